//! Models with random weights for garments of any number of vertices, to measure times with.
//!
//! Networks have the sizes of the training presets. Trained weights give more zero activations than
//! these random ones do, and evaluate faster in f32.

use glam::{Quat, Vec3};
use std::{error::Error, f32::consts::TAU, ops::Range};
use unic_core::{
    Model, Pose,
    character::{Character, Garment},
    config::*,
    features::RestBox,
    mesh::TriMesh,
    model::{About, ModelParts},
    motion::{JointSprings, MotionLayout, MotionSpec, Normalisation, Spring, VelocityScheme},
    network::Linear,
    prior::{Components, Prior},
    projection::{StrainLimit, limited_pairs},
    recurrence::Recurrence,
    replay::{FEATURES, KEY, KeyMap, Library, Replay},
    skeleton::{SMPL_PARENTS, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Numbers of vertices of the four garments of the paper.
pub const VERTICES: [usize; 4] = [3_653, 34_907, 59_380, 62_461];

/// Reason why a model cannot be made.
pub type Failure = Box<dyn Error + Send + Sync>;

/// Smallest number of vertices of a garment: three rings.
const FEWEST: usize = 32;

/// Number of vertices of the body, that of SMPL's.
const BODY_VERTICES: usize = 6_890;

/// Frames a second of the models and of [`walk`].
const FPS: f32 = 30.0;

/// Number of oscillators of the recurrence of the preset `standard`.
const OSCILLATORS: usize = 128;

/// Width of the recurrence of the preset `standard`.
const WIDTH: usize = 256;

/// Smallest number of principal components of the prior of the preset `standard`.
const LEAST_COMPONENTS: usize = 32;

/// Largest number of principal components of the prior of the preset `standard`.
const MOST_COMPONENTS: usize = 64;

/// Number of vectors in all principal components above which a large garment gets fewer components.
const MOST_COMPONENT_VECTORS: usize = 1_000_000;

/// Number of vectors in all shapes of wrinkles above which a large garment gets fewer.
const MOST_WRINKLE_VECTORS: usize = 1 << 18;

/// Smallest number of shapes of wrinkles of the preset `standard`.
const LEAST_WRINKLES: usize = 16;

/// Largest number of shapes of wrinkles of the preset `standard`.
const MOST_WRINKLES: usize = 64;

/// Largest number of frames in the replay of the preset `standard`.
const REPLAYED_FRAMES: usize = 10_240;

/// Left ankle and foot, right ankle and foot, by SMPL's index.
const CONTACT_JOINTS: [usize; 4] = [7, 10, 8, 11];

/// Training preset that sets the networks and the state of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkSize {
    /// The preset `standard`: the network of this project.
    Standard,
    /// The preset `paper`: the published network.
    Paper,
}

impl NetworkSize {
    /// Name of the preset.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Paper => "paper",
        }
    }
}

