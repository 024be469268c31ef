//! Test fixtures: a small random character with a tube as its garment, random models of every kind,
//! and motions.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "every test binary and example uses a part of it"
)]
#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod handling;

#[allow(unused_imports, reason = "every test binary and example uses a part of it")]
pub use handling::{correct_each, skinned_garment};

use glam::{Quat, Vec3};
use std::f32::consts::TAU;
use std::sync::Arc;
use unic_core::{
    Animator, GarmentFrame, Model, Pose, Start, StepInput,
    character::{Character, Garment},
    config::*,
    features::RestBox,
    mesh::TriMesh,
    model::{About, ModelParts},
    motion::{JointSprings, MotionLayout, MotionSpec, Normalisation, Spring, VelocityScheme, motion_len},
    network::Linear,
    prior::{Components, Prior},
    projection::{StrainLimit, limited_pairs},
    recurrence::Recurrence,
    replay::{FEATURES, KeyMap, Library, Replay},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Number of joints: pelvis, chest, left foot, right foot, head.
pub const JOINTS: usize = 5;
/// Frame rate of models and motions, Hz.
pub const FPS: f32 = 30.0;

/// Settings in which the variants of a model differ.
#[derive(Clone, Debug)]
pub struct Variant {
    pub name: &'static str,
    pub layout: MotionLayout,
    pub velocity: VelocityScheme,
    pub state: StateConfig,
    /// Number of the prior's principal components. Without any the prior is its mean; with two or
    /// more it has a recurrence.
    pub components: usize,
    /// Limit of the elements of the normalised motion vector.
    pub limit: Option<f32>,
    pub masking: Masking,
    pub code: LatentCode,
    /// Strain projection with limits 2 % around the rest lengths.
    pub projection: Option<ProjectionConfig>,
    pub springs: JointSprings,
}

/// Mask of the garment's vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masking {
    /// No mask: the model moves all vertices.
    None,
    /// Mask that grows from 0 at the lowest ring to 1 at the highest.
    Graded,
}

/// Variants of both states, with and without principal components, in all layouts.
pub fn variants() -> Vec<Variant> {
    use MotionLayout::{Heading, Paper, PaperRootRelative};
    use PointInput::*;
    use VelocityScheme::{Backward, Forward};
    let second_order = displacement(0.1, 3.0, &[Displacement, Velocity, Rest, Up, SkinVelocity]);
    // The velocity first, and a limit that is often reached.
    let short = displacement(0.05, 0.4, &[Velocity, Displacement, SkinVelocity, Rest]);
    let pose_only = displacement(0.0, 2.0, &[Rest, Up]);
    let mut kept = displacement(0.2, 2.0, &[Displacement, Rest]);
    if let StateConfig::Displacement(config) = &mut kept {
        config.excursion_m = Some(0.05);
    }
    let variant = |name, layout, velocity, state, components, limit| Variant {
        name,
        layout,
        velocity,
        state,
        components,
        limit,
        masking: Masking::None,
        code: LatentCode::PickedLogit,
        projection: None,
        springs: JointSprings::default(),
    };
    let one_hot = Variant {
        code: LatentCode::OneHot,
        ..variant("one-hot code", Paper, Forward, StateConfig::RootRelative, 0, None)
    };
    let masked = Variant {
        masking: Masking::Graded,
        ..variant("masked", Heading, Backward, short.clone(), 2, Some(4.0))
    };
    let projected = Variant {
        projection: Some(ProjectionConfig::default()),
        ..variant("projected", Heading, Backward, short.clone(), 2, Some(4.0))
    };
    let masked_projected = Variant {
        name: "projected, masked",
        masking: Masking::Graded,
        ..projected.clone()
    };
    let relative_projected = Variant {
        projection: Some(ProjectionConfig::default()),
        ..variant(
            "position, projected",
            Heading,
            Backward,
            StateConfig::RootRelative,
            0,
            None,
        )
    };
    let kept_projected = Variant {
        projection: Some(ProjectionConfig::default()),
        ..variant(
            "kept garment, projected",
            Heading,
            Backward,
            kept.clone(),
            2,
            Some(5.0),
        )
    };
    vec![
        relative_projected,
        kept_projected,
        projected,
        masked_projected,
        masked,
        one_hot,
        variant("paper", Paper, Forward, StateConfig::RootRelative, 0, None),
        variant(
            "paper, motion relative to the root",
            PaperRootRelative,
            Forward,
            StateConfig::RootRelative,
            0,
            None,
        ),
        variant(
            "position in the heading frame",
            Heading,
            Backward,
            StateConfig::RootRelative,
            0,
            Some(5.0),
        ),
        variant(
            "second order",
            Heading,
            Backward,
            second_order.clone(),
            3,
            Some(4.0),
        ),
        variant(
            "second order, mean alone",
            Heading,
            Backward,
            second_order,
            0,
            None,
        ),
        variant("short limit", Heading, Forward, short.clone(), 2, Some(3.0)),
        variant(
            "displacement in the paper's layout",
            Paper,
            Backward,
            short,
            2,
            None,
        ),
        variant("pose only", Heading, Backward, pose_only, 1, Some(5.0)),
        Variant {
            springs: springs(),
            ..variant("kept garment", Heading, Backward, kept, 2, Some(5.0))
        },
    ]
}

