//! Smoothing of a garment's shape by a wavelength.

use super::welded::WeldedMesh;
use crate::error::{Error, Result};
use faer::{
    Mat, Side,
    prelude::Solve,
    sparse::{SparseColMat, Triplet, linalg::solvers::Llt},
};
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;
use unic_core::diffusion::Diffusion;

/// Smoothing S_λ of numbers at the N vertices of a welded rest mesh, factorised.
///
/// It solves (M + τL) y = M x with the lumped areas M and the cotangent Laplacian L of the rest mesh,
/// and τ = (λ / 2π)². It multiplies a wave of wavelength ℓ by 1 / (1 + (λ / ℓ)²).
pub(super) struct Smoothing {
    /// Lumped rest area of each vertex, m².
    masses: Vec<f64>,
    /// Factorised matrix M + τL.
    matrix: Llt<usize, f64>,
}

impl Smoothing {
    /// Factorises the smoothing that halves a wave of so many metres.
    ///
    /// # Errors
    /// A rest mesh whose matrix cannot be factorised, such as one with areas of 1e-300 m².
    pub(super) fn new(mesh: &WeldedMesh, wavelength_m: f64) -> Result<Self> {
        let rest = &mesh.rest;
        let diffusion = Diffusion::new(&rest.vertices, &rest.faces, (wavelength_m / TAU).powi(2));
        let matrix = factorised(&diffusion).ok_or(Error::Smoothing {
            vertices: rest.vertices.len(),
        })?;
        Ok(Self {
            masses: diffusion.masses().to_vec(),
            matrix,
        })
    }

    /// Lumped rest area of each vertex, m².
    pub(super) fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Returns the smoothed columns of an N × C matrix.
    pub(super) fn smooth(&self, x: &Mat<f64>) -> Mat<f64> {
        let right = Mat::from_fn(x.nrows(), x.ncols(), |i, column| self.masses[i] * x[(i, column)]);
        self.matrix.solve(right)
    }

    /// Returns N smoothed positions, metres.
    pub(super) fn smoothed(&self, positions: &[Vec3]) -> Vec<Vec3> {
        let rough = Mat::from_fn(positions.len(), 3, |i, axis| f64::from(positions[i][axis]));
        let smooth = self.smooth(&rough);
        let row = |i| DVec3::new(smooth[(i, 0)], smooth[(i, 1)], smooth[(i, 2)]);
        (0..positions.len()).map(|i| row(i).as_vec3()).collect()
    }
}

/// Returns the Cholesky factors of a smoothing's matrix. `None` stands for one that is not positive
/// definite.
fn factorised(diffusion: &Diffusion) -> Option<Llt<usize, f64>> {
    let count = diffusion.masses().len();
    let entries: Vec<_> = diffusion
        .lower_entries()
        .map(|(row, column, value)| Triplet::new(row, column, value))
        .collect();
    let matrix = SparseColMat::try_new_from_triplets(count, count, &entries).ok()?;
    matrix.sp_cholesky(Side::Lower).ok()
}
