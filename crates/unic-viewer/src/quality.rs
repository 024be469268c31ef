//! Quality of pictures, from which the frame rate follows.

/// Cost of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Antialiasing.
    pub samples: Samples,
    /// Side of the drawn picture by that of the shown one, 0 to 1.
    pub scale: f32,
    /// Side of the shadow maps, pixels.
    pub shadow_size: u32,
    /// Number of samples of a shadow.
    pub shadow_taps: u32,
}

/// Samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Samples {
    /// One.
    One,
    /// Four: antialiased edges.
    Four,
}

impl Samples {
    pub(crate) fn count(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Four => 4,
        }
    }
}

impl Quality {
    /// Steps from the best to the cheapest.
    pub const STEPS: [Self; 6] = [
        Self::new(Samples::Four, 1.0, 2048, 20),
        Self::new(Samples::Four, 1.0, 1024, 10),
        Self::new(Samples::One, 1.0, 1024, 6),
        Self::new(Samples::One, 0.7, 512, 4),
        Self::new(Samples::One, 0.5, 512, 3),
        Self::new(Samples::One, 0.35, 256, 2),
    ];

    /// Best quality.
    pub const BEST: Self = Self::STEPS[0];

    const fn new(samples: Samples, scale: f32, shadow_size: u32, shadow_taps: u32) -> Self {
        Self {
            samples,
            scale,
            shadow_size,
            shadow_taps,
        }
    }
}

/// Chooses the step of the quality by the measured time of frames.
///
/// It goes down after half a second of slow frames and never up again, so that pictures do not
/// change for ever.
#[derive(Clone, Copy, Debug)]
pub struct QualityControl {
    step: usize,
    slow_s: f32,
    limit_s: f32,
}

/// Time of slow frames after which the quality goes down, seconds.
const PATIENCE_S: f32 = 0.5;
/// Most that one frame counts, seconds. A pause of the window is no slower than a slow frame.
const MOST_S: f32 = 0.1;

impl QualityControl {
    /// Starts at the best quality; frames may take `limit_s` seconds.
    pub fn new(limit_s: f32) -> Self {
        Self {
            step: 0,
            slow_s: 0.0,
            limit_s,
        }
    }

    /// Starts at a step of [`Quality::STEPS`], or the last one.
    #[must_use]
    pub fn from_step(self, step: usize) -> Self {
        let step = step.min(Quality::STEPS.len() - 1);
        Self { step, ..self }
    }

    /// Current quality.
    pub fn quality(&self) -> Quality {
        Quality::STEPS[self.step]
    }

    /// Index of the current quality in [`Quality::STEPS`].
    pub fn step(&self) -> usize {
        self.step
    }

    /// Takes the time of a frame, seconds.
    pub fn frame(&mut self, seconds: f32) {
        if seconds <= self.limit_s {
            self.slow_s = 0.0;
            return;
        }
        self.slow_s += seconds.min(MOST_S);
        if self.slow_s > PATIENCE_S && self.step + 1 < Quality::STEPS.len() {
            self.step += 1;
            self.slow_s = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quality_goes_down_while_frames_are_slow_and_stays_when_they_are_fast() {
        let mut control = QualityControl::new(1.0 / 15.0);
        for _ in 0..100 {
            control.frame(0.02);
        }
        assert_eq!(control.step(), 0);
        // One slow frame, such as a shader's first or a sleeping computer's, changes nothing.
        for pause_s in [0.4, 0.69, 5.0, 3600.0] {
            control.frame(pause_s);
            control.frame(0.02);
            assert_eq!(control.step(), 0);
        }
        for _ in 0..6 {
            control.frame(0.1);
        }
        assert_eq!(control.step(), 1);
        for _ in 0..6 {
            control.frame(1.2);
        }
        assert_eq!(control.step(), 2);
        for _ in 0..1000 {
            control.frame(0.1);
        }
        assert_eq!(Some(&control.quality()), Quality::STEPS.last());
    }
}