/// Variants whose shown positions are the predicted ones, for formulas of these.
pub fn variants_without_projection() -> impl Iterator<Item = Variant> {
    variants().into_iter().filter(|v| v.projection.is_none())
}

/// Returns true for variants whose field is not zero.
pub fn has_field(variant: &Variant) -> bool {
    !matches!(&variant.state, StateConfig::Displacement(d) if d.excursion_m.is_some())
}

fn displacement(memory_s: f32, output_limit: f32, inputs: &[PointInput]) -> StateConfig {
    StateConfig::Displacement(DisplacementConfig {
        memory_s,
        excursion_m: None,
        scale_m: 0.05,
        output_limit,
        inputs: inputs.to_vec(),
    })
}

pub fn variant(name: &str) -> Variant {
    variants().into_iter().find(|v| v.name == name).unwrap()
}

/// Model of a variant with a garment of 13 × 12 vertices: three tiles, the last one partly full.
pub fn parts(variant: &Variant) -> ModelParts {
    let config = ModelConfig {
        fps: FPS,
        motion: motion_spec(variant),
        encoder: EncoderConfig {
            hidden: vec![24, 16],
            channels: 6,
            categories: 4,
            code: variant.code,
        },
        field: FieldConfig {
            width: 18,
            hidden_layers: 4,
            skip: Some(2),
        },
        state: variant.state.clone(),
        intersection: IntersectionMode::Off,
        projection: variant.projection,
    };
    let garment = tube(13, 12, 0.27);
    let inputs = 2 * config.motion.len(JOINTS);
    let prior = prior_of(inputs, garment.rest.vertices.len(), variant.components);
    let mut parts = with_networks(config, garment, prior, variant.limit);
    if !has_field(variant) {
        parts.field.last_mut().unwrap().scale(0.0);
    }
    match variant.masking {
        Masking::None => parts,
        Masking::Graded => Model::new(parts)
            .unwrap()
            .with_mask(&graded(13, 12))
            .unwrap()
            .to_parts(),
    }
}

/// Mask of a tube: 0 at the lowest two rings, 1 at the highest two, linear between.
pub fn graded(rings: usize, segments: usize) -> Vec<f32> {
    let at = |ring: usize| ((ring as f32 - 1.0) / (rings - 3) as f32).clamp(0.0, 1.0);
    (0..rings * segments).map(|v| at(v / segments)).collect()
}

