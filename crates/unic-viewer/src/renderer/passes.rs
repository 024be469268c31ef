//! Passes of a picture: shadow maps, the picture itself, tone mapping.

use super::{Canvas, DEPTH_FORMAT, Renderer};
use crate::scene::{Scene, Shading};
use unic_gpu::wgpu;
use unic_raster::Ground;

/// Depth maps of what casts shadows, bound with the view.
#[derive(Debug)]
pub(crate) struct ShadowMaps {
    /// Depth seen from the key light.
    key: wgpu::TextureView,
    /// Depth seen from above.
    above: wgpu::TextureView,
    size: u32,
    view_group: wgpu::BindGroup,
}

impl ShadowMaps {
    pub(super) fn new(renderer: &Renderer, size: u32) -> Self {
        let device = renderer.context.device();
        let map = |size| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("shadow map"),
                size: wgpu::Extent3d {
                    width: size,
                    height: size,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: DEPTH_FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        // What is above is looked at through wide disks: few pixels do.
        let (key, above) = (map(size), map(size / 4));
        let resources = [
            renderer.view.as_entire_binding(),
            wgpu::BindingResource::TextureView(&key),
            wgpu::BindingResource::TextureView(&above),
            wgpu::BindingResource::Sampler(&renderer.compare),
        ];
        let view_group = bind(device, &renderer.layouts.view, resources);
        Self {
            key,
            above,
            size,
            view_group,
        }
    }

    /// Side of the map of the key light, pixels.
    pub(crate) fn size(&self) -> u32 {
        self.size
    }
}

/// Binds resources in the order of a layout.
pub(super) fn bind<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource; N],
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries,
    })
}

/// Pass that writes depth alone.
fn depth_attachment(view: &wgpu::TextureView, clear: f32) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(clear),
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    }
}

impl Renderer {
    pub(super) fn shadow_passes(&self, scene: &Scene, encoder: &mut wgpu::CommandEncoder) {
        // `prepare` has made both.
        let (Some(maps), Some(pipelines)) = (&self.shadows, self.pipelines.values().next()) else {
            return;
        };
        let passes = [
            (&maps.key, &pipelines.key_shadow),
            (&maps.above, &pipelines.above_shadow),
        ];
        for (map, pipeline) in passes {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                depth_stencil_attachment: Some(depth_attachment(map, 1.0)),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.shadow_group, &[]);
            pass.set_pipeline(pipeline);
            self.draw_parts(scene, &mut pass);
        }
    }

    pub(super) fn picture_pass(
        &self,
        scene: &Scene,
        marks: u32,
        canvas: &Canvas,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let Some(pipelines) = self.pipelines.get(&canvas.quality().samples.count()) else {
            return;
        };
        let Some(maps) = &self.shadows else { return };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(canvas.light_attachment())],
            depth_stencil_attachment: Some(depth_attachment(canvas.depth(), 0.0)),
            ..Default::default()
        });
        pass.set_bind_group(0, &maps.view_group, &[]);
        // What is near comes first, so that what it hides is not shaded.
        pass.set_pipeline(&pipelines.surface);
        self.draw_parts(scene, &mut pass);
        pass.set_pipeline(&pipelines.lines);
        self.draw_edges(scene, &mut pass);
        if let Ground::Height(_) = scene.ground {
            pass.set_pipeline(&pipelines.floor);
            pass.draw(0..4, 0..1);
        }
        if let Some(buffer) = &self.marks {
            pass.set_pipeline(&pipelines.mark);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..marks, 0..1);
        }
        pass.set_pipeline(&pipelines.sky);
        pass.draw(0..3, 0..1);
    }

    fn draw_parts(&self, scene: &Scene, pass: &mut wgpu::RenderPass) {
        for (i, part) in scene.parts.iter().enumerate() {
            let (Some(mesh), Some(group)) = (self.meshes.get(part), self.slots.bind_group(i)) else {
                continue;
            };
            pass.set_bind_group(1, group, &[]);
            pass.set_vertex_buffer(0, mesh.corners.slice(..));
            pass.set_index_buffer(mesh.faces.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..mesh.face_indices, 0, 0..1);
        }
    }

    fn draw_edges(&self, scene: &Scene, pass: &mut wgpu::RenderPass) {
        for (i, part) in scene.parts.iter().enumerate() {
            let (Some(mesh), Some(group)) = (self.meshes.get(part), self.slots.bind_group(i)) else {
                continue;
            };
            if part.shading == Shading::Wireframe {
                pass.set_bind_group(1, group, &[]);
                pass.set_index_buffer(mesh.edges.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..mesh.edge_indices, 0, 0..1);
            }
        }
    }

    pub(super) fn tone_pass(&self, canvas: &mut Canvas, encoder: &mut wgpu::CommandEncoder) {
        let Some(pipelines) = self.pipelines.get(&canvas.quality().samples.count()) else {
            return;
        };
        let group = canvas.tone_group(|light| {
            let resources = [
                wgpu::BindingResource::TextureView(light),
                wgpu::BindingResource::Sampler(&self.smooth),
            ];
            bind(self.context.device(), &self.layouts.tone, resources)
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone mapping"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: canvas.shown(),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(&pipelines.tone);
        pass.draw(0..3, 0..1);
    }
}
