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
        return Err(Error::value("number of colliders", "at most 1024", count));
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
    let needs_b = given.shape != UnicShape::Sphere as u32;
    let needs_radius = given.shape != UnicShape::HalfSpace as u32;
    if !a.is_finite() || (needs_b && !b.is_finite()) {
        let found = format_args!("{:?}, {:?}", given.a, given.b);
        return Err(Error::value("point of a collider", "finite numbers", found));
    }
    if needs_radius && !(radius_m > 0.0 && radius_m.is_finite()) {
        let found = given.radius;
        return Err(Error::value("radius of a collider", "a number above 0", found));
    }
    if given.shape == UnicShape::Sphere as u32 {
        return Ok(Collider::sphere(radius_m, a));
    }
    if given.shape == UnicShape::Capsule as u32 {
        return Ok(Collider::capsule(radius_m, a, b));
    }
    if given.shape != UnicShape::HalfSpace as u32 {
        return Err(Error::value("shape", "a value of UnicShape", given.shape));
    }
    let Some(normal) = (b - a).try_normalize() else {
        let found = format_args!("{:?} twice", given.a);
        return Err(Error::value("plane", "two different points", found));
    };
    Ok(Collider {
        shape: ColliderShape::HalfSpace,
        world_from_collider: Rigid::new(Quat::from_rotation_arc(Vec3::Y, normal), a),
    })
}
