//! Replay of residuals: variation of the garment that the motion does not determine.
//!
//! For training, which collects the residuals, and for other implementations of a step. Engines get
//! it from their animator.
//!
//! Fine wrinkles depend on the garment's past, because cloth sticks to the body and to itself. No
//! function of the motion predicts them, and a garment without them looks dead. A [`Replay`] holds
//! the residuals of the training clips: coefficients of what a prior lacks which has not seen the
//! clip. While the character moves, the residuals of a stretch with a similar motion are added to
//! the prediction (motion matching, with garments for answers).
//!
//! Residuals are those of the prior's last R coefficients. Training gives them components of their
//! own, the shapes of fine wrinkles, which the motion does not move.
//!
//! 1. The key of a frame is its motion vector, projected on a few principal components, and the
//!    logarithm of its *activity*: how fast the motion vector changes.
//! 2. The stretch plays at the speed of the activity. A still body has a still garment.
//! 3. Four times a second a search compares the keys of all frames with the present one. It goes to
//!    another stretch only where that is better by a margin, and not within a second of the last
//!    switch. At the end of a clip it goes to the best frame at once.
//! 4. A sequence that begins at the mean shape begins with the whole residual of a stretch. A garment
//!    that was given has wrinkles of its own: the residual grows as they are forgotten (see
//!    [`StartMemory`](crate::animator::StartMemory)).
//! 5. The step at a switch becomes an offset that decays with the activity, so there is no jump.
//!
//! Keys are integers, so their distances are exact.

mod key;
mod library;
mod search;
#[cfg(test)]
mod tests;

pub use key::{Activity, FEATURES, KEY, Key, KeyMap};
pub use library::{Library, MOST_FRAMES, ReplayError};

use key::{KEY_STEPS, distance};
use serde::{Deserialize, Serialize};

/// Time from one search to the next, seconds.
const SEARCH_S: f32 = 0.25;

/// Least time between two switches, seconds.
pub const LEAST_STRETCH_S: f32 = 1.0;

/// Time constant of the offset that a switch leaves, seconds at full speed.
const FADE_S: f32 = 1.0;

/// Largest speed of a stretch, frames a tick. Residuals that run faster flutter.
const FASTEST: f32 = 1.25;

/// Advantage that another stretch must have, in squared units of a key.
const MARGIN: f32 = 1.0;

/// Largest length of an offset by that of the library's longest residual. A bound for every motion.
const LONGEST_OFFSET: f32 = 4.0;

/// Residuals of training clips with the keys to find them. An asset.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    keys: KeyMap,
    library: Library,
}

/// Place of a garment in the library. Part of an animator's state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplayState {
    activity: Activity,
    /// Stretch that plays; none until the first tick.
    stretch: Option<Stretch>,
    /// Remainder of the steps at switches, R coefficients in metres.
    offset: Vec<f32>,
}

/// Buffers of a replay.
#[derive(Clone, Debug, Default)]
pub struct ReplayScratch {
    /// Present residual, R coefficients in metres.
    residual: Vec<f32>,
}

/// Stretch of a clip that plays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stretch {
    /// Frame of the library.
    frame: u32,
    /// Way to the next frame, 0 to 1.
    fraction: f32,
    /// Ticks since the switch to the stretch.
    held: u32,
}

impl Replay {
    /// Makes a replay of a library whose keys were made by `keys`.
    pub fn new(keys: KeyMap, library: Library) -> Self {
        Self { keys, library }
    }

    /// The replay with all residuals multiplied by a factor.
    ///
    /// # Errors
    /// A factor that is negative or makes a residual that is not finite.
    pub fn scaled(self, factor: f32) -> Result<Self, ReplayError> {
        Ok(Self::new(self.keys, self.library.scaled(factor)?))
    }

    /// Map from motion to keys.
    pub fn keys(&self) -> &KeyMap {
        &self.keys
    }

    /// Residuals and keys.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Returns the state of a new sequence, in which nothing plays until it [begins](Self::begin).
    pub fn start(&self) -> ReplayState {
        ReplayState {
            activity: Activity::default(),
            stretch: None,
            offset: vec![0.0; self.library.coefficients()],
        }
    }

    /// Begins a new sequence at the stretch whose motion is nearest to that of the first tick, with
    /// the whole of its residual.
    ///
    /// `pair` is the normalised motion vectors of the first two frames, one after the other, `dt` the
    /// time between them in seconds. Without a stretch that is long enough nothing plays yet.
    pub fn begin(&self, pair: &[f32], dt: f32, state: &mut ReplayState) {
        state.activity = Activity::of(pair, dt);
        let key = self.keys.key(pair, state.activity);
        let best = self.library.best(&key, &[], ticks(LEAST_STRETCH_S, dt));
        // The key is that of the first tick, which plays one frame on.
        state.stretch = best.map(|best| Stretch::at(self.library.before(best.frame)));
        state.offset.fill(0.0);
    }

