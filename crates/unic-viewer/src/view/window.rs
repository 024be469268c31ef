//! Window of a view.

mod inbox;
mod keys;
mod options;
mod recording;
mod timeline;

use super::layout::cells;
use super::quantity::Quantity;
use super::session::ViewSession;
use super::sheet::{SheetLayout, curve_colour, draw_sheet, has_curve};
use super::source::{ModelSource, Source};
use crate::{
    Canvas, Orbit, Pane, Quality, QualityControl, Renderer, ViewerError, WindowDevice, WindowSettings,
    run_window, window_quality,
};
use eframe::egui::{self, Color32, RichText};
use glam::Vec2;
use inbox::Inbox;
use recording::Recording;
use std::path::Path;
use std::sync::{Arc, mpsc::Receiver};
use std::time::Instant;
use unic_raster::{Image, heat_colour};

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
/// Pixels of the wheel for a step.
const WHEEL_STEP: f32 = 50.0;

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
    screenshots: usize,
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
            screenshots: 0,
            recording: None,
            device,
        }
    }

    /// Advances the time by that since the last frame, or by a picture of the movie that is
    /// recorded.
    fn advance(&mut self) {
        let now = Instant::now();
        let before = self.last_frame.replace(now);
        let elapsed = before.map_or(0.0, |before| (now - before).as_secs_f32());
        self.frames += 1;
        // The first frames compile shaders.
        if self.frames > 10 && self.recording.is_none() {
            self.quality.frame(elapsed);
        }
        if self.playback == Playback::Pauses {
            return;
        }
        let seconds = match self.recording {
            Some(_) => 1.0 / self.session.fps(),
            // A window that was hidden does not jump ahead.
            None => elapsed.min(0.25) * self.speed,
        };
        // Time waits for predictions, so that garments do not lag behind their bodies.
        if self.session.is_ready(self.session.seconds() + seconds) {
            self.session.advance(seconds);
        }
    }

    /// Draws the panes into the space that is left.
    fn draw_panes(&mut self, ui: &mut egui::Ui) {
        let region = ui.available_rect_before_wrap();
        let visible = self.session.visible();
        let count = self.session.tracks().len();
        self.panes.resize_with(count, Pane::default);
        let places = cells(visible.len(), [region.width(), region.height()]);
        for (&track, [left, top, width, height]) in visible.iter().zip(places) {
            let corner = region.min + egui::vec2(left, top);
            let place = egui::Rect::from_min_size(corner, egui::vec2(width, height));
            let builder = egui::UiBuilder::new().max_rect(place).id_salt(("pane", track));
            let mut ui = ui.new_child(builder);
            self.draw_pane(&mut ui, track);
        }
        ui.advance_cursor_after_rect(region);
    }

    fn draw_pane(&mut self, ui: &mut egui::Ui, track: usize) {
        let whole = ui.available_rect_before_wrap();
        let (caption, picture) = whole.split_top_bottom_at_y(whole.top() + CAPTION);
        self.draw_caption(ui, caption, track);
        let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(picture));
        ui.set_clip_rect(picture);
        let aspect = picture.aspect_ratio();
        let quality = self.quality.quality();
        let (device, renderer, pane) = (&self.device, &mut self.renderer, &mut self.panes[track]);
        let response = self.session.with_scene(track, aspect, |scene, camera| {
            pane.show(&mut ui, device, renderer, quality, scene, camera)
        });
        match response {
            Ok(response) => turn_camera(&ui, &response, self.session.camera_mut()),
            Err(error) => self.message = error.to_string(),
        }
        if self.session.quantity == Quantity::Error && has_curve(&self.session, track) {
            draw_scale(&ui, picture, self.session.heat_most_m);
        }
    }

    fn draw_caption(&self, ui: &egui::Ui, place: egui::Rect, track: usize) {
        let painter = ui.painter().with_clip_rect(place);
        painter.rect_filled(place, 0.0, Color32::from_gray(34));
        let mut left = place.left_center() + egui::vec2(8.0, 0.0);
        if has_curve(&self.session, track) {
            let [r, g, b] = curve_colour(track);
            painter.circle_filled(left + egui::vec2(4.0, 0.0), 5.0, Color32::from_rgb(r, g, b));
            left.x += 16.0;
        }
        let text = match self.session.tracks().len() {
            1 => self.session.caption(track),
            _ => format!("{}  {}", track + 1, self.session.caption(track)),
        };
        let font = egui::FontId::proportional(13.0);
        painter.text(left, egui::Align2::LEFT_CENTER, text, font, Color32::from_gray(225));
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
        let path = loop {
            self.screenshots += 1;
            let path = format!("unic_view_{:04}.png", self.screenshots);
            if !Path::new(&path).exists() {
                break path;
            }
        };
        let saved = self.picture(size).and_then(|image| Ok(image.save_png(&path)?));
        self.message = match saved {
            Ok(()) => format!("{path} written"),
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
            painter.text(region.center(), egui::Align2::CENTER_CENTER, text, font, Color32::WHITE);
        }
    }

    fn message_line(&self, ui: &mut egui::Ui) {
        let colour = Color32::from_rgb(255, 210, 120);
        ui.label(RichText::new(&self.message).color(colour).size(13.0));
    }
}

