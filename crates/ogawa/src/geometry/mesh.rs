//! Reading meshes.

use super::{
    attribute::{Attribute, Scope},
    faces::{Faces, reverse_corners},
};
use crate::{
    archive::{Archive, Element, ObjectId, Samples},
    error::{Error, Result},
};
use std::io::{Read, Seek};

/// Kind of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshKind {
    /// Polygons.
    Polygons,
    /// Control cage of a subdivision surface.
    Subdivision,
}

/// Animated mesh of an archive. Samples are read one frame at a time.
///
/// Frames are the samples of the positions. If those are all equal, frames are the samples of the
/// transform above that has most of them. Everything else is taken at the time of the frame.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub(super) object: ObjectId,
    pub(super) name: Box<str>,
    pub(super) kind: MeshKind,
    /// Samples whose times are those of the frames.
    pub(super) timeline: Samples,
    pub(super) positions: Samples,
    pub(super) counts: Samples,
    pub(super) corners: Samples,
    pub(super) uvs: Option<Values>,
    pub(super) normals: Option<Values>,
    pub(super) velocities: Option<Samples>,
}

/// Samples of an attribute, with samples of indices if there are any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub(super) scope: Scope,
    pub(super) values: Samples,
    pub(super) indices: Option<Samples>,
}

impl Mesh {
    /// Object of the mesh, for [`Archive::full_name`] and [`Archive::world_from_object`].
    pub fn object(&self) -> ObjectId {
        self.object
    }

    /// Name of the object.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Kind of the surface.
    pub fn kind(&self) -> MeshKind {
        self.kind
    }

    /// Number of frames; none for a mesh without positions. A broken file may claim up to 2³² - 1
    /// equal ones.
    pub fn frames(&self) -> u32 {
        match self.positions.count() {
            0 => 0,
            _ => self.timeline.count(),
        }
    }

    /// Whether all frames have the same faces.
    pub fn has_constant_faces(&self) -> bool {
        self.counts.is_constant() && self.corners.is_constant()
    }

    /// Whether all frames have the same positions in the space of the object.
    pub fn has_constant_positions(&self) -> bool {
        self.positions.is_constant()
    }

    /// Time of a frame, seconds.
    pub fn time<R: Read + Seek>(&self, archive: &Archive<R>, frame: u32) -> f64 {
        archive.time(&self.timeline, frame)
    }

    /// Reads the positions of a frame in the space of the object.
    ///
    /// # Errors
    /// No such frame, damaged data, or a failure to read.
    pub fn positions<R: Read + Seek>(
        &self,
        archive: &mut Archive<R>,
        frame: u32,
        into: &mut Vec<[f32; 3]>,
    ) -> Result<()> {
        self.check_frame(frame)?;
        let index = self.index(archive, &self.positions, frame);
        archive.read(&self.positions, index, into)
    }

    /// Reads the positions of a frame in world space, moved by the transforms of all ancestors.
    ///
    /// # Errors
    /// No such frame, damaged data, or a failure to read.
    pub fn world_positions<R: Read + Seek>(
        &self,
        archive: &mut Archive<R>,
        frame: u32,
        into: &mut Vec<[f32; 3]>,
    ) -> Result<()> {
        self.positions(archive, frame, into)?;
        let time = self.time(archive, frame);
        let world = archive.world_from_object(self.object, time)?;
        into.iter_mut().for_each(|point| *point = world.point(*point));
        Ok(())
    }

    /// Reads the velocities of the vertices, in units per second in the space of the object; none if
    /// the mesh has none.
    ///
    /// # Errors
    /// No such frame, damaged data, or a failure to read.
    pub fn velocities<R: Read + Seek>(
        &self,
        archive: &mut Archive<R>,
        frame: u32,
    ) -> Result<Option<Vec<[f32; 3]>>> {
        self.check_frame(frame)?;
        let Some(samples) = self.velocities.filter(|samples| samples.count() > 0) else {
            return Ok(None);
        };
        self.at_frame(archive, &samples, frame).map(Some)
    }

    /// Reads the faces of a frame.
    ///
    /// Their vertices are compared with the number of positions of the frame.
    ///
    /// # Errors
    /// No such frame, faces that do not fit together, damaged data, or a failure to read.
    pub fn faces<R: Read + Seek>(&self, archive: &mut Archive<R>, frame: u32) -> Result<Faces> {
        self.check_frame(frame)?;
        let counts = self.corner_counts(archive, frame)?;
        let mut corners: Vec<u32> = self.non_negative(archive, &self.corners, frame)?;
        let total = counts.iter().map(|&count| u64::from(count)).sum::<u64>();
        if total != corners.len() as u64 {
            let expected = format!("{total} corners of faces");
            return Err(self.fault(archive, expected, corners.len()));
        }
        let index = self.index(archive, &self.positions, frame);
        let vertices = archive.element_count(&self.positions, index)?;
        if let Some(&vertex) = corners.iter().find(|&&vertex| u64::from(vertex) >= vertices) {
            let expected = format!("faces of {vertices} vertices");
            return Err(self.fault(archive, expected, format!("vertex {vertex}")));
        }
        reverse_corners(&counts, &mut corners);
        Faces::new(counts, corners)
    }

