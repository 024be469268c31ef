//! Does a garment move as much as the truth does?

use super::clip_run::ClipRun;
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::{f64::consts::TAU, ops::RangeInclusive};

/// Length of a window, seconds; windows overlap by a half.
const WINDOW_S: f64 = 4.0;
/// Swing, lag and flutter; slower is where a garment hangs, Hz.
const BAND_HZ: RangeInclusive<f64> = 0.5..=5.0;

/// Liveliness in free running from frame 0 of a clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Aliveness {
    /// The clip.
    pub clip: String,
    /// RMS second difference of world positions over time, by the truth's; as
    /// [`Metrics::jitter_ratio`](crate::Metrics::jitter_ratio).
    pub jitter_ratio: f64,
    /// Mean over 200 vertices of |u − ū|² between 0.5 and 5 Hz, mm².
    pub band_energy_mm2: f64,
    /// The truth's, mm².
    pub true_band_energy_mm2: f64,
    /// The first by the second.
    pub band_energy_ratio: f64,
}

/// None for a clip that is shorter than a window.
pub(super) fn measure(run: &ClipRun) -> Option<Aliveness> {
    let spectrum = Spectrum::new(f64::from(run.captured.clip.fps));
    let [found, truth] = run.displacements.each_ref().map(|d| spectrum.of_vertices(d));
    let (found, truth) = (1e6 * found?, 1e6 * truth?);
    Some(Aliveness {
        clip: run.captured.clip.name.clone(),
        jitter_ratio: run.jitter_ratio,
        band_energy_mm2: found,
        true_band_energy_mm2: truth,
        band_energy_ratio: found / truth,
    })
}

/// The part of a signal's variance that lies in the band: Welch's estimate with Hann windows.
///
/// The bins of the discrete Fourier transform in the band are summed directly. A sine of amplitude a
/// well inside the band has a² / 2, whatever its phase.
pub(super) struct Spectrum {
    /// Hann, periodic, so that a constant reaches no bin beyond the first.
    window: Vec<f64>,
    /// Cosine and sine of each bin in the band, by frame, times the window.
    bins: Vec<Vec<[f64; 2]>>,
}

impl Spectrum {
    pub(super) fn new(fps: f64) -> Self {
        let frames = ((WINDOW_S * fps).round() as usize).max(2);
        let phase = |k: usize, t: usize| TAU * ((k * t) % frames) as f64 / frames as f64;
        let window: Vec<f64> = (0..frames).map(|t| 0.5 - 0.5 * phase(1, t).cos()).collect();
        let is_inside = |k: &usize| BAND_HZ.contains(&(*k as f64 * fps / frames as f64));
        let wave = |k: usize| {
            let at = |t: usize| [phase(k, t).cos() * window[t], phase(k, t).sin() * window[t]];
            (0..frames).map(at).collect()
        };
        // The highest bin of an even number of frames is its own mirror image.
        let bins = (1..frames.div_ceil(2)).filter(is_inside).map(wave).collect();
        Self { window, bins }
    }

    /// Sum over x, y and z, mean over vertices and windows; m². None where no window fits.
    fn of_vertices(&self, displacements: &[Vec<Vec3>]) -> Option<f64> {
        let vertices = displacements.first()?.len();
        let of_vertex = |vertex: usize| {
            let of_axis = |axis: usize| {
                let signal = displacements.iter().map(|frame| f64::from(frame[vertex][axis]));
                self.energy(&signal.collect::<Vec<f64>>())
            };
            (0..3).map(of_axis).sum::<Option<f64>>()
        };
        let energies: Vec<Option<f64>> = (0..vertices).into_par_iter().map(of_vertex).collect();
        let sum = energies.into_iter().sum::<Option<f64>>()?;
        (vertices > 0).then(|| sum / vertices as f64)
    }

    /// In the signal's unit squared. None where it is shorter than a window.
    pub(super) fn energy(&self, signal: &[f64]) -> Option<f64> {
        let frames = self.window.len();
        let windows = signal.windows(frames).step_by((frames / 2).max(1));
        let count = windows.len();
        (count > 0).then(|| windows.map(|w| self.energy_of_window(w)).sum::<f64>() / count as f64)
    }

    fn energy_of_window(&self, signal: &[f64]) -> f64 {
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        let power = |bin: &Vec<[f64; 2]>| {
            let terms = signal.iter().zip(bin);
            let [re, im] = terms.fold([0.0; 2], |[re, im], (x, [cos, sin])| {
                [re + (x - mean) * cos, im + (x - mean) * sin]
            });
            re * re + im * im
        };
        let squares: f64 = self.window.iter().map(|w| w * w).sum();
        // Bins of negative frequency hold as much; Parseval, and what the window takes away.
        2.0 * self.bins.iter().map(power).sum::<f64>() / (signal.len() as f64 * squares)
    }
}
