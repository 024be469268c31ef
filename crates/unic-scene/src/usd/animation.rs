//! Motion of joints and of the prims above them.

use super::{
    points::uniform_step,
    sampled::{Mix, Sampled},
    skeleton::Skeleton,
    stage::{Prims, fault},
    units::Conversion,
    value,
    xform::Xforms,
};
use crate::{
    fault::Fault,
    request::Content,
    sampling::check_length,
    scene::{Local, Motion, Scene, Track},
};
use glam::{DQuat, Vec3};
use openusd::sdf;

/// Smallest rate of samples that is taken for that of frames. Others were set by hand.
const MIN_FPS: f64 = 12.0;
/// Frames per second of samples by hand in a file that states none.
const DEFAULT_FPS: f64 = 24.0;

/// Animation of the joints of a skeleton.
struct JointAnimation<'a> {
    skeleton: &'a Skeleton,
    /// Index among the animation's joints for each joint of the skeleton that it moves.
    sources: Vec<Option<usize>>,
    translations: Option<Sampled<Vec<Vec3>>>,
    rotations: Option<Sampled<Vec<DQuat>>>,
    scales: Option<Sampled<Vec<Vec3>>>,
}

/// Adds the names of the animations, and their samples if they are asked for.
pub(super) fn read(
    prims: &Prims,
    xforms: &Xforms,
    skeletons: &[Skeleton],
    conversion: &Conversion,
    content: Content,
    scene: &mut Scene,
) -> Result<(), Fault> {
    let bound = bound(prims, skeletons)?;
    for (_, path) in &bound {
        let name = path.name().unwrap_or("without a name").to_owned();
        if !scene.animations.contains(&name) {
            scene.animations.push(name);
        }
    }
    // Prims that carry skeletons around move them too; without skeletons nothing has joints.
    let carried: Vec<(usize, Vec<f64>)> = match skeletons.is_empty() {
        true => Vec::new(),
        false => xforms.animated().collect(),
    };
    if scene.animations.is_empty() && !carried.is_empty() {
        scene.animations.push("transforms".to_owned());
    }
    if content != Content::Motion || scene.animations.is_empty() {
        return Ok(());
    }
    let joints = (bound.iter()).map(|(skeleton, path)| JointAnimation::read(prims, skeleton, path));
    let joints: Vec<JointAnimation> = joints.collect::<Result<_, Fault>>()?;
    let name = scene.animations.first().cloned();
    let motion = motion(name, &joints, &carried, xforms, conversion, prims.length)?;
    scene.motion = Some(motion);
    Ok(())
}

/// Skeletons with the animations that move them.
fn bound<'a>(prims: &Prims, skeletons: &'a [Skeleton]) -> Result<Vec<(&'a Skeleton, sdf::Path)>, Fault> {
    let mut bound = Vec::new();
    for skeleton in skeletons {
        if let Some(path) = source(prims, skeleton)?
            && moves(prims, &path)?
        {
            bound.push((skeleton, path));
        }
    }
    Ok(bound)
}

/// Samples the joints, and the nodes that are `carried` around with the times of their own samples.
/// `length` is that of the file.
fn motion(
    name: Option<String>,
    joints: &[JointAnimation],
    carried: &[(usize, Vec<f64>)],
    xforms: &Xforms,
    conversion: &Conversion,
    length: usize,
) -> Result<Motion, Fault> {
    let lists = joints.iter().flat_map(JointAnimation::times);
    let times: Vec<Vec<f64>> = lists
        .chain(carried.iter().map(|(_, times)| times.clone()))
        .collect();
    let timeline = Timeline::of(&times, conversion)?;
    let moving: usize = joints.iter().map(|animation| animation.sources.len()).sum();
    check_length(timeline.frames, moving + carried.len(), length)?;
    let local = |node: usize, time: f64| Local::from_matrix(xforms.local(node, Some(time)).as_mat4());
    let carried = carried.iter().map(|&(node, _)| Track {
        node,
        locals: timeline.codes().map(|time| local(node, time)).collect(),
    });
    let tracks = joints.iter().flat_map(|animation| animation.tracks(&timeline));
    Ok(Motion {
        name,
        fps: timeline.fps as f32,
        rate: timeline.rate.to_owned(),
        frames: timeline.frames,
        tracks: tracks.chain(carried).collect(),
    })
}

