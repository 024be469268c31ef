//! Nearest-neighbour search in a set of points.
//!
//! For simulation, metrics and tools.

use crate::{
    aabb_tree::AabbTree,
    bounds::{Aabb, squared_length},
};
use glam::Vec3;

/// Nearest-neighbour search over a set of points. Among points at the same distance, the lowest
/// index is the answer.
///
/// The tree is built once; [`ClosestVertex::refit`] follows points that move, without allocating.
///
/// ```
/// use glam::Vec3;
/// use unic_core::closest::ClosestVertex;
///
/// let mut tree = ClosestVertex::build(&[Vec3::ZERO, Vec3::X, Vec3::X]);
/// assert_eq!(tree.nearest(Vec3::X * 3.0), Some((1, 2.0)));
/// tree.refit(&[Vec3::X * 4.0, Vec3::X, Vec3::X]);
/// assert_eq!(tree.nearest(Vec3::X * 3.0), Some((0, 1.0)));
/// ```
#[derive(Clone, Debug)]
pub struct ClosestVertex {
    tree: AabbTree,
    points: Vec<Vec3>,
}

impl ClosestVertex {
    /// Builds the tree. Points that are not finite are never the answer. Any number of points may
    /// be identical.
    pub fn build(points: &[Vec3]) -> Self {
        let mut closest = Self {
            tree: AabbTree::build(points),
            points: points.to_vec(),
        };
        closest.refit(points);
        closest
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Moves the points. Answers stay exact however far they go; queries stay fast while
    /// neighbours stay neighbours, as the vertices of a posed mesh do.
    ///
    /// # Panics
    /// When the number of points is not [`Self::len`].
    pub fn refit(&mut self, points: &[Vec3]) {
        assert_eq!(points.len(), self.len(), "points to refit");
        self.points.copy_from_slice(points);
        self.tree.refit(|i| Aabb::around(&[points[i as usize]]));
    }

    /// Returns the index of the nearest point and its distance in metres. None when there are no
    /// finite points or `p` is not finite.
    pub fn nearest(&self, p: Vec3) -> Option<(usize, f32)> {
        if !p.is_finite() {
            return None;
        }
        let mut best = (f32::INFINITY, u32::MAX);
        self.tree.visit_nearest(p, best.0, |indices, _| {
            for &index in indices {
                let found = (squared_length(self.points[index as usize] - p), index);
                // NaN compares as neither less nor equal.
                if found.0 < best.0 || (found.0 == best.0 && found.1 < best.1) {
                    best = found;
                }
            }
            best.0
        });
        // Squared distances are compared; one square root is taken at the end.
        best.0.is_finite().then(|| (best.1 as usize, best.0.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    fn brute_force_nearest(points: &[Vec3], p: Vec3) -> Option<(usize, f32)> {
        (points.iter().enumerate())
            .map(|(i, &x)| (i, (x - p).length_squared()))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
            .map(|(i, squared)| (i, squared.sqrt()))
    }

    proptest! {
        #[test]
        fn nearest_agrees_with_brute_force(
            points in vec(point(2.0), 1..300), moved in vec(point(2.0), 300), p in point(3.0),
        ) {
            let mut tree = ClosestVertex::build(&points);
            prop_assert_eq!(tree.nearest(p), brute_force_nearest(&points, p));
            let moved = &moved[..points.len()];
            tree.refit(moved);
            prop_assert_eq!(tree.nearest(p), brute_force_nearest(moved, p));
        }

        #[test]
        fn ties_go_to_the_lowest_index(
            cells in vec((0i8..4, 0i8..4, 0i8..4), 1..400), q in (0i8..8, 0i8..8, 0i8..8),
        ) {
            // In a coarse grid several points share most distances.
            let grid = |(x, y, z): (i8, i8, i8)| Vec3::new(x.into(), y.into(), z.into());
            let points: Vec<Vec3> = cells.into_iter().map(grid).collect();
            let tree = ClosestVertex::build(&points);
            prop_assert_eq!(tree.nearest(grid(q) / 2.0), brute_force_nearest(&points, grid(q) / 2.0));
        }
    }

    #[test]
    fn identical_points_are_allowed() {
        let tree = ClosestVertex::build(&[Vec3::ONE; 10_000]);
        assert_eq!(tree.nearest(Vec3::ZERO), Some((0, 3f32.sqrt())));
    }

    #[test]
    fn points_that_are_not_finite_neither_find_nor_are_found() {
        assert_eq!(ClosestVertex::build(&[]).nearest(Vec3::ZERO), None);
        let tree = ClosestVertex::build(&[Vec3::NAN, Vec3::INFINITY, Vec3::X, Vec3::Y]);
        assert_eq!(tree.nearest(Vec3::Y * 2.0), Some((3, 1.0)));
        assert_eq!(tree.nearest(Vec3::new(0.0, f32::NAN, 0.0)), None);
        assert_eq!(ClosestVertex::build(&[Vec3::NAN]).nearest(Vec3::ZERO), None);
    }
}
