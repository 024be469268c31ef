//! Axes and units of the caller.

use crate::{error::Error, options::UnicAxes};
use glam::{Quat, Vec3};

/// Whether a base turns like the right or the left hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Handedness {
    /// That of the model.
    Right,
    /// That of Unity and Unreal: rotations turn and faces wind the other way.
    Left,
}

/// Conversion between the caller's base and the model's: right-handed, +Y up, +Z ahead, metres.
///
/// Every number is multiplied by 1 or −1 and a unit, so that the model's own base gives the same
/// bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axes {
    /// Caller's axis along each axis of the model.
    axis: [usize; 3],
    /// 1, or −1 where the caller's axis points the other way.
    sign: [f32; 3],
    metres_per_unit: f32,
    units_per_metre: f32,
    handedness: Handedness,
}

impl Axes {
    /// Makes the conversion of a preset or of custom axes; `metres_per_unit` 0 is the preset's own.
    ///
    /// `custom` holds the signed number, from 1, of the caller's axis along each of the model's. Zeros
    /// are the model's axes.
    pub(crate) fn new(axes: u32, custom: [i32; 3], metres_per_unit: f32) -> Result<Self, Error> {
        let custom = match custom {
            [0, 0, 0] => [1, 2, 3],
            given => given,
        };
        let preset = [
            (UnicAxes::Model, [1, 2, 3], 1.0),
            (UnicAxes::Unity, [-1, 2, 3], 1.0),
            // Left is −Y, up is Z, ahead is X.
            (UnicAxes::Unreal, [-2, 3, 1], 0.01),
            // Left is X, up is Z, ahead is −Y.
            (UnicAxes::Blender, [1, 3, -2], 1.0),
            (UnicAxes::Custom, custom, 1.0),
        ]
        .into_iter()
        .find(|(preset, ..)| *preset as u32 == axes);
        let Some((_, numbers, own_unit)) = preset else {
            return Err(Error::value("axes", "a value of UnicAxes", axes));
        };
        let metres_per_unit = match metres_per_unit {
            0.0 => own_unit,
            given => given,
        };
        if !(1e-6..=1e6).contains(&metres_per_unit) {
            return Err(Error::value(
                "metres_per_unit",
                "0, or 1e-6 to 1e6",
                metres_per_unit,
            ));
        }
        Self::of_numbers(numbers, metres_per_unit).ok_or_else(|| {
            Error::value(
                "custom_axes",
                "1, 2 and 3 in any order and with any signs",
                format_args!("{numbers:?}"),
            )
        })
    }

    fn of_numbers(numbers: [i32; 3], metres_per_unit: f32) -> Option<Self> {
        let mut sorted = numbers.map(i32::unsigned_abs);
        sorted.sort_unstable();
        if sorted != [1, 2, 3] {
            return None;
        }
        let axis = numbers.map(|n| n.unsigned_abs() as usize - 1);
        let sign = numbers.map(|n| n.signum() as f32);
        // A cyclic order is a rotation, any other one a reflection; each sign is a reflection more.
        let cyclic = (axis[0] + 1) % 3 == axis[1];
        let reflections = sign.iter().filter(|s| **s < 0.0).count() + usize::from(!cyclic);
        Some(Self {
            axis,
            sign,
            metres_per_unit,
            // In f64, so that 0.01 gives 100 and not its neighbour.
            units_per_metre: (1.0 / f64::from(metres_per_unit)) as f32,
            handedness: match reflections % 2 {
                0 => Handedness::Right,
                _ => Handedness::Left,
            },
        })
    }

    pub(crate) fn handedness(&self) -> Handedness {
        self.handedness
    }

