//! Instances: garments in motion.

use crate::{
    axes::Axes,
    collider::{UnicCollider, read_colliders},
    error::{Error, guard},
    memory::{check_pointer, write},
    mesh::{MeshLayout, UnicMesh},
    model::{MODELS, UnicModel},
    options::{Options, UnicOptions, UnicPrecision},
    pose::PoseReader,
    registry::Registry,
    status::UnicStatus,
};
use glam::Vec3;
use std::sync::{Arc, Mutex, TryLockError};
use unic_core::{Animator, Collider, Model, Start, StepInput, TickInterpolator};

/// One garment in motion. One thread at a time may use it; another one gets UNIC_STATUS_IN_USE.
///
/// A handle, not a pointer: it is never dereferenced.
pub struct UnicInstance {
    _private: [u8; 0],
}

pub(crate) static INSTANCES: Registry<Mutex<Instance>> = Registry::new("instance");

/// State and buffers behind a [`UnicInstance`].
pub(crate) struct Instance {
    pub(crate) animator: Animator,
    pub(crate) display: TickInterpolator,
    pub(crate) axes: Axes,
    pub(crate) poses: PoseReader,
    pub(crate) garment: MeshLayout,
    pub(crate) body: MeshLayout,
    /// Start positions in metres, of a reset that gives them.
    pub(crate) start_positions: Vec<Vec3>,
    pub(crate) body_positions: Vec<Vec3>,
    pub(crate) body_normals: Vec<Vec3>,
    /// Checksum of the model's file.
    pub(crate) checksum: u32,
    /// Bytes of the state that was saved last.
    pub(crate) saved: Vec<u8>,
    colliders: Vec<Collider>,
}

impl Instance {
    fn new(model: Arc<Model>, checksum: u32, options: Options) -> Result<Self, Error> {
        let axes = options.axes;
        let layout = |mesh| MeshLayout::new(mesh, options.vertex_layout, &axes);
        let mut instance = Self {
            poses: PoseReader::new(&model, axes),
            garment: layout(&model.garment().rest),
            body: layout(&model.character().body),
            animator: Animator::new(Arc::clone(&model)),
            display: TickInterpolator::default(),
            axes,
            start_positions: Vec::new(),
            body_positions: Vec::new(),
            body_normals: Vec::new(),
            checksum,
            saved: Vec::new(),
            colliders: Vec::new(),
        };
        instance.animator.set_threads(options.threads);
        if let Some(mode) = options.intersection {
            instance.animator.set_intersection(mode);
        }
        // Every later call finds a garment.
        let bind_pose = model.character().skeleton.bind_pose();
        let input = StepInput {
            pose: &bind_pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        instance.animator.reset(&input, Start::MeanShape)?;
        instance.display.cut(&instance.animator);
        Ok(instance)
    }

    /// Layout of a mesh by the value of a [`UnicMesh`].
    pub(crate) fn mesh(&self, mesh: u32) -> Result<&MeshLayout, Error> {
        match mesh {
            mesh if mesh == UnicMesh::Garment as u32 => Ok(&self.garment),
            mesh if mesh == UnicMesh::Body as u32 => Ok(&self.body),
            mesh => Err(Error::value("mesh", "a value of UnicMesh", mesh)),
        }
    }
}

/// Runs a call on an instance, which no other call may use at the same time.
pub(crate) fn with(
    instance: *const UnicInstance,
    work: impl FnOnce(&mut Instance) -> Result<(), Error>,
) -> UnicStatus {
    guard(|| {
        let shared = INSTANCES.get(instance)?;
        let mut instance = shared.try_lock().map_err(|e| match e {
            TryLockError::WouldBlock => Error::InUse,
            // A panic has interrupted a call, and left anything behind.
            TryLockError::Poisoned(_) => Error::Broken,
        })?;
        work(&mut instance)
    })
}

/// Makes an instance of a model, at rest in the rest pose. Null options are the defaults.
///
/// `instance` gets the handle, which unic_instance_release ends. The first instance with a precision
/// or a sampling packs the model for it, which takes longer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_create(
    model: *const UnicModel,
    options: *const UnicOptions,
    instance: *mut *mut UnicInstance,
) -> UnicStatus {
    guard(|| {
        let shared = MODELS.get(model)?;
        check_pointer("instance", instance)?;
        // SAFETY: passed on.
        let options = unsafe { Options::read(options) }?;
        let model = shared.variant(options.precision.of(&shared.model), options.sampling)?;
        let made = Instance::new(model, shared.checksum, options)?;
        let handle = INSTANCES.insert(Arc::new(Mutex::new(made)));
        // SAFETY: checked above.
        unsafe { write("instance", instance, handle) }
    })
}

