//! Reference implementation of the documented formulas in f64, one vertex at a time. It is slow,
//! and shares only the motion vector and the replay with the crate, whose own tests check them.

#![allow(unreachable_pub, reason = "a module of test binaries")]
#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use glam::{DQuat, DVec3, Quat, Vec3};
use unic_core::{
    Model, Pose, StepInput,
    config::{DisplacementConfig, LatentCode, PointInput, StateConfig},
    model::ModelParts,
    motion::{MotionInput, MotionState},
    network::Linear,
    replay::{Replay, ReplayScratch, ReplayState},
};

/// Reference animator, without intersection handling.
pub struct Reference {
    parts: ModelParts,
    motion: MotionState,
    /// Skinned points of all frames so far.
    skinned: Vec<Vec<DVec3>>,
    /// Rotations of the vertices in the current frame.
    rotations: Vec<DQuat>,
    /// States of all frames so far: positions in the motion's frame, or displacements.
    states: Vec<Vec<DVec3>>,
    /// World positions of the first frame.
    start: Vec<DVec3>,
    /// Oscillators of the prior's recurrence, complex numbers.
    memory: Vec<[f64; 2]>,
    /// State of the prior's replay.
    replay: Option<ReplayState>,
    /// Memory of a garment whose positions were given.
    given: Given,
    wind: DVec3,
    /// Number of outputs that were shortened to the limit.
    pub limited: usize,
}

/// Memory of a garment whose positions were given.
#[derive(Default)]
struct Given {
    /// Coefficients in the frame of the given positions, without those of the replay.
    coefficients: Vec<f64>,
    /// Largest excursion since, metres.
    excursion: f64,
    share: f64,
}

impl Given {
    fn at(coefficients: Vec<f64>) -> Self {
        Self {
            coefficients,
            excursion: 0.0,
            share: 1.0,
        }
    }
}

impl Reference {
    /// Starts at frame 0 with the garment at its mean shape.
    pub fn new(model: &Model, input: &StepInput) -> Self {
        let parts = model.to_parts();
        let motion = MotionState::start(
            &parts.config.motion,
            &parts.character.skeleton,
            &tick(&parts, input),
        );
        let (skinned, rotations) = skin(&parts, input.pose);
        let mean = parts.prior.mean.iter().map(|u| u.as_dvec3());
        let start = skinned
            .iter()
            .zip(&rotations)
            .zip(mean)
            .map(|((x, r), u)| *x + *r * u)
            .collect();
        let mut reference = Self {
            replay: parts.prior.replay.as_ref().map(Replay::start),
            parts,
            motion,
            skinned: vec![skinned],
            rotations,
            states: vec![],
            start,
            memory: vec![],
            given: Given::default(),
            wind: input.wind.as_dvec3(),
            limited: 0,
        };
        if reference.parts.config.state == StateConfig::RootRelative {
            reference.states = vec![reference.to_root_relative(&reference.start.clone())];
        }
        reference
    }

    /// Advances to the next frame and returns world positions, metres.
    pub fn step(&mut self, input: &StepInput) -> Vec<DVec3> {
        let frame_0 = std::mem::take(&mut self.rotations);
        self.wind = input.wind.as_dvec3();
        self.motion.advance(
            &self.parts.config.motion,
            &self.parts.character.skeleton,
            &tick(&self.parts, input),
        );
        let (skinned, rotations) = skin(&self.parts, input.pose);
        self.skinned.push(skinned);
        self.rotations = rotations;
        let (before, now) = self.motion.pair();
        let pair = [self.normalised(before), self.normalised(now)].concat();
        let latent = self.latent(&pair);
        if self.states.is_empty() {
            // The displacement at frame 0 is counted from the prior of c_0, now that it is
            // complete.
            let still = [self.normalised(before), self.normalised(before)].concat();
            self.start_recurrence(&still);
            self.begin_replay(&pair);
            // A mean shape was not given, and fades.
            self.given = Given::at(self.moved(&still));
            (self.given.excursion, self.given.share) = (f64::INFINITY, 0.0);
            let prior = self.prior(&still);
            let vertices = self
                .start
                .iter()
                .zip(&self.skinned[0])
                .zip(frame_0.iter().zip(&prior));
            self.states.push(
                vertices
                    .map(|((x, s), (r, p))| r.inverse() * (*x - *s) - *p)
                    .collect(),
            );
        }
        self.advance_recurrence(&pair);
        self.advance_replay(&pair);
        let factor = self.forget(&pair);
        let outputs: Vec<DVec3> = (0..self.start.len()).map(|i| self.field(i, &latent)).collect();
        let next = outputs
            .into_iter()
            .enumerate()
            .map(|(i, output)| self.updated(i, output, factor))
            .collect();
        self.states.push(next);
        self.positions(&pair)
    }

