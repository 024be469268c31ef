//! Contract: rigged characters, their motion and animated meshes are read from FBX and USD as other
//! programs show them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, largest_distance, posed};
use glam::{Quat, Vec3};
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_core::{character::Character, mesh::TriMesh};
use unic_io::{
    Assumed, Capture, MotionOptions, Up, import_motion, inspect,
    inspect::FileKind,
    read_character,
    rigged::{CharacterOptions, RiggedCharacter, RiggedFormat, read_rigged_character, read_scene_points},
    usd::UsdWriter,
};
use unic_testdata::rod::{ROD_USDA, fbx_binary, fbx_text, rod_fbx, rod_garment_usda};

/// Largest distance of a posed vertex of Blender's FBX file from the truth, metres. The exporter has
/// left out keys, so that angles are up to half a degree off.
const THINNED_M: f32 = 3.2e-3;
/// Largest distance from the truth elsewhere, metres.
const EXACT_M: f32 = 2e-5;

fn read_rig(path: &Path) -> RiggedCharacter {
    read_rigged_character(
        path,
        RiggedFormat::of(path).unwrap(),
        &CharacterOptions::default(),
    )
    .unwrap()
}

/// Distances of the posed vertices from those of the capture, the largest of each frame.
fn distances(path: &Path, character: &Character, capture: &Capture) -> Vec<f32> {
    let truth = capture.load_clip("walk_02_01").unwrap().clip;
    let import = import_motion(path, character, &MotionOptions::default()).unwrap();
    println!("{:?}", import.notes);
    assert_eq!(import.clip.fps, 30.0);
    assert!(import.findings.is_empty());
    let frames = import.clip.poses.iter().zip(&truth.poses);
    frames
        .map(|(pose, truth)| largest_distance(&posed(character, pose), &posed(&capture.character, truth)))
        .collect()
}

#[test]
fn the_body_of_blender_is_that_of_the_capture() {
    let Some(root) = data("captures/tshirt_blender") else {
        return;
    };
    let capture = Capture::open(&root).unwrap();
    for (file, frames, limit) in [
        ("interop/body_walk.fbx", 150, THINNED_M),
        ("interop/tshirt_walk_30frames.usdc", 30, EXACT_M),
    ] {
        let Some(path) = data(file) else { return };
        let read = read_rig(&path);
        let body = &read.character.body;
        assert!(largest_distance(&body.vertices, &capture.character.body.vertices) < 1e-5);
        assert_eq!(body.faces, capture.character.body.faces);
        assert_eq!(
            read.character.file_mesh, None,
            "corners have the texture coordinates"
        );
        assert_eq!(read.character.skeleton.len(), 24);
        // On its own rig, and on the capture's character, whose zero pose is another one.
        for character in [&read.character, &capture.character] {
            let far = distances(&path, character, &capture);
            assert_eq!(far.len(), frames);
            let most = far.iter().copied().fold(0.0, f32::max);
            println!("{file}: {:.4} mm, first frame {:.4} mm", 1e3 * most, 1e3 * far[0]);
            assert!(most < limit, "{file}: {most} m");
            // Every curve has a key in the first frame.
            assert!(far[0] < EXACT_M, "{file}: {} m", far[0]);
        }
    }
}

#[test]
fn the_garment_of_blender_is_that_of_the_capture() {
    let (Some(path), Some(root)) = (
        data("interop/tshirt_walk_30frames.usdc"),
        data("captures/tshirt_blender"),
    ) else {
        return;
    };
    let truth = Capture::open(&root)
        .unwrap()
        .load_clip("walk_02_01")
        .unwrap()
        .garment;
    let points = read_scene_points(&path, RiggedFormat::Usd, None, 3738, &Assumed::default()).unwrap();
    assert_eq!((points.frames.len(), points.fps), (30, Some(30.0)));
    assert!(points.name.ends_with("/Garment/Garment"), "{}", points.name);
    let far = (points.frames.iter().zip(truth.iter()))
        .map(|(found, truth)| largest_distance(found, truth))
        .fold(0.0, f32::max);
    println!("{:.4} mm", 1e3 * far);
    assert!(far < EXACT_M, "{far} m");
}

