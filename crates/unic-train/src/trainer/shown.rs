//! Choices that motions left out make of the shown cloth: bending, chords and order of the strain
//! projection, and the factor of the replay.

mod search;

use super::Trainer;
use crate::{
    error::TrainError,
    field_data::Judge,
    validation::{
        Chosen, FreeBending, FreeCrossings, FreeLife, Proceed, ValidationMotion, go_on, true_liveliness,
    },
};
use search::{Trial, best_chords, best_order, share_of_step};
use std::sync::Arc;
use unic_core::model::{Model, ModelParts};
use unic_eval::{Liveliness, LivingMeasure, PreparedClip, SelfCrossingShares};

/// Factors of the replay that are tried where its wrinkles are too calm, after 1.
const LIVELIER: &[f32] = &[2.0, 4.0];

/// Factors that are tried where its wrinkles are too lively.
const CALMER: &[f32] = &[0.5];

/// Number of factors that are tried at most.
const MOST_FACTORS: usize = 1 + LIVELIER.len();

/// Smallest number of motions left out that judge a factor. Three lively ones have made a pleated
/// dress crumple in a calm dance.
const LEAST_JUDGED: usize = 5;

/// Receiver of a model and a clip that it has not seen.
type See<'a> = dyn FnMut(&Arc<Model>, &PreparedClip, &mut Proceed) -> Result<(), TrainError> + 'a;

impl Trainer {
    /// Chooses bending, chords and factor for a share of the field with the least order, the order, then
    /// the bending with it.
    pub(super) fn choose_shown(
        &self,
        parameters: &[Vec<f32>],
        field_share: f32,
        proceed: &mut Proceed,
    ) -> Result<Chosen, TrainError> {
        let mut chosen = Chosen {
            field_share,
            chord_deviations: self.chord_choices().iter().copied().max_by(f32::total_cmp),
            order: self.orders().iter().copied().min_by(f32::total_cmp),
            ..Chosen::SETTINGS
        };
        let least = chosen.order;
        chosen = self.choose_wrinkles(parameters, chosen, proceed)?;
        chosen.order = self.order(parameters, chosen, proceed)?;
        // More pushes bend the cloth more.
        if chosen.order > least {
            let bending = chosen.bending.unwrap_or(0.0);
            chosen.bending = self.bending(parameters, chosen, bending, proceed)?;
        }
        Ok(chosen)
    }

