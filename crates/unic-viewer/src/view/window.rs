//! Window of a view.

mod inbox;
mod keys;
mod options;
mod pane;
mod recording;
mod timeline;

use super::session::ViewSession;
use super::sheet::{SheetLayout, draw_sheet};
use super::source::{ModelSource, Source};
use crate::free_name::free_name;
use crate::{
    Canvas, Pane, Quality, QualityControl, Renderer, ViewerError, WindowDevice, WindowSettings, run_window,
    window_quality,
};
use eframe::egui::{self, Color32, RichText};
use inbox::Inbox;
use recording::Recording;
use std::path::Path;
use std::sync::{Arc, mpsc::Receiver};
use std::time::Instant;
use unic_raster::Image;

/// Reads a file or folder that is dropped on the window. The error is a sentence to show.
pub type Loader = Arc<dyn Fn(&Path) -> Result<Vec<Source>, String> + Send + Sync>;

/// Change that comes from outside of the window, such as from a training.
#[derive(Clone)]
pub enum ViewUpdate {
    /// Model to show, in the place of an earlier one of its name.
    Model(ModelSource),
    /// Sentence to show.
    Message(String),
    /// The window closes.
    Close,
}

/// Contents of the window of a view.
pub struct ViewSettings {
    /// Title of the window.
    pub title: String,
    /// Session to show.
    pub session: ViewSession,
    /// Reader of dropped files.
    pub load: Loader,
    /// Changes from outside.
    pub updates: Option<Receiver<ViewUpdate>>,
}

/// Height of a caption, points.
const CAPTION: f32 = 22.0;

/// Opens the window of a view and runs it until it is closed.
///
/// # Errors
/// No display, no adapter, a device that was lost.
pub fn view_in_window(settings: ViewSettings) -> Result<(), ViewerError> {
    let window = WindowSettings {
        title: settings.title.clone(),
        size: [1280.0, 760.0],
    };
    run_window(&window, move |device, ctx| {
        ctx.set_visuals(egui::Visuals::dark());
        Ok(ViewWindow::new(device, settings))
    })
}

struct ViewWindow {
    device: WindowDevice,
    renderer: Renderer,
    session: ViewSession,
    panes: Vec<Pane>,
    inbox: Inbox,
    quality: QualityControl,
    frames: u64,
    last_frame: Option<Instant>,
    playback: Playback,
    speed: f32,
    help: Shown,
    options: Shown,
    message: String,
    recording: Option<Recording>,
}

/// Whether time goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Playback {
    Plays,
    Pauses,
}

/// Whether something is on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Yes,
    No,
}

impl Shown {
    fn toggled(self) -> Self {
        match self {
            Self::Yes => Self::No,
            Self::No => Self::Yes,
        }
    }
}

/// Whether the time of a view has moved in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moved {
    Yes,
    No,
}

impl ViewWindow {
    fn new(device: WindowDevice, settings: ViewSettings) -> Self {
        let context = device.context().clone();
        Self {
            quality: window_quality(&context),
            renderer: Renderer::new(context),
            session: settings.session,
            panes: Vec::new(),
            inbox: Inbox::new(settings.load, settings.updates),
            frames: 0,
            last_frame: None,
            playback: Playback::Plays,
            speed: 1.0,
            help: Shown::No,
            options: Shown::Yes,
            message: "H shows the keys; drop models, captures and animations here".into(),
            recording: None,
            device,
        }
    }

    /// Advances the time by that since the last frame, or by a picture of the movie that is
    /// recorded. Returns whether it has moved: it waits while paused and for predictions.
    fn advance(&mut self) -> Moved {
        let now = Instant::now();
        let before = self.last_frame.replace(now);
        let elapsed = before.map_or(0.0, |before| (now - before).as_secs_f32());
        self.frames += 1;
        // The first frames compile shaders.
        if self.frames > 10 && self.recording.is_none() {
            self.quality.frame(elapsed);
        }
        if self.playback == Playback::Pauses {
            return Moved::No;
        }
        let seconds = match self.recording {
            Some(_) => 1.0 / self.session.fps(),
            // A window that was hidden does not jump ahead.
            None => elapsed.min(0.25) * self.speed,
        };
        // Time waits for predictions, so that garments do not lag behind their bodies.
        if !self.session.is_ready(self.session.seconds() + seconds) {
            return Moved::No;
        }
        self.session.advance(seconds);
        Moved::Yes
    }

