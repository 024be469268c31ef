//! The garment of an import: its animation, its rest shape and its frame rate.

use super::notes::Notes;
use crate::args::{ImportArgs, MeshUpName};
use anyhow::{Result, bail};
use glam::Vec3;
use std::path::Path;
use unic_core::mesh::TriMesh;
use unic_io::{Capture, VertexFrames, pc2::read_pc2, read_obj, read_vertex_cache};

/// Conversion of a file's positions to metres, Y up.
#[derive(Clone, Copy, Debug)]
struct Conversion {
    up: MeshUpName,
    /// Metres in a unit of the file.
    scale: f32,
}

impl Conversion {
    fn of(args: &ImportArgs) -> Self {
        Self {
            up: args.up,
            scale: args.scale,
        }
    }

    fn apply(self, v: Vec3) -> Vec3 {
        let turned = match self.up {
            MeshUpName::Y => v,
            MeshUpName::Z => Vec3::new(v.x, v.z, -v.y),
        };
        turned * self.scale
    }

    fn describe(self, path: &Path, notes: &mut Notes) {
        if self.up == MeshUpName::Z {
            notes.add(path, "Z up converted to Y up");
        }
        if self.scale != 1.0 {
            notes.add(path, &format!("scaled by {}", self.scale));
        }
    }
}

/// Animation of a garment's vertices.
pub(super) struct Animation {
    /// Positions in the unit and axes of the file.
    pub(super) frames: VertexFrames,
    /// Frames per second, if the file states them.
    fps: Option<f32>,
    /// First frame with its faces in metres, Y up, if the file has faces.
    mesh: Option<TriMesh>,
    conversion: Conversion,
}

impl Animation {
    /// Reads the animation of `--garment`.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn read(args: &ImportArgs, notes: &mut Notes) -> Result<Self> {
        let path = &args.garment;
        let cache = read_vertex_cache(path)?;
        let conversion = Conversion::of(args);
        conversion.describe(path, notes);
        if path.extension().is_some_and(|e| e == "pc2") {
            describe_samples(path, notes)?;
        }
        Ok(Self {
            frames: cache.frames,
            fps: cache.fps,
            mesh: cache.mesh.map(|mesh| converted(mesh, conversion)),
            conversion,
        })
    }

    /// Writes the positions of a frame to `positions`, in metres, Y up.
    ///
    /// # Panics
    /// When the animation does not have the frame.
    pub(super) fn frame(&self, frame: usize, positions: &mut Vec<Vec3>) {
        positions.clear();
        positions.extend(self.frames.frame(frame).iter().map(|v| self.conversion.apply(*v)));
    }
}

/// Notes a point cache whose samples are not the frames of its scene.
fn describe_samples(path: &Path, notes: &mut Notes) -> Result<()> {
    let step = read_pc2(path)?.frames_per_sample;
    if step != 1.0 {
        let text = format!("a sample for every {step} frames of the scene: --fps is the rate of the samples");
        notes.add(path, &text);
    }
    Ok(())
}

fn converted(mut mesh: TriMesh, conversion: Conversion) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = conversion.apply(*v));
    mesh
}

/// Returns the rest shape: that of `--rest`, of the capture, or the first frame of the animation.
///
/// # Errors
/// No file with faces, a rest shape that is not that of the capture.
pub(super) fn rest(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &Animation,
    notes: &mut Notes,
) -> Result<TriMesh> {
    if let Some(path) = &args.rest {
        let conversion = Conversion::of(args);
        let mesh = converted(read_obj(path)?, conversion);
        conversion.describe(path, notes);
        if let Some(capture) = before {
            capture.check_same_rest(path, &mesh)?;
        }
        return Ok(mesh);
    }
    if let Some(capture) = before {
        return Ok(capture.garment.rest.clone());
    }
    let Some(mesh) = &animation.mesh else {
        bail!(
            "{}: expected a rest shape with faces, found positions alone; give the garment's mesh as --rest \
             FILE.obj",
            args.garment.display()
        );
    };
    notes.add(
        &args.garment,
        "no rest shape given: the first frame is taken, whose lengths the cloth then keeps; --rest states \
         another",
    );
    Ok(mesh.clone())
}

/// Checks that the animation has the vertices of the rest shape.
///
/// # Errors
/// Another number of vertices.
pub(super) fn check_vertex_count(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &Animation,
    rest: &TriMesh,
) -> Result<()> {
    let (expected, found) = (rest.vertices.len(), animation.frames.vertex_count());
    if expected == found {
        return Ok(());
    }
    let of = match (&args.rest, before) {
        (Some(path), _) => path,
        (None, Some(capture)) => &capture.root,
        (None, None) => &args.garment,
    };
    bail!(
        "{}: expected {expected} vertices as in the rest shape of {}, found {found}: export both from one mesh, \
         with its vertex order kept",
        args.garment.display(),
        of.display()
    )
}

/// Returns the frame rate of the garment: its file's, that of `--fps`, or that of the capture. None
/// if only the motion can tell.
///
/// # Errors
/// A rate that is not that of the capture.
pub(super) fn frame_rate(
    args: &ImportArgs,
    before: Option<&Capture>,
    animation: &Animation,
    notes: &mut Notes,
) -> Result<Option<f32>> {
    let own = before.map(|capture| capture.manifest.fps);
    let stated = animation.fps.or(args.fps);
    if let (Some(file), Some(asked)) = (animation.fps, args.fps)
        && file != asked
    {
        let text = format!("the file states {file} fps, which is taken instead of --fps {asked}");
        notes.add(&args.garment, &text);
    }
    match (own, stated) {
        // Frames of cloth are not interpolated: a capture has one frame rate.
        (Some(own), Some(stated)) if (own - stated).abs() > 1e-4 * own => bail!(
            "{}: expected the {own} frames per second of {}, found {stated}",
            args.garment.display(),
            args.out.display()
        ),
        _ => Ok(own.or(stated)),
    }
}
