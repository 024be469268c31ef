//! Contract: regressions recover the systems that generate their data.

use super::{
    components::{Series, SeriesSet},
    fit::{Feedback, FittedRegression},
};

const INPUTS: usize = 5;

/// Input that excites every direction and differs between clips.
fn input(clip: usize, t: usize) -> Vec<f64> {
    let phase = |i: usize| (t * (i + 2)) as f64 * 0.37 + (clip * 7 + i) as f64;
    (0..INPUTS)
        .map(|i| phase(i).sin() + 0.3 * (1.7 * phase(i)).cos())
        .collect()
}

/// Computes z = B x + b + `memory` A z', where A rotates two of the components.
fn system(x: &[f64], previous: &[f64], memory: f64) -> Vec<f64> {
    let driven = |k: usize| -> f64 {
        let terms = x.iter().enumerate();
        0.02 * (k + 1) as f64
            + terms
                .map(|(i, x)| x * 0.05 * ((3 * k + i) as f64).cos())
                .sum::<f64>()
    };
    let [p, q, r] = [previous[0], previous[1], previous[2]];
    let turned = [0.8 * p - 0.6 * q, 0.6 * p + 0.8 * q, r];
    (0..3).map(|k| driven(k) + memory * turned[k]).collect()
}

fn series(clip: usize, frames: usize, memory: f64) -> Series {
    let inputs: Vec<_> = (1..frames).map(|t| input(clip, t)).collect();
    let mut components = vec![vec![0.1, -0.2, 0.02 * (clip % 5) as f64]];
    for x in &inputs {
        components.push(system(x, components.last().unwrap(), memory));
    }
    Series {
        inputs,
        components,
        motion: clip,
    }
}

fn set(clips: std::ops::Range<usize>, memory: f64) -> SeriesSet {
    SeriesSet {
        train: clips.map(|c| series(c, 80, memory)).collect(),
        validation: Vec::new(),
    }
}

/// Largest error of a free run over a clip that is not in the fit.
fn error_on_a_new_clip(fitted: &FittedRegression, memory: f64) -> f64 {
    let unseen = series(40, 300, memory);
    let mut z = unseen.components[0].clone();
    let mut worst = 0.0_f64;
    for (x, truth) in unseen.inputs.iter().zip(&unseen.components[1..]) {
        z = fitted.next(x, &z);
        let errors = z.iter().zip(truth).map(|(a, b)| (a - b).abs());
        worst = errors.fold(worst, f64::max);
    }
    worst
}

#[test]
fn ridge_recovers_a_linear_system() {
    for set in [set(0..3, 0.0), set(0..1, 0.0)] {
        let fitted = FittedRegression::new(&set, Feedback::None).unwrap();
        assert!(error_on_a_new_clip(&fitted, 0.0) < 1e-5);
        assert_eq!(fitted.strength, 1e-6);
    }
}

#[test]
fn linear_dynamics_recovers_a_stable_autoregression() {
    let set = set(0..3, 0.9);
    let fitted = FittedRegression::new(&set, Feedback::Previous).unwrap();
    let error = error_on_a_new_clip(&fitted, 0.9);
    assert!(error < 1e-3, "{error} m at strength {}", fitted.strength);
    // The motion alone does not determine the state.
    let ridge = FittedRegression::new(&set, Feedback::None).unwrap();
    assert!(error_on_a_new_clip(&ridge, 0.9) > 0.05);
}

#[test]
fn the_strength_is_chosen_on_the_validation_clips() {
    // The validation clips do not depend on the inputs: the flattest map is the best.
    let mut set = set(0..3, 0.0);
    let mut unrelated = series(9, 80, 0.0);
    let mean = unrelated.components.iter().fold(vec![0.0; 3], |sum, z| {
        sum.iter().zip(z).map(|(a, b)| a + b / 80.0).collect()
    });
    unrelated.components.fill(mean);
    assert_eq!(
        FittedRegression::new(&set, Feedback::None).unwrap().strength,
        1e-6
    );
    set.validation.push(unrelated);
    assert!(FittedRegression::new(&set, Feedback::None).unwrap().strength > 10.0);
}

#[test]
fn an_unstable_system_stays_in_range() {
    let set = set(0..2, 1.02);
    let fitted = FittedRegression::new(&set, Feedback::Previous).unwrap();
    let most = |k: usize| {
        let all = set.train.iter().flat_map(|s| &s.components);
        all.map(|z| z[k].abs()).fold(0.0, f64::max)
    };
    let mut z = vec![0.5; 3];
    for t in 0..5000 {
        z = fitted.next(&input(0, t), &z);
    }
    assert!((0..3).all(|k| z[k].abs() <= 2.0 * most(k) + 1e-12), "{z:?}");
}

#[test]
fn a_fit_without_pairs_is_none() {
    assert!(FittedRegression::new(&SeriesSet::default(), Feedback::None).is_none());
    let single = SeriesSet {
        train: vec![series(0, 1, 0.0)],
        validation: Vec::new(),
    };
    assert!(FittedRegression::new(&single, Feedback::Previous).is_none());
}
