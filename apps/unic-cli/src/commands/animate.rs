//! The command `unic animate`: runs a model on a motion and writes the animation.

mod files;

use crate::{
    args::AnimateArgs,
    interrupt, model_file, motion_file,
    output::{print, print_json},
    pictures::{FrameSnapshot, GAP, Placement, Renderer, Snapshot, evenly_spread},
    progress::Progress,
};
use anyhow::{Result, anyhow, bail};
use files::AnimationFiles;
#[cfg(feature = "viewer")]
pub(crate) use files::body_path;
use glam::Vec3;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};
use unic_core::{Animator, Model, Start, StepInput, clip::Clip};
use unic_io::{check, read_obj, read_vertex_cache};
use unic_raster::grid;

/// Number of frames in the picture.
const PICTURES: usize = 8;

/// Animates a motion and writes the animation.
///
/// # Errors
/// Unusable options or inputs, files that cannot be read or written, an interruption.
pub(crate) fn run(args: &AnimateArgs) -> Result<()> {
    let started = Instant::now();
    // Outputs are checked before inputs are read, which may take long.
    files::check(args)?;
    let model = Arc::new(read_model(args)?);
    let clip = read_motion(args, &model)?;
    let start = args
        .start
        .as_ref()
        .map(|path| read_start(args, path, &model, &clip))
        .transpose()?;
    let mut files = AnimationFiles::create(args, &model, &clip)?;
    let pictures = animate(args, &model, &clip, start.as_deref(), &mut files)?;
    let picture = draw(&model, &clip, &pictures)?;
    let written = files.finish(&picture)?;
    let seconds = started.elapsed().as_secs_f64();
    print_summary(
        args,
        &AnimationSummary {
            frames: clip.len(),
            fps: clip.fps,
            vertices: model.vertex_count(),
            precision: model.precision().name(),
            seconds,
            written,
        },
    )
}

/// Reads the model, with the mesh of `--mesh` if there is one.
fn read_model(args: &AnimateArgs) -> Result<Model> {
    let model = args.precision.apply(model_file::read(&args.model)?);
    let Some(path) = &args.mesh else { return Ok(model) };
    let mesh = read_obj(path)?;
    args.force
        .check_findings(path, &check::other_mesh(&mesh, &model.garment().rest))?;
    model
        .with_mesh(mesh)
        .map_err(|e| anyhow!("{}: {e}", path.display()))
}

/// Reads the motion at the model's frame rate, cut to `--frames`.
fn read_motion(args: &AnimateArgs, model: &Model) -> Result<Clip> {
    let fps = model.config().fps;
    let clip = motion_file::read(&args.motion, model.character(), fps, &args.reading, args.force)?;
    motion_file::cut(&args.motion, clip, args.frames.clone())
}

/// Reads the positions of `--start`, in world space and metres.
///
/// # Errors
/// Another number of vertices, positions that are not finite, a probable mistake without `--force`.
fn read_start(args: &AnimateArgs, path: &Path, model: &Model, clip: &Clip) -> Result<Vec<Vec3>> {
    let is_obj = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    let positions = match is_obj {
        true => read_obj(path)?.vertices,
        false => first_frame(path)?,
    };
    let (expected, found) = (model.vertex_count(), positions.len());
    if expected != found {
        bail!(
            "{}: expected a garment of {expected} vertices to start from, found {found}",
            path.display()
        );
    }
    // Plausibility is computed from the positions, which must be finite for that.
    match positions.iter().position(|p| !p.is_finite()) {
        None => {
            let skeleton = &model.character().skeleton;
            let findings = check::start(&positions, model.garment(), skeleton, &clip.poses[0]);
            args.force.check_findings(path, &findings)?;
            Ok(positions)
        }
        Some(vertex) => bail!(
            "{}: expected finite positions, found vertex {vertex} at none",
            path.display()
        ),
    }
}

/// Positions of the first frame of a vertex animation or of a clip of a capture.
fn first_frame(path: &Path) -> Result<Vec<Vec3>> {
    // The motion `clips/NAME.npz` of a capture has its garment beside it, in
    // `clips/NAME.garment.npy`.
    let garment_file = path.with_extension("garment.npy");
    let source = if path.extension().is_some_and(|e| e == "npz") && garment_file.exists() {
        &garment_file
    } else {
        path
    };
    let cache = read_vertex_cache(source)?;
    match cache.frames.iter().next() {
        Some(frame) => Ok(frame.to_vec()),
        None => bail!("{}: expected at least one frame, found none", source.display()),
    }
}

