//! Intersection handling of a whole garment.

use super::{DisplayPass, Handling, Layers, PosedVertices};
use crate::{
    character::{Character, Garment},
    collider::Collider,
    config::{Corrects, IntersectionMode},
    network::TILE,
    parallel::for_each_chunk,
    transform::Rigid,
};
use glam::Vec3;

/// Everything that a mode of intersection handling does to a garment on a skinned body: the correction of
/// each vertex by its [`Handling`], and the [`DisplayPass`] of the robust rule.
///
/// The animator handles its garment by this type, and [`apply`](Self::apply) handles any other positions
/// of the same garment alike: a baseline, a simulation. Scratch: [posed](Self::pose) anew for every frame,
/// without allocating after the first.
///
/// ```
/// use unic_core::{config::{Corrects, IntersectionMode}, intersection::GarmentHandling, transform::Rigid};
/// # use glam::Vec3;
/// # use unic_core::{character::*, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
/// # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
/// #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// # let parts = SkeletonParts { parents: vec![-1], joints: vec![Vec3::ZERO], ..Default::default() };
/// # let weights = SkinningWeights::from_dense(&[1.0; 4], 4, 1)?;
/// # let character = Character { skeleton: Skeleton::new(parts)?, weights: weights.clone(), body: body.clone() };
/// # let garment = Garment::new(body, weights);
/// let mode = IntersectionMode::Robust { margin_m: 0.003, corrects: Corrects::Display };
/// let mut handling = GarmentHandling::new(mode, &character, &garment);
/// // A body in its bind pose.
/// handling.pose(&character, &[Rigid::IDENTITY]);
/// let mut positions = vec![Vec3::splat(2.0); 4];
/// positions[0] = Vec3::new(0.2, 0.2, 0.001);
/// handling.apply(&mut positions);
/// assert!(positions[0].z < -0.002);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct GarmentHandling {
    mode: IntersectionMode,
    handling: Handling,
    display: Option<Box<DisplayPass>>,
    /// World, metres.
    body_vertices: Vec<Vec3>,
}

impl GarmentHandling {
    /// Handling in a mode, for a garment on a character; [`pose`](Self::pose) must follow.
    pub fn new(mode: IntersectionMode, character: &Character, garment: &Garment) -> Self {
        let handling = Handling::new(mode, character, garment);
        let display = match &handling {
            Handling::Robust(rule, body) => Some(Box::new(DisplayPass::new(*rule, garment, body))),
            _ => None,
        };
        Self {
            mode,
            handling,
            display,
            body_vertices: Vec::new(),
        }
    }

    /// The mode that it was made for.
    pub fn mode(&self) -> IntersectionMode {
        self.mode
    }

    /// Whether the mode moves the vertices of a state, and not only those that are shown.
    pub(crate) fn corrects_state(&self) -> bool {
        match self.mode {
            IntersectionMode::Off => false,
            IntersectionMode::Paper { .. } => true,
            IntersectionMode::Robust { corrects, .. } => corrects == Corrects::State,
        }
    }

    /// Whether the mode moves the vertices that are shown.
    pub(crate) fn corrects_display(&self) -> bool {
        self.display.is_some()
    }

    /// Keeps layers of the garment in order from now on, where the mode's rule is the robust one.
    pub fn set_layers(&mut self, layers: &Layers) {
        if let Some(display) = &mut self.display {
            display.set_layers(layers);
        }
    }

    /// Skins the body by the transforms of its joints, on all threads.
    ///
    /// # Panics
    /// When the character is another than that it was made for.
    pub fn pose(&mut self, character: &Character, world_from_rest: &[Rigid]) {
        pose_body(character, world_from_rest, &mut self.body_vertices);
        self.handling.pose(character, &self.body_vertices);
    }

    /// [`Handling::correct`] of one vertex of the posed frame.
    pub(crate) fn correct(&self, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        self.handling.correct(vertex, p, seed)
    }

    /// Moves shown world positions, metres, off the body and the colliders.
    pub(crate) fn lift(&mut self, colliders: &[Collider], positions: &mut [Vec3]) {
        if let (Handling::Robust(_, body), Some(display)) = (&self.handling, &mut self.display) {
            let posed = PosedVertices {
                body,
                vertices: &self.body_vertices,
                colliders,
            };
            display.apply(posed, positions);
        }
    }

    /// Moves world positions of the garment in the posed frame, metres, to where the animator shows
    /// vertices that its model puts there.
    pub fn apply(&mut self, positions: &mut [Vec3]) {
        if self.corrects_state() {
            let handling = &self.handling;
            for_each_chunk(positions, TILE, |first, chunk| {
                for (vertex, p) in (first..).zip(chunk) {
                    *p = handling
                        .correct(vertex, *p, &mut Handling::no_seed())
                        .unwrap_or(*p);
                }
            });
        }
        self.lift(&[], positions);
    }
}

/// Skinned body, world space, on all threads.
pub(crate) fn pose_body(character: &Character, world_from_rest: &[Rigid], positions: &mut Vec<Vec3>) {
    let (weights, rest) = (&character.weights, &character.body.vertices);
    positions.resize(rest.len(), Vec3::ZERO);
    for_each_chunk(positions, TILE, |first, chunk| {
        for (vertex, position) in (first..).zip(chunk) {
            *position = weights.position(vertex, rest[vertex], world_from_rest);
        }
    });
}
