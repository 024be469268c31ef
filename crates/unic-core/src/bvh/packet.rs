//! Neighbouring points that search a tree together.

use super::{Bvh, Child, Marks, Node, STACK_ENTRIES, most};
use crate::{network::Instructions, triangle::Triangle};
use glam::Vec3;

/// Points that search together: lanes of the widest vector.
pub(crate) const LANES: usize = 16;

/// Numbers of all lanes.
type Lanes<T> = [T; LANES];

/// More than what rounding takes from the sum of two distances and its square.
const REACH_SLACK: f32 = 1.0 + 1e-5;

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
    /// Has anything been found since the reach was asked for?
    has_found: bool,
    /// The middle of the lanes that take part.
    centre: Vec3,
    /// Distances of the lanes from it, metres.
    radii: Lanes<f32>,
}

impl Packet {
    const EMPTY: Self = Self {
        points: [[0.0; LANES]; 3],
        squared: [-1.0; LANES],
        item: [u32::MAX; LANES],
        has_found: false,
        centre: Vec3::ZERO,
        radii: [0.0; LANES],
    };

    /// Looks `squared` far from each point; points beyond the last, and those that are not finite,
    /// take no part.
    pub(crate) fn new(instructions: Instructions, points: &[Vec3], squared: f32) -> Self {
        let mut packet = Self::EMPTY;
        let mut count = 0.0;
        for (lane, p) in points.iter().enumerate().filter(|(_, p)| p.is_finite()) {
            (0..3).for_each(|axis| packet.points[axis][lane] = p[axis]);
            packet.squared[lane] = squared;
            count += 1.0;
        }
        instructions.run(
            #[inline(always)]
            || packet.surround(most(count, 1.0)),
        );
        packet
    }

    /// Finds the middle of so many lanes, and how far they are from it.
    #[inline(always)]
    fn surround(&mut self, count: f32) {
        let [x, y, z] = &self.points;
        self.centre = Vec3::new(sum(x), sum(y), sum(z)) / count;
        let [cx, cy, cz] = self.centre.to_array();
        for lane in 0..LANES {
            let (x, y, z) = (x[lane] - cx, y[lane] - cy, z[lane] - cz);
            let radius = (x * x + y * y + z * z).sqrt();
            self.radii[lane] = if self.squared[lane] >= 0.0 { radius } else { 0.0 };
        }
    }

    #[inline(always)]
    fn point(&self, lane: usize) -> Vec3 {
        Vec3::new(self.points[0][lane], self.points[1][lane], self.points[2][lane])
    }

    /// Takes up a triangle where it is nearer than what was found, or as near and its number lower; one that
    /// is near is asked whether it counts.
    #[inline(always)]
    pub(crate) fn meet(&mut self, item: u32, triangle: &Triangle, counts: impl FnOnce() -> bool) {
        let mut found = [0.0; LANES];
        for (lane, found) in found.iter_mut().enumerate() {
            *found = triangle.nearest(self.point(lane)).squared_distance;
        }
        // Most triangles are near none of the points.
        let mut any = 0;
        for (&found, &best) in found.iter().zip(&self.squared) {
            any |= u32::from(found <= best);
        }
        if any != 0 && counts() {
            self.take_up(item, &found);
        }
    }

    /// Takes up an item at these squared distances.
    #[inline(always)]
    fn take_up(&mut self, item: u32, found: &Lanes<f32>) {
        self.has_found = true;
        let (squared, items) = (self.squared, self.item);
        for lane in 0..LANES {
            let (new, old) = (found[lane], squared[lane]);
            let takes = (new < old) | ((new == old) & (item < items[lane]));
            self.squared[lane] = if takes { new } else { old };
            self.item[lane] = if takes { item } else { items[lane] };
        }
    }

    /// Square of a distance from the centre beyond which nothing is nearer to a point than what that has
    /// found, m². Generous by more than rounding.
    #[inline(always)]
    fn reach(&self) -> f32 {
        let mut reaches = [0.0f32; LANES];
        for ((reach, &radius), &squared) in reaches.iter_mut().zip(&self.radii).zip(&self.squared) {
            let is_asked = squared >= 0.0;
            let squared = if is_asked { squared } else { 0.0 };
            let asked = radius + squared.sqrt();
            *reach = if is_asked { asked } else { 0.0 };
        }
        let reach = maximum(&reaches) * REACH_SLACK;
        reach * reach + f32::MIN_POSITIVE
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

/// All lanes in one, in halves, which are vectors.
#[inline(always)]
fn fold(lanes: &Lanes<f32>, both: impl Fn(f32, f32) -> f32) -> f32 {
    let (mut lanes, mut half) = (*lanes, LANES / 2);
    while half > 0 {
        for lane in 0..half {
            lanes[lane] = both(lanes[lane], lanes[lane + half]);
        }
        half /= 2;
    }
    lanes[0]
}

#[inline(always)]
fn maximum(lanes: &Lanes<f32>) -> f32 {
    fold(lanes, most)
}

#[inline(always)]
fn sum(lanes: &Lanes<f32>) -> f32 {
    fold(lanes, |a, b| a + b)
}

impl Bvh {
    /// As [`Bvh::nearest`] for all points of a packet: calls `visit` with the items of every leaf that
    /// may hold something of these marks no farther from one of the points than what that has found.
    #[inline(always)]
    pub(crate) fn nearest_of_packet(
        &self,
        packet: &mut Packet,
        marks: Marks,
        mut visit: impl FnMut(&[u32], &mut Packet),
    ) {
        let mut stack = [(0.0f32, 0u32); STACK_ENTRIES];
        let mut reach = packet.reach();
        let mut height = self.push_boxes(0, (packet.centre, reach, marks), &mut stack, 0);
        while height > 0 {
            height -= 1;
            let (distance, entry) = stack[height];
            let (node, child) = (&self.nodes[entry as usize / 4], entry as usize % 4);
            if distance > reach || !packet.reaches(node, child) {
                continue;
            }
            match node.children[child].child() {
                Child::Empty => {}
                Child::Leaf { first, count } => {
                    visit(&self.order[first as usize..][..count as usize], packet);
                    if packet.has_found {
                        packet.has_found = false;
                        reach = packet.reach();
                    }
                }
                Child::Node(node) => {
                    let asked = (packet.centre, reach, marks);
                    height = self.push_boxes(node, asked, &mut stack, height);
                }
            }
        }
    }

    /// Pushes the boxes of a node's children, the nearest to the packet's centre last; the new height. An
    /// entry is four times the node's number plus the child's.
    #[inline(always)]
    fn push_boxes(
        &self,
        index: u32,
        (centre, reach, marks): (Vec3, f32, Marks),
        stack: &mut [(f32, u32); STACK_ENTRIES],
        bottom: usize,
    ) -> usize {
        let Some(node) = self.nodes.get(index as usize) else {
            return bottom;
        };
        let mut top = bottom;
        for (child, distance) in node.squared_distances(centre).into_iter().enumerate() {
            // An empty box is infinitely far.
            if distance <= reach && distance.is_finite() && self.may_hold(index, child, marks) {
                let mut at = top;
                while at > bottom && stack[at - 1].0 < distance {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (distance, 4 * index + child as u32);
                top += 1;
            }
        }
        top
    }
}
