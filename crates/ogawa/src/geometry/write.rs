//! Writing meshes, one frame at a time.

use super::{
    GEOMETRY, POLY_MESH, XFORM,
    attribute::{Attribute, Scope},
    faces::{Faces, reverse_corners},
};
use crate::{
    archive::{Metadata, ObjectTree, PropertyTree, SampleLayout, SampleWriter, TimeSampling, write_archive},
    container::ContainerWriter,
    error::{Error, Result},
    file::NewFile,
};
use std::{
    io::{Seek, Write},
    path::Path,
};

/// Index of the sampling of frames. Sampling 0 is that of properties without a time.
const FRAMES: u32 = 1;

/// Times of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTiming {
    /// Frames per second, greater than 0.
    pub fps: f64,
    /// Time of frame 0, seconds.
    pub start: f64,
}

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

/// Index of a mesh in its [`ArchiveWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshId(usize);

/// Writer of an archive of animated meshes. Frames of the meshes may be pushed in any order.
///
/// Memory holds one frame, and 24 bytes for each frame of each mesh. Each mesh is written as
/// `/NAME/NAMEShape`, below a transform that moves nothing.
#[derive(Debug)]
pub struct ArchiveWriter<W> {
    file: ContainerWriter<W>,
    timing: FrameTiming,
    meshes: Vec<MeshInProgress>,
}

/// Properties of a mesh that is being written.
#[derive(Debug)]
struct MeshInProgress {
    name: Box<str>,
    vertices: usize,
    bounds: SampleWriter,
    positions: SampleWriter,
    corners: SampleWriter,
    counts: SampleWriter,
    /// Texture coordinates: values and perhaps indices.
    uvs: Option<AttributeInProgress>,
    normals: Option<SampleWriter>,
}

#[derive(Debug)]
struct AttributeInProgress {
    metadata: Metadata,
    values: SampleWriter,
    indices: Option<SampleWriter>,
}

impl ArchiveWriter<NewFile> {
    /// Starts a file, which appears under its name with [`ArchiveWriter::save`].
    ///
    /// # Errors
    /// The folder cannot be written to, and the errors of [`ArchiveWriter::new`].
    pub fn create(path: impl AsRef<Path>, timing: FrameTiming) -> Result<Self> {
        check_timing(timing)?;
        Self::new(NewFile::create(path.as_ref())?, timing)
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(self) -> Result<()> {
        self.finish()?.save()
    }
}

impl<W: Write + Seek> ArchiveWriter<W> {
    /// Starts an archive in an empty file.
    ///
    /// # Errors
    /// A frame rate that is not positive, times that are not finite, or a failure to write.
    pub fn new(sink: W, timing: FrameTiming) -> Result<Self> {
        check_timing(timing)?;
        Ok(Self {
            file: ContainerWriter::new(sink)?,
            timing,
            meshes: Vec::new(),
        })
    }

    /// Adds a mesh.
    ///
    /// # Errors
    /// An unusable or known name; faces of vertices that the mesh does not have; another number of
    /// texture coordinates than vertices or corners; a failure to write.
    pub fn add_mesh(&mut self, mesh: &MeshDescription<'_>) -> Result<MeshId> {
        check_mesh(mesh)?;
        if self.meshes.iter().any(|known| *known.name == *mesh.name) {
            return Err(Error::argument("name", "one for each mesh", mesh.name));
        }
        let signed = |numbers: &[u32]| numbers.iter().map(|&n| n as i32).collect::<Vec<_>>();
        let mut turned = signed(mesh.faces.corners());
        reverse_corners(mesh.faces.counts(), &mut turned);
        let mut corners = array::<i32>(".faceIndices", Metadata::default());
        corners.push(&mut self.file, &turned)?;
        let mut counts = array::<i32>(".faceCounts", Metadata::default());
        counts.push(&mut self.file, &signed(mesh.faces.counts()))?;
        let uvs = mesh.uvs.map(|uvs| self.add_uvs(uvs, mesh.faces)).transpose()?;
        let bounds = Metadata::of(&[("interpretation", "box")]);
        let points = Metadata::of(&[("geoScope", "vtx"), ("interpretation", "point")]);
        self.meshes.push(MeshInProgress {
            name: mesh.name.into(),
            vertices: mesh.vertices,
            bounds: SampleWriter::new::<[f64; 6]>(".selfBnds", SampleLayout::Scalar, FRAMES, bounds),
            positions: array::<[f32; 3]>("P", points),
            corners,
            counts,
            uvs,
            normals: None,
        });
        Ok(MeshId(self.meshes.len() - 1))
    }

