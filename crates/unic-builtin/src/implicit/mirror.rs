//! Joining a half with its mirror image.

use super::Patch;
use glam::Vec3;

/// A patch that is mirror-symmetric in x to the bit.
pub(crate) struct Mirrored {
    pub(crate) patch: Patch,
    /// Index of each vertex's mirror image; a vertex on the midplane is its own.
    pub(crate) image: Vec<u32>,
}

/// Joins a patch with its mirror image in x = 0 along the vertices on the cut `plane`.
///
/// `label` gives the panel of a panel's mirror image.
pub(crate) fn mirrored(half: &Patch, plane: usize, label: impl Fn(u8) -> u8) -> Mirrored {
    let mut patch = half.clone();
    let mut image: Vec<u32> = (0..half.vertices.len() as u32).collect();
    for (v, image) in image.iter_mut().enumerate() {
        if half.bits[v] & 1 << plane != 0 {
            // Projection onto the cut leaves x near zero.
            patch.vertices[v].x = 0.0;
        } else {
            *image = patch.vertices.len() as u32;
            patch.vertices.push(half.vertices[v] * Vec3::new(-1.0, 1.0, 1.0));
            patch.bits.push(half.bits[v]);
        }
    }
    for (face, &panel) in half.faces.iter().zip(&half.labels) {
        let [a, b, c] = face.map(|v| image[v as usize]);
        // A reflection turns triangles around: the order of corners is reversed.
        patch.faces.push([a, c, b]);
        patch.labels.push(label(panel));
    }
    // The new vertices follow in the order of their originals.
    for v in 0..half.vertices.len() {
        if image[v] as usize != v {
            image.push(v as u32);
        }
    }
    Mirrored { patch, image }
}