/// Model of the sizes in `config`, with random networks.
pub fn with_networks(config: ModelConfig, garment: Garment, prior: Prior, limit: Option<f32>) -> ModelParts {
    let motion = config.motion.len(JOINTS);
    let (inputs, points) = (2 * motion, config.state.input_len());
    let widths = config.encoder.widths(inputs);
    let encoder = widths
        .windows(2)
        .enumerate()
        .map(|(i, w)| linear(w[0], w[1], 1.2, 100 + i as u64));
    let field_widths = field_sizes(&config.field, points + config.encoder.latent_len());
    // The paper's state integrates its outputs: small ones keep the test within the motion's size.
    let gain = if config.state == StateConfig::RootRelative {
        0.02
    } else {
        1.5
    };
    let last = config.field.hidden_layers;
    let field = field_widths
        .iter()
        .enumerate()
        .map(|(i, &(a, b))| linear(a, b, if i == last { gain } else { 1.4 }, 200 + i as u64));
    let strain_limits = match &config.projection {
        Some(projection) => strain_limits(projection, &garment.rest),
        None => Vec::new(),
    };
    ModelParts {
        encoder: encoder.collect(),
        field: field.collect(),
        rest_box: RestBox::of(&garment.rest.vertices),
        normalisation: normalisation(limit, motion),
        character: character(),
        garment,
        prior,
        strain_limits,
        about: About {
            name: "tube".into(),
            provenance: "made up".into(),
            training: serde_json::json!({"x": 0.1}),
        },
        config,
    }
}

/// Limits 2 % around the lengths of the rest shape's edges.
fn strain_limits(config: &ProjectionConfig, rest: &TriMesh) -> Vec<StrainLimit> {
    let limit = |[a, b]: [u32; 2]| {
        let length = rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        StrainLimit {
            shortest: 0.98 * length,
            longest: 1.02 * length,
        }
    };
    limited_pairs(config, rest).into_iter().map(limit).collect()
}

fn field_sizes(config: &FieldConfig, input: usize) -> Vec<(usize, usize)> {
    let inputs = |i: usize| match i {
        0 => input,
        i if config.skip == Some(i) => config.width + input,
        _ => config.width,
    };
    let outputs = |i: usize| {
        if i == config.hidden_layers {
            3
        } else {
            config.width
        }
    };
    (0..=config.hidden_layers)
        .map(|i| (inputs(i), outputs(i)))
        .collect()
}

pub fn model(variant: &Variant) -> Arc<Model> {
    Arc::new(Model::new(parts(variant)).unwrap())
}

fn motion_spec(variant: &Variant) -> MotionSpec {
    let (layout, velocity) = (variant.layout, variant.velocity);
    MotionSpec {
        springs: variant.springs.clone(),
        ..MotionSpec::new(layout, velocity, [2, 2, 3, 3], &character()).unwrap()
    }
}

/// A spring of each kind on two joints.
fn springs() -> JointSprings {
    let [by_joint, by_air] = [Spring::OF_PRESETS[0], Spring::OF_PRESETS[3]];
    JointSprings {
        joints: vec![0, 2],
        springs: vec![by_joint, by_air],
    }
}

/// Generator of pseudo-random numbers in −1..1 that are the same on all machines (splitmix64).
pub struct Noise(pub u64);

impl Noise {
    pub fn number(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }
}

/// Random layer whose outputs are about `gain` times as large as its inputs.
fn linear(inputs: usize, outputs: usize, gain: f32, seed: u64) -> Linear {
    let mut noise = Noise(seed);
    let spread = gain * (3.0 / inputs as f32).sqrt();
    Linear {
        inputs,
        outputs,
        weight: (0..inputs * outputs).map(|_| noise.number() * spread).collect(),
        bias: (0..outputs).map(|_| noise.number() * 0.2 * gain).collect(),
    }
}

fn normalisation(limit: Option<f32>, len: usize) -> Normalisation {
    let mut noise = Noise(300);
    let mut normalisation = Normalisation::identity(len);
    normalisation.limit = limit;
    normalisation
        .mean
        .iter_mut()
        .for_each(|m| *m = 0.2 * noise.number());
    normalisation
        .std
        .iter_mut()
        .for_each(|s| *s = 1.0 + 0.5 * noise.number());
    normalisation
}

/// Random prior with a few centimetres of mean displacement and of each principal component. With
/// two or more components it has a recurrence and a replay.
pub fn prior(vertices: usize, components: usize) -> Prior {
    prior_of(2 * motion_len(JOINTS), vertices, components)
}

fn prior_of(inputs: usize, vertices: usize, components: usize) -> Prior {
    let mut noise = Noise(400);
    let mut vectors = |count: usize| -> Vec<Vec3> { (0..count).map(|_| noise.vector() * 0.02).collect() };
    Prior {
        mean: vectors(vertices),
        map: linear(inputs, components, 0.7, 401),
        recurrence: (components > 1).then(|| recurrence(inputs, components)),
        // The first component is not replayed.
        replay: (components > 1).then(|| replay(inputs / 2, components - 1)),
        components: Components::of_vectors(&vectors(vertices * components), components),
    }
}

