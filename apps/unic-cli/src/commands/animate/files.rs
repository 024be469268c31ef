//! Files that `unic animate` writes, in the format of the ending of `--out`.

use crate::{
    args::AnimateArgs,
    motion_file,
    outputs::{self, Existing},
};
use anyhow::{Result, anyhow, bail};
use glam::Vec3;
use std::{
    ffi::OsString,
    io::Write,
    path::{Path, PathBuf},
};
use unic_core::{Model, Pose, character::FileMesh, clip::Clip, mesh::TriMesh};
use unic_io::{
    VertexCacheWriter,
    alembic::AlembicWriter,
    atomic::AtomicFile,
    glb::{GlbScene, GlbWriter},
    usd::UsdWriter,
    write_obj_to,
};
use unic_vat::{VatPaths, VatWriter};

/// Files of an animation that is being written.
///
/// All are opened before the first frame, so that a missing folder or a full disk is found early.
/// None gets its final name before [`AnimationFiles::finish`].
pub(super) struct AnimationFiles {
    animation: Animation,
    /// Meshes of garment and body, which point caches need because they hold no faces.
    meshes: Vec<AtomicFile>,
    vat: Option<VatWriter>,
    picture: AtomicFile,
    paths: Vec<PathBuf>,
    body: BodyOrder,
}

/// Order of the vertices of bodies in files.
struct BodyOrder {
    /// Mesh of the body's file, if it has other vertices than the model's body.
    file_mesh: Option<FileMesh>,
    positions: Vec<Vec3>,
}

impl BodyOrder {
    /// Returns the positions of a frame as files have them.
    fn of_file<'a>(&'a mut self, body: &'a [Vec3]) -> &'a [Vec3] {
        match &self.file_mesh {
            None => body,
            Some(mesh) => {
                mesh.expand(body, &mut self.positions);
                &self.positions
            }
        }
    }
}

// Boxed because the writers are large and differ in size.
enum Animation {
    /// Writers of garment and body, each with a file or folder of its own.
    Caches(Box<[VertexCacheWriter; 2]>),
    /// Writer of one file for garment and body.
    Glb(Box<GlbWriter>),
    /// Writer of one file with garment and body as meshes.
    Alembic(Box<AlembicWriter>),
    /// Writer of one layer with garment and body as meshes.
    Usd(Box<UsdWriter>),
}

/// Format of an animation, chosen by the ending of its path.
#[derive(Clone, Copy, PartialEq)]
enum AnimationFormat {
    Glb,
    Alembic,
    Usd,
    Pc2,
    Mdd,
    Npz,
    Folder,
}

impl AnimationFormat {
    /// Returns the format of a path.
    ///
    /// # Errors
    /// An ending of no known format.
    fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("glb") => Ok(Self::Glb),
            Some("abc") => Ok(Self::Alembic),
            Some("usda" | "usdc" | "usd") => Ok(Self::Usd),
            Some("pc2") => Ok(Self::Pc2),
            Some("mdd") => Ok(Self::Mdd),
            Some("npz") => Ok(Self::Npz),
            None => Ok(Self::Folder),
            Some(other) => bail!(
                "{}: expected the ending .glb, .abc, .usd, .usda, .usdc, .pc2, .mdd, .npz or none (a folder of OBJ files), \
                 found .{other}",
                path.display()
            ),
        }
    }
}

/// Paths of all outputs.
struct OutputPaths {
    /// Garment and body; one file for both with GLB, Alembic and USD.
    animation: Vec<PathBuf>,
    /// Meshes of garment and body, for point caches only.
    meshes: Vec<PathBuf>,
    /// Files of the vertex animation texture, if there is one.
    vat: Vec<PathBuf>,
    picture: PathBuf,
}

impl OutputPaths {
    fn of(args: &AnimateArgs, format: AnimationFormat) -> Self {
        let body = body_path(&args.out);
        let picture = args.picture.clone();
        let vat = args.vat.as_ref();
        let vat = vat.map_or(Vec::new(), |path| {
            VatPaths::of(path).all().map(PathBuf::clone).to_vec()
        });
        Self {
            vat,
            picture: picture.unwrap_or_else(|| args.out.with_extension("png")),
            meshes: match format {
                AnimationFormat::Pc2 | AnimationFormat::Mdd => {
                    [&args.out, &body].map(|path| path.with_extension("obj")).to_vec()
                }
                _ => Vec::new(),
            },
            animation: match format {
                AnimationFormat::Glb | AnimationFormat::Alembic | AnimationFormat::Usd => {
                    vec![args.out.clone()]
                }
                _ => vec![args.out.clone(), body],
            },
        }
    }

    /// Paths of garment, body, meshes, texture and picture, in this order.
    fn all(&self) -> Vec<PathBuf> {
        let picture = std::slice::from_ref(&self.picture);
        [&self.animation, &self.meshes, &self.vat, picture].concat()
    }
}

/// Refuses outputs that exist (without `--overwrite`), that are inputs, or that are equal.
///
/// # Errors
/// An unknown ending of `--out`, or a [`crate::failure::Usage`] that names the output.
pub(super) fn check(args: &AnimateArgs) -> Result<()> {
    let outputs = OutputPaths::of(args, AnimationFormat::of(&args.out)?);
    let inputs = [
        Some(&args.model),
        motion_file::files([&args.motion]).next(),
        args.mesh.as_ref(),
        args.start.as_ref(),
        args.reading.bone_map.as_ref(),
    ];
    outputs::Outputs::with_inputs(inputs.into_iter().flatten())
        .files(outputs.all())
        .check(Existing::of(args.overwrite))
}

