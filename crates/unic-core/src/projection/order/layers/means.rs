//! Means over the vertices in a few cells.

use glam::{IVec3, Vec3A, Vec4};
use std::collections::HashMap;

/// Sums over the vertices of each cell.
pub(super) struct CellMeans {
    size_m: f32,
    sums: HashMap<IVec3, Sums>,
}

/// Sums of positions and their number, and of unit normals.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    positions: Vec4,
    normals: Vec3A,
}

/// Cloth around a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    /// Mean position, metres.
    pub(super) middle: Vec3A,
    /// Mean of the unit normals. It is short where the normals have no common direction.
    pub(super) normal: Vec3A,
}

impl CellMeans {
    /// Makes cells of a size in metres.
    pub(super) fn new(size_m: f32) -> Self {
        Self {
            size_m,
            sums: HashMap::new(),
        }
    }

    /// Adds a vertex.
    pub(super) fn add(&mut self, position: Vec3A, normal: Vec3A) {
        let sums = self.sums.entry(self.cell(position)).or_default();
        sums.positions += position.extend(1.0);
        sums.normals += normal;
    }

    fn cell(&self, position: Vec3A) -> IVec3 {
        (position / self.size_m).floor().as_ivec3()
    }

    /// Computes the means around the place of a vertex that was added. The cells around it have the
    /// weights of a quadratic B-spline.
    pub(super) fn around(&self, place: Vec3A) -> Around {
        let cell = self.cell(place);
        // Place in the cell, from −0.5 to 0.5.
        let within = place / self.size_m - (place / self.size_m).floor() - 0.5;
        let weights = |x: f32| [0.5 * (0.5 - x).powi(2), 0.75 - x * x, 0.5 * (0.5 + x).powi(2)];
        let weights = within.to_array().map(weights);
        let mut mean = Sums::default();
        for step in 0..27 {
            let [x, y, z] = [step % 3, step / 3 % 3, step / 9];
            let steps = IVec3::new(x as i32, y as i32, z as i32) - 1;
            if let Some(sums) = self.sums.get(&cell.saturating_add(steps)) {
                let weight = weights[0][x] * weights[1][y] * weights[2][z];
                mean.positions += sums.positions * weight;
                mean.normals += sums.normals * weight;
            }
        }
        let count = mean.positions.w;
        Around {
            middle: Vec3A::from_vec4(mean.positions) / count,
            normal: mean.normals / count,
        }
    }
}
