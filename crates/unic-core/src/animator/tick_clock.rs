//! Ticks of a model within the frames of a display.

/// Share of a tick by which a tick may be early, so that sums of rounded frame times do not put it
/// off by a frame.
const EARLY: f64 = 1e-3;

/// Clock that says when a garment ticks, for displays of any rate.
///
/// A frame passes its time with [`advance`](Self::advance) and then takes the ticks that are due. The
/// ticks of a frame are spread over it, so that each has the pose of its own moment. A frame that is
/// longer than the most ticks is cut: its ticks have the poses from its start to its end, further
/// apart than usual, and the garment moves slowly rather than the program.
///
/// ```
/// use unic_core::TickClock;
///
/// let mut clock = TickClock::new(30.0);
/// clock.advance(1.0 / 60.0, 4);
/// assert_eq!(clock.take(), None);
/// // Between ticks the display interpolates.
/// assert!((clock.share() - 0.5).abs() < 1e-6);
/// clock.advance(1.0 / 60.0, 4);
/// while let Some(moment) = clock.take() {
///     // A step of the animator, on the pose between those of the last frame (0) and of this one (1).
///     assert_eq!(moment, 1.0);
/// }
/// assert_eq!(clock.share(), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickClock {
    /// Time between two ticks.
    tick_s: f64,
    /// Time since the last tick; below 0 after a tick that was early.
    since_tick_s: f64,
    /// Length of the frame, as far as it counts.
    frame_s: f64,
}

impl TickClock {
    /// Makes a clock that has just ticked. `fps` are the ticks a second, above 0.
    pub fn new(fps: f32) -> Self {
        Self {
            tick_s: 1.0 / f64::from(fps),
            since_tick_s: 0.0,
            frame_s: 0.0,
        }
    }

    /// Begins anew, after a reset of the animator: a tick has just happened.
    pub fn restart(&mut self) {
        self.since_tick_s = 0.0;
        self.frame_s = 0.0;
    }

    /// Passes the time of a frame, seconds. At most `most_ticks` are due then; ticks that an earlier
    /// frame has left are counted too, and those beyond are dropped.
    ///
    /// Time below 0 and NaN pass nothing.
    pub fn advance(&mut self, frame_s: f64, most_ticks: u32) {
        let most_s = f64::from(most_ticks) * self.tick_s;
        // `max` gives 0 for NaN.
        self.frame_s = frame_s.max(0.0).min(most_s);
        self.since_tick_s = (self.since_tick_s + self.frame_s).min(most_s);
    }

    /// Takes a tick that is due; none if there is none. Returns its moment within the frame, from its
    /// start, 0, to its end, 1.
    pub fn take(&mut self) -> Option<f32> {
        if self.since_tick_s < self.tick_s * (1.0 - EARLY) {
            return None;
        }
        self.since_tick_s -= self.tick_s;
        // Exactly 1 for a tick at the end of the frame, whose pose needs no interpolation.
        if self.frame_s <= 0.0 || self.since_tick_s <= EARLY * self.tick_s {
            return Some(1.0);
        }
        Some((1.0 - self.since_tick_s / self.frame_s).max(0.0) as f32)
    }

    /// Way from the last tick to the next one, 0 to 1.
    pub fn share(&self) -> f32 {
        (self.since_tick_s / self.tick_s).clamp(0.0, 1.0) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: u32 = 4;

    /// Moments of the ticks in a frame.
    fn frame(clock: &mut TickClock, frame_s: f64) -> Vec<f32> {
        clock.advance(frame_s, MOST);
        std::iter::from_fn(|| clock.take()).collect()
    }

    #[track_caller]
    fn assert_near(found: &[f32], expected: &[f32]) {
        let near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-5;
        let fits = found.len() == expected.len() && found.iter().zip(expected).all(near);
        assert!(fits, "expected {expected:?}, found {found:?}");
    }

    #[test]
    fn ticks_follow_the_time_at_any_frame_rate() {
        for rate in [10.0, 24.0, 30.0, 59.94, 60.0, 90.0, 144.0] {
            let mut clock = TickClock::new(30.0);
            let frames = (20.0 * rate) as usize;
            let mut ticks = 0;
            for _ in 0..frames {
                let moments = frame(&mut clock, 1.0 / rate);
                assert!(moments.is_sorted() && moments.iter().all(|m| (0.0..=1.0).contains(m)));
                assert!((0.0..=1.0).contains(&clock.share()));
                ticks += moments.len();
            }
            let expected = 30.0 * frames as f64 / rate;
            assert!(
                (ticks as f64 - expected).abs() <= 1.0,
                "{rate}: {ticks} ticks, {expected} expected"
            );
        }
    }

    /// Engines round frame times to nanoseconds or to f32.
    #[test]
    fn sums_of_rounded_frame_times_put_no_tick_off() {
        let exact: f64 = 1.0 / 60.0;
        let nanoseconds = (exact * 1e9).floor() / 1e9;
        // Eight minutes. The sums are off by up to a nanosecond a frame.
        for rounded in [exact, f64::from(exact as f32), nanoseconds] {
            let mut clock = TickClock::new(30.0);
            for number in 1..=30_000 {
                let expected: &[f32] = if number % 2 == 0 { &[1.0] } else { &[] };
                assert_eq!(
                    frame(&mut clock, rounded),
                    expected,
                    "frame {number} of {rounded} s"
                );
            }
        }
    }

    #[test]
    fn ticks_are_spread_over_their_frame() {
        let mut clock = TickClock::new(30.0);
        assert_near(&frame(&mut clock, 0.1), &[1.0 / 3.0, 2.0 / 3.0, 1.0]);
        // What is left of a frame counts in the next one.
        assert_near(&frame(&mut clock, 0.05), &[2.0 / 3.0]);
        assert!((clock.share() - 0.5).abs() < 1e-6);
        assert_near(&frame(&mut clock, 0.05), &[1.0 / 3.0, 1.0]);
    }

    #[test]
    fn a_stop_of_seconds_is_cut_to_the_most_ticks_from_its_start_to_its_end() {
        let mut clock = TickClock::new(30.0);
        assert_near(&frame(&mut clock, 0.02), &[]);
        assert_near(&frame(&mut clock, 5.0), &[0.25, 0.5, 0.75, 1.0]);
        assert!(clock.share() < 1e-6);
        assert_near(&frame(&mut clock, 1.0 / 30.0), &[1.0]);
    }

    #[test]
    fn ticks_that_are_not_taken_wait_and_are_dropped_in_the_end() {
        let mut clock = TickClock::new(30.0);
        for _ in 0..10 {
            clock.advance(1.0 / 30.0, MOST);
        }
        assert_eq!(clock.share(), 1.0);
        let moments: Vec<f32> = std::iter::from_fn(|| clock.take()).collect();
        // Older ticks than the frame have the pose of its start.
        assert_near(&moments, &[0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_pause_passes_nothing() {
        let mut clock = TickClock::new(30.0);
        frame(&mut clock, 0.02);
        let before = clock.share();
        for time in [0.0, -1.0, f64::NAN] {
            assert_near(&frame(&mut clock, time), &[]);
            assert_eq!(clock.share(), before);
        }
        assert_near(&frame(&mut clock, 0.02), &[1.0 - (0.04 - 1.0 / 30.0) / 0.02]);
    }

    #[test]
    fn a_teleport_begins_anew() {
        let mut clock = TickClock::new(30.0);
        clock.advance(0.05, MOST);
        clock.restart();
        assert_eq!((clock.take(), clock.share()), (None, 0.0));
        assert_eq!(clock, TickClock::new(30.0));
    }
}
