//! Robust rule: pushes vertices out of the closest triangle that may push them, to a margin.

use super::{ContactFilter, keeps_layers_in_order};
use crate::{
    character::{Character, Garment},
    folds,
    surface::{FaceFilter, Feature, Surface, SurfacePoint},
};
use glam::Vec3;

mod fold_cache;
mod group;
mod retraction;
mod sinking;

use fold_cache::FoldCache;

/// Distance to an edge or vertex below which the surface's normal replaces the direction to it,
/// metres.
///
/// f32 resolves positions 100 m from the origin to 8 µm, so the direction of a shorter vector is
/// noise.
const MIN_DISTANCE_M: f32 = 1e-4;

/// Smallest cosine between the direction to the closest point and the normal there.
///
/// Below it the point lies beyond a rim, of the parts that may push or of an open body, and not
/// under the surface.
const MIN_RIM_COSINE: f32 = 0.3;

/// Largest number of further pushes after the first, and of rounds of sinking. In a crease a push
/// out of one side leads into the other.
const MAX_ITERATIONS: usize = 4;

/// Largest distance from its skin at which a point can be inside a limb, metres.
pub(super) const LIMB_RADIUS_M: f32 = 0.06;

/// Height below the margin at which a vertex is not pushed, metres: the rounding error of one that
/// has just been pushed to the margin.
const TOLERANCE_M: f32 = 1e-5;

/// Returns the next position of a vertex that is pushed from `at` to `out`.
///
/// It is `out`, but halfway in the last iteration. In a crease narrower than two margins pushes
/// alternate between the sides, and the middle of a gap is outside both.
fn next_position(iteration: usize, at: Vec3, out: Vec3) -> Vec3 {
    if iteration < MAX_ITERATIONS {
        out
    } else {
        at.midpoint(out)
    }
}

/// Posed body with what [`RobustIntersection`] needs of it. Scratch over a shared asset,
/// [`ContactFilter`].
#[derive(Clone, Debug)]
pub struct RobustBody {
    surface: Surface,
    // An asset, which clones share.
    contact_filter: std::sync::Arc<ContactFilter>,
    folds: FoldCache,
    /// Whether layers of the garment keep their order when they are pushed.
    keeps_layers_in_order: bool,
}

impl RobustBody {
    /// Prepares the body of a character for a garment, in the bind pose.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        let contact_filter = ContactFilter::new(character, garment);
        let mut surface = Surface::build(&character.body);
        surface.set_groups(|face| contact_filter.groups_of_body_face(face));
        let classes = contact_filter.garment_packets().class_count();
        Self {
            surface,
            folds: FoldCache::new(classes, character.body.vertices.len()),
            contact_filter: std::sync::Arc::new(contact_filter),
            keeps_layers_in_order: keeps_layers_in_order(&garment.rest, &character.body),
        }
    }

    /// Poses the body: world positions of its vertices, metres. Does not allocate.
    ///
    /// # Panics
    /// When the number of vertices differs from the body's.
    pub fn pose(&mut self, vertices: &[Vec3]) {
        self.surface.refit(vertices);
        self.folds.clear();
    }

    /// Surface of the posed body.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Returns whether layers of the garment keep their order when they are pushed.
    pub(super) fn keeps_layers_in_order(&self) -> bool {
        self.keeps_layers_in_order
    }

    /// Filter of the contacts between body parts and garment vertices.
    pub fn contact_filter(&self) -> &ContactFilter {
        &self.contact_filter
    }

    /// Returns the point of the body closest to a garment vertex, among the parts that may push it.
    ///
    /// None without such parts or for a `p` that is not finite.
    pub fn closest(&self, vertex: usize, p: Vec3, seed: u32) -> Option<SurfacePoint> {
        let pushing = self.faces_pushing(vertex);
        self.surface.closest_filtered(p, f32::INFINITY, seed, pushing)
    }

    /// Filter for the faces that may push a garment vertex.
    fn faces_pushing(&self, vertex: usize) -> FaceFilter<impl Fn(u32) -> bool + Copy> {
        FaceFilter {
            groups: self.contact_filter.groups_pushing_vertex(vertex),
            accepts: move |face| {
                self.contact_filter.groups_are_exact() || self.contact_filter.face_may_push(face, vertex)
            },
        }
    }

    /// Returns whether all corners of a body face lie in a fold between parts that may both push
    /// the vertex, see [`folds::Folds`]. Over a face with a corner outside of folds there is room
    /// for cloth.
    pub(super) fn is_folded(&self, face: u32, vertex: usize) -> bool {
        let class = self.contact_filter.garment_packets().class_of_vertex(vertex);
        let pushes = |face| self.contact_filter.face_may_push(face, vertex);
        let corners = self.surface.welded_faces().get(face as usize);
        corners.is_some_and(|corners| {
            corners.iter().all(|&corner| {
                let compute = || folds::vertex_is_folded(&self.surface, corner, pushes);
                self.folds.is_folded(class, corner, compute)
            })
        })
    }
}

