//! Edges with the triangles on their two sides.

/// For each pair of triangles that share an edge: the edge's ends, lower first, and the third
/// corners, lower first; sorted. An edge of n triangles has n − 1 pairs: each with the next by
/// third corner, so that a seam where three panels meet is held together and nothing is counted
/// for every pair.
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
    fn manifold_edges_have_one_hinge_rims_none_and_others_a_chain() {
        assert_eq!(hinges(&[[0, 1, 2], [2, 1, 3]]), [[1, 2, 0, 3]]);
        assert_eq!(
            hinges(&[[0, 1, 2], [0, 1, 3], [1, 0, 4]]),
            [[0, 1, 2, 3], [0, 1, 3, 4]]
        );
        // A face given twice bends with nothing.
        assert!(hinges(&[[0, 1, 2], [2, 0, 1]]).is_empty());
    }
}
