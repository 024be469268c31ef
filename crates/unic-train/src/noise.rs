//! Random perturbations of the garment's state.

use glam::Vec3;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::f32::consts::{PI, SQRT_2};

/// One number of the standard normal distribution.
pub(crate) fn normal(rng: &mut impl Rng) -> f32 {
    StandardNormal.sample(rng)
}

/// Random displacement field over the rest shape, smooth at the scale of folds, because prediction
/// errors are correlated between neighbouring vertices.
pub struct SmoothNoise {
    waves: Vec<Wave>,
    /// Ratio of the noise a frame earlier to the noise now. It perturbs the velocity too.
    earlier: f32,
}

struct Wave {
    direction: Vec3,
    amplitude: Vec3,
    phase: f32,
}

impl Wave {
    fn draw(rng: &mut impl Rng, strength: f32) -> Self {
        let [short, long] = WAVELENGTHS_M;
        // Uniform in the logarithm of the wavelength.
        let wavelength = short * (long / short).powf(rng.random::<f32>());
        Self {
            direction: vector(rng).normalize_or(Vec3::Y) * 2.0 * PI / wavelength,
            // A cosine has the mean square 1/2, and the variances of the waves add up.
            amplitude: vector(rng) * strength * SQRT_2 / (WAVES as f32).sqrt(),
            phase: rng.random::<f32>() * 2.0 * PI,
        }
    }
}

/// Waves in one field.
const WAVES: usize = 4;
/// Wavelengths, metres: from a fold to half a shirt.
const WAVELENGTHS_M: [f32; 2] = [0.08, 0.8];

impl SmoothNoise {
    /// Draws a field. Over many fields each coordinate has this standard deviation. The strength of
    /// a field is random, so that nearly undisturbed starts occur too.
    pub fn draw(rng: &mut impl Rng, deviation_m: f32) -> Self {
        let strength = deviation_m * normal(rng).abs();
        let waves = (0..WAVES).map(|_| Wave::draw(rng, strength)).collect();
        Self {
            waves,
            earlier: 1.0 + 0.2 * normal(rng),
        }
    }

    /// Noise of a vertex now and a frame earlier, metres.
    pub fn at(&self, rest: Vec3) -> (Vec3, Vec3) {
        let wave = |w: &Wave| w.amplitude * (w.direction.dot(rest) + w.phase).cos();
        let now: Vec3 = self.waves.iter().map(wave).sum();
        // The same waves in both frames: independent ones would add a velocity of their size per
        // frame.
        (now, now * self.earlier)
    }
}

fn vector(rng: &mut impl Rng) -> Vec3 {
    Vec3::new(normal(rng), normal(rng), normal(rng))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Stream, generator};

    #[test]
    fn field_has_the_given_deviation_and_is_smooth() {
        let mut rng = generator(3, Stream::StateNoise, 0);
        let (mut squares, mut steps) = (0.0, 0.0);
        const DRAWS: usize = 4000;
        for _ in 0..DRAWS {
            let noise = SmoothNoise::draw(&mut rng, 0.01);
            let (a, _) = noise.at(Vec3::ZERO);
            let (b, _) = noise.at(Vec3::X * 0.004);
            squares += a.length_squared() / 3.0;
            steps += (a - b).length_squared() / 3.0;
        }
        let deviation = (squares / DRAWS as f32).sqrt();
        assert!((deviation - 0.01).abs() < 0.001, "{deviation}");
        assert!((steps / DRAWS as f32).sqrt() < 0.1 * deviation);
    }
}
