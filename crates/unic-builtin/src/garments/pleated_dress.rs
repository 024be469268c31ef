//! A sleeveless dress with a knife-pleated skirt.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Grid, GridShape, Measurements, Sewing, Wrap, check_range,
    shoulder_surface::ShoulderSurface, trunk_surface::TrunkSurface,
};
use glam::Vec2;
use unic_core::character::Character;

mod pleat;
use pleat::{Pleat, PleatColumns};

/// Distance of the skirt's outer face from the body at the waist, metres: room for the folds below.
const FACE_LEVEL_M: f32 = 0.014;

/// Distance between neighbouring layers of a pleat at the waist, metres.
const WAIST_GAP_M: f32 = 0.004;

/// Distance between neighbouring layers of a pleat at the hem, metres.
const HEM_GAP_M: f32 = 0.006;

/// x of a strap's middle as a share of the bodice's half width.
const STRAP_MIDDLE: f32 = 0.56;

/// A fitted bodice on two straps with a skirt of knife pleats.
///
/// At the waist three layers of a pleat lie on one another; towards the hem the pleats open. The
/// folds belong to the rest shape, so that bending forces with rest angles keep them.
///
/// Only the visible faces of the pleats are sewn to the bodice. The fold behind each of them is
/// free at the waist and leaves an opening there.
///
/// Parts: `bodice`, `strap_left`, `strap_right`, `skirt`. Attachments: `waist`, the upper edge of
/// the pleats, and `chest`, the upper edge of the bodice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PleatedDress {
    /// Wanted number of vertices, 6,000 to 400,000; the result is within one percent.
    pub vertices: usize,
    /// Number of pleats, 12 to 60.
    pub pleats: usize,
    /// Vertical distance from the waist to the hem, metres, 0.2 to 1.1.
    pub skirt_m: f32,
    /// Horizontal run of the skirt for each metre down, 0 to 0.6.
    pub flare: f32,
    /// Distance of the bodice from the body, metres, 0.003 to 0.03.
    pub ease_m: f32,
    /// Width of a strap, metres, 0.015 to 0.08.
    pub strap_m: f32,
}

impl Default for PleatedDress {
    fn default() -> Self {
        Self {
            vertices: 35_000,
            pleats: 28,
            skirt_m: 0.56,
            flare: 0.14,
            ease_m: 0.008,
            strap_m: 0.045,
        }
    }
}

impl PleatedDress {
    /// Makes the dress for a character, in its bind-pose space.
    ///
    /// # Errors
    /// [`GarmentError::Parameter`] for a parameter out of range; other errors for a character that
    /// is not of SMPL's kind or has no trunk at the heights of the dress.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let hem = (measures.waist - self.skirt_m).max(measures.floor + 0.02);
        let top = bodice_top(&measures);
        let trunk = TrunkSurface::new(&body, hem - 0.02..top + 0.1, measures.waist, f32::MAX)?;
        let shoulders = ShoulderSurface::new(character, &trunk, top, self.ease_m, 0.0);
        DressLayout {
            dress: self,
            trunk: &trunk,
            shoulders: &shoulders,
            hem,
            waist: measures.waist,
            top,
        }
        .sewn()
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("skirt_m", self.skirt_m, 0.2..=1.1, "0.2 to 1.1 metres")?;
        check_range("flare", self.flare, 0.0..=0.6, "0 to 0.6")?;
        check_range("ease_m", self.ease_m, 0.003..=0.03, "0.003 to 0.03 metres")?;
        check_range("strap_m", self.strap_m, 0.015..=0.08, "0.015 to 0.08 metres")?;
        check_range("pleats", self.pleats as f32, 12.0..=60.0, "12 to 60")?;
        let vertices = self.vertices as f32;
        check_range("vertices", vertices, 6_000.0..=400_000.0, "6,000 to 400,000")
    }
}

/// Height of the bodice's upper edge: a hand's breadth under the shoulder joints, over the chest.
fn bodice_top(measures: &Measurements) -> f32 {
    measures.waist + 0.64 * (measures.shoulder - measures.waist)
}

/// Surfaces and heights of a dress on one body. Heights are world y in metres.
struct DressLayout<'a> {
    dress: &'a PleatedDress,
    trunk: &'a TrunkSurface,
    shoulders: &'a ShoulderSurface,
    hem: f32,
    waist: f32,
    /// Height of the bodice's upper edge.
    top: f32,
}

