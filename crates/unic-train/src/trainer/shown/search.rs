//! Searches over the values that motions left out choose, given a measurement of each.

use crate::error::TrainError;

/// Share of the excess, of self-crossings or bending, that the next value has to take away.
const LEAST_GAIN: f64 = 0.1;

/// Largest growth of the error by an order, as a share of the least error of the smaller ones.
const ORDER_COST: f64 = 0.01;

/// Ratio of the garment's bending to the truth's above which longer chords are tried.
const BENDS_TOO_MUCH: f64 = 1.1;

/// Largest growth of the error by longer chords, as a share of the least error of the shorter ones.
const CHORD_COST: f64 = 0.02;

/// Life and error of the cloth with a factor of the replay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    pub(super) factor: f64,
    /// Logarithm of the living ratio (see `Life::excess`).
    pub(super) excess: f64,
    pub(super) rmse: f64,
}

/// Excess of a property over the truth's, and the error, of the cloth with a value. None where the excess
/// is not known.
type Tried = Result<Option<[f64; 2]>, TrainError>;

/// Finds the order with the least excess of self-crossings, given excess and error of each that is tried.
/// None where those of the least one are not finite.
pub(super) fn best_order(orders: &[f32], trial: impl FnMut(f32) -> Tried) -> Result<Option<f32>, TrainError> {
    let mut least_first = orders.to_vec();
    least_first.sort_by(f32::total_cmp);
    // Larger values than one without an excess can only cost more.
    best(&least_first, ORDER_COST, |excess| excess == 0.0, trial)
}

/// Finds the chords with which the garment bends most nearly as much as the truth.
///
/// A trial returns the logarithm of the bending by the truth's, and the error. Longer chords, which have
/// smaller values, are tried only where the shorter ones bend too much. None if the first trial is not
/// finite.
pub(super) fn best_chords(
    choices: &[f32],
    trial: impl FnMut(f32) -> Tried,
) -> Result<Option<f32>, TrainError> {
    let mut shortest_first = choices.to_vec();
    shortest_first.sort_by(|a, b| b.total_cmp(a));
    let is_enough = |excess| excess < BENDS_TOO_MUCH.ln();
    best(&shortest_first, CHORD_COST, is_enough, trial)
}

/// Finds the value with the smallest excess, of either sign, of values that are tried one by one until the
/// excess is enough, the error exceeds the least one so far by more than `cost`, or either is not finite.
/// A later value has to take at least [`LEAST_GAIN`] of the excess away.
fn best(
    values: &[f32],
    cost: f64,
    is_enough: impl Fn(f64) -> bool,
    mut trial: impl FnMut(f32) -> Tried,
) -> Result<Option<f32>, TrainError> {
    let (mut best, mut largest_rmse): (Option<(f64, f32)>, _) = (None, f64::INFINITY);
    for &value in values {
        let tried = trial(value)?.filter(|tried| tried.iter().all(|number| number.is_finite()));
        let Some([excess, rmse]) = tried.filter(|[_, rmse]| *rmse <= largest_rmse) else {
            break;
        };
        if best.is_none_or(|(least, _)| excess.abs() < (1.0 - LEAST_GAIN) * least) {
            best = Some((excess.abs(), value));
        }
        if is_enough(excess) {
            break;
        }
        largest_rmse = largest_rmse.min(rmse * (1.0 + cost));
    }
    Ok(best.map(|(_, value)| value))
}

