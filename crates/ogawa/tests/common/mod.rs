//! Archives of transforms, written by the layer of objects and properties.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]
#![allow(dead_code, reason = "each test uses some of these")]

use ogawa::{
    archive::{
        DataType, Element, Metadata, ObjectTree, Pod, PropertyTree, SampleLayout, SampleWriter, TimeSampling,
        write_archive,
    },
    container::ContainerWriter,
};
use std::io::Cursor;

pub(crate) type File = ContainerWriter<Cursor<Vec<u8>>>;

/// Sampling of frames: one a second.
pub(crate) const FRAMES: u32 = 0;
/// Sampling of transforms: one every half second, which frames do not share.
pub(crate) const HALVES: u32 = 1;

pub(crate) fn property<T: Element>(
    file: &mut File,
    name: &str,
    layout: SampleLayout,
    (data_type, sampling): (DataType, u32),
    samples: &[&[T]],
) -> PropertyTree {
    let mut writer = SampleWriter::of_type(name, layout, data_type, sampling, Metadata::default());
    for sample in samples {
        writer.push(file, sample).unwrap();
    }
    PropertyTree::Samples(writer)
}

/// A transform with one operation of three or sixteen values.
pub(crate) fn transform(
    file: &mut File,
    name: &str,
    inherits: bool,
    op: u8,
    values: &[&[f64]],
) -> ObjectTree {
    let extent = values[0].len() as u8;
    let scalar = SampleLayout::Scalar;
    let inherits = property(
        file,
        ".inherits",
        scalar,
        (DataType::new(Pod::Bool, 1), FRAMES),
        &[&[inherits]],
    );
    let ops = property(
        file,
        ".ops",
        scalar,
        (DataType::new(Pod::U8, 1), FRAMES),
        &[&[op]],
    );
    let values = property(
        file,
        ".vals",
        scalar,
        (DataType::new(Pod::F64, extent), HALVES),
        values,
    );
    ObjectTree {
        name: name.into(),
        metadata: Metadata::new("schema=AbcGeom_Xform_v3"),
        properties: vec![PropertyTree::compound(
            ".xform",
            Metadata::default(),
            vec![inherits, ops, values],
        )],
        children: Vec::new(),
    }
}

/// A subdivision cage of one point at (1, 2, 3), in three frames.
pub(crate) fn point(file: &mut File) -> ObjectTree {
    let frame: &[[f32; 3]] = &[[1.0, 2.0, 3.0]];
    let moved: &[[f32; 3]] = &[[1.0, 2.0, 4.0]];
    let array = SampleLayout::Array;
    let positions = property(
        file,
        "P",
        array,
        (DataType::new(Pod::F32, 3), FRAMES),
        &[frame, frame, moved],
    );
    cage(file, positions)
}

pub(crate) fn cage(file: &mut File, positions: PropertyTree) -> ObjectTree {
    let array = SampleLayout::Array;
    let int = (DataType::new(Pod::I32, 1), FRAMES);
    let corners = property(file, ".faceIndices", array, int, &[&[0_i32, 0, 0]]);
    let counts = property(file, ".faceCounts", array, int, &[&[3_i32]]);
    let properties = vec![positions, corners, counts];
    ObjectTree {
        name: "point".into(),
        metadata: Metadata::new("schema=AbcGeom_SubD_v1"),
        properties: vec![PropertyTree::compound(".geom", Metadata::default(), properties)],
        children: Vec::new(),
    }
}

pub(crate) fn file() -> File {
    ContainerWriter::new(Cursor::new(Vec::new())).unwrap()
}

/// Bytes of an archive of one object below transforms, from the top on.
pub(crate) fn nested(
    file: File,
    mut child: ObjectTree,
    transforms: Vec<ObjectTree>,
    halves: TimeSampling,
) -> Vec<u8> {
    for mut transform in transforms.into_iter().rev() {
        transform.children.push(child);
        child = transform;
    }
    let top = ObjectTree {
        children: vec![child],
        ..ObjectTree::default()
    };
    let samplings = [TimeSampling::default(), halves];
    write_archive(file, top, &samplings).unwrap().into_inner()
}
