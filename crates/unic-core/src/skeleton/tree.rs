//! Checks of a description, and the order of its joints.

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

/// Parents before children, whatever the order in the file.
pub(super) fn topological_order(parents: &[Option<usize>], root: usize) -> Result<Vec<usize>, SkeletonError> {
    let mut order = vec![root];
    let mut next = 0;
    while let Some(&parent) = order.get(next) {
        order.extend((0..parents.len()).filter(|&j| parents[j] == Some(parent)));
        next += 1;
    }
    match (0..parents.len()).find(|j| order.len() < parents.len() && !order.contains(j)) {
        None => Ok(order),
        Some(joint) => Err(SkeletonError::Cycle { joint }),
    }
}
