//! Liveliness: whether a garment moves as much as the true one.

use super::clip_run::ClipRun;
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::{f64::consts::TAU, ops::RangeInclusive};

/// Length of a spectral window, seconds. Windows overlap by half.
const WINDOW_S: f64 = 4.0;
/// Frequency band of swinging, lag and flutter, Hz. Slower changes follow the pose.
const BAND_HZ: RangeInclusive<f64> = 0.5..=5.0;

/// Liveliness in free running from frame 0 of a clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Aliveness {
    /// Name of the clip.
    pub clip: String,
    /// RMS second difference of world positions over time, divided by that of the truth; see
    /// [`Metrics::jitter_ratio`](crate::Metrics::jitter_ratio).
    pub jitter_ratio: f64,
    /// Variance of the predicted displacement between 0.5 and 5 Hz, mean over 200 vertices, mm².
    pub band_energy_mm2: f64,
    /// Variance of the true displacement in the same band, mm².
    pub true_band_energy_mm2: f64,
    /// `band_energy_mm2` / `true_band_energy_mm2`.
    pub band_energy_ratio: f64,
}

/// Measures one run. Returns `None` for a clip that is shorter than a window.
pub(super) fn measure(run: &ClipRun) -> Option<Aliveness> {
    let spectrum = Spectrum::new(f64::from(run.captured.clip.fps));
    let [found, truth] = run.displacements.each_ref().map(|d| spectrum.mean_energy(d));
    let (found, truth) = (1e6 * found?, 1e6 * truth?);
    Some(Aliveness {
        clip: run.captured.clip.name.clone(),
        jitter_ratio: run.jitter_ratio,
        band_energy_mm2: found,
        true_band_energy_mm2: truth,
        band_energy_ratio: found / truth,
    })
}

/// Variance of a signal within the frequency band, by Welch's estimate with Hann windows.
///
/// The bins of the discrete Fourier transform in the band are summed directly. A sine of amplitude
/// a well inside the band has the variance a² / 2, whatever its phase.
pub(super) struct Spectrum {
    /// Periodic Hann window, with which a constant reaches no bin beyond the first.
    window: Vec<f64>,
    /// Cosine and sine of each bin in the band for each frame, times the window.
    bins: Vec<Vec<[f64; 2]>>,
}

impl Spectrum {
    /// Prepares windows and bins for a frame rate.
    pub(super) fn new(fps: f64) -> Self {
        let frames = ((WINDOW_S * fps).round() as usize).max(2);
        // The product is reduced before it becomes an angle, which keeps cosines of large t exact.
        let phase = |k: usize, t: usize| TAU * ((k * t) % frames) as f64 / frames as f64;
        let window: Vec<f64> = (0..frames).map(|t| 0.5 - 0.5 * phase(1, t).cos()).collect();
        let is_inside = |k: &usize| BAND_HZ.contains(&(*k as f64 * fps / frames as f64));
        let wave = |k: usize| {
            let at = |t: usize| [phase(k, t).cos() * window[t], phase(k, t).sin() * window[t]];
            (0..frames).map(at).collect()
        };
        // Bins above half the frame rate mirror those below. The one at half, of an even number of
        // frames, mirrors itself and is left out.
        let bins = (1..frames.div_ceil(2)).filter(is_inside).map(wave).collect();
        Self { window, bins }
    }

    /// Returns the variance summed over x, y and z, mean over vertices and windows, m². `None`
    /// where no window fits.
    fn mean_energy(&self, displacements: &[Vec<Vec3>]) -> Option<f64> {
        let vertices = displacements.first()?.len();
        let of_vertex = |vertex: usize| {
            let of_axis = |axis: usize| {
                let signal = displacements.iter().map(|frame| f64::from(frame[vertex][axis]));
                self.energy(&signal.collect::<Vec<f64>>())
            };
            (0..3).map(of_axis).sum::<Option<f64>>()
        };
        // Collected in the order of the vertices, so that the sum does not depend on threads.
        let energies: Vec<Option<f64>> = (0..vertices).into_par_iter().map(of_vertex).collect();
        let sum = energies.into_iter().sum::<Option<f64>>()?;
        (vertices > 0).then(|| sum / vertices as f64)
    }

    /// Returns the variance in the band, in the squared unit of the signal. `None` for a signal
    /// shorter than a window.
    pub(super) fn energy(&self, signal: &[f64]) -> Option<f64> {
        let frames = self.window.len();
        let windows = signal.windows(frames).step_by((frames / 2).max(1));
        let count = windows.len();
        (count > 0).then(|| windows.map(|w| self.energy_of_window(w)).sum::<f64>() / count as f64)
    }

    /// Returns the variance in the band of one window.
    fn energy_of_window(&self, signal: &[f64]) -> f64 {
        // The mean is large beside the swing. Removing it keeps precision.
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        let power = |bin: &Vec<[f64; 2]>| {
            let terms = signal.iter().zip(bin);
            let [re, im] = terms.fold([0.0; 2], |[re, im], (x, [cos, sin])| {
                [re + (x - mean) * cos, im + (x - mean) * sin]
            });
            re * re + im * im
        };
        let squares: f64 = self.window.iter().map(|w| w * w).sum();
        // The factor 2 counts the bins of negative frequency. By Parseval's theorem the sum is
        // divided by the length and by the power of the window.
        2.0 * self.bins.iter().map(power).sum::<f64>() / (signal.len() as f64 * squares)
    }
}
