//! Data of the parts of a scene on the device: a slot for each part.

use crate::renderer::layouts::Layouts;
use crate::renderer::uniforms::PartUniform;
use crate::scene::{Part, Shape};
use crate::vertex::Vertex;
use unic_gpu::{GpuContext, wgpu};

/// Slots, which are reused from picture to picture.
#[derive(Debug)]
pub(crate) struct Slots {
    slots: Vec<Slot>,
    /// Bound where a part has no colours.
    no_colours: wgpu::Buffer,
}

#[derive(Debug)]
struct Slot {
    part: wgpu::Buffer,
    vertices: Option<wgpu::Buffer>,
    colours: Option<wgpu::Buffer>,
    bound: Option<Bound>,
    /// Colours as bytes; kept so that pictures allocate little.
    bytes: Vec<[u8; 4]>,
}

/// Buffers that are bound, and their bind group. It is made again when one of them is another.
#[derive(Debug)]
struct Bound {
    /// Vertices now and before, colours.
    buffers: [wgpu::Buffer; 3],
    group: wgpu::BindGroup,
}

impl Slots {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        Self {
            slots: Vec::new(),
            no_colours: storage(device, "no colours", 4),
        }
    }

    /// Uploads what is in memory and binds what is on the device.
    pub(crate) fn upload(&mut self, context: &GpuContext, layouts: &Layouts, parts: &[Part]) {
        let device = context.device();
        self.slots.truncate(parts.len());
        while self.slots.len() < parts.len() {
            self.slots.push(Slot::new(device));
        }
        for (slot, part) in self.slots.iter_mut().zip(parts) {
            slot.upload(context, part);
            slot.bind(device, layouts, part, &self.no_colours);
        }
    }

    /// Bind group of a part.
    pub(crate) fn bind_group(&self, part: usize) -> Option<&wgpu::BindGroup> {
        self.slots.get(part)?.bound.as_ref().map(|bound| &bound.group)
    }
}

impl Slot {
    fn new(device: &wgpu::Device) -> Self {
        let part = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("part"),
            size: size_of::<PartUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            part,
            vertices: None,
            colours: None,
            bound: None,
            bytes: Vec::new(),
        }
    }

    fn upload(&mut self, context: &GpuContext, part: &Part) {
        let queue = context.queue();
        queue.write_buffer(&self.part, 0, bytemuck::bytes_of(&PartUniform::new(part)));
        if let Shape::Host(vertices) = part.shape {
            let bytes: &[u8] = bytemuck::cast_slice::<Vertex, u8>(vertices);
            write(context, &mut self.vertices, "vertices", bytes);
        }
        if let Some(colours) = part.colours {
            let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
            self.bytes.clear();
            let bytes = colours.iter().map(|c| [byte(c[0]), byte(c[1]), byte(c[2]), 255]);
            self.bytes.extend(bytes);
            write(
                context,
                &mut self.colours,
                "colours",
                bytemuck::cast_slice(&self.bytes),
            );
        }
    }

    fn bind(&mut self, device: &wgpu::Device, layouts: &Layouts, part: &Part, no_colours: &wgpu::Buffer) {
        let (now, before) = match part.shape {
            Shape::Host(_) => (self.vertices.as_ref(), self.vertices.as_ref()),
            Shape::Device { before, now, .. } => (Some(now), Some(before)),
        };
        let (Some(now), Some(before)) = (now, before) else {
            return;
        };
        let colours = match (part.colours, &self.colours) {
            (Some(_), Some(buffer)) => buffer,
            _ => no_colours,
        };
        let buffers = [now, before, colours].map(Clone::clone);
        if self.bound.as_ref().is_some_and(|bound| bound.buffers == buffers) {
            return;
        }
        let all = std::iter::once(&self.part).chain(&buffers);
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(all)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("part"),
            layout: &layouts.part,
            entries: &entries,
        });
        self.bound = Some(Bound { buffers, group });
    }
}

/// Writes bytes into a buffer, which is replaced where it has another size.
fn write(context: &GpuContext, buffer: &mut Option<wgpu::Buffer>, label: &str, bytes: &[u8]) {
    // A binding may not be empty.
    let size = bytes.len().max(4) as u64;
    if buffer.as_ref().map(wgpu::Buffer::size) != Some(size) {
        *buffer = Some(storage(context.device(), label, size));
    }
    if let Some(buffer) = buffer {
        context.queue().write_buffer(buffer, 0, bytes);
    }
}

fn storage(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
