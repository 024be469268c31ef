//! Building a database from clips.

use super::{
    content::{check_arrays, check_joints},
    database::{Database, DatabaseSettings, Frames, MAX_TAGS, StoredClip, View},
    error::{DatabaseError, check_count},
    features::{FeatureScale, feature_len},
    index::FeatureIndex,
    mirror::mirrored_clip,
    track::Track,
};
use crate::{clip::Clip, skeleton::Skeleton};
use glam::Quat;
use std::ops::Range;

/// Largest number of frames: nine hours at 30 fps, mirrored.
const MAX_FRAMES: usize = 1 << 21;

/// Clip with the tags of its frames.
#[derive(Clone, Debug)]
pub struct TaggedClip<'a> {
    /// Motion of the database's skeleton.
    pub clip: &'a Clip,
    /// Ranges of frames with their tag, which may overlap.
    pub tags: Vec<TagRange>,
}

/// Range of frames of a clip that have a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct TagRange {
    /// Name of the tag.
    pub tag: String,
    /// Frames of the clip; those beyond its end are ignored.
    pub frames: Range<usize>,
}

impl<'a> TaggedClip<'a> {
    /// Wraps a clip without tags.
    pub fn untagged(clip: &'a Clip) -> Self {
        Self {
            clip,
            tags: Vec::new(),
        }
    }

    /// Gives all frames of a clip one tag.
    pub fn whole(clip: &'a Clip, tag: impl Into<String>) -> Self {
        let frames = 0..clip.len();
        let tag = tag.into();
        Self {
            clip,
            tags: vec![TagRange { tag, frames }],
        }
    }
}

impl Database {
    /// Builds a database from clips of one skeleton and one frame rate.
    ///
    /// Mirrored clips, if the settings ask for them, follow behind all others. Clips shorter than
    /// two frames are left out.
    ///
    /// # Errors
    /// Settings or clips that do not fit the skeleton, clips that are too short or too many, and
    /// numbers that are not finite or too far from the origin.
    pub fn build(
        skeleton: &Skeleton,
        clips: &[TaggedClip],
        settings: DatabaseSettings,
    ) -> Result<Self, DatabaseError> {
        settings.check(skeleton)?;
        check_joints(skeleton)?;
        check_clips(skeleton, clips, &settings)?;
        let fps = clips.first().map_or(0.0, |c| c.clip.fps);
        let mut builder = Builder::new(skeleton, &settings, fps);
        for tagged in clips {
            builder.append(tagged, View::Direct)?;
        }
        if settings.mirror.is_some() {
            for tagged in clips {
                builder.append(tagged, View::Mirrored)?;
            }
        }
        builder.finish(settings.clone())
    }
}

fn check_clips(
    skeleton: &Skeleton,
    clips: &[TaggedClip],
    settings: &DatabaseSettings,
) -> Result<(), DatabaseError> {
    let Some(first) = clips.first() else {
        return Err(DatabaseError::NoFrames);
    };
    let copies = 1 + usize::from(settings.mirror.is_some());
    let found = copies * clips.iter().map(|c| c.clip.len()).sum::<usize>();
    let expected = MAX_FRAMES;
    if found > expected {
        return Err(DatabaseError::TooManyFrames { expected, found });
    }
    for TaggedClip { clip, .. } in clips {
        // Written so that NaN fails.
        if !(clip.fps == first.clip.fps && (1.0..=1000.0).contains(&clip.fps)) {
            return Err(DatabaseError::FrameRate {
                clip: clip.name.clone(),
                expected: first.clip.fps,
                found: clip.fps,
            });
        }
        let joints = skeleton.len();
        let is_wrong = |p: &crate::Pose| p.local.len() != joints || !p.is_valid();
        if let Some(frame) = clip.poses.iter().position(is_wrong) {
            return Err(DatabaseError::Pose {
                clip: clip.name.clone(),
                frame,
                joints,
            });
        }
    }
    Ok(())
}

/// Database in the making.
struct Builder<'a> {
    skeleton: &'a Skeleton,
    settings: &'a DatabaseSettings,
    fps: f32,
    tag_names: Vec<String>,
    clips: Vec<StoredClip>,
    frames: Frames,
    /// Raw features, one row a frame.
    rows: Vec<f32>,
}

impl<'a> Builder<'a> {
    fn new(skeleton: &'a Skeleton, settings: &'a DatabaseSettings, fps: f32) -> Self {
        Self {
            skeleton,
            settings,
            fps,
            tag_names: Vec::new(),
            clips: Vec::new(),
            frames: Frames::default(),
            rows: Vec::new(),
        }
    }

    fn append(&mut self, tagged: &TaggedClip, view: View) -> Result<(), DatabaseError> {
        if tagged.clip.len() < 2 {
            return Ok(());
        }
        let mirrored;
        let clip = match (view, &self.settings.mirror) {
            (View::Mirrored, Some(swap)) => {
                mirrored = mirrored_clip(tagged.clip, self.skeleton, swap);
                &mirrored
            }
            _ => tagged.clip,
        };
        self.clips.push(StoredClip {
            name: clip.name.clone(),
            view,
            first: self.frames.roots.len(),
            len: clip.len(),
        });
        self.append_tags(tagged)?;
        let track = Track::new(clip, self.skeleton);
        self.append_frames(clip, &track);
        self.append_contacts(&track);
        self.append_features(&track);
        Ok(())
    }

