//! Camera and scenes of a view.

use super::{CameraMotion, ViewSession};
use crate::view::body::Body;
use crate::{Fabric, Focus, Material, Orbit, Part, Scene, Shape, Vertex, ViewerError};
use glam::Vec3;
use std::{
    f32::consts::{FRAC_PI_2, PI},
    sync::Arc,
};
use unic_raster::{Camera, Ground};

/// Vector to the key light, before it is normalised.
const TO_KEY: Vec3 = Vec3::new(0.45, 0.85, 0.55);
/// Width by height of a pane in which a standing person fits; a narrower one has a farther camera.
const FULL_ASPECT: f32 = 0.72;
/// Distance of the camera by the height of what is shown.
const DISTANCE_PER_HEIGHT: f32 = 2.05;

/// Side of a character that the camera sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Three quarters from the front.
    #[default]
    ThreeQuarters,
    /// Chest.
    Front,
    /// Back.
    Back,
    /// Left arm.
    Left,
    /// Right arm.
    Right,
}

/// Subject that fills the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Subject {
    /// The whole character, or the garment where there is none.
    #[default]
    Figure,
    /// The garment.
    Garment,
}

impl Side {
    /// Angle of the eye from the direction that a character faces, radians.
    fn azimuth(self) -> f32 {
        match self {
            Self::ThreeQuarters => Orbit::person(Vec3::ZERO).azimuth,
            Self::Front => 0.0,
            Self::Left => FRAC_PI_2,
            Self::Right => -FRAC_PI_2,
            Self::Back => PI,
        }
    }
}

impl ViewSession {
    /// Aims the camera at the first pane's subject at the present time.
    pub fn aim(&mut self, side: Side, subject: Subject) {
        self.update();
        let Some(first) = self.tracks.first() else { return };
        let body = &self.bodies[first.body];
        let garment = &self.shown[0].garment;
        // A garment beside a body may not be computed yet.
        let seen = match (subject, body.vertices().is_empty()) {
            (Subject::Garment, _) if !garment.is_empty() => garment,
            (_, true) => garment,
            _ => body.vertices(),
        };
        let finite = seen
            .iter()
            .map(|vertex| vertex.position)
            .filter(|position| position.is_finite());
        let start = (f32::INFINITY, f32::NEG_INFINITY);
        let (low, high) = finite.fold(start, |(low, high), p| (low.min(p.y), high.max(p.y)));
        let frame = body.frame_at(self.seconds);
        // Without anything finite to see, a person's size is as good as any.
        let (low, high) = if low < high { (low, high) } else { (0.0, 1.75) };
        let target = Vec3::Y * (0.5 * (low + high) - body.anchor(frame).y);
        self.camera = Orbit {
            azimuth: body.facing(frame) + side.azimuth(),
            distance: (high - low) * DISTANCE_PER_HEIGHT,
            ..Orbit::person(target)
        };
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
