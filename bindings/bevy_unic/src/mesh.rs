//! Meshes of garments.

use crate::garment::{GarmentState, UnicGarment};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use std::collections::HashMap;
use unic_core::mesh::TriMesh;
use unic_glam as core;

/// Vertices and triangles in which every vertex has one texture coordinate, as Bevy needs them.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// Vertex of the model for each vertex: copies at texture seams follow those of the model.
    sources: Vec<u32>,
    uvs: Option<Vec<[f32; 2]>>,
    indices: Vec<u32>,
    rest: Vec<core::Vec3>,
}

impl Surface {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let mut sources: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let rest = mesh.vertices.clone();
        let Some(uvs) = &mesh.uvs else {
            return Self {
                sources,
                uvs: None,
                indices: mesh.faces.as_flattened().to_vec(),
                rest,
            };
        };
        let mut vertices: HashMap<(u32, u32), u32> = HashMap::new();
        let mut coordinates: Vec<Option<[f32; 2]>> = vec![None; sources.len()];
        let corners = mesh.faces.as_flattened().iter().zip(uvs.faces.as_flattened());
        let indices = corners.map(|(&vertex, &uv)| {
            *vertices.entry((vertex, uv)).or_insert_with(|| {
                // The texture of Bevy begins at the top.
                let [u, v] = uvs.coordinates[uv as usize].to_array();
                let coordinate = Some([u, 1.0 - v]);
                match coordinates[vertex as usize] {
                    None => {
                        coordinates[vertex as usize] = coordinate;
                        vertex
                    }
                    Some(_) => {
                        sources.push(vertex);
                        coordinates.push(coordinate);
                        sources.len() as u32 - 1
                    }
                }
            })
        });
        let indices = indices.collect();
        Self {
            sources,
            uvs: Some(coordinates.into_iter().map(Option::unwrap_or_default).collect()),
            indices,
            rest,
        }
    }

    /// Makes the mesh, at the places of the rest shape until the first step.
    pub(crate) fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        let positions: Vec<[f32; 3]> = self.spread(&self.rest).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; positions.len()]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        if let Some(uvs) = &self.uvs {
            mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, uvs.clone());
        }
        mesh.insert_indices(Indices::U32(self.indices.clone()));
        mesh
    }

    /// Values of all vertices, copies at seams included.
    fn spread<'a>(&'a self, values: &'a [core::Vec3]) -> impl Iterator<Item = [f32; 3]> + 'a {
        self.sources.iter().map(|&v| values[v as usize].to_array())
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
