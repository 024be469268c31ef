//! Meshes of garments.

use crate::garment::{GarmentState, UnicGarment};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use unic_core::mesh::{SeamSplit, TriMesh};
use unic_glam as core;

/// Mesh of a garment in which every vertex has one texture coordinate, as Bevy needs it.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    split: SeamSplit,
    rest: Vec<core::Vec3>,
}

impl Surface {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        Self {
            split: SeamSplit::new(mesh),
            rest: mesh.vertices.clone(),
        }
    }

    /// Makes the mesh, at the places of the rest shape until the first step.
    pub(crate) fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        let positions: Vec<[f32; 3]> = self.spread(&self.rest).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; positions.len()]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        if let Some(uvs) = &self.split.uvs {
            // The texture of Bevy begins at the top.
            let uvs: Vec<[f32; 2]> = uvs.iter().map(|uv| [uv.x, 1.0 - uv.y]).collect();
            mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, uvs);
        }
        mesh.insert_indices(Indices::U32(self.split.faces.as_flattened().to_vec()));
        mesh
    }

    /// Values of all vertices, copies at seams included.
    fn spread<'a>(&'a self, values: &'a [core::Vec3]) -> impl Iterator<Item = [f32; 3]> + 'a {
        self.split.spread(values).map(|v| v.to_array())
    }
}

/// Writes the vertices of this frame to the meshes.
pub(crate) fn write(
    mut meshes: ResMut<Assets<Mesh>>,
    mut garments: Query<
        (&mut GarmentState, &Mesh3d, &mut Transform, &mut GlobalTransform),
        With<UnicGarment>,
    >,
) {
    for (mut state, mesh, mut transform, mut global) in &mut garments {
        if !std::mem::take(&mut state.shown.is_new) {
            continue;
        }
        let Some(mut mesh) = meshes.get_mut(&mesh.0) else {
            continue;
        };
        let GarmentState { surface, shown, .. } = &*state;
        fill(
            &mut mesh,
            Mesh::ATTRIBUTE_POSITION,
            surface.spread(&shown.positions),
        );
        fill(&mut mesh, Mesh::ATTRIBUTE_NORMAL, surface.spread(&shown.normals));
        // A character of another size: the garment is computed in that of the model. Transforms have
        // been propagated already in this frame.
        let scaled = Transform::from_scale(Vec3::splat(shown.size));
        if *transform != scaled {
            *transform = scaled;
            *global = scaled.into();
        }
    }
}

/// Replaces the values of an attribute in place.
fn fill(mesh: &mut Mesh, attribute: bevy::mesh::MeshVertexAttribute, values: impl Iterator<Item = [f32; 3]>) {
    if let Some(VertexAttributeValues::Float32x3(old)) = mesh.attribute_mut(attribute) {
        old.clear();
        old.extend(values);
    }
}
