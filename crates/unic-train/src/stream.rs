//! Named random streams: every number of a run comes from (seed, stream, step).

use rand::{SeedableRng, rngs::ChaCha8Rng};

/// Purpose of random numbers. Streams are independent: the amount of numbers that one draws does
/// not change the others. The discriminants are part of the seed and must not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// First values of the parameters; the step is the number of the layer.
    Parameters = 1,
    /// Choice of clips, windows and vertices.
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
    /// Vertices on which a field's size is judged.
    Sizing = 10,
}

/// Creates the generator of one stream at one step.
pub fn generator(seed: u64, stream: Stream, step: u64) -> ChaCha8Rng {
    // Every number has bytes of its own in the key, so no two generators share a sequence.
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
