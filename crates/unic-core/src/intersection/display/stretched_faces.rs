//! Faces that are stretched through a part of the body between corners that are outside.

use super::{
    cloth::Cloth,
    poke_through::{FaceLift, LiftContext, PointPush},
};
use crate::{intersection::robust::LiftedFace, parallel::for_each_chunk};
use glam::{Mat3, Vec3};

/// Number of faces that one thread takes at a time.
const CHUNK: usize = 64;

/// Stretch up to which a face follows the skin well enough for the body's vertices to find it.
pub(super) const MIN_STRETCH: f32 = 1.1;

/// Largest distance of a face's points from its corners, fully stretched, at which a face that cuts
/// through the body cannot be seen, metres.
const MIN_RADIUS_M: f32 = 0.009;

/// Barycentric coordinates of the points of a face that are tested: the midpoints of its edges.
const TEST_POINTS: [Vec3; 3] = [
    Vec3::new(0.5, 0.5, 0.0),
    Vec3::new(0.0, 0.5, 0.5),
    Vec3::new(0.5, 0.0, 0.5),
];

/// Lifts of the faces that are stretched through the body.
///
/// A knee that comes through a skirt pushes the skirt's vertices out to all sides. The faces
/// between them lie deep in the knee. The knee's vertices find none of these faces, or others
/// beside them, so the faces themselves search for the body.
#[derive(Clone, Debug)]
pub(super) struct StretchedFaces {
    /// Faces of the garment wide enough to hide a body part. Empty for fine meshes.
    wide: Vec<u32>,
    /// Lift of each wide face.
    lifts: Vec<Option<FaceLift>>,
}

impl StretchedFaces {
    pub(super) fn new(cloth: &Cloth) -> Self {
        let wide = cloth.wide_faces(MIN_RADIUS_M);
        Self {
            lifts: vec![None; wide.len()],
            wide,
        }
    }

    /// Lifts that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = FaceLift> {
        self.lifts.iter().flatten().copied()
    }

    /// Finds the lifts of all wide faces that are near the body and stretched by more than a
    /// factor.
    pub(super) fn find(&mut self, min_stretch: f32, context: &LiftContext) {
        let wide = &self.wide;
        for_each_chunk(&mut self.lifts, CHUNK, |first, lifts| {
            for (&face, lift) in wide[first..].iter().zip(lifts) {
                *lift = context.lift_of_stretched_face(face, min_stretch);
            }
        });
    }
}

impl LiftContext<'_> {
    /// Returns the longest push out of the body of a stretched face's test points.
    fn lift_of_stretched_face(&self, face: u32, min_stretch: f32) -> Option<FaceLift> {
        let slots = self.cloth.corners(face).map(|slot| slot as usize);
        let corners = slots.map(|slot| self.corrected[slot]);
        if !self.cloth.is_stretched(face, min_stretch, corners) {
            return None;
        }
        let position_from_barycentric = Mat3::from_cols(corners[0], corners[1], corners[2]);
        let closest_faces = slots.map(|slot| self.contacts[slot].face);
        let corner = self.body.contact_filter().garment_packets().vertices()[slots[0]];
        let lifted = LiftedFace {
            face: self.cloth.garment_face(face),
            corner,
        };
        let pushes = TEST_POINTS.iter().filter_map(|&barycentric| {
            let p = position_from_barycentric * barycentric;
            // A point above the skin next to all corners is outside. Most faces end here, without a
            // search.
            if closest_faces
                .iter()
                .all(|&skin| self.body.surface().is_above(skin, p))
            {
                return None;
            }
            let out = self
                .rule
                .push_face_point_out(self.body, lifted, p, closest_faces[0])?;
            Some(PointPush {
                barycentric,
                push: out - p,
            })
        });
        FaceLift::longest(face, pushes)
    }
}
