//! Shapes of the wrinkles that predictions lack.

use super::residuals::Residuals;
use crate::error::TrainError;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
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
const ROWS: usize = 32;

/// Principal components of the wrinkles that predictions lack.
pub(super) struct WrinkleShapes {
    pub(super) filter: WrinkleFilter,
    /// Components of the wrinkles at V vertices, metres.
    pub(super) components: PrincipalComponents,
}

/// Wrinkles of sampled frames, frames × V.
struct Samples {
    vertices: usize,
    wrinkles: Vec<f32>,
}

impl SampleMatrix for Samples {
    fn rows(&self) -> usize {
        self.wrinkles.len() / self.vertices.max(1)
    }

    fn columns(&self) -> usize {
        self.vertices
    }

    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
        out.copy_from_slice(&self.wrinkles[row * self.vertices..][columns]);
    }
}

impl WrinkleShapes {
    /// Computes `count` shapes, or fewer for a large garment.
    ///
    /// # Errors
    /// A rest mesh whose smoothing cannot be factorised.
    pub(super) fn fit(residuals: Residuals, count: usize) -> Result<Self, TrainError> {
        let vertices = residuals.garment.rest.vertices.len();
        let filter = WrinkleFilter::new(residuals.garment, WAVELENGTH_M)?;
        let frames = residuals.spread(MOST_SAMPLES.min(MOST_HEIGHTS / vertices.max(1)));
        let pieces: Vec<(usize, &[usize])> = (frames.iter().enumerate())
            .flat_map(|(sequence, frames)| frames.chunks(ROWS).map(move |piece| (sequence, piece)))
            .collect();
        let wrinkles: Vec<Vec<f32>> = (pieces.into_par_iter())
            .map(|(sequence, piece)| residuals.wrinkles(&filter, sequence, piece.iter().copied()))
            .collect();
        let samples = Samples {
            vertices,
            wrinkles: wrinkles.concat(),
        };
        let most = (MOST_VECTORS / vertices.max(1)).max(LEAST_SHAPES);
        let components = PrincipalComponents::fit(&samples, count.min(most));
        Ok(Self { filter, components })
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
            let frames = start..(start + ROWS).min(frames.end);
            self.projected(&residuals.wrinkles(&self.filter, sequence, frames))
        };
        let pieces: Vec<Vec<f32>> = starts.into_par_iter().map(piece).collect();
        pieces.concat()
    }

    /// Coefficients of heights, frames × V, about the mean: frames × R.
    pub(super) fn projected(&self, heights: &[f32]) -> Vec<f32> {
        let coefficients = self.components.project_rows(heights);
        coefficients.into_iter().map(|c| c as f32).collect()
    }

    /// The shapes along the normals of the rest shape: V × R vectors, those of a vertex adjacent.
    pub(super) fn vectors(&self) -> Vec<Vec3> {
        let normals = self.filter.normals().iter().enumerate();
        normals
            .flat_map(|(v, n)| (0..self.len()).map(move |k| *n * self.components.component(k)[v]))
            .collect()
    }
}
