//! The choice of bending, chords, order and factor, by measurements on motions left out.

use super::{
    super::Trainer,
    search::{Trial, best_chords, best_order, share_of_step},
};
use crate::{
    error::TrainError,
    event::Control,
    field_data::Judge,
    validation::{
        Ask, Bending, Chosen, ClipBending, ClipCrossings, ClipLife, Crossings, Life, Measured, ShownTrial,
        true_liveliness,
    },
};
use rayon::prelude::*;
use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};
use unic_core::{
    model::{Model, ModelParts},
    parallel::{Serial, install},
};
use unic_eval::{BendingRatio, Liveliness, LivingMeasure, PreparedClip, SelfCrossingShares};

/// Factors of the replay that are tried where its wrinkles are too calm, after 1.
const LIVELIER: &[f32] = &[2.0, 4.0];

/// Factors that are tried where its wrinkles are too lively.
const CALMER: &[f32] = &[0.5];

/// Number of factors that are tried at most.
pub(super) const MOST_FACTORS: usize = 1 + LIVELIER.len();

/// Bending, chords, order and factor being chosen for a network.
pub(super) struct Choice<'a> {
    trainer: &'a Trainer,
    parameters: &'a [Vec<f32>],
    ask: &'a Ask<'a>,
    /// Trials so far, in the order of measurement.
    trials: Vec<ShownTrial>,
}

impl<'a> Choice<'a> {
    pub(super) fn new(trainer: &'a Trainer, parameters: &'a [Vec<f32>], ask: &'a Ask<'a>) -> Self {
        Self {
            trainer,
            parameters,
            ask,
            trials: Vec::new(),
        }
    }

    /// Chooses bending, chords and factor with the least order, then the order. The bending is chosen again
    /// if there are more pushes. Returns what was tried, too.
    pub(super) fn choose(mut self, field_share: f32) -> Result<(Chosen, Vec<ShownTrial>), TrainError> {
        let mut chosen = Chosen {
            field_share,
            chord_deviations: self
                .trainer
                .chord_choices()
                .iter()
                .copied()
                .max_by(f32::total_cmp),
            order: self.trainer.orders().iter().copied().min_by(f32::total_cmp),
            ..Chosen::SETTINGS
        };
        let least = chosen.order;
        chosen = self.wrinkles(chosen)?;
        chosen.order = self.order(chosen)?;
        // More pushes bend the cloth more.
        if chosen.order > least {
            chosen.bending = self.bending(chosen, chosen.bending.unwrap_or(0.0))?;
        }
        Ok((chosen, self.trials))
    }

    /// Chooses the bending, the chords and the factor with it, then the bending with the factor.
    fn wrinkles(&mut self, mut chosen: Chosen) -> Result<Chosen, TrainError> {
        chosen.bending = self.bending(chosen, 0.0)?;
        let shortest = chosen.chord_deviations;
        chosen.chord_deviations = self.chord_deviations(chosen)?;
        chosen.replay_factor = self.replay_factor(chosen)?;
        // More wrinkles bend more, so smaller values bend too much still.
        let least = match chosen.replay_factor {
            None if chosen.chord_deviations == shortest => return Ok(chosen),
            None => 0.0,
            Some(factor) if factor > 1.0 => chosen.bending.unwrap_or(0.0),
            Some(_) => 0.0,
        };
        chosen.bending = self.bending(chosen, least)?;
        Ok(chosen)
    }

