//! Bounding volume hierarchy: four children a node, built once, refitted as the items move.

mod build;
mod packet;
mod refit;

pub(crate) use build::clustered;
pub(crate) use packet::{LANES, Packet};
pub(crate) use refit::Posed;

use glam::Vec3;
use std::ops::Range;

/// Entries of a traversal's stack: every level leaves at most three behind, and quartering 2²⁹ items,
/// which is as many as links hold, ends after 16 levels.
const STACK_ENTRIES: usize = 64;

/// Axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl Aabb {
    /// Holds nothing and is infinitely far from everything.
    pub(crate) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The smallest box around points; coordinates that are NaN count for nothing.
    #[inline(always)]
    pub(crate) fn around(points: &[Vec3]) -> Self {
        points
            .iter()
            .fold(Self::EMPTY, |b, &p| b.union(Self { min: p, max: p }))
    }

    /// Coordinates of `other` that are NaN count for nothing.
    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self {
            min: lower(self.min, other.min),
            max: upper(self.max, other.max),
        }
    }
}

/// The lower of each coordinate; of `a` where `b` is NaN. One instruction, unlike `f32::min`.
#[inline(always)]
pub(crate) fn lower(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(least(a.x, b.x), least(a.y, b.y), least(a.z, b.z))
}

/// The higher of each coordinate; of `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn upper(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(most(a.x, b.x), most(a.y, b.y), most(a.z, b.z))
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// A half line: origin + t · direction, t ≥ 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// One over the direction by coordinate, finite.
    inverse: Vec3,
}