    /// Converts a direction of the caller.
    pub(crate) fn direction_in(&self, theirs: [f32; 3]) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|i| self.sign[i] * theirs[self.axis[i]]))
    }

    /// Converts a direction to the caller.
    pub(crate) fn direction_out(&self, ours: Vec3) -> [f32; 3] {
        let mut theirs = [0.0; 3];
        for (i, value) in ours.to_array().into_iter().enumerate() {
            theirs[self.axis[i]] = self.sign[i] * value;
        }
        theirs
    }

    /// Converts a point, a displacement or a velocity of the caller to metres.
    pub(crate) fn point_in(&self, theirs: [f32; 3]) -> Vec3 {
        self.direction_in(theirs) * self.metres_per_unit
    }

    /// Converts a point, a displacement or a velocity to the caller's unit.
    pub(crate) fn point_out(&self, ours: Vec3) -> [f32; 3] {
        self.direction_out(ours * self.units_per_metre)
    }

    /// Converts a length of the caller to metres.
    pub(crate) fn length_in(&self, theirs: f32) -> f32 {
        theirs * self.metres_per_unit
    }

    /// Converts a rotation of the caller, a quaternion x, y, z, w.
    pub(crate) fn rotation_in(&self, [x, y, z, w]: [f32; 4]) -> Quat {
        let axis = self.direction_in([x, y, z]) * self.turn();
        Quat::from_xyzw(axis.x, axis.y, axis.z, w)
    }

    /// Converts a rotation to the caller.
    pub(crate) fn rotation_out(&self, ours: Quat) -> [f32; 4] {
        let [x, y, z] = self.direction_out(ours.xyz() * self.turn());
        [x, y, z, ours.w]
    }

    /// Sign of angles: in a mirror a rotation turns the other way about the mirrored axis.
    fn turn(&self) -> f32 {
        match self.handedness {
            Handedness::Right => 1.0,
            Handedness::Left => -1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All bases: 48 of them.
    fn all() -> Vec<Axes> {
        let orders = [[1, 2, 3], [2, 3, 1], [3, 1, 2], [1, 3, 2], [3, 2, 1], [2, 1, 3]];
        let signed = |order: [i32; 3], bits: usize| {
            let sign = |i: usize| if bits >> i & 1 == 0 { 1 } else { -1 };
            std::array::from_fn(|i| sign(i) * order[i])
        };
        orders
            .into_iter()
            .flat_map(|order| (0..8).map(move |bits| signed(order, bits)))
            .map(|custom| Axes::new(UnicAxes::Custom as u32, custom, 0.5).unwrap())
            .collect()
    }

    #[test]
    fn conversions_there_and_back_change_nothing() {
        let (point, turn) = (Vec3::new(0.3, -1.7, 2.9), Quat::from_xyzw(0.1, 0.7, -0.5, 0.5));
        for axes in all() {
            assert_eq!(axes.point_in(axes.point_out(point)), point);
            assert_eq!(axes.direction_in(axes.direction_out(point)), point);
            assert_eq!(axes.rotation_in(axes.rotation_out(turn)), turn);
        }
    }

    /// A point that is turned and then converted is where a converted point is turned to.
    #[test]
    fn rotations_turn_converted_points() {
        let (point, turn) = (
            Vec3::new(0.3, -1.7, 2.9),
            Quat::from_xyzw(0.1, 0.7, -0.5, 0.5).normalize(),
        );
        for axes in all() {
            let theirs = Vec3::from_array(axes.point_out(point));
            let [x, y, z, w] = axes.rotation_out(turn);
            // The formula of quaternions is the same in both bases.
            let turned = Quat::from_xyzw(x, y, z, w) * theirs;
            let expected = Vec3::from_array(axes.point_out(turn * point));
            assert!(turned.distance(expected) < 1e-5, "{axes:?}");
        }
    }

    /// The cross product, in the formula of right-handed bases, of two converted vectors is the
    /// converted one, or in left-handed bases its opposite.
    #[test]
    fn handedness_is_that_of_the_cross_product() {
        for axes in all() {
            let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| Vec3::from_array(axes.direction_out(v)));
            let expected = match axes.handedness() {
                Handedness::Right => z,
                Handedness::Left => -z,
            };
            assert_eq!(x.cross(y), expected, "{axes:?}");
        }
    }

    #[test]
    fn presets_are_those_of_the_engines() {
        let up_left_ahead = |preset: UnicAxes| {
            let axes = Axes::new(preset as u32, [0; 3], 0.0).unwrap();
            [Vec3::Y, Vec3::X, Vec3::Z].map(|v| axes.point_out(v))
        };
        assert_eq!(
            up_left_ahead(UnicAxes::Unity),
            [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
        );
        assert_eq!(
            up_left_ahead(UnicAxes::Unreal),
            [[0.0, 0.0, 100.0], [0.0, -100.0, 0.0], [100.0, 0.0, 0.0]]
        );
        assert_eq!(
            up_left_ahead(UnicAxes::Blender),
            [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
        );
        let handedness = |preset: UnicAxes| Axes::new(preset as u32, [0; 3], 0.0).unwrap().handedness();
        assert_eq!(handedness(UnicAxes::Blender), Handedness::Right);
        assert_eq!(handedness(UnicAxes::Unity), Handedness::Left);
        assert_eq!(handedness(UnicAxes::Unreal), Handedness::Left);
    }

    #[test]
    fn unusable_axes_are_refused() {
        for custom in [[0, 2, 3], [1, 1, 3], [1, 2, 4], [i32::MIN, 2, 3]] {
            assert!(Axes::new(UnicAxes::Custom as u32, custom, 1.0).is_err());
        }
        assert!(Axes::new(99, [1, 2, 3], 1.0).is_err());
        for unit in [-1.0, f32::NAN, f32::INFINITY, 1e-9] {
            assert!(Axes::new(0, [1, 2, 3], unit).is_err());
        }
    }
}
