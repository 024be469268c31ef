//! A contact filter for folds of the body: which parts of a fold a particle collides with.
//!
//! Captured arms pass into the torso, which real arms cannot. Between the two there is no room for
//! cloth, so that a sleeve cannot stay outside both. It stays outside the arm, which it belongs to,
//! and passes through the torso; the cloth on the torso passes through the arm. A sleeve therefore
//! always encloses its arm, and both layers are where they were when the arm is lifted.

use super::walk::NO_FACE;
use crate::body::corners_of;
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{mesh::TriMesh, surface::Surface};

/// Distance in the bind pose from which on two faces belong to different parts of the body, metres.
/// Within it the sides of a crease are one part: there is nothing for cloth to enclose.
const PART_REACH_M: f32 = 0.08;

/// Tells which faces of the body belong to the part that a particle lies on.
#[derive(Clone, Debug, Default)]
pub(crate) struct FoldFilter {
    /// Face next to each particle in the bind pose; empty without a garment.
    pub(super) homes: Vec<u32>,
    /// Centre of each face of the body in the bind pose, metres.
    centres: Vec<Vec3>,
}

impl FoldFilter {
    /// Makes the filter of a garment whose particles are the vertices of `rest`, on the bind pose
    /// of a body.
    pub(crate) fn new(body: &TriMesh, rest: &TriMesh) -> Self {
        let surface = Surface::build(body);
        let home = |p: &Vec3| surface.closest(*p).map_or(NO_FACE, |hit| hit.face);
        let centre = |face: &[u32; 3]| corners_of(&body.vertices, *face).iter().sum::<Vec3>() / 3.0;
        Self {
            homes: rest.vertices.par_iter().map(home).collect(),
            centres: body.faces.iter().map(centre).collect(),
        }
    }

    /// Returns whether a face belongs to another part of the body than the face `home`. False for
    /// an index that is no face.
    #[inline]
    pub(super) fn is_foreign(&self, home: u32, face: u32) -> bool {
        let centre = |face: u32| self.centres.get(face as usize);
        let both = centre(home).zip(centre(face));
        both.is_some_and(|(own, other)| own.distance_squared(*other) > PART_REACH_M * PART_REACH_M)
    }
}
