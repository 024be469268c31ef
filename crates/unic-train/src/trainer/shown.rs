//! Choices that motions left out make of the shown cloth: bending, chords and order of the strain
//! projection, and the factor of the replay.

mod choice;
mod search;

use super::Trainer;
use crate::{
    error::TrainError,
    field_data::Judge,
    validation::{Ask, Chosen, ShownTrial, ValidationMotion},
};
use choice::{Choice, MOST_FACTORS};
use unic_eval::PreparedClip;

/// Smallest number of motions left out that judge a factor. Three lively ones have made a pleated
/// dress crumple in a calm dance.
const LEAST_JUDGED: usize = 5;

impl Trainer {
    /// Chooses bending, chords, factor and order for a share of the field. Returns everything that was
    /// tried, too.
    pub(super) fn choose_shown<'a>(
        &'a self,
        parameters: &'a [Vec<f32>],
        field_share: f32,
        ask: &'a Ask<'a>,
    ) -> Result<(Chosen, Vec<ShownTrial>), TrainError> {
        Choice::new(self, parameters, ask).choose(field_share)
    }

    /// Number of times that [`Trainer::choose_shown`] animates the judged clips at most.
    pub(super) fn shown_trials(&self) -> usize {
        let factors = match self.judges_replay() {
            true => MOST_FACTORS,
            false => 0,
        };
        // The bending was chosen with the first chords.
        let chords = self.chord_choices().len().saturating_sub(1);
        // It is chosen once more after the factor or the chords, and after the order.
        let again = usize::from(factors + chords > 0) + usize::from(self.crossing_trials() > 0);
        (1 + again) * self.bendings().len() + chords + factors + self.crossing_trials()
    }

    /// Number of times that [`Trainer::choose_shown`] counts the self-crossings of the judged clips at most,
    /// which takes about as long as to animate them.
    pub(super) fn crossing_trials(&self) -> usize {
        match self.orders().len() {
            // A lone value needs no judgement.
            1 => 0,
            orders => orders,
        }
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

    /// The validation clips, then clips of other motions with their judges.
    pub(super) fn judged(&self) -> impl Iterator<Item = (&PreparedClip, Option<&Judge>)> {
        let data = &self.field.data;
        let validation = data.validation.iter().map(|clip| (clip, None));
        // Clips that this fit does not train on show the motion of a validation clip.
        let clip_of = |judge: &Judge| data.clips.iter().find(|clip| clip.name() == judge.clip);
        let others = data.judges.iter();
        validation.chain(others.filter_map(move |judge| Some((clip_of(judge)?, Some(judge)))))
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