/// Replay of two clips with random keys and residuals of up to a tenth of a deviation.
fn replay(inputs: usize, components: usize) -> Replay {
    const CLIPS: [u32; 2] = [50, 45];
    let frames = CLIPS.iter().sum::<u32>() as usize;
    let mut noise = Noise(402);
    let mut step = |most: f32| (most * noise.number()) as i8;
    let keys = (0..frames).map(|_| std::array::from_fn(|_| step(30.0))).collect();
    let residuals = (0..frames * components).map(|_| step(100.0)).collect();
    let library = Library::new(CLIPS.to_vec(), keys, residuals, vec![1e-3; components]);
    let keys = KeyMap::new(linear(inputs, FEATURES, 0.3, 403)).unwrap();
    Replay::new(keys, library.unwrap())
}

/// Recurrence of five oscillators, from slow to fast, some of them with little damping.
fn recurrence(inputs: usize, outputs: usize) -> Recurrence {
    let (oscillators, embedding, hidden) = (5, 7, 6);
    let pole = |k: usize| {
        let (decay, angle) = (0.5 + 0.1 * k as f32, 0.3 * k as f32);
        [decay * angle.cos(), decay * angle.sin()]
    };
    Recurrence {
        poles: (0..oscillators).map(pole).collect(),
        embedding: linear(inputs, embedding, 0.7, 402),
        drive: linear(embedding, 2 * oscillators, 0.5, 403),
        memory: linear(2 * oscillators, hidden, 0.8, 404),
        hidden: linear(hidden + embedding, hidden, 0.8, 405),
        head: linear(hidden, outputs, 0.8, 406),
    }
}

/// Character with a body of 0.2 m radius around the y axis, from 0.1 to 1.7 m: an ellipsoid, so
/// that it is convex.
pub fn character() -> Character {
    let (rings, segments) = (15, 16);
    let radius = |height: f32| 0.2 * (1.0 - ((height - 0.9) / 0.8).powi(2)).max(0.0).sqrt();
    let heights: Vec<f32> = (1..rings)
        .map(|i| 0.9 - 0.8 * (TAU / 2.0 * i as f32 / rings as f32).cos())
        .collect();
    let mut body = lathe(&heights, segments, radius);
    let (bottom, top) = (body.vertices.len() as u32, body.vertices.len() as u32 + 1);
    body.vertices.extend([Vec3::Y * 0.1, Vec3::Y * 1.7]);
    let last = (heights.len() as u32 - 1) * segments as u32;
    for i in 0..segments as u32 {
        let next = (i + 1) % segments as u32;
        body.faces
            .extend([[bottom, i, next], [top, last + next, last + i]]);
    }
    Character {
        weights: weights(&body.vertices),
        skeleton: skeleton(),
        body,
        file_mesh: None,
    }
}

/// Tube around the body, open at both ends.
pub fn tube(rings: usize, segments: usize, radius: f32) -> Garment {
    let heights: Vec<f32> = (0..rings)
        .map(|i| 0.5 + 0.8 * i as f32 / (rings - 1) as f32)
        .collect();
    let rest = lathe(&heights, segments, |_| radius);
    let weights = weights(&rest.vertices);
    Garment::new(rest, weights)
}