    fn append_tags(&mut self, tagged: &TaggedClip) -> Result<(), DatabaseError> {
        let first = self.frames.tags.len();
        self.frames.tags.resize(first + tagged.clip.len(), 0);
        for range in &tagged.tags {
            let bit = self.tag_bit(&range.tag)?;
            let end = range.frames.end.min(tagged.clip.len());
            for frame in range.frames.start.min(end)..end {
                self.frames.tags[first + frame] |= bit;
            }
        }
        Ok(())
    }

    fn tag_bit(&mut self, name: &str) -> Result<u32, DatabaseError> {
        let known = self.tag_names.iter().position(|tag| tag == name);
        let bit = known.unwrap_or(self.tag_names.len());
        if known.is_none() {
            self.tag_names.push(name.to_owned());
        }
        match bit < MAX_TAGS {
            true => Ok(1 << bit),
            false => check_count("tags or fewer", MAX_TAGS, bit + 1).map(|()| 0),
        }
    }

    fn append_frames(&mut self, clip: &Clip, track: &Track) {
        let joint = self.skeleton.root();
        for ((pose, root), world) in clip.poses.iter().zip(&track.roots).zip(&track.world) {
            let hips = root.world_from_root().inverse().point(world[joint].translation);
            self.frames.hips.push(hips);
            let rotation = |(j, local): (usize, &Quat)| match j == joint {
                true => (root.rotation().inverse() * *local).normalize(),
                false => *local,
            };
            (self.frames.rotations).extend(pose.local.iter().enumerate().map(rotation));
        }
        self.frames.roots.extend(&track.roots);
    }

    fn append_contacts(&mut self, track: &Track) {
        let feet: Vec<Vec<bool>> = (self.settings.legs.iter().zip(self.settings.toe_heights_m))
            .map(|(leg, rest)| {
                let raw: Vec<bool> = (0..track.world.len())
                    .map(|t| {
                        let height = track.world[t][leg.toe].translation.y - rest;
                        let speed = track.central_velocity(leg.toe, t, self.fps).length();
                        height < self.settings.contact_height_m && speed < self.settings.contact_speed_m_s
                    })
                    .collect();
                majority(&raw)
            })
            .collect();
        let bits = |t: usize| u32::from(feet[0][t]) | u32::from(feet[1][t]) << 1;
        self.frames.contacts.extend((0..track.world.len()).map(bits));
    }

    fn append_features(&mut self, track: &Track) {
        for t in 0..track.roots.len() {
            let root = &track.roots[t];
            let root_from_world = root.world_from_root().inverse();
            for group in &self.settings.groups {
                let first = self.rows.len();
                self.rows.resize(first + group.feature.len(), 0.0);
                let out = &mut self.rows[first..];
                if let Some(joint) = group.feature.joint() {
                    let position = root_from_world.point(track.world[t][joint].translation);
                    let velocity = root_from_world.vector(track.velocity(joint, t, self.fps));
                    group.feature.write_joint(position, velocity, out);
                }
                let at = |seconds: f32| track.root_at(t, (seconds * self.fps).round() as isize);
                group.feature.write_trajectory(root, at, out);
            }
        }
    }

    fn finish(mut self, settings: DatabaseSettings) -> Result<Database, DatabaseError> {
        let scale = FeatureScale::of(&settings.groups, &self.rows);
        let len = feature_len(&settings.groups);
        self.rows
            .chunks_exact_mut(len)
            .for_each(|row| scale.normalise(row));
        check_arrays(&self.frames, &scale, &self.rows)?;
        let is_searchable = searchable(&self.clips, settings.end_margin_s * self.fps);
        if !is_searchable.contains(&true) {
            return Err(DatabaseError::NoFrames);
        }
        Ok(Database {
            skeleton: self.skeleton.clone(),
            index: FeatureIndex::new(len, &self.rows, &is_searchable),
            settings,
            fps: self.fps,
            tag_names: self.tag_names,
            clips: self.clips,
            frames: self.frames,
            scale,
        })
    }
}

/// Lists for each frame whether a search may end there: not within `margin` frames of the end of
/// its clip, nor in its last frame.
pub(super) fn searchable(clips: &[StoredClip], margin: f32) -> Vec<bool> {
    let margin = (margin.round().max(1.0)) as usize;
    let of_clip = |clip: &StoredClip| {
        let last = clip.len.saturating_sub(margin);
        (0..clip.len).map(move |t| t < last)
    };
    clips.iter().flat_map(of_clip).collect()
}

/// Majority of each frame and its neighbours: single frames are noise.
fn majority(raw: &[bool]) -> Vec<bool> {
    let at = |t: usize, step: isize| {
        let t = t.saturating_add_signed(step).min(raw.len() - 1);
        u8::from(raw[t])
    };
    (0..raw.len())
        .map(|t| at(t, -1) + at(t, 0) + at(t, 1) >= 2)
        .collect()
}