/// Ends an instance, and returns at once. A call on another thread that is at work with it goes on:
/// its buffers, and the context of parallel_for, must stay until it has returned.
#[unsafe(no_mangle)]
pub extern "C" fn unic_instance_release(instance: *const UnicInstance) -> UnicStatus {
    guard(|| INSTANCES.release(instance))
}

/// Writes the precision of an instance, which UNIC_PRECISION_AUTO has chosen or the caller, and
/// whether single precision, which is exact, is faster here: 1, else 0. Either place may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_precision(
    instance: *const UnicInstance,
    precision: *mut u32,
    is_slower_than_f32: *mut u32,
) -> UnicStatus {
    with(instance, |instance| {
        let model = instance.animator.model();
        let (found, width) = (model.precision(), model.config().field.width);
        let given = UnicPrecision::from(found) as u32;
        let slower = u32::from(found.is_slower_than_f32(width));
        let places = [
            ("precision", precision, given),
            ("is_slower_than_f32", is_slower_than_f32, slower),
        ];
        let wanted = || places.into_iter().filter(|(_, place, _)| !place.is_null());
        // Both before either is written: a call that fails changes nothing.
        wanted().try_for_each(|(what, place, _)| check_pointer(what, place))?;
        // SAFETY: passed on.
        wanted().try_for_each(|(what, place, value)| unsafe { write(what, place, value) })
    })
}

/// Sets ground and props, from the next step on; resets keep them. At most 1024.
///
/// UNIC_INTERSECTION_ROBUST moves shown vertices out of them. Other rules ignore them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_set_colliders(
    instance: *const UnicInstance,
    colliders: *const UnicCollider,
    count: usize,
) -> UnicStatus {
    with(instance, |instance| {
        let read = &mut instance.colliders;
        // SAFETY: passed on.
        unsafe { read_colliders(&instance.axes, colliders, count, read) }?;
        instance.animator.set_colliders(read.iter().cloned());
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{error::unic_last_error, model::unic_model_from_bytes, model::unic_model_release};
    use std::{ffi::CStr, ptr::null_mut};

    #[test]
    fn a_panic_is_a_code_and_breaks_the_instance_alone() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../apps/unic-cli/garments/tshirt.unic"
        );
        let bytes = std::fs::read(path).unwrap();
        let (mut model, mut instance, mut other) = (null_mut(), null_mut(), null_mut());
        // SAFETY: bytes of their length, places for handles.
        unsafe {
            let status = unic_model_from_bytes(bytes.as_ptr().cast(), bytes.len(), &mut model);
            assert_eq!(status, UnicStatus::Ok);
            for place in [&mut instance, &mut other] {
                assert_eq!(
                    unic_instance_create(model, std::ptr::null(), place),
                    UnicStatus::Ok
                );
            }
        }
        assert_eq!(with(instance, |_| panic!("on {}", "purpose")), UnicStatus::Panic);
        // SAFETY: a text that is never null.
        let text = unsafe { CStr::from_ptr(unic_last_error()) };
        assert_eq!(text, c"fault of the library: on purpose");
        assert_eq!(with(instance, |_| Ok(())), UnicStatus::Broken);
        assert_eq!(with(other, |_| Ok(())), UnicStatus::Ok);
        for released in [instance, other] {
            assert_eq!(unic_instance_release(released), UnicStatus::Ok);
        }
        assert_eq!(unic_model_release(model), UnicStatus::Ok);
    }
}