    /// Replaces the garment of the current frame.
    pub fn set_garment(&mut self, positions: &[Vec3]) {
        let world: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
        let state = match self.parts.config.state {
            StateConfig::RootRelative => self.to_root_relative(&world),
            StateConfig::Displacement(_) => {
                let (before, now) = self.motion.pair();
                let pair = [self.normalised(before), self.normalised(now)].concat();
                self.given = Given::at(self.moved(&pair));
                let prior = self.prior(&pair);
                let own = |i: usize| self.rotations[i].inverse() * (world[i] - self.skinned_at(1)[i]);
                let place = |i: usize| own(i) * self.share(i) - prior[i];
                (0..world.len()).map(place).collect()
            }
        };
        *self.states.last_mut().unwrap() = state;
    }

    /// Skinned points `back` frames ago; 1 is the current frame.
    fn skinned_at(&self, back: usize) -> &[DVec3] {
        &self.skinned[self.skinned.len() - back]
    }

    /// Orientation of the motion vector's frame, and position of the root joint in the current
    /// frame.
    fn root_frame(&self) -> (DQuat, DVec3) {
        let root = self.parts.character.skeleton.root();
        let rotation = unit(self.motion.world_from_frame().rotation);
        (
            rotation,
            self.motion.world_from_joint()[root].translation.as_dvec3(),
        )
    }

    fn to_root_relative(&self, world: &[DVec3]) -> Vec<DVec3> {
        let (rotation, root) = self.root_frame();
        world.iter().map(|x| rotation.inverse() * (*x - root)).collect()
    }

    fn positions(&self, pair: &[f64]) -> Vec<DVec3> {
        let states = self.states.last().unwrap();
        if self.parts.config.state == StateConfig::RootRelative {
            let (rotation, root) = self.root_frame();
            return states.iter().map(|v| rotation * *v + root).collect();
        }
        let prior = self.prior(pair);
        let place = |i: usize| self.skinned_at(1)[i] + self.rotations[i] * (prior[i] + states[i]);
        (0..states.len()).map(place).collect()
    }

    fn normalised(&self, vector: &[f32]) -> Vec<f64> {
        let n = &self.parts.normalisation;
        let limit = n.limit.map_or(f64::INFINITY, f64::from);
        let one = |(c, (m, s)): (&f32, (&f32, &f32))| (f64::from(*c) - f64::from(*m)) / f64::from(*s);
        vector
            .iter()
            .zip(n.mean.iter().zip(&n.std))
            .map(one)
            .map(|x| x.clamp(-limit, limit))
            .collect()
    }

    fn prior(&self, pair: &[f64]) -> Vec<DVec3> {
        let prior = &self.parts.prior;
        let mut a = self.moved(pair);
        let share = 1.0 - self.given.share.powi(2);
        for (a, residual) in a.iter_mut().zip(self.residual(prior.len())) {
            *a += residual * share;
        }
        let component = |i: usize, k: usize| prior.components.vector(i, k).as_dvec3();
        let vertex =
            |i: usize| (0..a.len()).fold(prior.mean[i].as_dvec3(), |sum, k| sum + component(i, k) * a[k]);
        (0..prior.mean.len()).map(vertex).collect()
    }

    /// Coefficients that the motion moves, without those of the replay.
    fn moved(&self, pair: &[f64]) -> Vec<f64> {
        let prior = &self.parts.prior;
        if prior.is_empty() {
            return vec![];
        }
        let correction = self.correction(pair);
        let linear = product(&prior.map, pair).into_iter().enumerate();
        linear
            .map(|(k, a)| a + correction.get(k).unwrap_or(&0.0))
            .collect()
    }

