//! Polygons of a mesh.

use crate::error::{Error, Result};

/// Polygons, counter-clockwise seen from outside.
///
/// Files hold them clockwise; this crate turns them round when it reads and writes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faces {
    counts: Vec<u32>,
    corners: Vec<u32>,
}

impl Faces {
    /// Makes faces of the number of corners of each, and the vertex of each corner.
    ///
    /// # Errors
    /// The counts do not add up to the number of corners.
    pub fn new(counts: Vec<u32>, corners: Vec<u32>) -> Result<Self> {
        let sum: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        if sum != corners.len() as u64 {
            return Err(Error::argument("corners", sum.to_string(), corners.len()));
        }
        Ok(Self { counts, corners })
    }

    /// Makes triangles.
    pub fn triangles(triangles: &[[u32; 3]]) -> Self {
        Self {
            counts: vec![3; triangles.len()],
            corners: triangles.as_flattened().to_vec(),
        }
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.counts.len()
    }

    /// Whether there are no faces.
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Number of corners of each face.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Vertex of each corner, face after face.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Vertices of each face.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let mut rest = self.corners.as_slice();
        self.counts.iter().map_while(move |&count| {
            let (face, others) = rest.split_at_checked(count as usize)?;
            rest = others;
            Some(face)
        })
    }

    /// Largest vertex of any corner; none without corners.
    pub(crate) fn largest_vertex(&self) -> Option<u32> {
        self.corners.iter().copied().max()
    }
}

/// Turns round the values of each face's corners.
///
/// `counts` are the numbers of corners. Values behind the last face stay as they are.
pub(crate) fn reverse_corners<T>(counts: &[u32], values: &mut [T]) {
    let mut rest = values;
    for &count in counts {
        let Some((face, others)) = rest.split_at_mut_checked(count as usize) else {
            return;
        };
        face.reverse();
        rest = others;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_several_sizes_are_turned_round() {
        let faces = Faces::new(vec![3, 0, 4], vec![0, 1, 2, 3, 2, 1, 0]).unwrap();
        let sizes: Vec<usize> = faces.iter().map(<[u32]>::len).collect();
        assert_eq!(sizes, [3, 0, 4]);
        let mut corners = faces.corners().to_vec();
        reverse_corners(faces.counts(), &mut corners);
        assert_eq!(corners, [2, 1, 0, 0, 1, 2, 3]);
        assert!(Faces::new(vec![3], vec![0, 1]).is_err());
        assert_eq!(
            Faces::triangles(&[[0, 1, 2]]).iter().collect::<Vec<_>>(),
            [[0, 1, 2]]
        );
    }
}
