//! New boxes for items that have moved.

use super::{Aabb, Branch, Bvh, Child, Node};
use crate::parallel::for_each;
use std::ops::Range;

/// What happened to the items of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Posed {
    /// They moved.
    Moved,
    /// They are where they were, and so are their boxes.
    Same,
    /// They are not to be found.
    Nowhere,
}

impl Bvh {
    /// Recomputes every box from those of the items.
    pub(crate) fn refit(&mut self, box_of_item: impl Fn(u32) -> Aabb + Sync) {
        let order = std::mem::take(&mut self.order);
        // Nothing is allocated for items without size.
        let mut items = vec![(); order.len()];
        let box_of = |place: usize, (): &()| box_of_item(order[place]);
        self.refit_with(&mut items, |_, _, _| Posed::Moved, box_of);
        self.order = order;
    }

    /// The items of each branch.
    pub(crate) fn branches(&self) -> impl Iterator<Item = Range<usize>> {
        self.branches.iter().map(|branch| branch.items.clone())
    }

    /// Poses the items, which are in the order of the tree, and recomputes every box, branch by branch on
    /// all threads.
    ///
    /// `pose` takes the number of a branch, the place of its first item, and its items.
    pub(crate) fn refit_with<T: Send + Sync>(
        &mut self,
        items: &mut [T],
        pose: impl Fn(usize, usize, &mut [T]) -> Posed + Sync,
        box_of: impl Fn(usize, &T) -> Aabb + Sync,
    ) {
        let parts = Branches {
            of: self.branches.iter().enumerate(),
            nodes: &mut self.nodes,
            nodes_before: 0,
            items,
        };
        for_each(parts, |(number, branch, nodes, items)| {
            let first = branch.items.start;
            match pose(number, first, items) {
                Posed::Same => {}
                Posed::Moved => {
                    let bounds = |range: Range<usize>| {
                        let items = range.clone().zip(&items[range.start - first..range.end - first]);
                        items.fold(Aabb::EMPTY, |b, (place, item)| b.union(box_of(place, item)))
                    };
                    let (first, last) = (branch.nodes.start, nodes.len());
                    (0..last).rev().for_each(|k| refit_node(nodes, first, k, bounds));
                }
                Posed::Nowhere => {
                    let root = nodes.first_mut().into_iter();
                    root.for_each(|root| root.set([Aabb::EMPTY; 4]));
                }
            }
        });
        for &index in self.above.iter().rev() {
            refit_node(&mut self.nodes, 0, index as usize, |_| Aabb::EMPTY);
        }
    }
}

/// The branches of a tree, each with its nodes and items.
struct Branches<'a, T> {
    of: std::iter::Enumerate<std::slice::Iter<'a, Branch>>,
    /// Those that are left, and how many are not.
    nodes: &'a mut [Node],
    nodes_before: usize,
    items: &'a mut [T],
}

impl<'a, T> Iterator for Branches<'a, T> {
    type Item = (usize, &'a Branch, &'a mut [Node], &'a mut [T]);

    fn next(&mut self) -> Option<Self::Item> {
        let (number, branch) = self.of.next()?;
        let after_gap = branch.nodes.start - self.nodes_before;
        let nodes = &mut std::mem::take(&mut self.nodes)[after_gap..];
        let (nodes, rest) = nodes.split_at_mut(branch.nodes.len());
        (self.nodes, self.nodes_before) = (rest, branch.nodes.end);
        let (items, rest) = std::mem::take(&mut self.items).split_at_mut(branch.items.len());
        self.items = rest;
        Some((number, branch, nodes, items))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.of.size_hint()
    }
}

impl<T> ExactSizeIterator for Branches<'_, T> {}

/// Recomputes the boxes of one of these nodes, the first of which has the number `first`.
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