    /// Chooses the bending, the chords and the factor with it, then the bending with the factor.
    fn choose_wrinkles(
        &self,
        parameters: &[Vec<f32>],
        mut chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Chosen, TrainError> {
        chosen.bending = self.bending(parameters, chosen, 0.0, proceed)?;
        let shortest = chosen.chord_deviations;
        chosen.chord_deviations = self.chord_deviations(parameters, chosen, proceed)?;
        chosen.replay_factor = self.replay_factor(parameters, chosen, proceed)?;
        // More wrinkles bend more, so smaller values bend too much still.
        let least = match chosen.replay_factor {
            None if chosen.chord_deviations == shortest => return Ok(chosen),
            None => 0.0,
            Some(factor) if factor > 1.0 => chosen.bending.unwrap_or(0.0),
            Some(_) => 0.0,
        };
        chosen.bending = self.bending(parameters, chosen, least, proceed)?;
        Ok(chosen)
    }

    /// Number of times that [`Trainer::choose_shown`] animates the judged clips at most.
    pub(super) fn shown_trials(&self) -> usize {
        let factors = match self.judges_replay() {
            true => MOST_FACTORS,
            false => 0,
        };
        let (bendings, chords) = (self.bendings().len(), self.chord_choices().len());
        // The bending is chosen once more after the factor or the chords, and after the order.
        let again = match factors + chords {
            0 => 1,
            _ => 2,
        };
        (1 + again) * bendings + chords + factors + self.orders().len()
    }

    /// Number of times that [`Trainer::choose_shown`] counts the self-crossings of the judged clips at most,
    /// which takes about as long as to animate them.
    pub(super) fn crossing_trials(&self) -> usize {
        self.orders().len()
    }

    /// Number of times that [`Trainer::choose_shown`] measures the life of the judged clips at most.
    pub(super) fn life_trials(&self) -> usize {
        // The truth is measured once.
        usize::from(self.judges_replay()) * (1 + MOST_FACTORS)
    }

    /// Returns whether the model has a replay that enough clips judge. The wrinkles of a lone clip are
    /// in its library.
    fn judges_replay(&self) -> bool {
        let data = &self.field.data;
        let motion = ValidationMotion::of(&data.validation, &data.clips);
        let is_judged = motion == ValidationMotion::Unseen && self.judged().count() >= LEAST_JUDGED;
        data.prior.replay.is_some() && is_judged
    }

    /// Chooses the bending of the strain projection, if the model has one, from `least` on.
    fn bending(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        least: f32,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        let mut least_first: Vec<f32> = self.bendings().to_vec();
        least_first.retain(|bending| *bending >= least);
        least_first.sort_by(f32::total_cmp);
        let mut best: Option<(f64, f32)> = None;
        for bending in least_first {
            let chosen = Chosen {
                bending: Some(bending),
                ..chosen
            };
            let bends = self.bends(parameters, chosen, proceed)?;
            // Without a truth that bends, or with a prediction that does not, none is better.
            let Some(error) = bends.excess() else {
                break;
            };
            if best.is_none_or(|(smallest, _)| error.abs() < smallest) {
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

    /// Chooses the least lengths of free chords, if there are any: longer ones only where the garment bends
    /// too much.
    fn chord_deviations(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        let choices = self.chord_choices();
        // A lone value needs no judgement.
        if choices.len() < 2 {
            return Ok(chosen.chord_deviations);
        }
        let found = best_chords(choices, |deviations| {
            let chosen = Chosen {
                chord_deviations: Some(deviations),
                ..chosen
            };
            let bends = self.bends(parameters, chosen, proceed)?;
            // Calm motion shows crumples, which lively motion hides among its folds.
            Ok(bends.mean_excess().map(|excess| [excess, bends.rmse()]))
        })?;
        Ok(found.or(chosen.chord_deviations))
    }

    /// Measures the bending on the judged clips.
    fn bends(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<FreeBending, TrainError> {
        let mut bends = FreeBending::new(&self.field.data.capture.garment.rest);
        self.each_judged(parameters, chosen, proceed, &mut |model, clip, proceed| {
            bends.add(model, clip, proceed)
        })?;
        Ok(bends)
    }

    /// Chooses the order of the strain projection, if the model has one: that with which the cloth of the
    /// judged clips passes through itself least beyond what the truth does, within the allowed cost of
    /// accuracy.
    fn order(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        let orders = self.orders();
        // A lone value needs no judgement.
        if orders.len() < 2 {
            return Ok(orders.first().copied());
        }
        let crossings = SelfCrossingShares::new(&self.field.data.capture.garment.rest);
        let found = best_order(orders, |order| {
            let chosen = Chosen {
                order: Some(order),
                ..chosen
            };
            let mut free = FreeCrossings::default();
            self.each_judged(parameters, chosen, proceed, &mut |model, clip, proceed| {
                free.add(crossings.clone(), model, clip, proceed)
            })?;
            Ok([free.excess(), free.rmse()])
        })?;
        Ok(found.or(orders.first().copied()))
    }

    /// Chooses the factor of the replay, from the least of [`CALMER`] to the largest of [`LIVELIER`]:
    /// that with which wrinkles come and go as much as the truth's, or the largest one within the
    /// allowed cost of accuracy. None without a replay that enough clips judge, where no truth is alive,
    /// and where a trial is not finite.
    fn replay_factor(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        proceed: &mut Proceed,
    ) -> Result<Option<f32>, TrainError> {
        if !self.judges_replay() {
            return Ok(None);
        }
        let measure =
            LivingMeasure::new(&self.field.data.capture.garment.rest).map_err(TrainError::Wrinkles)?;
        let mut truth = Vec::new();
        for (clip, _) in self.judged() {
            go_on(proceed)?;
            truth.push(true_liveliness(&measure, clip));
        }
        let mut try_factor = |factor: f32| {
            let chosen = Chosen {
                replay_factor: Some(factor),
                ..chosen
            };
            self.trial(parameters, chosen, (&measure, &truth), proceed)
        };
        let Some(first) = try_factor(1.0)? else {
            return Ok(None);
        };
        let largest_rmse = first.rmse * (1.0 + f64::from(self.config().replay.cost));
        let mut last = first;
        for &factor in if first.excess > 0.0 { CALMER } else { LIVELIER } {
            let Some(next) = try_factor(factor)? else { break };
            let share = share_of_step(last, next, largest_rmse);
            last = Trial {
                factor: last.factor * (next.factor / last.factor).powf(share),
                ..next
            };
            if share < 1.0 {
                break;
            }
        }
        // Two decimals say all that ten seconds of a few clips tell.
        Ok(Some((100.0 * last.factor).round() as f32 / 100.0))
    }

    /// Animates the judged clips with a factor, and compares them with the truth of each clip. None
    /// where that yields no finite numbers.
    fn trial(
        &self,
        parameters: &[Vec<f32>],
        chosen: Chosen,
        (measure, truth): (&LivingMeasure, &[Liveliness]),
        proceed: &mut Proceed,
    ) -> Result<Option<Trial>, TrainError> {
        let mut life = FreeLife::default();
        self.each_judged(parameters, chosen, proceed, &mut |model, clip, proceed| {
            life.add(measure, model, clip, proceed)
        })?;
        let trial = life.excess(truth).map(|excess| Trial {
            factor: chosen.replay_factor.unwrap_or(1.0).into(),
            excess,
            rmse: life.rmse(),
        });
        Ok(trial.filter(|trial| trial.excess.is_finite() && trial.rmse.is_finite()))
    }

    /// The validation clips, then clips of other motions with their judges.
    pub(super) fn judged(&self) -> impl Iterator<Item = (&PreparedClip, Option<&Judge>)> {
        let data = &self.field.data;
        let validation = data.validation.iter().map(|clip| (clip, None));
        // Clips that this fit does not train on show the motion of a validation clip.
        let clip_of = |judge: &Judge| data.clips.iter().find(|clip| clip.name() == judge.clip);
        let others = data.judges.iter();
        validation.chain(others.filter_map(move |judge| Some((clip_of(judge)?, Some(judge)))))
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
        let model = self.model_of(parameters, chosen)?;
        let parts = model.to_parts();
        let model = Arc::new(model);
        for (clip, judge) in self.judged() {
            let Some(judge) = judge else {
                see(&model, clip, proceed)?;
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

    /// Values of `projection.order` that [`Trainer::validation`] tries at most; none without a projection.
    fn orders(&self) -> &[f32] {
        let settings = &self.config().projection;
        match settings.at_inference {
            true => &settings.order,
            false => &[],
        }
    }

    /// Values of `projection.chord_deviations` that [`Trainer::validation`] tries at most; none without
    /// chords that they change.
    fn chord_choices(&self) -> &[f32] {
        match self.field.data.strain.hangs_free() {
            true => &self.config().projection.chord_deviations,
            false => &[],
        }
    }

    /// Values of `projection.bending` that [`Trainer::validation`] tries at most; none without a
    /// projection.
    fn bendings(&self) -> &[f32] {
        let settings = &self.config().projection;
        match settings.at_inference {
            true => &settings.bending,
            false => &[],
        }
    }
}