    /// Advances a state by one tick of `dt` seconds, given the normalised motion vectors of the
    /// previous and the present frame, one after the other.
    pub fn advance(&self, pair: &[f32], dt: f32, state: &mut ReplayState, scratch: &mut ReplayScratch) {
        state.activity.follow(pair, dt);
        if let Some(stretch) = &mut state.stretch {
            let speed =
                (state.activity.rate() / KeyMap::rate_of(self.library.key(stretch.frame))).min(FASTEST);
            let decay = (-speed.min(1.0) * dt / FADE_S).exp();
            state.offset.iter_mut().for_each(|x| *x *= decay);
            stretch.play(speed, &self.library);
        }
        if state.stretch.is_none_or(|stretch| self.is_due(stretch, dt)) {
            self.search(pair, dt, state, scratch);
        }
    }

    /// Adds the present residual to the last R of a prior's coefficients, in metres.
    ///
    /// # Panics
    /// When there are fewer coefficients than R.
    pub fn add_to(&self, state: &ReplayState, coefficients: &mut [f32]) {
        let Some(stretch) = state.stretch else { return };
        let first = coefficients.len() - self.library.coefficients();
        let coefficients = &mut coefficients[first..];
        self.library
            .add_between(stretch.frame, stretch.fraction, coefficients);
        let pairs = coefficients.iter_mut().zip(&state.offset);
        pairs.for_each(|(a, offset)| *a += offset);
    }

    /// Checks a saved state.
    ///
    /// # Errors
    /// Another number of coefficients, a frame beyond the library, numbers that are not finite.
    pub fn check(&self, state: &ReplayState) -> Result<(), ReplayError> {
        let (expected, found) = (self.library.coefficients(), state.offset.len());
        if expected != found {
            return Err(ReplayError::Coefficients { expected, found });
        }
        let mut numbers = state.offset.iter().copied().chain([state.activity.rate()]);
        let is_within =
            |s: &Stretch| (s.frame as usize) < self.library.len() && (0.0..=1.0).contains(&s.fraction);
        // A negative activity would let the offset grow.
        let is_active = state.activity.rate() >= 0.0;
        match is_active && numbers.all(|x| x.is_finite()) && state.stretch.iter().all(is_within) {
            true => Ok(()),
            false => Err(ReplayError::Unusable("a state")),
        }
    }

    fn is_due(&self, stretch: Stretch, dt: f32) -> bool {
        let is_tick = stretch.held.is_multiple_of(ticks(SEARCH_S, dt));
        is_tick && (self.has_ended(stretch) || stretch.held >= ticks(LEAST_STRETCH_S, dt))
    }

    fn has_ended(&self, stretch: Stretch) -> bool {
        self.library.remaining(stretch.frame) == 0
    }

    /// Goes to the best frame where it is better than the present one by the margin.
    fn search(&self, pair: &[f32], dt: f32, state: &mut ReplayState, scratch: &mut ReplayScratch) {
        let residual = &mut scratch.residual;
        residual.clear();
        residual.resize(state.offset.len(), 0.0);
        // Zero where nothing plays.
        self.add_to(state, residual);
        let key = self.keys.key(pair, state.activity);
        let Some(best) = self.library.best(&key, residual, ticks(LEAST_STRETCH_S, dt)) else {
            return;
        };
        let is_better = |stretch: Stretch| {
            let kept = distance(&key, self.library.key(stretch.frame)) as f32;
            self.has_ended(stretch) || best.cost + MARGIN * KEY_STEPS * KEY_STEPS < kept
        };
        if state.stretch.is_none_or(is_better) {
            self.switch(best.frame, residual, state);
        }
    }

    /// Begins a stretch; `residual` is the present one, which the offset continues.
    fn switch(&self, frame: u32, residual: &[f32], state: &mut ReplayState) {
        state.stretch = Some(Stretch::at(frame));
        state.offset.fill(0.0);
        self.library.add_between(frame, 0.0, &mut state.offset);
        let pairs = state.offset.iter_mut().zip(residual);
        pairs.for_each(|(offset, residual)| *offset = residual - *offset);
        let length = state.offset.iter().map(|x| x * x).sum::<f32>().sqrt();
        let limit = LONGEST_OFFSET * self.library.longest();
        if length > limit {
            state.offset.iter_mut().for_each(|x| *x *= limit / length);
        }
    }
}

impl Stretch {
    /// Begins at a frame.
    fn at(frame: u32) -> Self {
        Self {
            frame,
            fraction: 0.0,
            held: 0,
        }
    }

    /// Plays a part of a frame, up to the end of the clip.
    fn play(&mut self, speed: f32, library: &Library) {
        self.held = self.held.saturating_add(1);
        self.fraction += speed;
        while self.fraction >= 1.0 {
            if library.remaining(self.frame) == 0 {
                self.fraction = 0.0;
                return;
            }
            (self.frame, self.fraction) = (self.frame + 1, self.fraction - 1.0);
        }
    }
}

/// Number of ticks in a time.
fn ticks(seconds: f32, dt: f32) -> u32 {
    ((seconds / dt).round() as u32).max(1)
}
