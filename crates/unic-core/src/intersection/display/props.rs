//! Ground and props, and the garment faces that they poke through.

use super::pokes::Poke;
use crate::{collider::Collider, parallel::for_each_chunk};
use glam::Vec3;

/// Faces that one thread takes at a time.
const CHUNK: usize = 4096;

/// Where a place goes that any collider pushes; the later ones have the last word.
pub(super) fn out_of_all(colliders: &[Collider], p: Vec3, margin_m: f32) -> Option<Vec3> {
    colliders.iter().fold(None, |out, collider| {
        let at = out.unwrap_or(p);
        collider.way_out(at, margin_m).or(out)
    })
}

/// What round colliders ask of the garment's faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Props(Vec<Option<Poke>>);

impl Props {
    /// Those that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = Poke> {
        self.0.iter().flatten().copied()
    }

    /// Looks at all faces, three slots each, of places by slot, metres.
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
        for_each_chunk(&mut self.0, CHUNK, |first, pokes| {
            for (face, poke) in (first..).zip(pokes) {
                let corners = faces[face].map(&at);
                let ways = colliders
                    .iter()
                    .filter_map(|c| c.way_out_of_face(corners, height_m));
                *poke = Poke::longest(face as u32, ways.map(|(hit, way)| (hit.barycentric, way)));
            }
        });
    }
}
