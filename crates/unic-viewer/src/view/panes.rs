//! Panes of a session, made from its sources.

use super::body::Body;
use super::source::{ClipSource, ModelSource, Source};
use super::track::{Track, TrackKind};
use crate::ViewerError;
use glam::Vec3;
use unic_core::{character::Character, clip::Clip};

/// Bodies and tracks of sources, while they are made.
pub(super) struct Panes<'a> {
    clip: Option<&'a ClipSource>,
    bodies: Vec<Body>,
    tracks: Vec<Track>,
}

impl<'a> Panes<'a> {
    pub(super) fn of(sources: &'a [Source]) -> Result<Self, ViewerError> {
        if sources.is_empty() {
            return Err(refused("a view", "something to show", "nothing"));
        }
        let clip = sources.iter().find_map(|source| match source {
            Source::Clip(clip) => Some(clip),
            _ => None,
        });
        let mut panes = Self {
            clip,
            bodies: Vec::new(),
            tracks: Vec::new(),
        };
        if let Some(clip) = clip {
            panes.add_clip(clip)?;
        }
        for source in sources {
            match source {
                Source::Clip(_) => {}
                Source::Model(model) => panes.add_model(model)?,
                Source::Animation(animation) => {
                    let meshes = [Some(&animation.garment), animation.body.as_ref()];
                    if !meshes.into_iter().flatten().all(|mesh| mesh.is_consistent()) {
                        let expected = "frames with as many positions as the mesh has vertices";
                        return Err(refused(&animation.name, expected, "other frames"));
                    }
                    let truth = panes.clip.map(|clip| &clip.truth);
                    let body = panes.bodies.len();
                    let track = Track::of_animation(&animation.name, &animation.garment, truth, body);
                    panes.bodies.push(Body::of_animation(animation));
                    panes.tracks.push(track);
                }
            }
        }
        let is_compared = |track: &Track| track.kind() == TrackKind::Prediction && track.truth().is_some();
        if let Some(clip) = clip.filter(|_| panes.tracks.iter().any(is_compared)) {
            panes.tracks.push(Track::of_skinning(clip, 0));
        }
        Ok(panes)
    }

    pub(super) fn into_parts(self) -> (Vec<Body>, Vec<Track>) {
        (self.bodies, self.tracks)
    }

    fn add_clip(&mut self, clip: &ClipSource) -> Result<(), ViewerError> {
        let (expected, found) = (clip.motion.len(), clip.truth.frame_count());
        if expected == 0 || expected != found {
            let expected = format!("a garment in each of {expected} frames");
            return Err(refused(&clip.name, &expected, &format!("{found}")));
        }
        let (expected, found) = (clip.garment.rest.vertices.len(), clip.truth.positions(0).len());
        if expected != found {
            let expected = format!("{expected} garment vertices");
            return Err(refused(&clip.name, &expected, &format!("{found}")));
        }
        self.bodies.push(Body::of_clip(clip));
        self.tracks.push(Track::of_truth(clip, 0));
        Ok(())
    }

    fn add_model(&mut self, source: &ModelSource) -> Result<(), ViewerError> {
        if let Some(clip) = self
            .clip
            .filter(|clip| is_of_character(source, &clip.character) && fits(source, &clip.motion))
        {
            let track = Track::of_model(source, &clip.motion, Some(&clip.truth), 0);
            self.tracks.push(track);
            return Ok(());
        }
        let own = source.motion.as_ref();
        let Some(motion) = own.filter(|motion| fits(source, motion)) else {
            let joints = source.model.character().skeleton.len();
            let expected = format!(
                "a motion of {joints} joints at {} fps for the model",
                source.model.config().fps
            );
            let offered = own.or(self.clip.map(|clip| &clip.motion));
            let found = offered.map_or("none".to_owned(), |motion| {
                let joints = motion.poses.first().map_or(0, |pose| pose.local.len());
                format!("one of {joints} joints at {} fps", motion.fps)
            });
            return Err(refused(&source.name, &expected, &found));
        };
        let body = self.bodies.len();
        self.bodies.push(Body::of_model(source, motion));
        self.tracks.push(Track::of_model(source, motion, None, body));
        Ok(())
    }
}

/// Largest distance between a joint of one skeleton and the same joint of the other, metres: files of
/// one character from two programs round them.
const SAME_JOINT_M: f32 = 1e-3;

/// Whether a model is of a character's skeleton.
fn is_of_character(source: &ModelSource, character: &Character) -> bool {
    let (a, b) = (&source.model.character().skeleton, &character.skeleton);
    let is_near = |(a, b): (&Vec3, &Vec3)| a.distance(*b) <= SAME_JOINT_M;
    a.parents() == b.parents() && a.joints().iter().zip(b.joints()).all(is_near)
}

/// Whether a motion has the number of the model's joints, and its rate.
fn fits(source: &ModelSource, motion: &Clip) -> bool {
    // Files round rates such as 29.97.
    let fps = source.model.config().fps;
    let joints = motion.poses.first().map(|pose| pose.local.len());
    joints == Some(source.model.character().skeleton.len()) && (fps - motion.fps).abs() <= 1e-3 * fps
}

fn refused(name: &str, expected: &str, found: &str) -> ViewerError {
    ViewerError::Source {
        name: name.to_owned(),
        expected: expected.to_owned(),
        found: found.to_owned(),
    }
}
