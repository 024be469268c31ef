//! View without a window: sources, time, panes and what is drawn in them.

use super::body::Body;
use super::panes::Panes;
use super::quantity::{PaneFacts, Quantity, Shown};
use super::source::Source;
use super::track::Track;
use crate::{Fabric, Focus, Material, Orbit, Part, Scene, Shape, Vertex, ViewerError};
use glam::Vec3;
use std::sync::Arc;
use unic_core::mesh::vertex_normals;
use unic_raster::{Camera, Ground};

/// Unit vector to the key light, before it is normalised.
const TO_KEY: Vec3 = Vec3::new(0.45, 0.85, 0.55);
/// Width by height of a pane in which a standing person fits; a narrower one has a farther camera.
const FULL_ASPECT: f32 = 0.72;
/// Error at the light end of the heat map unless another one is set, metres.
const HEAT_MOST_M: f32 = 0.05;
/// Distance of the camera by the height of what is shown.
const DISTANCE_PER_HEIGHT: f32 = 2.05;

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
        session.place_camera();
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
        self.shown = tracks.iter().map(|_| Shown::default()).collect();
        self.sources = sources;
        self.bodies = bodies;
        self.tracks = tracks;
        self.panes = PaneChoice::All;
        self.set_seconds(self.seconds);
        Ok(())
    }

    /// Aims the camera at the first pane's body or garment.
    fn place_camera(&mut self) {
        self.update();
        let Some(first) = self.tracks.first() else { return };
        let body = &self.bodies[first.body];
        let garment = &self.shown[0].garment;
        // A garment beside a body may not be computed yet.
        let seen = if body.vertices().is_empty() {
            garment
        } else {
            body.vertices()
        };
        let finite = seen
            .iter()
            .map(|vertex| vertex.position)
            .filter(|position| position.is_finite());
        let start = (f32::INFINITY, f32::NEG_INFINITY);
        let (low, high) = finite.fold(start, |(low, high), p| (low.min(p.y), high.max(p.y)));
        let anchor = body.anchor(0);
        // Without anything finite to see, a person's size is as good as any.
        let (low, high) = if low < high { (low, high) } else { (0.0, 1.75) };
        let target = Vec3::Y * (0.5 * (low + high) - anchor.y);
        let front = Orbit::person(target);
        self.camera = Orbit {
            azimuth: body.facing() + front.azimuth,
            distance: (high - low) * DISTANCE_PER_HEIGHT,
            ..front
        };
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

    /// Duration of the longest motion, seconds, from the first frame to the end of the last one.
    pub fn duration(&self) -> f32 {
        let seconds = self
            .bodies
            .iter()
            .map(|body| body.frame_count() as f32 / body.fps());
        seconds.fold(0.0, f32::max)
    }

    /// Largest frame rate, frames a second.
    pub fn fps(&self) -> f32 {
        self.bodies.iter().map(Body::fps).fold(1.0, f32::max)
    }

    /// Time, seconds.
    pub fn seconds(&self) -> f32 {
        self.seconds
    }

    /// Index of the frame of a track at the present time.
    pub fn frame(&self, track: usize) -> usize {
        self.bodies[self.tracks[track].body].frame_at(self.seconds)
    }

    /// Number of frames and frames a second of a track.
    pub fn rate(&self, track: usize) -> (usize, f32) {
        let body = &self.bodies[self.tracks[track].body];
        (body.frame_count(), body.fps())
    }

    /// Goes to a time, which is kept within the motion.
    pub fn set_seconds(&mut self, seconds: f32) {
        let last = (self.duration() - 1.0 / self.fps()).max(0.0);
        self.seconds = match seconds.is_finite() {
            true => seconds.clamp(0.0, last),
            false => 0.0,
        };
    }

    /// Goes on by some seconds, and begins again at the end.
    pub fn advance(&mut self, seconds: f32) {
        let duration = self.duration();
        let next = self.seconds + seconds;
        self.seconds = if next < duration { next.max(0.0) } else { 0.0 };
    }

    /// Goes to the frame after or before the present one.
    pub fn step(&mut self, frames: i32) {
        let frame = (self.seconds * self.fps() + 1e-3).floor() + frames as f32;
        self.set_seconds(frame / self.fps());
    }

    /// Blocks until all that is shown at a time is computed.
    pub fn wait_for(&self, seconds: f32) {
        for track in self.visible() {
            let track = &self.tracks[track];
            track.wait_for(self.bodies[track.body].frame_at(seconds));
        }
    }

    /// Camera of all panes. Its target is relative to the point on the floor under each character.
    pub fn camera_mut(&mut self) -> &mut Orbit {
        &mut self.camera
    }

    /// Whether all that is shown at a time is computed.
    pub fn is_ready(&self, seconds: f32) -> bool {
        self.visible().into_iter().all(|track| {
            let track = &self.tracks[track];
            track.is_ready(self.bodies[track.body].frame_at(seconds))
        })
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

    /// Calls `draw` with the scene and the camera of a pane of width / height `aspect`, as of the
    /// last [`update`](Self::update).
    ///
    /// # Errors
    /// Those of `draw`; a camera that is not finite.
    pub fn with_scene<T>(
        &self,
        track: usize,
        aspect: f32,
        draw: impl FnOnce(&Scene, &Camera) -> Result<T, ViewerError>,
    ) -> Result<T, ViewerError> {
        let shown = &self.shown[track];
        let track = &self.tracks[track];
        let body = &self.bodies[track.body];
        let mut parts = Vec::new();
        if let Some(mesh) = body.mesh() {
            let vertices = shown.body.as_deref().unwrap_or(body.vertices());
            parts.push(self.part(mesh, vertices, self.looks.skin, &shown.body_colours));
        }
        if shown.frame.is_some() {
            parts.push(self.part(
                track.mesh(),
                &shown.garment,
                self.looks.cloth,
                &shown.garment_colours,
            ));
        }
        let positions = parts.iter().flat_map(|part| match part.shape {
            Shape::Host(vertices) => vertices,
            Shape::Device { .. } => &[],
        });
        let focus = Focus::around(positions.map(|vertex| vertex.position));
        let scene = Scene {
            parts: &parts,
            marks: &[],
            ground: Ground::Height(body.ground_height()),
            to_key: TO_KEY.normalize(),
            focus: Focus {
                radius: focus.radius + 0.1,
                ..focus
            },
        };
        draw(&scene, &self.camera_of(body, aspect)?)
    }

    fn part<'a>(
        &self,
        mesh: &'a Arc<crate::Mesh>,
        vertices: &'a [Vertex],
        material: Material,
        colours: &'a Option<Vec<[f32; 3]>>,
    ) -> Part<'a> {
        let colours = colours.as_deref();
        // Threads and prints would disturb colours that mean something.
        let material = match colours {
            Some(_) => Material::cloth(Fabric::Plain, material.colour),
            None => material,
        };
        Part {
            mesh,
            shape: Shape::Host(vertices),
            material,
            colours,
            shading: self.quantity.shading(colours.is_some()),
        }
    }

    fn camera_of(&self, body: &Body, aspect: f32) -> Result<Camera, ViewerError> {
        let frame = match self.camera_motion {
            CameraMotion::Follows => body.frame_at(self.seconds),
            CameraMotion::Stays => 0,
        };
        let farther = (FULL_ASPECT / aspect.max(0.05)).max(1.0);
        let orbit = Orbit {
            target: self.camera.target + body.anchor(frame),
            distance: self.camera.distance * farther,
            ..self.camera
        };
        Ok(orbit.camera()?)
    }
}
