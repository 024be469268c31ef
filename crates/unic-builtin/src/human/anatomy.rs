//! Implicit surface of the body, assembled from primitives at the standard height.

mod arm;
mod head;
mod leg;
mod trunk;

use super::{
    primitive::{BoundingSphere, Loft, LoftSection, Primitive},
    proportions::Proportions,
};
use crate::implicit::smooth_min;
use glam::Vec3;

/// Body segment whose joints carry a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Segment {
    Trunk,
    Head,
    Arm,
    Leg,
}

/// One piece of the body.
#[derive(Clone, Debug)]
struct Piece {
    segment: Segment,
    primitive: Primitive,
    /// Reach of the smooth union with the pieces before it, metres.
    blend: f32,
    bound: BoundingSphere,
}

/// A piece that is subtracted from the body.
#[derive(Clone, Debug)]
struct Hollow {
    primitive: Primitive,
    /// Reach of the smooth subtraction, metres.
    blend: f32,
}

/// Implicit surface of the left half of a body; the right half mirrors it.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    proportions: Proportions,
    pieces: Vec<Piece>,
    /// Eye sockets.
    hollows: Vec<Hollow>,
}

/// Round transition between the sides of the feet and their soles, metres.
const SOLE_ROUNDING_M: f32 = 0.012;

impl Anatomy {
    /// Assembles the body with the given proportions.
    pub(super) fn new(proportions: &Proportions) -> Self {
        let mut anatomy = Self {
            proportions: proportions.clone(),
            pieces: Vec::new(),
            hollows: Vec::new(),
        };
        // The smooth union is not associative: the order of the pieces shapes the surface.
        anatomy.trunk();
        anatomy.head();
        anatomy.leg();
        anatomy.foot();
        anatomy.arm();
        anatomy.hand();
        anatomy
    }

    /// Approximate signed distance from the skin, metres, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        let mut q = self.proportions.standard(p);
        q.x = q.x.abs();
        let mut distance = f32::MAX;
        for piece in &self.pieces {
            // Beyond its reach a piece does not change the union: the bounding sphere saves the
            // evaluation of most pieces.
            let bound = &piece.bound;
            if q.distance(bound.centre) - bound.radius < distance + piece.blend {
                distance = smooth_min(distance, piece.primitive.distance(q), piece.blend);
            }
        }
        for hollow in &self.hollows {
            distance = -smooth_min(-distance, hollow.primitive.distance(q), hollow.blend);
        }
        // The half space y < 0 is subtracted too: soles are flat.
        -smooth_min(-distance, q.y, SOLE_ROUNDING_M) * self.proportions.scale
    }

    /// Distances of a point on the left of the standard body from each segment, in the order of
    /// [`Segment`].
    pub(super) fn segment_distances(&self, q: Vec3) -> [SegmentDistance; 4] {
        [Segment::Trunk, Segment::Head, Segment::Arm, Segment::Leg].map(|segment| {
            let own = self.pieces.iter().filter(|piece| piece.segment == segment);
            let distances = own.map(|piece| piece.primitive.distance(q));
            SegmentDistance {
                segment,
                distance: distances.fold(f32::MAX, f32::min),
            }
        })
    }

    fn add(&mut self, segment: Segment, blend: f32, primitive: Primitive) {
        self.pieces.push(Piece {
            segment,
            bound: primitive.bound(),
            primitive,
            blend,
        });
    }

    fn cone(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], radii: [f32; 2]) {
        let ends = ends.map(Vec3::from);
        self.add(segment, blend, Primitive::Cone { ends, radii });
    }

    fn ellipsoid(&mut self, segment: Segment, blend: f32, centre: [f32; 3], half: [f32; 3], pitch: f32) {
        let (centre, half) = (centre.into(), half.into());
        self.add(segment, blend, Primitive::Ellipsoid { centre, half, pitch });
    }

    /// Adds a loft between two points. Its front faces +Z on a leg and +Y on an arm.
    ///
    /// Each section holds the distance along the axis, the half width, and the depths to the front
    /// and to the back, metres.
    fn limb(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], sections: &[[f32; 4]]) {
        let [start, end] = ends.map(Vec3::from);
        let axis = (end - start).normalize();
        let facing = if segment == Segment::Arm { Vec3::Y } else { Vec3::Z };
        let front = facing.reject_from(axis).normalize();
        let section = |&[along, side, front, back]: &[f32; 4]| LoftSection {
            along,
            side,
            front,
            back,
        };
        let loft = Loft {
            origin: start,
            axis,
            side: axis.cross(front),
            front,
            power: 2.1,
            sections: sections.iter().map(section).collect(),
        };
        self.add(segment, blend, Primitive::Loft(loft));
    }
}

/// Distance of a point from the nearest piece of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentDistance {
    pub(super) segment: Segment,
    /// Signed distance, metres, negative inside.
    pub(super) distance: f32,
}
