//! A flared skirt.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Measurements, Ring, Sewing, check_range, flatten::pattern,
};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use unic_core::character::Character;

/// A skirt that fits the waist and widens to the hem, where it falls into folds.
///
/// Triangles have the same size at the waist and at the hem. The pattern consists of gores, which
/// are flattened one by one.
///
/// Parts: `waistband`, `skirt`. Attachments: `waistband`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlaredSkirt {
    /// Vertical distance from the waistband's lower edge to the hem, metres, 0.2 to 0.9.
    pub length_m: f32,
    /// Horizontal run for each metre down, 0 to 1.5.
    pub flare: f32,
    /// Distance of the waistband from the body, metres, 0.002 to 0.03.
    pub ease_m: f32,
    /// Length of edges, metres, 0.008 to 0.05.
    pub edge_m: f32,
}

impl Default for FlaredSkirt {
    fn default() -> Self {
        Self {
            length_m: 0.52,
            flare: 0.52,
            ease_m: 0.006,
            edge_m: 0.0175,
        }
    }
}

/// Height of the waistband, metres.
const BAND_M: f32 = 0.03;

/// Distance below the waistband over which the flare sets in, metres.
const YOKE_M: f32 = 0.10;

/// Distance of the cloth from the hips, metres.
const HIP_EASE_M: f32 = 0.012;

/// Vertical distance between the outlines that are computed, metres.
const OUTLINE_STEP_M: f32 = 0.005;

/// Number of gores of the pattern.
const GORES: f32 = 8.0;

/// Outline of the cloth at one height.
struct HeightOutline {
    /// Distance below the waistband's lower edge, metres; negative in the band.
    down: f32,
    ring: Ring,
}

/// One row of vertices around the body.
struct VertexRow {
    /// First vertex.
    first: u32,
    /// Number of vertices; even.
    count: usize,
    /// Share of a vertex's width by which the row is turned: rows are staggered.
    phase: f32,
}

/// Corner of a triangle between two rows.
#[derive(Clone, Copy)]
struct RowCorner {
    /// 0 for the lower row, 1 for the upper one.
    row: usize,
    /// Number of the vertex in the row; the number of vertices means the first one again.
    number: usize,
}

