//! The finished model, and what it tells about its training.

use super::Trainer;
use crate::{
    config::Keep,
    error::TrainError,
    network::model_layers,
    validation::{Validation, free_running_rmse},
};
use serde_json::json;
use std::sync::Arc;
use unic_core::model::{About, Model, ModelParts};
use unic_eval::PreparedClip;

impl Trainer {
    /// The model as the settings want it kept: the last or the best parameters, averaged or not.
    ///
    /// # Errors
    /// None for a run that has not diverged.
    pub fn model(&self) -> Result<Model, TrainError> {
        match (&self.best, self.config.keep) {
            (Some(best), Keep::Best) => self.model_of(&best.parameters),
            _ => self.model_of(&self.averaged()),
        }
    }

    /// Measures the model on the clips held out; none in a fit on all clips.
    ///
    /// # Errors
    /// As [`Trainer::run`].
    pub fn validation(&self) -> Result<Option<Validation>, TrainError> {
        if !self.validates() {
            return Ok(None);
        }
        let model = Arc::new(self.model()?);
        Ok(Some(Validation {
            fit: self.data.fit,
            clips: names(&self.data.validation),
            rmse_mm: 1e3 * free_running_rmse(&model, &self.data.validation)?,
        }))
    }

    /// What the model file is to tell about unseen motion: the error of this fit, or of the one before
    /// that held clips out.
    pub fn set_validation(&mut self, validation: Validation) {
        self.validation = Some(validation);
    }

    /// The running mean of the parameters, or where there is none the parameters.
    pub(super) fn averaged(&self) -> Vec<Vec<f32>> {
        self.average.clone().unwrap_or_else(|| self.network.values())
    }

    pub(super) fn model_of(&self, parameters: &[Vec<f32>]) -> Result<Model, TrainError> {
        let capture = &self.data.capture;
        let (encoder, field) = model_layers(&self.shape, parameters);
        Ok(Model::new(ModelParts {
            config: self.data.config.clone(),
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
        json!({
            "settings": self.config,
            "fit": self.data.fit,
            "training_clips": names(&self.data.clips),
            "steps": self.step,
            "kept_step": match (&self.best, self.config.keep) {
                (Some(best), Keep::Best) => best.step,
                _ => self.step,
            },
            "seconds": self.seconds,
            "validation": self.validation,
        })
    }
}

fn names(clips: &[PreparedClip]) -> Vec<String> {
    clips.iter().map(|clip| clip.name().to_owned()).collect()
}
