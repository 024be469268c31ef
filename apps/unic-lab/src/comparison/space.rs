//! Subspaces of the whole garment.

use super::{
    bones::bone_functions,
    config::{SpaceSettings, SurfaceKind},
};
use glam::Vec3;
use unic_eval::{
    Displacements, FrameIndex, PrincipalComponents, RootRelativePositions, SampleMatrix, TrainingSet, mean,
};
use unic_train::TrainError;

/// Affine subspace u = ū + Σ_k z_k φ_k with orthonormal φ_k.
///
/// A displacement is stored as all x, all y, all z, metres. A row of the basis covers either all of
/// it or a single axis. In the second case it stands for three φ_k, one for each axis.
#[derive(Clone, Debug)]
pub(super) struct Subspace {
    mean: Vec<f32>,
    basis: Vec<f32>,
    /// Length of a row of the basis.
    len: usize,
}

/// Largest number of frames from which principal components are computed, evenly spread.
const MOST_FRAMES: usize = 2000;

/// Least part of a function that the others do not span, as a share of its size. A smaller part is
/// a rounding error.
const LEAST_SHARE: f64 = 1e-4;

impl Subspace {
    /// Fits a subspace to the training clips.
    pub(super) fn fit(
        set: &TrainingSet,
        surface: SurfaceKind,
        settings: SpaceSettings,
    ) -> Result<Self, TrainError> {
        match settings {
            SpaceSettings::Components(count) => {
                let frames = set.spread_frames(MOST_FRAMES);
                let fitted = PrincipalComponents::fit(&*samples(set, surface, frames), count);
                let rows = (0..fitted.len()).flat_map(|k| by_axis(fitted.component(k)));
                Ok(Self {
                    basis: rows.collect(),
                    len: fitted.mean().len(),
                    mean: by_axis(fitted.mean()).collect(),
                })
            }
            SpaceSettings::VirtualBones(count) => {
                let frames = set.frames();
                let mean = mean(&*samples(set, surface, frames));
                Ok(Self {
                    basis: orthonormal(bone_functions(&set.garment.rest, count)?),
                    len: set.garment.rest.vertices.len(),
                    mean: by_axis(&mean).collect(),
                })
            }
        }
    }

    /// Returns the number of coefficients K.
    pub(super) fn dimensions(&self) -> usize {
        self.axes() * self.rows()
    }

    /// Returns the number of axes that a row of the basis stands for.
    fn axes(&self) -> usize {
        self.mean.len() / self.len.max(1)
    }

    /// Returns the number of rows of the basis.
    fn rows(&self) -> usize {
        self.basis.len() / self.len.max(1)
    }

    /// Returns the coefficients of the nearest displacement of the subspace, metres.
    pub(super) fn project(&self, displacements: &[Vec3]) -> Vec<f32> {
        let axis = |a: usize| displacements.iter().map(move |u| u[a]);
        let centred: Vec<f32> = (axis(0).chain(axis(1)).chain(axis(2)).zip(&self.mean))
            .map(|(u, mean)| u - mean)
            .collect();
        (centred.chunks_exact(self.len.max(1)))
            .flat_map(|part| self.basis.chunks_exact(self.len.max(1)).map(|row| dot(row, part)))
            .collect()
    }

    /// Computes the displacement of these coefficients: all x, all y, all z.
    pub(super) fn reconstruct(&self, coefficients: &[f32], out: &mut Vec<f32>) {
        out.clone_from(&self.mean);
        let parts = out.chunks_exact_mut(self.len.max(1));
        for (part, z) in parts.zip(coefficients.chunks_exact(self.rows().max(1))) {
            for (row, z) in self.basis.chunks_exact(self.len.max(1)).zip(z) {
                part.iter_mut().zip(row).for_each(|(u, phi)| *u += z * phi);
            }
        }
    }
}

/// Returns the matrix of a subspace's samples, one row for each frame.
fn samples(set: &TrainingSet, surface: SurfaceKind, frames: Vec<FrameIndex>) -> Box<dyn SampleMatrix + '_> {
    match surface {
        SurfaceKind::Displacement => Box::new(Displacements { set, frames }),
        SurfaceKind::RootRelative => Box::new(RootRelativePositions { set, frames }),
    }
}

