//! Options beside the panes: quantity, looks, times.

use super::ViewWindow;
use crate::view::{CameraMotion, Quantity, TrackKind};
use crate::{AdapterKind, Fabric, Print, Quality};
use eframe::egui::{self, Color32, RichText};

impl ViewWindow {
    /// Draws the options.
    pub(super) fn options(&mut self, ui: &mut egui::Ui) {
        egui::ScrollArea::vertical().show(ui, |ui| {
            ui.add_space(6.0);
            self.quantity_options(ui);
            ui.separator();
            self.looks_options(ui);
            ui.separator();
            self.camera_options(ui);
            ui.separator();
            self.stage_times(ui);
            self.device_line(ui);
        });
    }

    fn quantity_options(&mut self, ui: &mut egui::Ui) {
        ui.label(RichText::new("Show").strong());
        egui::Grid::new("quantities").num_columns(2).show(ui, |ui| {
            for (i, quantity) in Quantity::ALL.into_iter().enumerate() {
                ui.radio_value(&mut self.session.quantity, quantity, quantity.name());
                if i % 2 == 1 {
                    ui.end_row();
                }
            }
        });
        if self.session.quantity == Quantity::Error {
            let mut most_mm = self.session.heat_most_m * 1e3;
            let slider = egui::Slider::new(&mut most_mm, 1.0..=300.0).logarithmic(true);
            ui.add(slider.suffix(" mm").max_decimals(0));
            self.session.heat_most_m = most_mm * 1e-3;
        }
    }

    fn looks_options(&mut self, ui: &mut egui::Ui) {
        let looks = &mut self.session.looks;
        ui.label(RichText::new("Looks").strong());
        egui::Grid::new("looks")
            .num_columns(2)
            .spacing([12.0, 5.0])
            .show(ui, |ui| {
                ui.label("body");
                colour(ui, &mut looks.skin.colour);
                ui.end_row();
                ui.label("garment");
                ui.horizontal(|ui| {
                    colour(ui, &mut looks.cloth.colour);
                    colour(ui, &mut looks.cloth.accent);
                });
                ui.end_row();
                ui.label("fabric");
                let fabric = egui::ComboBox::from_id_salt("fabric").selected_text(looks.cloth.fabric.name());
                fabric.show_ui(ui, |ui| {
                    for fabric in Fabric::CLOTHS {
                        ui.selectable_value(&mut looks.cloth.fabric, fabric, fabric.name());
                    }
                });
                ui.end_row();
                ui.label("print");
                let print = egui::ComboBox::from_id_salt("print").selected_text(looks.cloth.print.name());
                print.show_ui(ui, |ui| {
                    for print in Print::ALL {
                        ui.selectable_value(&mut looks.cloth.print, print, print.name());
                    }
                });
                ui.end_row();
            });
    }

    fn camera_options(&mut self, ui: &mut egui::Ui) {
        let mut follows = self.session.camera_motion == CameraMotion::Follows;
        ui.checkbox(&mut follows, "camera follows");
        self.session.camera_motion = match follows {
            true => CameraMotion::Follows,
            false => CameraMotion::Stays,
        };
        ui.horizontal(|ui| {
            if ui.button("Screenshot").clicked() {
                self.screenshot(&ui.ctx().clone());
            }
            let label = match self.recording {
                Some(_) => "End movie",
                None => "Movie",
            };
            if ui.button(label).clicked() {
                self.toggle_recording(&ui.ctx().clone());
            }
        });
    }

    /// Lists how long the stages of each model's step take.
    fn stage_times(&self, ui: &mut egui::Ui) {
        let predictions = self.session.tracks().iter();
        for track in predictions.filter(|track| track.kind() == TrackKind::Prediction) {
            let Some(progress) = track.progress() else {
                continue;
            };
            ui.label(RichText::new(track.name()).strong());
            if progress.stages.steps() == 0 {
                ui.label("no step yet");
                continue;
            }
            egui::Grid::new(("stages", track.name()))
                .num_columns(2)
                .spacing([18.0, 1.0])
                .show(ui, |ui| {
                    for (stage, ms) in progress.stages.mean_ms() {
                        time_row(ui, stage.name(), ms, Color32::from_gray(170));
                    }
                    time_row(ui, "a step", progress.stages.step_ms(), Color32::WHITE);
                });
            ui.add_space(6.0);
        }
    }

    fn device_line(&self, ui: &mut egui::Ui) {
        let kind = match AdapterKind::of(self.device.context()) {
            AdapterKind::Hardware => "",
            AdapterKind::Software => " (software)",
        };
        let name = self.device.context().device().adapter_info().name;
        let (step, all) = (self.quality.step(), Quality::STEPS.len());
        let line = format!("{name}{kind}, quality {} of {all}", all - step);
        let grey = Color32::from_gray(140);
        ui.label(RichText::new(line).small().color(grey));
        ui.label(RichText::new("garments on the processor").small().color(grey));
    }
}

/// Button that chooses a colour. Colours of materials are floats in sRGB, those of the button bytes.
fn colour(ui: &mut egui::Ui, colour: &mut [f32; 3]) {
    let mut bytes = colour.map(|channel| (channel * 255.0).round() as u8);
    if ui.color_edit_button_srgb(&mut bytes).changed() {
        *colour = bytes.map(|channel| f32::from(channel) / 255.0);
    }
}

fn time_row(ui: &mut egui::Ui, name: &str, ms: f64, colour: Color32) {
    ui.label(RichText::new(name).size(12.0).color(colour));
    ui.label(
        RichText::new(format!("{ms:7.3} ms"))
            .monospace()
            .size(12.0)
            .color(colour),
    );
    ui.end_row();
}
