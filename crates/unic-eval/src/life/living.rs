//! Living ratio of a garment that is measured while it is animated.

use super::{
    band_filter::{BANDS, BandFilter},
    sums::LEAST_AMPLITUDE,
    welded::WeldedMesh,
};
use crate::error::Result;
use glam::Vec3;
use rayon::prelude::*;
use std::{iter::zip, ops::Range};
use unic_core::mesh::TriMesh;

/// Bands whose living ratio [`LivingMeasure`] reads: wavelengths of 3 to 24 cm.
const MEASURED_BANDS: Range<usize> = 1..BANDS - 1;

/// Smallest number of frames that show how wrinkles vary.
const LEAST_FRAMES: usize = 6;

/// Measure of how much the wrinkles of a garment come and go, for the choices of a training.
pub struct LivingMeasure {
    filter: BandFilter,
}

/// Squared deviations of wrinkles from their means over the frames of a clip, by band, m⁴.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Liveliness {
    squared: [f64; MEASURED_BANDS.end - MEASURED_BANDS.start],
    frames: usize,
    /// Sum of the weights over vertices and frames, m².
    weight: f64,
}

impl LivingMeasure {
    /// Prepares the measure of a garment with this rest mesh.
    ///
    /// # Errors
    /// A rest mesh whose smoothings cannot be factorised.
    pub fn new(rest: &TriMesh) -> Result<Self> {
        let filter = BandFilter::new(WeldedMesh::new(rest))?;
        Ok(Self { filter })
    }

    /// Measures a garment in some frames of a clip, given the positions of all garment vertices in
    /// each of them, metres.
    pub fn liveliness(&self, frames: &[&[Vec3]]) -> Liveliness {
        // Collected first and summed in order: the result does not depend on the number of threads.
        let signals: Vec<Vec<f32>> = frames
            .par_iter()
            .map(|positions| self.filter.wrinkles(positions))
            .collect();
        let (weights, count) = (self.filter.weights(), frames.len() as f64);
        let deviation = |signal: usize| {
            let values = || signals.iter().map(|frame| f64::from(frame[signal]));
            let mean = values().sum::<f64>() / count;
            values().map(|x| (x - mean).powi(2)).sum::<f64>()
        };
        let of_band = |band: usize| {
            let vertices = weights.iter().enumerate();
            vertices
                .map(|(v, w)| w * deviation(band * weights.len() + v))
                .sum()
        };
        let mut squared = MEASURED_BANDS.map(of_band);
        Liveliness {
            squared: std::array::from_fn(|_| squared.next().unwrap_or_default()),
            frames: frames.len(),
            weight: count * weights.iter().sum::<f64>(),
        }
    }
}

impl Liveliness {
    /// Geometric mean of the living ratios from 3 to 24 cm of wavelength (see
    /// [`BandMetrics::living_ratio`](crate::BandMetrics::living_ratio)) in the same frames of a clip;
    /// none where the truth does not vary in one of these bands, and in fewer than six frames.
    pub fn ratio(&self, truth: &Self) -> Option<f64> {
        let least = self.weight * LEAST_AMPLITUDE * LEAST_AMPLITUDE;
        let is_alive = self.frames >= LEAST_FRAMES && truth.squared.iter().all(|x| *x > least);
        let ratio = |(predicted, truth): (f64, f64)| 0.5 * (predicted / truth).ln();
        let bands = zip(self.squared, truth.squared).map(ratio);
        is_alive.then(|| (bands.sum::<f64>() / self.squared.len() as f64).exp())
    }
}