/// Reorders x, y, z of every vertex to all x, all y, all z.
fn by_axis(interleaved: &[f32]) -> impl Iterator<Item = f32> + '_ {
    (0..3).flat_map(|axis| interleaved.iter().skip(axis).step_by(3).copied())
}

/// Returns the inner product. Partial sums for each SIMD lane avoid a chain of dependent additions.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 16;
    let mut sums = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f32 = (a.remainder().iter().zip(b.remainder()))
        .map(|(x, y)| x * y)
        .sum();
    for (a, b) in a.zip(b) {
        (sums.iter_mut().zip(a.iter().zip(b))).for_each(|(sum, (x, y))| *sum += x * y);
    }
    // A fixed order of summation: the result does not depend on the machine's vector width.
    sums.iter().sum::<f32>() + rest
}

/// Orthonormalises functions by the Gram–Schmidt process in f64. Functions in the span of those
/// before are left out.
fn orthonormal(functions: Vec<Vec<f64>>) -> Vec<f32> {
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut function in functions {
        let size = product(&function, &function).sqrt();
        // A second pass removes what rounding leaves of the first ("twice is enough").
        for _ in 0..2 {
            for row in &basis {
                let along = product(row, &function);
                function.iter_mut().zip(row).for_each(|(f, r)| *f -= along * r);
            }
        }
        let left = product(&function, &function).sqrt();
        if left > LEAST_SHARE * size {
            function.iter_mut().for_each(|f| *f /= left);
            basis.push(function);
        }
    }
    basis.iter().flatten().map(|x| *x as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_testdata::{Figure, VERTICES};

    /// Subspace of virtual bones with the mean 0.
    fn bones(count: usize) -> Subspace {
        let functions = bone_functions(&Figure::tube().garment.rest, count).unwrap();
        Subspace {
            mean: vec![0.0; 3 * VERTICES],
            basis: orthonormal(functions),
            len: VERTICES,
        }
    }

    #[test]
    fn bones_span_affine_displacements_and_no_others() {
        let space = bones(5);
        assert_eq!(space.dimensions(), 5 * 12);
        let rest = Figure::tube().garment.rest.vertices;
        let affine = |r: &Vec3| Vec3::new(0.3 * r.y - 0.1, r.x + 0.5 * r.z, 0.2 - r.y);
        let field: Vec<Vec3> = rest.iter().map(affine).collect();
        let mut again = Vec::new();
        space.reconstruct(&space.project(&field), &mut again);
        for (v, u) in field.iter().enumerate() {
            let found = Vec3::from_array([0, 1, 2].map(|axis| again[axis * VERTICES + v]));
            assert!(found.distance(*u) < 1e-5, "vertex {v}: {found} {u}");
        }
        // Displacements that alternate between vertices are not in the subspace.
        let alternating: Vec<Vec3> = (0..VERTICES)
            .map(|v| Vec3::X * (1.0 - 2.0 * (v % 2) as f32))
            .collect();
        let kept: f32 = space.project(&alternating).iter().map(|z| z * z).sum();
        assert!(kept < 0.1 * VERTICES as f32, "{kept}");
    }

    #[test]
    fn the_error_in_coefficients_is_the_error_in_vertices() {
        let space = bones(7);
        let z = |phase: f32| -> Vec<f32> {
            (0..space.dimensions())
                .map(|k| (k as f32 * 0.7 + phase).sin())
                .collect()
        };
        let (a, b) = (z(0.0), z(1.0));
        let (mut u, mut v) = (Vec::new(), Vec::new());
        space.reconstruct(&a, &mut u);
        space.reconstruct(&b, &mut v);
        let squared = |x: &[f32], y: &[f32]| -> f32 { x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum() };
        let (coefficients, vertices) = (squared(&a, &b), squared(&u, &v));
        assert!(
            (coefficients / vertices - 1.0).abs() < 1e-4,
            "{coefficients} {vertices}"
        );
    }
}
