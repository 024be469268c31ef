//! Intersection handling of all vertices of a garment.

use super::{Afterwards, CollisionScene, DisplayPass, Handling, Layers, SkinnedGarment};
use crate::{
    character::{Character, Garment},
    collider::Collider,
    config::IntersectionMode,
    parallel::{VERTICES_PER_TASK, for_each_chunk},
    projection::ContactPlane,
    transform::Rigid,
};
use glam::Vec3;

/// Intersection handling of a garment on a skinned body: the correction of each vertex by a
/// [`Handling`], and the [`DisplayPass`] of the robust rule.
///
/// The animator handles its garment with this type. [`apply`](Self::apply) does the same to any
/// other positions of the garment, such as a baseline's or a simulation's. Scratch:
/// [posed](Self::pose) anew for every frame, without allocating after the first.
///
/// ```
/// use unic_core::config::{Corrects, IntersectionMode};
/// use unic_core::{intersection::GarmentHandling, transform::Rigid};
/// # use glam::Vec3;
/// # use unic_core::{character::*, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
/// # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
/// #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// # let joints = vec![Vec3::ZERO];
/// # let parts = SkeletonParts { parents: vec![-1], joints, ..Default::default() };
/// # let weights = SkinningWeights::from_dense(&[1.0; 4], 4, 1)?;
/// # let garment = Garment::new(body.clone(), weights.clone());
/// # let character = Character { skeleton: Skeleton::new(parts)?, weights, body, file_mesh: None };
/// let mode = IntersectionMode::Robust { margin_m: 0.003, corrects: Corrects::Display };
/// let mut handling = GarmentHandling::new(mode, &character, &garment);
/// // A body in its bind pose.
/// handling.pose(&character, &[Rigid::IDENTITY]);
/// let mut positions = vec![Vec3::splat(2.0); 4];
/// positions[0] = Vec3::new(0.2, 0.2, 0.001);
/// handling.apply(&garment, &mut positions);
/// assert!(positions[0].z < -0.002);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct GarmentHandling {
    mode: IntersectionMode,
    handling: Handling,
    display: Option<Box<DisplayPass>>,
    /// Posed body, world space, metres.
    body_vertices: Vec<Vec3>,
    /// Transforms of the joints with which the body is posed.
    world_from_rest: Vec<Rigid>,
    /// How far tears are closed, 0 to 1.
    closing_share: f32,
}

