//! Compute pipelines, and what runs them.

use crate::{GpuContext, GpuError};
use wgpu::{BindGroup, BindGroupEntry, Buffer, ComputePipeline};

/// Invocations in a workgroup of the kernels that take one vertex each.
pub(crate) const GROUP: usize = 64;

/// A compiled entry point.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    pipeline: ComputePipeline,
    context: GpuContext,
}

/// A kernel with its buffers, ready to be recorded any number of times.
#[derive(Clone, Debug)]
pub(crate) struct Dispatch {
    pipeline: ComputePipeline,
    bindings: BindGroup,
    groups: u32,
}

/// What a kernel is compiled from.
pub(crate) struct Source<'a> {
    /// WGSL.
    pub(crate) text: &'a str,
    /// Entry point.
    pub(crate) entry: &'a str,
    /// Values of the `override` declarations that the entry point uses.
    pub(crate) constants: &'a [(&'a str, f64)],
}

impl Kernel {
    pub(crate) fn new(context: &GpuContext, source: &Source) -> Self {
        let module = context.device().create_shader_module(descriptor(source));
        Self::of(context, source, &module)
    }

    /// Without checks of indices and loops.
    ///
    /// # Safety
    /// The text indexes nothing out of bounds, and its loops end.
    pub(crate) unsafe fn unchecked(context: &GpuContext, source: &Source) -> Self {
        // SAFETY: the caller's promise.
        let module = unsafe {
            let checks = wgpu::ShaderRuntimeChecks::unchecked();
            context
                .device()
                .create_shader_module_trusted(descriptor(source), checks)
        };
        Self::of(context, source, &module)
    }

    fn of(context: &GpuContext, source: &Source, module: &wgpu::ShaderModule) -> Self {
        let pipeline = context
            .device()
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(source.entry),
                layout: None,
                module,
                entry_point: Some(source.entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: source.constants,
                    // Every kernel writes before it reads.
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            });
        Self {
            pipeline,
            context: context.clone(),
        }
    }

    /// Binds the buffers that the entry point uses, by their numbers, for so many workgroups.
    pub(crate) fn dispatch(&self, buffers: &[(u32, &Buffer)], groups: usize) -> Result<Dispatch, GpuError> {
        let device = self.context.device();
        let most = device.limits().max_compute_workgroups_per_dimension as usize;
        if groups > most {
            let what = "workgroups of a kernel";
            let found = groups;
            return Err(GpuError::TooLarge { what, most, found });
        }
        let entries: Vec<_> = (buffers.iter())
            .map(|(binding, buffer)| BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Ok(Dispatch {
            pipeline: self.pipeline.clone(),
            bindings,
            groups: groups as u32,
        })
    }
}

fn descriptor<'a>(source: &'a Source) -> wgpu::ShaderModuleDescriptor<'a> {
    wgpu::ShaderModuleDescriptor {
        label: Some(source.entry),
        source: wgpu::ShaderSource::Wgsl(source.text.into()),
    }
}

impl Dispatch {
    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(self.groups, 1, 1);
    }
}
