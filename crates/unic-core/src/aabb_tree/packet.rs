//! Packet queries: neighbouring points that search a tree together, one in each SIMD lane.

use super::{AabbTree, Child, GroupMask, Node, STACK_ENTRIES};
use crate::{bounds::scalar_max, simd::Instructions, triangle::Triangle};
use glam::Vec3;

/// Number of points in a packet: the f32 lanes of the widest SIMD register.
pub(crate) const LANES: usize = 16;

/// One value for each lane.
type Lanes<T> = [T; LANES];

/// Factor on the search radius that exceeds the rounding of a sum of two distances and of its
/// square.
const RADIUS_SLACK: f32 = 1.0 + 1e-5;

/// Points of a packet query with the nearest item found so far for each.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Packet {
    /// Coordinates by axis, metres.
    points: [Lanes<f32>; 3],
    /// Squared distance to the nearest item found so far, at first the square of the search radius;
    /// m², negative for an inactive lane.
    pub(crate) squared: Lanes<f32>,
    /// Nearest item found so far; `u32::MAX` without one.
    pub(crate) item: Lanes<u32>,
    /// True if any lane has found a nearer item since the search radius was last computed.
    has_found: bool,
    /// Mean of the points of the active lanes.
    centre: Vec3,
    /// Distances of the points from the centre, metres.
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

    /// Creates a query within the squared radius `squared` around each point, m².
    ///
    /// Lanes without a point, or with one that is not finite, are inactive.
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
            || packet.compute_bounding_sphere(scalar_max(count, 1.0)),
        );
        packet
    }

    /// Computes the mean of `count` active lanes and the distances from it.
    // Inactive lanes hold zeros, which change no sum.
    #[inline(always)]
    fn compute_bounding_sphere(&mut self, count: f32) {
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

    /// Updates the lanes to which a triangle is nearer than what they have found, or as near with a
    /// lower number.
    ///
    /// `is_accepted` filters triangles. It is called only for one that would update a lane.
    #[inline(always)]
    pub(crate) fn test_triangle(
        &mut self,
        item: u32,
        triangle: &Triangle,
        is_accepted: impl FnOnce() -> bool,
    ) {
        let mut found = [0.0; LANES];
        for (lane, found) in found.iter_mut().enumerate() {
            *found = triangle.nearest(self.point(lane)).squared_distance;
        }
        // Most triangles are near none of the points. An OR over all lanes has no branches, so it
        // compiles to vector instructions.
        let mut any = 0;
        for (&found, &best) in found.iter().zip(&self.squared) {
            any |= u32::from(found <= best);
        }
        if any != 0 && is_accepted() {
            self.keep_nearer(item, &found);
        }
    }

    /// Updates one lane before a search, if a triangle is nearer than what the lane has found, or as
    /// near with a lower number.
    // The search computes its radius at its start, so that `has_found` need not be set.
    #[inline(always)]
    pub(crate) fn test_triangle_in(&mut self, lane: usize, item: u32, triangle: &Triangle) {
        // An inactive lane has a negative square, than which nothing is nearer.
        let new = triangle.nearest(self.point(lane)).squared_distance;
        let old = self.squared[lane];
        if new < old || (new == old && item < self.item[lane]) {
            (self.squared[lane], self.item[lane]) = (new, item);
        }
    }

    /// Records an item in the lanes to which it is nearer, given its squared distances.
    #[inline(always)]
    fn keep_nearer(&mut self, item: u32, found: &Lanes<f32>) {
        self.has_found = true;
        let (squared, items) = (self.squared, self.item);
        for lane in 0..LANES {
            let (new, old) = (found[lane], squared[lane]);
            // `|` and `&` instead of `||` and `&&`: no branches between lanes.
            let is_nearer = (new < old) | ((new == old) & (item < items[lane]));
            self.squared[lane] = if is_nearer { new } else { old };
            self.item[lane] = if is_nearer { item } else { items[lane] };
        }
    }

    /// Squared search radius around the centre, m²: no item beyond it is nearer to any point than
    /// what the point has found.
    ///
    /// It is larger than the exact value by more than rounding.
    #[inline(always)]
    fn search_radius_squared(&self) -> f32 {
        let mut radii = [0.0f32; LANES];
        for ((reach, &radius), &squared) in radii.iter_mut().zip(&self.radii).zip(&self.squared) {
            let is_active = squared >= 0.0;
            let squared = if is_active { squared } else { 0.0 };
            let sum = radius + squared.sqrt();
            *reach = if is_active { sum } else { 0.0 };
        }
        let radius = maximum(&radii) * RADIUS_SLACK;
        // The square of a tiny radius may underflow to zero.
        radius * radius + f32::MIN_POSITIVE
    }

    /// Returns whether a child's box is no farther from some point than what the point has found.
    #[inline(always)]
    fn overlaps_child(&self, node: &Node, child: usize) -> bool {
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
        // No early exit, which would be a branch in every lane.
        let mut any = 0;
        for (&sum, &squared) in sum.iter().zip(&self.squared) {
            any |= u32::from(sum <= squared);
        }
        any != 0
    }
}

