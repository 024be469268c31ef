//! A wide-sleeved robe with overlapping fronts, a collar band and a sash.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, PatternVertex, Sewing, Side, check_range,
    shoulder_surface::ShoulderSurface, trunk_surface::TrunkSurface, vertex_budget::with_vertices,
};
use glam::{Vec2, Vec3};
use unic_core::{character::Character, surface::Surface};

mod collar;
mod sash;
mod sleeve;
mod torso;

/// Distance of back, right front and sleeves from the body, metres.
const LEVEL_M: f32 = 0.012;

/// Neck joint in SMPL's order.
const NECK: usize = 12;

/// Head joint in SMPL's order.
const HEAD: usize = 15;

/// Distance below the armholes from which upward the robe is straight, metres.
const STRAIGHT_M: f32 = 0.06;

/// Distance between the neck's side and the collar's seam, metres.
const NECK_EASE_M: f32 = 0.02;

/// Distance between layers that lie on one another, metres: the left front over the right one, the
/// sash over both, the ties over the sash.
const LAYER_GAP_M: f32 = 0.007;

/// A robe in the cut of a kimono or hanfu.
///
/// Back and fronts run over the shoulders without a shoulder seam. The left front lies over the
/// right one, and a collar band follows both edges. The sleeves widen towards the wrist. A sash
/// around the waist carries two ties that fall over it.
///
/// Parts: `front_left`, `back`, `front_right`, `sleeve_left`, `sleeve_right` and `collar`; `sash`,
/// `tie_left` and `tie_right` form a separate piece. Attachments: `sash`, and `waist`, the row of
/// the robe under it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robe {
    /// Wanted number of vertices, 8,000 to 400,000; the result is within one percent.
    pub vertices: usize,
    /// Height of the hem above the floor, metres, 0.02 to 0.9.
    pub hem_m: f32,
    /// Horizontal run of the skirt for each metre down, 0 to 0.5.
    pub flare: f32,
    /// Width of each front beyond the midplane without the collar, metres, 0.04 to 0.12.
    pub overlap_m: f32,
    /// Depth of the sleeve below the arm at the wrist, metres, 0.1 to 0.5.
    pub sleeve_m: f32,
    /// Width of the collar band, metres, 0.02 to 0.06.
    pub collar_m: f32,
    /// Width of the sash, metres, 0.04 to 0.2.
    pub sash_m: f32,
    /// Length of a tie below the sash, metres, 0.1 to 0.8.
    pub tie_m: f32,
}

impl Default for Robe {
    fn default() -> Self {
        Self {
            vertices: 62_000,
            hem_m: 0.16,
            flare: 0.12,
            overlap_m: 0.09,
            sleeve_m: 0.3,
            collar_m: 0.045,
            sash_m: 0.1,
            tie_m: 0.5,
        }
    }
}

impl Robe {
    /// Makes the robe for a character, in its bind-pose space.
    ///
    /// # Errors
    /// [`GarmentError::Parameter`] for a parameter out of range; other errors for a character that
    /// is not of SMPL's kind or has no trunk or arms at the places of the robe.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let hem = (measures.floor + self.hem_m).min(measures.crotch);
        // The armholes are deep, so that the sleeves do not touch the armpits.
        let underarm = measures.waist + 0.42 * (measures.shoulder - measures.waist);
        let trunk = TrunkSurface::new(
            &body,
            hem - 0.02..underarm + 0.1,
            measures.waist,
            underarm - STRAIGHT_M,
        )?;
        let neck_half_m = neck_half_width(character) + NECK_EASE_M;
        let ridge_half_m = neck_half_m - 0.6 * NECK_EASE_M;
        let shoulders = ShoulderSurface::new(character, &trunk, underarm, LEVEL_M, ridge_half_m);
        let skin = Surface::build(&character.body);
        // The default robe has about 2.9 m² of cloth.
        with_vertices(self.vertices, (2.9 / self.vertices as f32).sqrt(), |edge| {
            let layout = RobeLayout {
                design: self,
                body: &body,
                skin: &skin,
                trunk: &trunk,
                shoulders: &shoulders,
                hem,
                waist: measures.waist,
                underarm,
                neck_half_m,
                edge,
            };
            layout.sewn()
        })
    }

    fn check(&self) -> Result<(), GarmentError> {
        check_range("hem_m", self.hem_m, 0.02..=0.9, "0.02 to 0.9 metres")?;
        check_range("flare", self.flare, 0.0..=0.5, "0 to 0.5")?;
        check_range("overlap_m", self.overlap_m, 0.04..=0.12, "0.04 to 0.12 metres")?;
        check_range("sleeve_m", self.sleeve_m, 0.1..=0.5, "0.1 to 0.5 metres")?;
        check_range("collar_m", self.collar_m, 0.02..=0.06, "0.02 to 0.06 metres")?;
        check_range("sash_m", self.sash_m, 0.04..=0.2, "0.04 to 0.2 metres")?;
        check_range("tie_m", self.tie_m, 0.1..=0.8, "0.1 to 0.8 metres")?;
        let vertices = self.vertices as f32;
        check_range("vertices", vertices, 8_000.0..=400_000.0, "8,000 to 400,000")
    }
}

