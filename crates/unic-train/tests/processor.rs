//! Contract: every processor that the program is built for trains the same network as the CPU, and
//! goes on with its runs; one that it is not built for, or that the machine has not, is refused in
//! one sentence.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use unic_train::*;

const GPUS: [Processor; 3] = [Processor::Cuda, Processor::Vulkan, Processor::Metal];

fn trainer_on(config: &TrainConfig, processor: Processor) -> Result<Trainer, TrainError> {
    let (_folder, capture) = capture(&takes());
    let data = Dataset::load(capture, config, Fit::HeldOut)?;
    let prior = PriorTrainer {
        data: &data,
        settings: config,
        processor,
        folder: None,
    };
    let prior = prior.run(&|_, _| Control::Continue)?;
    Trainer::on(processor, FieldData::new(data, prior, config)?, config.clone())
}

/// Losses of the steps that are left, and the parameters after them.
fn train(trainer: &mut Trainer) -> (Vec<f32>, Vec<Vec<f32>>) {
    let mut losses = Vec::new();
    let mut listen = |event: &Event| {
        if let Event::Step { loss, .. } = event {
            losses.push(*loss);
        }
        Control::Continue
    };
    trainer.run(None, &mut listen).unwrap();
    (losses, trainer.network().values())
}

fn assert_near(found: &[f32], expected: &[f32], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let size = expected.iter().fold(0.0f32, |most, x| most.max(x.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() < 2e-3 * size,
            "{what}: {a}, on the CPU {b}, largest {size}"
        );
    }
}

#[test]
fn gpus_train_like_the_cpu_and_resume_its_runs() {
    for preset in PRESETS {
        let config = small(preset);
        let cpu = || trainer_on(&config, Processor::Cpu).unwrap();
        let (losses, parameters) = train(&mut cpu());
        for processor in GPUS {
            let mut trainer = match trainer_on(&config, processor) {
                Ok(trainer) => trainer,
                Err(error) => {
                    match error {
                        TrainError::NotBuilt { .. } => assert!(!processor.is_built(), "{error}"),
                        TrainError::Processor { .. } => assert!(processor.is_built(), "{error}"),
                        other => panic!("{other}"),
                    }
                    let sentence = error.to_string();
                    assert!(sentence.contains(&processor.to_string()) && !sentence.contains('\n'));
                    eprintln!("skipped: {sentence}");
                    continue;
                }
            };
            let (found, values) = train(&mut trainer);
            assert_near(&found, &losses, &format!("losses on {processor}"));
            assert_eq!(values.len(), parameters.len());
            for (values, expected) in values.iter().zip(&parameters) {
                assert_near(values, expected, &format!("parameters on {processor}"));
            }

            let folder = tempfile::tempdir().unwrap();
            let mut stop = |event: &Event| match event {
                Event::Step { step: 4, .. } => Control::Stop,
                _ => Control::Continue,
            };
            cpu().run(Some(folder.path()), &mut stop).unwrap();
            let mut other = trainer_on(&config, processor).unwrap();
            let checkpoint = Checkpoint::newest(folder.path()).unwrap().unwrap();
            other.resume(checkpoint, folder.path()).unwrap();
            let (found, _) = train(&mut other);
            assert_near(
                &found,
                &losses[4..],
                &format!("losses of a run that goes on on {processor}"),
            );
        }
    }
}
