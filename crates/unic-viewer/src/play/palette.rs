//! Colours of cloth.

use crate::Material;

/// Colours of cloth, sRGB, with those of their prints.
pub(super) const CLOTH_COLOURS: [[[f32; 3]; 2]; 6] = [
    [[0.16, 0.25, 0.45], [0.92, 0.89, 0.82]],
    [[0.62, 0.16, 0.17], [0.95, 0.86, 0.70]],
    [[0.86, 0.83, 0.76], [0.20, 0.30, 0.42]],
    [[0.20, 0.36, 0.30], [0.86, 0.74, 0.40]],
    [[0.86, 0.60, 0.24], [0.35, 0.16, 0.12]],
    [[0.13, 0.13, 0.15], [0.78, 0.20, 0.30]],
];

/// Colours of the body, sRGB.
pub(super) const SKIN_COLOURS: [[f32; 3]; 5] = [
    Material::SKIN.colour,
    [0.68, 0.50, 0.40],
    [0.47, 0.32, 0.25],
    [0.30, 0.20, 0.16],
    [0.62, 0.64, 0.67],
];

/// Cloth of a character of a crowd: the first one's in other colours.
pub(super) fn cloth_of(character: usize, first: Material) -> Material {
    match character {
        0 => first,
        _ => {
            let [colour, accent] = CLOTH_COLOURS[character % CLOTH_COLOURS.len()];
            Material {
                colour,
                accent,
                ..first
            }
        }
    }
}
