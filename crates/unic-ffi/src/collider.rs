//! Ground and props of the caller.

use crate::{
    axes::Axes,
    error::Error,
    memory::{Plain, read},
};
use glam::{Quat, Vec3};
use unic_core::{Collider, collider::ColliderShape, transform::Rigid};

/// Shape of a collider.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicShape {
    /// Everything behind the plane through `a` that faces `b`. For the ground, `b` is above `a`.
    HalfSpace = 0,
    /// Ball around `a`.
    Sphere = 1,
    /// Capsule with an axis from `a` to `b`.
    Capsule = 2,
}

/// Ground or prop that the robust intersection rules keep the garment out of, in the instance's
/// axes and unit.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicCollider {
    /// A UnicShape.
    pub shape: u32,
    /// Radius of a ball or a capsule.
    pub radius: f32,
    /// First point.
    pub a: [f32; 3],
    /// Second point.
    pub b: [f32; 3],
}

// SAFETY: eight numbers of 4 bytes.
unsafe impl Plain for UnicCollider {}
const _: () = assert!(size_of::<UnicCollider>() == 8 * 4, "padding");

/// Largest number of colliders. Every vertex is compared with every one of them.
const MOST_COLLIDERS: usize = 1024;

/// Reads the colliders of the caller into `out`.
///
/// # Safety
/// `colliders` is null, misaligned or points to `count` colliders.
pub(crate) unsafe fn read_colliders(
    axes: &Axes,
    colliders: *const UnicCollider,
    count: usize,
    out: &mut Vec<Collider>,
) -> Result<(), Error> {
    if count > MOST_COLLIDERS {
        return Err(Error::Value {
            what: "number of colliders",
            expected: "at most 1024",
            found: count.to_string(),
        });
    }
    out.clear();
    for i in 0..count {
        // SAFETY: within the array, by this function's contract; a null array is refused at its
        // first item.
        let given = unsafe { read("colliders", colliders.wrapping_add(i)) }?;
        out.push(collider(axes, &given)?);
    }
    Ok(())
}

fn collider(axes: &Axes, given: &UnicCollider) -> Result<Collider, Error> {
    let [a, b] = [given.a, given.b].map(|p| axes.point_in(p));
    let radius_m = axes.length_in(given.radius);
    let value = |what, expected, found: String| {
        Err(Error::Value {
            what,
            expected,
            found,
        })
    };
    let needs_b = given.shape != UnicShape::Sphere as u32;
    let needs_radius = given.shape != UnicShape::HalfSpace as u32;
    if !a.is_finite() || (needs_b && !b.is_finite()) {
        return value(
            "point of a collider",
            "finite numbers",
            format!("{:?}, {:?}", given.a, given.b),
        );
    }
    if needs_radius && !(radius_m > 0.0 && radius_m.is_finite()) {
        return value(
            "radius of a collider",
            "a number above 0",
            given.radius.to_string(),
        );
    }
    if given.shape == UnicShape::Sphere as u32 {
        return Ok(Collider::sphere(radius_m, a));
    }
    if given.shape == UnicShape::Capsule as u32 {
        return Ok(Collider::capsule(radius_m, a, b));
    }
    if given.shape != UnicShape::HalfSpace as u32 {
        return value("shape", "a value of UnicShape", given.shape.to_string());
    }
    let Some(normal) = (b - a).try_normalize() else {
        return value("plane", "two different points", format!("{:?} twice", given.a));
    };
    Ok(Collider {
        shape: ColliderShape::HalfSpace,
        world_from_collider: Rigid::new(Quat::from_rotation_arc(Vec3::Y, normal), a),
    })
}
