//! Frame rates of files: their range, and rates that are rounded in files.

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

/// Relative distance from a whole number up to which a frame rate is rounded.
const WHOLE_TOLERANCE: f64 = 2e-4;

/// Rounds a frame rate within 0.02 % of a whole number to it: files hold few digits of the time from
/// frame to frame, and .0083333 s is 120 fps.
pub(crate) fn whole_rate(fps: f64) -> f64 {
    let whole = fps.round();
    // 29.97 and 23.976 fps are 0.1 % from a whole number and stay as they are.
    match (fps - whole).abs() < WHOLE_TOLERANCE * whole {
        true => whole,
        false => fps,
    }
}
