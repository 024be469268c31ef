//! Contract of the settings: faulty values are refused by name.

use super::*;
use crate::motion::{JointSprings, MotionLayout, VelocityScheme};

fn config() -> ModelConfig {
    ModelConfig {
        fps: 30.0,
        motion: MotionSpec {
            layout: MotionLayout::Heading,
            velocity: VelocityScheme::Backward,
            contact_joints: [0, 1, 2, 3],
            contact_rest_heights_m: [0.1; 4],
            springs: JointSprings::default(),
        },
        encoder: EncoderConfig {
            hidden: vec![8],
            channels: 4,
            categories: 3,
            code: LatentCode::default(),
        },
        field: FieldConfig {
            width: 8,
            hidden_layers: 3,
            skip: Some(2),
        },
        state: StateConfig::Displacement(DisplacementConfig {
            memory_s: 0.1,
            excursion_m: None,
            scale_m: 0.05,
            output_limit: 3.0,
            inputs: vec![PointInput::Velocity, PointInput::Displacement, PointInput::Rest],
        }),
        intersection: IntersectionMode::Paper { relaxation_m: 0.005 },
        projection: None,
    }
}

fn refused(change: impl FnOnce(&mut ModelConfig, &mut DisplacementConfig)) -> &'static str {
    let mut config = config();
    let StateConfig::Displacement(mut state) = config.state.clone() else {
        unreachable!("the configuration above");
    };
    change(&mut config, &mut state);
    config.state = StateConfig::Displacement(state);
    config.check(5).unwrap_err().what
}

#[test]
fn distances_of_pushes_are_refused_outside_their_range() {
    let what = |config: ProjectionConfig| config.check().map_err(|error| error.what);
    let default = ProjectionConfig::default();
    for order in [0.01, 1.1, -0.2, f32::NAN] {
        assert_eq!(
            what(ProjectionConfig { order, ..default }),
            Err("projection.order")
        );
    }
    for layers in [0.51, -0.1, f32::NAN] {
        assert_eq!(
            what(ProjectionConfig { layers, ..default }),
            Err("projection.layers")
        );
    }
    let limits = ProjectionConfig {
        order: 1.0,
        layers: 0.5,
        ..default
    };
    assert_eq!(what(limits), Ok(()));
}

#[test]
fn errors_name_the_value_that_is_not_accepted() {
    assert_eq!(config().check(5), Ok(()));
    assert_eq!(refused(|c, _| c.fps = f32::NAN), "fps");
    assert_eq!(refused(|c, _| c.fps = 0.0), "fps");
    assert_eq!(refused(|c, _| c.encoder.hidden = vec![0]), "a layer's width");
    assert_eq!(refused(|c, _| c.field.width = usize::MAX), "a layer's width");
    assert_eq!(
        refused(|c, _| (c.encoder.channels, c.encoder.categories) = (1 << 16, 2)),
        "channels x categories"
    );
    assert_eq!(
        refused(|c, _| c.field.hidden_layers = usize::MAX),
        "field.hidden_layers"
    );
    assert_eq!(refused(|c, _| c.field.skip = Some(3)), "field.skip");
    assert_eq!(
        refused(|c, _| c.motion.contact_joints[2] = 5),
        "motion.contact_joints"
    );
    assert_eq!(refused(|_, s| s.scale_m = -0.1), "state.scale_m");
    assert_eq!(
        refused(|_, s| s.output_limit = f32::INFINITY),
        "state.output_limit"
    );
    assert_eq!(refused(|_, s| s.memory_s = 1e9), "state.memory_s");
    assert_eq!(refused(|_, s| s.memory_s = f32::NAN), "state.memory_s");
    assert_eq!(refused(|_, s| s.inputs.clear()), "state.inputs");
    assert_eq!(refused(|_, s| s.inputs.push(PointInput::Rest)), "state.inputs");
    assert_eq!(refused(|_, s| s.inputs.reverse()), "state.inputs");
    let relaxation_m = f32::NAN;
    let named = refused(|c, _| c.intersection = IntersectionMode::Paper { relaxation_m });
    assert_eq!(named, "intersection.relaxation_m");
    let pull_s = f32::NAN;
    let projection = ProjectionConfig {
        pull_s,
        ..ProjectionConfig::default()
    };
    let named = refused(|c, _| c.projection = Some(projection));
    assert_eq!(named, "projection.pull_s");
    let robust = IntersectionMode::Robust {
        margin_m: -0.001,
        corrects: Corrects::Display,
    };
    let named = refused(|c, _| c.intersection = robust);
    assert_eq!(named, "intersection.margin_m");
}

#[test]
fn inputs_are_counted_three_numbers_each() {
    assert_eq!(
        (config().state.input_len(), config().state.state_input_len()),
        (9, 6)
    );
    assert_eq!(
        (
            StateConfig::RootRelative.input_len(),
            StateConfig::RootRelative.state_input_len()
        ),
        (3, 3)
    );
}

#[test]
fn a_memory_of_one_tick_decays_by_the_factor_e() {
    let StateConfig::Displacement(mut state) = config().state else {
        unreachable!("the configuration above");
    };
    assert!((state.decay(0.1) - (-1f32).exp()).abs() < 1e-6);
    state.memory_s = 0.0;
    assert_eq!(state.decay(0.1), 0.0);
}
