//! Window of a play.

mod frame_times;
mod gamepad;
mod input;
mod overlay;

use super::session::PlaySession;
use super::settings::PlaySettings;
use super::steering::Steering;
use crate::free_name::free_name;
use crate::{
    Canvas, FollowCamera, Pane, Quality, QualityControl, Renderer, Scene, ViewerError, WindowDevice,
    WindowSettings, run_window, window_quality,
};
use eframe::egui;
use frame_times::FrameTimes;
use gamepad::Gamepad;
use glam::{Vec2, Vec3};
use input::Input;
use std::path::Path;
use std::time::Instant;
use unic_core::motion_matching::Command;
use unic_raster::Camera;

/// Longest time that a frame makes up for, seconds. A slower display slows the play down.
const LONGEST_FRAME_S: f32 = 0.13;
/// Speeds of the wind that a key goes through, m/s.
const WINDS_M_S: [f32; 3] = [0.0, 3.0, 6.0];
/// Speed of time in slow motion.
const SLOW: f32 = 0.25;
/// Speeds of the keyboard, m/s: walking, and with Shift.
const SPEEDS_M_S: [f32; 2] = [1.4, 2.8];
/// Turn of the camera in a second at full deflection of a stick, in heights of the picture.
const GAMEPAD_TURN_PER_S: f32 = 0.5;
/// Numbers of characters that a key goes through.
const CROWDS: [usize; 4] = [1, 4, 9, 16];

/// Opens the window of a play and runs it until it is closed.
///
/// `settings` are made on the window's device, so that garments can be computed there.
///
/// # Errors
/// No display, no adapter, a device that was lost, settings that cannot be made.
pub fn play_in_window(
    make: impl FnOnce(&WindowDevice) -> Result<PlaySettings, ViewerError> + 'static,
) -> Result<(), ViewerError> {
    let settings = WindowSettings {
        title: "unic play".into(),
        size: [1120.0, 700.0],
    };
    run_window(&settings, move |device, _| {
        let session = PlaySession::new(make(&device)?)?;
        Ok(PlayWindow::new(device, session))
    })
}

struct PlayWindow {
    device: WindowDevice,
    renderer: Renderer,
    pane: Pane,
    session: PlaySession,
    camera: FollowCamera,
    input: Input,
    gamepad: Gamepad,
    quality: QualityControl,
    times: FrameTimes,
    last_frame: Option<Instant>,
    time: TimeFlow,
    wind: usize,
    help: Shown,
    message: String,
}

/// Speed of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TimeFlow {
    Normal,
    Slow,
    Paused,
}

/// Whether something is on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Yes,
    No,
}

impl PlayWindow {
    fn new(device: WindowDevice, session: PlaySession) -> Self {
        let context = device.context().clone();
        Self {
            quality: window_quality(&context),
            renderer: Renderer::new(context),
            pane: Pane::default(),
            camera: FollowCamera::new(session.centre(), session.characters()),
            input: Input::default(),
            gamepad: Gamepad::open(),
            times: FrameTimes::default(),
            last_frame: None,
            time: TimeFlow::Normal,
            wind: 0,
            help: Shown::Yes,
            message: String::new(),
            session,
            device,
        }
    }

    /// Time since the last frame, seconds.
    fn elapsed(&mut self) -> f32 {
        let now = Instant::now();
        let before = self.last_frame.replace(now);
        before.map_or(0.0, |before| (now - before).as_secs_f32())
    }

    /// Advances time, characters and camera.
    fn advance(&mut self, elapsed: f32) -> Result<(), ViewerError> {
        let speed = match self.time {
            TimeFlow::Normal => 1.0,
            TimeFlow::Slow => SLOW,
            TimeFlow::Paused => 0.0,
        };
        let steering = self.steering(elapsed);
        self.session
            .advance(elapsed.min(LONGEST_FRAME_S) * speed, steering)?;
        self.camera.follow(self.session.centre(), elapsed);
        Ok(())
    }

