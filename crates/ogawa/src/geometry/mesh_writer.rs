//! A mesh that is being written.

use super::{
    GEOMETRY, POLY_MESH, TRANSFORM, XFORM,
    attribute::{Attribute, Scope},
    faces::{Faces, reverse_corners},
};
use crate::{
    archive::{Element, Metadata, ObjectTree, PropertyTree, SampleLayout, SampleWriter},
    container::ContainerWriter,
    error::{Error, Result},
};
use std::io::{Seek, Write};

/// Index of the sampling of frames. Sampling 0 is that of properties without a time.
const FRAMES: u32 = 1;

/// Mesh whose frames will be pushed.
#[derive(Clone, Copy, Debug)]
pub struct MeshDescription<'a> {
    /// Name, which programs show: not empty, without a slash, different from other meshes.
    pub name: &'a str,
    /// Number of vertices.
    pub vertices: usize,
    /// Faces, the same in all frames.
    pub faces: &'a Faces,
    /// Texture coordinates by vertex or by corner, v upwards, the same in all frames.
    pub uvs: Option<&'a Attribute<2>>,
}

/// Writer of a mesh: its properties, whose samples are in the file already.
#[derive(Debug)]
pub(super) struct MeshWriter {
    name: Box<str>,
    vertices: usize,
    bounds: SampleWriter,
    positions: SampleWriter,
    corners: SampleWriter,
    counts: SampleWriter,
    /// Texture coordinates: values and perhaps indices.
    uvs: Option<UvWriter>,
    normals: Option<SampleWriter>,
}

/// Writer of texture coordinates.
#[derive(Debug)]
struct UvWriter {
    metadata: Metadata,
    values: SampleWriter,
    indices: Option<SampleWriter>,
}