    /// Advances what is left of the given garment, and returns the factor of the displacements.
    fn forget(&mut self, pair: &[f64]) -> f64 {
        let StateConfig::Displacement(config) = &self.parts.config.state else {
            return 1.0;
        };
        let prior = &self.parts.prior;
        let moved = self.moved(pair);
        let mean_square = |k: usize| {
            let vectors = (0..prior.mean.len()).map(|v| prior.components.vector(v, k));
            let squares = vectors.map(|c| c.as_dvec3().length_squared());
            squares.sum::<f64>() / prior.mean.len() as f64
        };
        let square: f64 = (0..moved.len())
            .map(|k| mean_square(k) * (moved[k] - self.given.coefficients[k]).powi(2))
            .sum();
        self.given.excursion = self.given.excursion.max(square.sqrt());
        let ratio = |within: f32| self.given.excursion / f64::from(within);
        let stays = config
            .excursion_m
            .map_or(0.0, |within| (-ratio(within).powi(2)).exp());
        let (before, decay) = (self.given.share, self.decay(config));
        // From here on f32 has nothing left.
        self.given.share = if before < 1e-6 {
            0.0
        } else {
            stays.max(before * decay)
        };
        match self.given.share > before * decay {
            true => self.given.share / before,
            false => decay,
        }
    }

    fn decay(&self, config: &DisplacementConfig) -> f64 {
        match f64::from(config.memory_s) {
            memory if memory > 0.0 => (-1.0 / (f64::from(self.parts.config.fps) * memory)).exp(),
            _ => 0.0,
        }
    }

    /// Starts the recurrence in its steady state h = u / (1 − λ), the sum of λ^n u over all n.
    fn start_recurrence(&mut self, pair: &[f64]) {
        self.memory = self.drive(pair);
        let drive = self.memory.clone();
        // After a thousand ticks the terms of the slowest pole have vanished.
        for _ in 0..1000 {
            self.memory = self.advanced_memory(&drive);
        }
    }

    /// Advances the recurrence by one frame.
    fn advance_recurrence(&mut self, pair: &[f64]) {
        self.memory = self.advanced_memory(&self.drive(pair));
    }

    /// Begins the replay at the first two frames.
    fn begin_replay(&mut self, pair: &[f64]) {
        if let (Some(replay), Some(state)) = (&self.parts.prior.replay, &mut self.replay) {
            let pair: Vec<f32> = pair.iter().map(|x| *x as f32).collect();
            replay.begin(&pair, 1.0 / self.parts.config.fps, state);
        }
    }

    /// Advances the replay by one frame.
    fn advance_replay(&mut self, pair: &[f64]) {
        if let (Some(replay), Some(state)) = (&self.parts.prior.replay, &mut self.replay) {
            let pair: Vec<f32> = pair.iter().map(|x| *x as f32).collect();
            let dt = 1.0 / self.parts.config.fps;
            replay.advance(&pair, dt, state, &mut ReplayScratch::default());
        }
    }

    /// Residual that the replay adds to so many coefficients.
    fn residual(&self, coefficients: usize) -> Vec<f64> {
        let mut residual = vec![0.0; coefficients];
        if let (Some(replay), Some(state)) = (&self.parts.prior.replay, &self.replay) {
            replay.add_to(state, &mut residual);
        }
        residual.into_iter().map(f64::from).collect()
    }

    /// Oscillators of the next frame, λ h + u.
    fn advanced_memory(&self, drive: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let poles = self.parts.prior.recurrence.iter().flat_map(|r| &r.poles);
        let advance = |((l, h), u): ((&[f32; 2], &[f64; 2]), &[f64; 2])| {
            let [re, im] = l.map(f64::from);
            [re * h[0] - im * h[1] + u[0], re * h[1] + im * h[0] + u[1]]
        };
        poles.zip(&self.memory).zip(drive).map(advance).collect()
    }

    /// Input u of the oscillators.
    fn drive(&self, pair: &[f64]) -> Vec<[f64; 2]> {
        let Some(r) = &self.parts.prior.recurrence else {
            return vec![];
        };
        let embedding: Vec<f64> = product(&r.embedding, pair).into_iter().map(elu).collect();
        let drive = product(&r.drive, &embedding);
        let count = r.poles.len();
        (0..count).map(|k| [drive[k], drive[count + k]]).collect()
    }

