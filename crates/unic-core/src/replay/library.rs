//! Residuals of training clips, frame by frame, with their keys.

use super::Key;
use thiserror::Error;

/// Largest number of frames: 27 minutes at 30 frames per second.
pub const MOST_FRAMES: usize = 49_152;

/// Error: parts that make no replay, or a state of another one.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ReplayError {
    /// Map to another number of features.
    #[error("replay: expected {} features, found {found}", super::FEATURES)]
    Features {
        /// Number of the map's outputs.
        found: usize,
    },
    /// Another number of coefficients.
    #[error("replay: expected {expected} coefficients, found {found}")]
    Coefficients {
        /// Number of the library's.
        expected: usize,
        /// Number that was found.
        found: usize,
    },
    /// Clips with another number of frames than the keys or the residuals.
    #[error("replay: expected {expected} frames, found {found}")]
    Frames {
        /// Sum of the clips' frames.
        expected: usize,
        /// Number that was found.
        found: usize,
    },
    /// No frame, or more frames than [`MOST_FRAMES`].
    #[error("replay: expected 1 to {MOST_FRAMES} frames, found {found}")]
    Size {
        /// Number of frames.
        found: usize,
    },
    /// Numbers that are not finite or out of range.
    #[error("replay: {0} has numbers that are not usable")]
    Unusable(&'static str),
}

/// Residuals and keys of the frames of some clips. An asset.
#[derive(Clone, Debug, PartialEq)]
pub struct Library {
    /// Number of frames of each clip.
    clips: Vec<u32>,
    keys: Vec<Key>,
    /// Residuals in units of `scales`, frames × R.
    residuals: Vec<i8>,
    /// Unit of each of the R coefficients, metres.
    scales: Vec<f32>,
    /// Number of frames that follow each frame in its clip.
    remaining: Vec<u32>,
    longest: f32,
    mean_square: f32,
}

impl Library {
    /// Joins clips of so many frames with the key and the residual of each frame: `residuals` has
    /// frames × R numbers in units of the R `scales`, metres.
    ///
    /// # Errors
    /// Lengths that do not fit, too many frames, scales that are negative or not finite.
    pub fn new(
        clips: Vec<u32>,
        keys: Vec<Key>,
        residuals: Vec<i8>,
        scales: Vec<f32>,
    ) -> Result<Self, ReplayError> {
        // In u64: lengths of a damaged file may overflow 32 bits.
        let expected = clips.iter().map(|c| u64::from(*c)).sum::<u64>() as usize;
        if !(1..=MOST_FRAMES).contains(&expected) {
            return Err(ReplayError::Size { found: expected });
        }
        let wrong_length = [keys.len(), residuals.len() / scales.len().max(1)];
        if let Some(&found) = wrong_length.iter().find(|found| **found != expected) {
            return Err(ReplayError::Frames { expected, found });
        }
        if !residuals.len().is_multiple_of(scales.len().max(1))
            || !scales.iter().all(|s| s.is_finite() && *s >= 0.0)
        {
            return Err(ReplayError::Unusable("a scale of coefficients"));
        }
        let remaining = clips.iter().flat_map(|&frames| (0..frames).rev()).collect();
        let mut library = Self {
            clips,
            keys,
            residuals,
            scales,
            remaining,
            longest: 0.0,
            mean_square: 0.0,
        };
        let squares = || (0..expected as u32).map(|frame| library.square(frame));
        let (longest, sum) = (
            squares().fold(0.0, f32::max).sqrt(),
            squares().map(f64::from).sum::<f64>(),
        );
        // Finite scales may overflow with their residuals.
        if !longest.is_finite() {
            return Err(ReplayError::Unusable("a residual"));
        }
        library.longest = longest;
        library.mean_square = (sum / expected as f64) as f32;
        Ok(library)
    }

    /// The library with all residuals multiplied by a factor.
    ///
    /// # Errors
    /// A factor that is negative or makes a residual that is not finite.
    pub fn scaled(self, factor: f32) -> Result<Self, ReplayError> {
        let scales = self.scales.iter().map(|scale| factor * scale).collect();
        Self::new(self.clips, self.keys, self.residuals, scales)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Returns false: a library has a frame at least.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Number R of coefficients.
    pub fn coefficients(&self) -> usize {
        self.scales.len()
    }

    /// Number of frames of each clip.
    pub fn clips(&self) -> &[u32] {
        &self.clips
    }

    /// Keys of all frames.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Residuals in units of [`scales`](Self::scales), frames × R.
    pub fn residuals(&self) -> &[i8] {
        &self.residuals
    }

    /// Unit of each coefficient's residuals, metres.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Key of one frame.
    pub(super) fn key(&self, frame: u32) -> &Key {
        &self.keys[frame as usize]
    }

    /// Number of frames that follow a frame in its clip.
    pub(super) fn remaining(&self, frame: u32) -> u32 {
        self.remaining[frame as usize]
    }

    /// Frame before one in its clip, or the frame itself at the start of the clip.
    pub(super) fn before(&self, frame: u32) -> u32 {
        let before = frame.saturating_sub(1);
        match self.remaining(before) > self.remaining(frame) {
            true => before,
            false => frame,
        }
    }

    /// Length of the longest residual, metres.
    pub(super) fn longest(&self) -> f32 {
        self.longest
    }

    /// Mean of the squared lengths of all residuals, m².
    pub(super) fn mean_square(&self) -> f32 {
        self.mean_square
    }

    /// Residual of a frame, R coefficients in metres.
    pub(super) fn residual(&self, frame: u32) -> impl Iterator<Item = f32> {
        let count = self.scales.len();
        let units = &self.residuals[frame as usize * count..][..count];
        units
            .iter()
            .zip(&self.scales)
            .map(|(x, scale)| f32::from(*x) * scale)
    }

    fn square(&self, frame: u32) -> f32 {
        self.residual(frame).map(|x| x * x).sum()
    }

    /// Adds the residual between a frame and the next one of its clip, linearly interpolated.
    pub(super) fn add_between(&self, frame: u32, fraction: f32, coefficients: &mut [f32]) {
        let next = frame + self.remaining(frame).min(1);
        let both = self.residual(frame).zip(self.residual(next));
        for (a, (now, then)) in coefficients.iter_mut().zip(both) {
            *a += now + (then - now) * fraction;
        }
    }
}