#[test]
fn one_of_several_skinned_meshes_is_chosen_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dressed.usda");
    // The rod with a coat of twice its width on the same bones.
    let (start, mesh) = ROD_USDA.split_once("    def Mesh").unwrap();
    let coat = mesh
        .replace("\"body\"", "\"coat\"")
        .replace("(-10, -10, 0)", "(-20, -20, 0)");
    let body = mesh.trim_end().strip_suffix('}').unwrap();
    fs::write(&path, format!("{start}    def Mesh{body}\n    def Mesh{coat}")).unwrap();
    let read = |body: Option<&str>| {
        let options = CharacterOptions {
            body,
            ..CharacterOptions::default()
        };
        read_rigged_character(&path, RiggedFormat::Usd, &options)
    };
    let [body, coat] = ["body", "coat"].map(|name| read(Some(name)).unwrap());
    assert!(body.name.ends_with("body") && coat.name.ends_with("coat"));
    assert_eq!(body.character.skeleton.names(), coat.character.skeleton.names());
    let width = |read: &RiggedCharacter| read.character.body.vertices[0].x;
    assert!((width(&coat) - 2.0 * width(&body)).abs() < 1e-6);
    let error = read(None).unwrap_err().to_string();
    assert!(
        error.ends_with("/rig/body, /rig/coat; --body names the body"),
        "{error}"
    );
    let error = read(Some("hat")).unwrap_err().to_string();
    assert!(
        error.contains("one mesh of the name hat among /rig/body, /rig/coat"),
        "{error}"
    );
    // Both are described, and neither is a problem.
    let report = unic_io::inspect(&path).unwrap();
    assert!(
        report
            .problems
            .iter()
            .all(|problem| !problem.contains("one skinned mesh")),
        "{report:?}"
    );
}

/// Writes the rod in each format.
fn rods(folder: &Path) -> Vec<PathBuf> {
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    vec![
        write("binary.fbx", &fbx_binary(&rod_fbx())),
        write("text.fbx", fbx_text(&rod_fbx()).as_bytes()),
        write("text.usda", ROD_USDA.as_bytes()),
    ]
}

#[test]
fn units_and_axes_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    for path in rods(folder.path()) {
        let read = read_rig(&path);
        let character = &read.character;
        assert_eq!(
            character.skeleton.names(),
            ["hips", "chest"],
            "{}",
            path.display()
        );
        let chest = character.skeleton.joints()[1];
        assert!(chest.distance(Vec3::new(0.0, 0.5, 0.0)) < 1e-6, "{chest}");
        let corner = character.body.vertices[6];
        assert!(corner.distance(Vec3::new(0.1, 1.0, -0.1)) < 1e-6, "{corner}");
        assert_eq!(character.body.faces.len(), 12);

        let import = import_motion(&path, character, &MotionOptions::default()).unwrap();
        assert_eq!(
            (import.clip.len(), import.clip.fps),
            (21, 20.0),
            "{}",
            path.display()
        );
        // Half-way: moved by 0.5 m along the file's Y, which is -Z, and bent about X by half a radian.
        let bent = Quat::from_rotation_x(0.5) * (Vec3::new(0.1, 1.0, -0.1) - chest);
        let expected = Vec3::new(0.0, 0.5, -0.5) + bent;
        let found = posed(character, &import.clip.poses[10])[6];
        assert!(
            found.distance(expected) < 1e-5,
            "{}: {found} {expected}",
            path.display()
        );

        let report = inspect(&path).unwrap();
        assert_eq!(
            (report.kind, report.problems.as_slice()),
            (FileKind::Character, &[][..])
        );
        assert_eq!(report.get("animations"), Some("1: bend"));
        let units = report.get("unit and up axis").unwrap();
        assert!(units.contains("centimetres, Z up"), "{units}");
    }
}

#[test]
fn animated_meshes_are_in_world_space_at_the_rate_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloth.usda");
    let stated = "metersPerUnit = 0.01\n upAxis = \"Z\"\n timeCodesPerSecond = 24";
    let z_metres = Assumed {
        metres_per_unit: Some(0.01),
        up: Some(Up::Z),
        fps: Some(24.0),
    };
    // Where the file states its units, assumptions have no effect.
    let wrong = Assumed {
        metres_per_unit: Some(5.0),
        up: Some(Up::Y),
        fps: Some(10.0),
    };
    for (metadata, assumed) in [(stated, Assumed::default()), (stated, wrong), ("", z_metres)] {
        fs::write(&path, rod_garment_usda(metadata, 3)).unwrap();
        let points = read_scene_points(&path, RiggedFormat::Usd, None, 8, &assumed).unwrap();
        assert_eq!((points.frames.len(), points.fps), (3, Some(24.0)));
        assert_eq!(
            (points.name.as_str(), points.mesh.faces.len()),
            ("/parent/cloth", 12)
        );
        // (10, 10, 100 - 20) turned by 90° about Z and moved by 100 along X.
        let found = points.frames.frame(2)[6];
        assert!(found.distance(Vec3::new(0.9, 0.8, -0.1)) < 1e-6, "{found}");
        assert!(points.notes.iter().any(|note| note.contains("Z up converted")));
    }
    let silent = read_scene_points(&path, RiggedFormat::Usd, Some("cloth"), 8, &Assumed::default()).unwrap();
    assert_eq!(silent.fps, None);
    assert!(
        silent.notes.iter().any(|note| note.contains("no unit")),
        "{:?}",
        silent.notes
    );
    for (object, words) in [
        ("hat", "one whose points stay"),
        ("coat", "/parent/cloth, /parent/hat"),
    ] {
        let read = read_scene_points(&path, RiggedFormat::Usd, Some(object), 8, &Assumed::default());
        let message = read.unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
    let report = inspect(&path).unwrap();
    assert_eq!(report.kind, FileKind::VertexAnimation);
}