impl FlaredSkirt {
    /// Makes the skirt for a character, in its bind-pose space.
    ///
    /// # Errors
    /// [`GarmentError::Parameter`] for a parameter out of range; other errors for a character that
    /// is not of SMPL's kind.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let mut sewing = Sewing::default();
        let parts = [
            sewing.part("waistband", Fabric::Cotton),
            sewing.part("skirt", Fabric::Cotton),
        ];
        let outlines = self.outlines(&body, &measures)?;
        let rows = self.rows(&mut sewing, &outlines, parts);
        let mut gores = Vec::new();
        for pair in rows.windows(2) {
            sew_rows(&mut sewing, [&pair[0], &pair[1]], &mut gores);
        }
        let band = sewing.vertices_of(parts[0]);
        sewing.attach("waistband", &band);
        let mut garment = sewing.finish()?;
        let mesh = &mut garment.mesh;
        mesh.uvs = Some(pattern(&mesh.vertices, &mesh.faces, &gores, |gore| {
            // u along the tangent in the middle of the gore.
            let (sin, cos) = (TAU * (f32::from(gore) + 0.5) / GORES).sin_cos();
            [Vec3::new(cos, 0.0, -sin), Vec3::Y]
        }));
        Ok(garment)
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("length_m", self.length_m, 0.2..=0.9, "0.2 to 0.9 m")?;
        check_range("flare", self.flare, 0.0..=1.5, "0 to 1.5")?;
        check_range("ease_m", self.ease_m, 0.002..=0.03, "0.002 to 0.03 m")?;
        check_range("edge_m", self.edge_m, 0.008..=0.05, "0.008 to 0.05 m")
    }

    /// Closely spaced outlines of the cloth from the waistband's upper edge downward.
    fn outlines(
        &self,
        body: &BodyShape,
        measures: &Measurements,
    ) -> Result<Vec<HeightOutline>, GarmentError> {
        let band_bottom = measures.waist - 0.5 * BAND_M;
        let length = self.length_m.min(band_bottom - measures.floor - 0.02);
        let count = ((length + BAND_M) / OUTLINE_STEP_M).ceil() as usize;
        let mut outlines = Vec::with_capacity(count + 1);
        let mut above: Option<Ring> = None;
        for i in 0..=count {
            let down = (length + BAND_M) * i as f32 / count as f32 - BAND_M;
            // Cloth falls straight down from the widest place above: outlines never shrink.
            let bare = body.trunk_ring(band_bottom - down)?;
            let enclosing = above.map_or(bare.clone(), |above| bare.around_both(&above));
            let share = (down / YOKE_M).clamp(0.0, 1.0);
            // Within the yoke the slope grows from zero to the flare; below, it is the flare.
            let flared = self.flare * (down.max(0.0) - 0.5 * YOKE_M * share * (2.0 - share));
            let ease = self.ease_m + (HIP_EASE_M - self.ease_m).max(0.0) * share;
            let ring = enclosing.offset(ease + flared.max(0.0));
            outlines.push(HeightOutline { down, ring });
            above = Some(enclosing);
        }
        Ok(outlines)
    }

    /// Adds the vertices from the hem up to the waist, in rows an equilateral triangle's height
    /// apart.
    ///
    /// `parts` are the waistband and the skirt.
    fn rows(&self, sewing: &mut Sewing, outlines: &[HeightOutline], parts: [u32; 2]) -> Vec<VertexRow> {
        let [band, skirt] = parts;
        // Length of the cloth from the hem up to each outline.
        let mut up = vec![0.0; outlines.len()];
        for i in (0..outlines.len() - 1).rev() {
            up[i] = up[i + 1] + slant(&outlines[i + 1].ring, &outlines[i].ring);
        }
        // 0.866 is the height of an equilateral triangle over its side.
        let count = (up[0] / (self.edge_m * 0.866)).round().max(2.0) as usize;
        let mut rows = Vec::with_capacity(count + 1);
        for j in 0..=count {
            let at = up[0] * j as f32 / count as f32;
            let next = up.partition_point(|u| *u > at).clamp(1, up.len() - 1);
            let t = ((up[next - 1] - at) / (up[next - 1] - up[next]).max(1e-6)).clamp(0.0, 1.0);
            let (upper, lower) = (&outlines[next - 1], &outlines[next]);
            let ring = upper.ring.blended(&lower.ring, t);
            let down = upper.down + (lower.down - upper.down) * t;
            let part = if down < 0.5 * self.edge_m { band } else { skirt };
            let vertices = 2 * (0.5 * ring.circumference() / self.edge_m).round().max(4.0) as usize;
            let phase = 0.5 * (j % 2) as f32;
            let place = |i: usize| ring.point((i as f32 + phase) / vertices as f32);
            let indices: Vec<u32> = (0..vertices).map(|i| sewing.vertex(part, place(i))).collect();
            rows.push(VertexRow {
                first: indices[0],
                count: vertices,
                phase,
            });
        }
        rows
    }
}

/// Mean distance between two outlines, metres.
fn slant(lower: &Ring, upper: &Ring) -> f32 {
    let angle = |k: usize| k as f32 * TAU / 16.0;
    let distance = |k: usize| {
        lower
            .point_at_angle(angle(k))
            .distance(upper.point_at_angle(angle(k)))
    };
    (0..16).map(distance).sum::<f32>() / 16.0
}

impl VertexRow {
    /// Position of a vertex as a share of the circumference.
    fn share(&self, number: usize) -> f32 {
        (number as f32 + self.phase) / self.count as f32
    }

    fn vertex(&self, number: usize) -> u32 {
        self.first + (number % self.count) as u32
    }
}

/// Adds the triangles between a row and the next above it, and the gore of each triangle.
fn sew_rows(sewing: &mut Sewing, rows: [&VertexRow; 2], gores: &mut Vec<u8>) {
    let (mut i, mut j) = (0, 0);
    while i < rows[0].count || j < rows[1].count {
        // The shorter of the two diagonals, measured around the body.
        let lower_goes = j == rows[1].count
            || (i < rows[0].count
                && (rows[0].share(i + 1) - rows[1].share(j)).abs()
                    <= (rows[1].share(j + 1) - rows[0].share(i)).abs());
        let corner = |row: usize, number: usize| RowCorner { row, number };
        let next = if lower_goes {
            corner(0, i + 1)
        } else {
            corner(1, j + 1)
        };
        let corners = [corner(0, i), next, corner(1, j)];
        let middle = corners.iter().map(|c| rows[c.row].share(c.number)).sum::<f32>() / 3.0;
        gores.push((middle * GORES).min(GORES - 1.0) as u8);
        // Pattern coordinates are computed from the finished mesh.
        sewing.face(corners.map(|c| rows[c.row].vertex(c.number)), [Vec2::ZERO; 3]);
        i += usize::from(lower_goes);
        j += usize::from(!lower_goes);
    }
}
