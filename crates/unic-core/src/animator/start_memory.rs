//! Memory of the garment that an animator was given, at a reset or in a later frame.

use crate::{config::DisplacementConfig, prior::Prior};
use serde::{Deserialize, Serialize};

/// Excursion of a garment that was not given, metres: beyond every excursion of a motion.
pub const NEVER_GIVEN_M: f32 = 1e9;

/// Least share that is told from none.
pub const LEAST_SHARE: f32 = 1e-6;

/// Memory of a garment whose positions were given: how much of its displacement is left.
///
/// Cloth sticks to the body, so that a garment which hangs higher than the prior predicts stays
/// there while the body is calm. The *excursion* is the largest root mean square distance of the
/// predicted garment, in the vertices' own frames, from its shape in the frame of the given
/// positions. The share of the given displacement that is left is K = exp(−(excursion / L)²) for an
/// L of [`DisplacementConfig::excursion_m`]. It falls no faster than with the time constant
/// [`DisplacementConfig::memory_s`], so that nothing jumps.
///
/// The residual of a replay and the offsets of the strain projection are scaled by 1 − K²: given
/// wrinkles are not drawn twice.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartMemory {
    /// The prior's coefficients in the frame of the given positions, without those of the replay.
    pub coefficients: Vec<f32>,
    /// Largest excursion since then, metres.
    pub excursion_m: f32,
    /// Share K of the given displacement that is left, 0 to 1.
    pub share: f32,
}

/// Origin of the garment at the start of a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Positions were given, which stay as they lie.
    Given,
    /// The garment is a mean shape, which fades.
    MeanShape,
}

/// Displacements that stay while the body is calm, or fade alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keeping {
    /// They stay within the excursion of the configuration.
    WithinExcursion,
    /// They fade: an intersection handling that corrects states adds to them in every tick.
    Fading,
}

impl StartMemory {
    /// Makes the memory of a garment in a frame with these coefficients.
    pub fn begin(&mut self, origin: Origin, coefficients: &[f32]) {
        self.count_from(coefficients);
        (self.excursion_m, self.share) = match origin {
            Origin::Given => (0.0, 1.0),
            Origin::MeanShape => (NEVER_GIVEN_M, 0.0),
        };
    }

    /// Lets the displacement fade from now on, whatever the motion is.
    pub(crate) fn let_fade(&mut self) {
        self.excursion_m = NEVER_GIVEN_M;
    }

    /// Counts excursions from other coefficients.
    pub(crate) fn count_from(&mut self, coefficients: &[f32]) {
        self.coefficients.clear();
        self.coefficients.extend_from_slice(coefficients);
    }

    /// Advances by one tick of `dt` seconds to a frame with these coefficients, and returns the
    /// factor of the displacement, 0 to 1. `sizes` are the [`component_sizes`] of the prior.
    pub fn advance(
        &mut self,
        config: &DisplacementConfig,
        keeping: Keeping,
        sizes: &[f32],
        coefficients: &[f32],
        dt: f32,
    ) -> f32 {
        let fade = config.decay(dt);
        let within = config.excursion_m.filter(|_| keeping == Keeping::WithinExcursion);
        let stays = within.map_or(0.0, |within| {
            self.excursion_m = self.excursion_m.max(self.distance(sizes, coefficients));
            (-(self.excursion_m / within).powi(2)).exp()
        });
        let (before, faded) = (self.share, fade * self.share);
        // A share that is gone does not come back, and what else is in the state fades.
        if before < LEAST_SHARE || stays <= faded {
            self.share = if faded < LEAST_SHARE { 0.0 } else { faded };
            return fade;
        }
        self.share = stays.min(before);
        self.share / before
    }

    /// Share of a replay's residual and of the strain projection's offsets that is shown, 0 to 1.
    pub fn added_share(&self) -> f32 {
        1.0 - self.share * self.share
    }

    /// Root mean square distance of the predicted garment from that of the given positions, metres.
    ///
    /// `sizes` are the mean square lengths of the components. The distance is exact for orthogonal
    /// ones, which a mask or another mesh makes of principal components nearly.
    fn distance(&self, sizes: &[f32], coefficients: &[f32]) -> f32 {
        let moved = coefficients.iter().zip(&self.coefficients).map(|(a, b)| a - b);
        sizes
            .iter()
            .zip(moved)
            .map(|(size, a)| size * a * a)
            .sum::<f32>()
            .sqrt()
    }

    /// Returns true if the memory is one of a prior with this number of components.
    pub(crate) fn is_usable(&self, components: usize) -> bool {
        let numbers = self.coefficients.iter().chain([&self.excursion_m, &self.share]);
        self.coefficients.len() == components
            && numbers.into_iter().all(|x| x.is_finite())
            && self.excursion_m >= 0.0
            && (0.0..=1.0).contains(&self.share)
    }
}

