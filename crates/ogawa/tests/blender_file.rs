//! Contract: a file that Blender wrote is read exactly.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use ogawa::{
    Archive, Mesh, MeshKind,
    archive::{Metadata, Samples},
};
use std::{
    fs::{self, File},
    io::BufReader,
    path::{Path, PathBuf},
};

/// Largest difference of a coordinate from the same animation in a PC2 file, metres.
const TOLERANCE: f32 = 1e-6;
/// Length of the header of a PC2 file, bytes.
const PC2_HEADER: usize = 32;

fn data(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/interop");
    let path = folder.join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

fn open() -> Option<Archive<BufReader<File>>> {
    Some(Archive::open(data("tshirt_walk.abc")?).unwrap())
}

fn mesh(archive: &Archive<BufReader<File>>, name: &str) -> Mesh {
    let meshes = archive.meshes().unwrap();
    let is_wanted = |mesh: &&Mesh| archive.full_name(mesh.object()) == name;
    meshes.iter().find(is_wanted).unwrap().clone()
}

/// Vertices of each face of an OBJ file, from 0 on.
fn obj_faces(text: &str) -> Vec<Vec<u32>> {
    let faces = text.lines().filter_map(|line| line.strip_prefix("f "));
    let index = |corner: &str| corner.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
    faces
        .map(|face| face.split_whitespace().map(index).collect())
        .collect()
}

#[test]
fn every_frame_equals_that_of_the_point_cache() {
    let (Some(mut archive), Some(cache)) = (open(), data("tshirt_walk.pc2")) else {
        return;
    };
    let cache = fs::read(cache).unwrap();
    let floats = cache[PC2_HEADER..].chunks_exact(4);
    let truth: Vec<f32> = floats
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let garment = mesh(&archive, "/Garment/Garment");
    assert_eq!((garment.frames(), garment.kind()), (150, MeshKind::Polygons));
    let (mut positions, mut largest) = (Vec::new(), 0.0_f32);
    for (frame, truth) in truth.chunks_exact(3 * 3019).enumerate() {
        garment
            .world_positions(&mut archive, frame as u32, &mut positions)
            .unwrap();
        assert_eq!(positions.len(), 3019);
        let differences = positions
            .as_flattened()
            .iter()
            .zip(truth)
            .map(|(a, b)| (a - b).abs());
        largest = differences.fold(largest, f32::max);
        // Frame 1 of Blender is the first one.
        let time = garment.time(&archive, frame as u32);
        assert!((time - (frame + 1) as f64 / 30.0).abs() < 1e-6);
    }
    eprintln!("largest difference {largest} m");
    assert!(largest <= TOLERANCE, "{largest}");
}

#[test]
fn faces_are_those_of_the_meshes_that_were_exported() {
    let Some(mut archive) = open() else { return };
    for (name, obj) in [
        ("/Garment/Garment", "tshirt_rest.obj"),
        ("/Rig/Body/Body", "body_rest.obj"),
    ] {
        let Some(obj) = data(obj) else { return };
        let mesh = mesh(&archive, name);
        let faces = mesh.faces(&mut archive, 149).unwrap();
        let expected = obj_faces(&fs::read_to_string(obj).unwrap());
        assert!(faces.iter().eq(expected.iter().map(Vec::as_slice)), "{name}");
        assert!(mesh.has_constant_faces() && !mesh.has_constant_positions());
        assert!(mesh.uvs(&mut archive, 0).unwrap().is_none());
        assert!(mesh.normals(&mut archive, 0).unwrap().is_none());
        assert!(mesh.velocities(&mut archive, 0).unwrap().is_none());
    }
}

#[test]
fn keys_of_samples_are_murmur_digests_of_their_values() {
    let Some(mut archive) = open() else { return };
    let garment = mesh(&archive, "/Garment/Garment").object();
    let properties = archive
        .object(garment)
        .property(".geom")
        .unwrap()
        .properties()
        .to_vec();
    let samples = |name: &str| -> Samples {
        let property = properties.iter().find(|p| &*p.name == name).unwrap();
        *property.samples().unwrap()
    };
    let (mut points, mut counts) = (Vec::<[f32; 3]>::new(), Vec::<i32>::new());
    archive.read(&samples("P"), 7, &mut points).unwrap();
    archive.read(&samples(".faceCounts"), 7, &mut counts).unwrap();
    let bytes = |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let points: Vec<u32> = points.as_flattened().iter().map(|v| v.to_bits()).collect();
    let counts: Vec<u32> = counts.iter().map(|&v| v as u32).collect();
    for (name, values) in [("P", points), (".faceCounts", counts)] {
        let (low, high) = mur3::murmurhash3_x64_128(&bytes(&values), 0);
        let expected = [low.to_le_bytes(), high.to_le_bytes()].concat();
        let key = archive.key(&samples(name), 7).unwrap().unwrap();
        assert_eq!(key.as_slice(), expected, "{name}");
    }
}

#[test]
fn objects_have_their_names_and_metadata() {
    let Some(archive) = open() else { return };
    let names: Vec<String> = archive.objects().map(|(id, _)| archive.full_name(id)).collect();
    let expected = [
        "/",
        "/Garment",
        "/Rig",
        "/Garment/Garment",
        "/Rig/Body",
        "/Rig/Body/Body",
    ];
    assert_eq!(names, expected);
    let application = Metadata::get(archive.metadata(), "_ai_Application");
    assert_eq!((application, archive.library_version()), (Some("Blender"), 10803));
}