impl Ray {
    /// Stands for a zero in the direction: its inverse times any length in metres is finite, so
    /// that no box test meets 0 · ∞.
    const LEAST: f32 = 1e-30;

    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = |x: f32| if x.abs() < Self::LEAST { Self::LEAST } else { x }.recip();
        Self {
            origin,
            direction,
            inverse: Vec3::from(direction.to_array().map(inverse)),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Child {
    Empty,
    Node(u32),
    /// Entries `first..first + count` of the tree's order.
    Leaf {
        first: u32,
        count: u32,
    },
}

/// A [`Child`] in one word, so that a node is two cache lines: searches wait for memory.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Link(u32);

impl Link {
    const EMPTY: Self = Self(u32::MAX);
    const LEAF: u32 = 1 << 31;

    fn to(child: Child) -> Self {
        match child {
            Child::Empty => Self::EMPTY,
            Child::Node(node) => Self(node),
            // One to four of them: the count less one takes two bits.
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

/// Boxes of four children by coordinate, so that one distance computation serves all four.
#[derive(Clone, Debug)]
#[repr(align(128))]
struct Node {
    min: [[f32; 4]; 3],
    max: [[f32; 4]; 3],
    children: [Link; 4],
}

/// Marks that items bear or that a search is for, a bit each: what bears none of them is passed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Marks(pub(crate) u64);

impl Marks {
    /// All of them; every item bears one.
    pub(crate) const ANY: Self = Self(u64::MAX);

    pub(crate) fn meet(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A node with all below it.
#[derive(Clone, Debug)]
struct Branch {
    nodes: Range<usize>,
    /// Places in the tree's order.
    items: Range<usize>,
}

/// A tree over numbered items. It knows their order and boxes; its owner knows what they are.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    /// A child always follows its parent, so that a walk from the end refits from the leaves up.
    nodes: Vec<Node>,
    /// Every item is in one of them; in order.
    branches: Vec<Branch>,
    /// The nodes that are in no branch, in order.
    above: Vec<u32>,
    /// What is in each child of each node; empty where items bear no marks.
    marks: Vec<[Marks; 4]>,
    /// The items, leaf after leaf.
    order: Vec<u32>,
}

impl Bvh {
    /// Numbers the items by their order in the tree; what the numbers stand for.
    pub(crate) fn take_order(&mut self) -> Vec<u32> {
        let count = self.order.len() as u32;
        std::mem::replace(&mut self.order, (0..count).collect())
    }

    /// Marks the items.
    pub(crate) fn mark(&mut self, marks_of_item: impl Fn(u32) -> Marks) {
        self.marks = vec![[Marks(0); 4]; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            self.marks[index] = node.children.map(|link| match link.child() {
                Child::Empty => Marks(0),
                Child::Node(child) => self.marks[child as usize]
                    .into_iter()
                    .fold(Marks(0), Marks::union),
                Child::Leaf { first, count } => self.order[first as usize..][..count as usize]
                    .iter()
                    .fold(Marks(0), |all, &item| all.union(marks_of_item(item))),
            });
        }
    }

    /// Whether a child of a node holds items with any of these marks.
    #[inline(always)]
    fn may_hold(&self, node: u32, child: usize, marks: Marks) -> bool {
        (self.marks.get(node as usize)).is_none_or(|children| children[child].meet(marks))
    }

    /// Calls `visit` with the items of every leaf whose box is no farther from `p` than the bound;
    /// `visit` takes and returns the bound, a squared distance in m².
    ///
    /// A leaf at exactly the bound is visited: ties are the visitor's to decide.
    pub(crate) fn nearest(&self, p: Vec3, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.nearest_marked(p, bound, Marks::ANY, visit);
    }

    /// The same without the leaves that hold none of these marks.
    pub(crate) fn nearest_marked(
        &self,
        p: Vec3,
        bound: f32,
        marks: Marks,
        visit: impl FnMut(&[u32], f32) -> f32,
    ) {
        self.walk(marks, |node| node.squared_distances(p), bound, visit);
    }

    /// As [`Bvh::nearest`] for the items that a ray meets: the bound, which must be finite, and
    /// what `visit` returns are multiples of the ray's direction.
    pub(crate) fn along(&self, ray: &Ray, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.walk(Marks::ANY, |node| node.entries(ray), bound, visit);
    }

    /// Leaves in the order of `distances`, which must grow from a box to those inside it.
    fn walk(
        &self,
        marks: Marks,
        distances: impl Fn(&Node) -> [f32; 4],
        mut bound: f32,
        mut visit: impl FnMut(&[u32], f32) -> f32,
    ) {
        let mut stack = [(0.0, Link(0)); STACK_ENTRIES];
        // The root, where there is one.
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
                        if !self.may_hold(index, child, marks) {
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

    /// Whole vectors at once: what is written in pieces is slow to read as one.
    #[inline(always)]
    fn set(&mut self, [a, b, c, d]: [Aabb; 4]) {
        for axis in 0..3 {
            self.min[axis] = [a.min[axis], b.min[axis], c.min[axis], d.min[axis]];
            self.max[axis] = [a.max[axis], b.max[axis], c.max[axis], d.max[axis]];
        }
    }

    #[inline(always)]
    fn bounds(&self) -> Aabb {
        let low = |[a, b, c, d]: [f32; 4]| least(least(a, b), least(c, d));
        let high = |[a, b, c, d]: [f32; 4]| most(most(a, b), most(c, d));
        Aabb {
            min: Vec3::new(low(self.min[0]), low(self.min[1]), low(self.min[2])),
            max: Vec3::new(high(self.max[0]), high(self.max[1]), high(self.max[2])),
        }
    }

    /// Squared distances from `p` to the four boxes, in the order of operations in which
    /// [`squared_length`] measures a point: rounding is monotone, so no box is farther than what
    /// it holds, to the last bit.
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

    /// Where the ray enters each of the four boxes, as a multiple of its direction: zero from
    /// inside, infinity past the box and for an empty one.
    fn entries(&self, ray: &Ray) -> [f32; 4] {
        let (mut near, mut far) = ([0.0f32; 4], [f32::INFINITY; 4]);
        for axis in 0..3 {
            let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
            for lane in 0..4 {
                let a = (self.min[axis][lane] - origin) * inverse;
                let b = (self.max[axis][lane] - origin) * inverse;
                let (enter, leave) = if a < b { (a, b) } else { (b, a) };
                near[lane] = if enter > near[lane] { enter } else { near[lane] };
                far[lane] = if leave < far[lane] { leave } else { far[lane] };
            }
        }
        std::array::from_fn(|lane| {
            let is_empty = self.min[0][lane] > self.max[0][lane];
            if near[lane] <= far[lane] && !is_empty {
                near[lane]
            } else {
                f32::INFINITY
            }
        })
    }

    /// Pushes the children within the bound, the nearest last; returns the stack's new height. A child that
    /// is not at a finite distance is nowhere.
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

/// |v|² in m², summed in the order x, y, z that the boxes use.
pub(crate) fn squared_length(v: Vec3) -> f32 {
    v.x * v.x + v.y * v.y + v.z * v.z
}

#[cfg(test)]
mod tests {
    use super::build::LEAF_ITEMS;
    use super::*;
    use proptest::prelude::*;

    fn tree_over(points: &[Vec3]) -> Bvh {
        let mut tree = Bvh::build(points);
        tree.refit(|item| Aabb::around(&[points[item as usize]]));
        tree
    }

    proptest! {
        #[test]
        fn every_item_is_in_one_leaf(count in 0usize..400) {
            let points: Vec<Vec3> = (0..count).map(|i| Vec3::splat((i % 7) as f32)).collect();
            let mut seen = vec![0; count];
            let tree = tree_over(&points);
            tree.nearest(Vec3::ZERO, f32::INFINITY, |items, bound| {
                assert!(items.len() <= LEAF_ITEMS);
                items.iter().for_each(|&item| seen[item as usize] += 1);
                bound
            });
            prop_assert!(seen.iter().all(|&n| n == 1));
        }
    }

    proptest! {
        #[test]
        fn a_branch_moves_stays_or_is_nowhere(
            count in 1usize..2000, states in proptest::collection::vec(0usize..3, 64), q in 0f32..2000.0,
        ) {
            let line: Vec<Vec3> = (0..count).map(|i| Vec3::X * i as f32).collect();
            let mut tree = tree_over(&line);
            let order = tree.take_order();
            let mut points: Vec<Vec3> = order.iter().map(|&item| line[item as usize]).collect();
            let pose = |branch: usize, _: usize, points: &mut [Vec3]| match states[branch % 64] {
                0 => Posed::Same,
                1 => {
                    points.iter_mut().for_each(|p| *p += Vec3::Y * 3.0);
                    Posed::Moved
                }
                _ => Posed::Nowhere,
            };
            tree.refit_with(&mut points, pose, |_, p| Aabb::around(&[*p]));
            let branches: Vec<_> = tree.branches().collect();
            prop_assert_eq!(branches.iter().map(Range::len).sum::<usize>(), count);
            let found = |items: &[usize]| {
                let squared = items.iter().map(|&k| squared_length(points[k] - Vec3::X * q));
                squared.fold(f32::INFINITY, f32::min)
            };
            let there = branches.iter().enumerate().filter(|(branch, _)| states[branch % 64] < 2);
            let expected = found(&there.flat_map(|(_, items)| items.clone()).collect::<Vec<_>>());
            let mut best = f32::INFINITY;
            tree.nearest(Vec3::X * q, best, |items, _| {
                let items: Vec<usize> = items.iter().map(|&k| k as usize).collect();
                best = best.min(found(&items));
                best
            });
            prop_assert_eq!(best, expected);
            let mut along = Vec::new();
            tree.along(&Ray::new(Vec3::X * -1.0, Vec3::X), f32::MAX, |items, bound| {
                along.extend(items.iter().map(|&k| k as usize));
                bound
            });
            let is_nowhere = |place: &usize| {
                let branch = branches.iter().position(|items| items.contains(place));
                branch.is_none_or(|branch| states[branch % 64] == 2)
            };
            prop_assert!(!along.iter().any(is_nowhere));
        }
    }

    #[test]
    fn far_leaves_are_not_visited() {
        let points: Vec<Vec3> = (0..4096).map(|i| Vec3::X * i as f32).collect();
        let mut visited = 0;
        tree_over(&points).nearest(Vec3::X * 100.2, 1.0, |items, bound| {
            visited += items.len();
            bound
        });
        assert!((2..=12).contains(&visited), "{visited} of 4096 items visited");
    }
}