/// Mean square length of each component of a prior over the vertices, square metres.
///
/// The mean square displacement of a difference a of coefficients is Σ_k size_k a_k² for orthogonal
/// components.
pub fn component_sizes(prior: &Prior) -> Vec<f32> {
    let components = &prior.components;
    let mut sizes = vec![0.0_f64; prior.len()];
    for row in components.coordinates().chunks_exact(prior.len().max(1)) {
        for (size, steps) in sizes.iter_mut().zip(row) {
            *size += f64::from(*steps).powi(2);
        }
    }
    let vertices = prior.mean.len().max(1) as f64;
    let sizes = sizes.into_iter().zip(components.step_m());
    sizes
        .map(|(size, step)| (size * f64::from(*step).powi(2) / vertices) as f32)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(excursion_m: Option<f32>) -> DisplacementConfig {
        DisplacementConfig {
            memory_s: 0.5,
            excursion_m,
            scale_m: 0.01,
            output_limit: 1.0,
            inputs: Vec::new(),
        }
    }

    fn begun(origin: Origin) -> StartMemory {
        let mut memory = StartMemory::default();
        memory.begin(origin, &[0.5, 0.0]);
        memory
    }

    #[test]
    fn a_calm_garment_stays_and_a_moved_one_never_comes_back() {
        let (config, sizes, dt) = (config(Some(0.02)), [1e-4, 1e-4], 1.0);
        let mut memory = begun(Origin::Given);
        assert_eq!(
            memory.advance(&config, Keeping::WithinExcursion, &sizes, &[0.5, 0.0], dt),
            1.0
        );
        assert_eq!((memory.share, memory.added_share()), (1.0, 0.0));
        // One unit of a component of 1 cm.
        let factor = memory.advance(&config, Keeping::WithinExcursion, &sizes, &[0.5, 1.0], dt);
        assert!((memory.excursion_m - 0.01).abs() < 1e-7);
        assert!((factor - (-0.25_f32).exp()).abs() < 1e-6 && (memory.share - factor).abs() < 1e-6);
        let share = memory.share;
        assert_eq!(
            memory.advance(&config, Keeping::WithinExcursion, &sizes, &[0.5, 0.0], dt),
            1.0
        );
        assert_eq!(memory.share, share);
        assert!((memory.added_share() + share * share - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_share_falls_with_the_time_constant_at_most() {
        let (config, sizes, dt) = (config(Some(0.02)), [1.0, 1.0], 0.1);
        let mut memory = begun(Origin::Given);
        let mut displacement = 1.0;
        for tick in 1..100 {
            displacement *= memory.advance(&config, Keeping::WithinExcursion, &sizes, &[9.0, 9.0], dt);
            let expected = (-0.2 * tick as f32).exp();
            assert!((displacement / expected - 1.0).abs() < 1e-4, "tick {tick}");
        }
        assert_eq!((memory.share, memory.added_share()), (0.0, 1.0));
        assert!(memory.is_usable(2) && !memory.is_usable(3));
    }

    #[test]
    fn a_share_that_is_gone_stays_gone_and_displacements_fade() {
        let (config, sizes, dt) = (config(Some(0.02)), [1e-4, 1e-4], 0.1);
        let mut memory = begun(Origin::Given);
        // An excursion of four times the one within which the garment stays.
        let moved = [0.5, 8.0];
        for _ in 0..100 {
            memory.advance(&config, Keeping::WithinExcursion, &sizes, &moved, dt);
        }
        let factor = memory.advance(&config, Keeping::WithinExcursion, &sizes, &moved, dt);
        assert_eq!((memory.share, factor), (0.0, config.decay(dt)));
    }

    #[test]
    fn displacements_fade_where_states_are_corrected_and_after_a_change_of_mind() {
        let (config, sizes, still) = (config(Some(0.02)), [1e-4, 1e-4], [0.5, 0.0]);
        let mut corrected = begun(Origin::Given);
        let factor = corrected.advance(&config, Keeping::Fading, &sizes, &still, 0.1);
        assert_eq!(factor, config.decay(0.1));
        let mut carried = begun(Origin::Given);
        carried.let_fade();
        let factor = carried.advance(&config, Keeping::WithinExcursion, &sizes, &still, 0.1);
        assert_eq!((factor, carried.share), (config.decay(0.1), config.decay(0.1)));
    }

    #[test]
    fn a_mean_shape_and_a_model_without_an_excursion_fade() {
        for (config, origin) in [
            (config(Some(0.02)), Origin::MeanShape),
            (config(None), Origin::Given),
        ] {
            let mut memory = begun(origin);
            for _ in 0..20 {
                let factor =
                    memory.advance(&config, Keeping::WithinExcursion, &[1e-4, 1e-4], &[0.5, 0.0], 0.1);
                assert_eq!(factor, config.decay(0.1));
            }
            let share = if origin == Origin::Given {
                (-4.0_f32).exp()
            } else {
                0.0
            };
            assert!((memory.share - share).abs() < 1e-5);
        }
    }
}
