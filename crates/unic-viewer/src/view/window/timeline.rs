//! Timeline: play button, time, drift curves, progress of predictions.

use super::{Playback, ViewWindow};
use crate::view::sheet::{curve_colour, has_curve, top_of_curves};
use eframe::egui::{self, Color32, RichText, Stroke, pos2};

/// Height of the curves, points.
const CHART: f32 = 64.0;
/// Height of the bar of a prediction's progress, points.
const BAR: f32 = 3.0;
/// Longest curve that is drawn point by point; longer ones are thinned.
const POINTS: usize = 1200;

impl ViewWindow {
    /// Draws the timeline. Dragging over it goes to a time.
    pub(super) fn timeline(&mut self, ui: &mut egui::Ui) {
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            let label = match self.playback {
                Playback::Plays => "Pause",
                Playback::Pauses => "Play",
            };
            if ui.add_sized([64.0, 20.0], egui::Button::new(label)).clicked() {
                self.playback = self.playback.toggled();
            }
            let (seconds, duration) = (self.session.seconds(), self.session.duration());
            let frame = (seconds * self.session.fps() + 1e-3) as usize;
            let time = format!("{seconds:6.2} s of {duration:.2} s, frame {frame}");
            ui.label(RichText::new(time).monospace());
            ui.add_space(8.0);
            let speed = egui::Slider::new(&mut self.speed, 0.1..=2.0)
                .text("speed")
                .step_by(0.1);
            ui.add(speed);
        });
        self.message_line(ui);
        let size = egui::vec2(
            ui.available_width(),
            CHART + self.predictions() as f32 * (BAR + 1.0),
        );
        let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click_and_drag());
        if let Some(place) = response.interact_pointer_pos() {
            let share = (place.x - rect.left()) / rect.width().max(1.0);
            self.session.set_seconds(share * self.session.duration());
        }
        self.draw_chart(ui.painter(), rect);
        ui.add_space(4.0);
    }

    fn predictions(&self) -> usize {
        let all = self.session.tracks().iter();
        all.filter(|track| track.progress().is_some()).count()
    }

    fn draw_chart(&self, painter: &egui::Painter, rect: egui::Rect) {
        painter.rect_filled(rect, 3.0, Color32::from_gray(18));
        let duration = self.session.duration().max(1e-6);
        let chart = egui::Rect::from_min_size(rect.min, egui::vec2(rect.width(), CHART))
            .shrink2(egui::vec2(0.0, 4.0));
        let tracks = 0..self.session.tracks().len();
        let curves: Vec<(usize, Vec<f32>)> = tracks
            .filter(|&track| has_curve(&self.session, track))
            .map(|track| (track, self.session.tracks()[track].rmse_m()))
            .collect();
        let small = egui::FontId::proportional(11.0);
        let grey = Color32::from_gray(170);
        if let Some(most_m) = top_of_curves(curves.iter().map(|(_, curve)| curve.as_slice())) {
            for (track, curve) in &curves {
                self.draw_curve(painter, chart, (*track, curve), most_m);
            }
            let text = format!("{:.0} mm RMSE", most_m * 1e3);
            painter.text(
                chart.left_top() + egui::vec2(6.0, 0.0),
                egui::Align2::LEFT_TOP,
                text,
                small,
                grey,
            );
        } else {
            let text = "no ground truth: no error over time";
            painter.text(
                chart.center(),
                egui::Align2::CENTER_CENTER,
                text,
                small,
                Color32::from_gray(110),
            );
        }
        let mut top = rect.top() + CHART;
        for (i, track) in self.session.tracks().iter().enumerate() {
            let Some(progress) = track.progress() else {
                continue;
            };
            let (frames, fps) = self.session.rate(i);
            let share = frames as f32 / fps / duration * progress.done as f32 / progress.all.max(1) as f32;
            let bar =
                egui::Rect::from_min_size(pos2(rect.left(), top), egui::vec2(rect.width() * share, BAR));
            let [r, g, b] = curve_colour(i);
            painter.rect_filled(bar, 0.0, Color32::from_rgb(r, g, b).gamma_multiply(0.7));
            top += BAR + 1.0;
        }
        let x = rect.left() + self.session.seconds() / duration * rect.width();
        painter.vline(x, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
    }

    fn draw_curve(
        &self,
        painter: &egui::Painter,
        chart: egui::Rect,
        (track, curve): (usize, &[f32]),
        most_m: f32,
    ) {
        let (frames, fps) = self.session.rate(track);
        let width = chart.width() * frames as f32 / fps / self.session.duration().max(1e-6);
        let place = |(frame, &value): (usize, &f32)| {
            let x = chart.left() + width * frame as f32 / frames.max(1) as f32;
            pos2(
                x,
                chart.bottom() - chart.height() * (value / most_m).clamp(0.0, 1.0),
            )
        };
        let every = curve.len().div_ceil(POINTS).max(1);
        let finite = curve.iter().enumerate().filter(|(_, value)| value.is_finite());
        let points: Vec<egui::Pos2> = finite.step_by(every).map(place).collect();
        let [r, g, b] = curve_colour(track);
        painter.line(points, Stroke::new(1.5, Color32::from_rgb(r, g, b)));
    }
}
