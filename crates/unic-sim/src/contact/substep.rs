//! Projection of body and ground contacts in one substep.

use super::{
    detect::{BodyMotion, ContactCache, HeightSample},
    response::{Friction, Gap, SurfaceContact},
    settings::ContactSettings,
    walk::FaceAdjacency,
};
use crate::body::{PosedBody, interpolate};
use glam::Vec3;
use unic_core::folds::Folds;

/// Inputs of the projection that all particles share in a substep.
pub(super) struct BodySubstep<'a> {
    pub(super) settings: &'a ContactSettings,
    pub(super) adjacency: &'a FaceAdjacency,
    pub(super) folds: &'a Folds,
    /// The body at the start of the substep.
    pub(super) before: &'a PosedBody,
    /// The body at the end of the substep.
    pub(super) after: &'a PosedBody,
    /// Largest recovery from a penetration in the substep, metres.
    pub(super) recovery_m: f32,
    /// Largest displacement of cloth out of an ignored limb in the substep, metres.
    pub(super) max_sink_m: f32,
    pub(super) motion: &'a BodyMotion,
    /// Fraction of the interval at the end of the substep.
    pub(super) fraction: f32,
}

impl BodySubstep<'_> {
    /// Moves one particle out of the body and off the ground.
    pub(super) fn project(&self, cache: &mut ContactCache, position: &mut Vec3, previous: &mut Vec3) {
        let thickness_m = self.settings.thickness_m;
        // Both positions move, so that the displacement does not become velocity.
        let sunk = cache.sink_offset.clamp_length_max(self.max_sink_m);
        *position += sunk;
        *previous += sunk;
        cache.sink_offset -= sunk;
        if cache.is_within_reach && !cache.is_clear(*position, self.fraction, self.motion, thickness_m) {
            let contact = self.body_contact(cache, *position, *previous);
            contact.resolve(position, previous);
            // The height is that before the correction. A corrected particle is thus recorded below
            // the thickness, so that the next substep checks it again.
            cache.record(HeightSample {
                height_m: thickness_m + contact.gap.after,
                position: *position,
                fraction: self.fraction,
            });
        }
        if let Some(height) = self.settings.ground_height_m {
            self.ground_contact(height, *position, *previous)
                .resolve(position, previous);
        }
    }

    /// Finds the surface point next to the particle, from the cached face on, and returns its
    /// contact.
    fn body_contact(&self, cache: &mut ContactCache, position: Vec3, previous: Vec3) -> SurfaceContact {
        let projection = self.adjacency.walk(&self.after.positions, cache.face, position);
        cache.face = projection.face;
        let corners = self.adjacency.faces[projection.face as usize];
        let at = |body: &PosedBody| {
            let point = interpolate(&body.positions, corners, projection.barycentric);
            (
                point,
                interpolate(&body.normals, corners, projection.barycentric).normalize_or_zero(),
            )
        };
        let ((point_before, normal_before), (point, normal)) = (at(self.before), at(self.after));
        let height_before = height(previous - point_before, normal_before);
        let is_folded = !cache.passes_foreign && self.folds.is_face_folded(projection.face);
        SurfaceContact {
            normal,
            gap: Gap {
                before: height_before - self.settings.thickness_m,
                after: height(position - point, normal) - self.settings.thickness_m,
                recovery_m: if is_folded { 0.0 } else { self.recovery_m },
            },
            // A particle at rest keeps its height along the normal, which turns with the surface.
            // Without the second term it would slip back by its height times the angle: 2π times
            // 3 mm, which is two centimetres per full turn.
            surface_motion: point - point_before + (normal - normal_before) * height_before.max(0.0),
            friction: if is_folded {
                Friction::NONE
            } else {
                self.settings.body_friction
            },
        }
    }

    fn ground_contact(&self, height: f32, position: Vec3, previous: Vec3) -> SurfaceContact {
        let floor = height + self.settings.thickness_m;
        SurfaceContact {
            normal: Vec3::Y,
            gap: Gap {
                before: previous.y - floor,
                after: position.y - floor,
                recovery_m: self.recovery_m,
            },
            surface_motion: Vec3::ZERO,
            friction: self.settings.ground_friction,
        }
    }
}

/// Returns the height over the surface of a particle at `offset` from its projection, metres;
/// negative inside.
fn height(offset: Vec3, normal: Vec3) -> f32 {
    let along = offset.dot(normal);
    // Outside it is the distance, which is larger than the height along the normal beside a sharp
    // tip: a particle there is far enough away and must not be pushed.
    if along > 0.0 { offset.length() } else { along }
}
