//! A rod of two joints as files of other programs: centimetres, Z up, below a node that turns.
//!
//! The rod is a box, 20 cm wide and deep and 100 cm tall. Its lower corners follow `hips` at the
//! bottom, its upper corners `chest` at half of the height. In a second `hips` moves by 100 cm along
//! the file's Y, which is −Z in metres, Y up, and `chest` bends about X by one radian.

mod fbx;
mod usd;

pub use fbx::{FbxNode, FbxValue, fbx_binary, fbx_text, rod_fbx};
pub use usd::{ROD_USDA, rod_garment_usda};

/// Corners of the box in centimetres, Z up.
const CORNERS: [[f64; 3]; 8] = [
    [-10.0, -10.0, 0.0],
    [10.0, -10.0, 0.0],
    [10.0, 10.0, 0.0],
    [-10.0, 10.0, 0.0],
    [-10.0, -10.0, 100.0],
    [10.0, -10.0, 100.0],
    [10.0, 10.0, 100.0],
    [-10.0, 10.0, 100.0],
];

/// Sides of the box.
const SIDES: [[i32; 4]; 6] = [
    [0, 3, 2, 1],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];
