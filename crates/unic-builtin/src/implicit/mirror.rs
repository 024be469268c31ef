//! Doubling a half.

use super::Patch;
use glam::Vec3;

/// The patch and its mirror image in x = 0, joined where vertices carry the bit of the cut `plane`:
/// symmetric to the bit. `label` renames a panel's mirror image.
///
/// Also gives for each vertex its mirror image.
pub(crate) fn mirrored(half: &Patch, plane: usize, label: impl Fn(u8) -> u8) -> (Patch, Vec<u32>) {
    let mut whole = half.clone();
    let mut image: Vec<u32> = (0..half.vertices.len() as u32).collect();
    for (v, image) in image.iter_mut().enumerate() {
        if half.bits[v] & 1 << plane != 0 {
            whole.vertices[v].x = 0.0;
        } else {
            *image = whole.vertices.len() as u32;
            whole.vertices.push(half.vertices[v] * Vec3::new(-1.0, 1.0, 1.0));
            whole.bits.push(half.bits[v]);
        }
    }
    for (face, &panel) in half.faces.iter().zip(&half.labels) {
        let [a, b, c] = face.map(|v| image[v as usize]);
        whole.faces.push([a, c, b]);
        whole.labels.push(label(panel));
    }
    for v in 0..half.vertices.len() {
        if image[v] as usize != v {
            image.push(v as u32);
        }
    }
    (whole, image)
}
