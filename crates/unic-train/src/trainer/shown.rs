//! What motions left out choose of the cloth that is shown: the bending of the strain projection and
//! the factor of the replay.

use super::Trainer;
use crate::{
    error::TrainError,
    validation::{Chosen, FreeLife, Proceed, add_free_running_bending, true_liveliness},
};
use std::{slice::from_ref, sync::Arc};
use unic_core::model::{Model, ModelParts};
use unic_eval::{BendingRatio, LivingMeasure, PreparedClip};

/// Factors of the replay that are tried where its wrinkles are too calm, after 1.
const LIVELIER: &[f32] = &[2.0, 4.0];

/// Factors that are tried where its wrinkles are too lively.
const CALMER: &[f32] = &[0.5];

/// Number of factors that are tried at most.
const MOST_FACTORS: usize = 1 + LIVELIER.len();

/// Life and error of the cloth with a factor of the replay.
#[derive(Clone, Copy, Debug)]
struct Tried {
    factor: f64,
    /// Logarithm of the living ratio (see [`FreeLife::excess`]).
    excess: f64,
    rmse: f64,
}

/// Receiver of a model and a clip that it has not seen.
type See<'a> = dyn FnMut(&Arc<Model>, &PreparedClip, &mut Proceed) -> Result<(), TrainError> + 'a;

impl Trainer {
    /// Chooses bending and factor for a share of the field.
    pub(super) fn shown(
        &self,
        parameters: &[Vec<f32>],
        field_share: f32,
        proceed: &mut Proceed,
    ) -> Result<Chosen, TrainError> {
        let mut chosen = Chosen {
            field_share,
            ..Chosen::SETTINGS
        };
        chosen.bending = self.bending(parameters, chosen, proceed)?;
        chosen.replay_factor = self.replay_factor(parameters, chosen, proceed)?;
        // More wrinkles bend more.
        if chosen.replay_factor.is_some_and(|factor| factor > 1.0) {
            chosen.bending = self.bending(parameters, chosen, proceed)?;
        }
        Ok(chosen)
    }

    /// Number of times that [`Trainer::shown`] animates the judged clips at most.
    pub(super) fn shown_trials(&self) -> usize {
        let factors = usize::from(self.field.data.prior.replay.is_some());
        let bendings = self.bendings().len();
        (1 + factors) * bendings + factors * MOST_FACTORS
    }

    /// Chooses the bending of the strain projection, if the model has one, from the value of `chosen`
    /// on.
    fn bending(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        let from = chosen.bending.unwrap_or(0.0);
        let mut least_first: Vec<f32> = self.bendings().to_vec();
        least_first.retain(|bending| *bending >= from);
        least_first.sort_by(f32::total_cmp);
        let mut best: Option<(f64, f32)> = None;
        for bending in least_first {
            let chosen = Chosen {
                bending: Some(bending),
                ..chosen
            };
            let mut ratio = BendingRatio::new(&self.field.data.capture.garment.rest);
            self.each_judged(parameters, chosen, proceed, &mut |model, clip, proceed| {
                add_free_running_bending(&mut ratio, model, from_ref(clip), proceed)
            })?;
            // Without a truth that bends, or with a prediction that does not, none is better.
            let error = ratio.ratio().map(f64::ln);
            let Some(error) = error.filter(|error| error.is_finite()) else {
                break;
            };
            if best.is_none_or(|(least, _)| error.abs() < least) {
                best = Some((error.abs(), bending));
            }
            // Larger values bend the garment less still.
            if error <= 0.0 {
                break;
            }
        }
        let found = best.map(|(_, bending)| bending).or(chosen.bending);
        Ok(found.or(self.bendings().first().copied()))
    }