/// Surface of revolution: rings of vertices at the given heights, bottom up, with outward faces.
fn lathe(heights: &[f32], segments: usize, radius: impl Fn(f32) -> f32) -> TriMesh {
    let point = |y: f32, i: usize| {
        let (sine, cosine) = (TAU * i as f32 / segments as f32).sin_cos();
        Vec3::new(radius(y) * sine, y, radius(y) * cosine)
    };
    let vertices = heights
        .iter()
        .flat_map(|&y| (0..segments).map(move |i| (y, i)))
        .map(|(y, i)| point(y, i));
    let at = |ring: usize, i: usize| (ring * segments + i % segments) as u32;
    let quads = (1..heights.len()).flat_map(|ring| (0..segments).map(move |i| (ring, i)));
    let faces = quads.flat_map(|(ring, i)| {
        let [a, b, c, d] = [at(ring - 1, i), at(ring - 1, i + 1), at(ring, i + 1), at(ring, i)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh::new(vertices.collect(), faces.collect()).unwrap()
}

const JOINT_PLACES: [Vec3; JOINTS] = [
    Vec3::new(0.0, 0.9, 0.0),
    Vec3::new(0.0, 1.2, 0.02),
    Vec3::new(0.08, 0.15, 0.0),
    Vec3::new(-0.08, 0.15, 0.0),
    Vec3::new(0.0, 1.55, 0.01),
];

/// Skeleton with a bind pose that is not zero.
fn skeleton() -> Skeleton {
    let mut noise = Noise(500);
    Skeleton::new(SkeletonParts {
        names: vec![],
        parents: vec![-1, 0, 0, 0, 1],
        joints: JOINT_PLACES.to_vec(),
        rest_pose: (0..JOINTS).map(|_| noise.vector() * 0.3).collect(),
    })
    .unwrap()
}

/// Skinning weights that are smooth in space, on up to five joints a vertex.
fn weights(vertices: &[Vec3]) -> SkinningWeights {
    let near = |v: Vec3, joint: Vec3| (-(v - joint).length_squared() / 0.08).exp();
    let rows = vertices.iter().map(|&v| {
        let row: Vec<(usize, f32)> = JOINT_PLACES.iter().map(|&j| near(v, j)).enumerate().collect();
        row.into_iter()
            .filter(|(joint, weight)| *joint == 0 || *weight > 0.01)
    });
    SkinningWeights::from_rows(JOINTS, rows).unwrap()
}

/// Motion in which every joint swings and the character walks in a circle with halts.
pub fn motion(frames: usize) -> Vec<Pose> {
    let mut noise = Noise(600);
    let swings: Vec<(Vec3, f32)> = (0..JOINTS)
        .map(|_| (noise.vector() * 0.5, 3.0 * noise.number()))
        .collect();
    let pose = |frame: usize| {
        let t = frame as f32 / FPS;
        let time = 4.0 * t - (4.0 * t).sin();
        let mut local: Vec<Quat> = (swings.iter())
            .map(|&(axis, phase)| Quat::from_scaled_axis(axis * (time + phase).sin()))
            .collect();
        local[0] = Quat::from_rotation_y(0.4 * time) * local[0];
        Pose {
            trans: Vec3::new((0.3 * time).sin(), 0.05 * (2.0 * time).sin(), (0.3 * time).cos()),
            local,
        }
    };
    (0..frames).map(pose).collect()
}

/// Gusts of wind at frame `t`, m/s.
pub fn wind(t: usize) -> Vec3 {
    let time = t as f32 / FPS;
    Vec3::new((2.0 * time).sin(), 0.1, 1.5 * (3.0 * time).cos())
}

/// Input of frame `t` of a clip, with the next pose if there is one.
pub fn input(poses: &[Pose], t: usize) -> StepInput<'_> {
    StepInput {
        pose: &poses[t],
        next_pose: poses.get(t + 1),
        ground_height: 0.02,
        wind: wind(t),
    }
}

/// Resets to the mean shape at frame 0, steps through the clip, and returns the positions of every
/// frame.
pub fn run(animator: &mut Animator, poses: &[Pose]) -> Vec<Vec<Vec3>> {
    let start = animator
        .reset(&input(poses, 0), Start::MeanShape)
        .unwrap()
        .positions
        .to_vec();
    let mut frames = vec![start];
    frames.extend((1..poses.len()).map(|t| animator.step(&input(poses, t)).unwrap().positions.to_vec()));
    frames
}

/// Bits of a frame's numbers. Comparing them compares NaN and signed zero too.
pub fn bits(frame: GarmentFrame<'_>) -> Vec<[u32; 3]> {
    let bits = |v: &Vec3| v.to_array().map(f32::to_bits);
    frame.positions.iter().chain(frame.normals).map(bits).collect()
}

/// Largest distance between two lists of points, metres.
pub fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (*a - *b).length())
        .fold(0.0, f32::max)
}
