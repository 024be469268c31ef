//! One substep of contact.

use super::{
    ContactSettings, Friction, Gap,
    detect::{BodyMotion, Nearby, Sight},
    response::Touch,
    walk::FaceGraph,
};
use crate::body::{PosedBody, blend};
use glam::Vec3;
use unic_core::folds::Folds;

/// What all particles share in a substep.
pub(super) struct Substep<'a> {
    pub(super) settings: &'a ContactSettings,
    pub(super) graph: &'a FaceGraph,
    pub(super) folds: &'a Folds,
    pub(super) before: &'a PosedBody,
    pub(super) after: &'a PosedBody,
    /// Most of a penetration that is undone, metres.
    pub(super) recovery_m: f32,
    /// Farthest that cloth sinks out of a limb, metres.
    pub(super) sink_m: f32,
    pub(super) motion: &'a BodyMotion,
    /// Of the interval, at the end of the substep.
    pub(super) fraction: f32,
}

impl Substep<'_> {
    /// Moves one particle out of the body and off the ground.
    pub(super) fn keep_out(&self, nearby: &mut Nearby, position: &mut Vec3, previous: &mut Vec3) {
        let thickness_m = self.settings.thickness_m;
        let sunk = nearby.sink.clamp_length_max(self.sink_m);
        *position += sunk;
        *previous += sunk;
        nearby.sink -= sunk;
        if nearby.is_within_reach && !nearby.is_clear(*position, self.fraction, self.motion, thickness_m) {
            let touch = self.touch_body(nearby, *position, *previous);
            touch.resolve(position, previous);
            nearby.see(Sight {
                height_m: thickness_m + touch.gap.after,
                position: *position,
                fraction: self.fraction,
            });
        }
        if let Some(height) = self.settings.ground_height_m {
            self.touch_ground(height, *position, *previous)
                .resolve(position, previous);
        }
    }

    fn touch_body(&self, nearby: &mut Nearby, position: Vec3, previous: Vec3) -> Touch {
        let foot = self.graph.walk(&self.after.positions, nearby.face, position);
        nearby.face = foot.face;
        let corners = self.graph.faces[foot.face as usize];
        let at = |body: &PosedBody| {
            let point = blend(&body.positions, corners, foot.barycentric);
            (
                point,
                blend(&body.normals, corners, foot.barycentric).normalize_or_zero(),
            )
        };
        let ((point_before, normal_before), (point, normal)) = (at(self.before), at(self.after));
        let height_before = height(previous - point_before, normal_before);
        let is_folded = self.folds.has_face(foot.face);
        Touch {
            normal,
            gap: Gap {
                before: height_before - self.settings.thickness_m,
                after: height(position - point, normal) - self.settings.thickness_m,
                recovery_m: if is_folded { 0.0 } else { self.recovery_m },
            },
            // A particle above the surface turns with its normal: without that part it would slip
            // back by its height times the angle, two centimetres a turn.
            carried: point - point_before + (normal - normal_before) * height_before.max(0.0),
            friction: if is_folded {
                Friction::NONE
            } else {
                self.settings.body_friction
            },
        }
    }

    fn touch_ground(&self, height: f32, position: Vec3, previous: Vec3) -> Touch {
        let floor = height + self.settings.thickness_m;
        Touch {
            normal: Vec3::Y,
            gap: Gap {
                before: previous.y - floor,
                after: position.y - floor,
                recovery_m: self.recovery_m,
            },
            carried: Vec3::ZERO,
            friction: self.settings.ground_friction,
        }
    }
}

/// Height over the surface of a particle at `offset` from its foot: the distance outside, so that
/// beside a sharp tip nothing is pushed that is far enough away, and the depth inside.
fn height(offset: Vec3, normal: Vec3) -> f32 {
    let along = offset.dot(normal);
    if along > 0.0 { offset.length() } else { along }
}
