//! Pushes that keep the order of cloth that lies over one place of the body.

use super::{CHUNK, Contact, LIMB_RADIUS_M, RobustBody, RobustIntersection};
use crate::{
    mesh::TriMesh,
    parallel::for_each_chunk,
    surface::{Surface, SurfacePoint},
    topology::edges,
};
use glam::Vec3;

/// Length of a garment's edges by that of the body's below which its layers keep their order.
const FINE_SHARE: f32 = 2.0 / 3.0;

/// Depth below which cloth is not raised, metres.
const LEAST_DEPTH_M: f32 = 1e-4;

/// Weight of a corner from which on it takes the whole depth at a point of its face. Below it the
/// share falls to zero, so that at an edge it does not matter which of the two faces is nearest.
const FULL_WEIGHT: f32 = 0.1;

/// Returns whether layers of a garment keep their order when they are pushed out of a body, given
/// both meshes at rest: its edges are on average shorter than two thirds of the body's.
///
/// A place of the body is as large as its faces. Over a face a coarser garment has one layer alone,
/// whose vertices would raise each other.
pub fn keeps_layers_in_order(garment: &TriMesh, body: &TriMesh) -> bool {
    mean_edge_m(garment) < FINE_SHARE * mean_edge_m(body)
}

/// Returns the mean length of the edges of a mesh, metres; NaN without edges.
fn mean_edge_m(mesh: &TriMesh) -> f32 {
    let lengths = edges(&mesh.faces).into_iter().map(|ends| {
        let [a, b] = ends.map(|v| mesh.vertices[v as usize]);
        f64::from(a.distance(b))
    });
    let (count, sum) = lengths.fold((0, 0.0), |(count, sum), length| (count + 1, sum + length));
    (sum / f64::from(count)) as f32
}

/// Depths of cloth below the margin, by place of the body.
///
/// Vertices are pushed to the margin one by one. Layers of a pleat that are inside a thigh would
/// come to one height and cut through each other. The depth of a place is that of the deepest cloth
/// there. Heights from one depth below the margin to one above it become heights from the margin to
/// one depth above it: the deepest layer comes to the margin, and the others stay above it.
///
/// A vertex that was drawn towards its skinned position counts with its depth before that. In a fold
/// of the body nothing is pushed, so there is no depth.
#[derive(Clone, Debug)]
pub(super) struct Depths {
    /// Depth of the cloth next to each welded body vertex, metres.
    by_body_vertex: Vec<f32>,
    /// Depth at which each slot was before it was drawn towards its skinned position, metres; 0 for
    /// others.
    before_retraction: Vec<f32>,
}

impl Depths {
    /// Makes room for a number of body vertices and of slots.
    pub(super) fn new(body_vertices: usize, slots: usize) -> Self {
        Self {
            by_body_vertex: vec![0.0; body_vertices],
            before_retraction: vec![0.0; slots],
        }
    }

    /// Forgets the depths before retraction.
    pub(super) fn clear_retractions(&mut self) {
        self.before_retraction.fill(0.0);
    }

    /// Stores the depth of a slot that is drawn towards its skinned position, metres.
    pub(super) fn store_retraction(&mut self, slot: usize, depth_m: f32) {
        self.before_retraction[slot] = depth_m.max(0.0);
    }

    /// Moves the corrected positions of cloth that lies over a depth. Positions are by slot, metres.
    /// Replaces the faces of contacts there by the closest ones.
    pub(super) fn keep_order(
        &mut self,
        rule: RobustIntersection,
        body: &RobustBody,
        at: &[Vec3],
        contacts: &mut [Contact],
    ) {
        let greatest_m = self.find_depths(rule.margin_m, body, at, contacts);
        if greatest_m < LEAST_DEPTH_M {
            return;
        }
        let max_height_m = rule.margin_m + greatest_m;
        for_each_chunk(contacts, CHUNK, |first, contacts| {
            let slots = (first..).zip(contacts);
            // Heights are lower bounds: a vertex with a greater one is too high.
            for (slot, contact) in slots.filter(|(_, contact)| contact.height_m < max_height_m) {
                if let Some(cloth) = self.cloth(body, slot, at[slot], contact) {
                    contact.face = cloth.hit.face;
                    contact.corrected = rule.raise(&cloth, contact.corrected);
                }
            }
        });
    }