#[test]
fn faults_are_named_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rod.usda");
    for (from, to, words) in [
        (
            "def Mesh \"body\"",
            "def Xform \"body\"",
            "a skinned mesh, found none",
        ),
        (
            "upAxis = \"Z\"",
            "upAxis = \"X\"",
            "Y or Z as the up axis, found X",
        ),
        (
            "metersPerUnit = 0.01",
            "metersPerUnit = 0",
            "metersPerUnit above 0, found 0",
        ),
        (
            "[4, 4, 4, 4, 4, 4]",
            "[4, 4, 4, 4, 4, 4000000]",
            "found 24 corners",
        ),
        ("[0, 3, 2, 1, 4,", "[0, 3, 2, 1, 99,", "polygons of 8 vertices"),
        ("= [0, 0, 0, 0, 1,", "= [0, 0, 0, 0, 7,", "indices of 2 joints"),
        (
            "elementSize = 1",
            "elementSize = 2",
            "2 joints and weights for each of 8 vertices",
        ),
        (
            "(-10, -10, 0),",
            "(nan, -10, 0),",
            "finite positions in the mesh /rig/body",
        ),
        ("[\"hips\", ", "[\"hips, ", "a USD file"),
    ] {
        let damaged = ROD_USDA.replacen(from, to, 1);
        assert_ne!(damaged, ROD_USDA, "{from}");
        fs::write(&path, damaged).unwrap();
        let message = read_character(&path).expect_err(from).to_string();
        assert!(
            message.contains(words) && !message.contains('\n'),
            "{from}: {message}"
        );
        assert!(message.starts_with(&path.display().to_string()), "{message}");
    }
    let path = folder.path().join("rod.fbx");
    let valid = fbx_text(&rod_fbx());
    for (from, to, words) in [
        ("Model: 14", "Material: 14", "a skinned mesh"),
        ("\"Skin\"", "\"Other\"", "a skinned mesh, found none"),
        ("0,3,2,-2", "0,3,99,-2", "an FBX file"),
    ] {
        let damaged = valid.replacen(from, to, 1);
        assert_ne!(damaged, valid, "{from}");
        fs::write(&path, damaged).unwrap();
        let message = read_character(&path).expect_err(from).to_string();
        assert!(
            message.contains(words) && !message.contains('\n'),
            "{from}: {message}"
        );
    }
}

/// A USD file must not make the program read files elsewhere.
#[test]
fn references_stay_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    fs::write(folder.path().join("rod.usda"), ROD_USDA).unwrap();
    let path = inside.join("shot.usda");
    let shot = |target: &str| {
        let stated = "metersPerUnit = 0.01\n upAxis = \"Z\"\n timeCodesPerSecond = 20";
        format!(
            "#usda 1.0\n(\n {stated}\n)\ndef Xform \"shot\" (\n prepend references = @{target}@\n)\n{{\n}}\n"
        )
    };
    fs::write(&path, shot("../rod.usda")).unwrap();
    assert!(read_character(&path).is_err());
    fs::copy(folder.path().join("rod.usda"), inside.join("rod.usda")).unwrap();
    fs::write(&path, shot("./rod.usda")).unwrap();
    let character = read_character(&path).unwrap();
    assert_eq!(character.skeleton.names(), ["hips", "chest"]);
}

/// The own writer of USD and the library that reads it agree, in both forms.
#[test]
fn written_usd_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let figure = unic_testdata::Figure::tube();
    let (garment, body) = (&figure.garment.rest, &figure.character.body);
    let moved = |mesh: &TriMesh, frame: usize| -> Vec<Vec3> {
        let offset = Vec3::new(0.1, 0.01, -1.0 / 3.0) * frame as f32;
        mesh.vertices.iter().map(|v| *v + offset).collect()
    };
    for name in ["walk.usdc", "walk.usda"] {
        let path = folder.path().join(name);
        let mut writer = UsdWriter::create(&path, &[("garment", garment), ("body", body)], 25.0).unwrap();
        for frame in 0..7 {
            writer
                .push(&[&moved(garment, frame), &moved(body, frame)])
                .unwrap();
        }
        writer.finish().unwrap();
        let bodies = body.vertices.len();
        let read = read_scene_points(&path, RiggedFormat::Usd, None, bodies, &Assumed::default()).unwrap();
        assert_eq!((read.name.as_str(), read.fps), ("/animation/garment", Some(25.0)));
        assert_eq!((read.frames.len(), &read.mesh.faces), (7, &garment.faces));
        for (frame, found) in read.frames.iter().enumerate() {
            assert_eq!(found, moved(garment, frame), "{name}, frame {frame}");
        }
        let read = read_scene_points(&path, RiggedFormat::Usd, Some("body"), 0, &Assumed::default()).unwrap();
        assert_eq!(read.frames.frame(6), moved(body, 6));
    }
}
