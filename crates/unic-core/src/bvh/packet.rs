//! Neighbouring points that search a tree together.

use super::{Bvh, Child, Node, STACK_ENTRIES};
use crate::triangle::Triangle;
use glam::Vec3;

/// Points that search together: lanes of the widest vector.
pub(crate) const LANES: usize = 16;

/// Numbers of all lanes.
type Lanes<T> = [T; LANES];

/// What points know of the nearest item on their way through a tree.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Packet {
    /// Coordinates by axis, metres.
    points: [Lanes<f32>; 3],
    /// Of the nearest item so far, or how far to look: m², negative for a lane that does not take part.
    pub(crate) squared: Lanes<f32>,
    /// The nearest item so far; `u32::MAX` without one.
    pub(crate) item: Lanes<u32>,
    /// The middle of the lanes that take part.
    centre: Vec3,
}

impl Packet {
    /// Looks `squared` far from each point; points beyond the last, and those that are not finite,
    /// take no part.
    pub(crate) fn new(points: &[Vec3], squared: f32) -> Self {
        let mut packet = Self {
            points: [[0.0; LANES]; 3],
            squared: [-1.0; LANES],
            item: [u32::MAX; LANES],
            centre: Vec3::ZERO,
        };
        let mut count = 0.0;
        for (lane, p) in points.iter().enumerate().filter(|(_, p)| p.is_finite()) {
            (0..3).for_each(|axis| packet.points[axis][lane] = p[axis]);
            packet.squared[lane] = squared;
            packet.centre += *p;
            count += 1.0;
        }
        packet.centre /= f32::max(count, 1.0);
        packet
    }

    #[inline(always)]
    fn point(&self, lane: usize) -> Vec3 {
        Vec3::new(self.points[0][lane], self.points[1][lane], self.points[2][lane])
    }

    /// Takes up a triangle where it is nearer than what was found, or as near and its number lower.
    #[inline(always)]
    pub(crate) fn meet(&mut self, item: u32, triangle: &Triangle) {
        let mut found = [0.0; LANES];
        for (lane, found) in found.iter_mut().enumerate() {
            *found = triangle.nearest(self.point(lane)).squared_distance;
        }
        for (lane, found) in found.into_iter().enumerate() {
            let (best, of) = (self.squared[lane], self.item[lane]);
            let takes = (found < best) | ((found == best) & (item < of));
            self.squared[lane] = if takes { found } else { best };
            self.item[lane] = if takes { item } else { of };
        }
    }

    /// Is the box no farther from any point than what that has found?
    #[inline(always)]
    fn reaches(&self, node: &Node, child: usize) -> bool {
        let mut sum = [0.0f32; LANES];
        for axis in 0..3 {
            let (min, max) = (node.min[axis][child], node.max[axis][child]);
            for (sum, &p) in sum.iter_mut().zip(&self.points[axis]) {
                let (below, above) = (min - p, p - max);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                *sum += outside * outside;
            }
        }
        // Without an early end: no lane waits for another.
        let mut any = 0;
        for (&sum, &squared) in sum.iter().zip(&self.squared) {
            any |= u32::from(sum <= squared);
        }
        any != 0
    }
}

impl Bvh {
    /// As [`Bvh::nearest`] for all points of a packet: calls `visit` with the items of every leaf that
    /// may hold something no farther from one of the points than what that has found.
    #[inline(always)]
    pub(crate) fn nearest_of_packet(&self, packet: &mut Packet, mut visit: impl FnMut(&[u32], &mut Packet)) {
        let mut stack = [(0.0f32, 0u32, 0u8); STACK_ENTRIES];
        let mut height = self.push_boxes(0, packet.centre, &mut stack, 0);
        while height > 0 {
            height -= 1;
            let (_, node, child) = stack[height];
            let node = &self.nodes[node as usize];
            if !packet.reaches(node, usize::from(child)) {
                continue;
            }
            match node.children[usize::from(child)] {
                Child::Empty => {}
                Child::Leaf { first, count } => {
                    visit(&self.order[first as usize..][..count as usize], packet);
                }
                Child::Node(node) => height = self.push_boxes(node, packet.centre, &mut stack, height),
            }
        }
    }

    /// Pushes the boxes of a node's children, the nearest to the packet's centre last; the new height.
    #[inline(always)]
    fn push_boxes(
        &self,
        index: u32,
        centre: Vec3,
        stack: &mut [(f32, u32, u8); STACK_ENTRIES],
        bottom: usize,
    ) -> usize {
        let Some(node) = self.nodes.get(index as usize) else {
            return bottom;
        };
        let mut top = bottom;
        for (child, distance) in node.squared_distances(centre).into_iter().enumerate() {
            // An empty box is infinitely far.
            if distance.is_finite() {
                let mut at = top;
                while at > bottom && stack[at - 1].0 < distance {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (distance, index, child as u8);
                top += 1;
            }
        }
        top
    }
}
