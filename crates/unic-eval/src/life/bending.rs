//! Bending of a garment beside the truth's.

use super::{cloth::Cloth, sums::LEAST_BENDING, welded::WeldedMesh};
use glam::Vec3;
use unic_core::mesh::TriMesh;

/// RMS bending of predictions divided by that of the truth, over frames: `bending_ratio` of the
/// [metrics](crate::Metrics).
#[derive(Clone, Debug)]
pub struct BendingRatio {
    cloth: Cloth,
    /// Sums over frames of the mean squared bending, rad²: of predictions, and of the truth.
    squared: [f64; 2],
    frames: usize,
}

impl BendingRatio {
    /// Starts without frames, given the rest mesh of the garment.
    pub fn new(rest: &TriMesh) -> Self {
        Self {
            cloth: Cloth::new(rest, &WeldedMesh::new(rest)),
            squared: [0.0; 2],
            frames: 0,
        }
    }

    /// Adds a frame, given the positions of all garment vertices, metres.
    pub fn add(&mut self, predicted: &[Vec3], truth: &[Vec3]) {
        for (sum, positions) in self.squared.iter_mut().zip([predicted, truth]) {
            *sum += self.cloth.squared_bending(positions);
        }
        self.frames += 1;
    }

    /// Returns the ratio; none where the truth does not bend.
    pub fn ratio(&self) -> Option<f64> {
        ratio(self.squared, self.frames)
    }

    /// Returns the ratio over the frames of several measurements of a garment; none where the truth does
    /// not bend.
    pub fn over<'a>(several: impl IntoIterator<Item = &'a Self>) -> Option<f64> {
        let (mut squared, mut frames) = ([0.0; 2], 0);
        for one in several {
            for (sum, squared) in squared.iter_mut().zip(one.squared) {
                *sum += squared;
            }
            frames += one.frames;
        }
        ratio(squared, frames)
    }
}

/// Ratio of the bending of predictions to that of the truth, given sums over frames of the mean squared
/// bending of both.
fn ratio([predicted, truth]: [f64; 2], frames: usize) -> Option<f64> {
    let least = frames as f64 * LEAST_BENDING * LEAST_BENDING;
    (truth > least).then(|| (predicted / truth).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratio_is_that_of_the_angles_and_none_for_a_truth_at_rest() {
        let rest = TriMesh {
            vertices: vec![
                Vec3::ZERO,
                Vec3::X,
                Vec3::new(0.5, 1.0, 0.0),
                Vec3::new(0.5, -1.0, 0.0),
            ],
            faces: vec![[0, 1, 2], [1, 0, 3]],
            uvs: None,
        };
        let bent = |angle: f32| {
            let mut positions = rest.vertices.clone();
            positions[3] = Vec3::new(0.5, -angle.cos(), angle.sin());
            positions
        };
        let mut bending = BendingRatio::new(&rest);
        bending.add(&bent(0.2), &rest.vertices);
        assert_eq!(bending.ratio(), None);
        let mut bending = BendingRatio::new(&rest);
        bending.add(&bent(0.3), &bent(-0.6));
        assert!((bending.ratio().unwrap() - 0.5).abs() < 1e-5, "{bending:?}");
        let mut other = BendingRatio::new(&rest);
        other.add(&bent(0.3), &bent(0.6));
        other.add(&bent(0.1), &bent(0.2));
        let all = BendingRatio::over([&bending, &other]).unwrap();
        assert!((all - (0.19_f64 / 0.76).sqrt()).abs() < 1e-5, "{all}");
        assert_eq!(BendingRatio::over([]), None);
    }
}
