//! Text and graph over the picture of a play.

use super::{PlayWindow, Shown, TimeFlow, WINDS_M_S};
use crate::play::palette::{CLOTH_COLOURS, SKIN_COLOURS};
use crate::{AdapterKind, Fabric, Looks, Print, Quality, Shading};
use eframe::egui::{self, Color32, RichText};

const HELP: [(&str, &str); 17] = [
    ("left mouse", "walk to the pointer"),
    ("left + right", "and turn to it"),
    ("W A S D", "walk; Shift runs"),
    ("right mouse", "turn the camera"),
    ("wheel", "zoom"),
    ("G", "next garment"),
    ("F", "next fabric"),
    ("B", "next print"),
    ("C", "next colour"),
    ("J", "next colour of the body"),
    ("X", "lit, wireframe, normals"),
    ("V", "wind"),
    ("K", "more characters"),
    ("Space, T", "pause, slow motion"),
    ("R", "restart the garment"),
    ("P", "screenshot"),
    ("H, Esc", "help, quit"),
];
/// Time of a frame that the graph's line marks, seconds: 60 frames a second.
const BUDGET_S: f32 = 1.0 / 60.0;
/// Time at the top of the graph, seconds.
const GRAPH_S: f32 = 0.1;
/// Size of the graph, points.
const GRAPH: egui::Vec2 = egui::vec2(240.0, 56.0);

/// Changes the looks as a key asks for; other keys change nothing.
pub(super) fn change_looks(looks: &mut Looks, key: egui::Key) {
    let cloth = &mut looks.cloth;
    match key {
        egui::Key::F => cloth.fabric = next(&Fabric::CLOTHS, cloth.fabric),
        egui::Key::B => cloth.print = next(&Print::ALL, cloth.print),
        egui::Key::C => {
            let now = CLOTH_COLOURS.iter().position(|pair| pair[0] == cloth.colour);
            [cloth.colour, cloth.accent] = CLOTH_COLOURS[now.map_or(0, |i| (i + 1) % CLOTH_COLOURS.len())];
        }
        egui::Key::J => looks.skin.colour = next(&SKIN_COLOURS, looks.skin.colour),
        egui::Key::X => {
            let all = [Shading::Lit, Shading::Wireframe, Shading::Normals];
            looks.shading = next(&all, looks.shading);
        }
        _ => {}
    }
}

/// Element after `now`, or the first one.
fn next<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let at = all.iter().position(|&other| other == now);
    all[at.map_or(0, |i| (i + 1) % all.len())]
}

impl PlayWindow {
    /// Draws help, status and graph over the picture.
    pub(super) fn overlay(&self, ui: &mut egui::Ui) {
        let frame = egui::Frame::new()
            .fill(Color32::from_black_alpha(120))
            .corner_radius(6.0)
            .inner_margin(8.0);
        let area = |name: &str, anchor, offset: [f32; 2]| {
            egui::Area::new(egui::Id::unique(name))
                .anchor(anchor, offset)
                .interactable(false)
        };
        if self.help == Shown::Yes {
            area("help", egui::Align2::LEFT_TOP, [12.0, 12.0]).show(ui.ctx(), |ui| {
                frame.show(ui, help);
            });
        }
        area("status", egui::Align2::LEFT_BOTTOM, [12.0, -12.0]).show(ui.ctx(), |ui| {
            frame.show(ui, |ui| self.status(ui));
        });
        area("times", egui::Align2::RIGHT_TOP, [-12.0, 12.0]).show(ui.ctx(), |ui| {
            frame.show(ui, |ui| self.graph(ui));
        });
    }

    fn status(&self, ui: &mut egui::Ui) {
        let looks = self.session.costume();
        let mut words = vec![looks.outfit.name.clone()];
        words.push(match self.session.characters() {
            1 => "1 character".into(),
            count => format!("{count} characters"),
        });
        if self.wind > 0 {
            words.push(format!("wind {} m/s", WINDS_M_S[self.wind]));
        }
        words.push(match self.time {
            TimeFlow::Normal => format!("{:.1} m/s", self.session.command().velocity.length()),
            TimeFlow::Slow => "slow motion".into(),
            TimeFlow::Paused => "paused".into(),
        });
        ui.label(RichText::new(words.join("   ")).color(Color32::WHITE));
        let kind = match AdapterKind::of(self.device.context()) {
            AdapterKind::Hardware => "",
            AdapterKind::Software => " (software)",
        };
        let device = match self.session.costume().outfit.is_on_device() {
            true => "garments on the graphics device",
            false => "garments on the processor",
        };
        let step = self.quality.step();
        let quality = format!(
            "quality {} of {}",
            Quality::STEPS.len() - step,
            Quality::STEPS.len()
        );
        let name = self.device.context().device().adapter_info().name;
        let line = format!("{name}{kind}   {device}   {quality}");
        ui.label(RichText::new(line).small().color(Color32::LIGHT_GRAY));
        if !self.message.is_empty() {
            ui.label(RichText::new(&self.message).color(Color32::from_rgb(255, 210, 120)));
        }
    }

    /// Times of the last frames, with a line at 60 frames a second.
    fn graph(&self, ui: &mut egui::Ui) {
        let means = self.times.means();
        let ms = |seconds: f32| format!("{:.1}", seconds * 1e3);
        let line = format!(
            "{:.0} frames/s   motion {}   garment {}   draw {} ms",
            1.0 / means.frame_s.max(1e-4),
            ms(means.motion_s),
            ms(means.garment_s),
            ms(means.draw_s)
        );
        ui.label(RichText::new(line).small().color(Color32::WHITE));
        let (rect, _) = ui.allocate_exact_size(GRAPH, egui::Sense::hover());
        let painter = ui.painter();
        let width = rect.width() / 120.0;
        for (i, time) in self.times.iter().enumerate() {
            let height = (time.whole_s / GRAPH_S).min(1.0) * rect.height();
            let x = rect.right() - (i as f32 + 1.0) * width;
            let bar = egui::Rect::from_min_max(
                egui::pos2(x, rect.bottom() - height),
                egui::pos2(x + width * 0.8, rect.bottom()),
            );
            let colour = match time.whole_s > BUDGET_S * 1.2 {
                true => Color32::from_rgb(240, 150, 70),
                false => Color32::from_rgb(110, 200, 130),
            };
            painter.rect_filled(bar, 0.0, colour);
        }
        let y = rect.bottom() - BUDGET_S / GRAPH_S * rect.height();
        painter.hline(rect.x_range(), y, egui::Stroke::new(1.0, Color32::WHITE));
    }
}

fn help(ui: &mut egui::Ui) {
    egui::Grid::new("help").spacing([14.0, 2.0]).show(ui, |ui| {
        for (keys, what) in HELP {
            ui.label(RichText::new(keys).strong().color(Color32::WHITE));
            ui.label(RichText::new(what).color(Color32::LIGHT_GRAY));
            ui.end_row();
        }
    });
}
