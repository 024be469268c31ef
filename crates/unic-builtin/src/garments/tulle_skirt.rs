//! A tulle skirt of four gathered layers.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Grid, GridShape, PatternVertex, Sewing, Wrap, check_range,
    trunk_surface::TrunkSurface, vertex_budget::with_vertices,
};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use unic_core::character::Character;

/// Number of layers; layer 0 is the innermost.
const LAYERS: usize = 4;

/// Number of gathers around the waist. It is the same for all layers, so that they nest.
const GATHERS: f32 = 26.0;

/// Vertical distance between the tops of neighbouring layers, metres; inner layers begin lower.
const STAGGER_M: f32 = 0.022;

/// Vertical distance between the hems of neighbouring layers, metres; inner layers are longer.
const TIER_M: f32 = 0.018;

/// Distance of the waistband from the body, metres.
const BAND_LEVEL_M: f32 = 0.006;

/// Height of the waistband, metres.
const BAND_M: f32 = 0.035;

/// Distance between the band's edge and the top row of the outermost layer, metres.
const SEAM_M: f32 = 0.008;

/// Depth below a layer's top at which its gathers reach their full height, metres.
const GATHER_DEPTH_M: f32 = 0.04;

/// Number of segments by which the length of a row is measured: 60 for each gather.
const FINE: usize = 1560;

/// A waistband and four layers of gathered tulle, fuller and wider from the inside out.
///
/// The outermost layer is sewn to the band. The other layers are separate pieces whose top rows are
/// attached.
///
/// Parts: `waistband`, `layer_1` (innermost) to `layer_4`. Attachments: `waistband`, `layer_tops`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TulleSkirt {
    /// Wanted number of vertices, 4,000 to 400,000; the result is within one percent.
    pub vertices: usize,
    /// Vertical distance from the waistband's lower edge to the innermost layer's hem, metres, 0.15
    /// to 0.9.
    pub length_m: f32,
    /// Horizontal run of the outermost layer for each metre down, 0.3 to 0.8.
    pub flare: f32,
    /// Amplitude of a gather's wave as a share of its width, 0 to 0.22: 0 is flat, 0.2 takes a
    /// third more cloth.
    pub gather: f32,
}

impl Default for TulleSkirt {
    fn default() -> Self {
        Self {
            vertices: 59_000,
            length_m: 0.48,
            flare: 0.36,
            gather: 0.2,
        }
    }
}

impl TulleSkirt {
    /// Makes the skirt for a character, in its bind-pose space.
    ///
    /// # Errors
    /// [`GarmentError::Parameter`] for a parameter out of range; other errors for a character that
    /// is not of SMPL's kind or has no trunk at the heights of the skirt.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let band_bottom = measures.waist - 0.5 * BAND_M;
        let hem = (band_bottom - self.length_m).max(measures.floor + 0.02);
        let heights = hem - 0.02..measures.waist + BAND_M;
        let trunk = TrunkSurface::new(&body, heights, measures.waist, f32::MAX)?;
        // The default skirt has about 4.5 m² of cloth, in triangles of half a squared edge.
        with_vertices(self.vertices, (4.5 / self.vertices as f32).sqrt(), |edge| {
            let layout = TulleLayout {
                skirt: self,
                trunk: &trunk,
                band_bottom,
                length: band_bottom - hem,
                edge,
            };
            layout.sewn()
        })
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("length_m", self.length_m, 0.15..=0.9, "0.15 to 0.9 metres")?;
        check_range("flare", self.flare, 0.3..=0.8, "0.3 to 0.8")?;
        check_range("gather", self.gather, 0.0..=0.22, "0 to 0.22")?;
        let vertices = self.vertices as f32;
        check_range("vertices", vertices, 4_000.0..=400_000.0, "4,000 to 400,000")
    }
}

/// Measures of a tulle skirt on one body.
struct TulleLayout<'a> {
    skirt: &'a TulleSkirt,
    trunk: &'a TrunkSurface,
    /// Height of the band's lower edge (world y), metres.
    band_bottom: f32,
    /// Vertical distance from there to the innermost layer's hem, metres.
    length: f32,
    /// Edge length to mesh with, metres.
    edge: f32,
}

