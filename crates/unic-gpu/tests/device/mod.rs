//! Device on which the tests run.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "every test binary uses a part of it"
)]

use std::sync::{Arc, OnceLock};
use unic_core::Model;
use unic_gpu::{GpuAnimator, GpuContext, GpuError, GpuModel, Precision, wgpu};

/// Returns one device for all tests, if this machine has any.
pub fn context() -> Option<GpuContext> {
    static CONTEXT: OnceLock<Option<GpuContext>> = OnceLock::new();
    let make = || match GpuContext::new() {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter(why)) => {
            eprintln!("skipped: no adapter that computes ({why})");
            None
        }
        Err(other) => panic!("{other}"),
    };
    CONTEXT.get_or_init(make).clone()
}

/// Returns a caller's own device with the default limits of WebGPU, if this machine has any device.
pub fn context_with_default_limits() -> Option<GpuContext> {
    context()?;
    let (device, queue) = pollster::block_on(async {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance.request_adapter(&Default::default()).await.unwrap();
        adapter.request_device(&Default::default()).await.unwrap()
    });
    Some(GpuContext::from_device(device, queue))
}

/// Returns a device with matrix units, if this machine's device has any.
pub fn context_with_matrix_units() -> Option<GpuContext> {
    let name = context()?.adapter_name();
    let context = GpuContext::with_matrix_units().unwrap();
    if !context.has_matrix_units() {
        eprintln!("skipped: {name} has no matrix units");
        return None;
    }
    Some(context)
}

pub fn gpu_animator(context: &GpuContext, model: &Arc<Model>, precision: Precision) -> GpuAnimator {
    let asset = GpuModel::new(context, Arc::clone(model), precision).unwrap();
    GpuAnimator::new(Arc::new(asset)).unwrap()
}