/// Contact between a garment vertex and the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Body face near the vertex: the seed of the next search.
    pub face: u32,
    /// Height over the body, metres: negative inside, infinite where no part may push the vertex.
    ///
    /// For a vertex well above the body it is a lower bound.
    pub height_m: f32,
    /// Corrected position, metres; none when the vertex stays.
    pub corrected: Option<Vec3>,
}

impl Contact {
    /// Contact of a vertex that nothing may push.
    pub const NONE: Self = Self {
        face: u32::MAX,
        height_m: f32::INFINITY,
        corrected: None,
    };
}

/// Rule that keeps vertices at a height over the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustIntersection {
    /// Height to which vertices are pushed, metres.
    pub margin_m: f32,
}

impl RobustIntersection {
    /// Returns the corrected position of garment vertex `vertex` at `p`; none when it stays. See
    /// [`RobustIntersection::find_contact`].
    ///
    /// `seed`, a body face near the closest one, shortens the search, and is replaced.
    pub fn correct(&self, body: &RobustBody, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        let contact = self.find_contact(body, vertex, p, *seed);
        *seed = contact.face;
        contact.corrected
    }

    /// Returns the corrected position of garment vertex `vertex`, shown at `p`; none when it stays.
    ///
    /// Deep inside the body, the vertex first moves towards `skinned`, its position by linear blend
    /// skinning. Then it is [corrected](Self::correct). Positions are in the body's frame, metres.
    /// `seed`, a body face near the closest one, shortens the search, and is replaced.
    pub fn correct_shown(
        &self,
        body: &RobustBody,
        vertex: usize,
        p: Vec3,
        skinned: Vec3,
        seed: &mut u32,
    ) -> Option<Vec3> {
        let retracted = self.retract(body, vertex, p, skinned, *seed);
        let corrected = self.correct(body, vertex, retracted.unwrap_or(p), seed);
        corrected.or(retracted)
    }

    /// Finds the contact of garment vertex `vertex` at `p` with the body.
    ///
    /// The vertex is pushed along the shortest way between it and the parts that may push it, out
    /// to the margin. From inside a part that may not push it, it first sinks to those that may. In
    /// a crease narrower than two margins it moves to the middle.
    ///
    /// The vertex stays when it is high enough, when all corners of the closest face are in a fold,
    /// and when no part of the body pushes it.
    ///
    /// Height and position are continuous functions of `p`, with two exceptions: where two places
    /// of the skin are equally near, and where cloth above a limb that may not push it enters the
    /// limb.
    pub fn find_contact(&self, body: &RobustBody, vertex: usize, p: Vec3, seed: u32) -> Contact {
        let Some(nearest) = body.surface.closest_from(p, seed) else {
            return Contact::NONE;
        };
        let mut contact = self.first_push(body, vertex, p, nearest.face);
        if let Some(corrected) = &mut contact.corrected {
            // The height stays that of the first contact: it belongs to the position before the
            // push.
            *corrected = self.push_further(body, vertex, *corrected, contact.face);
            let nearest = body.surface.closest_from(*corrected, contact.face);
            *corrected = nearest.map_or(*corrected, |hit| self.sink(body, vertex, *corrected, hit.face));
        }
        contact
    }

    /// Sinks and pushes a vertex once; `nearest` is the face of the body closest to `p`.
    fn first_push(&self, body: &RobustBody, vertex: usize, p: Vec3, nearest: u32) -> Contact {
        if body.contact_filter.face_may_push(nearest, vertex) {
            let faces = ClosestFaces {
                of_body: nearest,
                of_pushing: nearest,
            };
            return self.push_once(body, vertex, SunkPosition { from: p, to: p }, faces);
        }
        let sunk = self.sink(body, vertex, p, nearest);
        let pushing = body
            .closest(vertex, sunk, u32::MAX)
            .map_or(u32::MAX, |hit| hit.face);
        let faces = ClosestFaces {
            of_body: nearest,
            of_pushing: pushing,
        };
        self.push_once(body, vertex, SunkPosition { from: p, to: sunk }, faces)
    }

