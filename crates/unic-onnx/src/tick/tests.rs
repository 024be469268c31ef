//! Contract: each graph has the inputs and outputs that its model needs, and no others. Nodes
//! follow what they read.

use super::*;
use crate::{port::Length, test_models};
use unic_core::{
    config::{LatentCode, PointInput, StateConfig},
    motion::{MotionLayout, VelocityScheme},
};

/// Names and shapes of ports as one text, such as `root 3, rotations 2x4`.
fn text(graph: &Graph, ports: &[(crate::port::Port, String)]) -> String {
    let length = |length: &Length| match length {
        Length::Fixed(number) => number.to_string(),
        Length::Named(name) => name[..1].to_uppercase(),
    };
    let port = |(port, name): &(crate::port::Port, String)| {
        let shape: Vec<String> = graph.sizes().shape(*port).iter().map(length).collect();
        format!("{name} {}", shape.join("x"))
    };
    ports.iter().map(port).collect::<Vec<_>>().join(", ")
}

fn inputs(graph: &Graph) -> String {
    text(graph, graph.inputs())
}

fn outputs(graph: &Graph) -> String {
    text(graph, graph.outputs())
}

#[test]
fn nodes_of_every_graph_follow_what_they_read() {
    for model in test_models::all() {
        for graph in graphs(&model) {
            graph.check_order();
        }
    }
}

#[test]
fn a_displacement_has_the_state_that_its_inputs_read() {
    let model = test_models::displacement(|_| ());
    let graph = tick(&model);
    assert_eq!(
        inputs(&graph),
        "joint_positions 2x3, joint_rotations 2x4, motion 1x31, root 3, rotations 2x4, yaw 1x1, ground_height 1, wind 3, \
         rest Vx3, skinning_weights Vx2, prior_mean Vx3, displacement Vx3, displacement_before Vx3"
    );
    assert_eq!(
        outputs(&graph),
        "joint_positions_out 2x3, joint_rotations_out 2x4, yaw_out 1x1, motion_out 1x31, displacement_out Vx3, \
         displacement_before_out Vx3, positions Vx3"
    );
    // Every state that a tick reads comes out of both graphs that precede it.
    let start = outputs(&start(&model));
    for (port, name) in graph.inputs() {
        if port.role == crate::port::Role::State {
            assert!(start.contains(&format!("{name}_out ")), "{name} in {start}");
        }
    }
}

#[test]
fn masks_skinned_velocities_and_recurrences_are_ports_where_the_model_has_them() {
    let model = test_models::displacement(|parts| {
        parts.garment.mask = Some(vec![0.5; 3]);
        test_models::add_recurrence(parts);
        let StateConfig::Displacement(config) = &mut parts.config.state else {
            unreachable!("the model of the tour has displacements")
        };
        config.inputs[2] = PointInput::SkinVelocity;
    });
    let graph = tick(&model);
    let (read, written) = (inputs(&graph), outputs(&graph));
    for name in [
        "mask Vx1",
        "skinned_before Vx3",
        "recurrence 1x2",
        "prior_shapes Vx3x1",
    ] {
        assert!(read.contains(name), "{name} in {read}");
    }
    for name in ["skinned_before_out Vx3", "recurrence_out 1x2"] {
        assert!(written.contains(name), "{name} in {written}");
    }
    let prior = prior(&model);
    assert_eq!(
        inputs(&prior),
        "motion_pair 1x62, recurrence 1x2, prior_mean Vx3, prior_shapes Vx3x1"
    );
    assert_eq!(outputs(&prior), "recurrence_out 1x2, coefficients 1x1, prior Vx3");
}

#[test]
fn the_published_method_reads_the_next_pose_and_no_weights() {
    let model = test_models::root_relative(MotionLayout::Paper, VelocityScheme::Forward);
    let graph = tick(&model);
    assert_eq!(
        inputs(&graph),
        "joint_positions 2x3, joint_rotations 2x4, motion 1x31, root 3, rotations 2x4, next_root 3, next_rotations 2x4, \
         next_known 1, sequence_rotation 1x4, sequence_origin 1x3, wind 3, root_relative Vx3"
    );
    assert!(graphs(&model).iter().all(|graph| graph.name() != "prior"));
    assert_eq!(
        inputs(&field(&model)),
        "latent 1x2, frame_rotation 1x4, root_position 1x3, root_relative Vx3"
    );
    let model = test_models::root_relative(MotionLayout::PaperRootRelative, VelocityScheme::Backward);
    let read = inputs(&tick(&model));
    assert!(
        !read.contains("next_") && !read.contains("sequence_origin"),
        "{read}"
    );
}

#[test]
fn stages_have_the_shapes_of_the_model() {
    let model = test_models::displacement(|_| ());
    assert_eq!(inputs(&encoder(&model)), "motion_pair 1x62");
    assert_eq!(outputs(&encoder(&model)), "latent 1x2, logits 2x3");
    assert_eq!(
        inputs(&skinning(&model)),
        "joint_positions 2x3, joint_rotations 2x4, rest Vx3, skinning_weights Vx2"
    );
    assert_eq!(outputs(&skinning(&model)), "skinned Vx3, vertex_rotations Vx4");
    assert_eq!(
        inputs(&field(&model)),
        "latent 1x2, skinned Vx3, vertex_rotations Vx4, prior Vx3, displacement Vx3, displacement_before Vx3, rest Vx3"
    );
    let one_hot = test_models::displacement(|parts| {
        parts.config.encoder.code = LatentCode::OneHot;
        let [first, second] = [0, 1].map(|i| parts.field[i].inputs + 4);
        parts.field[0] = test_models::linear(first, 8);
        parts.field[1] = test_models::linear(second, 8);
    });
    assert_eq!(outputs(&encoder(&one_hot)), "latent 1x6, logits 2x3");
}
