//! A tulle skirt of four gathered layers.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Grid, GridShape, Sewing, Wrap, check_range,
    trunk_surface::TrunkSurface, vertex_budget::with_vertices,
};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use unic_core::character::Character;

const LAYERS: usize = 4;

/// Gathers around the waist, common to all layers so that they nest.
const GATHERS: f32 = 26.0;

/// How much further down each layer under the outermost begins, metres.
const STAGGER_M: f32 = 0.022;

/// How much shorter each layer is than the one under it, metres.
const TIER_M: f32 = 0.018;

/// Distance of the waistband from the body, metres.
const BAND_LEVEL_M: f32 = 0.006;

/// Height of the waistband, metres.
const BAND_M: f32 = 0.035;

/// Depth below a layer's top at which its gathers reach their full height, metres.
const RAMP_M: f32 = 0.04;

/// Points at which a row is followed to find its length.
const FINE: usize = 1560;

/// A waistband and four layers of tulle, each gathered at its top, fuller and wider from the inside
/// out.
///
/// Parts: `waistband`, `layer_1` (innermost) to `layer_4`, which is sewn to the band; the others are
/// pieces of their own whose first row is held. Attachments: `waistband`, `layer_tops`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TulleSkirt {
    /// Vertices to aim for; the result is within one percent.
    pub vertices: usize,
    /// From the waistband's lower edge to the innermost layer's hem, straight down, metres.
    pub length_m: f32,
    /// Horizontal run of the outermost layer for each metre down, beyond the hips.
    pub flare: f32,
    /// Height of a gather's wave from its middle, as a share of its width: 0 lies flat, 0.2 takes up
    /// a third more cloth.
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
    /// The skirt on a character, in its bind-pose space.
    ///
    /// # Errors
    /// Parameters out of range, a character that is not SMPL's kind or has no trunk where the skirt
    /// is.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let band_bottom = measures.waist - 0.5 * BAND_M;
        let hem = (band_bottom - self.length_m).max(measures.floor + 0.02);
        let heights = hem - 0.02..measures.waist + BAND_M;
        let trunk = TrunkSurface::new(&body, heights, measures.waist, f32::MAX)?;
        with_vertices(self.vertices, (4.5 / self.vertices as f32).sqrt(), |edge| {
            let cut = Cut {
                skirt: self,
                trunk: &trunk,
                band_bottom,
                length: band_bottom - hem,
                edge,
            };
            cut.sewn()
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

/// A skirt laid out on one body.
struct Cut<'a> {
    skirt: &'a TulleSkirt,
    trunk: &'a TrunkSurface,
    band_bottom: f32,
    length: f32,
    /// Edge length to mesh with, metres.
    edge: f32,
}

impl Cut<'_> {
    fn sewn(&self) -> Result<GarmentMesh, GarmentError> {
        let mut sewing = Sewing::default();
        let waistband = sewing.part("waistband", Fabric::Cotton);
        let band = self.band(&mut sewing, waistband);
        let mut tops = Vec::new();
        for layer in 0..LAYERS {
            let top = self.layer(&mut sewing, layer);
            // The last vertex of a closed row is the first again.
            tops.extend(top[1..].iter().map(|(vertex, _)| *vertex));
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
            self.trunk.spot(height, u).at(BAND_LEVEL_M)
        };
        sewing.grid(part, shape, place, |u, v| Vec2::new(u * girth, v * BAND_M))
    }

    /// The band's lower edge with the pattern coordinates of the seam allowance below it.
    fn band_edge(&self, band: Grid) -> Vec<(u32, Vec2)> {
        let columns = band.shape().columns;
        let top = self.top_radius(LAYERS - 1) - self.seam();
        let angle = self.sector(LAYERS - 1);
        let at = |i: usize| origin(LAYERS - 1) + Vec2::from_angle(angle * i as f32 / columns as f32) * top;
        (0..=columns).map(|i| (band.at(i, 0), at(i))).collect()
    }

    /// One layer, from the hem up; its top row with pattern coordinates, the last being the first
    /// again.
    fn layer(&self, sewing: &mut Sewing, layer: usize) -> Vec<(u32, Vec2)> {
        let part = sewing.part(&format!("layer_{}", layer + 1), Fabric::Tulle);
        let (full, slant) = (self.depth(layer), self.slant(layer));
        let rows = (slant / self.edge).round().max(4.0) as usize;
        let (angle, inner) = (self.sector(layer), self.top_radius(layer));
        let mut below: Vec<(u32, Vec2)> = Vec::new();
        for row in 0..=rows {
            let rise = row as f32 / rows as f32;
            let places = self.even_row(layer, full * (1.0 - rise));
            let radius = inner + slant * (1.0 - rise);
            // A sector of a ring: u turns counter-clockwise about its centre, and v points to it.
            let flat = |i: usize| Vec2::from_angle(angle * i as f32 / places.len() as f32) * radius;
            let mut above: Vec<(u32, Vec2)> = (places.iter().enumerate())
                .map(|(i, place)| (sewing.vertex(part, *place), origin(layer) + flat(i)))
                .collect();
            above.push((above[0].0, origin(layer) + flat(places.len())));
            if row > 0 {
                sewing.strip(&below, &above);
            }
            below = above;
        }
        below
    }

    /// Vertices of one row: evenly along the cloth, with enough on each gather.
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

    /// Squares on a gather at least: fewer would not show its wave. Coarse meshes have fewer.
    fn least_on_gather(&self) -> f32 {
        (0.06 / self.edge).min(7.0)
    }

    fn fine_row(&self, layer: usize, depth: f32) -> Vec<Vec3> {
        let point = |i: usize| self.point(layer, i as f32 / FINE as f32, depth);
        (0..=FINE).map(point).collect()
    }

    /// A point of a layer: all layers are displacements of one convex outline along its normals, which
    /// grow from layer to layer, so that they cannot meet.
    fn point(&self, layer: usize, u: f32, depth: f32) -> Vec3 {
        let height = self.band_bottom - self.seam() - self.begin(layer) - depth;
        let run = self.skirt.flare * (1.0 - 0.1 * (LAYERS - 1 - layer) as f32) * depth;
        let girth = self.trunk.circumference(height, BAND_LEVEL_M + run);
        let fullness = 1.0 + 0.08 * (layer as f32 - 1.0);
        let ramp = 0.6 + 0.4 * (depth / RAMP_M).min(1.0);
        let amplitude = ramp * self.skirt.gather * fullness * girth / GATHERS;
        let level = BAND_LEVEL_M + run + amplitude * (1.25 + wave(u, depth));
        self.trunk.spot(height, u).at(level)
    }

    fn begin(&self, layer: usize) -> f32 {
        STAGGER_M * (LAYERS - 1 - layer) as f32
    }

    /// Distance between the band's edge and the gathered row under it.
    fn seam(&self) -> f32 {
        0.008
    }

    fn depth(&self, layer: usize) -> f32 {
        self.length - TIER_M * layer as f32 - self.begin(layer) - self.seam()
    }

    fn width(&self, layer: usize, depth: f32) -> f32 {
        let row = self.fine_row(layer, depth);
        row.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }

    /// Length of the cloth from top to hem.
    fn slant(&self, layer: usize) -> f32 {
        let full = self.depth(layer);
        let at = |i: usize| self.point(layer, 0.25, full * i as f32 / 32.0);
        (0..32).map(|i| at(i).distance(at(i + 1))).sum()
    }

    /// Angle of the ring sector that the layer is cut from, radians.
    fn sector(&self, layer: usize) -> f32 {
        let full = self.depth(layer);
        (self.width(layer, full) - self.width(layer, 0.0)) / self.slant(layer)
    }

    /// Inner radius of that sector, metres.
    fn top_radius(&self, layer: usize) -> f32 {
        self.width(layer, 0.0) / self.sector(layer)
    }
}

/// A gather's wave, between −1.25 and 1.25: neighbouring gathers differ and wander with depth.
fn wave(u: f32, depth: f32) -> f32 {
    let phase = TAU * u;
    let wander = 0.5 * (3.0 * phase + 4.0 * depth).sin() + 0.3 * (7.0 * phase).cos();
    let strength = 1.0 + 0.15 * (5.0 * phase + 1.0).cos() + 0.1 * (8.0 * phase).sin();
    strength * (GATHERS * phase + wander).cos()
}

/// Where the pattern of a layer lies: beside the others.
fn origin(layer: usize) -> Vec2 {
    Vec2::new(3.0 * (layer + 1) as f32, -2.0)
}

fn even(count: f32) -> usize {
    2 * (0.5 * count).round().max(4.0) as usize
}
