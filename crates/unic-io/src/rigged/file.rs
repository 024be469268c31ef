//! Scene of a file, whichever format it has.

use super::RiggedFormat;
use crate::{
    error::{Error, Result},
    gltf,
    mesh_names::{listed, named},
};
use glam::Mat4;
use std::path::{Path, PathBuf};
use unic_scene::{Format, Local, Mesh, Request, Scene};

/// A checked scene and the file that it comes from.
#[derive(Debug)]
pub(super) struct SceneFile {
    pub(super) path: PathBuf,
    pub(super) format: RiggedFormat,
    pub(super) scene: Scene,
    /// Nodes in an order in which parents precede their children.
    order: Vec<usize>,
}

impl SceneFile {
    /// Reads the parts of a file that are asked for.
    ///
    /// # Errors
    /// A damaged file; parts that the file lacks.
    pub(super) fn read(path: &Path, format: RiggedFormat, request: &Request) -> Result<Self> {
        let other = |format| {
            let read = unic_scene::read(path, format, request);
            read.map_err(|fault| Error::content(path, fault.expected, fault.found))
        };
        let scene = match format {
            RiggedFormat::Gltf => gltf::read(path, request)?,
            RiggedFormat::Fbx => other(Format::Fbx)?,
            RiggedFormat::Usd => other(Format::Usd)?,
        };
        let Some(order) = scene.order() else {
            return Err(Error::content(path, "a tree of nodes", "a cycle"));
        };
        Ok(Self {
            path: path.to_path_buf(),
            format,
            scene,
            order,
        })
    }

    /// Returns an error about the content of the file.
    pub(super) fn error(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::content(&self.path, expected, found)
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.scene.nodes.len()
    }

    /// Name of a node.
    pub(super) fn name(&self, node: usize) -> &str {
        &self.scene.nodes[node].name
    }

    /// Parent of a node.
    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.scene.nodes[node].parent
    }

    /// Nodes in an order in which parents precede their children.
    pub(super) fn order(&self) -> &[usize] {
        &self.order
    }

    /// Transforms of the nodes outside any animation.
    pub(super) fn locals(&self) -> Vec<Local> {
        self.scene.nodes.iter().map(|node| node.local).collect()
    }

    /// Computes `world_from_node` of all nodes into `out`, with the transforms of `locals`.
    pub(super) fn world(&self, locals: &[Local], out: &mut Vec<Mat4>) {
        out.clear();
        out.resize(self.len(), Mat4::IDENTITY);
        for &node in &self.order {
            let local = locals[node].matrix();
            out[node] = self.parent(node).map_or(local, |parent| out[parent] * local);
        }
    }

    /// Names of all meshes.
    pub(super) fn mesh_names(&self) -> Vec<String> {
        self.scene.meshes.iter().map(|mesh| mesh.name.clone()).collect()
    }

    /// Returns the mesh with a skin that is called `body`, or the only one.
    ///
    /// # Errors
    /// None, several; none of the name.
    pub(super) fn skinned(&self, body: Option<&str>) -> Result<&Mesh> {
        let meshes = self.scene.meshes.iter();
        let skinned: Vec<&Mesh> = meshes.filter(|mesh| mesh.skin.is_some()).collect();
        let names = || skinned.iter().map(|mesh| mesh.name.clone()).collect::<Vec<_>>();
        match (skinned.as_slice(), body) {
            ([], _) => Err(self.error("a skinned mesh", "none")),
            (several, Some(body)) => Ok(several[named(&self.path, &names(), body)?]),
            ([mesh], None) => Ok(mesh),
            _ => {
                let found = format!("{}; --body names the body", listed(&names()));
                Err(self.error("one skinned mesh", found))
            }
        }
    }
}
