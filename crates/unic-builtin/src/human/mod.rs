//! A procedural human.
//!
//! A smooth mannequin of one adult, modelled here from tabulated body-segment proportions and from
//! no scanned or statistical model: an implicit surface of lofts, cones and ellipsoids along the
//! skeleton is polygonised, its triangles are made regular, and one half is mirrored.
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
mod proportions;
mod shape;
mod weights;

use crate::implicit::{Beyond, Lattice, Patch, Sizing, Surfaces, mirrored, polygonise, remesh};
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

/// Measures of the body, metres. The default is one slim adult.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HumanParameters {
    /// Standing height, 1.2 to 2.2.
    pub height_m: f32,
    /// Between the shoulder joints, 0.26 to 0.44 at a height of 1.70.
    pub shoulder_width_m: f32,
    /// Girth of the chest, 0.75 to 1.2 at a height of 1.70.
    pub chest_m: f32,
    /// Girth of the waist, 0.6 to 1.1 at a height of 1.70.
    pub waist_m: f32,
    /// Girth of the hips, 0.85 to 1.15 at a height of 1.70.
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

/// Why a human cannot be made.
#[derive(Debug, Error, PartialEq)]
pub enum HumanError {
    /// A measure outside its range.
    #[error("human: {name} is {found} m, expected {least} to {most} m at this height")]
    Measure {
        /// The parameter.
        name: &'static str,
        /// Its value.
        found: f32,
        /// Least value at this height.
        least: f32,
        /// Greatest value at this height.
        most: f32,
    },
    /// The mesh is not sound.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The skeleton is not sound.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The weights are not sound.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

/// Side of the cubes that the surface is first cut into, at a height of 1.70 m, metres: two of them
/// fit between the fingers.
const LATTICE_M: f32 = 0.0055;

/// How far skinning weights are diffused over the skin, metres: a few edges, so that where two limbs
/// meet neither bleeds into the other.
const SKIN_DIFFUSION_M: f32 = 0.012;

/// Most joints that move one vertex.
const JOINTS_A_VERTEX: usize = 6;

/// A skinned human in a T-pose (pose zero), feet on y = 0, facing +Z, palms down: a closed manifold
/// that is mirror-symmetric in x to the bit, with joints in SMPL's order.
///
/// # Errors
/// Measures out of range.
pub fn human(parameters: &HumanParameters) -> Result<Character, HumanError> {
    let proportions = Proportions::new(parameters)?;
    let anatomy = Anatomy::new(&proportions);
    let (patch, image) = mirrored(&half_body(&anatomy, &proportions), MIDPLANE, |label| label);
    let body = TriMesh::new(patch.vertices, patch.faces)?;
    let skeleton = Skeleton::new(SkeletonParts {
        parents: SMPL_PARENTS.to_vec(),
        joints: proportions.joints.to_vec(),
        ..SkeletonParts::default()
    })?;
    let raw = weights::symmetric(&anatomy, &proportions, &body.vertices, &image)?;
    let smooth = diffused_weights(&raw, &body, SKIN_DIFFUSION_M * proportions.scale)?;
    let weights = smooth.pruned(JOINTS_A_VERTEX, 2e-3);
    Ok(Character {
        weights: weights::mirrored_rows(&weights, &image)?,
        body,
        skeleton,
    })
}

/// Index of the cut at x = 0.
const MIDPLANE: usize = 0;

/// The left half of the skin, cut at the midplane.
fn half_body(anatomy: &Anatomy, proportions: &Proportions) -> Patch {
    let scale = proportions.scale;
    let surface = |p: Vec3| anatomy.distance(p);
    let right_of_midplane = |p: Vec3| -p.x;
    let surfaces = Surfaces {
        surface: &surface,
        cuts: vec![&right_of_midplane],
    };
    // The lattice reaches over the midplane by a few cubes, for the cut to go through triangles.
    let lattice = Lattice {
        origin: Vec3::new(-0.021, -0.02, -0.2) * scale,
        end: Vec3::new(proportions.fingertip + 0.03, 1.74, 0.22) * scale,
        step: LATTICE_M * scale,
    };
    let (vertices, faces) = polygonise(&surface, lattice);
    let mut patch = Patch::new(vertices, faces);
    patch.cut(&surfaces, MIDPLANE, &[0], Beyond::Remove);
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
