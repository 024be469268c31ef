//! What a touched surface does to one particle in one substep.

use glam::Vec3;

/// Coulomb friction: dimensionless coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Largest tangential over normal force while nothing slides.
    pub r#static: f32,
    /// Tangential over normal force while it slides; at most `static`.
    pub dynamic: f32,
}

impl Friction {
    /// No friction.
    pub const NONE: Self = Self {
        r#static: 0.0,
        dynamic: 0.0,
    };

    /// The tangential correction to a `slip` over a surface that the normal correction
    /// `pressed_m` presses against, metres both: sticks within the cone, else slides.
    #[inline]
    pub(crate) fn correction(self, slip: Vec3, pressed_m: f32) -> Vec3 {
        let length = slip.length();
        if length <= self.r#static * pressed_m {
            return -slip;
        }
        slip * -(self.dynamic * pressed_m / length).min(1.0)
    }
}

/// How a gap may change within a substep.
///
/// A gap that was open may not become negative. One that was negative before the substep may not
/// become deeper, and closes by at most `recovery_m`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Before the substep, metres; negative inside.
    pub(crate) before: f32,
    /// After it, uncorrected.
    pub(crate) after: f32,
    /// Most that is recovered, metres.
    pub(crate) recovery_m: f32,
}

/// Corrections along a surface's normal, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Push {
    /// In all.
    pub(crate) total: f32,
    /// The part that undoes an old penetration: no motion of the cloth, so that it must not
    /// become velocity, nor press for friction.
    pub(crate) recovered: f32,
}

impl Gap {
    /// What must be added to the gap; none when it is allowed as it is.
    #[inline]
    pub(crate) fn push(self) -> Option<Push> {
        let floor = self.before.min(0.0);
        let allowed = (floor + self.recovery_m).min(0.0);
        let total = allowed - self.after;
        // NaN is no contact.
        (total > 0.0).then(|| Push {
            total,
            recovered: total.min(allowed - floor),
        })
    }
}

/// A surface under a particle over one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Unit, away from the surface, after the substep.
    pub(super) normal: Vec3,
    pub(super) gap: Gap,
    /// How a particle that sticks moves in the substep, metres.
    pub(super) carried: Vec3,
    pub(super) friction: Friction,
}

impl Touch {
    /// Moves a particle out of the surface and holds it by friction; returns whether it touches.
    ///
    /// Recovery moves `previous` along, so that a velocity taken from the positions is the one
    /// that the particle had without it: leaving a penetration adds no energy.
    pub(super) fn resolve(&self, position: &mut Vec3, previous: &mut Vec3) -> bool {
        let Some(push) = self.gap.push() else {
            return false;
        };
        let relative = *position - *previous - self.carried;
        let slip = relative - self.normal * relative.dot(self.normal);
        let friction = self.friction.correction(slip, push.total - push.recovered);
        *position += self.normal * push.total + friction;
        *previous += self.normal * push.recovered;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gaps_end_open_or_no_deeper(
            before in -0.1f32..0.1, change in -0.1f32..0.1, recovery_m in 0.0f32..0.01,
        ) {
            let gap = Gap { before, after: before + change, recovery_m };
            let end = gap.after + gap.push().map_or(0.0, |push| push.total);
            prop_assert!(end >= before.min(0.0) - 1e-6);
            if let Some(push) = gap.push() {
                prop_assert!(end <= 1e-6 && push.recovered <= push.total);
                prop_assert!((0.0..=recovery_m + 1e-6).contains(&push.recovered));
            }
        }

        #[test]
        fn friction_never_reverses_a_slip_nor_leaves_its_cone(slip in 0.0f32..0.1, pressed in 0.0f32..0.1) {
            let friction = Friction { r#static: 0.6, dynamic: 0.4 };
            let correction = friction.correction(Vec3::X * slip, pressed).x;
            prop_assert!((-slip..=0.0).contains(&correction));
            prop_assert!(-correction <= 0.6 * pressed + 1e-7);
            prop_assert_eq!(slip <= 0.6 * pressed, correction == -slip);
        }
    }

    #[test]
    fn recovery_leaves_the_velocity_alone() {
        let touch = Touch {
            normal: Vec3::Y,
            gap: Gap {
                before: -0.02,
                after: -0.02,
                recovery_m: 1e-3,
            },
            carried: Vec3::ZERO,
            friction: Friction::NONE,
        };
        let (mut position, mut previous) = (Vec3::ZERO, Vec3::ZERO);
        assert!(touch.resolve(&mut position, &mut previous));
        assert!((position.y - 1e-3).abs() < 1e-8);
        assert_eq!(position, previous);
    }
}
