//! Intersections of a garment with the body, and their correction.
//!
//! For training and evaluation; an engine sets a mode by
//! [`Animator::set_intersection`](crate::Animator::set_intersection).
//!
//! [`Handling`] is a mode of [`IntersectionMode`] with the posed body that it needs. Training and
//! the animator correct vertices with the same [`Handling::correct`]. [`PaperIntersection`] is the
//! paper's rule, [`RobustIntersection`] this crate's own.
//!
//! A [`DisplayPass`] corrects positions before they are shown. It sees all vertices at once, and so
//! finds faces that the body pokes through. It draws cloth deep inside a limb towards its skinned
//! shape, and [keeps its layers in order](keeps_layers_in_order). [`GarmentHandling`] handles a
//! garment with both.
//!
//! ```
//! use unic_core::{config::{Corrects, IntersectionMode}, intersection::Handling};
//! # use glam::Vec3;
//! # use unic_core::{character::*, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
//! # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
//! #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
//! # let joints = vec![Vec3::ZERO];
//! # let parts = SkeletonParts { parents: vec![-1], joints, ..Default::default() };
//! # let weights = SkinningWeights::from_dense(&[1.0; 4], 4, 1)?;
//! # let garment = Garment::new(body.clone(), weights.clone());
//! # let character = Character { skeleton: Skeleton::new(parts)?, weights, body, file_mesh: None };
//!
//! let mode = IntersectionMode::Robust { margin_m: 0.003, corrects: Corrects::State };
//! let mut handling = Handling::new(mode, &character, &garment);
//! // A body in its bind pose.
//! handling.pose(&character, &character.body.vertices);
//! let below_the_skin = Vec3::new(0.2, 0.2, 0.001);
//! let mut seed = Handling::NO_SEED;
//! let corrected = handling.correct(0, below_the_skin, &mut seed).unwrap();
//! assert!(corrected.distance(Vec3::new(0.2, 0.2, -0.003)) < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod contact_filter;
mod display;
mod garment_handling;
mod layers;
mod measure;
mod packets;
mod paper;
mod robust;
#[cfg(test)]
mod tests;

pub use contact_filter::{ContactFilter, MIN_CARRYING_WEIGHT};
pub(crate) use display::Afterwards;
pub use display::{CollisionScene, DisplayPass, LAST_MARGIN_SHARE, SkinnedGarment, keeps_layers_in_order};
pub use garment_handling::GarmentHandling;
pub(crate) use garment_handling::pose_body;
pub use layers::{Layers, LayersError};
pub use measure::{InsideTest, InsideTestBody};
pub use paper::{BodySnapshot, PaperIntersection, TangentPlane};
pub use robust::{Contact, RobustBody, RobustIntersection};

use crate::{
    character::{Character, Garment},
    config::IntersectionMode,
};
use glam::Vec3;

/// Mode of intersection handling with the posed body that it needs.
///
/// Scratch: [posed](Self::pose) anew for every frame, without allocating after the first.
#[derive(Clone, Debug, Default)]
pub enum Handling {
    /// Vertices stay where they are.
    #[default]
    Off,
    /// Rule of the paper.
    Paper(PaperIntersection, BodySnapshot),
    /// Robust rule.
    Robust(RobustIntersection, Box<RobustBody>),
}

impl Handling {
    /// Seed for a vertex whose closest face is not known yet.
    pub const NO_SEED: u32 = u32::MAX;

    /// Creates the handling of a mode for a garment on a character; [`pose`](Self::pose) must
    /// follow.
    pub fn new(mode: IntersectionMode, character: &Character, garment: &Garment) -> Self {
        match mode {
            IntersectionMode::Off => Self::Off,
            IntersectionMode::Paper { relaxation_m } => {
                Self::Paper(PaperIntersection { relaxation_m }, BodySnapshot::default())
            }
            IntersectionMode::Robust { margin_m, .. } => Self::Robust(
                RobustIntersection { margin_m },
                Box::new(RobustBody::new(character, garment)),
            ),
        }
    }

    /// Poses the body of the character that the handling was made for: world positions of its
    /// vertices, metres.
    ///
    /// # Panics
    /// When the number of vertices differs from that character's.
    pub fn pose(&mut self, character: &Character, vertices: &[Vec3]) {
        match self {
            Self::Off => {}
            Self::Paper(_, body) => body.prepare(vertices, &character.body.faces),
            Self::Robust(_, body) => body.pose(vertices),
        }
    }

    /// Returns the corrected position of garment vertex `vertex` at the world position `p`; none
    /// when it stays.
    ///
    /// `seed` should be the one of the last frame. It shortens the search and never changes the
    /// result.
    pub fn correct(&self, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        match self {
            Self::Off => None,
            Self::Paper(rule, body) => rule.correct(body, p),
            Self::Robust(rule, body) => rule.correct(body, vertex, p, seed),
        }
    }
}