/// Surfaces and measures of a robe on one body. Heights are world y in metres.
struct RobeLayout<'a> {
    design: &'a Robe,
    body: &'a BodyShape<'a>,
    skin: &'a Surface,
    trunk: &'a TrunkSurface,
    shoulders: &'a ShoulderSurface,
    hem: f32,
    waist: f32,
    /// Height of the lower ends of the armholes.
    underarm: f32,
    /// Distance from the midplane to the collar's seam on the shoulder, metres.
    neck_half_m: f32,
    /// Edge length to mesh with, metres.
    edge: f32,
}

impl RobeLayout<'_> {
    /// Adds all parts, each sewn to those before it.
    fn sewn(&self) -> Result<GarmentMesh, GarmentError> {
        let mut sewing = Sewing::default();
        let torso = self.torso(&mut sewing);
        let sleeves = [("sleeve_left", Side::Left), ("sleeve_right", Side::Right)];
        for ((name, side), armhole) in sleeves.into_iter().zip(&torso.armholes) {
            let part = sewing.part(name, Fabric::Silk);
            self.sleeve(&mut sewing, part, side, armhole)?;
        }
        self.collar(&mut sewing, &torso);
        self.sash(&mut sewing)?;
        sewing.attach("waist", &torso.waist);
        sewing.finish()
    }

    /// Distance of the robe's inner layer from the trunk surface at a height, metres.
    fn level(&self, height: f32) -> f32 {
        LEVEL_M + self.design.flare * (self.waist - height).max(0.0)
    }

    /// Number of squares along a length in metres, at least 2.
    fn squares(&self, length: f32) -> usize {
        (length / self.edge).round().max(2.0) as usize
    }
}

/// Half the width of the neck at the height of a collar, metres.
fn neck_half_width(character: &Character) -> f32 {
    // On a body with unusual weights, the limits 4 and 9 cm keep the collar near a neck's size.
    let base = character.skeleton.joints()[NECK].y;
    let is_neck = |(v, p): &(usize, &Vec3)| {
        let leading = character.weights.row(*v).next().map_or(0, |(j, _)| j);
        [NECK, HEAD].contains(&leading) && (base..base + 0.05).contains(&p.y)
    };
    let vertices = character.body.vertices.iter().enumerate();
    let widths = vertices.filter(is_neck).map(|(_, p)| p.x.abs());
    widths.fold(0.04, f32::max).min(0.09)
}

/// Adds a strip of triangles between two rows of vertices in the same direction.
///
/// In contrast to [`Sewing::strip`], of two possible diagonals the shorter one is taken. `second`
/// lies on the side to which v grows.
fn strip(sewing: &mut Sewing, first: &[PatternVertex], second: &[PatternVertex]) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < first.len() || j + 1 < second.len() {
        let position = |v: PatternVertex| sewing.position(v.vertex);
        let between = |a: PatternVertex, b: PatternVertex| position(a).distance(position(b));
        let first_goes = match (first.get(i + 1), second.get(j + 1)) {
            (Some(&a), Some(&b)) => between(a, second[j]) <= between(first[i], b),
            (next, _) => next.is_some(),
        };
        let (a, b) = (first[i], second[j]);
        let c = if first_goes { first[i + 1] } else { second[j + 1] };
        sewing.face([a.vertex, c.vertex, b.vertex], [a.pattern, c.pattern, b.pattern]);
        i += usize::from(first_goes);
        j += usize::from(!first_goes);
    }
}

/// Row of vertices laid out straight along the pattern's x axis.
///
/// The point at the share `anchor` of the row's length lies at `origin`, metres.
fn laid_flat(sewing: &Sewing, vertices: &[u32], anchor: f32, origin: Vec2) -> Vec<PatternVertex> {
    let mut along = vec![0.0];
    for pair in vertices.windows(2) {
        let step = sewing.position(pair[0]).distance(sewing.position(pair[1]));
        along.push(along[along.len() - 1] + step);
    }
    let length = along[along.len() - 1];
    let flat = |(&vertex, s): (&u32, f32)| PatternVertex {
        vertex,
        pattern: origin + Vec2::X * (s - anchor * length),
    };
    vertices.iter().zip(along).map(flat).collect()
}

/// Cubic smooth step from 0 at t ≤ 0 to 1 at t ≥ 1.
fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
