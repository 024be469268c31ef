//! Texture that is drawn to.

use super::{DEPTH_FORMAT, LIGHT_FORMAT, SHOWN_FORMAT};
use crate::{Quality, ViewerError};
use unic_gpu::{GpuContext, wgpu};
use unic_raster::Image;

/// Picture on a device, with the buffers that drawing it needs.
#[derive(Debug)]
pub struct Canvas {
    size: [u32; 2],
    /// Size of the picture that is drawn: smaller where the quality says so.
    drawn: [u32; 2],
    quality: Quality,
    /// Light with several samples a pixel; none with one sample.
    sampled: Option<wgpu::TextureView>,
    light: wgpu::TextureView,
    depth: wgpu::TextureView,
    texture: wgpu::Texture,
    shown: wgpu::TextureView,
}

impl Canvas {
    /// Makes a canvas of `width` × `height` pixels.
    ///
    /// # Errors
    /// A side of zero, or one that the device does not draw.
    pub fn new(context: &GpuContext, size: [u32; 2], quality: Quality) -> Result<Self, ViewerError> {
        let device = context.device();
        let most = device.limits().max_texture_dimension_2d;
        let [width, height] = size;
        if size.iter().any(|&side| side == 0 || side > most) {
            return Err(ViewerError::Size { most, width, height });
        }
        let drawn = size.map(|side| ((side as f32 * quality.scale).round() as u32).max(1));
        let samples = quality.samples.count();
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = attachment | wgpu::TextureUsages::TEXTURE_BINDING;
        let make = |size, format, samples, usage| texture(device, size, format, samples, usage);
        let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
        let shown_usage = readable | wgpu::TextureUsages::COPY_SRC;
        let texture = make(drawn, SHOWN_FORMAT, 1, shown_usage);
        Ok(Self {
            size,
            drawn,
            quality,
            sampled: (samples > 1).then(|| view(make(drawn, LIGHT_FORMAT, samples, attachment))),
            light: view(make(drawn, LIGHT_FORMAT, 1, readable)),
            depth: view(make(drawn, DEPTH_FORMAT, samples, attachment)),
            shown: texture.create_view(&Default::default()),
            texture,
        })
    }

    /// Width and height of the place that the picture fills, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Width by height.
    pub fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// Quality of the pictures that are drawn to it.
    pub fn quality(&self) -> Quality {
        self.quality
    }

    /// Shown picture: `Rgba8Unorm` with values in sRGB. It is smaller than [`size`](Self::size) where
    /// the quality says so.
    pub fn shown(&self) -> &wgpu::TextureView {
        &self.shown
    }

    pub(crate) fn light(&self) -> &wgpu::TextureView {
        &self.light
    }

    pub(crate) fn depth(&self) -> &wgpu::TextureView {
        &self.depth
    }

    /// Attachment that is cleared and, with several samples, resolved.
    pub(crate) fn light_attachment(&self) -> wgpu::RenderPassColorAttachment<'_> {
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
            store: match self.sampled {
                Some(_) => wgpu::StoreOp::Discard,
                None => wgpu::StoreOp::Store,
            },
        };
        let (view, resolve_target) = match &self.sampled {
            Some(sampled) => (sampled, Some(&self.light)),
            None => (&self.light, None),
        };
        wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops,
        }
    }

    /// Blocks until the picture is drawn, and copies it as large as it was drawn.
    ///
    /// # Errors
    /// A lost device; a picture that is too large for [`Image`].
    pub fn read(&self, context: &GpuContext) -> Result<Image, ViewerError> {
        let [width, height] = self.drawn;
        // Rows of a copy begin at multiples of 256 bytes.
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = self.download(context, row)?;
        let mut image = Image::filled(width, height, [0; 3])?;
        let rows = bytes.chunks_exact(row as usize);
        for (from, to) in rows.zip(image.pixels_mut().chunks_exact_mut(width as usize)) {
            for (from, to) in from.chunks_exact(4).zip(to) {
                to.copy_from_slice(&from[..3]);
            }
        }
        Ok(image)
    }

    fn download(&self, context: &GpuContext, row: u32) -> Result<Vec<u8>, ViewerError> {
        let device = context.device();
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(self.drawn[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout,
            },
            self.texture.size(),
        );
        context.queue().submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Sending fails only without a receiver, which lives until it has the result.
            let _ = sender.send(result);
        });
        context.wait()?;
        let lost = |e: &dyn std::fmt::Display| ViewerError::Device(e.to_string());
        receiver.recv().map_err(|e| lost(&e))?.map_err(|e| lost(&e))?;
        let view = buffer.get_mapped_range(..).map_err(|e| lost(&e))?;
        Ok(view.to_vec())
    }
}

fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("canvas"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
