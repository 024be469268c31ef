//! Where a garment cuts into the body, and the ways out.
//!
//! [`Handling`] is a mode of [`IntersectionMode`] with what it needs of the posed body; training and
//! the animator correct vertices by the same [`Handling::correct`]. The paper's rule is
//! [`PaperIntersection`], ours is [`RobustIntersection`]; what needs all vertices at once, faces that
//! the body pokes through, is a [`DisplayPass`] over positions on their way to the screen. A whole garment is
//! handled by [`GarmentHandling`].
//!
//! ```
//! use unic_core::{config::{Corrects, IntersectionMode}, intersection::Handling};
//! # use glam::Vec3;
//! # use unic_core::{character::*, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
//! # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
//! #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
//! # let parts = SkeletonParts { parents: vec![-1], joints: vec![Vec3::ZERO], ..Default::default() };
//! # let weights = SkinningWeights::from_dense(&[1.0; 4], 4, 1)?;
//! # let character = Character { skeleton: Skeleton::new(parts)?, weights: weights.clone(), body: body.clone() };
//! # let garment = Garment::new(body, weights);
//!
//! let mode = IntersectionMode::Robust { margin_m: 0.003, corrects: Corrects::State };
//! let mut handling = Handling::new(mode, &character, &garment);
//! // Of a body in its bind pose.
//! handling.pose(&character, &character.body.vertices);
//! let below_the_skin = Vec3::new(0.2, 0.2, 0.001);
//! let found = handling.correct(0, below_the_skin, &mut Handling::no_seed()).unwrap();
//! assert!(found.distance(Vec3::new(0.2, 0.2, -0.003)) < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod contact;
mod display;
mod garment_handling;
mod layers;
mod measure;
mod packets;
mod paper;
mod robust;
#[cfg(test)]
mod tests;

pub use contact::ContactParts;
pub use display::{DisplayPass, PosedVertices};
pub use garment_handling::GarmentHandling;
pub(crate) use garment_handling::pose_body;
pub use layers::{Layers, LayersError};
pub use measure::{InsideTest, PosedBody};
pub use paper::{BodySnapshot, PaperIntersection, TangentPlane};
pub use robust::{Contact, RobustBody, RobustIntersection};

use crate::{
    character::{Character, Garment},
    config::IntersectionMode,
};
use glam::Vec3;

/// A mode of intersection handling with the posed body that it works on.
///
/// Scratch: [posed](Self::pose) anew for every frame, without allocating after the first.
#[derive(Clone, Debug, Default)]
pub enum Handling {
    /// Vertices stay where they are.
    #[default]
    Off,
    /// The paper's.
    Paper(PaperIntersection, BodySnapshot),
    /// Ours.
    Robust(RobustIntersection, Box<RobustBody>),
}

impl Handling {
    /// Of a mode, for a garment on a character; [`pose`](Self::pose) must follow.
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

    /// Takes the posed body of that character: world positions of its vertices, metres.
    ///
    /// # Panics
    /// When the character is another.
    pub fn pose(&mut self, character: &Character, vertices: &[Vec3]) {
        match self {
            Self::Off => {}
            Self::Paper(_, body) => body.prepare(vertices, &character.body.faces),
            Self::Robust(_, body) => body.pose(vertices),
        }
    }

    /// Where garment vertex `vertex` at the world position `p` goes; none when it stays.
    ///
    /// `seed` makes the search faster when it is the last frame's, and nothing else.
    pub fn correct(&self, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        match self {
            Self::Off => None,
            Self::Paper(rule, body) => rule.correct(body, p),
            Self::Robust(rule, body) => rule.correct(body, vertex, p, seed),
        }
    }

    /// The seed of a vertex that has not been looked up yet.
    pub const fn no_seed() -> u32 {
        u32::MAX
    }
}
