//! Contract: the errors that a run reports in training are those of an evaluation afterwards. The
//! certainty of a categorical code has a closed form.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use std::sync::Arc;
use unic_core::Model;
use unic_eval::{CodeCertainty, ModelPredictor, NamedPredictor, PreparedClip, evaluate};
use unic_train::*;

#[test]
fn the_one_step_error_of_a_run_is_that_of_an_evaluation() {
    for preset in PRESETS {
        let config = small(preset);
        let (_folder, capture) = capture(&takes());
        let data = FieldData::prepare(capture.clone(), &config, Fit::HeldOut).unwrap();
        let mut trainer = Trainer::new(data, config).unwrap();
        let mut reported = None;
        let mut listen = |event: &Event| {
            if let Event::OneStep { validation_rmse, .. } = event {
                reported = *validation_rmse;
            }
            Control::Continue
        };
        trainer.run(None, &mut listen).unwrap();
        let predictor = ModelPredictor::new(Arc::new(trainer.model().unwrap()));
        let clips = [trainer.data().validation[0].name().to_owned()];
        let found = evaluate(
            &capture,
            &mut [NamedPredictor::model(predictor)],
            &clips,
            &mut |_| Ok(()),
        )
        .unwrap();
        let found = found.pooled.model.unwrap().one_step.unwrap().rmse_mm;
        let reported = 1e3 * reported.unwrap();
        assert!(
            (reported - found).abs() < 1e-3 * found,
            "{preset:?}: {reported} mm, {found} mm"
        );
    }
}

/// The error on training clips falls with the steps, and is measured at the same places every time.
#[test]
fn the_one_step_error_on_training_clips_is_of_a_fixed_sample() {
    let mut config = small(Preset::Paper);
    config.validation.every = 1;
    config.optimiser.learning_rate = 0.0 + f64::MIN_POSITIVE;
    config.optimiser.final_learning_rate = 0.0;
    config.optimiser.weight_decay = 0.0;
    let (_folder, capture) = capture(&takes());
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    let mut errors = Vec::new();
    let mut listen = |event: &Event| {
        if let Event::OneStep { training_rmse, .. } = event {
            errors.push(*training_rmse);
        }
        Control::Continue
    };
    Trainer::new(data, config)
        .unwrap()
        .run(None, &mut listen)
        .unwrap();
    // A network that does not move errs by the same on the same sample.
    assert_eq!(errors.len(), 10);
    assert!(
        errors[0] > 0.0 && errors.iter().all(|e| *e == errors[0]),
        "{errors:?}"
    );
}

/// The same logits for every motion.
fn deciding(model: &Model, logits: &[f32]) -> Model {
    let mut parts = model.to_parts();
    let last = parts.encoder.last_mut().unwrap();
    last.weight.fill(0.0);
    last.bias = logits.repeat(last.outputs / logits.len());
    Model::new(parts).unwrap()
}

#[test]
fn the_certainty_of_a_code_has_a_closed_form() {
    let config = small(Preset::Paper);
    let (_folder, capture) = capture(&takes());
    let data = FieldData::prepare(capture.clone(), &config, Fit::HeldOut).unwrap();
    let model = Trainer::new(data, config).unwrap().model().unwrap();
    let long = take("long", 3, 450);
    let clips = |frames: usize| {
        let mut captured = capture.load_clip("take0").unwrap();
        captured.clip.poses = long.clip.poses[..frames].to_vec();
        let skeleton = &capture.character.skeleton;
        vec![PreparedClip::new(&model.config().motion, skeleton, captured)]
    };
    // e² / (e² + 3) of four categories.
    let decided = CodeCertainty::measure(&deciding(&model, &[0.0, 2.0, 0.0, 0.0]), &clips(30)).unwrap();
    let expected = 2f64.exp() / (2f64.exp() + 3.0);
    assert!(
        (decided.mean_top_probability - expected).abs() < 1e-6,
        "{decided:?}"
    );
    assert_eq!((decided.uniform, decided.frames), (0.25, 29));
    // A long clip is looked at in every third frame.
    let undecided = CodeCertainty::measure(&deciding(&model, &[1.5; 4]), &clips(450)).unwrap();
    assert!((undecided.mean_top_probability - 0.25).abs() < 1e-6);
    assert_eq!(undecided.frames, 150);
    assert_eq!(CodeCertainty::measure(&model, &[]), None);
}