    /// Returns the cloth of a slot at a position, metres; none where it lies over no depth.
    fn cloth(&self, body: &RobustBody, slot: usize, at: Vec3, contact: &Contact) -> Option<VertexOverDepth> {
        let retracted_m = self.before_retraction[slot];
        let place = place(at, contact, retracted_m);
        let mut hit = body.surface().point_on(contact.face, place)?;
        let is_free = contact.corrected.is_none() && retracted_m == 0.0;
        let filter = body.contact_filter();
        let vertex = filter.garment_packets().vertices()[slot] as usize;
        // Of a vertex well above the body the height is a lower bound, and the face only near the
        // closest one that may push it.
        let is_closest =
            hit.signed_distance == contact.height_m && filter.face_may_push(contact.face, vertex);
        if is_free && !is_closest {
            hit = body.closest(vertex, at, contact.face)?;
        }
        let depths_m = self.at_corners(body.surface(), hit.face);
        (depths_m.max_element() >= LEAST_DEPTH_M).then(|| VertexOverDepth {
            at,
            place,
            depth_m: depths_m.dot(hit.barycentric),
            hit,
            retracted_m,
        })
    }

    /// Returns the depths at the corners of a body face, metres; zero for a face that does not exist.
    fn at_corners(&self, surface: &Surface, face: u32) -> Vec3 {
        let corners = surface.welded_faces().get(face as usize);
        corners.map_or(Vec3::ZERO, |corners| {
            Vec3::from(corners.map(|v| self.by_body_vertex[v as usize]))
        })
    }

    /// Finds the depth of each place of the body. Returns the greatest, metres.
    fn find_depths(
        &mut self,
        margin_m: f32,
        body: &RobustBody,
        at: &[Vec3],
        contacts: &mut [Contact],
    ) -> f32 {
        self.by_body_vertex.fill(0.0);
        let surface = body.surface();
        let vertices = body.contact_filter().garment_packets().vertices();
        let mut greatest_m: f32 = 0.0;
        for (slot, (contact, at)) in contacts.iter_mut().zip(at).enumerate() {
            let retracted_m = self.before_retraction[slot];
            if contact.corrected.is_none() && retracted_m == 0.0 {
                continue;
            }
            let place = place(*at, contact, retracted_m);
            let hit = match retracted_m > 0.0 {
                // Its push may have led it elsewhere on the body.
                true => body.closest(vertices[slot] as usize, place, contact.face),
                false => surface.point_on(contact.face, place),
            };
            let Some(hit) = hit else {
                continue;
            };
            contact.face = hit.face;
            let depth_m = match contact.corrected {
                // A vertex that sinks towards a part that may push it is not inside that part.
                Some(pushed) if retracted_m == 0.0 => {
                    pushed.distance(*at).min(margin_m - hit.signed_distance)
                }
                _ => retracted_m,
            };
            // What is deeper is on the wrong side of a limb, and says nothing about layers.
            let depth_m = depth_m.min(LIMB_RADIUS_M);
            greatest_m = greatest_m.max(depth_m);
            let corners = surface.welded_faces()[hit.face as usize];
            for (corner, weight) in corners.into_iter().zip(hit.barycentric.to_array()) {
                let depth = &mut self.by_body_vertex[corner as usize];
                *depth = depth.max(depth_m * (weight / FULL_WEIGHT).min(1.0));
            }
        }
        greatest_m
    }
}

/// Returns the place of cloth whose depth counts, metres: for retracted cloth that after its push.
fn place(at: Vec3, contact: &Contact, retracted_m: f32) -> Vec3 {
    match retracted_m > 0.0 {
        true => contact.corrected.unwrap_or(at),
        false => at,
    }
}

/// Vertex of cloth over a depth.
struct VertexOverDepth {
    /// Position before its push, metres.
    at: Vec3,
    /// Place whose depth counts, metres.
    place: Vec3,
    /// Closest point of the body to that place.
    hit: SurfacePoint,
    /// Depth there, metres.
    depth_m: f32,
    /// Depth before retraction, metres; 0 without one.
    retracted_m: f32,
}

impl VertexOverDepth {
    /// Returns the height over the margin to which cloth at a height over it is raised, metres.
    fn raised_m(&self, height_m: f32) -> f32 {
        (0.5 * (height_m + self.depth_m)).max(0.0)
    }
}

impl RobustIntersection {
    /// Returns the corrected position of cloth, metres, given that of its push alone. None where it
    /// stays.
    fn raise(self, cloth: &VertexOverDepth, pushed: Option<Vec3>) -> Option<Vec3> {
        let over_body = |raised_m: f32| {
            let margin_m = self.margin_m + raised_m;
            Self { margin_m }.push_out(&cloth.hit, cloth.place)
        };
        if cloth.retracted_m > 0.0 {
            return over_body(cloth.raised_m(-cloth.retracted_m)).or(pushed);
        }
        if let Some(pushed) = pushed {
            if cloth.hit.signed_distance >= self.margin_m {
                // The vertex sinks towards a part that may push it.
                return Some(pushed);
            }
            let push = pushed - cloth.at;
            return Some(pushed + push.normalize_or_zero() * cloth.raised_m(-push.length()));
        }
        let height_m = cloth.hit.signed_distance - self.margin_m;
        let is_over = self.is_high_enough(cloth.hit.signed_distance) && height_m < cloth.depth_m;
        is_over.then(|| over_body(cloth.raised_m(height_m)))?
    }
}
