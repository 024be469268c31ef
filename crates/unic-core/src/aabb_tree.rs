//! Bounding volume hierarchy over numbered items, with four children a node.
//!
//! The topology is built once; the boxes are refitted as the items move. The tree stores the order
//! and the boxes of the items; its owner stores the items themselves (points, triangles).

mod build;
mod packet;
mod refit;

pub(crate) use build::clustered;
pub(crate) use packet::{LANES, Packet};
pub(crate) use refit::BranchUpdate;

use crate::bounds::{Aabb, Ray, scalar_max, scalar_min};
use glam::Vec3;
use std::ops::Range;

/// Entries of a traversal's stack.
///
/// Every level leaves at most three siblings on it. Quartering 2²⁹ items, as many as a link can
/// number, ends after 16 levels.
const STACK_ENTRIES: usize = 64;

/// Child of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Child {
    Empty,
    /// Number of the node.
    Node(u32),
    /// Entries `first..first + count` of the tree's order.
    Leaf {
        first: u32,
        count: u32,
    },
}

/// A [`Child`] packed into 32 bits, so that a node takes two cache lines: memory bounds the
/// searches.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Link(u32);

impl Link {
    const EMPTY: Self = Self(u32::MAX);
    const LEAF: u32 = 1 << 31;

    fn to(child: Child) -> Self {
        match child {
            Child::Empty => Self::EMPTY,
            Child::Node(node) => Self(node),
            // A leaf has one to four items, so the count minus one takes two bits.
            Child::Leaf { first, count } => Self(Self::LEAF | first << 2 | (count - 1)),
        }
    }

    #[inline(always)]
    fn child(self) -> Child {
        match self {
            Self::EMPTY => Child::Empty,
            Self(node) if node & Self::LEAF == 0 => Child::Node(node),
            Self(leaf) => Child::Leaf {
                first: (leaf & !Self::LEAF) >> 2,
                count: (leaf & 3) + 1,
            },
        }
    }
}

/// Boxes of four children, coordinate by coordinate, so that one vector operation serves all four.
#[derive(Clone, Debug)]
#[repr(align(128))]
struct Node {
    min: [[f32; 4]; 3],
    max: [[f32; 4]; 3],
    children: [Link; 4],
}

/// Set of collision groups, one bit each.
///
/// Items belong to groups, and a search names the groups that it is for. Subtrees without an item
/// of these groups are skipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GroupMask(pub(crate) u64);

impl GroupMask {
    /// All groups.
    pub(crate) const ALL: Self = Self(u64::MAX);

    pub(crate) fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Subtree that one thread refits.
#[derive(Clone, Debug)]
struct Branch {
    nodes: Range<usize>,
    /// Places in the tree's order.
    items: Range<usize>,
}

/// Bounding volume hierarchy of axis-aligned boxes over numbered items.
#[derive(Clone, Debug)]
pub(crate) struct AabbTree {
    /// Nodes in depth-first order. A child follows its parent, so a pass from the end to the start
    /// refits from the leaves up.
    nodes: Vec<Node>,
    /// Disjoint subtrees in order; every item is in one of them.
    branches: Vec<Branch>,
    /// Nodes above the branches, in order.
    top_nodes: Vec<u32>,
    /// Groups of the items in each child of each node; empty where items have no groups.
    groups: Vec<[GroupMask; 4]>,
    /// Numbers of the items, leaf after leaf.
    order: Vec<u32>,
}

impl AabbTree {
    /// Renumbers the items by their place in the tree, and returns the former number of each.
    ///
    /// An owner that stores its items in this order reads the items of a leaf from one run of
    /// memory.
    pub(crate) fn renumber_in_tree_order(&mut self) -> Vec<u32> {
        let count = self.order.len() as u32;
        std::mem::replace(&mut self.order, (0..count).collect())
    }

    /// Assigns groups to the items.
    pub(crate) fn set_groups(&mut self, groups_of_item: impl Fn(u32) -> GroupMask) {
        self.groups = vec![[GroupMask(0); 4]; self.nodes.len()];
        // Groups have an array of their own: a node has no room for them in its two cache lines,
        // and trees without groups need none.
        for (index, node) in self.nodes.iter().enumerate().rev() {
            self.groups[index] = node.children.map(|link| match link.child() {
                Child::Empty => GroupMask(0),
                Child::Node(child) => self.groups[child as usize]
                    .into_iter()
                    .fold(GroupMask(0), GroupMask::union),
                Child::Leaf { first, count } => self.order[first as usize..][..count as usize]
                    .iter()
                    .fold(GroupMask(0), |all, &item| all.union(groups_of_item(item))),
            });
        }
    }

    /// Returns whether a child of a node has items of any of these groups.
    #[inline(always)]
    fn child_has_groups(&self, node: u32, child: usize, groups: GroupMask) -> bool {
        (self.groups.get(node as usize)).is_none_or(|children| children[child].intersects(groups))
    }

    /// Calls `visit` with the items of every leaf whose box is no farther from `p` than the bound,
    /// a squared distance in m².
    ///
    /// `visit` takes the bound and returns the new one. A leaf at exactly the bound is visited too,
    /// so that `visit` decides ties.
    pub(crate) fn visit_nearest(&self, p: Vec3, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.visit_nearest_in_groups(p, bound, GroupMask::ALL, visit);
    }