impl TulleLayout<'_> {
    /// Adds all parts and sews the outermost layer to the band.
    fn sewn(&self) -> Result<GarmentMesh, GarmentError> {
        let mut sewing = Sewing::default();
        let waistband = sewing.part("waistband", Fabric::Cotton);
        let band = self.band(&mut sewing, waistband);
        let mut tops = Vec::new();
        for layer in 0..LAYERS {
            let top = self.layer(&mut sewing, layer);
            // The last vertex of a closed row is the first again.
            tops.extend(top[1..].iter().map(|v| v.vertex));
            if layer + 1 == LAYERS {
                sewing.strip(&top, &self.band_edge(band));
            }
        }
        let held: Vec<u32> = (0..=band.shape().rows).flat_map(|j| band.row(j)).collect();
        sewing.attach("waistband", &held);
        sewing.attach("layer_tops", &tops);
        sewing.finish()
    }

    fn band(&self, sewing: &mut Sewing, part: u32) -> Grid {
        let girth = self.trunk.circumference(self.band_bottom, BAND_LEVEL_M);
        let shape = GridShape {
            columns: even(girth / self.edge),
            rows: (BAND_M / self.edge).round().max(2.0) as usize,
            wrap: Wrap::Closed,
        };
        let place = |u: f32, v: f32| {
            let height = self.band_bottom + v * BAND_M;
            self.trunk.surface_point(height, u).raised_by(BAND_LEVEL_M)
        };
        sewing.grid(part, shape, place, |u, v| Vec2::new(u * girth, v * BAND_M))
    }

    /// Lower edge of the band, with the pattern coordinates of the outermost layer's seam
    /// allowance.
    fn band_edge(&self, band: Grid) -> Vec<PatternVertex> {
        let columns = band.shape().columns;
        let top = self.top_radius(LAYERS - 1) - SEAM_M;
        let angle = self.sector(LAYERS - 1);
        let flat = |i: usize| origin(LAYERS - 1) + Vec2::from_angle(angle * i as f32 / columns as f32) * top;
        let vertex = |i: usize| PatternVertex {
            vertex: band.at(i, 0),
            pattern: flat(i),
        };
        (0..=columns).map(vertex).collect()
    }

    /// Adds one layer from the hem up and returns its top row, which ends with its first vertex.
    fn layer(&self, sewing: &mut Sewing, layer: usize) -> Vec<PatternVertex> {
        let part = sewing.part(&format!("layer_{}", layer + 1), Fabric::Tulle);
        let (full, slant) = (self.depth(layer), self.slant(layer));
        let rows = (slant / self.edge).round().max(4.0) as usize;
        let (angle, inner) = (self.sector(layer), self.top_radius(layer));
        let mut below: Vec<PatternVertex> = Vec::new();
        for row in 0..=rows {
            let rise = row as f32 / rows as f32;
            let places = self.even_row(layer, full * (1.0 - rise));
            let radius = inner + slant * (1.0 - rise);
            // The pattern is a sector of a ring: u turns counter-clockwise about its centre, and v
            // points to the centre.
            let flat = |i: usize| Vec2::from_angle(angle * i as f32 / places.len() as f32) * radius;
            let mut above: Vec<PatternVertex> = (places.iter().enumerate())
                .map(|(i, place)| PatternVertex {
                    vertex: sewing.vertex(part, *place),
                    pattern: origin(layer) + flat(i),
                })
                .collect();
            above.push(PatternVertex {
                vertex: above[0].vertex,
                pattern: origin(layer) + flat(places.len()),
            });
            if row > 0 {
                sewing.strip(&below, &above);
            }
            below = above;
        }
        below
    }

    /// Positions of the vertices of one row at a depth below the layer's top, metres: evenly along
    /// the cloth, with enough of them on each gather.
    fn even_row(&self, layer: usize, depth: f32) -> Vec<Vec3> {
        let fine = self.fine_row(layer, depth);
        let mut along = vec![0.0];
        for pair in fine.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        let columns = even((along[FINE] / self.edge).max(GATHERS * self.least_on_gather()));
        let at = |i: usize| {
            let s = along[FINE] * i as f32 / columns as f32;
            let next = along.partition_point(|a| *a <= s).clamp(1, FINE);
            let t = (s - along[next - 1]) / (along[next] - along[next - 1]).max(1e-9);
            fine[next - 1].lerp(fine[next], t)
        };
        (0..columns).map(at).collect()
    }

    /// Least number of squares on a gather: fewer would not represent its wave. Coarse meshes take
    /// fewer.
    fn least_on_gather(&self) -> f32 {
        (0.06 / self.edge).min(7.0)
    }

    /// Closely spaced points of one row, the last at the first.
    fn fine_row(&self, layer: usize, depth: f32) -> Vec<Vec3> {
        let point = |i: usize| self.point(layer, i as f32 / FINE as f32, depth);
        (0..=FINE).map(point).collect()
    }

    /// Point of a layer at the share u of the circumference and a depth below the layer's top,
    /// metres.
    ///
    /// All layers displace the same convex outlines along their normals. Displacements grow from
    /// layer to layer, so that layers do not cross.
    fn point(&self, layer: usize, u: f32, depth: f32) -> Vec3 {
        let height = self.band_bottom - SEAM_M - self.begin(layer) - depth;
        let run = self.skirt.flare * (1.0 - 0.1 * (LAYERS - 1 - layer) as f32) * depth;
        let girth = self.trunk.circumference(height, BAND_LEVEL_M + run);
        let fullness = 1.0 + 0.08 * (layer as f32 - 1.0);
        let growth = 0.6 + 0.4 * (depth / GATHER_DEPTH_M).min(1.0);
        let amplitude = growth * self.skirt.gather * fullness * girth / GATHERS;
        // The wave is at least −1.25: the displacement is never below the band's.
        let level = BAND_LEVEL_M + run + amplitude * (1.25 + wave(u, depth));
        self.trunk.surface_point(height, u).raised_by(level)
    }

    /// Vertical distance from the outermost layer's top down to a layer's top, metres.
    fn begin(&self, layer: usize) -> f32 {
        STAGGER_M * (LAYERS - 1 - layer) as f32
    }

    /// Vertical distance from a layer's top to its hem, metres.
    fn depth(&self, layer: usize) -> f32 {
        self.length - TIER_M * layer as f32 - self.begin(layer) - SEAM_M
    }

    /// Length of the cloth around a layer at a depth below its top, metres.
    fn width(&self, layer: usize, depth: f32) -> f32 {
        let row = self.fine_row(layer, depth);
        row.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }

    /// Length of the cloth of a layer from top to hem, on the left side of the body, metres.
    fn slant(&self, layer: usize) -> f32 {
        let full = self.depth(layer);
        let at = |i: usize| self.point(layer, 0.25, full * i as f32 / 32.0);
        (0..32).map(|i| at(i).distance(at(i + 1))).sum()
    }

    /// Angle of the ring sector that is the pattern of a layer, radians.
    fn sector(&self, layer: usize) -> f32 {
        let full = self.depth(layer);
        // Outer arc minus inner arc over the difference of their radii.
        (self.width(layer, full) - self.width(layer, 0.0)) / self.slant(layer)
    }

    /// Inner radius of the ring sector that is the pattern of a layer, metres.
    fn top_radius(&self, layer: usize) -> f32 {
        self.width(layer, 0.0) / self.sector(layer)
    }
}

/// Wave of the gathers, between −1.25 and 1.25.
///
/// Neighbouring gathers differ in height, and their phase changes with the depth.
fn wave(u: f32, depth: f32) -> f32 {
    let phase = TAU * u;
    let wander = 0.5 * (3.0 * phase + 4.0 * depth).sin() + 0.3 * (7.0 * phase).cos();
    let strength = 1.0 + 0.15 * (5.0 * phase + 1.0).cos() + 0.1 * (8.0 * phase).sin();
    strength * (GATHERS * phase + wander).cos()
}

/// Origin of a layer's pattern, beside the patterns of the other layers, metres.
fn origin(layer: usize) -> Vec2 {
    Vec2::new(3.0 * (layer + 1) as f32, -2.0)
}

/// Nearest even number, at least 8.
fn even(count: f32) -> usize {
    2 * (0.5 * count).round().max(4.0) as usize
}