    /// Sticks and keys steer before the mouse does.
    fn steering(&mut self, elapsed: f32) -> Steering<'static> {
        let sticks = self.gamepad.sticks();
        let turn =
            Vec2::new(sticks.right.x, -sticks.right.y) * GAMEPAD_TURN_PER_S * elapsed.min(LONGEST_FRAME_S);
        self.camera.orbit.turn(turn);
        let (stick, speed) = match sticks.left == Vec2::ZERO {
            true => (self.input.stick(), SPEEDS_M_S[usize::from(self.input.runs())]),
            false => (sticks.left, SPEEDS_M_S[1]),
        };
        if stick != Vec2::ZERO {
            let command = Command::from_stick(stick, self.camera.orbit.view_yaw(), speed);
            return Steering::Command(command);
        }
        if !self.input.used_mouse() {
            return Steering::Command(Command::STAND);
        }
        // A mouse that points at the sky leaves the target at the character.
        Steering::Mouse {
            pointer: self.input.pointer().unwrap_or(self.session.root().position),
            buttons: self.input.buttons(),
        }
    }

    /// Does what the keys ask for.
    fn act(&mut self, ui: &egui::Ui) -> Result<(), ViewerError> {
        for key in input::pressed(ui) {
            match key {
                egui::Key::Space => self.time = toggled(self.time, TimeFlow::Paused),
                egui::Key::T => self.time = toggled(self.time, TimeFlow::Slow),
                egui::Key::H => {
                    self.help = match self.help {
                        Shown::Yes => Shown::No,
                        Shown::No => Shown::Yes,
                    }
                }
                egui::Key::R => self.session.restart_garments()?,
                egui::Key::G => self.session.wear(self.session.costume_index() + 1)?,
                egui::Key::V => {
                    self.wind = (self.wind + 1) % WINDS_M_S.len();
                    self.session.set_wind(Vec3::X * WINDS_M_S[self.wind]);
                }
                egui::Key::K => {
                    let now = self.session.characters();
                    let next = CROWDS.into_iter().find(|&count| count > now);
                    self.session.set_characters(next.unwrap_or(CROWDS[0]))?;
                    self.camera = FollowCamera::new(self.session.centre(), self.session.characters());
                }
                egui::Key::F12 | egui::Key::P => self.screenshot(),
                egui::Key::Escape => ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close),
                key => overlay::change_looks(self.session.looks_mut(), key),
            }
        }
        Ok(())
    }

    /// Saves the picture in the current folder, at the best quality and the size that is shown.
    fn screenshot(&mut self) {
        let Some(size) = self.pane.canvas().map(Canvas::size) else {
            return;
        };
        let path = free_name("unic_play", "png");
        self.message = match self.save_picture(&path, size) {
            Ok(()) => format!("{} written", path.display()),
            Err(error) => error.to_string(),
        };
    }

    fn save_picture(&mut self, path: &Path, size: [u32; 2]) -> Result<(), ViewerError> {
        let context = self.device.context().clone();
        let mut canvas = Canvas::new(&context, size, Quality::BEST)?;
        self.with_scene(|renderer, _, scene, camera| renderer.draw(scene, camera, &mut canvas))?;
        Ok(canvas.read(&context)?.save_png(path)?)
    }

    /// Does something with the scene as it is now.
    fn with_scene<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer, &mut Pane, &Scene, &Camera) -> Result<T, ViewerError>,
    ) -> Result<T, ViewerError> {
        let camera = self.camera.orbit.camera()?;
        let (renderer, pane) = (&mut self.renderer, &mut self.pane);
        self.session
            .with_scene(|scene| work(renderer, pane, scene, &camera))
    }

    fn draw(&mut self, ui: &mut egui::Ui) -> Result<egui::Response, ViewerError> {
        let (quality, device) = (self.quality.quality(), self.device.clone());
        self.with_scene(|renderer, pane, scene, camera| {
            pane.show(ui, &device, renderer, quality, scene, camera)
        })
    }

    fn frame(&mut self, ui: &mut egui::Ui) -> Result<(), ViewerError> {
        let elapsed = self.elapsed();
        // Both are of the frame before.
        self.times.push(elapsed, self.session.times());
        self.act(ui)?;
        self.advance(elapsed)?;
        let response = self.draw(ui)?;
        self.input.update(ui, &response, &mut self.camera.orbit);
        // The first frames compile shaders.
        if self.times.frames() > 10 {
            self.quality.frame(elapsed);
        }
        Ok(())
    }
}

/// Goes to `wanted`, or back to normal time if it is there already.
fn toggled(now: TimeFlow, wanted: TimeFlow) -> TimeFlow {
    if now == wanted { TimeFlow::Normal } else { wanted }
}

impl eframe::App for PlayWindow {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        if let Err(error) = self.frame(ui) {
            self.message = error.to_string();
        }
        self.overlay(ui);
        ui.ctx().request_repaint();
    }
}
