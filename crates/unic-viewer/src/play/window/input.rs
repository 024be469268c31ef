//! Mouse and keyboard of a play.

use crate::Orbit;
use eframe::egui;
use glam::Vec2;
use unic_core::motion_matching::MouseButtons;

/// State of the devices.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Input {
    stick: Vec2,
    runs: bool,
    buttons: MouseButtons,
    /// Place on the floor under the mouse, (x, z) metres.
    pointer: Option<Vec2>,
    /// Whether the mouse was the last device that steered.
    used_mouse: bool,
}

/// Pixels of the wheel for a step.
const WHEEL_STEP: f32 = 50.0;

impl Input {
    /// Reads the devices. Drags of the right button turn the camera, the wheel zooms.
    pub(super) fn update(&mut self, ui: &egui::Ui, response: &egui::Response, camera: &mut Orbit) {
        let rect = response.rect;
        ui.input(|input| {
            let held = |key| f32::from(u8::from(input.key_down(key)));
            use egui::Key;
            let right = held(Key::D).max(held(Key::ArrowRight)) - held(Key::A).max(held(Key::ArrowLeft));
            let forward = held(Key::W).max(held(Key::ArrowUp)) - held(Key::S).max(held(Key::ArrowDown));
            self.stick = Vec2::new(right, forward);
            self.runs = input.modifiers.shift;
            let pointer = &input.pointer;
            let inside = pointer.latest_pos().filter(|&place| rect.contains(place));
            let (left, right) = (pointer.primary_down(), pointer.secondary_down());
            self.buttons = match (left && inside.is_some(), right) {
                (true, true) => MouseButtons::LeftAndRight,
                (true, false) => MouseButtons::Left,
                (false, _) => MouseButtons::Released,
            };
            self.used_mouse = match self.buttons {
                MouseButtons::Released => self.used_mouse && self.stick == Vec2::ZERO,
                _ => true,
            };
            self.pointer = inside.and_then(|place| on_floor(camera, rect, place));
            if right && !left {
                let drag = pointer.delta() / rect.height().max(1.0);
                camera.turn(Vec2::new(drag.x, drag.y));
            }
            camera.zoom(input.smooth_scroll_delta().y / WHEEL_STEP);
        });
    }

    /// Deflection of the keys, (right, forward).
    pub(super) fn stick(&self) -> Vec2 {
        self.stick
    }

    /// Whether the character is asked to run.
    pub(super) fn runs(&self) -> bool {
        self.runs
    }

    pub(super) fn buttons(&self) -> MouseButtons {
        self.buttons
    }

    pub(super) fn pointer(&self) -> Option<Vec2> {
        self.pointer
    }

    /// Whether the mouse was the last device that steered.
    pub(super) fn used_mouse(&self) -> bool {
        self.used_mouse
    }
}

/// Place on the floor, (x, z) metres, that is seen at a place of the window.
fn on_floor(camera: &Orbit, rect: egui::Rect, place: egui::Pos2) -> Option<Vec2> {
    let camera = camera.camera().ok()?;
    let share = (place - rect.min) / rect.size();
    let [right, up, forward] = camera.ray_axes(rect.aspect_ratio());
    let ray = right * (2.0 * share.x - 1.0) + up * (1.0 - 2.0 * share.y) + forward;
    let distance = -camera.eye().y / ray.y;
    let point = camera.eye() + ray * distance;
    // Above the horizon there is no floor.
    (distance > 0.0 && point.is_finite()).then(|| Vec2::new(point.x, point.z))
}

/// Lists the keys that were pressed since the last frame.
pub(super) fn pressed(ui: &egui::Ui) -> Vec<egui::Key> {
    let key = |event: &egui::Event| match event {
        egui::Event::Key {
            key,
            pressed: true,
            repeat: false,
            ..
        } => Some(*key),
        _ => None,
    };
    ui.input(|input| input.events.iter().filter_map(key).collect())
}
