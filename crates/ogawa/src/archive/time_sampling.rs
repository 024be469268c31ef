//! Times of samples.

use super::fields::Fields;
use crate::error::{Error, Result};

/// Length of a cycle that marks times without a cycle, seconds.
const ACYCLIC: f64 = f64::MAX / 32.0;

/// Times of the samples of a property, seconds.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeSampling {
    /// Samples at equal distances.
    Uniform {
        /// Time of sample 0.
        start: f64,
        /// Time from one sample to the next, greater than 0.
        step: f64,
    },
    /// A pattern of times that repeats, as for motion blur.
    Cyclic {
        /// Times of the first cycle, ascending, at least one.
        times: Vec<f64>,
        /// Time from one cycle to the next, greater than 0.
        period: f64,
    },
    /// One time for each sample, ascending, at least one.
    Acyclic(Vec<f64>),
}

impl Default for TimeSampling {
    /// The sampling of properties without a time: one sample a second, from 0 on.
    fn default() -> Self {
        Self::Uniform {
            start: 0.0,
            step: 1.0,
        }
    }
}

impl TimeSampling {
    /// Time of a sample, seconds. Beyond the last time of an acyclic sampling it is the last time.
    pub fn time(&self, index: u32) -> f64 {
        match self {
            Self::Uniform { start, step } => start + step * f64::from(index),
            Self::Cyclic { times, period } => {
                let count = u32::try_from(times.len()).unwrap_or(u32::MAX).max(1);
                let within = times.get((index % count) as usize).copied().unwrap_or_default();
                within + period * f64::from(index / count)
            }
            Self::Acyclic(times) => (times.get(index as usize).or(times.last()).copied()).unwrap_or_default(),
        }
    }

    /// Index of the sample nearest to a time, of `count` samples; the earlier one of two that are
    /// equally near. 0 if there are no samples.
    pub fn nearest(&self, time: f64, count: u32) -> u32 {
        let (mut low, mut high) = (0, count);
        // Times ascend: the first one behind `time` is found by halving.
        while low < high {
            let middle = low + (high - low) / 2;
            match self.time(middle) <= time {
                true => low = middle + 1,
                false => high = middle,
            }
        }
        match low {
            0 => 0,
            _ if low == count => count - 1,
            _ if time - self.time(low - 1) <= self.time(low) - time => low - 1,
            _ => low,
        }
    }

    /// Reads a sampling and passes over the largest number of samples that it is used for.
    pub(super) fn decode(fields: &mut Fields<'_>) -> Result<Self> {
        fields.u32()?;
        let offset = fields.offset();
        let period = fields.f64()?;
        if !(period > 0.0 && period.is_finite()) {
            return Err(Error::damaged(
                offset,
                "a time between samples",
                period.to_string(),
            ));
        }
        let offset = fields.offset();
        let count = fields.u32()?;
        let mut bytes = Fields::new(fields.bytes(8 * count as usize)?, offset + 4);
        let mut times = Vec::with_capacity(count as usize);
        while !bytes.is_empty() {
            times.push(bytes.f64()?);
        }
        if !times.iter().all(|t| t.is_finite()) || !times.is_sorted() {
            return Err(Error::damaged(offset, "ascending times", "others"));
        }
        match *times {
            [] => Err(Error::damaged(offset, "at least one time", "none")),
            _ if period == ACYCLIC => Ok(Self::Acyclic(times)),
            [start] => Ok(Self::Uniform { start, step: period }),
            _ => Ok(Self::Cyclic { times, period }),
        }
    }

    /// Appends the sampling; `samples` is the largest number of samples that it is used for.
    pub(super) fn encode(&self, samples: u32, into: &mut Vec<u8>) {
        let (period, times) = match self {
            Self::Uniform { start, step } => (*step, std::slice::from_ref(start)),
            Self::Cyclic { times, period } => (*period, times.as_slice()),
            Self::Acyclic(times) => (ACYCLIC, times.as_slice()),
        };
        into.extend_from_slice(&samples.to_le_bytes());
        into.extend_from_slice(&period.to_le_bytes());
        into.extend_from_slice(&(times.len() as u32).to_le_bytes());
        times
            .iter()
            .for_each(|t| into.extend_from_slice(&t.to_le_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_sample_is_found_in_every_kind() {
        let uniform = TimeSampling::Uniform {
            start: 1.0,
            step: 0.5,
        };
        let cyclic = TimeSampling::Cyclic {
            times: vec![0.0, 0.1],
            period: 1.0,
        };
        let acyclic = TimeSampling::Acyclic(vec![0.0, 1.0, 5.0]);
        for (sampling, time, expected) in [
            (&uniform, -3.0, 0),
            (&uniform, 1.7, 1),
            (&uniform, 1.76, 2),
            (&uniform, 99.0, 3),
            (&cyclic, 1.09, 3),
            (&cyclic, 0.9, 2),
            (&acyclic, 3.1, 2),
            (&acyclic, 3.0, 1),
        ] {
            assert_eq!(sampling.nearest(time, 4), expected, "{sampling:?} at {time}");
        }
        assert_eq!(uniform.nearest(0.0, 0), 0);
        assert!((uniform.time(3), cyclic.time(3), acyclic.time(9)) == (2.5, 1.1, 5.0));
    }
}