impl GarmentHandling {
    /// Creates the handling of a mode for a garment on a character; [`pose`](Self::pose) must
    /// follow.
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
            world_from_rest: Vec::new(),
            closing_share: 1.0,
        }
    }

    /// Mode that the handling was made for.
    pub fn mode(&self) -> IntersectionMode {
        self.mode
    }

    /// Returns whether the mode moves the vertices that are shown.
    pub(crate) fn corrects_display(&self) -> bool {
        self.display.is_some()
    }

    /// Keeps layers of the garment in order from now on. No effect in other modes than the robust
    /// one.
    pub fn set_layers(&mut self, layers: &Layers) {
        if let Some(display) = &mut self.display {
            display.set_layers(layers);
        }
    }

    /// Sets how far tears are closed from now on, 0 to 1. A garment that a caller gives is not torn,
    /// even where it cuts through the body.
    pub(crate) fn set_closing_share(&mut self, share: f32) {
        self.closing_share = share;
    }

    /// Skins the body by the transforms of its joints, on all threads.
    ///
    /// # Panics
    /// When the number of body vertices differs from that of the character it was made for.
    pub fn pose(&mut self, character: &Character, world_from_rest: &[Rigid]) {
        pose_body(character, world_from_rest, &mut self.body_vertices);
        self.world_from_rest.clear();
        self.world_from_rest.extend_from_slice(world_from_rest);
        self.handling.pose(character, &self.body_vertices);
    }

    /// Returns the corrected position of one vertex, see [`Handling::correct`].
    pub(crate) fn correct(&self, vertex: usize, p: Vec3, seed: &mut u32) -> Option<Vec3> {
        self.handling.correct(vertex, p, seed)
    }

    /// Writes the planes that keep shown vertices off the body, after
    /// [`correct_for_display`](Self::correct_for_display). Returns false where it has moved nothing.
    pub(crate) fn contact_planes(&self, positions: &[Vec3], planes: &mut Vec<ContactPlane>) -> bool {
        match (&self.handling, &self.display) {
            (Handling::Robust(_, body), Some(display)) if display.has_moved() => {
                let scene = CollisionScene {
                    body,
                    vertices: &self.body_vertices,
                    colliders: &[],
                    skinned: None,
                };
                display.contact_planes(scene, positions, planes);
                true
            }
            _ => false,
        }
    }

    /// Corrects shown positions once more after sweeps along the [planes](Self::contact_planes).
    pub(crate) fn correct_again(
        &mut self,
        garment: &Garment,
        colliders: &[Collider],
        planes: &[ContactPlane],
        positions: &mut [Vec3],
    ) {
        if let (Handling::Robust(_, body), Some(display)) = (&self.handling, &mut self.display) {
            let scene = CollisionScene {
                body,
                vertices: &self.body_vertices,
                colliders,
                skinned: skinned_garment(self.mode, garment, &self.world_from_rest, self.closing_share),
            };
            display.correct_again(scene, planes, positions);
        }
    }

    /// Moves shown world positions of the garment, metres, off the body and the colliders.
    pub(crate) fn correct_for_display(
        &mut self,
        garment: &Garment,
        colliders: &[Collider],
        afterwards: Afterwards,
        positions: &mut [Vec3],
    ) {
        if let (Handling::Robust(_, body), Some(display)) = (&self.handling, &mut self.display) {
            let scene = CollisionScene {
                body,
                vertices: &self.body_vertices,
                colliders,
                skinned: skinned_garment(self.mode, garment, &self.world_from_rest, self.closing_share),
            };
            display.set_afterwards(afterwards);
            display.apply(scene, positions);
        }
    }

    /// Corrects world positions of the garment that the handling was made for on the posed body,
    /// metres, as the animator corrects the output of its model.
    ///
    /// # Panics
    /// When another garment has fewer vertices or more joints than the one it was made for.
    pub fn apply(&mut self, garment: &Garment, positions: &mut [Vec3]) {
        if self.mode.corrects_state() {
            let handling = &self.handling;
            for_each_chunk(positions, VERTICES_PER_TASK, |first, chunk| {
                for (vertex, p) in (first..).zip(chunk) {
                    // No seeds are kept: callers may pass unrelated positions from call to call.
                    let mut seed = Handling::NO_SEED;
                    *p = handling.correct(vertex, *p, &mut seed).unwrap_or(*p);
                }
            });
        }
        self.correct_for_display(garment, &[], Afterwards::Shown, positions);
    }
}

/// Skinned garment that deep or torn cloth is drawn towards.
fn skinned_garment<'a>(
    mode: IntersectionMode,
    garment: &'a Garment,
    world_from_rest: &'a [Rigid],
    closing_share: f32,
) -> Option<SkinnedGarment<'a>> {
    // Corrected states are not deep. They take the shortest way, as in training.
    (!mode.corrects_state()).then_some(SkinnedGarment {
        garment,
        world_from_rest,
        closing_share,
    })
}

/// Skins the body into world space, on all threads.
pub(crate) fn pose_body(character: &Character, world_from_rest: &[Rigid], positions: &mut Vec<Vec3>) {
    let (weights, rest) = (&character.weights, &character.body.vertices);
    positions.resize(rest.len(), Vec3::ZERO);
    for_each_chunk(positions, VERTICES_PER_TASK, |first, chunk| {
        for (vertex, position) in (first..).zip(chunk) {
            *position = weights.position(vertex, rest[vertex], world_from_rest);
        }
    });
}
