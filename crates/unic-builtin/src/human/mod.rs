//! A procedural human.
//!
//! The human is a smooth mannequin of one adult, modelled from tabulated body-segment proportions
//! without scans or a statistical model. An implicit surface of lofts, cones and ellipsoids along
//! the skeleton is polygonised, its triangles are made regular, and the left half is mirrored.
//!
//! ```
//! use unic_builtin::human::{HumanParameters, human};
//!
//! let character = human(&HumanParameters { height_m: 1.8, ..Default::default() })?;
//! assert_eq!(character.skeleton.len(), 24);
//! let top = character.body.vertices.iter().map(|v| v.y).fold(0.0, f32::max);
//! assert!((top - 1.8).abs() < 0.01);
//! # Ok::<(), unic_builtin::human::HumanError>(())
//! ```

mod anatomy;
mod primitive;
mod proportions;
mod weights;

use crate::implicit::{
    Lattice, Mirrored, Patch, PositiveSide, Sizing, Surfaces, mirrored, polygonise, remesh,
};
use anatomy::Anatomy;
use glam::Vec3;
use proportions::Proportions;
use thiserror::Error;
use unic_core::{
    character::Character,
    mesh::{MeshError, TriMesh},
    skeleton::{SMPL_PARENTS, Skeleton, SkeletonError, SkeletonParts},
    skinning::WeightsError,
    weights::diffused_weights,
};

/// Measures of the body, metres. The default is a slim adult.
///
/// Ranges are those at a height of 1.70 m and grow in proportion to the height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HumanParameters {
    /// Standing height, metres, 1.2 to 2.2 m.
    pub height_m: f32,
    /// Distance between the shoulder joints, metres, 0.26 to 0.44 at a height of 1.70.
    pub shoulder_width_m: f32,
    /// Girth of the chest, metres, 0.75 to 1.2 at a height of 1.70.
    pub chest_m: f32,
    /// Girth of the waist, metres, 0.6 to 1.1 at a height of 1.70.
    pub waist_m: f32,
    /// Girth of the hips, metres, 0.85 to 1.15 at a height of 1.70.
    pub hip_m: f32,
}

impl Default for HumanParameters {
    fn default() -> Self {
        Self {
            height_m: 1.70,
            shoulder_width_m: 0.33,
            chest_m: 0.90,
            waist_m: 0.74,
            hip_m: 0.95,
        }
    }
}

/// Reason why a human cannot be made.
#[derive(Debug, Error, PartialEq)]
pub enum HumanError {
    /// A measure is outside its range.
    #[error("human: {name} is {found} m, expected {least} to {most} m at this height")]
    Measure {
        /// Name of the parameter.
        name: &'static str,
        /// Value of the parameter, metres.
        found: f32,
        /// Smallest value at this height, metres.
        least: f32,
        /// Largest value at this height, metres.
        most: f32,
    },
    /// The mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The skeleton is invalid.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The skinning weights are invalid.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

/// Side of the lattice cubes for polygonising, metres at a height of 1.70 m.
///
/// Two of them fit between the fingers.
const LATTICE_M: f32 = 0.0055;

/// Distance over which skinning weights are diffused on the skin, metres.
///
/// It is a few edges: where two limbs meet, neither takes over the other's weights.
const SKIN_DIFFUSION_M: f32 = 0.012;

/// Largest number of joints that move one vertex.
const JOINTS_PER_VERTEX: usize = 6;

/// Skinning weights below this share of a vertex's total are dropped.
const LEAST_WEIGHT: f32 = 2e-3;

/// Makes a skinned human in a T-pose (pose zero), with its feet on y = 0, facing +Z, palms down.
///
/// The body is a closed manifold that is mirror-symmetric in x to the bit. Joints are in SMPL's
/// order.
///
/// # Errors
/// [`HumanError::Measure`] for a measure out of range.
pub fn human(parameters: &HumanParameters) -> Result<Character, HumanError> {
    let proportions = Proportions::new(parameters)?;
    let anatomy = Anatomy::new(&proportions);
    let half = half_body(&anatomy, &proportions);
    let Mirrored { patch, image } = mirrored(&half, MIDPLANE, |label| label);
    let body = TriMesh::new(patch.vertices, patch.faces)?;
    let skeleton = Skeleton::new(SkeletonParts {
        parents: SMPL_PARENTS.to_vec(),
        joints: proportions.joints.to_vec(),
        ..SkeletonParts::default()
    })?;
    let raw = weights::symmetric(&anatomy, &proportions, &body.vertices, &image)?;
    let smooth = diffused_weights(&raw, &body, SKIN_DIFFUSION_M * proportions.scale)?;
    let weights = smooth.pruned(JOINTS_PER_VERTEX, LEAST_WEIGHT);
    // Diffusion adds in the order of vertices, which rounds differently on the left and the right.
    Ok(Character {
        weights: weights::symmetrised(&weights, &image)?,
        body,
        skeleton,
        file_mesh: None,
    })
}

/// Index of the cut at x = 0.
const MIDPLANE: usize = 0;

/// Mesh of the left half of the skin, cut at the midplane.
fn half_body(anatomy: &Anatomy, proportions: &Proportions) -> Patch {
    let scale = proportions.scale;
    let surface = |p: Vec3| anatomy.distance(p);
    let right_of_midplane = |p: Vec3| -p.x;
    let surfaces = Surfaces {
        surface: &surface,
        cuts: vec![&right_of_midplane],
    };
    // The lattice reaches over the midplane by a few cubes: the cut must go through triangles.
    let lattice = Lattice {
        origin: Vec3::new(-0.021, -0.02, -0.2) * scale,
        end: Vec3::new(proportions.fingertip + 0.03, 1.74, 0.22) * scale,
        step: LATTICE_M * scale,
    };
    let (vertices, faces) = polygonise(&surface, lattice);
    let mut patch = Patch::new(vertices, faces);
    patch.cut(&surfaces, MIDPLANE, &[0], PositiveSide::Remove);
    let edge = |p: Vec3| proportions.wanted_edge(p);
    remesh(
        &mut patch,
        &surfaces,
        Sizing {
            edge: &edge,
            rounds: 6,
        },
    );
    patch
}
