//! Closest faces of many points of a group.

use super::{BySlot, Group, Slots};
use crate::{aabb_tree::LANES, surface::FaceFilter};
use glam::Vec3;

impl Group<'_> {
    /// Finds the closest faces that may push, where `nearest`, the closest of all, may not. `faces`
    /// are seeds before, and the faces that may push after.
    pub(super) fn search_pushing_from(&self, slots: &Slots, at: &[Vec3], nearest: &[u32], faces: &mut [u32]) {
        let others = slots.filtered(|slot| {
            let may_push = self.may_push(nearest[slot]);
            if may_push {
                faces[slot] = nearest[slot];
            }
            !may_push
        });
        self.search_pushing(&others, at, faces);
    }

    /// Finds the closest faces that may push. `faces` are seeds before, and the faces found after.
    pub(super) fn search_pushing(&self, slots: &Slots, at: &[Vec3], faces: &mut [u32]) {
        self.search_among(slots, at, faces, None, self.body.faces_pushing(self.vertex));
    }

    /// Finds the closest faces of the body, and their distances in metres where they are asked for.
    /// `faces` are seeds before, and the faces found after.
    pub(super) fn search(
        &self,
        slots: &Slots,
        at: &[Vec3],
        faces: &mut [u32],
        distances: Option<&mut BySlot<f32>>,
    ) {
        self.search_among(slots, at, faces, distances, FaceFilter::new(|_| true));
    }

    /// Finds the closest faces among those that a filter accepts, as [`Self::search`] does.
    // Packets are filled with what is searched for: vertices that need no search take no lanes.
    fn search_among(
        &self,
        slots: &Slots,
        at: &[Vec3],
        faces: &mut [u32],
        mut distances: Option<&mut BySlot<f32>>,
        filter: FaceFilter<impl Fn(u32) -> bool + Copy>,
    ) {
        for slots in slots.as_slice().chunks(LANES) {
            let (mut points, mut seeds) = ([Vec3::NAN; LANES], [u32::MAX; LANES]);
            for (lane, &slot) in slots.iter().enumerate() {
                (points[lane], seeds[lane]) = (at[slot as usize], faces[slot as usize]);
            }
            let surface = &self.body.surface;
            let found = surface.closest_of_packet(&points, f32::INFINITY, &seeds, filter);
            for (lane, &slot) in slots.iter().enumerate() {
                faces[slot as usize] = found.item[lane];
                if let Some(distances) = &mut distances {
                    distances[slot as usize] = found.squared[lane].sqrt();
                }
            }
        }
    }
}