    /// Chooses the bending of the strain projection, if the model has one, from `least` on.
    fn bending(&mut self, chosen: Chosen, least: f32) -> Result<Option<f32>, TrainError> {
        let bendings = self.trainer.bendings();
        let mut least_first: Vec<f32> = bendings.to_vec();
        least_first.retain(|bending| *bending >= least);
        least_first.sort_by(f32::total_cmp);
        let mut best: Option<(f64, f32)> = None;
        for bending in least_first {
            let chosen = Chosen {
                bending: Some(bending),
                ..chosen
            };
            // Without a truth that bends, or with a prediction that does not, none is better.
            let Bending { all: Some(error), .. } = self.bends(chosen)? else {
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
        Ok(found.or(bendings.first().copied()))
    }

    /// Chooses the least lengths of free chords, if there are any: longer ones only where the garment bends
    /// too much.
    fn chord_deviations(&mut self, chosen: Chosen) -> Result<Option<f32>, TrainError> {
        let choices = self.trainer.chord_choices();
        // A lone value needs no judgement.
        if choices.len() < 2 {
            return Ok(chosen.chord_deviations);
        }
        let found = best_chords(choices, |deviations| {
            let chosen = Chosen {
                chord_deviations: Some(deviations),
                ..chosen
            };
            let bends = self.bends(chosen)?;
            // Calm motion shows crumples, which lively motion hides among its folds.
            Ok(bends.by_clip.map(|excess| [excess, bends.rmse]))
        })?;
        Ok(found.or(chosen.chord_deviations))
    }

    /// Measures the bending on the judged clips, once for the same values.
    fn bends(&mut self, chosen: Chosen) -> Result<Bending, TrainError> {
        let mut earlier = self.trials.iter().filter(|trial| trial.chosen.shows_as(&chosen));
        if let Some(bending) = earlier.find_map(ShownTrial::bending) {
            return Ok(bending);
        }
        let empty = BendingRatio::new(&self.trainer.field.data.capture.garment.rest);
        let clips = self.judged_with(chosen, |model, clip, ask| {
            ClipBending::measure(empty.clone(), model, clip, ask)
        })?;
        let bending = Bending::over(&clips);
        self.trials.push(ShownTrial {
            chosen,
            measured: Measured::Bending {
                all: bending.all,
                by_clip: bending.by_clip,
            },
            rmse: bending.rmse,
        });
        Ok(bending)
    }

    /// Chooses the order of the strain projection, if the model has one: that with which the cloth of the
    /// judged clips passes through itself least beyond what the truth does, within the allowed cost of
    /// accuracy.
    fn order(&mut self, chosen: Chosen) -> Result<Option<f32>, TrainError> {
        let orders = self.trainer.orders();
        // A lone value needs no judgement.
        if orders.len() < 2 {
            return Ok(orders.first().copied());
        }
        let crossings = SelfCrossingShares::new(&self.trainer.field.data.capture.garment.rest);
        let found = best_order(orders, |order| {
            let chosen = Chosen {
                order: Some(order),
                ..chosen
            };
            let clips = self.judged_with(chosen, |model, clip, ask| {
                ClipCrossings::measure(crossings.clone(), model, clip, ask)
            })?;
            let Crossings { excess, rmse } = Crossings::over(&clips);
            let measured = Measured::Crossings { excess };
            self.trials.push(ShownTrial {
                chosen,
                measured,
                rmse,
            });
            Ok(Some([excess, rmse]))
        })?;
        Ok(found.or(orders.first().copied()))
    }

    /// Chooses the factor of the replay, from the least of [`CALMER`] to the largest of [`LIVELIER`]:
    /// that with which wrinkles come and go as much as the truth's, or the largest one within the
    /// allowed cost of accuracy. None without a replay that enough clips judge, where no truth is alive,
    /// and where a trial is not finite.
    fn replay_factor(&mut self, chosen: Chosen) -> Result<Option<f32>, TrainError> {
        let trainer = self.trainer;
        if !trainer.judges_replay() {
            return Ok(None);
        }
        let measure =
            LivingMeasure::new(&trainer.field.data.capture.garment.rest).map_err(TrainError::Wrinkles)?;
        let truth = side_by_side(trainer, self.ask, |clip, _, ask| {
            true_liveliness(&measure, clip, ask)
        })?;
        let mut try_factor = |factor: f32| {
            let chosen = Chosen {
                replay_factor: Some(factor),
                ..chosen
            };
            self.life(chosen, (&measure, &truth))
        };
        let Some(first) = try_factor(1.0)? else {
            return Ok(None);
        };
        let largest_rmse = first.rmse * (1.0 + f64::from(trainer.config().replay.cost));
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
    fn life(
        &mut self,
        chosen: Chosen,
        (measure, truth): (&LivingMeasure, &[Liveliness]),
    ) -> Result<Option<Trial>, TrainError> {
        let clips = self.judged_with(chosen, |model, clip, ask| {
            ClipLife::measure(measure, model, clip, ask)
        })?;
        let Life { excess, rmse } = Life::over(&clips, truth);
        let measured = Measured::Life { excess };
        self.trials.push(ShownTrial {
            chosen,
            measured,
            rmse,
        });
        let trial = excess.map(|excess| Trial {
            factor: chosen.replay_factor.unwrap_or(1.0).into(),
            excess,
            rmse,
        });
        Ok(trial.filter(|trial| trial.rmse.is_finite()))
    }

    /// Measures the validation clips with the model, and clips of other motions with models whose priors
    /// have not seen them.
    fn judged_with<T: Send>(
        &self,
        chosen: Chosen,
        measure: impl Fn(&Arc<Model>, &PreparedClip, &Ask) -> Result<T, TrainError> + Sync,
    ) -> Result<Vec<T>, TrainError> {
        let model = self.trainer.model_of(self.parameters, chosen)?;
        let parts = model.to_parts();
        let model = Arc::new(model);
        side_by_side(self.trainer, self.ask, |clip, judge, ask| {
            let Some(judge) = judge else {
                return measure(&model, clip, ask);
            };
            let mut prior = judge.prior.clone();
            chosen.scale_replay(&mut prior)?;
            let parts = ModelParts {
                prior,
                ..parts.clone()
            };
            measure(&Arc::new(Model::new(parts)?), clip, ask)
        })
    }
}

/// Measures the judged clips in parallel. Returns the results in the order of the clips, or the first of
/// their errors. An answer to stop ends all of them.
fn side_by_side<T: Send>(
    trainer: &Trainer,
    ask: &Ask,
    measure: impl Fn(&PreparedClip, Option<&Judge>, &Ask) -> Result<T, TrainError> + Sync,
) -> Result<Vec<T>, TrainError> {
    let is_stopped = AtomicBool::new(false);
    let ask = || match is_stopped.load(Ordering::Relaxed) {
        true => Control::Stop,
        false => {
            let answer = ask();
            is_stopped.fetch_or(answer == Control::Stop, Ordering::Relaxed);
            answer
        }
    };
    let judged: Vec<_> = trainer.judged().collect();
    let measure = |(clip, judge): &(&PreparedClip, Option<&Judge>)| match judged.len() {
        1 => measure(clip, *judge, &ask),
        // Threads that share one small garment wait for each other most of the time.
        _ => install(Arc::new(Serial), || measure(clip, *judge, &ask)),
    };
    let clips = judged.par_iter().with_max_len(1).map(measure);
    let clips: Vec<_> = clips.collect();
    clips.into_iter().collect()
}
