//! The finished model, and what it tells about its training.

use super::Trainer;
use crate::{
    config::Keep,
    error::TrainError,
    event::Control,
    network::model_layers,
    validation::{JUDGED_S, Validation, ValidationMotion, free_running_rmse_of},
};
use serde_json::json;
use std::sync::Arc;
use unic_core::{
    config::{IntersectionMode, StateConfig},
    model::{About, Model, ModelParts},
};
use unic_eval::{CodeCertainty, PreparedClip};

/// How much of the field's output is tried on clips held out, the whole of it first.
const FIELD_SHARES: [f32; 5] = [1.0, 0.75, 0.5, 0.25, 0.0];

impl Trainer {
    /// The model as the settings want it kept: the last or the best parameters, averaged or not, its field
    /// as far as [the validation](Trainer::set_validation) believes it.
    ///
    /// # Errors
    /// None for a run that has not diverged.
    pub fn model(&self) -> Result<Model, TrainError> {
        self.model_of(
            &self.kept(),
            self.validation.as_ref().map_or(1.0, |v| v.field_share),
        )
    }

    /// [`Trainer::model`], whose file also tells how far the training motions decide its code.
    ///
    /// # Errors
    /// As [`Trainer::model`].
    pub fn measured_model(&self) -> Result<Model, TrainError> {
        let model = self.model()?;
        let Some(code) = CodeCertainty::measure(&model, &self.data.clips) else {
            return Ok(model);
        };
        let mut parts = model.to_parts();
        parts.about.training["code"] = json!(code);
        Ok(Model::new(parts)?)
    }

    /// Measures the model on the clips held out; none in a fit on all clips.
    ///
    /// A field that moves a displacement from its prior can learn its training motions by heart, and does where they
    /// are few. So several shares of its output are tried, each for [`JUDGED_S`] seconds of a clip without intersections
    /// handled, which takes most of the time, and the best one is the validation's: its error is a little too small,
    /// for it was chosen there. A lone clip, which is trained on too, cannot tell.
    ///
    /// # Errors
    /// The errors of [`Trainer::run`]; [`TrainError::Stopped`] where `proceed`, asked before each frame, says stop.
    pub fn validation(&self, proceed: &dyn Fn() -> Control) -> Result<Option<Validation>, TrainError> {
        if !self.validates() {
            return Ok(None);
        }
        let parameters = self.kept();
        let clips = &self.data.validation;
        let mut proceed = || proceed();
        let mut best: Option<(f64, f32)> = None;
        for &field_share in self.field_shares() {
            let model = Arc::new(self.model_of(&parameters, field_share)?);
            let rmse = free_running_rmse_of(
                &model,
                clips,
                self.judged_frames(),
                IntersectionMode::Off,
                &mut proceed,
            )?;
            // What has left the numbers is no result to prefer.
            let is_better = |(best, _): (f64, f32)| rmse < best || (rmse.is_finite() && !best.is_finite());
            if best.is_none_or(is_better) {
                best = Some((rmse, field_share));
            }
        }
        let field_share = best.map_or(1.0, |(_, share)| share);
        let model = Arc::new(self.model_of(&parameters, field_share)?);
        let intersection = model.config().intersection;
        let rmse = free_running_rmse_of(&model, clips, usize::MAX, intersection, &mut proceed)?;
        Ok(Some(Validation {
            fit: self.data.fit,
            motion: ValidationMotion::of(clips, &self.data.clips),
            clips: names(clips),
            rmse_mm: 1e3 * rmse,
            field_share,
        }))
    }

    /// Of a clip, for each share.
    pub(super) fn judged_frames(&self) -> usize {
        (JUDGED_S * self.data.config.fps) as usize
    }

    /// What [`Trainer::validation`] tries: without a prior there is nothing but the field.
    pub(super) fn field_shares(&self) -> &'static [f32] {
        match self.config.has_prior() {
            true => &FIELD_SHARES,
            false => &FIELD_SHARES[..1],
        }
    }

    /// What the model file is to tell about unseen motion, and how much of the field the model takes: of this fit,
    /// or of the one before that held clips out.
    pub fn set_validation(&mut self, validation: Validation) {
        self.validation = Some(validation);
    }

    fn kept(&self) -> Vec<Vec<f32>> {
        match (&self.best, self.config.keep) {
            (Some(best), Keep::Best) => best.parameters.clone(),
            _ => self.averaged(),
        }
    }

    /// The running mean of the parameters, or where there is none the parameters.
    pub(super) fn averaged(&self) -> Vec<Vec<f32>> {
        self.average.clone().unwrap_or_else(|| self.network.values())
    }

    pub(super) fn model_of(&self, parameters: &[Vec<f32>], field_share: f32) -> Result<Model, TrainError> {
        let capture = &self.data.capture;
        let (encoder, mut field) = model_layers(&self.shape, parameters);
        let mut config = self.data.config.clone();
        if let (StateConfig::Displacement(state), Some(last)) = (&mut config.state, field.last_mut()) {
            last.scale(field_share);
            // The limit is part of the output; a field that says nothing meets any.
            state.output_limit *= if field_share > 0.0 { field_share } else { 1.0 };
        }
        Ok(Model::new(ModelParts {
            config,
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            prior: self.data.prior.clone(),
            rest_box: self.data.rest_box,
            normalisation: self.data.normalisation.clone(),
            encoder,
            field,
            about: About {
                name: capture.manifest.name.clone(),
                provenance: capture.manifest.provenance.clone(),
                training: self.account(),
            },
        })?)
    }

    /// What the model file tells about its training.
    fn account(&self) -> serde_json::Value {
        let time = self.other + self.time;
        json!({
            "settings": self.config,
            "fit": self.data.fit,
            "training_clips": names(&self.data.clips),
            "steps": self.step,
            "kept_step": match (&self.best, self.config.keep) {
                (Some(best), Keep::Best) => best.step,
                _ => self.step,
            },
            "seconds": time.seconds,
            "prior_seconds": time.prior_seconds,
            "validation": self.validation,
        })
    }
}

fn names(clips: &[PreparedClip]) -> Vec<String> {
    clips.iter().map(|clip| clip.name().to_owned()).collect()
}
