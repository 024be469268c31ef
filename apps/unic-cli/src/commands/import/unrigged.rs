//! A body that comes as an animated surface, without a rig.

use super::{
    animation::{Animation, MeshChoice},
    notes::Notes,
};
use crate::{args::ImportArgs, interrupt, progress::Progress};
use anyhow::{Result, anyhow, bail};
use glam::Vec3;
use unic_core::{character::Character, clip::Clip, mesh::TriMesh};
use unic_io::{
    Capture, MotionOptions, counted, read_obj,
    rig_fit::{BodyFrame, MAX_RMS_M, MotionSkeleton, UnriggedBody, fit_rig},
};

/// Number of frames that a rig is fitted to.
const FRAMES: usize = 60;

/// An animation of a body without a rig.
pub(super) struct Body {
    animation: Animation,
    /// Body of the first frame.
    mesh: TriMesh,
}

impl Body {
    /// Opens the animation of `--character`, if that is no character with a rig.
    ///
    /// # Errors
    /// A file that cannot be read; several meshes of which none is chosen; positions without faces.
    pub(super) fn open(args: &ImportArgs, notes: &mut Notes) -> Result<Option<Self>> {
        let Some(path) = &args.character else {
            return Ok(None);
        };
        let Some(found) = UnriggedBody::find(path, args.body.as_deref())? else {
            return Ok(None);
        };
        let choice = MeshChoice {
            path,
            object: found.mesh.as_deref(),
            other_vertices: usize::MAX,
        };
        let animation = Animation::open(args, &choice, notes)?;
        let mesh = match (&animation.mesh, &found.faces) {
            (Some(mesh), _) => mesh.clone(),
            (None, Some(faces)) => read_obj(faces)?,
            (None, None) => bail!(
                "{}: expected the body's faces, found positions alone; keep the body's mesh beside it as {}",
                path.display(),
                path.with_extension("obj").display()
            ),
        };
        if mesh.vertices.len() != animation.vertex_count() {
            bail!(
                "{}: expected the {} vertices of the body's mesh, found {}",
                path.display(),
                mesh.vertices.len(),
                animation.vertex_count()
            );
        }
        Ok(Some(Self { animation, mesh }))
    }

    /// Makes a character whose skinning reproduces the body: joints by the motion, weights fitted.
    ///
    /// # Errors
    /// A motion that does not move the body, an interruption.
    pub(super) fn character(
        &mut self,
        args: &ImportArgs,
        motion: &MotionOptions,
        notes: &mut Notes,
    ) -> Result<Character> {
        let skeleton = MotionSkeleton::read(&args.motion, motion)?;
        let fps = f64::from(self.animation.fps.or(args.fps).unwrap_or(skeleton.fps()));
        let last = (skeleton.seconds() * fps).floor() as i64;
        // Frame 0 of the motion belongs to frame `offset` of garment and body.
        let first = args.offset.max(0);
        let last = (last + args.offset).min(self.animation.len() as i64 - 1);
        let count = (last - first + 1).clamp(0, FRAMES as i64);
        let mut frames = Vec::new();
        let mut progress = Progress::new("fitting a rig to the body", 0, count as u64);
        for i in 0..count {
            interrupt::check()?;
            let frame = first + i * (last - first) / (count - 1).max(1);
            let mut vertices = Vec::new();
            self.animation.frame(frame as usize, &mut vertices)?;
            frames.push(BodyFrame {
                seconds: (frame - args.offset) as f64 / fps,
                vertices,
            });
            progress.set(i as u64 + 1, String::new);
        }
        let path = args.character.as_ref().unwrap_or(&args.garment);
        let fitted = fit_rig(path, &self.mesh.faces, &frames, &skeleton)?;
        let text = format!(
            "no rig in the file: {} of {}, weights fitted to {}: vertices are {:.2} mm off (RMS), {:.1} mm at most",
            counted(fitted.character.skeleton.len(), "joint"),
            args.motion.display(),
            counted(frames.len(), "frame"),
            1e3 * fitted.rms_m,
            1e3 * fitted.largest_m
        );
        notes.add(path, &text);
        Ok(fitted.character)
    }

    /// Checks that the character of a capture follows the body.
    ///
    /// # Errors
    /// Other vertices; a body that is elsewhere.
    pub(super) fn check_follows(
        &mut self,
        args: &ImportArgs,
        capture: &Capture,
        clip: &Clip,
        notes: &mut Notes,
    ) -> Result<()> {
        let Character {
            body,
            skeleton,
            weights,
        } = &capture.character;
        let path = args.character.as_ref().unwrap_or(&args.garment).display();
        if body.vertices.len() != self.animation.vertex_count() {
            bail!(
                "{path}: expected the {} vertices of the body of {}, found {}",
                body.vertices.len(),
                capture.root.display(),
                self.animation.vertex_count()
            );
        }
        let (mut positions, mut joints, mut transforms, mut skinned) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::<Vec3>::new());
        let (mut sum, mut count) = (0.0f64, 0usize);
        for (frame, pose) in clip
            .poses
            .iter()
            .enumerate()
            .step_by(clip.len().div_ceil(FRAMES).max(1))
        {
            let of_body = frame as i64 + args.offset;
            if !(0..self.animation.len() as i64).contains(&of_body) {
                continue;
            }
            self.animation.frame(of_body as usize, &mut positions)?;
            skeleton.forward_kinematics(pose, &mut joints);
            skeleton.world_from_rest(&joints, &mut transforms);
            weights.skin(&body.vertices, &transforms, &mut skinned);
            let pairs = skinned.iter().zip(&positions);
            sum += pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>();
            count += skinned.len();
        }
        let rms = (sum / count.max(1) as f64).sqrt() as f32;
        if !(count > 0 && rms < MAX_RMS_M) {
            return Err(anyhow!(
                "{path}: expected the body of {} in this motion, found one that is {rms:.2} m off on average",
                capture.root.display()
            ));
        }
        let text = format!(
            "the character of the capture is taken: vertices are {:.2} mm off (RMS)",
            1e3 * rms
        );
        notes.add(args.character.as_ref().unwrap_or(&args.garment), &text);
        Ok(())
    }
}
