//! Bodies in motion.

use super::source::{AnimatedMesh, AnimationSource, ClipSource, ModelSource, ShapeFrames};
use crate::{Mesh, Skinning, Vertex};
use glam::{Quat, Vec3};
use std::cell::OnceCell;
use std::sync::Arc;
use unic_core::{
    character::Character,
    clip::Clip,
    mesh::{TriMesh, vertex_normals},
    skinning::SkinningWeights,
    surface::Surface,
};

/// Body with its motion, which several panes share.
pub(super) struct Body {
    kind: BodyKind,
    mesh: Option<Arc<Mesh>>,
    skinning: Skinning,
    shown: Option<usize>,
    positions: Vec<Vec3>,
    vertices: Vec<Vertex>,
    /// Search tree of the shown body, made where it is asked for.
    surface: OnceCell<Surface>,
    refitted: Option<usize>,
}

enum BodyKind {
    Posed {
        character: Arc<Character>,
        motion: Arc<Clip>,
        /// Positions that differ from those of skinning.
        known: Option<Arc<dyn ShapeFrames>>,
    },
    Animated {
        fps: f32,
        garment: AnimatedMesh,
        body: Option<AnimatedMesh>,
    },
}

impl Body {
    pub(super) fn of_clip(clip: &ClipSource) -> Self {
        Self::posed(&clip.character, &clip.motion, clip.body.clone())
    }

    pub(super) fn of_model(model: &ModelSource, motion: &Arc<Clip>) -> Self {
        Self::posed(&Arc::new(model.model.character().clone()), motion, None)
    }

    pub(super) fn of_animation(animation: &AnimationSource) -> Self {
        let mesh = animation
            .body
            .as_ref()
            .map(|body| Arc::new(Mesh::new(&body.mesh)));
        let kind = BodyKind::Animated {
            fps: animation.fps,
            garment: animation.garment.clone(),
            body: animation.body.clone(),
        };
        Self::new(kind, mesh)
    }

    fn posed(character: &Arc<Character>, motion: &Arc<Clip>, known: Option<Arc<dyn ShapeFrames>>) -> Self {
        let mesh = Arc::new(Mesh::new(&character.body));
        let kind = BodyKind::Posed {
            character: Arc::clone(character),
            motion: Arc::clone(motion),
            known,
        };
        Self::new(kind, Some(mesh))
    }

    fn new(kind: BodyKind, mesh: Option<Arc<Mesh>>) -> Self {
        Self {
            kind,
            mesh,
            skinning: Skinning::default(),
            shown: None,
            positions: Vec::new(),
            vertices: Vec::new(),
            surface: OnceCell::new(),
            refitted: None,
        }
    }

    pub(super) fn fps(&self) -> f32 {
        match &self.kind {
            BodyKind::Posed { motion, .. } => motion.fps,
            BodyKind::Animated { fps, .. } => *fps,
        }
    }

    pub(super) fn frame_count(&self) -> usize {
        match &self.kind {
            BodyKind::Posed { motion, .. } => motion.len(),
            BodyKind::Animated { garment, .. } => garment.frames.frame_count(),
        }
    }

    /// Height of the floor, metres.
    pub(super) fn ground_height(&self) -> f32 {
        match &self.kind {
            BodyKind::Posed { motion, .. } => motion.ground_height,
            BodyKind::Animated { .. } => 0.0,
        }
    }

    /// Frame at a time, which stays within the motion.
    pub(super) fn frame_at(&self, seconds: f32) -> usize {
        // A frame's own time, computed in f32, must not fall into the frame before.
        let frame = (f64::from(seconds) * f64::from(self.fps()) + 1e-3)
            .floor()
            .max(0.0) as usize;
        frame.min(self.frame_count().saturating_sub(1))
    }

    /// Mesh, unless the body is unknown.
    pub(super) fn mesh(&self) -> Option<&Arc<Mesh>> {
        self.mesh.as_ref()
    }

