//! The finished model, and the validation of its field.

use super::{Trainer, field_training::names, measurement::judged_frames};
use crate::{
    error::TrainError,
    event::Control,
    validation::{Chosen, Validation, ValidationMotion, free_running_rmse_of},
};
use serde_json::json;
use std::sync::Arc;
use unic_core::{Precision, PrecisionErrors, config::IntersectionMode, model::Model};
use unic_eval::CodeCertainty;

/// Duration at the start of a clip on which precisions are compared, seconds.
const PRECISION_S: f32 = 10.0;

/// Shares of the field's output that are tried on validation clips, the whole output first.
const FIELD_SHARES: [f32; 5] = [1.0, 0.75, 0.5, 0.25, 0.0];

impl Trainer {
    /// The model with the parameters that the settings choose, the last or their running mean, and
    /// with what [the validation](Trainer::set_validation) chose.
    ///
    /// # Errors
    /// None for a run that has not diverged.
    pub fn model(&self) -> Result<Model, TrainError> {
        let chosen = self
            .field
            .validation
            .as_ref()
            .map_or(self.field.chosen(), Chosen::from);
        self.model_of(&self.learner.kept(), chosen)
    }

    /// [`Trainer::model`], whose file also records how certain its categorical code is on the
    /// training motions, and its error in each precision. The errors are left out where `proceed`,
    /// called before each frame, answers stop.
    ///
    /// # Errors
    /// The errors of [`Trainer::model`].
    pub fn measured_model(&self, proceed: &dyn Fn() -> Control) -> Result<Model, TrainError> {
        let model = self.model()?;
        let mut parts = model.to_parts();
        if let Some(code) = CodeCertainty::measure(&model, &self.field.data.clips) {
            parts.about.training["code"] = json!(code);
        }
        match self.precision_errors(&model, proceed) {
            Ok(Some(errors)) => parts.about.training[PrecisionErrors::KEY] = json!(errors),
            Ok(None) | Err(TrainError::Stopped) => {}
            Err(error) => return Err(error),
        }
        Ok(Model::new(parts)?)
    }

    /// Measures the error of a model in each precision, in free running through the start of a clip:
    /// the first of the validation, which a fit on all clips has seen. Intersections are not
    /// handled. None where the field adds nothing, and all precisions are equal.
    fn precision_errors(
        &self,
        model: &Model,
        proceed: &dyn Fn() -> Control,
    ) -> Result<Option<PrecisionErrors>, TrainError> {
        let validation = self.field.validation.as_ref();
        let chosen = validation.map_or(self.field.chosen(), Chosen::from);
        let clips = || self.field.data.validation.iter().chain(&self.field.data.clips);
        let name = validation.and_then(|validation| validation.clips.first());
        let clip = clips().find(|clip| name.is_none_or(|name| clip.name() == name));
        let Some(clip) = clip.or(clips().next()).filter(|_| chosen.field_share > 0.0) else {
            return Ok(None);
        };
        let frames = (PRECISION_S * model.config().fps) as usize;
        let error = |precision| -> Result<f64, TrainError> {
            let model = Arc::new(model.clone().with_precision(precision));
            let (clips, off) = (std::slice::from_ref(clip), IntersectionMode::Off);
            Ok(1e3 * free_running_rmse_of(&model, clips, frames, off, &mut || proceed())?)
        };
        let finite = |precision| error(precision).map(|mm| Some(mm).filter(|mm| mm.is_finite()));
        Ok(Some(PrecisionErrors {
            f32: error(Precision::F32)?,
            bf16: finite(Precision::Bf16)?,
            int16: finite(Precision::Int16)?,
            int8: finite(Precision::Int8)?,
        }))
    }

