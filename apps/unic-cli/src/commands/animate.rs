//! `unic animate`.

mod files;

use crate::{
    args::AnimateArgs,
    interrupt, model_file, motion_file,
    output::{print, print_json},
    pictures::{CLOTH, GAP, Place, Shot, Studio, evenly_spread},
    progress::Progress,
};
use anyhow::{Result, anyhow, bail};
use files::Files;
use glam::Vec3;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};
use unic_core::{
    animator::{Animator, Start, StepInput},
    clip::Clip,
    model::Model,
};
use unic_io::{check, read_obj, read_vertex_cache};
use unic_viewer::grid;

/// Pictures in the strip.
const SHOTS: usize = 8;

/// Animates and writes.
pub(crate) fn run(args: &AnimateArgs) -> Result<()> {
    let started = Instant::now();
    files::check(args)?;
    let model = Arc::new(read_model(args)?);
    let clip = read_motion(args, &model)?;
    let start = args
        .start
        .as_ref()
        .map(|path| read_start(args, path, &model, &clip))
        .transpose()?;
    let mut files = Files::create(args, &model, &clip)?;
    let shots = animate(args, &model, &clip, start.as_deref(), &mut files)?;
    let picture = draw(&model, &clip, &shots)?;
    let written = files.finish(&picture)?;
    let seconds = started.elapsed().as_secs_f64();
    show(
        args,
        &Summary {
            frames: clip.len(),
            fps: clip.fps,
            vertices: model.vertex_count(),
            seconds,
            written,
        },
    )
}

fn read_model(args: &AnimateArgs) -> Result<Model> {
    let model = model_file::read(&args.model)?;
    let Some(path) = &args.mesh else { return Ok(model) };
    let mesh = read_obj(path)?;
    args.force
        .settle(path, &check::other_mesh(&mesh, &model.garment().rest))?;
    model
        .with_mesh(mesh)
        .map_err(|e| anyhow!("{}: {e}", path.display()))
}

fn read_motion(args: &AnimateArgs, model: &Model) -> Result<Clip> {
    let fps = model.config().fps;
    let clip = motion_file::read(&args.motion, model.character(), fps, &args.reading, args.force)?;
    let Some(range) = args.frames.clone() else {
        return Ok(clip);
    };
    if range.end > clip.len() {
        let (path, fps) = (args.motion.display(), clip.fps);
        bail!(
            "{path}: expected --frames within 0..{} at {fps} fps, found {}..{}",
            clip.len(),
            range.start,
            range.end
        );
    }
    Ok(clip.part(range))
}

/// Positions of the first frame, or of the only one.
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
    match positions.iter().position(|p| !p.is_finite()) {
        None => {
            let skeleton = &model.character().skeleton;
            let findings = check::start(&positions, model.garment(), skeleton, &clip.poses[0]);
            args.force.settle(path, &findings)?;
            Ok(positions)
        }
        Some(vertex) => bail!(
            "{}: expected finite positions, found vertex {vertex} at none",
            path.display()
        ),
    }
}

/// A clip of a capture may have its garment in a file beside it.
fn first_frame(path: &Path) -> Result<Vec<Vec3>> {
    let mapped = path.with_extension("garment.npy");
    let source = if path.extension().is_some_and(|e| e == "npz") && mapped.exists() {
        &mapped
    } else {
        path
    };
    let cache = read_vertex_cache(source)?;
    match cache.frames.iter().next() {
        Some(frame) => Ok(frame.to_vec()),
        None => bail!("{}: expected at least one frame, found none", source.display()),
    }
}

/// Steps through the clip; pictures are kept at even distances.
fn animate(
    args: &AnimateArgs,
    model: &Arc<Model>,
    clip: &Clip,
    start: Option<&[Vec3]>,
    files: &mut Files,
) -> Result<Vec<(usize, Shot)>> {
    let mut animator = animator(args, model);
    let mut progress = Progress::new("animating", 0, clip.len() as u64);
    let picture_frames = evenly_spread(clip.len(), SHOTS);
    let mut shots = Vec::new();
    let mut body = Vec::new();
    for (t, pose) in clip.poses.iter().enumerate() {
        interrupt::check()?;
        let mut input = StepInput::of_clip(clip, t);
        input.wind = args.wind.unwrap_or(input.wind);
        let garment = match t {
            0 => animator.reset(&input, start.map_or(Start::MeanShape, Start::Positions)),
            _ => animator.step(&input),
        };
        let garment = garment
            .map_err(|e| anyhow!("{}: {e}", args.motion.display()))?
            .positions
            .to_vec();
        animator.body(&mut body);
        files.push(pose, &garment, &body)?;
        if picture_frames.contains(&t) {
            let place = Place::new(&model.character().skeleton, pose);
            shots.push((
                t,
                Shot {
                    body: body.clone(),
                    garment,
                    place,
                },
            ));
        }
        progress.set(t as u64 + 1, String::new);
    }
    Ok(shots)
}

fn animator(args: &AnimateArgs, model: &Arc<Model>) -> Animator {
    let mut animator = Animator::new(model.clone());
    if let Some(name) = args.intersection {
        animator.set_intersection(model_file::intersection(model, name));
    }
    animator.set_code_sampling(args.code.sampling());
    animator
}

fn draw(model: &Model, clip: &Clip, shots: &[(usize, Shot)]) -> Result<Vec<u8>> {
    let all: Vec<Shot> = shots.iter().map(|(_, shot)| shot.clone()).collect();
    let studio = Studio::new(model.character(), model.garment(), clip.ground_height, &all)?;
    let tile =
        |(t, shot): &(usize, Shot)| studio.picture(shot, CLOTH, &format!("{:.2} s", *t as f32 / clip.fps));
    let tiles = shots.iter().map(tile).collect::<Result<Vec<_>>>()?;
    Ok(grid(&tiles, tiles.len(), GAP)?.encode_png()?)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    frames: usize,
    fps: f32,
    vertices: usize,
    /// Of the whole command.
    seconds: f64,
    /// Garment, body unless it is in the same file, their meshes for .pc2, picture.
    written: Vec<PathBuf>,
}

fn show(args: &AnimateArgs, summary: &Summary) -> Result<()> {
    if args.json {
        return print_json(summary);
    }
    let Summary {
        frames,
        fps,
        vertices,
        seconds,
        written,
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
