//! Unit and up axis of meshes that do not state them.

use crate::args::MeshUpName;
use glam::Vec3;
use unic_core::mesh::TriMesh;

/// Conversion of a file's positions to metres, Y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshUnits {
    up: MeshUpName,
    /// Metres in a unit of the file.
    scale: f32,
}

impl MeshUnits {
    /// Units of a file that is in metres, Y up.
    pub(crate) const METRES: Self = Self {
        up: MeshUpName::Y,
        scale: 1.0,
    };

    /// Units as options state them: metres, Y up where they are silent.
    pub(crate) fn stated(up: Option<MeshUpName>, scale: Option<f32>) -> Self {
        Self {
            up: up.unwrap_or(Self::METRES.up),
            scale: scale.unwrap_or(Self::METRES.scale),
        }
    }

    /// Converts a position.
    pub(crate) fn apply(self, v: Vec3) -> Vec3 {
        let turned = match self.up {
            MeshUpName::Y => v,
            MeshUpName::Z => Vec3::new(v.x, v.z, -v.y),
        };
        turned * self.scale
    }

    /// Converts the vertices of a mesh.
    pub(crate) fn mesh(self, mut mesh: TriMesh) -> TriMesh {
        mesh.vertices.iter_mut().for_each(|v| *v = self.apply(*v));
        mesh
    }

    /// Descriptions of what is converted.
    pub(crate) fn notes(self) -> Vec<String> {
        let turned = (self.up == MeshUpName::Z).then(|| "Z up converted to Y up".to_owned());
        let scaled = (self.scale != 1.0).then(|| format!("scaled by {}", self.scale));
        turned.into_iter().chain(scaled).collect()
    }
}
