//! A contact filter for folds of the body: which parts of a fold a particle collides with.
//!
//! Captured arms pass into the torso, which real arms cannot. Between the two there is no room for
//! cloth, so that a sleeve cannot stay outside both. It stays outside the arm, which it belongs to,
//! and passes through the torso; the cloth on the torso passes through the arm. A sleeve therefore
//! always encloses its arm, and both layers are where they were when the arm is lifted.

use super::walk::NO_FACE;
use crate::body::corners_of;
use glam::Vec3;
use unic_core::{mesh::TriMesh, surface::SurfacePoint};

/// Smallest distance in the bind pose between faces of different parts of the body, metres. Nearer
/// faces, such as the two sides of a crease, are one part: there is nothing for cloth to enclose.
const PART_REACH_M: f32 = 0.08;

/// Tells which faces of the body belong to the part that a particle lies on.
///
/// The *home face* of a particle is the face of the body that it lies on: that next to it in the
/// bind pose, and from then on an adjacent face whenever one is nearer.
#[derive(Clone, Debug, Default)]
pub(crate) struct FoldFilter {
    /// Home face of each particle in the bind pose; empty without a garment.
    pub(super) home_faces: Vec<u32>,
    /// Centre of each face of the body in the bind pose, metres.
    centres: Vec<Vec3>,
}

impl FoldFilter {
    /// Makes the filter from the points of a body next to a garment's particles, in the bind pose.
    pub(crate) fn new(body: &TriMesh, hits: &[Option<SurfacePoint>]) -> Self {
        let home_face = |hit: &Option<SurfacePoint>| hit.as_ref().map_or(NO_FACE, |hit| hit.face);
        let centre = |face: &[u32; 3]| corners_of(&body.vertices, *face).iter().sum::<Vec3>() / 3.0;
        Self {
            home_faces: hits.iter().map(home_face).collect(),
            centres: body.faces.iter().map(centre).collect(),
        }
    }

    /// Returns whether two faces belong to different parts of the body. False for an index that is
    /// no face.
    #[inline]
    pub(super) fn is_foreign(&self, home_face: u32, face: u32) -> bool {
        let centre = |face: u32| self.centres.get(face as usize);
        let both = centre(home_face).zip(centre(face));
        both.is_some_and(|(own, other)| own.distance_squared(*other) > PART_REACH_M * PART_REACH_M)
    }
}
