//! Files that a view shows.

use crate::{
    args::{PrecisionArgs, ViewArgs},
    checks::ForceArgs,
    commands::animate::body_path,
    failure::Usage,
    model_file, motion_file,
    output::print_status,
};
use anyhow::{Result, bail};
use glam::Vec3;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};
use unic_builtin::{
    human,
    motion::{Action, Performer, Timeline},
};
use unic_core::{Model, character::Character, clip::Clip, mesh::TriMesh};
use unic_io::{
    Capture, Split, VertexFrames, capture::is_capture, holds_several_meshes, read_obj, read_vertex_animation,
};
use unic_viewer::{AnimatedMesh, AnimationSource, ClipSource, ModelSource, ShapeFrames, Source};

/// Name of the body's mesh in files of `unic animate`.
const BODY: &str = "body";
/// Frames a second of animations whose file states none.
const USUAL_FPS: f32 = 30.0;
/// Duration of the walk of models without a motion, seconds.
const WALK_S: f32 = 8.0;
/// Speed of that walk, m/s, and of its turn, radians a second.
const WALK_M_S: f32 = 1.2;
const WALK_TURN: f32 = 0.5;
/// Largest distance between joints of one character, metres: files round them.
const SAME_JOINT_M: f32 = 1e-3;

/// Reader of models, captures and animations, with the options that say how.
pub(crate) struct Reader {
    clip: Option<String>,
    motion: Option<Motion>,
    precision: PrecisionArgs,
    force: ForceArgs,
}

/// Motion file, which is read for each model's skeleton and rate.
struct Motion {
    path: PathBuf,
    reading: crate::args::MotionArgs,
}

/// Frames of a file, for the viewer.
struct FileFrames(VertexFrames);

impl ShapeFrames for FileFrames {
    fn frame_count(&self) -> usize {
        self.0.len()
    }

    fn positions(&self, frame: usize) -> &[Vec3] {
        self.0.frame(frame)
    }
}

impl Reader {
    /// Makes a reader with the options of a command line.
    ///
    /// # Errors
    /// Two captures, or options that concern none of the paths.
    pub(crate) fn new(args: &ViewArgs) -> Result<Self> {
        let captures = args.paths.iter().filter(|path| is_capture(path)).count();
        if captures > 1 {
            return Err(Usage(format!("expected one capture at most, found {captures}")).into());
        }
        if args.clip.is_some() && captures == 0 {
            return Err(Usage("--clip: expected a capture that has the clip, found none".into()).into());
        }
        Ok(Self {
            clip: args.clip.clone(),
            motion: args.motion.clone().map(|path| Motion {
                path,
                reading: args.reading.clone(),
            }),
            precision: args.precision,
            force: args.force,
        })
    }

    /// Makes a reader of files that are dropped on a window.
    pub(crate) fn of_dropped_files() -> Self {
        Self {
            clip: None,
            motion: None,
            precision: PrecisionArgs::default(),
            force: ForceArgs { force: true },
        }
    }

    /// Reads all paths.
    ///
    /// # Errors
    /// The first one that cannot be read.
    pub(crate) fn read_all(&self, paths: &[PathBuf]) -> Result<Vec<Source>> {
        let mut sources: Vec<Source> = Vec::new();
        for path in paths {
            for mut source in self.read(path)? {
                // Two files may have the same name in two folders.
                let taken = |name: &str| sources.iter().any(|other| other.name() == name);
                if taken(source.name()) {
                    match &mut source {
                        Source::Model(model) => model.name = path.display().to_string(),
                        Source::Animation(animation) => animation.name = path.display().to_string(),
                        Source::Clip(_) => {}
                    }
                }
                sources.push(source);
            }
        }
        Ok(sources)
    }

