//! Hinges: edges with the triangles on their two sides.

/// Lists the hinges of a mesh, sorted: the edge's two ends, then the third corners of its two
/// triangles, both lower first.
///
/// An edge of n triangles makes n − 1 hinges, each between neighbours in the order of the third
/// corners. A seam where three panels meet is held together this way. A hinge for every pair of
/// triangles would make such seams too stiff.
pub(super) fn hinges(faces: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let mut sides: Vec<[u32; 3]> = (faces.iter())
        .flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]])
        .map(|[a, b, third]| [a.min(b), a.max(b), third])
        .collect();
    sides.sort_unstable();
    sides.dedup();
    (sides.windows(2))
        .filter(|pair| pair[0][..2] == pair[1][..2])
        .map(|pair| [pair[0][0], pair[0][1], pair[0][2], pair[1][2]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::hinges;

    #[test]
    fn edges_of_two_triangles_have_one_hinge_boundary_edges_none_and_others_a_chain() {
        assert_eq!(hinges(&[[0, 1, 2], [2, 1, 3]]), [[1, 2, 0, 3]]);
        assert_eq!(
            hinges(&[[0, 1, 2], [0, 1, 3], [1, 0, 4]]),
            [[0, 1, 2, 3], [0, 1, 3, 4]]
        );
        // A duplicated face makes no hinge.
        assert!(hinges(&[[0, 1, 2], [2, 0, 1]]).is_empty());
    }
}
