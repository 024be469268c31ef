//! The range of frame rates that readers accept.

/// Checks that a frame rate is from 1 to 1000 Hz; `Err` holds the rate as text.
///
/// Rates outside that range come from damaged files or wrong units, and resampling to them would
/// allocate an absurd number of frames. NaN is refused too: no range contains it.
pub(crate) fn check_frame_rate(fps: f64) -> Result<(), String> {
    if (1.0..=1000.0).contains(&fps) {
        return Ok(());
    }
    Err(fps.to_string())
}