    /// Chooses the factor of the replay, if the model has one: that with which wrinkles come and go
    /// as much as the truth's, or the largest one within the allowed cost of accuracy. None for a
    /// truth without life.
    fn replay_factor(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        let data = &self.field.data;
        if data.prior.replay.is_none() {
            return Ok(None);
        }
        let measure = LivingMeasure::new(&data.capture.garment).map_err(TrainError::Wrinkles)?;
        let mut truth = Vec::new();
        self.each_judged(parameters, chosen, proceed, &mut |_, clip, _| {
            truth.push(true_liveliness(&measure, clip));
            Ok(())
        })?;
        let mut tried = |factor: f32| -> Result<Option<Tried>, TrainError> {
            let chosen = Chosen {
                replay_factor: Some(factor),
                ..chosen
            };
            let mut life = FreeLife::default();
            self.each_judged(parameters, chosen, proceed, &mut |model, clip, proceed| {
                life.add(&measure, model, clip, proceed)
            })?;
            let tried = life.excess(&truth).map(|excess| Tried {
                factor: factor.into(),
                excess,
                rmse: life.rmse(),
            });
            Ok(tried.filter(|tried| tried.excess.is_finite() && tried.rmse.is_finite()))
        };
        let Some(first) = tried(1.0)? else {
            return Ok(None);
        };
        let most = first.rmse * (1.0 + f64::from(self.config().replay.cost));
        let mut last = first;
        for &factor in if first.excess > 0.0 { CALMER } else { LIVELIER } {
            let Some(next) = tried(factor)? else { break };
            let way = way(last, next, most);
            last = Tried {
                factor: last.factor * (next.factor / last.factor).powf(way),
                ..next
            };
            if way < 1.0 {
                break;
            }
        }
        // Two digits say all that ten seconds of a few clips tell.
        Ok(Some((100.0 * last.factor).round() as f32 / 100.0))
    }

    /// Shows the validation clips with the model, and clips of other motions with models whose priors
    /// have not seen them.
    fn each_judged(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
        see: &mut See,
    ) -> Result<(), TrainError> {
        let data = &self.field.data;
        let model = self.model_of(parameters, chosen)?;
        let parts = model.to_parts();
        let model = Arc::new(model);
        for clip in &data.validation {
            see(&model, clip, proceed)?;
        }
        for judge in &data.judges {
            // Clips that this fit does not train on show the motion of a validation clip.
            let Some(clip) = data.clips.iter().find(|clip| clip.name() == judge.clip) else {
                continue;
            };
            let mut prior = judge.prior.clone();
            chosen.scale_replay(&mut prior)?;
            let model = Model::new(ModelParts {
                prior,
                ..parts.clone()
            })?;
            see(&Arc::new(model), clip, proceed)?;
        }
        Ok(())
    }

    /// Values of `projection.bending` that [`Trainer::validation`] tries at most; none without a
    /// projection.
    pub(super) fn bendings(&self) -> &[f32] {
        let settings = &self.config().projection;
        match settings.at_inference {
            true => &settings.bending,
            false => &[],
        }
    }
}

/// Share of the way from one factor to the next, on a scale of logarithms, at which the excess is
/// zero or the error reaches `most`. 1 where neither happens.
fn way(last: Tried, next: Tried, most: f64) -> f64 {
    let crossing = |from: f64, to: f64| match from * to < 0.0 {
        true => from / (from - to),
        false => 1.0,
    };
    let life = crossing(last.excess, next.excess);
    life.min(crossing(last.rmse - most, next.rmse - most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_ends_where_wrinkles_live_enough_or_cost_too_much() {
        let tried = |factor, excess, rmse| Tried { factor, excess, rmse };
        let first = tried(1.0, -0.2, 10.0);
        assert_eq!(way(first, tried(2.0, -0.1, 10.1), 10.6), 1.0);
        assert!((way(first, tried(2.0, 0.2, 10.1), 10.6) - 0.5).abs() < 1e-12);
        assert!((way(first, tried(2.0, 0.2, 12.4), 10.6) - 0.25).abs() < 1e-12);
        // Calmer cloth that errs more than lively cloth is taken all the same.
        assert!((way(tried(1.0, 0.3, 10.0), tried(0.5, -0.1, 10.2), 10.6) - 0.75).abs() < 1e-12);
    }
}
