//! Shapes of the wrinkles that predictions lack.

use super::residuals::{Residuals, spread};
use crate::error::TrainError;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use unic_core::character::Garment;
use unic_eval::{PrincipalComponents, SampleMatrix, WrinkleFilter};

/// Wavelength below which wrinkles are replayed, metres. Coarser shapes cost much accuracy, since
/// they are larger.
const WAVELENGTH_M: f64 = 0.24;

/// Largest number of frames that the shapes are computed from.
const MOST_SAMPLES: usize = 2000;

/// Largest number of heights that the shapes are computed from, which bounds memory.
const MOST_HEIGHTS: usize = 1 << 26;

/// Largest number of vectors in all shapes together. A frame reads them all, and the file holds
/// them.
const MOST_VECTORS: usize = 1 << 18;

/// Number of shapes that even the largest garments may have.
const LEAST_SHAPES: usize = 16;

/// Number of frames whose wrinkles are filtered at once, which bounds memory.
pub(super) const ROWS: usize = 32;

/// Principal components of the wrinkles that predictions lack.
pub(super) struct WrinkleShapes {
    /// Filter from displacements to wrinkles.
    pub(super) filter: WrinkleFilter,
    /// Components of the wrinkles at V vertices, metres.
    components: PrincipalComponents,
    /// Coefficients of the components' mean, R numbers in metres.
    mean: Vec<f64>,
}

/// Wrinkles of sampled frames: pieces of [`ROWS`] frames × V, but for the last.
struct Samples {
    vertices: usize,
    pieces: Vec<Vec<f32>>,
}

impl SampleMatrix for Samples {
    fn rows(&self) -> usize {
        self.pieces.iter().map(Vec::len).sum::<usize>() / self.vertices.max(1)
    }

    fn columns(&self) -> usize {
        self.vertices
    }

    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
        let piece = &self.pieces[row / ROWS];
        out.copy_from_slice(&piece[row % ROWS * self.vertices..][columns]);
    }
}

/// Makes the filter of a garment's wrinkles.
///
/// # Errors
/// A rest mesh whose smoothing cannot be factorised.
pub(crate) fn wrinkle_filter(garment: &Garment) -> Result<WrinkleFilter, TrainError> {
    WrinkleFilter::new(garment, WAVELENGTH_M).map_err(TrainError::Wrinkles)
}

impl WrinkleShapes {
    /// Computes `count` shapes, or fewer for a large garment.
    pub(super) fn fit(filter: WrinkleFilter, residuals: Residuals, count: usize) -> Self {
        let vertices = residuals.garment.rest.vertices.len();
        let most = MOST_SAMPLES.min(MOST_HEIGHTS / vertices.max(1));
        let spread = spread(&residuals.lengths(), most, 1).into_iter();
        let frames: Vec<(usize, usize)> = spread
            .flat_map(|(sequence, frames)| frames.into_iter().map(move |t| (sequence, t)))
            .collect();
        let wrinkles = |piece: &[(usize, usize)]| {
            let residual = |(sequence, t): &(usize, usize)| residuals.frame(*sequence, *t).residual;
            filter.wrinkles(&piece.iter().map(residual).collect::<Vec<_>>())
        };
        let samples = Samples {
            vertices,
            pieces: frames.par_chunks(ROWS).map(wrinkles).collect(),
        };
        let most = (MOST_VECTORS / vertices.max(1)).max(LEAST_SHAPES);
        let components = PrincipalComponents::fit(&samples, count.min(most));
        let mean = components.project(&vec![0.0; vertices]).into_iter().map(|c| -c);
        Self {
            mean: mean.collect(),
            filter,
            components,
        }
    }

    /// Number R of shapes.
    pub(super) fn len(&self) -> usize {
        self.components.len()
    }

    /// Coefficients of the wrinkles that a prediction lacks: frames × R, metres.
    pub(super) fn coefficients(
        &self,
        residuals: Residuals,
        sequence: usize,
        frames: Range<usize>,
    ) -> Vec<f32> {
        let starts: Vec<usize> = frames.clone().step_by(ROWS).collect();
        let piece = |start: usize| {
            let piece = start..(start + ROWS).min(frames.end);
            let lacking: Vec<_> = piece.map(|t| residuals.frame(sequence, t).residual).collect();
            self.projected(&self.filter.wrinkles(&lacking))
        };
        let pieces: Vec<Vec<f32>> = starts.into_par_iter().map(piece).collect();
        pieces.concat()
    }

    /// Coefficients of heights, frames × V: frames × R.
    pub(super) fn projected(&self, heights: &[f32]) -> Vec<f32> {
        // Those about the components' mean, plus those of the mean.
        let about = self.components.project_rows(heights).into_iter();
        about
            .zip(self.mean.iter().cycle())
            .map(|(c, m)| (c + m) as f32)
            .collect()
    }

    /// The shapes along the normals of the smoothed rest shape: V × R vectors, those of a vertex
    /// adjacent.
    pub(super) fn vectors(&self) -> Vec<Vec3> {
        let normals = self.filter.normals().iter().enumerate();
        normals
            .flat_map(|(v, n)| (0..self.len()).map(move |k| *n * self.components.component(k)[v]))
            .collect()
    }
}