    /// Measures the model on the validation clips. Returns none in a fit on all clips.
    ///
    /// The field has the share that a sizing has chosen, see [`Trainer::sized`]. Without one, a field
    /// that adds to a prior can memorise its training motions, and does where they are few. So
    /// several shares of its output are tried, each on the first [`JUDGED_S`](crate::JUDGED_S)
    /// seconds of every clip, without intersection handling, which takes most of the time. The
    /// share with the least error is the validation's. The error that is reported for it is
    /// slightly too small, because the share was chosen on the same clips. A lone clip, which is
    /// trained on too, cannot judge.
    ///
    /// Then the values of `projection.bending` are tried on the starts of these clips and of clips of
    /// other motions, each with the prior that has not seen it. The value is taken with which the
    /// garment bends most nearly as much as the truth. Smaller values leave more wrinkles. Where the
    /// garment then bends over a tenth more than the truth, smaller `projection.chord_deviations` are
    /// tried in the same way, at an error of at most 2 % more. On the same starts the replay gets the
    /// factor with which wrinkles come and go as much as the truth's, at a limited cost of accuracy.
    /// Then the values of `projection.order` are tried, and the one is taken with which the garment
    /// passes through itself least beyond what the truth does, at an error of at most 1 % more. Bending
    /// is chosen once more if that has pushes.
    ///
    /// # Errors
    /// The errors of [`Trainer::run`]; [`TrainError::Stopped`] where `ask` answers stop. It is called
    /// before each frame, from several threads at the same time.
    pub fn validation(&self, ask: &(dyn Fn() -> Control + Sync)) -> Result<Option<Validation>, TrainError> {
        if !self.field.validates() {
            return Ok(None);
        }
        let parameters = self.learner.kept();
        let (data, clips) = (&self.field.data, &self.field.data.validation);
        let mut proceed = || ask();
        let mut best: Option<(f64, f32)> = None;
        let shares = self.field_shares();
        // A lone share needs no judgement.
        for &field_share in shares.iter().filter(|_| shares.len() > 1) {
            let chosen = Chosen {
                field_share,
                ..Chosen::SETTINGS
            };
            let model = Arc::new(self.model_of(&parameters, chosen)?);
            let (frames, off) = (judged_frames(data), IntersectionMode::Off);
            let rmse = free_running_rmse_of(&model, clips, frames, off, &mut proceed)?;
            // NaN compares false to everything: a finite error must replace one that is not.
            let is_better = |(best, _): (f64, f32)| rmse < best || (rmse.is_finite() && !best.is_finite());
            if best.is_none_or(is_better) {
                best = Some((rmse, field_share));
            }
        }
        let field_share = best.map_or(shares[0], |(_, share)| share);
        let (chosen, trials) = self.choose_shown(&parameters, field_share, ask)?;
        let model = Arc::new(self.model_of(&parameters, chosen)?);
        let intersection = model.config().intersection;
        let rmse = free_running_rmse_of(&model, clips, usize::MAX, intersection, &mut proceed)?;
        Ok(Some(Validation {
            fit: data.fit,
            motion: ValidationMotion::of(clips, &data.clips),
            clips: names(clips),
            rmse_mm: 1e3 * rmse,
            field_share,
            bending: chosen.bending,
            chord_deviations: chosen.chord_deviations,
            order: chosen.order,
            replay_factor: chosen.replay_factor,
            trials,
        }))
    }

    /// Shares that [`Trainer::validation`] tries, one at least. Without a prior, nothing can replace
    /// the field. Where a sizing has chosen a share, more clips than the validation's have judged
    /// it.
    pub(super) fn field_shares(&self) -> Vec<f32> {
        match (&self.field.sizing, self.field.config.has_prior()) {
            (Some(sizing), _) => vec![sizing.share],
            (None, true) => FIELD_SHARES.to_vec(),
            (None, false) => vec![1.0],
        }
    }

    /// Sets the validation that the model file records, and whose choices the model takes: of this
    /// fit, or of the one before that held clips out.
    pub fn set_validation(&mut self, validation: Validation) {
        self.field.validation = Some(validation);
    }

    /// The model with other parameters and a share of the field.
    #[cfg(test)]
    pub(crate) fn model_with(&self, parameters: &[Vec<f32>], field_share: f32) -> Result<Model, TrainError> {
        let chosen = Chosen {
            field_share,
            ..Chosen::SETTINGS
        };
        self.model_of(parameters, chosen)
    }

    pub(super) fn model_of(&self, parameters: &[Vec<f32>], chosen: Chosen) -> Result<Model, TrainError> {
        let (step, seconds) = (self.learner.step(), self.learner.seconds());
        self.field.model(step, seconds, parameters, chosen)
    }
}