    /// Shape of the last [`show`](Self::show).
    pub(super) fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    pub(super) fn weights(&self) -> Option<&SkinningWeights> {
        match &self.kind {
            BodyKind::Posed { character, .. } => Some(&character.weights),
            BodyKind::Animated { .. } => None,
        }
    }

    /// Poses the body of a frame.
    pub(super) fn show(&mut self, frame: usize) {
        if self.shown == Some(frame) {
            return;
        }
        self.shown = Some(frame);
        let (positions, faces) = match &self.kind {
            BodyKind::Posed {
                character,
                motion,
                known: None,
            } => {
                let (positions, normals) = self.skinning.body(character, &motion.poses[frame]);
                self.positions.clear();
                self.positions.extend_from_slice(positions);
                Vertex::join(positions, normals, &mut self.vertices);
                return;
            }
            BodyKind::Posed {
                character,
                known: Some(known),
                ..
            } => (
                known.positions(frame.min(known.frame_count().saturating_sub(1))),
                &character.body.faces,
            ),
            BodyKind::Animated { body: Some(body), .. } => {
                let last = body.frames.frame_count().saturating_sub(1);
                (body.frames.positions(frame.min(last)), &body.mesh.faces)
            }
            BodyKind::Animated { body: None, .. } => return,
        };
        let mut normals = Vec::new();
        vertex_normals(positions, faces, &mut normals);
        Vertex::join(positions, &normals, &mut self.vertices);
        self.positions.clear();
        self.positions.extend_from_slice(positions);
    }

    /// Search tree over the shown body.
    pub(super) fn surface(&mut self) -> Option<&Surface> {
        let mesh: &TriMesh = match &self.kind {
            BodyKind::Posed { character, .. } => &character.body,
            BodyKind::Animated { body, .. } => &body.as_ref()?.mesh,
        };
        self.surface.get_or_init(|| Surface::build(mesh));
        let surface = self.surface.get_mut()?;
        if self.refitted != self.shown {
            surface.refit(&self.positions);
            self.refitted = self.shown;
        }
        Some(surface)
    }

    /// Point on the floor that a camera follows: under the root joint, or under the middle of an
    /// animation.
    pub(super) fn anchor(&self, frame: usize) -> Vec3 {
        match &self.kind {
            BodyKind::Posed {
                character, motion, ..
            } => {
                let skeleton = &character.skeleton;
                let at_bind = skeleton.joints().get(skeleton.root()).copied();
                (at_bind.unwrap_or_default() + motion.poses[frame].trans).with_y(motion.ground_height)
            }
            BodyKind::Animated { garment, body, .. } => {
                let mesh = body.as_ref().unwrap_or(garment);
                let last = mesh.frames.frame_count().saturating_sub(1);
                let positions = mesh.frames.positions(frame.min(last));
                let finite = positions.iter().filter(|p| p.is_finite());
                let (sum, count) = finite.fold((Vec3::ZERO, 0), |(sum, n), p| (sum + p, n + 1));
                (sum / count.max(1) as f32).with_y(0.0)
            }
        }
    }

    /// Direction that the character faces in a frame, from +Z towards +X, radians.
    pub(super) fn facing(&self, frame: usize) -> f32 {
        let BodyKind::Posed {
            character, motion, ..
        } = &self.kind
        else {
            return 0.0;
        };
        let root = character.skeleton.root();
        let Some(world_from_root) = motion.poses.get(frame).and_then(|pose| pose.local.get(root)) else {
            return 0.0;
        };
        let rest = character.skeleton.rest_pose().get(root);
        let bind_from_root = rest.map_or(Quat::IDENTITY, |rest| Quat::from_scaled_axis(*rest));
        // Characters face +Z in their bind pose.
        let forward = *world_from_root * bind_from_root.inverse() * Vec3::Z;
        forward.x.atan2(forward.z)
    }
}
