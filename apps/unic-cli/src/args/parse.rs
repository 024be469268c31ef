//! Values that are no plain numbers or paths.

use crate::limits;
use std::{num::NonZeroUsize, ops::Range, time::Duration};
use unic_io::{LowPass, capture::JointReference};

pub(super) fn budget(text: &str) -> Result<Duration, String> {
    let budget = humantime::parse_duration(text).map_err(|e| format!("{e}; write 90s, 45m or 1h 30m"))?;
    match budget.is_zero() {
        true => Err("a time above zero, such as 45m, is needed".into()),
        false => Ok(budget),
    }
}

pub(super) fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let most = limits::most_threads();
    let count: Option<NonZeroUsize> = text.parse().ok();
    count
        .filter(|count| count.get() <= most)
        .ok_or_else(|| format!("a whole number from 1 to {most} is needed on this machine"))
}

pub(super) fn low_pass(text: &str) -> Result<LowPass, String> {
    match text.parse::<f32>() {
        Ok(0.0) => Ok(LowPass::Off),
        Ok(hertz) if hertz.is_finite() && hertz > 0.0 => Ok(LowPass::Hertz(hertz)),
        _ => Err("a frequency in Hz is needed, such as 8, or 0 for none".into()),
    }
}

pub(super) fn frame_rate(text: &str) -> Result<f32, String> {
    let fps: Option<f32> = text.parse().ok().filter(|fps| (1.0..=1000.0).contains(fps));
    fps.ok_or_else(|| "a frame rate from 1 to 1000 is needed, such as 30".into())
}

pub(super) fn percent(text: &str) -> Result<f32, String> {
    let percent: Option<f32> = text.parse().ok().filter(|p: &f32| *p > 0.0 && *p <= 100.0);
    percent.ok_or_else(|| "a number above 0 and up to 100 is needed, such as 25".into())
}

pub(super) fn seconds(text: &str) -> Result<f32, String> {
    let seconds: Option<f32> = text.parse().ok().filter(|s: &f32| s.is_finite() && *s > 0.0);
    seconds.ok_or_else(|| "a number of seconds above zero is needed, such as 10".into())
}

pub(super) fn speed(text: &str) -> Result<f32, String> {
    let speed: Option<f32> = text.parse().ok().filter(|s| (0.0..=50.0).contains(s));
    speed.ok_or_else(|| "a speed from 0 to 50 m/s is needed, such as 2.5".into())
}

pub(super) fn contacts(text: &str) -> Result<[JointReference; 4], String> {
    let joint = |name: &str| match name.parse() {
        Ok(index) => JointReference::Index(index),
        Err(_) => JointReference::Name(name.to_owned()),
    };
    let joints: Vec<JointReference> = text.split(',').map(|name| joint(name.trim())).collect();
    <[JointReference; 4]>::try_from(joints)
        .map_err(|found| format!("four joints are needed, such as 7,10,8,11; found {}", found.len()))
}

pub(super) fn thickness(text: &str) -> Result<f32, String> {
    let mm: Option<f32> = text.parse().ok().filter(|mm| (0.0..=50.0).contains(mm));
    mm.ok_or_else(|| "a distance from 0 to 50 mm is needed, such as 3".into())
}

pub(super) fn vector(text: &str) -> Result<glam::Vec3, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map_while(|part| part.trim().parse().ok())
        .collect();
    let vector = <[f32; 3]>::try_from(numbers).ok().map(glam::Vec3::from);
    vector
        .filter(|v| v.is_finite())
        .ok_or_else(|| "three numbers X,Y,Z are needed, such as 0,0,-3".into())
}

pub(super) fn frames(text: &str) -> Result<Range<usize>, String> {
    let parsed = text
        .split_once("..")
        .and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    let range: Option<Range<usize>> = parsed.filter(|r: &Range<usize>| r.start < r.end);
    range.ok_or_else(|| "two whole numbers A..B with A below B are needed, such as 60..240".into())
}
