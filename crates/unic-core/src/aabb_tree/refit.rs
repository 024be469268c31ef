//! Refit: new boxes for items that have moved.

use super::{AabbTree, Branch, Child, Node};
use crate::{bounds::Aabb, parallel::for_each};
use std::ops::Range;

/// Action of a refit on a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BranchUpdate {
    /// Recomputes the boxes: items moved.
    Moved,
    /// Keeps the boxes: no item moved.
    Unchanged,
    /// Empties the root's boxes: searches find no item of the branch.
    Excluded,
}

impl AabbTree {
    /// Recomputes every box from those of the items.
    pub(crate) fn refit(&mut self, box_of_item: impl Fn(u32) -> Aabb + Sync) {
        let order = std::mem::take(&mut self.order);
        // A vector of zero-sized items does not allocate.
        let mut items = vec![(); order.len()];
        let box_of = |place: usize, (): &()| box_of_item(order[place]);
        self.refit_branches(&mut items, |_, _, _| BranchUpdate::Moved, box_of);
        self.order = order;
    }

    /// Places in the tree's order of the items of each branch.
    pub(crate) fn branches(&self) -> impl Iterator<Item = Range<usize>> {
        self.branches.iter().map(|branch| branch.items.clone())
    }

    /// Updates the items, which are in the order of the tree, and recomputes the boxes, branch by
    /// branch on all threads.
    ///
    /// `update` takes the number of a branch, the place of its first item, and its items. `box_of`
    /// takes the place of an item and the item.
    pub(crate) fn refit_branches<T: Send + Sync>(
        &mut self,
        items: &mut [T],
        update: impl Fn(usize, usize, &mut [T]) -> BranchUpdate + Sync,
        box_of: impl Fn(usize, &T) -> Aabb + Sync,
    ) {
        let parts = Branches {
            branches: self.branches.iter().enumerate(),
            nodes: &mut self.nodes,
            nodes_before: 0,
            items,
        };
        for_each(parts, |(number, branch, nodes, items)| {
            let first = branch.items.start;
            match update(number, first, items) {
                BranchUpdate::Unchanged => {}
                BranchUpdate::Moved => {
                    let bounds = |range: Range<usize>| {
                        let items = range.clone().zip(&items[range.start - first..range.end - first]);
                        items.fold(Aabb::EMPTY, |b, (place, item)| b.union(box_of(place, item)))
                    };
                    let (first, last) = (branch.nodes.start, nodes.len());
                    (0..last).rev().for_each(|k| refit_node(nodes, first, k, bounds));
                }
                BranchUpdate::Excluded => {
                    // Boxes further down keep old values, which no search reaches.
                    let root = nodes.first_mut().into_iter();
                    root.for_each(|root| root.set([Aabb::EMPTY; 4]));
                }
            }
        });
        // Branches hold all items, so the nodes above them have no leaves.
        for &index in self.top_nodes.iter().rev() {
            refit_node(&mut self.nodes, 0, index as usize, |_| Aabb::EMPTY);
        }
    }
}

/// Iterator over the branches of a tree with mutable slices of their nodes and items.
struct Branches<'a, T> {
    branches: std::iter::Enumerate<std::slice::Iter<'a, Branch>>,
    /// Nodes after those that were handed out.
    nodes: &'a mut [Node],
    /// Number of nodes before `nodes`.
    nodes_before: usize,
    /// Items after those that were handed out.
    items: &'a mut [T],
}

impl<'a, T> Iterator for Branches<'a, T> {
    type Item = (usize, &'a Branch, &'a mut [Node], &'a mut [T]);

    fn next(&mut self) -> Option<Self::Item> {
        let (number, branch) = self.branches.next()?;
        // Nodes above the branches lie between them.
        let after_gap = branch.nodes.start - self.nodes_before;
        let nodes = &mut std::mem::take(&mut self.nodes)[after_gap..];
        let (nodes, rest) = nodes.split_at_mut(branch.nodes.len());
        (self.nodes, self.nodes_before) = (rest, branch.nodes.end);
        let (items, rest) = std::mem::take(&mut self.items).split_at_mut(branch.items.len());
        self.items = rest;
        Some((number, branch, nodes, items))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.branches.size_hint()
    }
}

impl<T> ExactSizeIterator for Branches<'_, T> {}

/// Recomputes the boxes of `nodes[k]`; `nodes[0]` has the number `first` in the tree.
#[inline(always)]
fn refit_node(nodes: &mut [Node], first: usize, k: usize, bounds: impl Fn(Range<usize>) -> Aabb) {
    let of_child = |child: usize| match nodes[k].children[child].child() {
        Child::Empty => Aabb::EMPTY,
        Child::Node(child) => nodes[child as usize - first].bounds(),
        Child::Leaf { first, count } => bounds(first as usize..(first + count) as usize),
    };
    let boxes = [of_child(0), of_child(1), of_child(2), of_child(3)];
    nodes[k].set(boxes);
}
