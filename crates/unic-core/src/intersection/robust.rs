//! Our way out of the body: the closest triangle that may push, along the shortest way, to a margin.

use super::ContactParts;
use crate::{
    character::{Character, Garment},
    folds,
    surface::{Among, Feature, Surface, SurfacePoint},
};
use glam::Vec3;

mod fold_memory;
mod group;
mod visitors;

use fold_memory::FoldMemory;

/// Closer to an edge than this the way to it has no direction but the surface's normal, metres: f32
/// places a point 100 m from the origin to 8 µm.
const LEAST_DISTANCE_M: f32 = 1e-4;

/// Cosine between the way to the closest point and the normal there below which the point lies on a
/// rim, of the parts that may push or of an open body: what is beyond a rim is not under it.
const LEAST_COSINE: f32 = 0.3;

/// Further looks at the surface after the first way out: in a crease it leads into the other side. Rounds of sinking too.
const MOST_LOOKS: usize = 4;

/// Where a vertex goes after the first way out, by the looks since: all the way, but halfway after the last one. In a
/// crease that is narrower than two margins the way leads to and fro, and where there is a gap its middle is outside both
/// sides.
fn next_place(look: usize, [at, out]: [Vec3; 2]) -> Vec3 {
    if look < MOST_LOOKS { out } else { at.midpoint(out) }
}

/// What is inside a limb is at most this far from its skin, metres.
pub(super) const LIMB_RADIUS_M: f32 = 0.06;

/// Height below the margin at which a vertex is left, metres: what rounding does to one that was moved.
const TOLERANCE_M: f32 = 1e-5;

/// A posed body as [`RobustIntersection`] sees it. Scratch over a shared asset, [`ContactParts`].
#[derive(Clone, Debug)]
pub struct RobustBody {
    surface: Surface,
    parts: std::sync::Arc<ContactParts>,
    /// For the kinds of garment vertices that the same parts push.
    folds: FoldMemory,
}

impl RobustBody {
    /// Of a garment on a character, in the bind pose.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        let parts = ContactParts::new(character, garment);
        let mut surface = Surface::build(&character.body);
        surface.mark(|face| parts.marks_of_face(face));
        Self {
            surface,
            folds: FoldMemory::new(parts.packets().kinds(), character.body.vertices.len()),
            parts: std::sync::Arc::new(parts),
        }
    }

    /// Poses the body: world positions of its vertices, metres. Does not allocate.
    ///
    /// # Panics
    /// When their number is another.
    pub fn pose(&mut self, vertices: &[Vec3]) {
        self.surface.refit(vertices);
        self.folds.forget();
    }

    /// The posed body.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// What may push what.
    pub fn parts(&self) -> &ContactParts {
        &self.parts
    }

    /// The point of the body closest to a garment vertex, among the parts that may push it; none
    /// without such parts or for a `p` that is not finite.
    pub fn closest(&self, vertex: usize, p: Vec3, seed: u32) -> Option<SurfacePoint> {
        let pushing = self.pushing(vertex);
        self.surface.closest_marked(p, f32::INFINITY, seed, pushing)
    }

    /// The faces that may push a garment vertex.
    fn pushing(&self, vertex: usize) -> Among<impl Fn(u32) -> bool> {
        Among {
            marks: self.parts.marks_of_vertex(vertex),
            counts: move |face| self.parts.marks_tell_all() || self.parts.face_pushes(face, vertex),
        }
    }

    /// Does `face`, with all its corners, lie in a fold between parts that may both push the vertex? See
    /// [`folds::Folds`]. Over a face with a corner outside there is room for cloth.
    fn is_folded(&self, face: u32, vertex: usize) -> bool {
        let kind = self.parts.packets().kind_of_vertex(vertex);
        let pushes = |face| self.parts.face_pushes(face, vertex);
        let corners = self.surface.welded_faces().get(face as usize);
        corners.is_some_and(|corners| {
            corners.iter().all(|&corner| {
                let find_out = || folds::vertex_is_folded(&self.surface, corner, pushes);
                self.folds.is_folded(kind, corner, find_out)
            })
        })
    }
}

/// What a look at the body says about a garment vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// A face near the vertex: the seed of the next look.
    pub face: u32,
    /// Height over the body, metres; negative inside, infinite where no part may push the vertex. Where
    /// the vertex is well above the body, it may be higher than this.
    pub height_m: f32,
    /// Where the vertex goes, metres; none when it stays.
    pub moved: Option<Vec3>,
}

impl Contact {
    /// Without anything to touch.
    pub const NONE: Self = Self {
        face: u32::MAX,
        height_m: f32::INFINITY,
        moved: None,
    };
}

/// Keeps vertices at a height over the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustIntersection {
    /// The height, metres.
    pub margin_m: f32,
}

