//! The graphs of a model: start, tick, and the stages of a tick one by one.

use crate::{
    graph::{Graph, Value},
    kinematics::{Joints, Skinned, skin},
    motion::Motion,
    networks::{Moment, PriorFrame, encode},
    port::{
        COEFFICIENTS, FRAME_ROTATION, JOINT_POSITIONS, JOINT_ROTATIONS, LATENT, LOGITS, MOTION_PAIR,
        POSITIONS, PRIOR, PRIOR_MEAN, ROOT_POSITION, ROOT_RELATIVE, SKINNED, Sizes, VERTEX_ROTATIONS,
    },
    vertices::{DisplacementFrame, RootFrame},
};
use unic_core::{Model, config::StateConfig};

/// Lengths of a model's axes.
pub(crate) fn sizes(model: &Model) -> Sizes {
    let config = &model.config().encoder;
    let joints = model.character().skeleton.len();
    Sizes {
        joints,
        motion: model.config().motion.len(joints),
        masses: model.config().motion.springs.masses(),
        latent: config.latent_len(),
        channels: config.channels,
        categories: config.categories,
        recurrence: model.prior().state_len(),
        components: model.prior().len(),
    }
}

/// Makes all graphs of a model.
pub(crate) fn graphs(model: &Model) -> Vec<Graph> {
    let mut graphs = vec![
        start(model),
        tick(model),
        motion(model),
        skinning(model),
        encoder(model),
    ];
    if model.config().state != StateConfig::RootRelative {
        graphs.push(prior(model));
    }
    graphs.push(field(model));
    graphs
}

/// First frame: the garment in the mean shape of training, and the state of that frame.
fn start(model: &Model) -> Graph {
    let mut graph = Graph::new("start", sizes(model));
    let g = &mut graph;
    let skeleton = &model.character().skeleton;
    let motion = Motion::start(g, model);
    motion.output_state(g);
    g.scope("skinning");
    let skinned = skin(g, skeleton, motion.joints);
    let prior = g.input(PRIOR_MEAN);
    let frame = DisplacementFrame { skinned, prior };
    let positions = frame.positions(g, prior);
    match &model.config().state {
        StateConfig::RootRelative => {
            let frame = root_frame(g, model, &motion);
            let states = frame.states(g, positions);
            g.output(ROOT_RELATIVE, states);
        }
        StateConfig::Displacement(config) => {
            let prior = PriorFrame::new(g, model.prior(), motion.pair, Moment::Start);
            prior.output_state(g);
            // The mean shape is displaced from the prior by what the prior adds to it.
            let displacement = match prior.deviation(g) {
                Some(deviation) => g.map("Neg", deviation),
                None => g.sub(frame.prior, frame.prior),
            };
            frame.output_state(g, config, [displacement; 2]);
        }
    }
    g.output(POSITIONS, positions);
    graph
}

/// One tick.
fn tick(model: &Model) -> Graph {
    let mut graph = Graph::new("tick", sizes(model));
    let g = &mut graph;
    let motion = Motion::advance(g, model);
    motion.output_state(g);
    let code = encode(g, model, motion.pair);
    match &model.config().state {
        StateConfig::RootRelative => root_frame(g, model, &motion).advance(g, model, code.latent),
        StateConfig::Displacement(config) => {
            g.scope("skinning");
            let skinned = skin(g, &model.character().skeleton, motion.joints);
            let prior = PriorFrame::new(g, model.prior(), motion.pair, Moment::Tick);
            prior.output_state(g);
            let prior = prior.displacements(g);
            DisplacementFrame { skinned, prior }.advance(g, model, config, code.latent);
        }
    }
    graph
}

fn root_frame(graph: &mut Graph, model: &Model, motion: &Motion) -> RootFrame {
    RootFrame {
        rotation: motion.frame_rotation,
        origin: motion.joints.root_position(graph, &model.character().skeleton),
    }
}

/// Stage from poses to motion vectors.
fn motion(model: &Model) -> Graph {
    let mut graph = Graph::new("motion", sizes(model));
    let g = &mut graph;
    let motion = Motion::advance(g, model);
    motion.output_state(g);
    g.output(MOTION_PAIR, motion.pair);
    if model.config().state == StateConfig::RootRelative {
        let frame = root_frame(g, model, &motion);
        g.output(FRAME_ROTATION, frame.rotation);
        g.output(ROOT_POSITION, frame.origin);
    }
    graph
}

/// Stage from joints to skinned vertices.
fn skinning(model: &Model) -> Graph {
    let mut graph = Graph::new("skinning", sizes(model));
    let g = &mut graph;
    let joints = Joints {
        positions: g.input(JOINT_POSITIONS),
        rotations: g.input(JOINT_ROTATIONS),
    };
    let skinned = skin(g, &model.character().skeleton, joints);
    g.output(SKINNED, skinned.positions);
    g.output(VERTEX_ROTATIONS, skinned.rotations);
    graph
}

/// Stage from motion vectors to the motion's code.
fn encoder(model: &Model) -> Graph {
    let mut graph = Graph::new("encoder", sizes(model));
    let g = &mut graph;
    let pair = g.input(MOTION_PAIR);
    let code = encode(g, model, pair);
    g.output(LATENT, code.latent);
    g.output(LOGITS, code.logits);
    graph
}

/// Stage from motion vectors to the displacements of the prior.
fn prior(model: &Model) -> Graph {
    let mut graph = Graph::new("prior", sizes(model));
    let g = &mut graph;
    let pair = g.input(MOTION_PAIR);
    let prior = PriorFrame::new(g, model.prior(), pair, Moment::Tick);
    prior.output_state(g);
    if let Some(coefficients) = prior.coefficients {
        g.output(COEFFICIENTS, coefficients);
    }
    let displacements = prior.displacements(g);
    g.output(PRIOR, displacements);
    graph
}

/// Stage from everything else to the vertices' states and positions.
fn field(model: &Model) -> Graph {
    let mut graph = Graph::new("field", sizes(model));
    let g = &mut graph;
    let latent: Value = g.input(LATENT);
    match &model.config().state {
        StateConfig::RootRelative => {
            let frame = RootFrame {
                rotation: g.input(FRAME_ROTATION),
                origin: g.input(ROOT_POSITION),
            };
            frame.advance(g, model, latent);
        }
        StateConfig::Displacement(config) => {
            let skinned = Skinned {
                positions: g.input(SKINNED),
                rotations: g.input(VERTEX_ROTATIONS),
            };
            let prior = g.input(PRIOR);
            DisplacementFrame { skinned, prior }.advance(g, model, config, latent);
        }
    }
    graph
}

#[cfg(test)]
mod tests;
