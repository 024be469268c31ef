//! Models of three vertices on two joints, for tests.

use glam::Vec3;
use unic_core::{
    Model,
    config::StateConfig,
    model::ModelParts,
    motion::{JointSprings, MotionLayout, Normalisation, Spring, SpringDamping, VelocityScheme},
    network::Linear,
    prior::Components,
    recurrence::Recurrence,
};

#[allow(unreachable_pub, reason = "snippets of unic-core include the same file")]
mod tour {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../unic-core/src/tour_model.rs"
    ));
}

/// A model of displacements, whose parts are changed first.
pub(crate) fn displacement(change: impl FnOnce(&mut ModelParts)) -> Model {
    let file = tour::file().unwrap();
    let mut parts = Model::from_bytes(&file).unwrap().to_parts();
    change(&mut parts);
    Model::new(parts).unwrap()
}

/// A model of positions relative to the root joint.
pub(crate) fn root_relative(layout: MotionLayout, velocity: VelocityScheme) -> Model {
    displacement(|parts| {
        parts.config.state = StateConfig::RootRelative;
        parts.config.motion.layout = layout;
        parts.config.motion.velocity = velocity;
        parts.field = vec![linear(5, 8), linear(13, 8), linear(8, 3)];
    })
}

/// Adds a component and a recurrence of one oscillator to a prior.
pub(crate) fn add_recurrence(parts: &mut ModelParts) {
    let pair = parts.prior.map.inputs;
    parts.prior.components = Components::of_vectors(&vec![Vec3::X; parts.prior.mean.len()], 1);
    parts.prior.map = linear(pair, 1);
    parts.prior.recurrence = Some(Recurrence {
        poles: vec![[0.9, 0.1]],
        embedding: linear(pair, 4),
        drive: linear(4, 2),
        memory: linear(2, 4),
        hidden: linear(8, 4),
        head: linear(4, 1),
    });
}

/// Adds springs to both joints, and the recurrence.
pub(crate) fn add_springs(parts: &mut ModelParts) {
    let spring = |damping| Spring {
        frequency_hz: 1.0,
        damping_ratio: 0.5,
        damping,
    };
    parts.config.motion.springs = JointSprings {
        joints: vec![0, 1],
        springs: vec![spring(SpringDamping::Joint), spring(SpringDamping::Air)],
    };
    let len = parts.config.motion.len(2);
    parts.normalisation = Normalisation::identity(len);
    parts.prior.map.inputs = 2 * len;
    parts.encoder[0] = linear(2 * len, parts.encoder[0].outputs);
    add_recurrence(parts);
}

/// One model of each kind.
pub(crate) fn all() -> Vec<Model> {
    vec![
        displacement(|_| ()),
        displacement(add_recurrence),
        displacement(add_springs),
        root_relative(MotionLayout::Paper, VelocityScheme::Forward),
        root_relative(MotionLayout::PaperRootRelative, VelocityScheme::Backward),
        root_relative(MotionLayout::Heading, VelocityScheme::Backward),
    ]
}

pub(crate) fn linear(inputs: usize, outputs: usize) -> Linear {
    Linear {
        inputs,
        outputs,
        weight: vec![0.01; inputs * outputs],
        bias: vec![0.1; outputs],
    }
}