impl MeshWriter {
    /// Writes faces and texture coordinates.
    ///
    /// # Errors
    /// An unusable name, faces or texture coordinates that do not fit the vertices, a failure to
    /// write.
    pub(super) fn new<W: Write + Seek>(
        file: &mut ContainerWriter<W>,
        mesh: &MeshDescription<'_>,
    ) -> Result<Self> {
        check_mesh(mesh)?;
        let signed = |numbers: &[u32]| numbers.iter().map(|&n| n.cast_signed()).collect::<Vec<_>>();
        let mut turned = signed(mesh.faces.corners());
        reverse_corners(mesh.faces.counts(), &mut turned);
        let mut corners = array::<i32>(".faceIndices", Metadata::default());
        corners.push(file, &turned)?;
        let mut counts = array::<i32>(".faceCounts", Metadata::default());
        counts.push(file, &signed(mesh.faces.counts()))?;
        let uvs = mesh.uvs.map(|uvs| UvWriter::new(file, uvs, mesh.faces));
        let bounds = Metadata::of(&[("interpretation", "box")]);
        let points = Metadata::of(&[("geoScope", "vtx"), ("interpretation", "point")]);
        Ok(Self {
            name: mesh.name.into(),
            vertices: mesh.vertices,
            bounds: SampleWriter::new::<[f64; 6]>(".selfBnds", SampleLayout::Scalar, FRAMES, bounds),
            positions: array::<[f32; 3]>("P", points),
            corners,
            counts,
            uvs: uvs.transpose()?,
            normals: None,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Writes a frame. Either all frames have normals or none has.
    pub(super) fn push<W: Write + Seek>(
        &mut self,
        file: &mut ContainerWriter<W>,
        positions: &[[f32; 3]],
        normals: Option<&[[f32; 3]]>,
    ) -> Result<()> {
        check_vectors("positions", positions, self.vertices)?;
        if let Some(normals) = normals {
            check_vectors("normals", normals, self.vertices)?;
            if self.positions.count() == 0 {
                let metadata = attribute_metadata(Scope::Vertex, 3, "normal");
                self.normals = Some(array::<[f32; 3]>("N", metadata));
            }
        }
        match (&mut self.normals, normals) {
            (None, None) => {}
            (Some(writer), Some(normals)) => writer.push(file, normals)?,
            (Some(_), None) => return Err(Error::argument("normals", "some as in frame 0", "none")),
            (None, Some(_)) => return Err(Error::argument("normals", "none as in frame 0", "some")),
        }
        self.positions.push(file, positions)?;
        self.bounds.push(file, &[bounds(positions)])
    }

    /// Transform with the mesh as its child.
    pub(super) fn object<W: Write + Seek>(mut self, file: &mut ContainerWriter<W>) -> Result<ObjectTree> {
        let frames = self.positions.count();
        self.corners.repeat_until(frames);
        self.counts.repeat_until(frames);
        let mut properties = vec![self.bounds, self.positions, self.corners, self.counts];
        properties.extend(self.normals);
        let mut properties: Vec<_> = properties.into_iter().map(PropertyTree::Samples).collect();
        properties.extend(self.uvs.map(|uvs| uvs.property(frames)));
        let schema = Metadata::of(&[
            ("schema", "AbcGeom_PolyMesh_v1"),
            ("schemaBaseType", "AbcGeom_GeomBase_v1"),
        ]);
        let shape = ObjectTree {
            name: format!("{}Shape", self.name).into(),
            metadata: object_metadata(POLY_MESH, "v1", GEOMETRY),
            properties: vec![PropertyTree::compound(GEOMETRY, schema, properties)],
            children: Vec::new(),
        };
        let mut inherits =
            SampleWriter::new::<bool>(".inherits", SampleLayout::Scalar, 0, Metadata::default());
        inherits.push(file, &[true])?;
        let schema = Metadata::of(&[("schema", "AbcGeom_Xform_v3")]);
        let transform = vec![PropertyTree::Samples(inherits)];
        Ok(ObjectTree {
            name: self.name,
            metadata: object_metadata(XFORM, "v3", TRANSFORM),
            properties: vec![PropertyTree::compound(TRANSFORM, schema, transform)],
            children: vec![shape],
        })
    }
}

impl UvWriter {
    fn new<W: Write + Seek>(
        file: &mut ContainerWriter<W>,
        uvs: &Attribute<2>,
        faces: &Faces,
    ) -> Result<Self> {
        let metadata = attribute_metadata(uvs.scope, 2, "vector");
        let mut turned = uvs.clone();
        match &mut turned.indices {
            _ if uvs.scope != Scope::Corner => {}
            Some(indices) => reverse_corners(faces.counts(), indices),
            None => reverse_corners(faces.counts(), &mut turned.values),
        }
        let name = if turned.indices.is_some() { ".vals" } else { "uv" };
        // Readers look for the metadata at the compound and at its values.
        let mut values = array::<[f32; 2]>(name, metadata.clone());
        values.push(file, &turned.values)?;
        let mut indices = None;
        if let Some(numbers) = turned.indices {
            let mut writer = array::<u32>(".indices", Metadata::default());
            writer.push(file, &numbers)?;
            indices = Some(writer);
        }
        Ok(Self {
            metadata,
            values,
            indices,
        })
    }
    fn property(mut self, frames: u32) -> PropertyTree {
        self.values.repeat_until(frames);
        let Some(mut indices) = self.indices else {
            return PropertyTree::Samples(self.values);
        };
        indices.repeat_until(frames);
        let properties = [self.values, indices].map(PropertyTree::Samples).into();
        PropertyTree::compound("uv", self.metadata, properties)
    }
}

fn array<T: Element>(name: &str, metadata: Metadata) -> SampleWriter {
    SampleWriter::new::<T>(name, SampleLayout::Array, FRAMES, metadata)
}

/// Metadata of an object of a schema, as the library writes them.
fn object_metadata(schema: &str, version: &str, property: &str) -> Metadata {
    let schema = format!("{schema}_{version}");
    let title = format!("{schema}:{property}");
    let mut pairs = vec![("schema", schema.as_str()), ("schemaObjTitle", &title)];
    if property == GEOMETRY {
        pairs.push(("schemaBaseType", "AbcGeom_GeomBase_v1"));
    }
    Metadata::of(&pairs)
}

/// Metadata of an attribute of `extent` floats.
fn attribute_metadata(scope: Scope, extent: u8, interpretation: &str) -> Metadata {
    Metadata::of(&[
        ("arrayExtent", "1"),
        ("geoScope", scope.encode()),
        ("interpretation", interpretation),
        ("isGeomParam", "true"),
        ("podExtent", &extent.to_string()),
        ("podName", "float32_t"),
    ])
}

/// Smallest and largest coordinates; those of no point are the other way round.
fn bounds(positions: &[[f32; 3]]) -> [f64; 6] {
    let mut bounds = [f64::MAX, f64::MAX, f64::MAX, f64::MIN, f64::MIN, f64::MIN];
    for position in positions {
        for (axis, &coordinate) in position.iter().enumerate() {
            let coordinate = f64::from(coordinate);
            bounds[axis] = bounds[axis].min(coordinate);
            bounds[axis + 3] = bounds[axis + 3].max(coordinate);
        }
    }
    bounds
}

fn check_mesh(mesh: &MeshDescription<'_>) -> Result<()> {
    if mesh.name.is_empty() || mesh.name.contains(['/', '\0']) {
        return Err(Error::argument("name", "a text without a slash", mesh.name));
    }
    // Files count vertices and corners in i32.
    let largest = mesh.vertices.max(mesh.faces.corners().len());
    if i32::try_from(largest).is_err() {
        let expected = "at most 2147483647 vertices and corners";
        return Err(Error::argument("mesh", expected, largest));
    }
    if let Some(vertex) = mesh
        .faces
        .largest_vertex()
        .filter(|&v| v as usize >= mesh.vertices)
    {
        let expected = format!("vertices below {}", mesh.vertices);
        return Err(Error::argument("faces", expected, vertex));
    }
    mesh.uvs.map_or(Ok(()), |uvs| check_uvs(uvs, mesh))
}

fn check_uvs(uvs: &Attribute<2>, mesh: &MeshDescription<'_>) -> Result<()> {
    let elements = match uvs.scope {
        Scope::Vertex => mesh.vertices,
        Scope::Corner => mesh.faces.corners().len(),
        other => return Err(Error::argument("uvs", "Vertex or Corner", format!("{other:?}"))),
    };
    if uvs.len() != elements {
        return Err(Error::argument("uvs", format!("{elements} elements"), uvs.len()));
    }
    match (0..uvs.len()).all(|element| uvs.get(element).is_some()) {
        true => Ok(()),
        false => Err(Error::argument(
            "uvs",
            format!("indices below {}", uvs.values.len()),
            "larger ones",
        )),
    }
}

fn check_vectors(argument: &'static str, vectors: &[[f32; 3]], vertices: usize) -> Result<()> {
    if vectors.len() != vertices {
        return Err(Error::argument(argument, vertices.to_string(), vectors.len()));
    }
    let is_finite = |vector: &[f32; 3]| vector.iter().all(|v| v.is_finite());
    match vectors.iter().position(|vector| !is_finite(vector)) {
        None => Ok(()),
        Some(vertex) => Err(Error::argument(
            argument,
            "finite numbers",
            format!("vertex {vertex} without one"),
        )),
    }
}
