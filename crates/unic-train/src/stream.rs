//! Named random streams: every number of a run comes from (seed, stream, step).

use rand::{SeedableRng, rngs::ChaCha8Rng};

/// What random numbers are for. Streams do not see one another: changing how many numbers one
/// draws leaves the others as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// First values of the parameters; the step is the number of the layer.
    Parameters = 1,
    /// Which windows of which clips, and which of their vertices.
    Windows = 2,
    /// Dropout masks.
    Dropout = 3,
    /// Gumbel noise.
    Gumbel = 4,
    /// Noise on the state that a window starts from.
    StateNoise = 5,
    /// Choice of a validation clip.
    Validation = 6,
    /// Windows and dropout masks of the prior's recurrence.
    Recurrence = 8,
    /// Sample of the training clips that one-step errors are measured on.
    OneStep = 9,
}

/// The generator of one stream at one step.
pub fn generator(seed: u64, stream: Stream, step: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(stream as u64).to_le_bytes());
    key[16..24].copy_from_slice(&step.to_le_bytes());
    ChaCha8Rng::from_seed(key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn a_stream_depends_on_seed_name_and_step_alone() {
        let draw = |seed, stream, step| generator(seed, stream, step).random::<u64>();
        assert_eq!(draw(1, Stream::Gumbel, 5), draw(1, Stream::Gumbel, 5));
        assert_ne!(draw(1, Stream::Gumbel, 5), draw(2, Stream::Gumbel, 5));
        assert_ne!(draw(1, Stream::Gumbel, 5), draw(1, Stream::Dropout, 5));
        assert_ne!(draw(1, Stream::Gumbel, 5), draw(1, Stream::Gumbel, 6));
    }
}