    /// Correction that the recurrence adds to the coefficients.
    fn correction(&self, pair: &[f64]) -> Vec<f64> {
        let Some(r) = &self.parts.prior.recurrence else {
            return vec![];
        };
        let embedding = product(&r.embedding, pair).into_iter().map(elu);
        let state: Vec<f64> = (0..2)
            .flat_map(|part| self.memory.iter().map(move |h| h[part]))
            .collect();
        let memory = product(&r.memory, &state).into_iter().map(elu);
        let joined: Vec<f64> = memory.chain(embedding).collect();
        let hidden: Vec<f64> = product(&r.hidden, &joined).into_iter().map(elu).collect();
        product(&r.head, &hidden)
    }

    /// Latent vector: linear maps with ELU between them, then the largest of each channel's logits,
    /// or the one-hot code of its category.
    fn latent(&self, pair: &[f64]) -> Vec<f64> {
        let (last, hidden) = self.parts.encoder.split_last().unwrap();
        let x = hidden.iter().fold(pair.to_vec(), |x, layer| {
            product(layer, &x).into_iter().map(elu).collect()
        });
        let logits = product(last, &x);
        let config = &self.parts.config.encoder;
        let of_channel = |channel: &[f64]| {
            let largest = channel.iter().copied().fold(f64::MIN, f64::max);
            match config.code {
                LatentCode::PickedLogit => vec![largest],
                LatentCode::OneHot => channel
                    .iter()
                    .map(|x| f64::from(u8::from(*x == largest)))
                    .collect(),
            }
        };
        logits
            .chunks_exact(config.categories)
            .flat_map(of_channel)
            .collect()
    }

    fn field(&self, vertex: usize, latent: &[f64]) -> DVec3 {
        let input = [self.point_inputs(vertex), latent.to_vec()].concat();
        let (last, hidden) = self.parts.field.split_last().unwrap();
        let mut x = input.clone();
        for (i, layer) in hidden.iter().enumerate() {
            if self.parts.config.field.skip == Some(i) {
                x.extend(&input);
            }
            x = product(layer, &x).into_iter().map(|y| y.max(0.0)).collect();
        }
        DVec3::from_slice(&product(last, &x))
    }

    fn point_inputs(&self, vertex: usize) -> Vec<f64> {
        match &self.parts.config.state {
            StateConfig::RootRelative => self.states.last().unwrap()[vertex].to_array().to_vec(),
            StateConfig::Displacement(config) => {
                let inputs = config.inputs.iter();
                inputs
                    .flat_map(|&input| self.point_input(config, input, vertex).to_array())
                    .collect()
            }
        }
    }

    fn point_input(&self, config: &DisplacementConfig, input: PointInput, vertex: usize) -> DVec3 {
        let (own_from_world, fps) = (self.rotations[vertex].inverse(), f64::from(self.parts.config.fps));
        let scale = f64::from(config.scale_m);
        let d = |back: usize| self.states[self.states.len().saturating_sub(back)][vertex];
        let x = |back: usize| self.skinned_at(back)[vertex];
        match input {
            PointInput::Displacement => d(1) / scale,
            PointInput::Velocity if self.states.len() < 2 => DVec3::ZERO,
            PointInput::Velocity => (d(1) - d(2)) / (3.0 * scale),
            PointInput::Rest => self.rest(vertex),
            PointInput::Up => own_from_world * DVec3::Y,
            PointInput::SkinVelocity => own_from_world * ((x(1) - x(2)) * fps - self.wind) / 2.0,
        }
    }

    /// Rest position relative to the bounding box, whose longest side is from −1 to 1.
    fn rest(&self, vertex: usize) -> DVec3 {
        let rest: Vec<DVec3> = self
            .parts
            .garment
            .rest
            .vertices
            .iter()
            .map(|v| v.as_dvec3())
            .collect();
        let low = rest.iter().fold(DVec3::MAX, |a, b| a.min(*b));
        let high = rest.iter().fold(DVec3::MIN, |a, b| a.max(*b));
        (rest[vertex] - (low + high) / 2.0) * 2.0 / (high - low).max_element()
    }