impl RobustIntersection {
    /// Where garment vertex `vertex` goes from `p`, see [`RobustIntersection::look`]; none when it
    /// stays. `seed`, a body face near the closest one, makes the search faster, and is replaced.
    pub fn correct(&self, body: &RobustBody, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        let contact = self.look(body, vertex, p, *seed);
        *seed = contact.face;
        contact.moved
    }

    /// Looks at the body from garment vertex `vertex` at `p`. The vertex goes along the shortest way
    /// between it and the parts that may push it, out to the margin; from inside a part that may not
    /// it sinks to them first. It stays when it is high enough, when the closest face is in a fold with all its
    /// corners, and when no part of the body pushes it. In a crease narrower than two margins it goes to the middle.
    ///
    /// Height and place are continuous functions of `p` but where two parts of the skin are equally
    /// far from it, and where cloth that lies over a visiting limb meets it from above.
    pub fn look(&self, body: &RobustBody, vertex: usize, p: Vec3, seed: u32) -> Contact {
        let Some(nearest) = body.surface.closest_from(p, seed) else {
            return Contact::NONE;
        };
        let mut contact = self.touch(body, vertex, p, nearest.face);
        if let Some(moved) = &mut contact.moved {
            *moved = self.follow(body, vertex, *moved, contact.face);
            let nearest = body.surface.closest_from(*moved, contact.face);
            *moved = nearest.map_or(*moved, |hit| self.sink(body, vertex, *moved, hit.face));
        }
        contact
    }

    /// The first of the way: `nearest` is the closest face of the body.
    fn touch(&self, body: &RobustBody, vertex: usize, p: Vec3, nearest: u32) -> Contact {
        if body.parts.face_pushes(nearest, vertex) {
            return self.contact(body, vertex, [p, p], [nearest, nearest]);
        }
        let at = self.sink(body, vertex, p, nearest);
        let pushing = body
            .closest(vertex, at, u32::MAX)
            .map_or(u32::MAX, |hit| hit.face);
        self.contact(body, vertex, [p, at], [nearest, pushing])
    }

    /// Of a vertex at `p` that has sunk to `at`: `nearest` is the closest face of the body to the one,
    /// `pushing` the closest that may push it to the other.
    fn contact(
        &self,
        body: &RobustBody,
        vertex: usize,
        [p, at]: [Vec3; 2],
        [nearest, pushing]: [u32; 2],
    ) -> Contact {
        let hit = body.surface.point_on(pushing, at);
        let nearest = match nearest == pushing && p == at {
            true => hit,
            false => body.surface.point_on(nearest, p),
        };
        let Some((nearest, hit)) = nearest.zip(hit) else {
            return Contact::NONE;
        };
        let out = self.way_out(&hit, at);
        let out = out.filter(|_| !body.is_folded(hit.face, vertex));
        Contact {
            face: hit.face,
            height_m: hit.signed_distance.min(nearest.signed_distance),
            moved: out.or_else(|| (at != p).then_some(at)),
        }
    }

    /// Goes on from the first way out: in a crease it leads into the other side.
    fn follow(&self, body: &RobustBody, vertex: usize, mut at: Vec3, mut seed: u32) -> Vec3 {
        for look in 1..=MOST_LOOKS {
            let Some(hit) = body.closest(vertex, at, seed) else {
                break;
            };
            let Some(out) = self.way_out(&hit, at) else {
                break;
            };
            (at, seed) = (next_place(look, [at, out]), hit.face);
        }
        at
    }

    /// Where a place of garment face `face` inside the parts that may push all its corners goes, by the shortest way;
    /// none for one outside. `corner` is one of them. It may end in another part: the face's neighbours show that.
    pub(crate) fn out_of_depth(
        &self,
        body: &RobustBody,
        [face, corner]: [u32; 2],
        p: Vec3,
        seed: u32,
    ) -> Option<Vec3> {
        let parts = &body.parts;
        let lifting = Among {
            marks: parts.marks_of_lifted(face),
            counts: |part| parts.marks_tell_all() || parts.face_lifts(part, face),
        };
        let hit = body.surface.closest_marked(p, LIMB_RADIUS_M, seed, lifting)?;
        let out = self.way_out(&hit, p).filter(|_| hit.signed_distance < 0.0)?;
        (!body.is_folded(hit.face, corner as usize)).then_some(out)
    }

    fn is_high_enough(&self, height_m: f32) -> bool {
        height_m > self.margin_m - TOLERANCE_M
    }

    fn way_out(&self, hit: &SurfacePoint, p: Vec3) -> Option<Vec3> {
        if self.is_high_enough(hit.signed_distance) {
            return None;
        }
        // Over a face the two are one, and the normal is free of the rounding of positions.
        let is_normal = hit.feature == Feature::Face || hit.distance < LEAST_DISTANCE_M;
        let direction = match is_normal {
            true => hit.normal,
            false => (p - hit.point) / hit.signed_distance,
        };
        let is_under_the_vertex = direction.dot(hit.normal) > LEAST_COSINE;
        is_under_the_vertex.then(|| hit.point + direction * self.margin_m)
    }
}