    /// Adds a frame to a mesh: one position for each vertex.
    ///
    /// # Errors
    /// Another number of positions than vertices, positions that are not finite, missing normals of
    /// a mesh whose frames have some, or a failure to write.
    pub fn push(&mut self, mesh: MeshId, positions: &[[f32; 3]]) -> Result<()> {
        self.push_frame(mesh, positions, None)
    }

    /// Adds a frame to a mesh: one position and one normal for each vertex.
    ///
    /// # Errors
    /// Another number of positions or normals than vertices, numbers that are not finite, normals of
    /// a mesh whose first frame has none, or a failure to write.
    pub fn push_with_normals(
        &mut self,
        mesh: MeshId,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
    ) -> Result<()> {
        self.push_frame(mesh, positions, Some(normals))
    }

    fn push_frame(&mut self, id: MeshId, positions: &[[f32; 3]], normals: Option<&[[f32; 3]]>) -> Result<()> {
        let Some(mesh) = self.meshes.get_mut(id.0) else {
            return Err(Error::argument(
                "mesh",
                format!("one of {} meshes", self.meshes.len()),
                id.0,
            ));
        };
        check_vectors("positions", positions, mesh.vertices)?;
        if let Some(normals) = normals {
            check_vectors("normals", normals, mesh.vertices)?;
            if mesh.positions.count() == 0 {
                mesh.normals = Some(array::<[f32; 3]>(
                    "N",
                    attribute_metadata(Scope::Vertex, 3, "normal"),
                ));
            }
        }
        match (&mut mesh.normals, normals) {
            (None, None) => {}
            (Some(writer), Some(normals)) => writer.push(&mut self.file, normals)?,
            (Some(_), None) => return Err(Error::argument("normals", "some as in frame 0", "none")),
            (None, Some(_)) => return Err(Error::argument("normals", "none as in frame 0", "some")),
        }
        mesh.positions.push(&mut self.file, positions)?;
        mesh.bounds.push(&mut self.file, &[bounds(positions)])
    }

    /// Writes all tables and returns the file, which holds a complete archive.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<W> {
        let samplings = [
            TimeSampling::default(),
            TimeSampling::Uniform {
                start: self.timing.start,
                step: 1.0 / self.timing.fps,
            },
        ];
        let mut file = self.file;
        let meshes = self.meshes.into_iter().map(|mesh| mesh.object(&mut file));
        let fps = format!("{:.6}", self.timing.fps);
        let metadata = [("FramesPerTimeUnit", fps.as_str()), ("_ai_Application", "unic")];
        let top = ObjectTree {
            metadata: Metadata::of(&metadata),
            children: meshes.collect::<Result<_>>()?,
            ..ObjectTree::default()
        };
        write_archive(file, top, &samplings)
    }

    fn add_uvs(&mut self, uvs: &Attribute<2>, faces: &Faces) -> Result<AttributeInProgress> {
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
        values.push(&mut self.file, &turned.values)?;
        let mut indices = None;
        if let Some(numbers) = turned.indices {
            let mut writer = array::<u32>(".indices", Metadata::default());
            writer.push(&mut self.file, &numbers)?;
            indices = Some(writer);
        }
        Ok(AttributeInProgress {
            metadata,
            values,
            indices,
        })
    }
}

impl MeshInProgress {
    /// Transform with the mesh as its child.
    fn object<W: Write + Seek>(mut self, file: &mut ContainerWriter<W>) -> Result<ObjectTree> {
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
            metadata: object_metadata(XFORM, "v3", ".xform"),
            properties: vec![PropertyTree::compound(".xform", schema, transform)],
            children: vec![shape],
        })
    }
}

impl AttributeInProgress {
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

fn array<T: crate::archive::Element>(name: &str, metadata: Metadata) -> SampleWriter {
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

fn check_timing(timing: FrameTiming) -> Result<()> {
    let FrameTiming { fps, start } = timing;
    let step = 1.0 / fps;
    if !(fps > 0.0 && fps.is_finite() && step.is_finite()) {
        return Err(Error::argument("fps", "a positive number", fps));
    }
    match start.is_finite() {
        true => Ok(()),
        false => Err(Error::argument("start", "a finite time", start)),
    }
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
