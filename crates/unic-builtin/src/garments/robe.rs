//! A wide-sleeved robe with overlapping fronts, a collar band and a sash.

use super::{
    BodyShape, Fabric, GarmentError, GarmentMesh, Sewing, Side, check_range,
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

/// The neck and head joints in SMPL's order.
const NECK: usize = 12;
const HEAD: usize = 15;

/// From this far below the armholes upward the robe falls straight, metres: it is loose over the waist.
const STRAIGHT_M: f32 = 0.06;

/// Between the neck's side and the collar's seam, metres.
const NECK_EASE_M: f32 = 0.02;

/// Distance between layers that lie on one another, metres: the left front over the right one, the
/// sash over both, the ties over the sash.
const LAYER_GAP_M: f32 = 0.007;

/// A row of vertices with their pattern coordinates, metres.
type Row = Vec<(u32, Vec2)>;

/// A robe in the cut of a kimono or hanfu: back and fronts run over the shoulders without a seam of
/// their own, the left front lies over the right one, a collar band follows both edges, the sleeves
/// widen towards the wrist, and a sash around the waist carries two ties that fall over it.
///
/// Parts: `front_left`, `back`, `front_right`, `sleeve_left`, `sleeve_right`, `collar`, and as a piece
/// of their own `sash`, `tie_left`, `tie_right`. Attachments: `sash`, and `waist`, the robe's row under
/// it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robe {
    /// Vertices to aim for; the result is within one percent.
    pub vertices: usize,
    /// Height of the hem above the floor, metres.
    pub hem_m: f32,
    /// Horizontal run of the skirt for each metre down, beyond the hips.
    pub flare: f32,
    /// How far each front reaches beyond the middle, the collar not counted, metres.
    pub overlap_m: f32,
    /// Depth of the sleeve below the arm at the wrist, metres.
    pub sleeve_m: f32,
    /// Width of the collar band, metres.
    pub collar_m: f32,
    /// Width of the sash, metres.
    pub sash_m: f32,
    /// Length of a tie below the sash, metres.
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
    /// The robe on a character, in its bind-pose space.
    ///
    /// # Errors
    /// Parameters out of range, a character that is not SMPL's kind or has no trunk or arms where the
    /// robe is.
    pub fn make(&self, character: &Character) -> Result<GarmentMesh, GarmentError> {
        self.check()?;
        let body = BodyShape::new(character)?;
        let measures = body.measurements()?;
        let hem = (measures.floor + self.hem_m).min(measures.crotch);
        // Deep armholes: the sleeve hangs free of the armpit.
        let underarm = measures.waist + 0.42 * (measures.shoulder - measures.waist);
        let trunk = TrunkSurface::new(
            &body,
            hem - 0.02..underarm + 0.1,
            measures.waist,
            underarm - STRAIGHT_M,
        )?;
        let neck_half_m = neck_half_width(character) + NECK_EASE_M;
        let shoulders = ShoulderSurface::new(
            character,
            &trunk,
            [underarm, LEVEL_M, neck_half_m - 0.6 * NECK_EASE_M],
        );
        let skin = Surface::build(&character.body);
        with_vertices(self.vertices, (2.9 / self.vertices as f32).sqrt(), |edge| {
            let cut = Cut {
                robe: self,
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
            cut.sewn()
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

/// A robe laid out on one body.
struct Cut<'a> {
    robe: &'a Robe,
    body: &'a BodyShape<'a>,
    skin: &'a Surface,
    trunk: &'a TrunkSurface,
    shoulders: &'a ShoulderSurface,
    hem: f32,
    waist: f32,
    /// Height at which the sleeves begin.
    underarm: f32,
    /// From the midplane to the collar on the shoulder, metres.
    neck_half_m: f32,
    /// Edge length to mesh with, metres.
    edge: f32,
}

impl Cut<'_> {
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
        LEVEL_M + self.robe.flare * (self.waist - height).max(0.0)
    }

    /// Squares along a length, metres.
    fn squares(&self, length: f32) -> usize {
        (length / self.edge).round().max(2.0) as usize
    }
}

/// Half the width of the neck where a collar stands, metres.
fn neck_half_width(character: &Character) -> f32 {
    let base = character.skeleton.joints()[NECK].y;
    let is_neck = |(v, p): &(usize, &Vec3)| {
        let leading = character.weights.row(*v).next().map_or(0, |(j, _)| j);
        [NECK, HEAD].contains(&leading) && (base..base + 0.05).contains(&p.y)
    };
    let vertices = character.body.vertices.iter().enumerate();
    let widths = vertices.filter(is_neck).map(|(_, p)| p.x.abs());
    widths.fold(0.04, f32::max).min(0.09)
}

/// A strip of triangles between two rows in the same direction, with the shorter diagonals; `second`
/// lies on the side to which v grows.
fn strip(sewing: &mut Sewing, first: &[(u32, Vec2)], second: &[(u32, Vec2)]) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < first.len() || j + 1 < second.len() {
        let between = |a: (u32, Vec2), b: (u32, Vec2)| sewing.position(a.0).distance(sewing.position(b.0));
        let first_goes = match (first.get(i + 1), second.get(j + 1)) {
            (Some(&a), Some(&b)) => between(a, second[j]) <= between(first[i], b),
            (next, _) => next.is_some(),
        };
        let (a, b) = (first[i], second[j]);
        let c = if first_goes { first[i + 1] } else { second[j + 1] };
        sewing.face([a.0, c.0, b.0], [a.1, c.1, b.1]);
        i += usize::from(first_goes);
        j += usize::from(!first_goes);
    }
}

/// A row of vertices laid flat: x runs along the row, zero at the share `anchor` of its length.
fn laid_flat(sewing: &Sewing, vertices: &[u32], anchor: f32, origin: Vec2) -> Row {
    let mut along = vec![0.0];
    for pair in vertices.windows(2) {
        let step = sewing.position(pair[0]).distance(sewing.position(pair[1]));
        along.push(along[along.len() - 1] + step);
    }
    let length = along[along.len() - 1];
    let at = |s: f32| origin + Vec2::X * (s - anchor * length);
    vertices.iter().zip(along).map(|(v, s)| (*v, at(s))).collect()
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
