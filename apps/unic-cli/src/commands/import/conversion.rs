//! Conversion of positions to metres, Y up.

use super::notes::Notes;
use crate::args::{ImportArgs, MeshUpName};
use glam::Vec3;
use std::path::Path;
use unic_core::mesh::TriMesh;

/// Conversion of a file's positions to metres, Y up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion {
    up: MeshUpName,
    /// Metres in a unit of the file.
    scale: f32,
}

impl Conversion {
    /// Makes the conversion that `--up` and `--scale` ask for.
    pub(super) fn of(args: &ImportArgs) -> Self {
        Self {
            up: args.up.unwrap_or(MeshUpName::Y),
            scale: args.scale.unwrap_or(1.0),
        }
    }

    /// Conversion of a file that is in metres, Y up.
    pub(super) fn none() -> Self {
        Self {
            up: MeshUpName::Y,
            scale: 1.0,
        }
    }

    /// Converts a position.
    pub(super) fn apply(self, v: Vec3) -> Vec3 {
        let turned = match self.up {
            MeshUpName::Y => v,
            MeshUpName::Z => Vec3::new(v.x, v.z, -v.y),
        };
        turned * self.scale
    }

    /// Converts the vertices of a mesh.
    pub(super) fn mesh(self, mut mesh: TriMesh) -> TriMesh {
        mesh.vertices.iter_mut().for_each(|v| *v = self.apply(*v));
        mesh
    }

    /// Notes what the conversion does to the file `path`.
    pub(super) fn describe(self, path: &Path, notes: &mut Notes) {
        if self.up == MeshUpName::Z {
            notes.add(path, "Z up converted to Y up");
        }
        if self.scale != 1.0 {
            notes.add(path, &format!("scaled by {}", self.scale));
        }
    }
}