/// Share of the step from one factor to the next, on a scale of logarithms, after which the excess is
/// zero or the error `largest_rmse`. 1 where neither happens.
pub(super) fn share_of_step(last: Trial, next: Trial, largest_rmse: f64) -> f64 {
    // From a value that is not positive to one that is.
    let rise = |from: f64, to: f64| match from <= 0.0 && to > 0.0 {
        true => from / (from - to),
        false => 1.0,
    };
    let life = rise(last.excess, next.excess).min(rise(-last.excess, -next.excess));
    life.min(rise(last.rmse - largest_rmse, next.rmse - largest_rmse))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order that is chosen by these excesses and errors, and how many were tried.
    fn chosen(trials: &[[f64; 2]]) -> (Option<f32>, usize) {
        let orders: Vec<f32> = (0..trials.len()).rev().map(|i| i as f32).collect();
        let mut tried = 0;
        let order = best_order(&orders, |order| {
            tried += 1;
            Ok(Some(trials[order as usize]))
        });
        (order.unwrap(), tried)
    }

    #[test]
    fn an_order_has_to_take_crossings_away_at_a_small_cost() {
        assert_eq!(chosen(&[[0.4, 10.0], [0.2, 10.05], [0.1, 10.0]]), (Some(2.0), 3));
        // A twentieth less is no gain.
        assert_eq!(chosen(&[[0.4, 10.0], [0.38, 9.0], [0.39, 9.0]]), (Some(0.0), 3));
        // Costs count from the least error so far.
        assert_eq!(chosen(&[[0.4, 10.0], [0.2, 9.9], [0.0, 10.01]]), (Some(1.0), 3));
        assert_eq!(chosen(&[[0.4, 10.0], [0.1, 10.2], [0.0, 10.0]]), (Some(0.0), 2));
        // Nothing is left to take away.
        assert_eq!(chosen(&[[0.0, 10.0], [0.0, 9.0]]), (Some(0.0), 1));
        assert_eq!(chosen(&[[0.4, 10.0], [f64::NAN, 10.0]]), (Some(0.0), 2));
        assert_eq!(chosen(&[[f64::NAN, f64::NAN], [0.1, 10.0]]), (None, 1));
        assert_eq!(chosen(&[[0.4, 10.0], [0.1, f64::NAN]]), (Some(0.0), 2));
    }

    #[test]
    fn chords_become_longer_only_where_cloth_bends_too_much() {
        let chosen = |trials: &[Option<[f64; 2]>]| {
            let choices: Vec<f32> = (0..trials.len()).map(|i| i as f32).collect();
            let mut tried = 0;
            // The first trial is that of the largest value.
            let found = best_chords(&choices, |choice| {
                tried += 1;
                Ok(trials[trials.len() - 1 - choice as usize])
            });
            (found.unwrap(), tried)
        };
        assert_eq!(chosen(&[Some([0.05, 10.0]), Some([0.0, 9.0])]), (Some(1.0), 1));
        assert_eq!(chosen(&[Some([-0.3, 10.0]), Some([0.0, 9.0])]), (Some(1.0), 1));
        let crumpled = Some([0.6, 10.0]);
        assert_eq!(
            chosen(&[crumpled, Some([0.3, 10.1]), Some([0.2, 10.2])]),
            (Some(0.0), 3)
        );
        // A twentieth less is no gain, and the error counts from the least so far.
        assert_eq!(chosen(&[crumpled, Some([0.57, 9.0]), None]), (Some(2.0), 3));
        assert_eq!(
            chosen(&[crumpled, Some([0.3, 10.1]), Some([0.2, 10.3])]),
            (Some(1.0), 3)
        );
        assert_eq!(
            chosen(&[crumpled, Some([0.3, 9.9]), Some([0.2, 10.15])]),
            (Some(1.0), 3)
        );
        // The bending may become too small.
        assert_eq!(chosen(&[crumpled, Some([-0.7, 10.0])]), (Some(1.0), 2));
        assert_eq!(chosen(&[crumpled, None]), (Some(1.0), 2));
        assert_eq!(chosen(&[None, crumpled]), (None, 1));
    }

    #[test]
    fn a_step_ends_where_wrinkles_live_enough_or_cost_too_much() {
        let trial = |factor, excess, rmse| Trial { factor, excess, rmse };
        let first = trial(1.0, -0.2, 10.0);
        let share = |next, largest_rmse| share_of_step(first, next, largest_rmse);
        assert_eq!(share(trial(2.0, -0.1, 10.1), 10.6), 1.0);
        assert!((share(trial(2.0, 0.2, 10.1), 10.6) - 0.5).abs() < 1e-12);
        assert!((share(trial(2.0, 0.2, 12.4), 10.6) - 0.25).abs() < 1e-12);
        // No cost is allowed, but a gain is.
        assert_eq!(share(trial(2.0, -0.1, 10.1), 10.0), 0.0);
        assert_eq!(share(trial(2.0, -0.1, 9.9), 10.0), 1.0);
        let lively = trial(1.0, 0.3, 10.0);
        let share = |next| share_of_step(lively, next, 10.6);
        assert!((share(trial(0.5, -0.1, 10.2)) - 0.75).abs() < 1e-12);
        assert!((share(trial(0.5, 0.1, 12.4)) - 0.25).abs() < 1e-12);
        // Wrinkles that live as much as the truth's stay.
        assert_eq!(
            share_of_step(trial(1.0, 0.0, 10.0), trial(2.0, 0.1, 10.0), 10.6),
            0.0
        );
    }
}