    /// Does what [`Self::visit_nearest`] does, without the subtrees that have no item of these
    /// groups.
    pub(crate) fn visit_nearest_in_groups(
        &self,
        p: Vec3,
        bound: f32,
        groups: GroupMask,
        visit: impl FnMut(&[u32], f32) -> f32,
    ) {
        self.walk(groups, |node| node.squared_distances(p), bound, visit);
    }

    /// Calls `visit` with the items of every leaf whose box a ray enters no farther than the bound.
    ///
    /// The bound and what `visit` returns are finite multiples of the ray's direction.
    pub(crate) fn visit_along_ray(&self, ray: &Ray, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.walk(GroupMask::ALL, |node| node.ray_entries(ray), bound, visit);
    }

    /// Visits leaves nearest first. `distances` must not decrease from a box to the boxes inside
    /// it.
    fn walk(
        &self,
        groups: GroupMask,
        distances: impl Fn(&Node) -> [f32; 4],
        mut bound: f32,
        mut visit: impl FnMut(&[u32], f32) -> f32,
    ) {
        let mut stack = [(0.0, Link(0)); STACK_ENTRIES];
        // The stack starts with the root, unless the tree is empty.
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let (distance, link) = stack[height];
            if distance > bound {
                continue;
            }
            match link.child() {
                Child::Empty => {}
                Child::Leaf { first, count } => {
                    bound = visit(&self.order[first as usize..][..count as usize], bound);
                }
                Child::Node(index) => {
                    let node = &self.nodes[index as usize];
                    let mut distances = distances(node);
                    for (child, distance) in distances.iter_mut().enumerate() {
                        if !self.child_has_groups(index, child, groups) {
                            // NaN keeps the child off the stack.
                            *distance = f32::NAN;
                        }
                    }
                    height = node.push_children(distances, bound, &mut stack, height);
                }
            }
        }
    }
}

impl Node {
    const EMPTY: Self = Self {
        min: [[f32::INFINITY; 4]; 3],
        max: [[f32::NEG_INFINITY; 4]; 3],
        children: [Link::EMPTY; 4],
    };

    /// Stores the boxes of the four children.
    // Whole arrays are written at once: a vector load soon after four scalar stores to its place
    // stalls.
    #[inline(always)]
    fn set(&mut self, [a, b, c, d]: [Aabb; 4]) {
        for axis in 0..3 {
            self.min[axis] = [a.min[axis], b.min[axis], c.min[axis], d.min[axis]];
            self.max[axis] = [a.max[axis], b.max[axis], c.max[axis], d.max[axis]];
        }
    }

    #[inline(always)]
    fn bounds(&self) -> Aabb {
        let low = |[a, b, c, d]: [f32; 4]| scalar_min(scalar_min(a, b), scalar_min(c, d));
        let high = |[a, b, c, d]: [f32; 4]| scalar_max(scalar_max(a, b), scalar_max(c, d));
        Aabb {
            min: Vec3::new(low(self.min[0]), low(self.min[1]), low(self.min[2])),
            max: Vec3::new(high(self.max[0]), high(self.max[1]), high(self.max[2])),
        }
    }

    /// Squared distances from `p` to the four boxes, m².
    ///
    /// Terms are added in the order of [`squared_length`](crate::bounds::squared_length). Rounding
    /// is monotone, so no box is farther than what it holds, to the last bit.
    #[inline(always)]
    fn squared_distances(&self, p: Vec3) -> [f32; 4] {
        let mut sum = [0.0; 4];
        for ((min, max), p) in self.min.iter().zip(&self.max).zip(p.to_array()) {
            for (lane, sum) in sum.iter_mut().enumerate() {
                let (below, above) = (min[lane] - p, p - max[lane]);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                *sum += outside * outside;
            }
        }
        sum
    }

    /// Multiples of the ray's direction at which it enters each of the four boxes: zero from
    /// inside, infinity for a box that it misses and for an empty one.
    fn ray_entries(&self, ray: &Ray) -> [f32; 4] {
        let (mut near, mut far) = ([0.0f32; 4], [f32::INFINITY; 4]);
        for axis in 0..3 {
            let (origin, inverse) = (ray.origin[axis], ray.inverse_direction[axis]);
            for lane in 0..4 {
                let a = (self.min[axis][lane] - origin) * inverse;
                let b = (self.max[axis][lane] - origin) * inverse;
                let (enter, leave) = if a < b { (a, b) } else { (b, a) };
                near[lane] = if enter > near[lane] { enter } else { near[lane] };
                far[lane] = if leave < far[lane] { leave } else { far[lane] };
            }
        }
        std::array::from_fn(|lane| {
            // An empty box has infinite bounds of the wrong order: swapped, they hold every ray.
            let is_empty = self.min[0][lane] > self.max[0][lane];
            if near[lane] <= far[lane] && !is_empty {
                near[lane]
            } else {
                f32::INFINITY
            }
        })
    }

