//! `unic animate`.

use crate::{
    args::{AnimateArgs, IntersectionName},
    interrupt, model_file, motion_file,
    output::{print, print_json},
    pictures::{CLOTH, GAP, Place, Shot, Studio, evenly_spread},
    progress::Progress,
};
use anyhow::{Result, anyhow, bail};
use glam::Vec3;
use serde::Serialize;
use std::{
    ffi::OsString,
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};
use unic_core::{
    animator::{Animator, Start, StepInput},
    clip::Clip,
    config::IntersectionMode,
    mesh::TriMesh,
    model::Model,
};
use unic_io::{VertexCacheWriter, atomic::AtomicFile, read_obj, read_vertex_cache, write_obj_to};
use unic_viewer::grid;

/// Pictures in the strip.
const SHOTS: usize = 8;

/// Animates and writes.
pub(crate) fn run(args: &AnimateArgs) -> Result<()> {
    let started = Instant::now();
    let model = Arc::new(read_model(args)?);
    let clip = read_motion(args, &model)?;
    let start = args
        .start
        .as_ref()
        .map(|path| read_start(path, &model))
        .transpose()?;
    let mut files = Files::create(args, &model)?;
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
    model
        .with_mesh(mesh)
        .map_err(|e| anyhow!("{}: {e}", path.display()))
}

fn read_motion(args: &AnimateArgs, model: &Model) -> Result<Clip> {
    let fps = model.config().fps;
    let mut clip = motion_file::read(&args.motion, model.character(), fps, &args.reading)?;
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
    clip.poses = clip.poses[range].to_vec();
    Ok(clip)
}

/// Positions of the first frame, or of the only one.
fn read_start(path: &Path, model: &Model) -> Result<Vec<Vec3>> {
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
        None => Ok(positions),
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
        let input = StepInput {
            pose,
            next_pose: clip.poses.get(t + 1),
            ground_height: clip.ground_height,
        };
        let garment = match t {
            0 => animator.reset(&input, start.map_or(Start::MeanShape, Start::Positions)),
            _ => animator.step(&input),
        };
        let garment = garment
            .map_err(|e| anyhow!("{}: {e}", args.motion.display()))?
            .positions
            .to_vec();
        animator.body(&mut body);
        files.push(&garment, &body)?;
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
    match args.intersection {
        Some(IntersectionName::Off) => animator.set_intersection(IntersectionMode::Off),
        Some(IntersectionName::Paper) => animator.set_intersection(model_file::paper_intersection(model)),
        None => {}
    }
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

/// The files being written: all are open before a frame is made, and nothing appears before
/// [`Files::finish`].
struct Files {
    garment: VertexCacheWriter,
    body: VertexCacheWriter,
    /// A point cache has no faces: these are the meshes that the two caches deform.
    meshes: Vec<AtomicFile>,
    picture: AtomicFile,
    /// Garment, body, meshes, picture.
    paths: Vec<PathBuf>,
}

impl Files {
    fn create(args: &AnimateArgs, model: &Model) -> Result<Self> {
        let paths = outputs(args);
        refuse_inputs(args, &paths)?;
        let fps = model.config().fps;
        let meshes = [&model.garment().rest, &model.character().body];
        let [garment, body] = [0, 1].map(|i| VertexCacheWriter::create(&paths[i], meshes[i], fps));
        let (mesh_paths, picture_path) = (&paths[2..paths.len() - 1], &paths[paths.len() - 1]);
        let mesh = |(path, mesh): (&PathBuf, &TriMesh)| mesh_file(path, mesh);
        Ok(Self {
            garment: garment?,
            body: body?,
            meshes: mesh_paths.iter().zip(meshes).map(mesh).collect::<Result<_>>()?,
            picture: AtomicFile::create(picture_path)?,
            paths,
        })
    }

    fn push(&mut self, garment: &[Vec3], body: &[Vec3]) -> Result<()> {
        self.garment.push(garment)?;
        Ok(self.body.push(body)?)
    }

    /// Everything is written before the first file gets its name.
    fn finish(mut self, picture: &[u8]) -> Result<Vec<PathBuf>> {
        let failed = |path: &Path, e: std::io::Error| anyhow!("{}: cannot write: {e}", path.display());
        let target = self.picture.target().to_owned();
        (self.picture.write_all(picture)).map_err(|e| failed(&target, e))?;
        self.garment.finish()?;
        self.body.finish()?;
        for file in self.meshes.into_iter().chain([self.picture]) {
            file.finish()?;
        }
        Ok(self.paths)
    }
}

fn mesh_file(path: &Path, mesh: &TriMesh) -> Result<AtomicFile> {
    let mut file = AtomicFile::create(path)?;
    write_obj_to(&mut file, mesh).map_err(|e| anyhow!("{}: cannot write: {e}", path.display()))?;
    Ok(file)
}

/// Garment, body, the meshes of point caches, picture.
fn outputs(args: &AnimateArgs) -> Vec<PathBuf> {
    let body = beside(&args.out);
    let picture = args.picture.clone();
    let picture = picture.unwrap_or_else(|| args.out.with_extension("png"));
    let is_pc2 = args
        .out
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("pc2"));
    let meshes = match is_pc2 {
        true => vec![args.out.with_extension("obj"), body.with_extension("obj")],
        false => Vec::new(),
    };
    [vec![args.out.clone(), body], meshes, vec![picture]].concat()
}

/// No output may be one of the files that are read: an artist's motion or mesh is never lost.
fn refuse_inputs(args: &AnimateArgs, outputs: &[PathBuf]) -> Result<()> {
    let inputs = [
        Some(&args.model),
        Some(&args.motion),
        args.mesh.as_ref(),
        args.start.as_ref(),
    ];
    let real: Vec<PathBuf> = inputs
        .into_iter()
        .flatten()
        .filter_map(|p| p.canonicalize().ok())
        .collect();
    match outputs
        .iter()
        .find(|path| path.canonicalize().is_ok_and(|path| real.contains(&path)))
    {
        None => Ok(()),
        Some(path) => bail!(
            "{}: expected an output that is none of the inputs, found one of them",
            path.display()
        ),
    }
}

/// `walk.body.pc2` for `walk.pc2`, `frames_body` for a folder `frames`.
fn beside(path: &Path) -> PathBuf {
    let mut name: OsString = path.file_stem().unwrap_or_default().to_owned();
    match path.extension() {
        Some(extension) => {
            name.push(".body.");
            name.push(extension);
        }
        None => name.push("_body"),
    }
    path.with_file_name(name)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    frames: usize,
    fps: f32,
    vertices: usize,
    /// Of the whole command.
    seconds: f64,
    /// Garment, body, their meshes for .pc2, picture.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_body_goes_beside_the_garment() {
        assert_eq!(beside(Path::new("a/walk.pc2")), Path::new("a/walk.body.pc2"));
        assert_eq!(beside(Path::new("frames")), Path::new("frames_body"));
    }
}
