//! Construction of the tree: items that are neighbours in space become neighbours in memory.

use super::{AabbTree, Branch, Child, Link, Node};
use crate::bounds::Aabb;
use glam::Vec3;
use std::ops::Range;

/// Largest number of items in a leaf; [`Link`] has two bits for it. A leaf of four triangles costs
/// a search about as much as a node.
pub(super) const LEAF_ITEMS: usize = 4;

/// Largest number of items in a branch, the unit of work of one thread in a refit.
const BRANCH_ITEMS: usize = 256;

impl AabbTree {
    /// Builds the topology by splitting the items at medians of their centres.
    ///
    /// Boxes are empty until [`AabbTree::refit`] or [`AabbTree::refit_branches`].
    pub(crate) fn build(centres: &[Vec3]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            branches: Vec::new(),
            top_nodes: Vec::new(),
            groups: Vec::new(),
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
        let mut is_top = vec![true; tree.nodes.len()];
        (tree.branches.iter()).for_each(|branch| is_top[branch.nodes.clone()].fill(false));
        let top_nodes = (0..tree.nodes.len() as u32).filter(|&node| is_top[node as usize]);
        tree.top_nodes = top_nodes.collect();
        tree
    }

    /// Appends the subtree over a range of the order, and returns the number of its root.
    fn split(&mut self, centres: &[Vec3], range: Range<usize>) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        // Splitting at multiples of a full subtree fills the leaves: half-full ones would double
        // the number of nodes.
        let unit = full_child_items(range.len());
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
                // A few items beside full branches become a branch too, instead of a leaf above the
                // branches: a refit updates items branch by branch.
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

/// Orders points such that every block of the order is a cluster in space, for each of the
/// ascending block `sizes`.
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

/// Capacity of each child of a node over `count` items: the smallest full subtree of which four
/// hold them.
fn full_child_items(count: usize) -> usize {
    let mut unit = LEAF_ITEMS;
    while 4 * unit < count {
        unit *= 4;
    }
    unit
}

/// Partitions `range` in halves along its longest axis, the first of whole units, and returns the
/// start of the second.
fn halve(order: &mut [u32], centres: &[Vec3], range: Range<usize>, unit: usize) -> usize {
    match (range.len() / 2).next_multiple_of(unit) {
        lower if lower < range.len() => partition(order, centres, range, lower),
        _ => range.end,
    }
}

/// Puts the `lower` lowest of `range` along its longest axis before the others, and returns where
/// the others begin.
fn partition(order: &mut [u32], centres: &[Vec3], range: Range<usize>, lower: usize) -> usize {
    let part = &mut order[range.clone()];
    let spread = (part.iter()).fold(Aabb::EMPTY, |b, &item| {
        b.union(Aabb::around(&[centres[item as usize]]))
    });
    let axis = (spread.max - spread.min).max_position();
    // Ties are broken by number, so that the order does not depend on the selection's algorithm; a
    // total order keeps centres that are NaN from panicking.
    part.select_nth_unstable_by(lower, |&a, &b| {
        let (x, y) = (centres[a as usize][axis], centres[b as usize][axis]);
        x.total_cmp(&y).then(a.cmp(&b))
    });
    range.start + lower
}