/// Returns whether an animation has several samples. Others are poses.
fn moves(prims: &Prims, path: &sdf::Path) -> Result<bool, Fault> {
    for name in ["translations", "rotations", "scales"] {
        let attribute = prims.stage.prim(path.clone()).attribute(name);
        if attribute.num_time_samples().map_err(fault)? > 1 {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Animation that moves a skeleton: that of its binding, or the only one of the file.
fn source(prims: &Prims, skeleton: &Skeleton) -> Result<Option<sdf::Path>, Fault> {
    const SOURCE: &str = "skel:animationSource";
    if let Some(path) = prims.inherited_target(&skeleton.path, SOURCE)? {
        return Ok(prims.animations.contains(&path).then_some(path));
    }
    for mesh in &prims.meshes {
        if prims.inherited_target(mesh, "skel:skeleton")?.as_ref() == Some(&skeleton.path)
            && let Some(path) = prims.inherited_target(mesh, SOURCE)?
        {
            return Ok(prims.animations.contains(&path).then_some(path));
        }
    }
    match prims.animations.as_slice() {
        [only] => Ok(Some(only.clone())),
        _ => Ok(None),
    }
}

impl<'a> JointAnimation<'a> {
    fn read(prims: &Prims, skeleton: &'a Skeleton, path: &sdf::Path) -> Result<Self, Fault> {
        let names = prims.tokens(path, "joints")?;
        let mut sources = vec![None; skeleton.joints.len()];
        for (source, place) in skeleton.places(&names).into_iter().enumerate() {
            if let Some(place) = place {
                sources[place] = Some(source);
            }
        }
        Ok(Self {
            skeleton,
            sources,
            translations: Sampled::read(prims, path, "translations", value::vectors)?,
            rotations: Sampled::read(prims, path, "rotations", value::rotations)?,
            scales: Sampled::read(prims, path, "scales", value::vectors)?,
        })
    }

    fn times(&self) -> impl Iterator<Item = Vec<f64>> {
        let lists = [
            self.translations.as_ref().map(Sampled::times),
            self.rotations.as_ref().map(Sampled::times),
            self.scales.as_ref().map(Sampled::times),
        ];
        lists.into_iter().flatten()
    }

    /// Transforms of the joints that move. Parts that the animation lacks are those of the rest pose.
    fn tracks(&self, timeline: &Timeline) -> Vec<Track> {
        let moving = self.sources.iter().enumerate();
        let moving: Vec<(usize, usize)> = moving
            .filter_map(|(joint, source)| Some((joint, (*source)?)))
            .collect();
        let mut tracks: Vec<Track> = (moving.iter())
            .map(|(joint, _)| Track {
                node: self.skeleton.first_node + joint,
                locals: Vec::with_capacity(timeline.frames),
            })
            .collect();
        for time in timeline.codes() {
            let (t, r, s) = (
                at(&self.translations, time),
                at(&self.rotations, time),
                at(&self.scales, time),
            );
            for ((joint, source), track) in moving.iter().zip(&mut tracks) {
                let rest = self.skeleton.rest[*joint];
                track.locals.push(Local {
                    translation: t.get(*source).copied().unwrap_or(rest.translation),
                    rotation: r
                        .get(*source)
                        .map_or(rest.rotation, |rotation| rotation.as_quat()),
                    scale: s.get(*source).copied().unwrap_or(rest.scale),
                });
            }
        }
        tracks
    }
}

/// Values at a time code; empty where there are none.
fn at<T: Mix>(values: &Option<Sampled<Vec<T>>>, time: f64) -> Vec<T> {
    values
        .as_ref()
        .and_then(|values| values.at(time))
        .unwrap_or_default()
}

/// Times of frames at a constant rate.
struct Timeline {
    start: f64,
    /// Time codes from frame to frame.
    step: f64,
    fps: f64,
    rate: &'static str,
    frames: usize,
}

impl Timeline {
    /// Makes the timeline from the first sample to the last one, at the rate of the attribute with
    /// most samples, else at that of the file.
    fn of(times: &[Vec<f64>], conversion: &Conversion) -> Result<Self, Fault> {
        let all = || times.iter().flatten().copied();
        let (start, end) = (
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        );
        let codes = conversion.codes_per_second;
        let densest = times.iter().max_by_key(|times| times.len());
        let by_samples = densest
            .and_then(|times| uniform_step(times))
            .map(|step| codes / step);
        let (fps, rate) = match by_samples.filter(|fps| *fps >= MIN_FPS) {
            Some(fps) => (fps, "by its samples"),
            None => (
                conversion.fps.unwrap_or(DEFAULT_FPS),
                "as the file or --fps states, else the format's",
            ),
        };
        let step = codes / fps;
        // Saturates: a damaged time may be huge, and the caller checks the count.
        let frames = (((end - start) / step).round().max(0.0) as usize).saturating_add(1);
        match frames {
            0 | 1 => Err(Fault::new("at least two frames", frames.to_string())),
            _ => Ok(Self {
                start,
                step,
                fps,
                rate,
                frames,
            }),
        }
    }

    /// Time code of each frame.
    fn codes(&self) -> impl Iterator<Item = f64> {
        (0..self.frames).map(|frame| self.start + frame as f64 * self.step)
    }
}
