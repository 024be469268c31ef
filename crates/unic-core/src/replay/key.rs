//! Keys of frames, by which a motion finds similar ones.

use super::ReplayError;
use crate::network::Linear;
use serde::{Deserialize, Serialize};

/// Components of the motion vector in a key.
pub const FEATURES: usize = 15;

/// Numbers of a key: the features and the activity.
pub const KEY: usize = FEATURES + 1;

/// Key of a frame: features and activity, in steps.
pub type Key = [i8; KEY];

/// Steps of a key for one unit. A unit is the root mean square of all features in training.
pub(super) const KEY_STEPS: f32 = 16.0;

/// Weight of the logarithm of the activity in a key.
const ACTIVITY_WEIGHT: f32 = 1.5;

/// Activity of a body that stands nearly still, units of normalised motion vectors per second. The
/// logarithm of a smaller one would tell stillness from stillness.
const LEAST_ACTIVITY: f32 = 3e-3;

/// Time constant of the smoothed activity, seconds.
const SMOOTHING_S: f32 = 0.1;

/// Smoothed change of the motion vector: root mean square over its elements, units per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Activity(f32);

impl Activity {
    /// Returns the activity of a motion that has always changed as much as in one tick of `dt`
    /// seconds, given the normalised motion vectors of the previous and the present frame.
    pub fn of(pair: &[f32], dt: f32) -> Self {
        let (before, now) = pair.split_at(pair.len() / 2);
        let squares = before.iter().zip(now).map(|(b, n)| (n - b).powi(2));
        Self((squares.sum::<f32>() / now.len().max(1) as f32).sqrt() / dt)
    }

    /// Follows the motion by one tick of `dt` seconds, given the normalised motion vectors of the
    /// previous and the present frame, one after the other.
    pub fn follow(&mut self, pair: &[f32], dt: f32) {
        let change = Self::of(pair, dt).0;
        self.0 += (change - self.0) * (1.0 - (-dt / SMOOTHING_S).exp());
    }

    /// Units per second.
    pub fn rate(self) -> f32 {
        self.0
    }
}

/// Map from motion to keys: the leading principal components of the motion vector. An asset.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyMap {
    features: Linear,
}

impl KeyMap {
    /// Takes a map from a normalised motion vector to [`FEATURES`] features.
    ///
    /// # Errors
    /// Another number of features, weights of another length, numbers that are not finite.
    pub fn new(features: Linear) -> Result<Self, ReplayError> {
        let sizes = [features.outputs, features.bias.len()];
        if let Some(&found) = sizes.iter().find(|size| **size != FEATURES) {
            return Err(ReplayError::Features { found });
        }
        let mut numbers = features.weight.iter().chain(&features.bias);
        if features.weight.len() != FEATURES * features.inputs || numbers.any(|x| !x.is_finite()) {
            return Err(ReplayError::Unusable("a map to features"));
        }
        Ok(Self { features })
    }

    /// Map to the features.
    pub fn features(&self) -> &Linear {
        &self.features
    }

    /// Length of a normalised motion vector.
    pub fn inputs(&self) -> usize {
        self.features.inputs
    }

    /// Returns the key of a pair of normalised motion vectors.
    pub fn key(&self, pair: &[f32], activity: Activity) -> Key {
        let now = &pair[self.inputs()..];
        let rows = self.features.weight.chunks_exact(self.inputs());
        let features = rows.zip(&self.features.bias);
        let feature = |(row, b): (&[f32], &f32)| b + row.iter().zip(now).map(|(w, x)| w * x).sum::<f32>();
        let mut key = [0; KEY];
        for (k, x) in key.iter_mut().zip(features.map(feature)) {
            *k = in_steps(x);
        }
        key[FEATURES] = in_steps(ACTIVITY_WEIGHT * (activity.rate() + LEAST_ACTIVITY).ln());
        key
    }

    /// Returns the activity of a key, units per second. It is above zero.
    pub(super) fn rate_of(key: &Key) -> f32 {
        // Keys hold the logarithm, whose rounding is one in twenty.
        (f32::from(key[FEATURES]) / (KEY_STEPS * ACTIVITY_WEIGHT)).exp()
    }
}

/// Squared distance of two keys, in steps.
pub(super) fn distance(a: &Key, b: &Key) -> i32 {
    let differences = a.iter().zip(b).map(|(a, b)| i16::from(*a) - i16::from(*b));
    differences.map(|d| i32::from(d) * i32::from(d)).sum()
}

/// Rounds a number of a key to steps.
fn in_steps(x: f32) -> i8 {
    // A float that is out of range becomes the nearest integer.
    (x * KEY_STEPS).round() as i8
}
