//! Renderer on wgpu: draws a [`Scene`] to a texture.

mod canvas;
mod gpu_mesh;
mod layouts;
mod passes;
mod pipelines;
mod slots;
mod uniforms;

pub use canvas::Canvas;

use crate::{Quality, Scene, ViewerError};
use gpu_mesh::MeshCache;
use layouts::Layouts;
use passes::{ShadowMaps, bind};
use pipelines::Pipelines;
use slots::Slots;
use std::collections::HashMap;
use unic_gpu::{GpuContext, wgpu};
use unic_raster::Camera;
use uniforms::{MarkPoint, ViewUniform};

/// Format of the light that is drawn, before tone mapping.
const LIGHT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Format of depth. It is reversed: 1 is near, 0 infinitely far.
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Format of shown pictures. Its values are sRGB already.
const SHOWN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Draws scenes to [`Canvas`]es on a device.
///
/// Shadows of a key light and of the sky, cloth with threads, a floor, tone mapping. Meshes stay on
/// the device for as long as their owner keeps them.
#[derive(Debug)]
pub struct Renderer {
    context: GpuContext,
    layouts: Layouts,
    /// Pipelines for each number of samples of a pixel.
    pipelines: HashMap<u32, Pipelines>,
    meshes: MeshCache,
    slots: Slots,
    shadows: Option<ShadowMaps>,
    view: wgpu::Buffer,
    /// View alone, for passes that write the shadow maps.
    shadow_group: wgpu::BindGroup,
    /// Corners of marks, reused from picture to picture.
    marks: Option<wgpu::Buffer>,
    compare: wgpu::Sampler,
    smooth: wgpu::Sampler,
}

impl Renderer {
    /// Makes a renderer on a device.
    pub fn new(context: GpuContext) -> Self {
        let device = context.device();
        let layouts = Layouts::new(device);
        let view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<ViewUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let linear = wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        };
        let smooth = device.create_sampler(&linear);
        let compare = device.create_sampler(&wgpu::SamplerDescriptor {
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..linear
        });
        let slots = Slots::new(device);
        let shadow_group = bind(device, &layouts.shadow, [view.as_entire_binding()]);
        Self {
            layouts,
            pipelines: HashMap::new(),
            meshes: MeshCache::default(),
            slots,
            shadows: None,
            view,
            shadow_group,
            marks: None,
            compare,
            smooth,
            context,
        }
    }

    /// Device on which the renderer draws.
    pub fn context(&self) -> &GpuContext {
        &self.context
    }

    /// Draws a scene to a canvas. The call returns when the work is submitted.
    ///
    /// # Errors
    /// Shapes or colours of another length than the mesh, too little memory on the device.
    pub fn draw(&mut self, scene: &Scene, camera: &Camera, canvas: &mut Canvas) -> Result<(), ViewerError> {
        for part in scene.parts {
            part.check()?;
        }
        self.prepare(canvas.quality());
        self.meshes.keep(self.context.device(), scene.parts);
        self.slots.upload(&self.context, &self.layouts, scene.parts);
        let uniform = ViewUniform::new(scene, camera, canvas);
        let marks = self.upload_marks(scene);
        let (device, queue) = (self.context.device(), self.context.queue());
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&uniform));
        let mut encoder = device.create_command_encoder(&Default::default());
        self.shadow_passes(scene, &mut encoder);
        self.picture_pass(scene, marks, canvas, &mut encoder);
        self.tone_pass(canvas, &mut encoder);
        queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Makes the pipelines and shadow maps of a quality.
    fn prepare(&mut self, quality: Quality) {
        let (device, layouts) = (self.context.device(), &self.layouts);
        let samples = quality.samples.count();
        self.pipelines
            .entry(samples)
            .or_insert_with(|| Pipelines::new(device, layouts, samples));
        if self.shadows.as_ref().map(ShadowMaps::size) != Some(quality.shadow_size) {
            self.shadows = Some(ShadowMaps::new(self, quality.shadow_size));
        }
    }

    /// Uploads the marks. Returns the number of their corners.
    fn upload_marks(&mut self, scene: &Scene) -> u32 {
        let points: Vec<MarkPoint> = scene.marks.iter().flat_map(MarkPoint::of_mark).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&points);
        let fits = |buffer: &wgpu::Buffer| buffer.size() >= bytes.len() as u64;
        if !self.marks.as_ref().is_some_and(fits) {
            self.marks = Some(self.context.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("marks"),
                size: (bytes.len() as u64).next_power_of_two().max(4096),
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        if let Some(buffer) = &self.marks {
            self.context.queue().write_buffer(buffer, 0, bytes);
        }
        points.len() as u32
    }
}
