//! Parsers of option values that have a range or a form of their own.
//!
//! Each returns the text that clap prints after "invalid value": what was expected, with an
//! example.

use crate::limits;
use std::{num::NonZeroUsize, ops::Range, time::Duration};
use unic_io::{LowPass, capture::JointReference};

/// Parses a duration above zero, such as `90s` or `1h 30m`.
pub fn budget(text: &str) -> Result<Duration, String> {
    let budget = humantime::parse_duration(text).map_err(|e| format!("{e}; write 90s, 45m or 1h 30m"))?;
    match budget.is_zero() {
        true => Err("expected a time above zero, such as 45m".into()),
        false => Ok(budget),
    }
}

/// Parses a number of threads that this machine can be asked to start.
pub(crate) fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let most = limits::most_threads();
    let count: Option<NonZeroUsize> = text.parse().ok();
    count
        .filter(|count| count.get() <= most)
        .ok_or_else(|| format!("expected a whole number from 1 to {most} on this machine"))
}

/// Parses a cutoff frequency in Hz; 0 turns the filter off.
pub(super) fn low_pass(text: &str) -> Result<LowPass, String> {
    match text.parse::<f32>() {
        Ok(0.0) => Ok(LowPass::Off),
        Ok(hertz) if hertz.is_finite() && hertz > 0.0 => Ok(LowPass::Hertz(hertz)),
        _ => Err("expected a frequency in Hz such as 8, or 0 for no filter".into()),
    }
}

/// Parses a frame rate, frames per second. The range is that of captures.
pub(super) fn frame_rate(text: &str) -> Result<f32, String> {
    // `contains` is false for NaN, which `f32` parses: here and below no range lets it through.
    let fps: Option<f32> = text.parse().ok().filter(|fps| (1.0..=1000.0).contains(fps));
    fps.ok_or_else(|| "expected a frame rate from 1 to 1000, such as 30".into())
}

/// Parses a factor of lengths above zero.
pub(super) fn scale(text: &str) -> Result<f32, String> {
    let scale: Option<f32> = text.parse().ok().filter(|s| (1e-6..=1e6).contains(s));
    scale.ok_or_else(|| "expected a factor from 0.000001 to 1000000, such as 0.01 for centimetres".into())
}

/// Parses a share of vertices in percent.
pub(super) fn percent(text: &str) -> Result<f32, String> {
    let percent: Option<f32> = text.parse().ok().filter(|p: &f32| *p > 0.0 && *p <= 100.0);
    percent.ok_or_else(|| "expected a number above 0 and up to 100, such as 25".into())
}

/// Parses a share from 0 to 1.
pub(super) fn share(text: &str) -> Result<f32, String> {
    let share: Option<f32> = text.parse().ok().filter(|s| (0.0..=1.0).contains(s));
    share.ok_or_else(|| "expected a number from 0 to 1, such as 0.5".into())
}

/// Parses a colour, sRGB, of six hexadecimal digits after an optional `#`.
#[cfg(feature = "viewer")]
pub(super) fn colour(text: &str) -> Result<[f32; 3], String> {
    let digits = text.strip_prefix('#').unwrap_or(text);
    let is_colour = digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_colour);
    let [_, red, green, blue] = number
        .ok_or("expected six hexadecimal digits, such as 2a4073")?
        .to_be_bytes();
    Ok([red, green, blue].map(|byte| f32::from(byte) / 255.0))
}

/// Parses the width and the height of pictures, pixels.
#[cfg(feature = "viewer")]
pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x');
    let parse = |side: &str| side.parse().ok().filter(|side| (16..=4096).contains(side));
    let size = sides.and_then(|(width, height)| Some([parse(width)?, parse(height)?]));
    size.ok_or_else(|| "expected width and height from 16 to 4096 pixels, such as 640x360".into())
}

/// Parses a number of characters.
#[cfg(feature = "viewer")]
pub(super) fn characters(text: &str) -> Result<usize, String> {
    let count: Option<usize> = text.parse().ok().filter(|count| (1..=64).contains(count));
    count.ok_or_else(|| "expected a whole number from 1 to 64".into())
}

/// Parses a length of time in seconds.
pub(super) fn seconds(text: &str) -> Result<f32, String> {
    let seconds: Option<f32> = text.parse().ok().filter(|s: &f32| s.is_finite() && *s > 0.0);
    seconds.ok_or_else(|| "expected a number of seconds above zero, such as 10".into())
}

/// Parses a time from zero on, in seconds.
#[cfg(feature = "viewer")]
pub(super) fn time(text: &str) -> Result<f32, String> {
    let seconds: Option<f32> = text.parse().ok().filter(|s: &f32| s.is_finite() && *s >= 0.0);
    seconds.ok_or_else(|| "expected a time from 0 s on, such as 1.5".into())
}

/// Parses a length in millimetres.
#[cfg(feature = "viewer")]
pub(super) fn millimetres(text: &str) -> Result<f32, String> {
    let length: Option<f32> = text.parse().ok().filter(|mm| (0.1..=10_000.0).contains(mm));
    length.ok_or_else(|| "expected a length from 0.1 to 10000 mm, such as 50".into())
}

/// Parses a wind speed from 0 to 50 m/s.
pub(super) fn speed(text: &str) -> Result<f32, String> {
    let speed: Option<f32> = text.parse().ok().filter(|s| (0.0..=50.0).contains(s));
    speed.ok_or_else(|| "expected a speed from 0 to 50 m/s, such as 2.5".into())
}

/// Parses the four joints that touch the ground, each a name or an index from 0.
pub(super) fn contacts(text: &str) -> Result<[JointReference; 4], String> {
    let joint = |name: &str| match name.parse() {
        Ok(index) => JointReference::Index(index),
        Err(_) => JointReference::Name(name.to_owned()),
    };
    let joints: Vec<JointReference> = text.split(',').map(|name| joint(name.trim())).collect();
    <[JointReference; 4]>::try_from(joints)
        .map_err(|found| format!("expected four joints such as 7,10,8,11, found {}", found.len()))
}

/// Parses a distance between cloth and body in millimetres.
pub(super) fn thickness(text: &str) -> Result<f32, String> {
    let mm: Option<f32> = text.parse().ok().filter(|mm| (0.0..=50.0).contains(mm));
    mm.ok_or_else(|| "expected a distance from 0 to 50 mm, such as 3".into())
}

/// Parses a vector of three finite numbers, `X,Y,Z`.
pub(super) fn vector(text: &str) -> Result<glam::Vec3, String> {
    // A part that is no number ends the list, which then has the wrong length.
    let numbers: Vec<f32> = text
        .split(',')
        .map_while(|part| part.trim().parse().ok())
        .collect();
    let vector = <[f32; 3]>::try_from(numbers).ok().map(glam::Vec3::from);
    vector
        .filter(|v| v.is_finite())
        .ok_or_else(|| "expected three numbers X,Y,Z, such as 0,0,-3".into())
}

/// Parses a non-empty range of frames, `A..B` without B.
pub(super) fn frames(text: &str) -> Result<Range<usize>, String> {
    let parsed = text
        .split_once("..")
        .and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    let range: Option<Range<usize>> = parsed.filter(|r: &Range<usize>| r.start < r.end);
    range.ok_or_else(|| "expected two whole numbers A..B with A below B, such as 60..240".into())
}