/// Reduces all lanes to one number by halves.
// Each half is a vector, and the order of the sums is the same on all instruction sets.
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
    fold(lanes, scalar_max)
}

#[inline(always)]
fn sum(lanes: &Lanes<f32>) -> f32 {
    fold(lanes, |a, b| a + b)
}

/// Sphere around the centre of a packet in which leaves may matter, and the groups that are
/// searched.
#[derive(Clone, Copy)]
struct SearchSphere {
    centre: Vec3,
    squared_radius: f32,
    groups: GroupMask,
}

impl AabbTree {
    /// Calls `visit` with the items of every leaf that may have an item of these groups no farther
    /// from a point of the packet than what the point has found.
    #[inline(always)]
    pub(crate) fn visit_nearest_of_packet(
        &self,
        packet: &mut Packet,
        groups: GroupMask,
        mut visit: impl FnMut(&[u32], &mut Packet),
    ) {
        let mut stack = [(0.0f32, 0u32); STACK_ENTRIES];
        let mut sphere = SearchSphere {
            centre: packet.centre,
            squared_radius: packet.search_radius_squared(),
            groups,
        };
        let mut height = self.push_boxes(0, sphere, &mut stack, 0);
        while height > 0 {
            height -= 1;
            let (distance, entry) = stack[height];
            let (node, child) = (&self.nodes[entry as usize / 4], entry as usize % 4);
            // The sphere is a cheap test of one point for the exact test of sixteen.
            if distance > sphere.squared_radius || !packet.overlaps_child(node, child) {
                continue;
            }
            match node.children[child].child() {
                Child::Empty => {}
                Child::Leaf { first, count } => {
                    visit(&self.order[first as usize..][..count as usize], packet);
                    if packet.has_found {
                        packet.has_found = false;
                        sphere.squared_radius = packet.search_radius_squared();
                    }
                }
                Child::Node(node) => {
                    height = self.push_boxes(node, sphere, &mut stack, height);
                }
            }
        }
    }

    /// Pushes the children of a node that the sphere touches, the nearest to its centre last, and
    /// returns the stack's new height.
    ///
    /// An entry is four times the node's number plus the child's.
    #[inline(always)]
    fn push_boxes(
        &self,
        index: u32,
        sphere: SearchSphere,
        stack: &mut [(f32, u32); STACK_ENTRIES],
        bottom: usize,
    ) -> usize {
        let Some(node) = self.nodes.get(index as usize) else {
            return bottom;
        };
        let mut top = bottom;
        for (child, distance) in node.squared_distances(sphere.centre).into_iter().enumerate() {
            // An empty box is infinitely far, and so may be the radius.
            let is_near = distance <= sphere.squared_radius && distance.is_finite();
            if is_near && self.child_has_groups(index, child, sphere.groups) {
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