    /// Pushes the children within the bound, the nearest last, and returns the stack's new height.
    ///
    /// A child whose distance is not finite is left out.
    fn push_children(
        &self,
        distances: [f32; 4],
        bound: f32,
        stack: &mut [(f32, Link); STACK_ENTRIES],
        bottom: usize,
    ) -> usize {
        let mut top = bottom;
        for (distance, child) in distances.into_iter().zip(self.children) {
            if distance > bound || !distance.is_finite() {
                continue;
            }
            // Insertion sort: four entries at most.
            let mut at = top;
            while at > bottom && stack[at - 1].0 < distance {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = (distance, child);
            top += 1;
        }
        top
    }
}

#[cfg(test)]
mod tests {
    use super::build::LEAF_ITEMS;
    use super::*;
    use crate::{bounds::squared_length, test_meshes::point, triangle::Triangle};
    use proptest::prelude::*;

    fn tree_over(points: &[Vec3]) -> AabbTree {
        let mut tree = AabbTree::build(points);
        tree.refit(|item| Aabb::around(&[points[item as usize]]));
        tree
    }

    proptest! {
        #[test]
        fn every_item_is_in_one_leaf(count in 0usize..400) {
            let points: Vec<Vec3> = (0..count).map(|i| Vec3::splat((i % 7) as f32)).collect();
            let mut visits = vec![0; count];
            let tree = tree_over(&points);
            tree.visit_nearest(Vec3::ZERO, f32::INFINITY, |items, bound| {
                assert!(items.len() <= LEAF_ITEMS);
                items.iter().for_each(|&item| visits[item as usize] += 1);
                bound
            });
            prop_assert!(visits.iter().all(|&n| n == 1));
        }
    }

    proptest! {
        #[test]
        fn branches_move_stay_or_are_excluded_independently(
            count in 1usize..2000, states in proptest::collection::vec(0usize..3, 64), q in 0f32..2000.0,
        ) {
            let line: Vec<Vec3> = (0..count).map(|i| Vec3::X * i as f32).collect();
            let mut tree = tree_over(&line);
            let order = tree.renumber_in_tree_order();
            let mut points: Vec<Vec3> = order.iter().map(|&item| line[item as usize]).collect();
            let pose = |branch: usize, _: usize, points: &mut [Vec3]| match states[branch % 64] {
                0 => BranchUpdate::Unchanged,
                1 => {
                    points.iter_mut().for_each(|p| *p += Vec3::Y * 3.0);
                    BranchUpdate::Moved
                }
                _ => BranchUpdate::Excluded,
            };
            tree.refit_branches(&mut points, pose, |_, p| Aabb::around(&[*p]));
            let branches: Vec<_> = tree.branches().collect();
            prop_assert_eq!(branches.iter().map(Range::len).sum::<usize>(), count);
            let squared_distance = |items: &[usize]| {
                let squared = items.iter().map(|&k| squared_length(points[k] - Vec3::X * q));
                squared.fold(f32::INFINITY, f32::min)
            };
            let included = branches.iter().enumerate().filter(|(branch, _)| states[branch % 64] < 2);
            let expected = squared_distance(&included.flat_map(|(_, items)| items.clone()).collect::<Vec<_>>());
            let mut best = f32::INFINITY;
            tree.visit_nearest(Vec3::X * q, best, |items, _| {
                let items: Vec<usize> = items.iter().map(|&k| k as usize).collect();
                best = best.min(squared_distance(&items));
                best
            });
            prop_assert_eq!(best, expected);
            let mut along = Vec::new();
            tree.visit_along_ray(&Ray::new(Vec3::X * -1.0, Vec3::X), f32::MAX, |items, bound| {
                along.extend(items.iter().map(|&k| k as usize));
                bound
            });
            let is_excluded = |place: &usize| {
                let branch = branches.iter().position(|items| items.contains(place));
                branch.is_none_or(|branch| states[branch % 64] == 2)
            };
            prop_assert!(!along.iter().any(is_excluded));
        }

        #[test]
        fn no_closest_point_is_nearer_than_the_box_to_the_bit(
            p in point(1.0), corners in [point(0.5), point(0.5), point(0.5)], level in 0usize..4,
        ) {
            // A triangle perpendicular to an axis fills its box, seen from beside its plane.
            let corners = corners.map(|mut c| {
                if level < 3 {
                    c[level] = 0.1;
                }
                c
            });
            let mut tree = AabbTree::build(&corners[..1]);
            tree.refit(|_| Aabb::around(&corners));
            let mut is_visited = false;
            tree.visit_nearest(p, Triangle::new(corners).closest(p).squared_distance, |_, bound| {
                is_visited = true;
                bound
            });
            prop_assert!(is_visited);
        }
    }

    #[test]
    fn far_leaves_are_not_visited() {
        let points: Vec<Vec3> = (0..4096).map(|i| Vec3::X * i as f32).collect();
        let mut visited = 0;
        tree_over(&points).visit_nearest(Vec3::X * 100.2, 1.0, |items, bound| {
            visited += items.len();
            bound
        });
        assert!((2..=12).contains(&visited), "{visited} of 4096 items visited");
    }
}
