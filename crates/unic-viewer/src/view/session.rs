//! View without a window: sources, time, panes and what is drawn in them.

mod scene;
mod time;

pub use scene::{Side, Subject};

use super::body::Body;
use super::panes::Panes;
use super::quantity::{PaneFacts, Quantity, Shown};
use super::source::Source;
use super::track::Track;
use crate::{Material, Orbit, Vertex, ViewerError};
use glam::Vec3;
use unic_core::mesh::vertex_normals;

/// Error at the light end of the heat map unless another one is set, metres.
const HEAT_MOST_M: f32 = 0.05;

/// Models, captures and animations side by side, at one time and from one camera.
pub struct ViewSession {
    sources: Vec<Source>,
    bodies: Vec<Body>,
    tracks: Vec<Track>,
    shown: Vec<Shown>,
    seconds: f32,
    camera: Orbit,
    /// Panes that are shown.
    pub panes: PaneChoice,
    /// Quantity that is shown.
    pub quantity: Quantity,
    /// Looks of bodies and garments.
    pub looks: ViewLooks,
    /// Error at the light end of the heat map, metres.
    pub heat_most_m: f32,
    /// Whether the camera moves with the characters.
    pub camera_motion: CameraMotion,
}

/// Panes that are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PaneChoice {
    /// All of them.
    #[default]
    All,
    /// The one of an index.
    Only(usize),
}

/// Motion of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraMotion {
    /// With each character.
    #[default]
    Follows,
    /// None.
    Stays,
}

/// Looks of bodies and garments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewLooks {
    /// Bodies.
    pub skin: Material,
    /// Garments.
    pub cloth: Material,
}

impl Default for ViewLooks {
    fn default() -> Self {
        Self {
            skin: Material::SKIN,
            cloth: Material::SHIRT,
        }
    }
}

impl ViewSession {
    /// Shows sources from their first frames. Predictions begin to be computed.
    ///
    /// # Errors
    /// No source; a model without a motion; an animation whose frames are not of its mesh.
    pub fn new(sources: Vec<Source>) -> Result<Self, ViewerError> {
        let mut session = Self {
            sources: Vec::new(),
            bodies: Vec::new(),
            tracks: Vec::new(),
            shown: Vec::new(),
            seconds: 0.0,
            camera: Orbit::person(Vec3::Y),
            panes: PaneChoice::All,
            quantity: Quantity::Lit,
            looks: ViewLooks::default(),
            heat_most_m: HEAT_MOST_M,
            camera_motion: CameraMotion::Follows,
        };
        session.add(sources)?;
        session.aim(Side::default(), Subject::default());
        Ok(session)
    }

    /// Adds sources to those that are shown. A source replaces one of its kind and name, and a clip
    /// replaces the clip.
    ///
    /// # Errors
    /// Those of [`new`](Self::new). The session stays as it was.
    pub fn add(&mut self, newer: Vec<Source>) -> Result<(), ViewerError> {
        let mut sources = self.sources.clone();
        for source in newer {
            let replaces = |old: &Source| match (old, &source) {
                (Source::Clip(_), Source::Clip(_)) => true,
                (Source::Model(a), Source::Model(b)) => a.name == b.name,
                (Source::Animation(a), Source::Animation(b)) => a.name == b.name,
                _ => false,
            };
            match sources.iter().position(replaces) {
                Some(place) => sources[place] = source,
                None => sources.push(source),
            }
        }
        self.show_sources(sources)
    }

    /// Makes bodies and tracks of sources.
    fn show_sources(&mut self, sources: Vec<Source>) -> Result<(), ViewerError> {
        let (bodies, mut tracks) = Panes::of(&sources)?.into_parts();
        let chosen = match self.panes {
            PaneChoice::Only(pane) => self.tracks.get(pane),
            PaneChoice::All => None,
        };
        let chosen = chosen.map(|track| (track.kind(), track.name().to_owned()));
        let mut earlier: Vec<Option<Track>> =
            std::mem::take(&mut self.tracks).into_iter().map(Some).collect();
        for track in &mut tracks {
            let is_same = |old: &&mut Option<Track>| {
                let old = old.as_ref();
                old.is_some_and(|old| old.kind() == track.kind() && old.name() == track.name())
            };
            if let Some(old) = earlier.iter_mut().find(is_same).and_then(Option::take) {
                track.inherit(old);
            }
        }
        // A pane that was chosen stays so while it is there.
        let is_chosen = |track: &Track| {
            chosen
                .as_ref()
                .is_some_and(|(kind, name)| track.kind() == *kind && track.name() == name)
        };
        self.panes = match tracks.iter().position(is_chosen) {
            Some(pane) => PaneChoice::Only(pane),
            None => PaneChoice::All,
        };
        self.shown = tracks.iter().map(|_| Shown::default()).collect();
        self.sources = sources;
        self.bodies = bodies;
        self.tracks = tracks;
        self.set_seconds(self.seconds);
        Ok(())
    }

    /// Tracks of all panes, shown or not.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Indices of the tracks that are shown.
    pub fn visible(&self) -> Vec<usize> {
        match self.panes {
            PaneChoice::Only(pane) if pane < self.tracks.len() => vec![pane],
            PaneChoice::Only(_) | PaneChoice::All => (0..self.tracks.len()).collect(),
        }
    }

    /// Camera of all panes. Its target is relative to the point on the floor under each character.
    pub fn camera_mut(&mut self) -> &mut Orbit {
        &mut self.camera
    }

    /// Brings the shapes and colours of the panes up to the time. A garment that is not computed yet
    /// is left out.
    pub fn update(&mut self) {
        for track in self.visible() {
            if self.tracks[track].promote() {
                self.shown[track] = Shown::default();
            }
            let (track, shown) = (&self.tracks[track], &mut self.shown[track]);
            let body = &mut self.bodies[track.body];
            let frame = body.frame_at(self.seconds);
            body.show(frame);
            let Some(positions) = track.positions(frame) else {
                *shown = Shown::default();
                continue;
            };
            if shown.frame != Some(frame) {
                let mut normals = Vec::new();
                vertex_normals(&positions, track.mesh().faces(), &mut normals);
                Vertex::join(&positions, &normals, &mut shown.garment);
                shown.frame = Some(frame);
            }
            shown.colour(self.quantity, track, body, self.heat_most_m);
        }
    }

    /// Numbers that a pane shows.
    pub fn facts(&self, track: usize) -> PaneFacts {
        self.shown[track].facts
    }

    /// Caption of a pane: name, numbers, and how far a prediction is that is behind the time.
    pub fn caption(&self, track: usize) -> String {
        let mut words = vec![self.tracks[track].name().to_owned()];
        let facts = self.facts(track).text();
        if !facts.is_empty() {
            words.push(facts);
        }
        if let Some(progress) = self.tracks[track].progress() {
            match &progress.failure {
                Some(failure) => words.push(failure.clone()),
                None if progress.done <= self.frame(track) => {
                    words.push(format!("computed {} of {}", progress.done, progress.all));
                }
                None => {}
            }
        }
        words.join(" - ")
    }
}
