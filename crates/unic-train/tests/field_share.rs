//! Contract: a model scales its field's output by the share with the least error on held-out
//! motion. A field that has memorised its training motions therefore does no harm.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};
use unic_core::{Animator, IntersectionMode, Start, StepInput};
use unic_train::*;

/// A run of `standard`'s kind whose steps are so large that they only do harm.
fn harmed() -> (f64, Trainer) {
    let mut config = small(Preset::Tiny);
    // Shares are compared without intersection handling, the error is reported with it.
    config.intersection.at_inference = true;
    // A model without a field would keep its start, which is another difference.
    if let StateSettings::Displacement { excursion_m, .. } = &mut config.model.state {
        *excursion_m = 0.0;
    }
    config.optimiser.learning_rate = 1.0;
    config.optimiser.warmup = 0.0;
    config.regularisation.average = 0.0;
    let mut trainer = Trainer::new(dataset(&config), config).unwrap();
    let prior_mm = trainer
        .validation(&|| Control::Continue)
        .unwrap()
        .unwrap()
        .rmse_mm;
    trainer.run(None, &mut |_| Control::Continue).unwrap();
    (prior_mm, trainer)
}

#[test]
fn field_that_harms_held_out_motion_is_reduced() {
    let (prior_mm, mut trainer) = harmed();
    let whole = free_running_rmse(&trainer.model().unwrap().into(), &trainer.data().validation).unwrap();
    assert!(
        1e3 * whole > 1.1 * prior_mm,
        "{whole} m, of the prior {prior_mm} mm"
    );
    let validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
    assert!(validation.field_share < 1.0, "{validation:?}");
    assert!(validation.rmse_mm < 1.001 * prior_mm, "{validation:?}");
    // The model has the error that its validation reports.
    trainer.set_validation(validation.clone());
    let rmse = free_running_rmse(&trainer.model().unwrap().into(), &trainer.data().validation).unwrap();
    assert!(
        (1e3 * rmse - validation.rmse_mm).abs() < 1e-6,
        "{rmse} {validation:?}"
    );
}

#[test]
fn a_share_of_the_field_moves_the_displacement_by_that_share() {
    let (_, mut trainer) = harmed();
    let mut displacements = |field_share: f32| {
        trainer.set_validation(Validation {
            fit: Fit::HeldOut,
            motion: ValidationMotion::Unseen,
            clips: vec![],
            rmse_mm: 0.0,
            field_share,
            bending: None,
            chord_deviations: None,
            order: None,
            replay_factor: None,
            trials: vec![],
        });
        let mut animator = Animator::new(Arc::new(trainer.model().unwrap()));
        animator.set_intersection(IntersectionMode::Off);
        let motion = &trainer.data().validation[0].captured.clip;
        let input = StepInput {
            pose: &motion.poses[0],
            next_pose: motion.poses.get(1),
            ground_height: motion.ground_height,
            wind: motion.wind_at(0),
        };
        animator.reset(&input, Start::MeanShape).unwrap();
        animator.step(&input).unwrap().positions.to_vec()
    };
    let [none, half, whole] = [0.0, 0.5, 1.0].map(&mut displacements);
    let moved = |to: &[Vec3]| -> Vec<Vec3> { to.iter().zip(&none).map(|(a, b)| *a - *b).collect() };
    let (half, whole) = (moved(&half), moved(&whole));
    assert!(whole.iter().any(|d| d.length() > 1e-3));
    for (half, whole) in half.iter().zip(&whole) {
        assert!((*half * 2.0).distance(*whole) < 1e-5, "{half} {whole}");
    }
}

#[test]
fn a_validation_can_be_stopped_between_its_shares() {
    let (_, trainer) = harmed();
    let asked = AtomicUsize::new(0);
    let ask = || match asked.fetch_add(1, Ordering::Relaxed) {
        0 => Control::Continue,
        _ => Control::Stop,
    };
    assert!(matches!(trainer.validation(&ask), Err(TrainError::Stopped)));
    assert_eq!(asked.into_inner(), 2);
}
