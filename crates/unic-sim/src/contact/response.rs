//! Contact response: the correction of one particle by one surface in one substep.

use glam::Vec3;

/// Coefficients of Coulomb friction, dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Static coefficient: largest ratio of tangential to normal force without sliding.
    pub r#static: f32,
    /// Dynamic coefficient: ratio of tangential to normal force while sliding; at most `static`.
    pub dynamic: f32,
}

impl Friction {
    /// No friction.
    pub const NONE: Self = Self {
        r#static: 0.0,
        dynamic: 0.0,
    };

    /// Returns the tangential correction of a tangential displacement `slip`, in metres.
    ///
    /// `pressed_m` is the normal correction in metres, which stands for the normal force. Inside
    /// the friction cone the correction cancels the slip; outside it shortens the slip.
    #[inline]
    pub(crate) fn correction(self, slip: Vec3, pressed_m: f32) -> Vec3 {
        let length = slip.length();
        // Also the case of zero length, which must not be divided by.
        if length <= self.r#static * pressed_m {
            return -slip;
        }
        slip * -(self.dynamic * pressed_m / length).min(1.0)
    }
}

/// The gap between a particle and a surface, before and after a substep.
///
/// A gap that was open may not become negative. A gap that was negative may not become deeper, and
/// recovers by at most `recovery_m`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Gap before the substep, metres; negative for a penetration.
    pub(crate) before: f32,
    /// Gap after the substep without correction, metres.
    pub(crate) after: f32,
    /// Largest recovery from an old penetration, metres.
    pub(crate) recovery_m: f32,
}

/// The correction of a gap along the surface's normal, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalCorrection {
    /// Sum of all corrections.
    pub(crate) total: f32,
    /// Part that undoes an old penetration. It is no motion of the cloth: it must not become
    /// velocity and does not count as pressure for friction.
    pub(crate) recovered: f32,
}

impl Gap {
    /// Returns the correction that the gap needs; `None` when it needs none or is NaN.
    #[inline]
    pub(crate) fn correction(self) -> Option<NormalCorrection> {
        let floor = self.before.min(0.0);
        let allowed = (floor + self.recovery_m).min(0.0);
        let total = allowed - self.after;
        // The comparison is false for NaN.
        (total > 0.0).then(|| NormalCorrection {
            total,
            recovered: total.min(allowed - floor),
        })
    }
}

/// A contact of a particle with a surface in one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceContact {
    /// Unit normal after the substep, away from the surface.
    pub(super) normal: Vec3,
    pub(super) gap: Gap,
    /// Displacement in the substep of a particle that sticks to the surface, metres.
    pub(super) surface_motion: Vec3,
    pub(super) friction: Friction,
}

impl SurfaceContact {
    /// Moves a particle out of the surface and applies friction. Returns whether it touches.
    pub(super) fn resolve(&self, position: &mut Vec3, previous: &mut Vec3) -> bool {
        let Some(correction) = self.gap.correction() else {
            return false;
        };
        let relative = *position - *previous - self.surface_motion;
        let slip = relative - self.normal * relative.dot(self.normal);
        let friction = self
            .friction
            .correction(slip, correction.total - correction.recovered);
        *position += self.normal * correction.total + friction;
        // Recovery moves the previous position along, so that the velocity does not contain it.
        // Leaving a penetration therefore adds no energy.
        *previous += self.normal * correction.recovered;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gaps_end_open_or_no_deeper_than_before(
            before in -0.1f32..0.1, change in -0.1f32..0.1, recovery_m in 0.0f32..0.01,
        ) {
            let gap = Gap { before, after: before + change, recovery_m };
            let end = gap.after + gap.correction().map_or(0.0, |correction| correction.total);
            prop_assert!(end >= before.min(0.0) - 1e-6);
            if let Some(correction) = gap.correction() {
                prop_assert!(end <= 1e-6 && correction.recovered <= correction.total);
                prop_assert!((0.0..=recovery_m + 1e-6).contains(&correction.recovered));
            }
        }

        #[test]
        fn friction_never_reverses_a_slip_and_stays_in_its_cone(slip in 0.0f32..0.1, pressed in 0.0f32..0.1) {
            let friction = Friction { r#static: 0.6, dynamic: 0.4 };
            let correction = friction.correction(Vec3::X * slip, pressed).x;
            prop_assert!((-slip..=0.0).contains(&correction));
            prop_assert!(-correction <= 0.6 * pressed + 1e-7);
            prop_assert_eq!(slip <= 0.6 * pressed, correction == -slip);
        }
    }

    #[test]
    fn recovery_does_not_change_the_velocity() {
        let contact = SurfaceContact {
            normal: Vec3::Y,
            gap: Gap {
                before: -0.02,
                after: -0.02,
                recovery_m: 1e-3,
            },
            surface_motion: Vec3::ZERO,
            friction: Friction::NONE,
        };
        let (mut position, mut previous) = (Vec3::ZERO, Vec3::ZERO);
        assert!(contact.resolve(&mut position, &mut previous));
        assert!((position.y - 1e-3).abs() < 1e-8);
        assert_eq!(position, previous);
    }
}