    /// Draws all panes that are shown as one picture of `size` pixels.
    fn picture(&mut self, size: [u32; 2]) -> Result<Image, ViewerError> {
        let layout = SheetLayout::new(self.session.visible().len(), size)?;
        let context = self.device.context().clone();
        let mut canvas = Canvas::new(&context, layout.pane_size(), Quality::BEST)?;
        let renderer = &mut self.renderer;
        draw_sheet(&self.session, &layout, |scene, camera| {
            renderer.draw(scene, camera, &mut canvas)?;
            canvas.read(&context)
        })
    }

    /// Saves a picture of the panes in the current folder.
    fn screenshot(&mut self, ctx: &egui::Context) {
        let size = window_pixels(ctx);
        let path = free_name("unic_view", "png");
        let saved = self.picture(size).and_then(|image| Ok(image.save_png(&path)?));
        self.message = match saved {
            Ok(()) => format!("{} written", path.display()),
            Err(error) => error.to_string(),
        };
    }

    /// Takes what has come from outside.
    fn receive(&mut self, ui: &egui::Ui) {
        let dropped = ui.input(|input| {
            let files = input.raw.dropped_files.iter();
            files.map(|file| file.path().to_owned()).collect::<Vec<_>>()
        });
        for path in dropped {
            self.message = format!("reading {}", path.display());
            self.inbox.load(path, ui.ctx());
        }
        for change in self.inbox.take() {
            let shown = match change {
                inbox::Change::Sources(name, sources) => {
                    self.session.add(sources).map(|()| format!("{name} is shown"))
                }
                inbox::Change::Message(message) => Ok(message),
                inbox::Change::Close => {
                    ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
                    continue;
                }
            };
            self.message = shown.unwrap_or_else(|error| error.to_string());
        }
    }

    fn overlay(&self, ui: &egui::Ui, region: egui::Rect) {
        let frame = egui::Frame::new()
            .fill(Color32::from_black_alpha(185))
            .corner_radius(6.0)
            .inner_margin(10.0);
        if self.help == Shown::Yes {
            egui::Area::new(egui::Id::unique("help"))
                .fixed_pos(region.min + egui::vec2(12.0, CAPTION + 12.0))
                .interactable(false)
                .show(ui.ctx(), |ui| frame.show(ui, keys::help));
        }
        if ui.input(|input| !input.raw.hovered_files.is_empty()) {
            let painter = ui.ctx().layer_painter(egui::LayerId::new(
                egui::Order::Foreground,
                egui::Id::unique("drop"),
            ));
            painter.rect_filled(region, 0.0, Color32::from_black_alpha(140));
            let font = egui::FontId::proportional(22.0);
            let text = "drop to show";
            painter.text(
                region.center(),
                egui::Align2::CENTER_CENTER,
                text,
                font,
                Color32::WHITE,
            );
        }
    }

    fn message_line(&self, ui: &mut egui::Ui) {
        let colour = Color32::from_rgb(255, 210, 120);
        let text = RichText::new(&self.message).color(colour).size(13.0);
        // Sentences about files are long.
        ui.add(egui::Label::new(text).wrap());
    }
}

impl eframe::App for ViewWindow {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.receive(ui);
        self.act(ui);
        let moved = self.advance();
        self.session.update();
        egui::Panel::bottom("timeline").show(ui, |ui| self.timeline(ui));
        if self.options == Shown::Yes {
            egui::Panel::right("options")
                .resizable(false)
                .exact_size(232.0)
                .show(ui, |ui| self.options(ui));
        }
        let region = ui.available_rect_before_wrap();
        self.draw_panes(ui);
        self.overlay(ui, region);
        if moved == Moved::Yes {
            self.record();
        }
        ui.ctx().request_repaint();
    }

    fn on_exit(&mut self) {
        if let Some(recording) = self.recording.take() {
            // There is no window left to show a failure in.
            let _ = recording.finish();
        }
    }
}

/// Size of the window, pixels.
fn window_pixels(ctx: &egui::Context) -> [u32; 2] {
    let points = ctx.content_rect().size() * ctx.pixels_per_point();
    [points.x, points.y].map(|side| side.round().max(16.0) as u32)
}
