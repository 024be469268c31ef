//! What `unic animate` writes, and what it never writes over.

use crate::{
    args::AnimateArgs,
    outputs::{self, Existing},
};
use anyhow::{Result, anyhow, bail};
use glam::Vec3;
use std::{
    ffi::OsString,
    io::Write,
    path::{Path, PathBuf},
};
use unic_core::{clip::Clip, mesh::TriMesh, model::Model, skeleton::Pose};
use unic_io::{
    VertexCacheWriter,
    atomic::AtomicFile,
    glb::{GlbScene, GlbWriter},
    write_obj_to,
};

/// The files being written: all are open before a frame is made, and nothing appears before
/// [`Files::finish`].
pub(super) struct Files {
    animation: Animation,
    /// A point cache has no faces: these are the meshes that the two caches deform.
    meshes: Vec<AtomicFile>,
    picture: AtomicFile,
    paths: Vec<PathBuf>,
}

enum Animation {
    /// Garment and body each in a file or folder of its own.
    Caches(Box<[VertexCacheWriter; 2]>),
    /// Both in one file.
    Glb(Box<GlbWriter>),
}

/// The forms of an animation, by the ending of its path.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Glb,
    Pc2,
    Npz,
    Folder,
}

impl Form {
    fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("glb") => Ok(Self::Glb),
            Some("pc2") => Ok(Self::Pc2),
            Some("npz") => Ok(Self::Npz),
            None => Ok(Self::Folder),
            Some(other) => bail!(
                "{}: expected a path that ends in .glb, .pc2, .npz or in no ending (a folder of OBJ files), \
                 found .{other}",
                path.display()
            ),
        }
    }
}

/// Where everything goes.
struct Outputs {
    /// The garment; in a GLB with the body, else the body beside it.
    animation: Vec<PathBuf>,
    /// Of garment and body, for point caches.
    meshes: Vec<PathBuf>,
    picture: PathBuf,
}

impl Outputs {
    fn of(args: &AnimateArgs, form: Form) -> Self {
        let body = beside(&args.out);
        let picture = args.picture.clone();
        Self {
            picture: picture.unwrap_or_else(|| args.out.with_extension("png")),
            meshes: match form {
                Form::Pc2 => [&args.out, &body].map(|path| path.with_extension("obj")).to_vec(),
                _ => Vec::new(),
            },
            animation: match form {
                Form::Glb => vec![args.out.clone()],
                _ => vec![args.out.clone(), body],
            },
        }
    }

    /// Garment, body, meshes, picture.
    fn all(&self) -> Vec<PathBuf> {
        let picture = std::slice::from_ref(&self.picture);
        [&self.animation, &self.meshes, picture].concat()
    }
}

/// Refuses outputs that would cost the user something; before anything is read.
pub(super) fn check(args: &AnimateArgs) -> Result<()> {
    let outputs = Outputs::of(args, Form::of(&args.out)?);
    let inputs = [
        Some(&args.model),
        Some(&args.motion),
        args.mesh.as_ref(),
        args.start.as_ref(),
        args.reading.bone_map.as_ref(),
    ];
    outputs::Outputs::beside(inputs.into_iter().flatten())
        .files(outputs.all())
        .check(Existing::of(args.overwrite))
}

impl Files {
    pub(super) fn create(args: &AnimateArgs, model: &Model, clip: &Clip) -> Result<Self> {
        let form = Form::of(&args.out)?;
        let outputs = Outputs::of(args, form);
        let paths = outputs.all();
        let meshes = [&model.garment().rest, &model.character().body];
        let mesh = |(path, mesh): (&PathBuf, &TriMesh)| mesh_file(path, mesh);
        Ok(Self {
            animation: match form {
                Form::Glb => Animation::glb(&args.out, model, clip)?,
                _ => Animation::caches(args, meshes, clip.fps)?,
            },
            meshes: (outputs.meshes.iter().zip(meshes))
                .map(mesh)
                .collect::<Result<_>>()?,
            picture: AtomicFile::create(&outputs.picture)?,
            paths,
        })
    }

    pub(super) fn push(&mut self, pose: &Pose, garment: &[Vec3], body: &[Vec3]) -> Result<()> {
        match &mut self.animation {
            Animation::Glb(writer) => writer.push(pose, garment)?,
            Animation::Caches(writers) => {
                let [garments, bodies] = &mut **writers;
                garments.push(garment)?;
                bodies.push(body)?;
            }
        }
        Ok(())
    }

    /// Everything is written before the first file gets its name. The paths: garment, body, meshes,
    /// picture.
    pub(super) fn finish(mut self, picture: &[u8]) -> Result<Vec<PathBuf>> {
        let failed = |path: &Path, e: std::io::Error| anyhow!("{}: cannot write: {e}", path.display());
        let target = self.picture.target().to_owned();
        (self.picture.write_all(picture)).map_err(|e| failed(&target, e))?;
        match self.animation {
            Animation::Glb(writer) => writer.finish()?,
            Animation::Caches(writers) => (*writers).into_iter().try_for_each(VertexCacheWriter::finish)?,
        }
        for file in self.meshes.into_iter().chain([self.picture]) {
            file.finish()?;
        }
        Ok(self.paths)
    }
}

impl Animation {
    fn glb(path: &Path, model: &Model, clip: &Clip) -> Result<Self> {
        let scene = GlbScene {
            name: &clip.name,
            character: model.character(),
            garment: &model.garment().rest,
            fps: clip.fps,
            frames: clip.len(),
        };
        Ok(Self::Glb(Box::new(GlbWriter::create(path, &scene)?)))
    }

    fn caches(args: &AnimateArgs, [garment, body]: [&TriMesh; 2], fps: f32) -> Result<Self> {
        let garment = VertexCacheWriter::create(&args.out, garment, fps)?;
        let body = VertexCacheWriter::create(&beside(&args.out), body, fps)?;
        Ok(Self::Caches(Box::new([garment, body])))
    }
}

fn mesh_file(path: &Path, mesh: &TriMesh) -> Result<AtomicFile> {
    let mut file = AtomicFile::create(path)?;
    write_obj_to(&mut file, mesh).map_err(|e| anyhow!("{}: cannot write: {e}", path.display()))?;
    Ok(file)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_body_goes_beside_the_garment() {
        assert_eq!(beside(Path::new("a/walk.pc2")), Path::new("a/walk.body.pc2"));
        assert_eq!(beside(Path::new("frames")), Path::new("frames_body"));
    }

    #[test]
    fn endings_in_any_case_tell_the_form() {
        assert!(Form::of(Path::new("A.GLB")).is_ok_and(|form| form == Form::Glb));
        assert!(Form::of(Path::new("a.b/walk")).is_ok_and(|form| form == Form::Folder));
        assert!(Form::of(Path::new("walk.abc")).is_err());
    }
}
