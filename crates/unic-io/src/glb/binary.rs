//! Writing the binary chunk, with the views and accessors that describe it.

use super::json::{Accessor, BufferView, Index};
use crate::{
    atomic::parent_folder,
    error::{Error, Result},
};
use bytemuck::Pod;
use glam::{Mat4, Quat, Vec2, Vec3};
use std::{
    fs::File,
    io::{BufWriter, Seek, Write},
    path::{Path, PathBuf},
};

/// Element type of an accessor. Its size is a multiple of four bytes, so that all offsets are
/// aligned as the specification demands.
pub(super) trait AccessorElement: Pod {
    /// Value of glTF's `componentType`.
    const COMPONENT: u32;
    /// Value of glTF's `type`.
    const SHAPE: &'static str;
}

macro_rules! elements {
    ($($element:ty: $component:expr, $shape:expr;)*) => {
        $(impl AccessorElement for $element {
            const COMPONENT: u32 = $component;
            const SHAPE: &'static str = $shape;
        })*
    };
}

const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

elements! {
    [u8; 4]: UNSIGNED_BYTE, "VEC4";
    [u16; 4]: UNSIGNED_SHORT, "VEC4";
    u32: UNSIGNED_INT, "SCALAR";
    f32: FLOAT, "SCALAR";
    Vec2: FLOAT, "VEC2";
    Vec3: FLOAT, "VEC3";
    [f32; 4]: FLOAT, "VEC4";
    Quat: FLOAT, "VEC4";
    Mat4: FLOAT, "MAT4";
}

/// Purpose of a buffer view.
#[derive(Clone, Copy)]
pub(super) enum BufferUsage {
    /// Vertex attributes, `ARRAY_BUFFER`. All elements of the view have one size.
    Vertices,
    /// Corners of triangles, `ELEMENT_ARRAY_BUFFER`.
    Indices,
    /// Key frames and inverse bind matrices, which have no target.
    Data,
}

impl BufferUsage {
    fn target(self) -> Option<u32> {
        match self {
            Self::Vertices => Some(34962),
            Self::Indices => Some(34963),
            Self::Data => None,
        }
    }
}

/// Writer of the binary chunk.
///
/// Elements are collected in an unnamed temporary file of the target's folder. In a GLB the JSON
/// document precedes them, and it is known only when all of them are written.
#[derive(Debug)]
pub(super) struct BinaryWriter {
    path: PathBuf,
    file: BufWriter<File>,
    length: u64,
    views: Vec<BufferView>,
    accessors: Vec<Accessor>,
}

/// A complete binary chunk with its description; its bytes begin at the start of `file`.
pub(super) struct BinaryChunk {
    pub(super) file: File,
    pub(super) length: u64,
    pub(super) views: Vec<BufferView>,
    pub(super) accessors: Vec<Accessor>,
}

impl BinaryWriter {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let folder = parent_folder(path);
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create folder"))?;
        // In the target's folder and not in the system's: the chunk may be larger than `/tmp`.
        let file = tempfile::tempfile_in(folder).map_err(Error::io(path, "create"))?;
        Ok(Self {
            path: path.to_path_buf(),
            file: BufWriter::with_capacity(1 << 16, file),
            length: 0,
            views: Vec::new(),
            accessors: Vec::new(),
        })
    }

    /// Writes elements into a view of their own and returns their accessor.
    pub(super) fn write<E: AccessorElement>(&mut self, usage: BufferUsage, elements: &[E]) -> Result<Index> {
        let view = self.open_view(usage, size_of::<E>());
        self.append(view, elements)
    }

    /// Starts a view for elements of `size` bytes. [`BinaryWriter::append`] fills it until the next
    /// view is started.
    pub(super) fn open_view(&mut self, usage: BufferUsage, size: usize) -> Index {
        self.views.push(BufferView {
            buffer: 0,
            byte_offset: self.length,
            byte_length: 0,
            // The specification demands a stride if accessors share a view of vertices, and forbids
            // it for other views.
            byte_stride: matches!(usage, BufferUsage::Vertices).then_some(size),
            target: usage.target(),
        });
        self.views.len() - 1
    }

    /// Adds elements to the view that was started last, and returns their accessor.
    pub(super) fn append<E: AccessorElement>(&mut self, view: Index, elements: &[E]) -> Result<Index> {
        debug_assert_eq!(view + 1, self.views.len(), "a view is contiguous");
        let bytes: &[u8] = bytemuck::cast_slice(elements);
        self.file
            .write_all(bytes)
            .map_err(Error::io(&self.path, "write"))?;
        // Offsets of accessors count from the start of their view.
        let byte_offset = self.length - self.views[view].byte_offset;
        self.length += bytes.len() as u64;
        self.views[view].byte_length += bytes.len() as u64;
        self.accessors.push(Accessor {
            buffer_view: view,
            byte_offset,
            component_type: E::COMPONENT,
            count: elements.len(),
            shape: E::SHAPE,
            min: Vec::new(),
            max: Vec::new(),
        });
        Ok(self.accessors.len() - 1)
    }

    /// Adds positions with their bounds, which the specification demands, and returns their
    /// accessor.
    pub(super) fn append_positions(&mut self, view: Index, positions: &[Vec3]) -> Result<Index> {
        let accessor = self.append(view, positions)?;
        // Folding from the first position and not from infinity keeps empty bounds finite.
        let first = positions.first().copied().unwrap_or_default();
        let fold = |f: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().fold(first, f);
        let to_f64 = |v: Vec3| v.as_dvec3().to_array().to_vec();
        self.accessors[accessor].min = to_f64(fold(Vec3::min));
        self.accessors[accessor].max = to_f64(fold(Vec3::max));
        Ok(accessor)
    }

    /// Writes the ascending times of key frames, seconds, with their bounds, and returns their
    /// accessor.
    pub(super) fn write_times(&mut self, times: &[f32]) -> Result<Index> {
        let accessor = self.write(BufferUsage::Data, times)?;
        let bound = |time: Option<&f32>| time.map(|&t| f64::from(t)).into_iter().collect();
        self.accessors[accessor].min = bound(times.first());
        self.accessors[accessor].max = bound(times.last());
        Ok(accessor)
    }

    /// Completes the chunk.
    pub(super) fn finish(self) -> Result<BinaryChunk> {
        let failed = |e| Error::io(&self.path, "write")(e);
        let mut file = self.file.into_inner().map_err(|e| failed(e.into_error()))?;
        file.rewind().map_err(failed)?;
        Ok(BinaryChunk {
            file,
            length: self.length,
            views: self.views,
            accessors: self.accessors,
        })
    }
}