/// Animates all frames of the clip and writes them. Returns the frames for the picture.
fn animate(
    args: &AnimateArgs,
    model: &Arc<Model>,
    clip: &Clip,
    start: Option<&[Vec3]>,
    files: &mut AnimationFiles,
) -> Result<Vec<FrameSnapshot>> {
    let mut animator = animator(args, model);
    let mut progress = Progress::new("animating", 0, clip.len() as u64);
    let picture_frames = evenly_spread(clip.len(), PICTURES);
    let mut pictures = Vec::new();
    let mut body = Vec::new();
    for (t, pose) in clip.poses.iter().enumerate() {
        interrupt::check()?;
        let mut input = StepInput::of_clip(clip, t);
        input.wind = args.wind.unwrap_or(input.wind);
        // Frame 0 places the garment; every other frame follows from the state of the one before.
        let garment = match t {
            0 => animator.reset(&input, start.map_or(Start::MeanShape, Start::Positions)),
            _ => animator.step(&input),
        };
        // A copy, because the animator is borrowed again for the body.
        let garment = garment
            .map_err(|e| anyhow!("{}: {e}", args.motion.display()))?
            .positions
            .to_vec();
        animator.body(&mut body);
        files.push(pose, &garment, &body)?;
        if picture_frames.contains(&t) {
            let snapshot = Snapshot {
                body: body.clone(),
                garment,
                placement: Placement::new(&model.character().skeleton, pose),
            };
            pictures.push(FrameSnapshot { frame: t, snapshot });
        }
        progress.set(t as u64 + 1, String::new);
    }
    Ok(pictures)
}

fn animator(args: &AnimateArgs, model: &Arc<Model>) -> Animator {
    let mut animator = Animator::new(model.clone());
    if let Some(name) = args.intersection {
        animator.set_intersection(model_file::intersection(model, name));
    }
    animator.set_code_sampling(args.code.sampling());
    animator
}

/// Draws the frames in one row. Returns the bytes of a PNG.
fn draw(model: &Model, clip: &Clip, pictures: &[FrameSnapshot]) -> Result<Vec<u8>> {
    let all: Vec<Snapshot> = pictures.iter().map(|p| p.snapshot.clone()).collect();
    let renderer = Renderer::new(model.character(), model.garment(), clip.ground_height, &all)?;
    #[cfg(feature = "viewer")]
    let mut portraits = crate::portraits::Portraits::new(&renderer)?;
    let tile = |p: &FrameSnapshot| {
        let caption = format!("{:.2} s", p.frame as f32 / clip.fps);
        #[cfg(feature = "viewer")]
        return portraits.picture(&p.snapshot, &caption);
        #[cfg(not(feature = "viewer"))]
        renderer.picture(&p.snapshot, crate::pictures::CLOTH, &caption)
    };
    let tiles = pictures.iter().map(tile).collect::<Result<Vec<_>>>()?;
    Ok(grid(&tiles, tiles.len(), GAP)?.encode_png()?)
}

/// Object that `--json` prints.
#[derive(Serialize)]
struct AnimationSummary {
    frames: usize,
    fps: f32,
    vertices: usize,
    /// Precision of the networks.
    precision: &'static str,
    /// Wall-clock time of the whole command.
    seconds: f64,
    /// Paths of the garment, the body if it has its own file, the meshes of point caches, the vertex
    /// animation texture, the picture.
    written: Vec<PathBuf>,
}

fn print_summary(args: &AnimateArgs, summary: &AnimationSummary) -> Result<()> {
    if args.json {
        return print_json(summary);
    }
    let AnimationSummary {
        frames,
        fps,
        vertices,
        seconds,
        written,
        ..
    } = summary;
    let paths: Vec<String> = written
        .iter()
        .map(|path| format!("  {}\n", path.display()))
        .collect();
    print(&format!(
        "{frames} frames of {vertices} vertices at {fps} fps in {seconds:.1} s\n{}",
        paths.concat()
    ))
}