impl DressLayout<'_> {
    /// Adds all parts and sews them together.
    fn sewn(&self) -> Result<GarmentMesh, GarmentError> {
        // Bodice and straps come first; the rows of the skirt use up the remaining vertices.
        let edge = self.edge_length();
        let columns = PleatColumns::for_edge(&self.pleat(0.5), edge);
        let mut sewing = Sewing::default();
        let bodice_part = sewing.part("bodice", Fabric::Cotton);
        let bodice = self.bodice(&mut sewing, bodice_part, self.bodice_shape(columns, edge));
        let mut taken = bodice.shape().rows * bodice.shape().columns;
        for (name, sign) in [("strap_left", 1.0), ("strap_right", -1.0)] {
            let part = sewing.part(name, Fabric::Cotton);
            let strap = self.strap(&mut sewing, part, sign, bodice, edge)?;
            taken += (strap.rows - 1) * strap.row_len();
        }
        let skirt_part = sewing.part("skirt", Fabric::Cotton);
        let across = columns.total() * self.dress.pleats;
        let left = self.dress.vertices.saturating_sub(taken);
        let rows = (left as f32 / across as f32 - 1.0).round().max(4.0) as usize;
        let skirt = self.skirt(&mut sewing, skirt_part, columns, rows);
        let waist = skirt.row(rows);
        let visible = waist.iter().enumerate();
        let visible: Vec<u32> = visible
            .filter(|(i, _)| columns.is_visible(i % columns.total()))
            .map(|(_, v)| *v)
            .collect();
        sewing.sew(&visible, &bodice.row(0))?;
        sewing.attach("waist", &waist);
        sewing.attach("chest", &bodice.row(bodice.shape().rows));
        sewing.finish()
    }

    /// Edge length at which the wanted number of vertices covers the cloth, metres.
    fn edge_length(&self) -> f32 {
        let width = |v: f32| self.pleat(v).length() * self.dress.pleats as f32;
        let skirt = 0.5 * (width(0.0) + width(1.0)) * (self.waist - self.hem);
        let girth = self
            .trunk
            .circumference(0.5 * (self.waist + self.top), self.dress.ease_m);
        let straps = 4.0 * self.dress.strap_m * self.shoulders.front_length(self.strap_middle());
        let area = skirt + girth * (self.top - self.waist) + straps;
        // A grid of squares has about one vertex for each square.
        (area / self.dress.vertices as f32).sqrt()
    }

    /// Section of a pleat at the share v of the skirt's height, 0 at the hem and 1 at the waist.
    fn pleat(&self, v: f32) -> Pleat {
        let height = self.hem + v * (self.waist - self.hem);
        let girth = self.trunk.circumference(height, self.level(height));
        let gap = HEM_GAP_M + (WAIST_GAP_M - HEM_GAP_M) * v;
        let face = girth / self.dress.pleats as f32;
        // Three layers at the waist; the folds keep most of their depth where the faces widen.
        let waist_girth = self.trunk.circumference(self.waist, self.level(self.waist));
        let waist_face = waist_girth / self.dress.pleats as f32;
        Pleat {
            face,
            depth: (0.7 + 0.3 * (1.0 - v)) * waist_face,
            gap,
        }
    }

    /// Distance of the visible faces from the trunk surface at a height, metres.
    fn level(&self, height: f32) -> f32 {
        FACE_LEVEL_M + self.dress.flare * (self.waist - height)
    }

    fn skirt(&self, sewing: &mut Sewing, part: u32, columns: PleatColumns, rows: usize) -> Grid {
        let (pleats, across) = (self.dress.pleats, columns.total());
        let shape = GridShape {
            columns: pleats * across,
            rows,
            wrap: Wrap::Closed,
        };
        // The grid gives shares u; columns of pleats need whole numbers again.
        let locate = |u: f32| {
            let column = (u * shape.columns as f32).round() as usize;
            (column / across, column % across)
        };
        let place = |u: f32, v: f32| {
            let (number, column) = locate(u);
            let height = self.hem + v * (self.waist - self.hem);
            let pleat = self.pleat(v);
            let point = columns.point(&pleat, column);
            let level = self.level(height);
            let share = (number as f32 + point.x / pleat.face) / pleats as f32;
            let surface_point = self.trunk.point_on_offset(height, share, level);
            surface_point.raised_by(level + point.y)
        };
        let slants = self.slants(rows);
        let pattern = |u: f32, v: f32| {
            let (number, column) = locate(u);
            let pleat = self.pleat(v);
            let along = number as f32 * pleat.length() + columns.along(&pleat, column);
            // Rows are centred on one another: the pattern of a flared skirt widens on both sides.
            Vec2::new(
                along - 0.5 * pleat.length() * pleats as f32,
                slants[(v * rows as f32).round() as usize],
            )
        };
        sewing.grid(part, shape, place, pattern)
    }

    /// Length of the cloth from the waist down to each row, as a mean around the skirt, in metres.
    ///
    /// Lengths are negative and ordered by ascending height.
    fn slants(&self, rows: usize) -> Vec<f32> {
        let at = |row: usize, i: usize| {
            let height = self.hem + (self.waist - self.hem) * row as f32 / rows as f32;
            self.trunk
                .surface_point(height, i as f32 / 16.0)
                .raised_by(self.level(height))
        };
        let mut slants = vec![0.0; rows + 1];
        for row in (0..rows).rev() {
            let sum: f32 = (0..16).map(|i| at(row, i).distance(at(row + 1, i))).sum();
            slants[row] = slants[row + 1] - sum / 16.0;
        }
        slants
    }

    fn bodice_shape(&self, columns: PleatColumns, edge: f32) -> GridShape {
        GridShape {
            columns: columns.visible() * self.dress.pleats,
            rows: ((self.top - self.waist) / edge).round().max(4.0) as usize,
            wrap: Wrap::Closed,
        }
    }

    fn bodice(&self, sewing: &mut Sewing, part: u32, shape: GridShape) -> Grid {
        let columns = shape.columns as f32;
        let place = |u: f32, v: f32| {
            let height = self.waist + v * (self.top - self.waist);
            // At the waist the bodice is as far from the body as the faces of the skirt, and its
            // columns are shifted to meet those of the pleats.
            let seam = (1.0 - 4.0 * v).max(0.0).powi(2);
            let level = self.dress.ease_m + seam * (FACE_LEVEL_M - self.dress.ease_m);
            let share = u + seam * 1.2 / columns;
            self.trunk.point_on_offset(height, share, level).raised_by(level)
        };
        let girth = |v: f32| {
            let height = self.waist + v * (self.top - self.waist);
            self.trunk.circumference(height, self.dress.ease_m)
        };
        let pattern = |u: f32, v: f32| Vec2::new((u - 0.5) * girth(v), 0.1 + v * (self.top - self.waist));
        sewing.grid(part, shape, place, pattern)
    }

    /// Adds a strap from the bodice's front edge over the shoulder to its back edge.
    ///
    /// `sign` is 1 for the left strap and −1 for the right one.
    fn strap(
        &self,
        sewing: &mut Sewing,
        part: u32,
        sign: f32,
        bodice: Grid,
        edge: f32,
    ) -> Result<GridShape, GarmentError> {
        let spacing = self.trunk.circumference(self.top, self.dress.ease_m) / bodice.shape().columns as f32;
        let columns = even(self.dress.strap_m / spacing);
        let front = self.edge_columns(bodice, columns, 0.0, sign);
        let back = self.edge_columns(bodice, columns, 0.5, sign);
        let x = |vertex: u32, sewing: &Sewing| self.shoulders.across(sewing.position(vertex).x);
        // Coordinate across the shoulders of both ends of each column.
        let ends: Vec<[f32; 2]> = (front.iter().zip(&back))
            .map(|(f, b)| [x(*f, sewing), x(*b, sewing)])
            .collect();
        let length = 2.0 * self.shoulders.front_length(self.strap_middle());
        let shape = GridShape {
            columns,
            rows: (length / edge).round().max(4.0) as usize,
            wrap: Wrap::Open,
        };
        let place = |u: f32, v: f32| {
            let [a, b] = ends[(u * columns as f32).round() as usize];
            self.shoulders.position(a + (b - a) * smooth(v), v)
        };
        let width = self.dress.strap_m;
        let pattern = |u: f32, v: f32| Vec2::new(1.0 + 0.2 * sign + u * width, v * length);
        let strap = sewing.grid(part, shape, place, pattern);
        sewing.sew(&front, &strap.row(0))?;
        sewing.sew(&back, &strap.row(shape.rows))?;
        Ok(shape)
    }

    /// Coordinate across the shoulders of a strap's middle.
    fn strap_middle(&self) -> f32 {
        self.shoulders.across(STRAP_MIDDLE * self.shoulders.half_width())
    }

    /// Vertices of the bodice's upper edge under a strap, at the front (`middle` = 0) or at the
    /// back (`middle` = 0.5).
    ///
    /// They are in the order in which the strap's u grows: from the character's right to its left.
    fn edge_columns(&self, bodice: Grid, columns: usize, middle: f32, sign: f32) -> Vec<u32> {
        let shape = bodice.shape();
        let target = sign * STRAP_MIDDLE * self.shoulders.half_width();
        let x = |i: usize| {
            self.trunk
                .surface_point(self.top, i as f32 / shape.columns as f32)
                .position
                .x
        };
        // Candidates lie within a quarter turn from the middle, on the side of the strap.
        let quarter = shape.columns / 4;
        let start = (middle * shape.columns as f32).round() as usize;
        let direction: i64 = if (middle == 0.0) == (sign > 0.0) { 1 } else { -1 };
        let at = |k: usize| (start as i64 + direction * k as i64).rem_euclid(shape.columns as i64) as usize;
        let nearest =
            (0..quarter).min_by(|&i, &j| (x(at(i)) - target).abs().total_cmp(&(x(at(j)) - target).abs()));
        let nearest = nearest.unwrap_or(quarter / 2).max(columns / 2);
        let mut found: Vec<u32> = (0..=columns)
            .map(|k| bodice.at(at(nearest - columns / 2 + k), shape.rows))
            .collect();
        if sign < 0.0 {
            found.reverse();
        }
        found
    }
}

/// Nearest even number, at least 4.
fn even(count: f32) -> usize {
    2 * (0.5 * count).round().max(2.0) as usize
}

/// Cubic smooth step for t from 0 to 1.
fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}
