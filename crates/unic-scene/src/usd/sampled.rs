//! Values over time.

use super::stage::{Prims, fault};
use crate::fault::Fault;
use glam::{DMat4, DQuat, DVec3, Vec3};
use openusd::sdf::{self, Value};

/// Values of an attribute over time.
pub(super) enum Sampled<T> {
    /// The same at all times.
    Constant(T),
    /// Values at ascending time codes, at least one. Before and behind them the value is constant.
    Over(Vec<(f64, T)>),
}

impl<T> Sampled<T> {
    /// Reads an attribute; none if it has no value.
    ///
    /// # Errors
    /// Values of another type than `convert` takes, times that do not ascend.
    pub(super) fn read(
        prims: &Prims,
        prim: &sdf::Path,
        name: &str,
        convert: impl Fn(Value) -> Option<T>,
    ) -> Result<Option<Self>, Fault> {
        let wrong = || {
            Fault::new(
                format!("numbers of the right kind in {name}"),
                format!("others at {prim}"),
            )
        };
        let attribute = prims.stage.prim(prim.clone()).attribute(name);
        let samples = attribute.time_samples().map_err(fault)?.unwrap_or_default();
        let mut over = Vec::with_capacity(samples.len());
        for (time, value) in samples {
            if matches!(value, Value::ValueBlock | Value::None) {
                continue;
            }
            over.push((time, convert(value).ok_or_else(wrong)?));
        }
        if !over.iter().all(|(time, _)| time.is_finite()) || !over.is_sorted_by(|a, b| a.0 < b.0) {
            return Err(Fault::new(
                "ascending times of samples",
                format!("others in {name} at {prim}"),
            ));
        }
        if !over.is_empty() {
            return Ok(Some(Self::Over(over)));
        }
        match prims.value(prim, name)? {
            None | Some(Value::ValueBlock | Value::None) => Ok(None),
            Some(value) => Ok(Some(Self::Constant(convert(value).ok_or_else(wrong)?))),
        }
    }

    /// Time codes of the samples; none for a constant.
    pub(super) fn times(&self) -> Vec<f64> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Over(samples) => samples.iter().map(|(time, _)| *time).collect(),
        }
    }

    /// First value.
    pub(super) fn first(&self) -> Option<&T> {
        match self {
            Self::Constant(value) => Some(value),
            Self::Over(samples) => samples.first().map(|(_, value)| value),
        }
    }
}

impl<T: Mix> Sampled<T> {
    /// Value at a time code.
    pub(super) fn at(&self, time: f64) -> Option<T> {
        let samples = match self {
            Self::Constant(value) => return Some(value.clone()),
            Self::Over(samples) => samples,
        };
        let next = samples.partition_point(|(sample, _)| *sample <= time);
        let before = next.checked_sub(1).and_then(|index| samples.get(index));
        Some(match (before, samples.get(next)) {
            (Some((a, low)), Some((b, high))) => low.mix(high, (time - a) / (b - a)),
            (Some((_, value)), None) | (None, Some((_, value))) => value.clone(),
            (None, None) => return None,
        })
    }
}

/// Values between two samples.
pub(super) trait Mix: Clone {
    /// Returns the value `along` the way to `other`, from 0 to 1.
    fn mix(&self, other: &Self, along: f64) -> Self;
}

impl Mix for f64 {
    fn mix(&self, other: &Self, along: f64) -> Self {
        self + (other - self) * along
    }
}

impl Mix for DVec3 {
    fn mix(&self, other: &Self, along: f64) -> Self {
        self.lerp(*other, along)
    }
}

impl Mix for Vec3 {
    fn mix(&self, other: &Self, along: f64) -> Self {
        self.lerp(*other, along as f32)
    }
}

impl Mix for DQuat {
    fn mix(&self, other: &Self, along: f64) -> Self {
        self.slerp(*other, along)
    }
}

impl Mix for DMat4 {
    fn mix(&self, other: &Self, along: f64) -> Self {
        *self + (*other - *self) * along
    }
}

/// Lists of one length are mixed; else the earlier one holds, as the format demands.
impl<T: Mix> Mix for Vec<T> {
    fn mix(&self, other: &Self, along: f64) -> Self {
        match self.len() == other.len() {
            true => self.iter().zip(other).map(|(a, b)| a.mix(b, along)).collect(),
            false => self.clone(),
        }
    }
}