impl eframe::App for ViewWindow {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.receive(ui);
        self.act(ui);
        self.advance();
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
        self.record(ui.ctx());
        ui.ctx().request_repaint();
    }

    fn on_exit(&mut self) {
        if let Some(recording) = self.recording.take() {
            // There is no window left to show a failure in.
            let _ = recording.finish();
        }
    }
}

/// Turns, moves and zooms the camera of all panes by the mouse over one of them.
fn turn_camera(ui: &egui::Ui, response: &egui::Response, camera: &mut Orbit) {
    let height = response.rect.height().max(1.0);
    let drag = response.drag_delta() / height;
    let drag = Vec2::new(drag.x, drag.y);
    let pans = ui.input(|input| input.modifiers.shift);
    if response.dragged_by(egui::PointerButton::Primary) && !pans {
        camera.turn(drag);
    } else if response.dragged() {
        camera.pan(drag);
    }
    if response.hovered() {
        camera.zoom(ui.input(|input| input.smooth_scroll_delta().y) / WHEEL_STEP);
    }
}

/// Draws the scale of the heat map into a corner of a pane.
fn draw_scale(ui: &egui::Ui, pane: egui::Rect, most_m: f32) {
    const STEPS: usize = 48;
    let painter = ui.painter();
    let width = (pane.width() * 0.5).clamp(60.0, 180.0);
    let corner = egui::pos2(pane.left() + 14.0, pane.bottom() - 40.0);
    let back = egui::Rect::from_min_size(corner - egui::vec2(8.0, 6.0), egui::vec2(width + 16.0, 38.0));
    painter.rect_filled(back, 4.0, Color32::from_black_alpha(150));
    let step = width / STEPS as f32;
    for i in 0..STEPS {
        let [r, g, b] = heat_colour(i as f32 / (STEPS - 1) as f32).map(|c| (c * 255.0).round() as u8);
        let min = corner + egui::vec2(i as f32 * step, 0.0);
        // Half a point more, so that no gap is between the steps.
        let rect = egui::Rect::from_min_size(min, egui::vec2(step + 0.5, 10.0));
        painter.rect_filled(rect, 0.0, Color32::from_rgb(r, g, b));
    }
    let font = egui::FontId::proportional(11.0);
    let labels = [
        (0.0, egui::Align2::LEFT_TOP, "0".to_owned()),
        (0.5, egui::Align2::CENTER_TOP, format!("{:.0}", most_m * 500.0)),
        (1.0, egui::Align2::RIGHT_TOP, format!("{:.0} mm", most_m * 1e3)),
    ];
    for (share, align, text) in labels {
        let place = corner + egui::vec2(width * share, 12.0);
        painter.text(place, align, text, font.clone(), Color32::WHITE);
    }
}

/// Size of the window, pixels.
fn window_pixels(ctx: &egui::Context) -> [u32; 2] {
    let points = ctx.content_rect().size() * ctx.pixels_per_point();
    [points.x, points.y].map(|side| side.round().max(16.0) as u32)
}
