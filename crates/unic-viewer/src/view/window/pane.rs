//! Panes in the window, with their captions and the scale of the heat map.

use super::{CAPTION, ViewWindow};
use crate::view::{
    Quantity,
    layout::cells,
    sheet::{curve_colour, has_curve},
};
use crate::{Orbit, Pane};
use eframe::egui::{self, Color32};
use glam::Vec2;
use unic_raster::heat_colour;

/// Pixels of the wheel for a step.
const WHEEL_STEP: f32 = 50.0;

impl ViewWindow {
    /// Draws the panes into the space that is left.
    pub(super) fn draw_panes(&mut self, ui: &mut egui::Ui) {
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
        painter.text(
            left,
            egui::Align2::LEFT_CENTER,
            text,
            font,
            Color32::from_gray(225),
        );
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
