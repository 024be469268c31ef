//! Pushes of colliders: of single points, and of garment faces that a collider pokes through.

use super::poke_through::{FaceLift, PointPush};
use crate::{collider::Collider, parallel::for_each_chunk};
use glam::Vec3;

/// Number of faces that one thread takes at a time.
const CHUNK: usize = 4096;

/// Pushes a point out of all colliders, one after the other; none when it stays.
///
/// Where colliders overlap, the last one decides.
pub(super) fn push_out_of_all(colliders: &[Collider], p: Vec3, margin_m: f32) -> Option<Vec3> {
    colliders.iter().fold(None, |out, collider| {
        let at = out.unwrap_or(p);
        collider.push_out(at, margin_m).or(out)
    })
}

/// Lifts of garment faces over spheres and capsules, by face; empty without colliders.
#[derive(Clone, Debug, Default)]
pub(super) struct ColliderLifts(Vec<Option<FaceLift>>);

impl ColliderLifts {
    /// Lifts that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = FaceLift> {
        self.0.iter().flatten().copied()
    }

    /// Finds the lifts of all faces, three slots each, by the position of each slot, metres.
    pub(super) fn find(
        &mut self,
        colliders: &[Collider],
        faces: &[[u32; 3]],
        at: impl Fn(u32) -> Vec3 + Sync,
        height_m: f32,
    ) {
        self.0.clear();
        if colliders.is_empty() {
            return;
        }
        self.0.resize(faces.len(), None);
        // Half spaces need no lifts: a face whose corners are above a plane is above it. Mesh
        // colliders push vertices only.
        for_each_chunk(&mut self.0, CHUNK, |first, lifts| {
            for (face, lift) in (first..).zip(lifts) {
                let corners = faces[face].map(&at);
                let pushes = colliders
                    .iter()
                    .filter_map(|c| c.push_face_out(corners, height_m));
                let pushes = pushes.map(|deepest| PointPush {
                    barycentric: deepest.barycentric,
                    push: deepest.push,
                });
                *lift = FaceLift::longest(face as u32, pushes);
            }
        });
    }
}
