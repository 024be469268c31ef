//! Round numbers for axes.

/// Ticks of an axis that starts at 0 and ends at or above `max`.
///
/// There are at most about `most` steps, of 1, 2 or 5 times a power of ten. The axis ends at 1 if
/// `max` is not a positive finite number.
pub(crate) fn ticks_from_zero(max: f64, most: usize) -> Vec<f64> {
    // Beyond these limits, steps overflow or vanish.
    let max = match max.is_finite() && max > 1e-12 {
        true => max.min(1e12),
        false => 1.0,
    };
    let least = max / most.max(1) as f64;
    let power = 10_f64.powi(least.log10().floor() as i32);
    // The slack of 1e-9 here and below keeps exact multiples from the next step by rounding.
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|&step| step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * power);
    let count = (max / step - 1e-9).ceil() as usize;
    (0..=count).map(|k| k as f64 * step).collect()
}

/// Formats a number with at most three decimal places and without trailing zeros.
pub(crate) fn short_number(value: f64) -> String {
    let text = format!("{value:.3}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    short.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn steps_are_round() {
        assert_eq!(ticks_from_zero(5.0, 5), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(ticks_from_zero(93.0, 5), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks_from_zero(f64::NAN, 2), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn numbers_have_no_trailing_zeros() {
        let numbers = [0.0, 20.0, 12.5, 0.125];
        assert_eq!(numbers.map(short_number), ["0", "20", "12.5", "0.125"]);
    }

    proptest! {
        #[test]
        fn ticks_cover_any_maximum(max in 1e-9..1e9_f64, most in 2..9_usize) {
            let ticks = ticks_from_zero(max, most);
            let last = ticks[ticks.len() - 1];
            prop_assert!(last >= max * (1.0 - 1e-6) && ticks[ticks.len() - 2] < max);
            prop_assert!(ticks.len() <= most + 1);
        }

        #[test]
        fn any_number_makes_a_few_finite_ticks(max: f64) {
            let ticks = ticks_from_zero(max, 5);
            prop_assert!(ticks.len() <= 6 && ticks.iter().all(|t| t.is_finite()));
        }
    }
}