impl AnimationFiles {
    /// Opens all files under temporary names.
    pub(super) fn create(args: &AnimateArgs, model: &Model, clip: &Clip) -> Result<Self> {
        let format = AnimationFormat::of(&args.out)?;
        let outputs = OutputPaths::of(args, format);
        let paths = outputs.all();
        let character = model.character().in_file_order();
        let garment = &model.garment().rest;
        let meshes = [garment, &character.body];
        let named = [("garment", garment), ("body", &character.body)];
        let mesh = |(path, mesh): (&PathBuf, &TriMesh)| mesh_file(path, mesh);
        Ok(Self {
            animation: match format {
                AnimationFormat::Glb => {
                    let scene = GlbScene {
                        name: &clip.name,
                        character: &character,
                        garment,
                        fps: clip.fps,
                        frames: clip.len(),
                    };
                    Animation::Glb(Box::new(GlbWriter::create(&args.out, &scene)?))
                }
                AnimationFormat::Alembic => {
                    Animation::Alembic(Box::new(AlembicWriter::create(&args.out, &named, clip.fps)?))
                }
                AnimationFormat::Usd => {
                    Animation::Usd(Box::new(UsdWriter::create(&args.out, &named, clip.fps)?))
                }
                _ => Animation::caches(args, meshes, clip.fps)?,
            },
            meshes: (outputs.meshes.iter().zip(meshes))
                .map(mesh)
                .collect::<Result<_>>()?,
            vat: (args.vat.as_ref())
                .map(|path| VatWriter::create(path, &model.garment().rest, clip.fps, clip.len()))
                .transpose()?,
            picture: AtomicFile::create(&outputs.picture)?,
            paths,
            body: BodyOrder {
                file_mesh: model.character().file_mesh.clone(),
                positions: Vec::new(),
            },
        })
    }

    /// Writes the next frame: the pose, and the positions of garment and body in metres.
    pub(super) fn push(&mut self, pose: &Pose, garment: &[Vec3], body: &[Vec3]) -> Result<()> {
        if let Some(vat) = &mut self.vat {
            vat.push(garment)?;
        }
        let body = self.body.of_file(body);
        match &mut self.animation {
            // The body of a GLB is a skin, which the pose moves.
            Animation::Glb(writer) => writer.push(pose, garment)?,
            Animation::Alembic(writer) => writer.push(&[garment, body])?,
            Animation::Usd(writer) => writer.push(&[garment, body])?,
            Animation::Caches(writers) => {
                let [garments, bodies] = &mut **writers;
                garments.push(garment)?;
                bodies.push(body)?;
            }
        }
        Ok(())
    }

    /// Writes the picture, gives all files their names and returns their paths.
    ///
    /// The order is garment, body, meshes, texture, picture.
    pub(super) fn finish(mut self, picture: &[u8]) -> Result<Vec<PathBuf>> {
        let failed = |path: &Path, e: std::io::Error| anyhow!("{}: cannot write: {e}", path.display());
        let target = self.picture.target().to_owned();
        // Everything is written before the first file gets its name: a full disk leaves no file
        // behind.
        (self.picture.write_all(picture)).map_err(|e| failed(&target, e))?;
        match self.animation {
            Animation::Glb(writer) => writer.finish()?,
            Animation::Alembic(writer) => writer.finish()?,
            Animation::Usd(writer) => writer.finish()?,
            Animation::Caches(writers) => (*writers).into_iter().try_for_each(VertexCacheWriter::finish)?,
        }
        if let Some(vat) = self.vat {
            vat.finish()?;
        }
        for file in self.meshes.into_iter().chain([self.picture]) {
            file.finish()?;
        }
        Ok(self.paths)
    }
}

impl Animation {
    /// Opens the caches of garment and body.
    fn caches(args: &AnimateArgs, [garment, body]: [&TriMesh; 2], fps: f32) -> Result<Self> {
        let garment = VertexCacheWriter::create(&args.out, garment, fps)?;
        let body = VertexCacheWriter::create(&body_path(&args.out), body, fps)?;
        Ok(Self::Caches(Box::new([garment, body])))
    }
}

fn mesh_file(path: &Path, mesh: &TriMesh) -> Result<AtomicFile> {
    let mut file = AtomicFile::create(path)?;
    write_obj_to(&mut file, mesh).map_err(|e| anyhow!("{}: cannot write: {e}", path.display()))?;
    Ok(file)
}

/// Path of the body beside that of the garment: `walk.body.pc2` for `walk.pc2`, `frames_body` for a
/// folder `frames`.
pub(crate) fn body_path(path: &Path) -> PathBuf {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_body_is_written_beside_the_garment() {
        assert_eq!(body_path(Path::new("a/walk.pc2")), Path::new("a/walk.body.pc2"));
        assert_eq!(body_path(Path::new("frames")), Path::new("frames_body"));
    }

    #[test]
    fn the_ending_chooses_the_format_in_any_case() {
        let format = |path: &str| AnimationFormat::of(Path::new(path)).ok();
        assert!(format("A.GLB") == Some(AnimationFormat::Glb));
        assert!(format("a.b/walk") == Some(AnimationFormat::Folder));
        assert!(format("walk.Abc") == Some(AnimationFormat::Alembic));
        assert!(format("walk.usda") == Some(AnimationFormat::Usd));
        assert!(format("walk.fbx").is_none());
    }
}
