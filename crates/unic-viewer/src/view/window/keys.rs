//! Keys of a view.

use super::{Playback, Shown, ViewWindow};
use crate::view::{CameraMotion, PaneChoice, Quantity};
use eframe::egui::{self, Color32, Key, RichText};

const HELP: [(&str, &str); 14] = [
    ("left mouse", "turn the camera of all panes"),
    ("right mouse", "move the camera"),
    ("wheel", "zoom"),
    ("Space", "play or pause"),
    ("left, right", "frame before or after; Shift: 10 frames"),
    ("Home", "first frame"),
    ("1 to 9, 0", "one pane alone, all panes"),
    ("X, Shift+X", "next or last quantity"),
    (
        "E, W, N, I, K",
        "error, wireframe, normals, intersections, weights",
    ),
    ("F", "camera follows or stays"),
    ("O", "options"),
    ("P", "screenshot"),
    ("M", "start or end a movie"),
    ("H, Esc", "help, quit"),
];

/// Lists the keys.
pub(super) fn help(ui: &mut egui::Ui) {
    egui::Grid::new("help").spacing([14.0, 3.0]).show(ui, |ui| {
        for (keys, what) in HELP {
            ui.label(RichText::new(keys).strong().color(Color32::WHITE));
            ui.label(RichText::new(what).color(Color32::LIGHT_GRAY));
            ui.end_row();
        }
    });
}

impl ViewWindow {
    /// Does what the keys ask for.
    pub(super) fn act(&mut self, ui: &egui::Ui) {
        // Keys that go to a text field are no commands.
        if ui.ctx().text_edit_focused() {
            return;
        }
        let pressed = ui.input(|input| {
            let key = |event: &egui::Event| match event {
                egui::Event::Key {
                    key,
                    pressed: true,
                    modifiers,
                    ..
                } => Some((*key, modifiers.shift)),
                _ => None,
            };
            input.events.iter().filter_map(key).collect::<Vec<_>>()
        });
        for (key, shift) in pressed {
            self.press(key, shift, ui.ctx());
        }
    }

    fn press(&mut self, key: Key, shift: bool, ctx: &egui::Context) {
        match key {
            Key::Space => self.playback = self.playback.toggled(),
            Key::ArrowLeft => self.step(if shift { -10 } else { -1 }),
            Key::ArrowRight => self.step(if shift { 10 } else { 1 }),
            Key::Home => self.session.set_seconds(0.0),
            Key::X => self.session.quantity = turned(self.session.quantity, shift),
            Key::E => self.toggle(Quantity::Error),
            Key::W => self.toggle(Quantity::Wireframe),
            Key::N => self.toggle(Quantity::Normals),
            Key::I => self.toggle(Quantity::Intersections),
            Key::K => self.toggle(Quantity::Weights),
            Key::F => {
                self.session.camera_motion = match self.session.camera_motion {
                    CameraMotion::Follows => CameraMotion::Stays,
                    CameraMotion::Stays => CameraMotion::Follows,
                }
            }
            Key::O => self.options = self.options.toggled(),
            Key::P | Key::F12 => self.screenshot(ctx),
            Key::M => self.toggle_recording(ctx),
            Key::H => self.help = self.help.toggled(),
            Key::Escape if self.help == Shown::Yes => self.help = Shown::No,
            Key::Escape => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            key => self.choose_pane(key),
        }
    }

    /// Pauses at another frame.
    pub(super) fn step(&mut self, frames: i32) {
        self.playback = Playback::Pauses;
        self.session.step(frames);
    }

    /// Shows a quantity, or the materials if it is shown already.
    fn toggle(&mut self, quantity: Quantity) {
        let shown = &mut self.session.quantity;
        *shown = if *shown == quantity {
            Quantity::Lit
        } else {
            quantity
        };
    }

    fn choose_pane(&mut self, key: Key) {
        const DIGITS: [Key; 10] = [
            Key::Num0,
            Key::Num1,
            Key::Num2,
            Key::Num3,
            Key::Num4,
            Key::Num5,
            Key::Num6,
            Key::Num7,
            Key::Num8,
            Key::Num9,
        ];
        let Some(digit) = DIGITS.iter().position(|&other| other == key) else {
            return;
        };
        let chosen = digit.checked_sub(1).map(PaneChoice::Only);
        self.session.panes = match chosen {
            Some(chosen) if chosen != self.session.panes && digit <= self.session.tracks().len() => chosen,
            _ => PaneChoice::All,
        };
    }
}

impl Playback {
    pub(super) fn toggled(self) -> Self {
        match self {
            Self::Plays => Self::Pauses,
            Self::Pauses => Self::Plays,
        }
    }
}

/// Quantity after `now`, or before it.
fn turned(now: Quantity, backwards: bool) -> Quantity {
    let count = Quantity::ALL.len();
    let at = Quantity::ALL.iter().position(|&other| other == now).unwrap_or(0);
    let step = if backwards { count - 1 } else { 1 };
    Quantity::ALL[(at + step) % count]
}
