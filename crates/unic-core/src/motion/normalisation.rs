//! Normalisation of the motion vector by its mean and standard deviation in training.

use super::{MotionError, MotionSlices, motion_len};
use serde::{Deserialize, Serialize};
use std::iter;

/// Standard deviation below which an element counts as constant in training and is centred only.
///
/// Such deviations are rounding errors: f32 resolves 2e-6 m at 30 m from the origin.
pub const ROUNDING_STD: f32 = 1e-5;

/// Rule by which a [`Normalisation`] is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalisationRule {
    /// Elements that are centred and scaled.
    pub elements: NormalisedElements,
    /// Least standard deviation that an element is divided by, in its own unit.
    ///
    /// It keeps an element that hardly moves in training from becoming large when it moves later. A
    /// deviation of 2 cm (or 0.02 of another unit) is too small to move a garment. With
    /// [`ROUNDING_STD`] every element that varies is scaled by its own deviation.
    pub least_std: f32,
    /// Largest magnitude of a normalised element, if limited. The limit keeps the networks' inputs
    /// in the range of training when a motion is far from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f32>,
}

/// Elements of the motion vector that are centred and scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalisedElements {
    /// Positions and velocities, as published, and springs. Rotations and contacts stay unchanged.
    PositionsAndVelocities,
    /// All elements.
    All,
}

impl NormalisationRule {
    /// Published rule.
    pub const PAPER: Self = Self {
        elements: NormalisedElements::PositionsAndVelocities,
        least_std: ROUNDING_STD,
        limit: None,
    };
}

/// Mean and standard deviation of every element of the motion vector over the training frames.
///
/// It maps c to (c − mean) / std. Elements that are not normalised have mean 0 and standard
/// deviation 1 ([`MotionSlices::normalised`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normalisation {
    /// Means, one an element, in its own unit.
    pub mean: Vec<f32>,
    /// Standard deviations, one an element, in its own unit; above zero.
    pub std: Vec<f32>,
    /// Largest magnitude of a normalised element, if limited.
    pub limit: Option<f32>,
}

impl Normalisation {
    /// Returns the normalisation that changes nothing, of vectors of this length.
    pub fn identity(len: usize) -> Self {
        Self {
            mean: vec![0.0; len],
            std: vec![1.0; len],
            limit: None,
        }
    }

    /// Fits a normalisation to motion vectors of `len` numbers, springs included, of a skeleton
    /// with this many joints.
    ///
    /// The standard deviation is that of the population. Elements that do not vary get 1. Without
    /// any vector the result is the identity.
    ///
    /// # Errors
    /// Vectors of another length, elements that are not finite.
    pub fn fit<V: AsRef<[f32]>>(
        joints: usize,
        len: usize,
        rule: NormalisationRule,
        vectors: impl IntoIterator<Item = V>,
    ) -> Result<Self, MotionError> {
        let least = motion_len(joints);
        check_length("a motion vector, or more", least, len.min(least))?;
        let mut moments = Moments::new(len);
        for vector in vectors {
            moments.add(vector.as_ref())?;
        }
        let mut fitted = Self {
            limit: rule.limit,
            ..Self::identity(len)
        };
        let mut normalise = |element: usize| {
            fitted.mean[element] = moments.mean[element] as f32;
            let std = (moments.squares[element] / moments.count.max(1.0)).sqrt() as f32;
            // Otherwise the deviation stays 1, so that rounding errors are not amplified.
            if std >= ROUNDING_STD {
                fitted.std[element] = std.max(rule.least_std);
            }
        };
        match rule.elements {
            NormalisedElements::All => (0..len).for_each(normalise),
            NormalisedElements::PositionsAndVelocities => {
                MotionSlices::new(joints)
                    .normalised()
                    .chain(iter::once(motion_len(joints)..len))
                    .flatten()
                    .for_each(&mut normalise);
            }
        }
        Ok(fitted)
    }

    /// Normalises a motion vector in place.
    pub fn apply(&self, vector: &mut [f32]) {
        debug_assert_eq!(vector.len(), self.mean.len());
        for ((c, mean), std) in vector.iter_mut().zip(&self.mean).zip(&self.std) {
            *c = (*c - mean) / std;
        }
        if let Some(limit) = self.limit {
            vector.iter_mut().for_each(|c| *c = c.clamp(-limit, limit));
        }
    }

    /// Writes two motion vectors side by side, normalised: the input of the encoder and the prior.
    pub fn write_pair(&self, pair: [&[f32]; 2], out: &mut Vec<f32>) {
        out.clear();
        for vector in pair {
            let start = out.len();
            out.extend_from_slice(vector);
            self.apply(&mut out[start..]);
        }
    }

    /// Checks a normalisation that comes from a file.
    ///
    /// # Errors
    /// Another length than that of the motion vector, means that are not finite, standard
    /// deviations that are not finite and above zero.
    pub fn check(&self, len: usize) -> Result<(), MotionError> {
        check_length("normalisation means", len, self.mean.len())?;
        check_length("normalisation deviations", len, self.std.len())?;
        let usable = |what, element: Option<usize>| match element {
            None => Ok(()),
            Some(element) => Err(MotionError::NotFinite { what, element }),
        };
        let not_positive = |s: &f32| !(s.is_finite() && *s > 0.0);
        usable("mean", self.mean.iter().position(|m| !m.is_finite()))?;
        usable("standard deviation", self.std.iter().position(not_positive))
    }
}

/// Running mean and sum of squared deviations of every element.
///
/// Welford's recurrence in f64: the difference of a mean square and a squared mean would lose the
/// digits of small deviations.
struct Moments {
    count: f64,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    fn new(len: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; len],
            squares: vec![0.0; len],
        }
    }

    fn add(&mut self, vector: &[f32]) -> Result<(), MotionError> {
        check_length("a motion vector", self.mean.len(), vector.len())?;
        if let Some(element) = vector.iter().position(|value| !value.is_finite()) {
            let what = "motion vector element";
            return Err(MotionError::NotFinite { what, element });
        }
        self.count += 1.0;
        let moments = self.mean.iter_mut().zip(&mut self.squares);
        for ((mean, squares), &value) in moments.zip(vector) {
            let before = f64::from(value) - *mean;
            *mean += before / self.count;
            // One factor is the deviation from the old mean, the other that from the new mean.
            *squares += before * (f64::from(value) - *mean);
        }
        Ok(())
    }
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), MotionError> {
    if expected == found {
        return Ok(());
    }
    Err(MotionError::Length {
        what,
        expected,
        found,
    })
}
