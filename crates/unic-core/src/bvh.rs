//! Bounding volume hierarchy: four children a node, built once, refitted as the items move.

mod packet;

pub(crate) use packet::{LANES, Packet};

use glam::Vec3;
use std::ops::Range;

/// Most items in one leaf. With four, a leaf of triangles costs about as much as a node.
const LEAF_ITEMS: usize = 4;

/// Entries of a traversal's stack: every level leaves at most three behind, and halving 2³² items
/// twice a level ends after 16 levels.
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
    let least = |a: f32, b: f32| if b < a { b } else { a };
    Vec3::new(least(a.x, b.x), least(a.y, b.y), least(a.z, b.z))
}

/// The higher of each coordinate; of `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn upper(a: Vec3, b: Vec3) -> Vec3 {
    let most = |a: f32, b: f32| if b > a { b } else { a };
    Vec3::new(most(a.x, b.x), most(a.y, b.y), most(a.z, b.z))
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

#[derive(Clone, Copy, Debug)]
enum Child {
    Empty,
    Node(u32),
    /// Entries `first..first + count` of the tree's order.
    Leaf {
        first: u32,
        count: u32,
    },
}

/// Boxes of four children by coordinate, so that one distance computation serves all four.
#[derive(Clone, Debug)]
struct Node {
    min: [[f32; 4]; 3],
    max: [[f32; 4]; 3],
    children: [Child; 4],
}

/// A tree over numbered items. It knows their order and boxes; its owner knows what they are.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    /// A child always follows its parent, so that a walk from the end refits from the leaves up.
    nodes: Vec<Node>,
    /// The items, leaf after leaf.
    order: Vec<u32>,
}

impl Bvh {
    /// Splits the items at medians of their centres; [`Bvh::refit`] must follow.
    pub(crate) fn build(centres: &[Vec3]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..centres.len() as u32).collect(),
        };
        if !centres.is_empty() {
            tree.split(centres, 0..centres.len());
        }
        tree
    }

    fn split(&mut self, centres: &[Vec3], range: Range<usize>) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let middle = halve(&mut self.order, centres, range.clone());
        let (left, right) = (range.start..middle, middle..range.end);
        let quarter = halve(&mut self.order, centres, left.clone());
        let three_quarters = halve(&mut self.order, centres, right.clone());
        let quarters = [
            left.start..quarter,
            quarter..left.end,
            right.start..three_quarters,
            three_quarters..right.end,
        ];
        self.nodes[index].children = quarters.map(|part| match part.len() {
            0 => Child::Empty,
            count @ 1..=LEAF_ITEMS => Child::Leaf {
                first: part.start as u32,
                count: count as u32,
            },
            _ => Child::Node(self.split(centres, part)),
        });
        index as u32
    }

    /// Numbers the items by their order in the tree; what the numbers stand for.
    pub(crate) fn take_order(&mut self) -> Vec<u32> {
        let count = self.order.len() as u32;
        std::mem::replace(&mut self.order, (0..count).collect())
    }

    /// Recomputes every box from those of the items.
    pub(crate) fn refit(&mut self, box_of_item: impl Fn(u32) -> Aabb) {
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..4 {
                let bounds = match self.nodes[index].children[lane] {
                    Child::Empty => Aabb::EMPTY,
                    Child::Node(child) => self.nodes[child as usize].bounds(),
                    Child::Leaf { first, count } => self.order[first as usize..][..count as usize]
                        .iter()
                        .fold(Aabb::EMPTY, |b, &item| b.union(box_of_item(item))),
                };
                self.nodes[index].set(lane, bounds);
            }
        }
    }

    /// Calls `visit` with the items of every leaf whose box is no farther from `p` than the bound;
    /// `visit` takes and returns the bound, a squared distance in m².
    ///
    /// A leaf at exactly the bound is visited: ties are the visitor's to decide.
    pub(crate) fn nearest(&self, p: Vec3, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.walk(|node| node.squared_distances(p), bound, visit);
    }

    /// As [`Bvh::nearest`] for the items that a ray meets: the bound, which must be finite, and
    /// what `visit` returns are multiples of the ray's direction.
    pub(crate) fn along(&self, ray: &Ray, bound: f32, visit: impl FnMut(&[u32], f32) -> f32) {
        self.walk(|node| node.entries(ray), bound, visit);
    }

    /// Leaves in the order of `distances`, which must grow from a box to those inside it.
    fn walk(
        &self,
        distances: impl Fn(&Node) -> [f32; 4],
        mut bound: f32,
        mut visit: impl FnMut(&[u32], f32) -> f32,
    ) {
        let mut stack = [(0.0, Child::Empty); STACK_ENTRIES];
        let mut height = 0;
        if !self.nodes.is_empty() {
            stack[0] = (0.0, Child::Node(0));
            height = 1;
        }
        while height > 0 {
            height -= 1;
            let (distance, child) = stack[height];
            if distance > bound {
                continue;
            }
            match child {
                Child::Empty => {}
                Child::Leaf { first, count } => {
                    bound = visit(&self.order[first as usize..][..count as usize], bound);
                }
                Child::Node(node) => {
                    let node = &self.nodes[node as usize];
                    height = node.push_children(distances(node), bound, &mut stack, height);
                }
            }
        }
    }
}

