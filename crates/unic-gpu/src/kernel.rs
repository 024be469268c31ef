//! Compute kernels: pipelines, and dispatches with their buffers.

use crate::{GpuContext, GpuError};
use wgpu::{BindGroup, BindGroupEntry, Buffer, ComputePipeline};

/// Number of invocations in a workgroup of the kernels with one invocation a vertex.
pub(crate) const GROUP: usize = 64;

/// Compiled entry point.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    pipeline: ComputePipeline,
    context: GpuContext,
}

/// Kernel with its buffers, which can be recorded any number of times.
#[derive(Clone, Debug)]
pub(crate) struct Dispatch {
    pipeline: ComputePipeline,
    bindings: BindGroup,
    groups: u32,
}

/// Source of a kernel.
pub(crate) struct Source<'a> {
    /// Text in WGSL.
    pub(crate) text: &'a str,
    /// Name of the entry point.
    pub(crate) entry: &'a str,
    /// Values of the `override` declarations that the entry point uses.
    pub(crate) constants: &'a [(&'a str, f64)],
}

impl Kernel {
    pub(crate) fn new(context: &GpuContext, source: &Source) -> Self {
        let module = context.device().create_shader_module(descriptor(source));
        Self::compile(context, source, &module)
    }

    /// Compiles a kernel without run-time checks of indices and loops, which cost time.
    ///
    /// # Safety
    /// The text must index nothing out of bounds, and its loops must end.
    pub(crate) unsafe fn unchecked(context: &GpuContext, source: &Source) -> Self {
        // SAFETY: the caller promises what the checks would ensure.
        let module = unsafe {
            let checks = wgpu::ShaderRuntimeChecks::unchecked();
            context
                .device()
                .create_shader_module_trusted(descriptor(source), checks)
        };
        Self::compile(context, source, &module)
    }

    fn compile(context: &GpuContext, source: &Source, module: &wgpu::ShaderModule) -> Self {
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

    /// Binds the buffers that the entry point uses, by their binding numbers, for a number of
    /// workgroups.
    ///
    /// # Errors
    /// Fails when a dispatch may not have as many workgroups.
    pub(crate) fn dispatch(&self, buffers: &[(u32, &Buffer)], groups: usize) -> Result<Dispatch, GpuError> {
        let device = self.context.device();
        let limit = device.limits().max_compute_workgroups_per_dimension as usize;
        if groups > limit {
            return Err(GpuError::TooLarge {
                what: "the workgroups of a kernel",
                limit,
                found: groups,
            });
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