    /// Pushes a vertex that has sunk, or not moved yet, out of the closest face that may push it.
    fn push_once(
        &self,
        body: &RobustBody,
        vertex: usize,
        SunkPosition { from, to }: SunkPosition,
        faces: ClosestFaces,
    ) -> Contact {
        let pushing = body.surface.point_on(faces.of_pushing, to);
        // Most vertices have not sunk and have one closest face: one query instead of two.
        let nearest = match faces.of_body == faces.of_pushing && from == to {
            true => pushing,
            false => body.surface.point_on(faces.of_body, from),
        };
        let Some((nearest, pushing)) = nearest.zip(pushing) else {
            return Contact::NONE;
        };
        let out = self.push_out(&pushing, to);
        let out = out.filter(|_| !body.is_folded(pushing.face, vertex));
        // Inside a part that may not push it, a vertex has the negative height of that part.
        Contact {
            face: pushing.face,
            height_m: pushing.signed_distance.min(nearest.signed_distance),
            corrected: out.or_else(|| (to != from).then_some(to)),
        }
    }

    /// Pushes a vertex on after the first push, which in a crease leads into the other side.
    fn push_further(&self, body: &RobustBody, vertex: usize, mut at: Vec3, mut seed: u32) -> Vec3 {
        for iteration in 1..=MAX_ITERATIONS {
            let Some(hit) = body.closest(vertex, at, seed) else {
                break;
            };
            let Some(out) = self.push_out(&hit, at) else {
                break;
            };
            (at, seed) = (next_position(iteration, at, out), hit.face);
        }
        at
    }

    /// Pushes a point of a garment face out of the parts that may push all its corners, by the
    /// shortest way; none for a point outside of them.
    ///
    /// The result may lie in another part, which the face's neighbours then touch too.
    pub(crate) fn push_face_point_out(
        &self,
        body: &RobustBody,
        face: LiftedFace,
        p: Vec3,
        seed: u32,
    ) -> Option<Vec3> {
        let contact_filter = &body.contact_filter;
        let lifting = FaceFilter {
            groups: contact_filter.groups_lifting_face(face.face),
            accepts: |body_face| {
                contact_filter.groups_are_exact() || contact_filter.face_may_lift(body_face, face.face)
            },
        };
        let hit = body.surface.closest_filtered(p, LIMB_RADIUS_M, seed, lifting)?;
        // Points outside the body stay: between corners at the margin a face may be lower than
        // that.
        let out = self.push_out(&hit, p).filter(|_| hit.signed_distance < 0.0)?;
        (!body.is_folded(hit.face, face.corner as usize)).then_some(out)
    }

    pub(super) fn is_high_enough(&self, height_m: f32) -> bool {
        height_m > self.margin_m - TOLERANCE_M
    }

    /// Returns the point at the margin on the way from the closest point through `p`; none for a
    /// `p` that is high enough or beyond a rim.
    pub(super) fn push_out(&self, hit: &SurfacePoint, p: Vec3) -> Option<Vec3> {
        if self.is_high_enough(hit.signed_distance) {
            return None;
        }
        // Over a face both directions are the same, and the normal has no rounding of positions in
        // it.
        let is_normal = hit.feature == Feature::Face || hit.distance < MIN_DISTANCE_M;
        let direction = match is_normal {
            true => hit.normal,
            // The sign of the distance turns the direction outwards from both sides.
            false => (p - hit.point) / hit.signed_distance,
        };
        let is_under_the_vertex = direction.dot(hit.normal) > MIN_RIM_COSINE;
        is_under_the_vertex.then(|| hit.point + direction * self.margin_m)
    }
}

/// Garment face that the body may lift.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LiftedFace {
    /// Index of the face in the garment.
    pub(crate) face: u32,
    /// Index of one of its vertices.
    pub(crate) corner: u32,
}

/// Position of a vertex before and after it sinks; equal when it does not.
#[derive(Clone, Copy, Debug)]
struct SunkPosition {
    from: Vec3,
    to: Vec3,
}

/// Faces of the body closest to a vertex.
#[derive(Clone, Copy, Debug)]
struct ClosestFaces {
    /// Face closest to the position before sinking, among all faces.
    of_body: u32,
    /// Face closest to the position after sinking, among those that may push the vertex.
    of_pushing: u32,
}