    /// Reads the texture coordinates of a frame, v upwards; none if the mesh has none.
    ///
    /// # Errors
    /// No such frame, indices without a value, damaged data, or a failure to read.
    pub fn uvs<R: Read + Seek>(&self, archive: &mut Archive<R>, frame: u32) -> Result<Option<Attribute<2>>> {
        self.attribute(archive, self.uvs, frame)
    }

    /// Reads the normals of a frame in the space of the object; none if the mesh has none.
    ///
    /// # Errors
    /// No such frame, indices without a value, damaged data, or a failure to read.
    pub fn normals<R: Read + Seek>(
        &self,
        archive: &mut Archive<R>,
        frame: u32,
    ) -> Result<Option<Attribute<3>>> {
        self.attribute(archive, self.normals, frame)
    }

    fn attribute<R: Read + Seek, const N: usize>(
        &self,
        archive: &mut Archive<R>,
        source: Option<Values>,
        frame: u32,
    ) -> Result<Option<Attribute<N>>> {
        self.check_frame(frame)?;
        let Some(source) = source.filter(|source| source.values.count() > 0) else {
            return Ok(None);
        };
        let mut values: Vec<[f32; N]> = self.at_frame(archive, &source.values, frame)?;
        let mut indices: Option<Vec<u32>> = match source.indices.filter(|indices| indices.count() > 0) {
            Some(samples) => Some(self.at_frame(archive, &samples, frame)?),
            None => None,
        };
        let count = values.len();
        let beyond = |indices: &Vec<u32>| indices.iter().copied().find(|&i| i as usize >= count);
        if let Some(index) = indices.as_ref().and_then(beyond) {
            let expected = format!("indices below {count}");
            return Err(self.fault(archive, expected, index));
        }
        if source.scope == Scope::Corner {
            let counts = self.corner_counts(archive, frame)?;
            match &mut indices {
                Some(indices) => reverse_corners(&counts, indices),
                None => reverse_corners(&counts, &mut values),
            }
        }
        Ok(Some(Attribute {
            scope: source.scope,
            values,
            indices,
        }))
    }

    fn corner_counts<R: Read + Seek>(&self, archive: &mut Archive<R>, frame: u32) -> Result<Vec<u32>> {
        self.non_negative(archive, &self.counts, frame)
    }

    /// Reads i32 numbers of a frame that must not be negative.
    fn non_negative<R: Read + Seek>(
        &self,
        archive: &mut Archive<R>,
        samples: &Samples,
        frame: u32,
    ) -> Result<Vec<u32>> {
        let signed: Vec<i32> = self.at_frame(archive, samples, frame)?;
        match signed.iter().find(|&&n| n < 0) {
            Some(negative) => Err(self.fault(archive, "counts and vertices from 0 on", negative)),
            None => Ok(signed.into_iter().map(i32::cast_unsigned).collect()),
        }
    }

    /// Reads the sample of a frame.
    fn at_frame<R: Read + Seek, T: Element>(
        &self,
        archive: &mut Archive<R>,
        samples: &Samples,
        frame: u32,
    ) -> Result<Vec<T>> {
        let mut elements = Vec::new();
        archive.read(samples, self.index(archive, samples, frame), &mut elements)?;
        Ok(elements)
    }

    /// Index of the sample at the time of a frame.
    fn index<R: Read + Seek>(&self, archive: &Archive<R>, samples: &Samples, frame: u32) -> u32 {
        match samples.sampling() == self.timeline.sampling() {
            // Samples at the same times are counted in the same way, so that no time is rounded.
            true => frame.min(samples.count().saturating_sub(1)),
            false => archive.nearest(samples, self.time(archive, frame)),
        }
    }

    fn check_frame(&self, frame: u32) -> Result<()> {
        match frame < self.frames() {
            true => Ok(()),
            false => Err(Error::argument(
                "frame",
                format!("one of {} frames", self.frames()),
                frame,
            )),
        }
    }

    fn fault<R: Read + Seek>(
        &self,
        archive: &Archive<R>,
        expected: impl Into<std::borrow::Cow<'static, str>>,
        found: impl ToString,
    ) -> Error {
        Error::content(&archive.full_name(self.object), expected, found.to_string())
    }
}

impl<R: Read + Seek> Archive<R> {
    /// Number of elements of a sample, by the size of its data.
    fn element_count(&mut self, samples: &Samples, index: u32) -> Result<u64> {
        let bytes = self.value_bytes(samples, index)?;
        Ok(bytes / samples.data_type().size().unwrap_or(1) as u64)
    }
}
