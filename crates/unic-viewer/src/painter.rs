//! Pictures of scenes without a window.

use crate::{AdapterKind, Canvas, Quality, Renderer, Scene, ViewerError, rasterise};
use std::sync::{Arc, Mutex};
use unic_gpu::{GpuContext, wgpu};
use unic_raster::{Camera, Image};

/// Draws scenes as pictures, on a graphics adapter or by the software rasteriser.
#[derive(Debug)]
pub struct Painter {
    size: [u32; 2],
    // Boxed: a renderer is much larger than nothing.
    device: Option<Box<(Renderer, Canvas)>>,
    /// Error of the device since the last picture.
    failure: Arc<Mutex<Option<String>>>,
}

/// Choice of what draws a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PainterChoice {
    /// A graphics adapter if there is one, else the rasteriser.
    #[default]
    Auto,
    /// A graphics adapter.
    Gpu,
    /// The software rasteriser.
    Software,
}

impl Painter {
    /// Makes a painter of pictures of `size` (width, height) pixels.
    ///
    /// # Errors
    /// No adapter where one was asked for, a size that it does not draw.
    pub fn new(choice: PainterChoice, size: [u32; 2]) -> Result<Self, ViewerError> {
        let context = match choice {
            PainterChoice::Software => None,
            PainterChoice::Gpu => Some(GpuContext::new()?),
            PainterChoice::Auto => GpuContext::new().ok(),
        };
        let failure = Arc::new(Mutex::new(None));
        let Some(context) = context else {
            return Ok(Self {
                size,
                device: None,
                failure,
            });
        };
        let seen = Arc::clone(&failure);
        // Without this an error of the device ends the program.
        let keep = move |error: wgpu::Error| {
            if let Ok(mut failure) = seen.lock() {
                failure.get_or_insert(error.to_string());
            }
        };
        context.device().on_uncaptured_error(Arc::new(keep));
        let canvas = Canvas::new(&context, size, Quality::BEST)?;
        let device = Some(Box::new((Renderer::new(context), canvas)));
        Ok(Self {
            size,
            device,
            failure,
        })
    }

    /// Width and height of the pictures, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Device that draws; none is the rasteriser.
    pub fn context(&self) -> Option<&GpuContext> {
        self.device.as_ref().map(|device| device.0.context())
    }

    /// Sentence about what draws.
    pub fn description(&self) -> String {
        match self.context() {
            None => "drawn by the software rasteriser".into(),
            Some(context) => {
                let kind = match AdapterKind::of(context) {
                    AdapterKind::Hardware => "",
                    AdapterKind::Software => ", which computes on the processor",
                };
                format!("drawn by {}{kind}", context.adapter_name())
            }
        }
    }

    /// Draws a scene and waits for the picture.
    ///
    /// # Errors
    /// Shapes or colours of another length than the mesh; a lost device; a shape on a device where
    /// the rasteriser draws.
    pub fn picture(&mut self, scene: &Scene, camera: &Camera) -> Result<Image, ViewerError> {
        let Some(device) = &mut self.device else {
            return rasterise(scene, camera, self.size);
        };
        let (renderer, canvas) = &mut **device;
        renderer.draw(scene, camera, canvas)?;
        let image = canvas.read(renderer.context())?;
        match self.failure.lock().ok().and_then(|mut failure| failure.take()) {
            Some(failure) => Err(ViewerError::Device(failure)),
            None => Ok(image),
        }
    }
}
