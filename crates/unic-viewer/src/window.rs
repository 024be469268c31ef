//! Windows: adapter, device and event loop.

use crate::{Canvas, Quality, QualityControl, Renderer, Scene, ViewerError};
use eframe::egui;
use eframe::egui_wgpu::{self, RenderState};
use std::cell::RefCell;
use std::panic::{self, AssertUnwindSafe};
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::thread;
use unic_gpu::{GpuContext, wgpu};
use unic_raster::Camera;

/// Title and size of a window.
#[derive(Clone, Debug)]
pub struct WindowSettings {
    /// Title.
    pub title: String,
    /// Width and height, points.
    pub size: [f32; 2],
}

/// Device of a window, for renderers and garments.
#[derive(Clone)]
pub struct WindowDevice {
    context: GpuContext,
    state: RenderState,
}

/// Kind of an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterKind {
    /// Hardware.
    Hardware,
    /// Driver that computes on the processor.
    Software,
}

impl AdapterKind {
    /// Kind of the adapter of a device.
    pub fn of(context: &GpuContext) -> Self {
        match context.device().adapter_info().device_type {
            wgpu::DeviceType::Cpu => Self::Software,
            _ => Self::Hardware,
        }
    }
}

impl WindowDevice {
    /// Device and queue.
    pub fn context(&self) -> &GpuContext {
        &self.context
    }
}

/// Opens a window and runs an application until the window is closed.
///
/// # Errors
/// No display, no adapter, an error of `make`, or a device that was lost.
///
/// # Panics
/// With the application. The panic hook is replaced while the window is open.
pub fn run_window<A: eframe::App + 'static>(
    settings: &WindowSettings,
    make: impl FnOnce(WindowDevice, &egui::Context) -> Result<A, ViewerError> + 'static,
) -> Result<(), ViewerError> {
    let failure = Failure::default();
    let seen = failure.clone();
    // An error of `make` is no error of the window.
    let refused = Rc::new(RefCell::new(None));
    let refusing = Rc::clone(&refused);
    let options = options(settings);
    let creator: eframe::AppCreator = Box::new(move |creation| {
        let state = creation.wgpu_render_state.clone();
        let state = state.ok_or("the window has no graphics device")?;
        let context = GpuContext::from_device(state.device.clone(), state.queue.clone());
        watch(&context, &creation.egui_ctx, seen.clone());
        match make(WindowDevice { context, state }, &creation.egui_ctx) {
            Ok(app) => Ok(Box::new(Watched { app, failure: seen }) as Box<dyn eframe::App>),
            Err(error) => {
                let text = error.to_string();
                *refusing.borrow_mut() = Some(error);
                Err(text.into())
            }
        }
    });
    let run = catching_panics(&failure, || eframe::run_native(&settings.title, options, creator));
    let lost = failure.take();
    if let Some(error) = refused.take() {
        return Err(error);
    }
    match (lost, run) {
        (Some(message), _) => Err(ViewerError::Device(message)),
        (None, Ok(Err(error))) => Err(ViewerError::Window(reason(&error))),
        (None, Ok(Ok(()))) => Ok(()),
        (None, Err(panic)) => panic::resume_unwind(panic),
    }
}

/// Reason why there is no window, without places in the source of libraries.
fn reason(error: &eframe::Error) -> String {
    match error {
        eframe::Error::WinitEventLoop(_) => "expected a display, found none".into(),
        eframe::Error::Winit(_) => "expected a window of the display, found none".into(),
        eframe::Error::Wgpu(_) => "expected a graphics adapter for the display, found none".into(),
        other => other.to_string(),
    }
}

/// First failure of a device.
#[derive(Clone, Default)]
struct Failure(Arc<Mutex<Option<String>>>);

impl Failure {
    fn set(&self, message: String) {
        if let Ok(mut failure) = self.0.lock() {
            failure.get_or_insert(message);
        }
    }

    fn is_set(&self) -> bool {
        self.0.lock().is_ok_and(|failure| failure.is_some())
    }

    fn take(&self) -> Option<String> {
        self.0.lock().ok().and_then(|mut failure| failure.take())
    }
}

/// Runs a window, and catches its panics. Once the device has failed those of this thread print
/// nothing: wgpu panics where it frees the picture of a window that was not shown any more.
fn catching_panics<T>(failure: &Failure, run: impl FnOnce() -> T) -> thread::Result<T> {
    let (failure, before) = (failure.clone(), Arc::new(panic::take_hook()));
    let (hook, window) = (Arc::clone(&before), thread::current().id());
    panic::set_hook(Box::new(move |info| {
        if !failure.is_set() || thread::current().id() != window {
            hook(info);
        }
    }));
    let result = panic::catch_unwind(AssertUnwindSafe(run));
    panic::set_hook(Box::new(move |info| before(info)));
    result
}

