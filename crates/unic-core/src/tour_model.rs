// The model of the snippets in the crate's documentation: a garment of three vertices on a skeleton
// of two joints, with networks that have learned nothing. Each snippet includes this file.

use glam::Vec3;
use std::error::Error;
use unic_core::{
    Corrects, IntersectionMode, Model, Pose, StepInput,
    character::{Character, Garment},
    config::{
        DisplacementConfig, EncoderConfig, FieldConfig, LatentCode, ModelConfig, PointInput, StateConfig,
    },
    features::RestBox,
    mesh::TriMesh,
    model::{About, ModelParts},
    motion::{MotionLayout, MotionSpec, Normalisation, VelocityScheme, motion_len},
    network::Linear,
    prior::Prior,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// The bytes of the model's file.
pub fn file() -> Result<Vec<u8>, Box<dyn Error>> {
    Ok(Model::new(parts()?)?.to_bytes()?)
}

/// A tick in still air, on flat ground at height 0.
#[allow(dead_code, reason = "snippets that show it write it out")]
pub fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}

fn parts() -> Result<ModelParts, Box<dyn Error>> {
    let skeleton = Skeleton::new(SkeletonParts {
        parents: vec![-1, 0],
        joints: vec![Vec3::Y, Vec3::Y * 0.1],
        ..SkeletonParts::default()
    })?;
    let mesh = TriMesh::new(vec![Vec3::Y, Vec3::Y + Vec3::X, Vec3::Y * 0.5], vec![[0, 1, 2]])?;
    let weights = SkinningWeights::from_dense(&[1.0, 0.0, 1.0, 0.0, 0.5, 0.5], 3, 2)?;
    let character = Character {
        body: mesh.clone(),
        skeleton,
        weights: weights.clone(),
        file_mesh: None,
    };
    let motion_pair = 2 * motion_len(2);
    Ok(ModelParts {
        config: ModelConfig {
            fps: 30.0,
            motion: MotionSpec::new(MotionLayout::Heading, VelocityScheme::Backward, [1; 4], &character)?,
            encoder: EncoderConfig {
                hidden: vec![4],
                channels: 2,
                categories: 3,
                code: LatentCode::PickedLogit,
            },
            field: FieldConfig {
                width: 8,
                hidden_layers: 2,
                skip: Some(1),
            },
            state: StateConfig::Displacement(DisplacementConfig {
                memory_s: 0.1,
                excursion_m: None,
                scale_m: 0.05,
                output_limit: 3.0,
                inputs: vec![PointInput::Displacement, PointInput::Velocity, PointInput::Rest],
            }),
            projection: None,
            intersection: IntersectionMode::Robust {
                margin_m: IntersectionMode::MARGIN_M,
                corrects: Corrects::Display,
            },
        },
        character,
        rest_box: RestBox::of(&mesh.vertices),
        prior: Prior::constant(vec![Vec3::ZERO; 3], motion_pair),
        garment: Garment::new(mesh, weights),
        normalisation: Normalisation::identity(motion_pair / 2),
        encoder: vec![linear(motion_pair, 4), linear(4, 6)],
        strain_limits: Vec::new(),
        field: vec![linear(11, 8), linear(19, 8), linear(8, 3)],
        about: About::default(),
    })
}

fn linear(inputs: usize, outputs: usize) -> Linear {
    Linear {
        inputs,
        outputs,
        weight: vec![0.01; inputs * outputs],
        bias: vec![0.1; outputs],
    }
}
