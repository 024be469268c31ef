//! Checks of a skeleton's description, and the topological order of its joints.

use super::SkeletonError;
use glam::Vec3;

pub(super) fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), SkeletonError> {
    if expected == found {
        return Ok(());
    }
    Err(SkeletonError::Length {
        what,
        expected,
        found,
    })
}

pub(super) fn check_finite(what: &'static str, values: &[Vec3]) -> Result<(), SkeletonError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(joint) => Err(SkeletonError::NotFinite { what, joint }),
    }
}

pub(super) fn checked_parents(parents: &[i64]) -> Result<Vec<Option<usize>>, SkeletonError> {
    let joints = parents.len();
    (parents.iter().enumerate())
        .map(|(joint, &parent)| match usize::try_from(parent) {
            Ok(p) if p < joints => Ok(Some(p)),
            Err(_) if parent == -1 => Ok(None),
            _ => Err(SkeletonError::Parent {
                joint,
                parent,
                joints,
            }),
        })
        .collect()
}

pub(super) fn single_root(parents: &[Option<usize>]) -> Result<usize, SkeletonError> {
    let found = parents.iter().filter(|p| p.is_none()).count();
    match parents.iter().position(Option::is_none) {
        Some(root) if found == 1 => Ok(root),
        _ => Err(SkeletonError::Roots { found }),
    }
}

/// Orders the joints such that parents precede their children.
///
/// # Errors
/// Fails when a joint is not connected to the root.
pub(super) fn topological_order(parents: &[Option<usize>], root: usize) -> Result<Vec<usize>, SkeletonError> {
    // Sorted by parent, the children of a joint are found by bisection: a search of all joints for
    // each would take quadratic time, and hostile files may have very many.
    let mut by_parent: Vec<usize> = (0..parents.len()).collect();
    by_parent.sort_by_key(|&joint| parents[joint]);
    let mut order = vec![root];
    let mut next = 0;
    while let Some(&parent) = order.get(next) {
        let first = by_parent.partition_point(|&joint| parents[joint] < Some(parent));
        let children = by_parent[first..].iter();
        order.extend(children.take_while(|&&joint| parents[joint] == Some(parent)));
        next += 1;
    }
    // Every joint has one parent, so joints that are not reached from the root are on or behind a
    // cycle.
    let mut is_reached = vec![false; parents.len()];
    order.iter().for_each(|&joint| is_reached[joint] = true);
    match is_reached.iter().position(|is_reached| !is_reached) {
        None => Ok(order),
        Some(joint) => Err(SkeletonError::Cycle { joint }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_chains_and_wide_fans_are_ordered_quickly() {
        let count = 300_000;
        let chain: Vec<_> = (1..count).map(Some).chain([None]).collect();
        let expected: Vec<_> = (0..count).rev().collect();
        assert_eq!(topological_order(&chain, count - 1), Ok(expected));
        let fan: Vec<_> = std::iter::once(None).chain(vec![Some(0); count]).collect();
        assert_eq!(topological_order(&fan, 0), Ok((0..=count).collect()));
        let cycle: Vec<_> = std::iter::once(None).chain((1..count).map(Some)).collect();
        assert_eq!(
            topological_order(&cycle, 0),
            Err(SkeletonError::Cycle { joint: 1 })
        );
    }
}
