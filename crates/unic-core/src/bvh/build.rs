//! Orders of items in which neighbours in space are neighbours in memory.

use super::{Aabb, Branch, Bvh, Child, Link, Node};
use glam::Vec3;
use std::ops::Range;

/// Most items in one leaf, as [`Link`] has it. With four, a leaf of triangles costs about as much as a node.
pub(super) const LEAF_ITEMS: usize = 4;

/// Most items in a branch, which one thread refits at a time.
const BRANCH_ITEMS: usize = 256;

impl Bvh {
    /// Splits the items at medians of their centres; [`Bvh::refit`] must follow.
    pub(crate) fn build(centres: &[Vec3]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            branches: Vec::new(),
            above: Vec::new(),
            marks: Vec::new(),
            order: (0..centres.len() as u32).collect(),
        };
        if !centres.is_empty() {
            tree.split(centres, 0..centres.len());
        }
        if (1..=BRANCH_ITEMS).contains(&centres.len()) {
            tree.branches.push(Branch {
                nodes: 0..tree.nodes.len(),
                items: 0..centres.len(),
            });
        }
        let mut is_above = vec![true; tree.nodes.len()];
        (tree.branches.iter()).for_each(|branch| is_above[branch.nodes.clone()].fill(false));
        let above = (0..tree.nodes.len() as u32).filter(|&node| is_above[node as usize]);
        tree.above = above.collect();
        tree
    }

    fn split(&mut self, centres: &[Vec3], range: Range<usize>) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        // Full subtrees: half-full leaves would double the nodes.
        let unit = largest_subtree(range.len());
        let middle = halve(&mut self.order, centres, range.clone(), unit);
        let (left, right) = (range.start..middle, middle..range.end);
        let quarter = halve(&mut self.order, centres, left.clone(), unit);
        let three_quarters = halve(&mut self.order, centres, right.clone(), unit);
        let quarters = [
            left.start..quarter,
            quarter..left.end,
            right.start..three_quarters,
            three_quarters..right.end,
        ];
        self.nodes[index].children = quarters.map(|part| {
            Link::to(match part.len() {
                0 => Child::Empty,
                // What is left over beside full branches is a branch too: refits pass by other items.
                count @ 1..=LEAF_ITEMS if range.len() <= BRANCH_ITEMS => Child::Leaf {
                    first: part.start as u32,
                    count: count as u32,
                },
                count => {
                    let items = part.clone();
                    let child = self.split(centres, part);
                    if count <= BRANCH_ITEMS && range.len() > BRANCH_ITEMS {
                        let nodes = child as usize..self.nodes.len();
                        self.branches.push(Branch { nodes, items });
                    }
                    Child::Node(child)
                }
            })
        });
        index as u32
    }
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

/// Items that each child of a node over so many holds when it is full.
fn largest_subtree(count: usize) -> usize {
    let mut unit = LEAF_ITEMS;
    while 4 * unit < count {
        unit *= 4;
    }
    unit
}

/// Puts about the lower half of `range`, whole units along the axis of widest spread, before the others.
fn halve(order: &mut [u32], centres: &[Vec3], range: Range<usize>, unit: usize) -> usize {
    match (range.len() / 2).next_multiple_of(unit) {
        lower if lower < range.len() => partition(order, centres, range, lower),
        _ => range.end,
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
