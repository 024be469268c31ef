//! Animations: transforms of nodes at any time.

use super::container::Container;
use crate::{
    error::Result,
    frame_rate::{check_frame_rate, whole_rate},
};
use glam::{Quat, Vec3, Vec4};
use gltf::{
    accessor::Dimensions,
    animation::{Interpolation, Property},
};
use unic_scene::{Local, Motion, Node, Track, check_length};

/// Frames per second of an animation whose keys do not show a rate.
pub(super) const DEFAULT_FPS: f32 = 30.0;
/// Smallest rate of keys that is taken for that of frames. Keys farther apart were set by hand.
const MIN_FPS: f64 = 12.0;

/// Animation of the nodes of a file.
pub(super) struct NodeAnimation {
    /// Name, if the file has one.
    name: Option<String>,
    channels: Vec<NodeChannel>,
}

/// Values of one property of one node over time.
struct NodeChannel {
    node: usize,
    property: Property,
    interpolation: Interpolation,
    /// Ascending times of the keys, seconds; at least one.
    times: Vec<f32>,
    /// Three values for each key of a cubic spline, one otherwise.
    values: Vec<Vec4>,
}

/// Times of frames at a constant rate.
#[derive(Clone, Copy, Debug)]
struct Timeline {
    /// Time of frame 0, seconds.
    start: f64,
    fps: f32,
    frames: usize,
}

impl Timeline {
    /// Time of a frame, seconds.
    fn time(&self, frame: usize) -> f32 {
        (self.start + frame as f64 / f64::from(self.fps)) as f32
    }
}

impl NodeAnimation {
    /// Reads the first animation of a file.
    ///
    /// # Errors
    /// No animation, one without keys, times that do not ascend, other damage of the data.
    pub(super) fn read(container: &Container) -> Result<Self> {
        let Some(animation) = container.document.animations().next() else {
            return Err(container.error("an animation", "none"));
        };
        let mut channels = Vec::new();
        for channel in animation.channels() {
            channels.extend(NodeChannel::read(container, &channel)?);
        }
        if channels.is_empty() {
            return Err(container.error("an animation with keys of nodes", "none"));
        }
        Ok(Self {
            name: animation.name().map(str::to_owned),
            channels,
        })
    }

    /// Samples the animation. `fps` is the rate where the keys show none.
    ///
    /// # Errors
    /// Fewer than two frames, an animation out of proportion to the file.
    pub(super) fn motion(self, container: &Container, nodes: &[Node], fps: Option<f32>) -> Result<Motion> {
        let timeline = self.timeline(container, fps)?;
        let mut animated: Vec<usize> = self.channels.iter().map(|channel| channel.node).collect();
        animated.sort_unstable();
        animated.dedup();
        check_length(timeline.frames, animated.len(), container.length)
            .map_err(|fault| container.error(fault.expected, fault.found))?;
        let empty = |node| Track {
            node,
            locals: Vec::with_capacity(timeline.frames),
        };
        let mut tracks: Vec<Track> = animated.into_iter().map(empty).collect();
        let rest: Vec<Local> = nodes.iter().map(|node| node.local).collect();
        let mut locals = Vec::new();
        for frame in 0..timeline.frames {
            locals.clone_from(&rest);
            self.apply(timeline.time(frame), &mut locals);
            for track in &mut tracks {
                track.locals.push(locals[track.node]);
            }
        }
        Ok(Motion {
            name: self.name,
            fps: timeline.fps,
            rate: "by its keys, or by --fps".to_owned(),
            frames: timeline.frames,
            tracks,
        })
    }

    /// Returns the times of the frames: from the first key to the last one, at the rate of the
    /// channel with most keys. `fps` is the rate where the keys show none.
    ///
    /// # Errors
    /// Fewer than two frames.
    fn timeline(&self, container: &Container, fps: Option<f32>) -> Result<Timeline> {
        let ends = |channel: &NodeChannel| {
            let first = channel.times.first().copied().unwrap_or_default();
            (first, channel.times.last().copied().unwrap_or(first))
        };
        let whole = |(low, high): (f32, f32), (first, last): (f32, f32)| (low.min(first), high.max(last));
        let (start, end) = (self.channels.iter().map(ends)).fold((f32::INFINITY, f32::NEG_INFINITY), whole);
        let densest = self.channels.iter().max_by_key(|channel| channel.times.len());
        let fps = (densest.and_then(|channel| rate(&channel.times)))
            .or(fps)
            .unwrap_or(DEFAULT_FPS);
        let seconds = f64::from(end) - f64::from(start);
        // Saturates: a damaged time may be huge, and the caller compares the count with the file.
        let steps = (seconds * f64::from(fps)).round() as usize;
        match steps {
            0 => Err(container.error("at least two frames", format!("{seconds} s"))),
            _ => Ok(Timeline {
                start: start.into(),
                fps,
                frames: steps.saturating_add(1),
            }),
        }
    }

    /// Sets the transforms of the animated nodes at a time. The others stay.
    fn apply(&self, time: f32, locals: &mut [Local]) {
        for channel in &self.channels {
            let value = channel.at(time);
            let local = &mut locals[channel.node];
            match channel.property {
                Property::Translation => local.translation = value.truncate(),
                Property::Scale => local.scale = value.truncate(),
                Property::Rotation => local.rotation = rotation(value),
                Property::MorphTargetWeights => {}
            }
        }
    }
}

fn rotation(value: Vec4) -> Quat {
    Quat::from_vec4(value.normalize_or(Vec4::W))
}

