//! The standard body: what it is put together from.

mod arm;
mod head;
mod leg;
mod trunk;

use super::{
    proportions::Proportions,
    shape::{Loft, Shape, Station},
};
use crate::implicit::smooth_min;
use glam::Vec3;

/// Which chain of joints carries a piece.
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
    shape: Shape,
    /// Reach of the smooth union with what comes before it, metres.
    blend: f32,
    centre: Vec3,
    radius: f32,
}

/// The implicit surface of the left half of a body; the right half mirrors it.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    proportions: Proportions,
    pieces: Vec<Piece>,
    /// What is taken away: the eye sockets.
    hollows: Vec<(Shape, f32)>,
}

/// Round transition between the sides of the feet and their soles, metres.
const SOLE_ROUNDING_M: f32 = 0.012;

impl Anatomy {
    pub(super) fn new(proportions: &Proportions) -> Self {
        let mut anatomy = Self {
            proportions: proportions.clone(),
            pieces: Vec::new(),
            hollows: Vec::new(),
        };
        anatomy.trunk();
        anatomy.head();
        anatomy.leg();
        anatomy.foot();
        anatomy.arm();
        anatomy.hand();
        anatomy
    }

    /// Near to the signed distance from the skin, metres, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        let mut q = self.proportions.standard(p);
        q.x = q.x.abs();
        let mut distance = f32::MAX;
        for piece in &self.pieces {
            // Beyond its reach a piece does not change the union.
            if q.distance(piece.centre) - piece.radius < distance + piece.blend {
                distance = smooth_min(distance, piece.shape.distance(q), piece.blend);
            }
        }
        for (hollow, blend) in &self.hollows {
            distance = -smooth_min(-distance, hollow.distance(q), *blend);
        }
        -smooth_min(-distance, q.y, SOLE_ROUNDING_M) * self.proportions.scale
    }

    /// For a place of the standard body, on the left: distances from the pieces of each segment,
    /// metres, in the order of [`Segment`].
    pub(super) fn segment_distances(&self, q: Vec3) -> [(Segment, f32); 4] {
        [Segment::Trunk, Segment::Head, Segment::Arm, Segment::Leg].map(|segment| {
            let own = self.pieces.iter().filter(|piece| piece.segment == segment);
            (
                segment,
                own.map(|piece| piece.shape.distance(q)).fold(f32::MAX, f32::min),
            )
        })
    }

    fn add(&mut self, segment: Segment, blend: f32, shape: Shape) {
        let (centre, radius) = shape.bound();
        self.pieces.push(Piece {
            segment,
            shape,
            blend,
            centre,
            radius,
        });
    }

    fn cone(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], radii: [f32; 2]) {
        let ends = ends.map(Vec3::from);
        self.add(segment, blend, Shape::Cone { ends, radii });
    }

    fn ellipsoid(&mut self, segment: Segment, blend: f32, centre: [f32; 3], half: [f32; 3], pitch: f32) {
        let (centre, half) = (centre.into(), half.into());
        self.add(segment, blend, Shape::Ellipsoid { centre, half, pitch });
    }

    /// A loft between two places whose sections' front is towards +Z (a leg's) or +Y (an arm's).
    fn limb(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], sections: &[[f32; 4]]) {
        let [start, end] = ends.map(Vec3::from);
        let axis = (end - start).normalize();
        let facing = if segment == Segment::Arm { Vec3::Y } else { Vec3::Z };
        let front = facing.reject_from(axis).normalize();
        let station = |&[along, side, front, back]: &[f32; 4]| Station {
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
            stations: sections.iter().map(station).collect(),
        };
        self.add(segment, blend, Shape::Loft(loft));
    }
}
