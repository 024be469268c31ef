//! Error that a faster animator adds.

use super::scene::Scene;
use crate::interrupt;
use anyhow::Result;
use glam::Vec3;
use unic_core::{Animator, Start};

/// Root mean square distances to the positions of the exact animator, millimetres.
#[derive(Clone, Copy, Debug)]
pub(super) struct AddedError {
    /// Error when every frame starts from the exact state.
    pub(super) one_step: f64,
    /// Error when both animators run freely.
    pub(super) free_running: f64,
}

impl AddedError {
    /// Measures over all frames of a scene.
    pub(super) fn measure(exact: &Animator, inexact: &Animator, scene: &Scene) -> Result<Self> {
        let (mut exact, mut free, mut forced) = (exact.clone(), inexact.clone(), inexact.clone());
        for animator in [&mut exact, &mut free] {
            animator.reset(&scene.input(0), Start::MeanShape)?;
        }
        let (mut one_step, mut free_running) = (MeanSquare::default(), MeanSquare::default());
        for t in 1..scene.poses.len() {
            interrupt::check()?;
            let input = scene.input(t);
            // The exact state replaces the inexact one, so that errors of earlier frames do not
            // count.
            forced.restore(exact.state().clone())?;
            let truth = exact.step(&input)?.positions;
            one_step.add(forced.step(&input)?.positions, truth);
            free_running.add(free.step(&input)?.positions, truth);
        }
        Ok(Self {
            one_step: one_step.root_mm(),
            free_running: free_running.root_mm(),
        })
    }
}

/// Mean of squared distances.
#[derive(Default)]
struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    /// Adds the distances of all vertices.
    fn add(&mut self, found: &[Vec3], truth: &[Vec3]) {
        let squares = found
            .iter()
            .zip(truth)
            // Differences of micrometres at metres from the origin need f64.
            .map(|(a, b)| a.as_dvec3().distance_squared(b.as_dvec3()));
        self.sum += squares.sum::<f64>();
        self.count += truth.len();
    }

    /// Returns the root mean square, millimetres.
    fn root_mm(&self) -> f64 {
        1e3 * (self.sum / self.count as f64).sqrt()
    }
}
