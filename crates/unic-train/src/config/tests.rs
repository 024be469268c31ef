use super::*;

#[test]
fn presets_round_trip_through_toml() {
    for preset in [Preset::Paper, Preset::Standard, Preset::Tiny] {
        let config = TrainConfig::preset(preset);
        config.check().unwrap();
        assert_eq!(TrainConfig::from_toml(&config.to_toml()).unwrap(), config);
    }
}

#[test]
fn assignments_reach_nested_keys_and_refuse_unknown_ones() {
    let config = TrainConfig::preset(Preset::Tiny);
    let set = |text: &str| config.with_assignments(&[text.to_owned()]);
    assert_eq!(set("optimiser.steps=7").unwrap().optimiser.steps, 7);
    let refit = set("validation.refit = never").unwrap().validation.refit;
    assert_eq!(refit, Refit::Never);
    assert_eq!(set("motion_seconds=5").unwrap().motion_seconds, Some(5.0));
    for wrong in [
        "steps",
        "optimiser.stepz=7",
        "nowhere.steps=7",
        "optimiser.steps=x",
        "batch.points=0",
        "loss.position=-1",
        "optimiser.clip_norm=nan",
        "optimiser.learning_rate=inf",
        "model.normalisation.least_std=nan",
        "model.normalisation.limit=-1",
        "model.normalisation.limit=nan",
        "model.state.displacement.memory_s=nan",
        "model.state.displacement.excursion_m=nan",
        "model.state.displacement.excursion_m=-1",
        "validation.every=0",
        "validation.refit=maybe",
    ] {
        assert!(set(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn epochs_set_the_number_of_steps_unless_steps_are_given() {
    let config = TrainConfig::preset(Preset::Paper);
    // 300 passes over 1,000 pairs, 128 of them in a step.
    assert_eq!(config.clone().for_pairs(1000).optimiser.steps, 2344);
    assert!((config.epochs_of(2344, 1000) - 300.0).abs() < 0.1);
    assert_eq!(config.clone().for_pairs(0).optimiser.steps, 1);
    assert_eq!(
        config.clone().for_pairs(usize::MAX).optimiser.steps,
        u64::MAX.div_ceil(128)
    );
    let set = |lines: &[&str]| {
        let lines: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        config.with_assignments(&lines).unwrap().for_pairs(1000).optimiser
    };
    let given = set(&["optimiser.steps=7"]);
    assert_eq!((given.steps, given.epochs), (7, None));
    assert_eq!(set(&["optimiser.epochs=30"]).steps, 235);
    assert_eq!(set(&["optimiser.steps = 7", "optimiser.epochs = 30"]).steps, 235);
    assert_eq!(set(&["optimiser.epochs = 30", "optimiser.steps = 7"]).steps, 7);
    assert!(
        config
            .with_assignments(&["optimiser.epochs=0".to_owned()])
            .is_err()
    );
    let standard = TrainConfig::preset(Preset::Standard);
    assert_eq!(standard.clone().for_pairs(1000), standard);
}

#[test]
fn longer_run_continues_the_schedule_of_the_shorter_one() {
    let config = TrainConfig::preset(Preset::Paper);
    let with = |lines: &[&str]| {
        let lines: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        config.with_assignments(&lines).unwrap()
    };
    let longer = with(&["optimiser.epochs=500", "optimiser.half_periods=5.0"]);
    assert!(config.is_lengthened_by(&longer));
    assert!(!longer.is_lengthened_by(&config));
    assert!(!config.is_lengthened_by(&config));
    // Epochs are rounded up to whole steps: 2,344 and 3,907 of them here.
    let (short, long) = (config.clone().for_pairs(1000), longer.clone().for_pairs(1000));
    for step in [0, 900, 2343] {
        assert!((short.learning_rate(step) - long.learning_rate(step)).abs() < 1e-3 * 1e-4);
    }
    assert!(!config.is_lengthened_by(&with(&["optimiser.epochs=500"])));
    assert!(!config.is_lengthened_by(&with(&["optimiser.steps=5000", "optimiser.half_periods=5.0"])));
    let other = &["optimiser.epochs=500", "optimiser.half_periods=5.0", "seed=2"];
    assert!(!config.is_lengthened_by(&with(other)));
    let twice = |c: &TrainConfig| TrainConfig {
        validation: ValidationConfig {
            refit: Refit::AllClips,
            ..c.validation.clone()
        },
        ..c.clone()
    };
    assert!(!twice(&config).is_lengthened_by(&twice(&longer)));
    let grows = |c: &TrainConfig| TrainConfig {
        batch: BatchConfig {
            unroll_last: 3,
            ..c.batch.clone()
        },
        ..c.clone()
    };
    assert!(!grows(&config).is_lengthened_by(&grows(&longer)));
    let sized = |c: &TrainConfig| TrainConfig {
        sizing: SizingSettings { sizes: vec![[8, 2]] },
        ..c.clone()
    };
    assert!(!sized(&config).is_lengthened_by(&sized(&longer)));
}

#[test]
fn sizes_are_refused_unless_they_rise() {
    let of = |sizes: &str| {
        let config = TrainConfig::preset(Preset::Standard);
        config.with_assignments(&[format!("sizing.sizes={sizes}")])
    };
    assert!(of("[[64,4],[128,4],[256,6]]").is_ok());
    for sizes in ["[[64,4],[64,4]]", "[[128,4],[64,4]]"] {
        let text = of(sizes).unwrap_err().to_string();
        assert!(text.contains("from small to large"), "{text}");
    }
}

#[test]
fn values_of_the_projection_are_refused_outside_their_range() {
    let of = |text: &str| {
        let config = TrainConfig::preset(Preset::Standard);
        config.with_assignments(&[text.to_owned()])
    };
    assert!(of("projection.layers=0").is_ok() && of("projection.order=[0.05]").is_ok());
    for text in [
        "projection.layers=0.6",
        "projection.layers=-0.1",
        "projection.order=[0.01]",
        "projection.chord_deviations=[]",
        "projection.chord_deviations=[-0.1]",
        "projection.chord_deviations=[0.5, 1.6]",
        "projection.chord_deviations=[nan]",
    ] {
        let found = of(text).unwrap_err().to_string();
        assert!(found.contains(text.split('=').next().unwrap()), "{found}");
    }
}

#[test]
fn learning_rate_of_the_paper_rises_in_the_second_half_period() {
    let config = TrainConfig::preset(Preset::Paper);
    let third = config.optimiser.steps / 3;
    assert!((config.learning_rate(0) - 1e-4).abs() < 1e-12);
    assert!((config.learning_rate(third) - 1e-6).abs() < 1e-9);
    assert!((config.learning_rate(2 * third) - 1e-4).abs() < 1e-9);
    assert!((config.learning_rate(3 * third) - 1e-6).abs() < 1e-9);
}

#[test]
fn unrolling_grows_to_its_full_length() {
    let config = TrainConfig::preset(Preset::Standard);
    assert_eq!(config.unroll(0), config.batch.unroll_first);
    assert_eq!(
        config.unroll(config.optimiser.steps - 1),
        config.batch.unroll_last
    );
    assert_eq!(TrainConfig::preset(Preset::Paper).unroll(10), 1);
}

#[test]
fn batch_that_exceeds_memory_is_refused() {
    let config = TrainConfig::preset(Preset::Paper);
    let set = |points: usize, unroll: usize| {
        let lines = [
            format!("batch.points={points}"),
            format!("batch.unroll_last={unroll}"),
        ];
        config.with_assignments(&lines)
    };
    // 128 windows: the published batch of 1.2 million vertices fits.
    assert!(set(9_375, 1).is_ok());
    assert!(set(1 << 15, 1).is_ok());
    let error = set(1 << 15, 2).unwrap_err().to_string();
    assert!(
        error.contains("product") && error.contains("found 8388608"),
        "{error}"
    );
}

#[test]
fn faulty_file_is_refused_with_a_one_line_error() {
    let text = TrainConfig::preset(Preset::Tiny).to_toml();
    for (whole, fault, message) in [
        ("seed = 1", "seed = \"\u{1f}\"", "line 1"),
        ("seed = 1", "sead = 1", "unknown field `sead`"),
        ("steps = 100", "steps = -1", "`-1`"),
    ] {
        assert!(text.contains(whole), "{text}");
        let error = TrainConfig::from_toml(&text.replacen(whole, fault, 1))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(message) && !error.contains(char::is_control),
            "{error}"
        );
    }
}

#[test]
fn largest_values_do_not_overflow() {
    let mut config = TrainConfig::preset(Preset::Standard);
    config.optimiser.steps = u64::MAX;
    assert!(config.learning_rate(u64::MAX) >= 0.0 && config.unroll(u64::MAX) > 0);
    if let StateSettings::Displacement {
        recurrence: Some(recurrence),
        ..
    } = &mut config.model.state
    {
        (recurrence.steps, recurrence.epochs) = (u64::MAX, u64::MAX);
        assert!(recurrence.steps_for(usize::MAX) > 1);
    }
}

#[test]
fn learning_rate_comes_near_its_setting_in_any_number_of_steps() {
    for preset in Preset::ALL {
        for steps in [20, 100, 1000, 3000] {
            let mut config = TrainConfig::preset(preset);
            config.set_steps(steps);
            let rates = (0..steps).map(|step| config.learning_rate(step));
            let largest = rates.fold(0.0, f64::max) / config.optimiser.learning_rate;
            // At the end of a warm-up over a tenth the cosine has fallen by 2.4 %.
            assert!(
                (0.97..=1.0).contains(&largest),
                "{preset:?}, {steps} steps: {largest}"
            );
        }
    }
}

#[test]
fn runs_of_earlier_versions_keep_the_weights_of_the_capture() {
    let mut settings = serde_json::to_value(TrainConfig::preset(Preset::Standard)).unwrap();
    let displacement = &mut settings["model"]["state"]["displacement"];
    assert_eq!(displacement["skinning"], "fitted");
    displacement.as_object_mut().unwrap().remove("skinning");
    let config: TrainConfig = serde_json::from_value(settings).unwrap();
    let StateSettings::Displacement { skinning, .. } = config.model.state else {
        panic!("standard's state is a displacement");
    };
    assert_eq!(skinning, SkinningSource::Given);
}

#[test]
fn runs_of_earlier_versions_keep_their_chords() {
    let mut settings = serde_json::to_value(TrainConfig::preset(Preset::Standard)).unwrap();
    let removed = settings["projection"]
        .as_object_mut()
        .unwrap()
        .remove("chord_deviations");
    assert!(removed.is_some());
    let config: TrainConfig = serde_json::from_value(settings).unwrap();
    assert_eq!(config.projection.chord_deviations, [1.5]);
}