/// Frames per second of keys at equal distances; None for keys that are set by hand.
fn rate(times: &[f32]) -> Option<f32> {
    let mut steps: Vec<f32> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f32::total_cmp);
    let median = f64::from(*steps.get(steps.len() / 2)?);
    // Times are f32, whose rounding a long animation shows; its mean rate is nearer.
    let (first, last) = (f64::from(*times.first()?), f64::from(*times.last()?));
    let mean = (last - first) / steps.len() as f64;
    let step = if (mean - median).abs() < 0.01 * median {
        mean
    } else {
        median
    };
    let fps = whole_rate(1.0 / step);
    (fps >= MIN_FPS && check_frame_rate(fps).is_ok()).then_some(fps as f32)
}

impl NodeChannel {
    /// Reads a channel; None for the weights of morph targets.
    fn read(container: &Container, channel: &gltf::animation::Channel) -> Result<Option<Self>> {
        let (sampler, property) = (channel.sampler(), channel.target().property());
        let dimensions = match property {
            Property::Rotation => Dimensions::Vec4,
            Property::Translation | Property::Scale => Dimensions::Vec3,
            Property::MorphTargetWeights => return Ok(None),
        };
        let times = container.floats(&sampler.input(), Dimensions::Scalar)?.values;
        let output = container.floats(&sampler.output(), dimensions)?;
        let interpolation = sampler.interpolation();
        let values_per_key = match interpolation {
            Interpolation::CubicSpline => 3,
            Interpolation::Linear | Interpolation::Step => 1,
        };
        if times.is_empty() || !times.is_sorted() {
            let found = format!("others in accessor {}", sampler.input().index());
            return Err(container.error("ascending times of keys", found));
        }
        if output.count != times.len().saturating_mul(values_per_key) {
            let expected = format!("{values_per_key} values for each of {} keys", times.len());
            return Err(container.error(expected, output.count.to_string()));
        }
        let values = match property {
            Property::Rotation => output.values.chunks_exact(4).map(Vec4::from_slice).collect(),
            _ => (output.values.chunks_exact(3))
                .map(|value| Vec3::from_slice(value).extend(0.0))
                .collect(),
        };
        Ok(Some(Self {
            node: channel.target().node().index(),
            property,
            interpolation,
            times,
            values,
        }))
    }

    /// Value at a time. Before the first key and behind the last one it is constant.
    fn at(&self, time: f32) -> Vec4 {
        let next = self.times.partition_point(|&key| key <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last {
            return self.value(next.min(last));
        }
        let key = next - 1;
        let seconds = self.times[next] - self.times[key];
        // Above zero: the key is at `time` or before, and the next one behind it.
        let along = ((time - self.times[key]) / seconds).clamp(0.0, 1.0);
        match self.interpolation {
            Interpolation::Step => self.value(key),
            Interpolation::Linear => self.linear(key, along),
            Interpolation::CubicSpline => self.cubic(key, along, seconds),
        }
    }

    /// Value of a key.
    fn value(&self, key: usize) -> Vec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            Interpolation::Linear | Interpolation::Step => self.values[key],
        }
    }

    fn linear(&self, key: usize, along: f32) -> Vec4 {
        let [a, b] = [key, key + 1].map(|key| self.value(key));
        match self.property {
            Property::Rotation => rotation(a).slerp(rotation(b), along).into(),
            _ => a.lerp(b, along),
        }
    }

    /// Hermite spline of glTF 2.0, appendix C.
    fn cubic(&self, key: usize, t: f32, seconds: f32) -> Vec4 {
        let (a, b) = (self.value(key), self.value(key + 1));
        let out_of_a = self.values[3 * key + 2] * seconds;
        let into_b = self.values[3 * (key + 1)] * seconds;
        let (t2, t3) = (t * t, t * t * t);
        a * (2.0 * t3 - 3.0 * t2 + 1.0)
            + out_of_a * (t3 - 2.0 * t2 + t)
            + b * (3.0 * t2 - 2.0 * t3)
            + into_b * (t3 - t2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(interpolation: Interpolation, values: Vec<Vec4>) -> NodeChannel {
        NodeChannel {
            node: 0,
            property: Property::Translation,
            interpolation,
            times: vec![1.0, 2.0, 4.0],
            values,
        }
    }

    #[test]
    fn values_between_keys_follow_the_interpolation() {
        let values = vec![Vec4::X, Vec4::Y, 3.0 * Vec4::Y];
        let linear = channel(Interpolation::Linear, values.clone());
        let step = channel(Interpolation::Step, values.clone());
        // Tangents of zero: a smooth step from key to key.
        let spline = values.iter().flat_map(|v| [Vec4::ZERO, *v, Vec4::ZERO]).collect();
        let cubic = channel(Interpolation::CubicSpline, spline);
        for all in [&linear, &step, &cubic] {
            assert_eq!(
                [0.0, 1.0, 2.0, 9.0].map(|t| all.at(t)),
                [values[0], values[0], values[1], values[2]]
            );
        }
        assert_eq!(linear.at(3.0), 2.0 * Vec4::Y);
        assert_eq!(step.at(3.9), Vec4::Y);
        assert_eq!(cubic.at(3.0), 2.0 * Vec4::Y);
        assert!((cubic.at(2.5).y - (1.0 + 2.0 * 0.15625)).abs() < 1e-6);
    }

    #[test]
    fn rates_are_those_of_baked_keys() {
        let baked: Vec<f32> = (1..=150).map(|i| i as f32 / 30.0).collect();
        assert_eq!(rate(&baked), Some(30.0));
        assert_eq!(rate(&[0.0, 0.5, 1.5]), None);
        assert_eq!(rate(&[0.0]), None);
        assert_eq!(rate(&[1.0, 1.0]), None);
    }
}