impl Node {
    const EMPTY: Self = Self {
        min: [[f32::INFINITY; 4]; 3],
        max: [[f32::NEG_INFINITY; 4]; 3],
        children: [Child::Empty; 4],
    };

    fn set(&mut self, lane: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.min[axis][lane] = bounds.min[axis];
            self.max[axis][lane] = bounds.max[axis];
        }
    }

    fn bounds(&self) -> Aabb {
        let fold = |lanes: [[f32; 4]; 3], start, f: fn(f32, f32) -> f32| {
            Vec3::from(lanes.map(|lane| lane.into_iter().fold(start, f)))
        };
        Aabb {
            min: fold(self.min, f32::INFINITY, f32::min),
            max: fold(self.max, f32::NEG_INFINITY, f32::max),
        }
    }

    /// Squared distances from `p` to the four boxes, in the order of operations in which
    /// [`squared_length`] measures a point: rounding is monotone, so no box is farther than what
    /// it holds, to the last bit.
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
    /// inside, infinity past the box.
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
            if near[lane] <= far[lane] {
                near[lane]
            } else {
                f32::INFINITY
            }
        })
    }

    /// Pushes the children within the bound, the nearest last; returns the stack's new height.
    fn push_children(
        &self,
        distances: [f32; 4],
        bound: f32,
        stack: &mut [(f32, Child); STACK_ENTRIES],
        bottom: usize,
    ) -> usize {
        let mut top = bottom;
        for (distance, child) in distances.into_iter().zip(self.children) {
            if distance > bound {
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

/// Puts some of the points in an order in which every so many of them, by each of the ascending
/// `sizes`, are neighbours.
pub(crate) fn clustered(mut chosen: Vec<u32>, points: &[Vec3], sizes: &[usize]) -> Vec<u32> {
    fn split(order: &mut [u32], points: &[Vec3], sizes: &[usize], range: Range<usize>) {
        let Some(size) = sizes.iter().rev().find(|&&size| range.len() > size) else {
            return;
        };
        let lower = (range.len() / 2).next_multiple_of(*size);
        let middle = partition(order, points, range.clone(), lower);
        split(order, points, sizes, range.start..middle);
        split(order, points, sizes, middle..range.end);
    }
    let count = chosen.len();
    split(&mut chosen, points, sizes, 0..count);
    chosen
}

/// Puts the lower half of `range`, along the axis of widest spread, before the upper half.
fn halve(order: &mut [u32], centres: &[Vec3], range: Range<usize>) -> usize {
    match range.len() {
        0 | 1 => range.end,
        count => partition(order, centres, range, count / 2),
    }
}

/// Puts the `lower` lowest of `range`, along the axis of widest spread, before the others; where these
/// begin.
fn partition(order: &mut [u32], centres: &[Vec3], range: Range<usize>, lower: usize) -> usize {
    let part = &mut order[range.clone()];
    let spread = (part.iter()).fold(Aabb::EMPTY, |b, &item| {
        b.union(Aabb::around(&[centres[item as usize]]))
    });
    let axis = (spread.max - spread.min).max_position();
    part.select_nth_unstable_by(lower, |&a, &b| {
        let (x, y) = (centres[a as usize][axis], centres[b as usize][axis]);
        x.total_cmp(&y).then(a.cmp(&b))
    });
    range.start + lower
}

#[cfg(test)]
mod tests {
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