    fn updated(&mut self, vertex: usize, output: DVec3, factor: f64) -> DVec3 {
        let value = self.states.last().unwrap()[vertex];
        let StateConfig::Displacement(config) = &self.parts.config.state else {
            return value + output;
        };
        let limit = f64::from(config.output_limit);
        self.limited += usize::from(output.length() > limit);
        // A field that is zero has no direction.
        let shorter = (limit / output.length().max(1e-30)).min(1.0);
        let moved = output * shorter * f64::from(config.scale_m);
        value * factor + moved * self.share(vertex)
    }

    fn share(&self, vertex: usize) -> f64 {
        let mask = self.parts.garment.mask.as_ref();
        mask.map_or(1.0, |mask| f64::from(mask[vertex]))
    }
}

fn tick<'a>(parts: &ModelParts, input: &StepInput<'a>) -> MotionInput<'a> {
    let StepInput {
        pose,
        next_pose,
        ground_height,
        wind,
    } = *input;
    MotionInput {
        pose,
        next_pose,
        ground_height,
        wind,
        dt: 1.0 / parts.config.fps,
    }
}

fn product(layer: &Linear, x: &[f64]) -> Vec<f64> {
    assert_eq!(layer.inputs, x.len());
    let rows = layer.weight.chunks_exact(layer.inputs).zip(&layer.bias);
    rows.map(|(row, b)| f64::from(*b) + row.iter().zip(x).map(|(w, x)| f64::from(*w) * x).sum::<f64>())
        .collect()
}

fn elu(x: f64) -> f64 {
    if x > 0.0 { x } else { x.exp() - 1.0 }
}

fn unit(rotation: Quat) -> DQuat {
    rotation.as_dquat().normalize()
}

/// Computes the skinned points and rotations of the garment's vertices: forward kinematics with a
/// rest pose, linear blend skinning, and the blend of quaternions in the heaviest joint's
/// hemisphere.
fn skin(parts: &ModelParts, pose: &Pose) -> (Vec<DVec3>, Vec<DQuat>) {
    let skeleton = &parts.character.skeleton;
    let joints: Vec<DVec3> = skeleton.joints().iter().map(|j| j.as_dvec3()).collect();
    let rest_local: Vec<DQuat> = skeleton
        .rest_pose()
        .iter()
        .map(|a| DQuat::from_scaled_axis(a.as_dvec3()))
        .collect();
    let (mut g, mut g0, mut p) = (vec![], vec![], vec![]);
    // Parents precede their children in this skeleton.
    for (j, parent) in skeleton.parents().iter().enumerate() {
        let local = unit(pose.local[j]);
        let (rotation, rest, place) = match *parent {
            None => (local, rest_local[j], joints[j] + pose.trans.as_dvec3()),
            Some(q) => {
                let (gq, rest): (DQuat, DQuat) = (g[q], g0[q]);
                let offset: DVec3 = gq * (rest.inverse() * (joints[j] - joints[q]));
                (gq * local, rest * rest_local[j], p[q] + offset)
            }
        };
        g.push(rotation);
        g0.push(rest);
        p.push(place);
    }
    let turn: Vec<DQuat> = g.iter().zip(&g0).map(|(g, g0)| *g * g0.inverse()).collect();
    let weights = parts.garment.weights.to_dense();
    let rows = weights
        .chunks_exact(skeleton.len())
        .zip(&parts.garment.rest.vertices);
    let vertex = |(row, rest): (&[f32], &Vec3)| {
        let row: Vec<f64> = row.iter().map(|w| f64::from(*w)).collect();
        let moved = |j: usize| turn[j] * (rest.as_dvec3() - joints[j]) + p[j];
        let heaviest = (0..row.len())
            .rev()
            .max_by(|a, b| row[*a].total_cmp(&row[*b]))
            .unwrap();
        let side = |j: usize| {
            if turn[j].dot(turn[heaviest]) < 0.0 {
                -turn[j]
            } else {
                turn[j]
            }
        };
        let point: DVec3 = (0..row.len()).map(|j| moved(j) * row[j]).sum();
        let rotation = (0..row.len()).fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, j| {
            sum + side(j) * row[j]
        });
        (point, rotation.normalize())
    };
    rows.map(vertex).unzip()
}