/// Makes a model with random weights for a garment of `vertices` vertices.
///
/// The garment is a tube around a body of 6,890 vertices and 24 joints. Intersections are handled
/// as in the paper.
///
/// # Errors
/// Returns an error for fewer than 32 vertices.
pub fn random_model(preset: NetworkSize, vertices: usize) -> Result<Model, Failure> {
    if vertices < FEWEST {
        return Err(format!("expected a garment of {FEWEST} vertices or more, found {vertices}").into());
    }
    let config = config(preset)?;
    let pair = 2 * config.motion.len(SMPL_PARENTS.len());
    let garment = garment(vertices)?;
    let wrinkles = (MOST_WRINKLE_VECTORS / vertices).clamp(LEAST_WRINKLES, MOST_WRINKLES);
    let components = (MOST_COMPONENT_VECTORS / vertices).clamp(LEAST_COMPONENTS, MOST_COMPONENTS) + wrinkles;
    Ok(Model::new(ModelParts {
        encoder: encoder_layers(&config),
        field: field_layers(&config),
        normalisation: Normalisation::identity(pair / 2),
        character: character()?,
        prior: match preset {
            NetworkSize::Standard => Prior {
                mean: vec![Vec3::ZERO; vertices],
                components: Components::of_vectors(
                    &vec![Vec3::splat(1e-3); vertices * components],
                    components,
                ),
                map: linear(pair, components),
                recurrence: Some(Recurrence {
                    // Inside the unit circle, so that the state does not grow.
                    poles: vec![[0.9, 0.1]; OSCILLATORS],
                    embedding: linear(pair, WIDTH),
                    drive: linear(WIDTH, 2 * OSCILLATORS),
                    memory: linear(2 * OSCILLATORS, WIDTH),
                    hidden: linear(2 * WIDTH, WIDTH),
                    head: linear(WIDTH, components),
                }),
                replay: Some(replay(pair / 2, wrinkles)?),
            },
            NetworkSize::Paper => Prior::constant(vec![Vec3::ZERO; vertices], pair),
        },
        rest_box: RestBox::of(&garment.rest.vertices),
        strain_limits: match &config.projection {
            Some(projection) => strain_limits(projection, &garment.rest),
            None => Vec::new(),
        },
        garment,
        config,
        about: About {
            name: "bench".into(),
            provenance: "random".into(),
            ..About::default()
        },
    })?)
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

/// Pose of a frame of a straight walk in which all joints turn a little.
pub fn walk(frame: usize) -> Pose {
    let s = frame as f32 / FPS;
    let turn = |j: usize| Quat::from_rotation_x(0.2 * (TAU * s + j as f32).sin());
    Pose {
        trans: Vec3::Z * s,
        local: (0..SMPL_PARENTS.len()).map(turn).collect(),
    }
}

/// Model configuration with the sizes and inputs of a training preset.
fn config(preset: NetworkSize) -> Result<ModelConfig, Failure> {
    use PointInput::{Displacement, Rest, SkinVelocity, Up, Velocity};
    let displacement = StateConfig::Displacement(DisplacementConfig {
        memory_s: 0.5,
        excursion_m: None,
        scale_m: 0.05,
        output_limit: 1.0,
        inputs: vec![Displacement, Velocity, Rest, Up, SkinVelocity],
    });
    let layout = match preset {
        NetworkSize::Standard => MotionLayout::Heading,
        NetworkSize::Paper => MotionLayout::Paper,
    };
    let encoder = |hidden, channels| EncoderConfig {
        hidden,
        channels,
        categories: 8,
        code: LatentCode::PickedLogit,
    };
    let mut motion = MotionSpec::new(layout, VelocityScheme::Backward, CONTACT_JOINTS, &character()?)?;
    motion.springs = match preset {
        NetworkSize::Standard => JointSprings {
            joints: (0..SMPL_PARENTS.len()).collect(),
            springs: Spring::OF_PRESETS.to_vec(),
        },
        NetworkSize::Paper => JointSprings::default(),
    };
    Ok(ModelConfig {
        fps: FPS,
        motion,
        encoder: match preset {
            NetworkSize::Standard => encoder(vec![128], 32),
            NetworkSize::Paper => encoder(vec![4096, 4096], 128),
        },
        field: match preset {
            NetworkSize::Standard => FieldConfig {
                width: 32,
                hidden_layers: 4,
                skip: None,
            },
            NetworkSize::Paper => FieldConfig {
                width: 256,
                hidden_layers: 8,
                skip: Some(5),
            },
        },
        state: match preset {
            NetworkSize::Standard => displacement,
            NetworkSize::Paper => StateConfig::RootRelative,
        },
        projection: match preset {
            NetworkSize::Standard => Some(ProjectionConfig::default()),
            NetworkSize::Paper => None,
        },
        intersection: IntersectionMode::Paper {
            relaxation_m: IntersectionMode::RELAXATION_M,
        },
    })
}

fn encoder_layers(config: &ModelConfig) -> Vec<Linear> {
    let widths = config.encoder.widths(2 * config.motion.len(SMPL_PARENTS.len()));
    widths.windows(2).map(|w| linear(w[0], w[1])).collect()
}

fn field_layers(config: &ModelConfig) -> Vec<Linear> {
    let field = &config.field;
    let input = config.state.input_len() + config.encoder.latent_len();
    let layer = |i: usize| {
        let before = if i == 0 { 0 } else { field.width };
        // A skip connection feeds the input of the network to a hidden layer once more.
        let again = if i == 0 || field.skip == Some(i) { input } else { 0 };
        let after = if i == field.hidden_layers { 3 } else { field.width };
        linear(before + again, after)
    };
    (0..=field.hidden_layers).map(layer).collect()
}

/// Layer with small pseudorandom weights of either sign, which keep the state near the body.
fn linear(inputs: usize, outputs: usize) -> Linear {
    let spread = 0.1 / (inputs as f32).sqrt();
    // Multiples of the golden ratio modulo 1 are evenly spread. f64, because the index is large.
    let number = |i: usize| ((i as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0) as f32;
    Linear {
        inputs,
        outputs,
        weight: (0..inputs * outputs).map(|i| spread * number(i)).collect(),
        bias: vec![0.0; outputs],
    }
}

/// A replay of one clip, whose keys and residuals are spread evenly.
fn replay(inputs: usize, coefficients: usize) -> Result<Replay, Failure> {
    let number = |i: usize| ((i as f64 * 0.618_033_988_75).fract() * 200.0 - 100.0) as i8;
    let key = |t: usize| std::array::from_fn(|k| number(t * KEY + k));
    let library = Library::new(
        vec![REPLAYED_FRAMES as u32],
        (0..REPLAYED_FRAMES).map(key).collect(),
        (0..REPLAYED_FRAMES * coefficients).map(number).collect(),
        vec![1e-5; coefficients],
    )?;
    Ok(Replay::new(KeyMap::new(linear(inputs, FEATURES))?, library))
}

fn character() -> Result<Character, Failure> {
    let body = tube(BODY_VERTICES, 60, 0.15, 0.0..1.6)?;
    let place = |j: usize| Vec3::new(0.02 * (j % 3) as f32 - 0.02, 0.9 + 0.02 * j as f32, 0.0);
    let skeleton = Skeleton::new(SkeletonParts {
        parents: SMPL_PARENTS.to_vec(),
        joints: (0..SMPL_PARENTS.len()).map(place).collect(),
        ..SkeletonParts::default()
    });
    Ok(Character {
        weights: weights(&body)?,
        body,
        skeleton: skeleton?,
        file_mesh: None,
    })
}

fn garment(vertices: usize) -> Result<Garment, Failure> {
    let sides = (vertices as f32 * 3.0).sqrt() as usize;
    let rest = tube(vertices, sides, 0.16, 0.5..1.0)?;
    let weights = weights(&rest)?;
    Ok(Garment::new(rest, weights))
}

/// Skinning weights with four joints per vertex, as in game engines.
fn weights(mesh: &TriMesh) -> Result<SkinningWeights, Failure> {
    let row = |v: &Vec3| {
        let first = (v.y * 12.0) as usize % (SMPL_PARENTS.len() - 3);
        [0.4, 0.3, 0.2, 0.1]
            .into_iter()
            .enumerate()
            .map(move |(i, w)| (first + i, w))
    };
    Ok(SkinningWeights::from_rows(
        SMPL_PARENTS.len(),
        mesh.vertices.iter().map(row),
    )?)
}

/// Tube of rings of squares from the bottom up.
///
/// The last ring may be incomplete, so that the tube has any number of vertices.
fn tube(vertices: usize, sides: usize, radius: f32, heights: Range<f32>) -> Result<TriMesh, Failure> {
    let rings = (vertices / sides) as f32;
    let place = |i: usize| {
        let (sine, cosine) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let up = (i / sides) as f32 / rings * (heights.end - heights.start);
        Vec3::new(radius * sine, heights.start + up, radius * cosine)
    };
    // The square below vertex i and its successor in the ring.
    let square = |i: usize| {
        let next = i / sides * sides + (i + 1) % sides;
        let [a, b, c, d] = [i - sides, next - sides, next, i].map(|v| v as u32);
        (next < vertices).then_some([[a, b, c], [a, c, d]])
    };
    let faces = (sides..vertices).filter_map(square).flatten();
    Ok(TriMesh::new((0..vertices).map(place).collect(), faces.collect())?)
}