    /// Reads a model, a capture or an animation.
    ///
    /// # Errors
    /// A file that is none of these.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<Source>> {
        if is_capture(path) {
            return Ok(vec![self.clip(path)?]);
        }
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        if ending.is_some_and(|ending| ending == "unic") {
            return Ok(vec![self.model(path)?]);
        }
        if !path.exists() {
            bail!(
                "{}: expected a model (.unic), a capture or an animation, found nothing",
                path.display()
            );
        }
        Ok(vec![self.animation(path)?])
    }

    fn clip(&self, path: &Path) -> Result<Source> {
        let capture = Capture::open(path)?;
        let name = match &self.clip {
            Some(name) => name.clone(),
            None => first_clip(&capture)?,
        };
        Ok(Source::Clip(clip_source(&capture, &name)?))
    }

    fn model(&self, path: &Path) -> Result<Source> {
        let model = self.precision.apply(model_file::read(path)?);
        let motion = match &self.motion {
            Some(motion) => Some(self.read_motion(motion, &model)?),
            None => walk_of(&model),
        };
        Ok(Source::Model(ModelSource {
            name: source_name(path),
            model: Arc::new(model),
            motion: motion.map(Arc::new),
        }))
    }

    fn read_motion(&self, motion: &Motion, model: &Model) -> Result<Clip> {
        let (path, fps) = (&motion.path, model.config().fps);
        motion_file::read(path, model.character(), fps, &motion.reading, self.force)
    }

    fn animation(&self, path: &Path) -> Result<Source> {
        let (garment, fps) = animated_mesh(path, None)?;
        let beside = body_path(path);
        let body = match (holds_several_meshes(path), beside.exists()) {
            // A file without a body shows the garment alone.
            (true, _) => animated_mesh(path, Some(BODY)).ok(),
            (false, true) => Some(animated_mesh(&beside, None)?),
            (false, false) => None,
        };
        let body = body.map(|(mesh, _)| mesh);
        if fps.is_none() {
            print_status(&format!(
                "{}: shown at {USUAL_FPS} frames a second, because the file states no rate",
                path.display()
            ));
        }
        Ok(Source::Animation(AnimationSource {
            name: source_name(path),
            fps: fps.unwrap_or(USUAL_FPS),
            garment,
            body,
        }))
    }
}

fn source_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Name of the clip that is shown without `--clip`.
fn first_clip(capture: &Capture) -> Result<String> {
    let splits = [Split::Test, Split::Validation, Split::Train];
    let mut clips = splits.into_iter().flat_map(|split| capture.clip_names(split));
    match clips.next() {
        Some(name) => Ok(name.clone()),
        None => bail!("{}: expected a clip, found none", capture.root.display()),
    }
}

/// Clip of a capture, for the viewer.
///
/// # Errors
/// A clip that the capture lacks or that cannot be read.
pub(crate) fn clip_source(capture: &Capture, name: &str) -> Result<ClipSource> {
    if capture.manifest.splits.split_of(name).is_none() {
        let names: Vec<&str> = capture.manifest.splits.iter().map(|(name, _)| name).collect();
        bail!(
            "{}: expected a clip of the capture ({}), found {name}",
            capture.root.display(),
            names.join(", ")
        );
    }
    let captured = capture.load_clip(name)?;
    Ok(ClipSource {
        name: name.to_owned(),
        character: Arc::new(capture.character.clone()),
        garment: Arc::new(capture.garment.clone()),
        motion: Arc::new(captured.clip),
        truth: Arc::new(FileFrames(captured.garment)),
        body: captured
            .body
            .map(|body| Arc::new(FileFrames(body)) as Arc<dyn ShapeFrames>),
    })
}

/// Reads a vertex animation with its faces, which point caches have in an OBJ file beside them.
/// Returns its frame rate too, if the file states one.
/// In a file of several meshes it is the one of the name `object`, else the garment.
fn animated_mesh(path: &Path, object: Option<&str>) -> Result<(AnimatedMesh, Option<f32>)> {
    let cache = read_vertex_animation(path, object)?;
    let mesh: TriMesh = match cache.mesh {
        Some(mesh) => mesh,
        None => {
            let beside = path.with_extension("obj");
            if !beside.exists() {
                bail!(
                    "{}: expected the mesh of the animation beside it in {}, found none",
                    path.display(),
                    beside.display()
                );
            }
            read_obj(&beside)?
        }
    };
    let (expected, found) = (mesh.vertices.len(), cache.frames.vertex_count());
    if expected != found {
        bail!(
            "{}: expected frames of {expected} vertices as its mesh has, found {found}",
            path.display()
        );
    }
    let animated = AnimatedMesh {
        mesh: Arc::new(mesh),
        frames: Arc::new(FileFrames(cache.frames)),
    };
    Ok((animated, cache.fps))
}

/// Walk for a model of the built-in human; none for other characters.
fn walk_of(model: &Model) -> Option<Clip> {
    let human = human::human(&human::HumanParameters::default()).ok()?;
    if !is_same_skeleton(&human, model.character()) {
        return None;
    }
    let performer = Performer::new(&human).ok()?;
    let walk = Timeline::new(0).then(Action::Travel {
        speed: WALK_M_S,
        turn_rate: WALK_TURN,
        seconds: WALK_S,
    });
    Some(walk.perform(&performer).clip("walk", model.config().fps))
}

fn is_same_skeleton(a: &Character, b: &Character) -> bool {
    let (a, b) = (&a.skeleton, &b.skeleton);
    let is_near = |(a, b): (&Vec3, &Vec3)| a.distance(*b) <= SAME_JOINT_M;
    a.parents() == b.parents() && a.joints().iter().zip(b.joints()).all(is_near)
}