/// Application that shows nothing any more once the device has failed: egui's renderer panics where
/// it has something to upload.
struct Watched<A> {
    app: A,
    failure: Failure,
}

impl<A: eframe::App> eframe::App for Watched<A> {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if !self.failure.is_set() {
            self.app.ui(ui, frame);
        }
        if self.failure.is_set() {
            ui.ctx()
                .graphics_mut(|graphics| *graphics = egui::layers::GraphicLayers::default());
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn on_exit(&mut self) {
        self.app.on_exit();
    }
}

/// Closes the window when the device fails.
fn watch(context: &GpuContext, window: &egui::Context, failure: Failure) {
    let window = window.clone();
    let fail = Arc::new(move |message: String| {
        failure.set(message);
        window.send_viewport_cmd(egui::ViewportCommand::Close);
    });
    let on_error = Arc::clone(&fail);
    let device = context.device();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| on_error(error.to_string())));
    device.set_device_lost_callback(move |reason, message| {
        // The end of the program destroys the device too.
        if reason != wgpu::DeviceLostReason::Destroyed {
            fail(message);
        }
    });
}

fn options(settings: &WindowSettings) -> eframe::NativeOptions {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(|adapter: &wgpu::Adapter| wgpu::DeviceDescriptor {
        label: Some("unic"),
        required_features: adapter.features() & GpuContext::USEFUL_FEATURES,
        // All that the adapter has: more workgroup memory allows larger tiles and wider fields.
        required_limits: adapter.limits(),
        ..Default::default()
    });
    eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_inner_size(settings.size)
            .with_min_inner_size([320.0, 240.0]),
        renderer: eframe::Renderer::Wgpu,
        wgpu_options: egui_wgpu::WgpuConfiguration {
            wgpu_setup: setup.into(),
            ..Default::default()
        },
        ..Default::default()
    }
}

/// Part of a window in which a scene is shown.
#[derive(Default)]
pub struct Pane {
    canvas: Option<Canvas>,
    texture: Option<egui::TextureId>,
}

impl Pane {
    /// Draws a scene at the size of the space that is left in `ui`, and shows it there.
    ///
    /// The returned response senses clicks and drags. Without space nothing is drawn.
    ///
    /// # Errors
    /// Errors of the renderer.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        device: &WindowDevice,
        renderer: &mut Renderer,
        quality: Quality,
        scene: &Scene,
        camera: &Camera,
    ) -> Result<egui::Response, ViewerError> {
        let points = ui.available_size();
        let (rect, response) = ui.allocate_exact_size(points, egui::Sense::click_and_drag());
        let pixels = points * ui.ctx().pixels_per_point();
        let size = [pixels.x.round() as u32, pixels.y.round() as u32];
        // A minimised window has no pixels.
        if size.contains(&0) {
            return Ok(response);
        }
        let fits = |canvas: &Canvas| canvas.size() == size && canvas.quality() == quality;
        if !self.canvas.as_ref().is_some_and(fits) {
            let canvas = Canvas::new(&device.context, size, quality)?;
            self.register(device, &canvas);
            self.canvas = Some(canvas);
        }
        if let (Some(canvas), Some(texture)) = (&mut self.canvas, self.texture) {
            renderer.draw(scene, camera, canvas)?;
            let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
            ui.painter().image(texture, rect, whole, egui::Color32::WHITE);
        }
        Ok(response)
    }

    /// Picture that is shown, if there is one.
    pub fn canvas(&self) -> Option<&Canvas> {
        self.canvas.as_ref()
    }

    /// Tells the window's renderer about the texture of a canvas.
    fn register(&mut self, device: &WindowDevice, canvas: &Canvas) {
        let mut windows = device.state.renderer.write();
        let (gpu, filter) = (&device.state.device, wgpu::FilterMode::Linear);
        match self.texture {
            Some(id) => windows.update_egui_texture_from_wgpu_texture(gpu, canvas.shown(), filter, id),
            None => self.texture = Some(windows.register_native_texture(gpu, canvas.shown(), filter)),
        }
    }
}

/// Quality control for a window on an adapter: 24 frames a second on hardware, which leaves room for
/// slow displays, and 15 on software.
pub fn window_quality(context: &GpuContext) -> QualityControl {
    match AdapterKind::of(context) {
        AdapterKind::Hardware => QualityControl::new(1.0 / 24.0),
        AdapterKind::Software => QualityControl::new(1.0 / 15.0).from_step(2),
    }
}
