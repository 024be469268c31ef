//! A body that comes as an animated surface, without a rig.

use super::{
    animation::{Animation, MeshChoice},
    notes::Notes,
};
use crate::{args::ImportArgs, interrupt, progress::Progress};
use anyhow::{Result, bail};
use glam::Vec3;
use unic_core::{Pose, character::Character, clip::Clip};
use unic_io::{
    MotionOptions, counted, read_obj,
    rig_fit::{BodyFrame, MAX_RMS_M, MotionSkeleton, ROUNDS, UnriggedBody, fit_rig},
};

/// Number of frames that a rig is fitted to.
const FRAMES: usize = 60;

/// An animation of a body without a rig.
pub(super) struct Body {
    animation: Animation,
    faces: Vec<[u32; 3]>,
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
        Ok(Some(Self {
            animation,
            faces: mesh.faces,
        }))
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
        let motion = MotionOptions {
            fps_of_file: motion.fps_of_file.or(self.animation.fps),
            ..motion.clone()
        };
        let skeleton = MotionSkeleton::read(&args.motion, &motion)?;
        let frames = self.sampled(args, &skeleton)?;
        let path = args.character.as_ref().unwrap_or(&args.garment);
        let mut progress = Progress::new("fitting a rig to the body", 0, ROUNDS as u64);
        let round = |rounds| -> Result<()> {
            progress.set(rounds as u64, String::new);
            Ok(interrupt::check()?)
        };
        let fitted = fit_rig(path, &self.faces, &frames, &skeleton, round)?;
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

    /// Reads some frames of the body that the motion covers.
    fn sampled(&mut self, args: &ImportArgs, skeleton: &MotionSkeleton) -> Result<Vec<BodyFrame>> {
        let fps = f64::from(self.animation.fps.or(args.fps).unwrap_or(skeleton.fps()));
        let last = (skeleton.seconds() * fps).floor() as i64;
        // Frame 0 of the motion belongs to frame `offset` of garment and body.
        let first = args.offset.max(0);
        let last = last
            .saturating_add(args.offset)
            .min(self.animation.len() as i64 - 1);
        let count = (last - first + 1).clamp(0, FRAMES as i64);
        let mut frames = Vec::new();
        let mut progress = Progress::new("reading the body", 0, count as u64);
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
        Ok(frames)
    }

    /// Checks that a character follows the body in the clip as it is imported. Returns the RMS distance,
    /// metres.
    ///
    /// # Errors
    /// Other vertices, another frame rate, no frame in common, a body that is elsewhere.
    pub(super) fn check_follows(
        &mut self,
        args: &ImportArgs,
        character: &Character,
        clip: &Clip,
    ) -> Result<f32> {
        let path = args.character.as_ref().unwrap_or(&args.garment).display();
        let (expected, found) = (character.body.vertices.len(), self.animation.vertex_count());
        if expected != found {
            bail!("{path}: expected the {expected} vertices of the character's body, found {found}");
        }
        if let Some(fps) = self
            .animation
            .fps
            .filter(|fps| (fps - clip.fps).abs() > 1e-3 * clip.fps)
        {
            bail!(
                "{path}: expected a body at the garment's {} frames per second, found {fps}",
                clip.fps
            );
        }
        let (mut positions, mut skinned) = (Vec::new(), Vec::new());
        let (mut sum, mut count) = (0.0f64, 0usize);
        for (frame, pose) in clip
            .poses
            .iter()
            .enumerate()
            .step_by(clip.len().div_ceil(FRAMES).max(1))
        {
            let of_body = (frame as i64).saturating_add(args.offset);
            if !(0..self.animation.len() as i64).contains(&of_body) {
                continue;
            }
            self.animation.frame(of_body as usize, &mut positions)?;
            skin(character, pose, &mut skinned);
            let pairs = skinned.iter().zip(&positions);
            sum += pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>();
            count += skinned.len();
        }
        if count == 0 {
            bail!(
                "{path}: expected frames of the body during the motion, found none with --offset {}",
                args.offset
            );
        }
        let rms = (sum / count as f64).sqrt() as f32;
        if rms.is_nan() || rms >= MAX_RMS_M {
            bail!(
                "{path}: expected the character's body in this motion, found one that is {rms:.2} m off (RMS)"
            );
        }
        Ok(rms)
    }
}

fn skin(character: &Character, pose: &Pose, out: &mut Vec<Vec3>) {
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    character.skeleton.forward_kinematics(pose, &mut joints);
    character.skeleton.world_from_rest(&joints, &mut transforms);
    character.weights.skin(&character.body.vertices, &transforms, out);
}
