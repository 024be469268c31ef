//! Contract: no damaged file makes a reader panic, loop endlessly or hold memory out of proportion
//! to it, and every refusal is one sentence. Values that are read nevertheless are used and must be
//! valid.
//!
//! `UNIC_MUTATION_SECONDS` is the time for each reader, `UNIC_MUTATION_SEED` repeats one file; see
//! [`unic_mutation`].

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;
#[path = "common/pickle.rs"]
mod pickle;

use common::{humanoid, small_character, small_clip, small_database, small_frame, small_garment};
use glam::Vec3;
use pickle::smpl_pickle;
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_core::{character::Character, clip::Clip, mesh::TriMesh, surface::Surface};
use unic_io::{
    Bvh, Capture, CaptureWriter, FootLock, GroundPlacement, LowPass, Manifest, MotionOptions, Npz, Split,
    UpAxis, VertexCacheWriter,
    alembic::{AlembicReader, AlembicWriter},
    capture::{JointReference, VertexAttributes, read_garment},
    frames::VertexFrames,
    glb::{GlbScene, GlbWriter},
    import_motion, inspect, read_character, read_motion_database, read_obj, read_vertex_cache,
    write_character, write_motion, write_motion_database, write_obj,
};
use unic_mutation::{Container, CountingAllocator, FuzzTarget, Tally, fuzz, measure, scratch_folder};
use unic_testdata::rod::{ROD_USDA, fbx_binary, fbx_text, rod_fbx};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

type Refusal = Result<(), String>;

/// An empty folder for the files of a reader.
fn folder(name: &str) -> PathBuf {
    scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), name)
}

fn damage(name: &str, path: &Path, read: impl Fn(&Path) -> unic_io::Result<()>) -> Tally {
    let is_zip = path.extension().is_some_and(|e| e == "npz");
    let container = if is_zip { Container::Zip } else { Container::Plain };
    let target = FuzzTarget {
        name,
        path,
        container,
    };
    let inspected = |path: &Path| -> Refusal {
        // Inspection of a damaged file must succeed, and its text must be safe for a terminal.
        let report = inspect(path).map_err(|e| e.to_string())?.to_string();
        assert!(!report.chars().any(|c| c.is_control() && c != '\n'), "{report:?}");
        read(path).map_err(|e| e.to_string())
    };
    let tally = fuzz(&target, inspected);
    assert!(tally.refused > 100, "{name}: too little damage is detected");
    tally
}

fn use_mesh(mesh: &TriMesh) {
    let surface = Surface::build(mesh);
    for point in [Vec3::ZERO, Vec3::splat(0.3)] {
        let _ = surface.closest(point);
    }
}

fn use_frames(frames: &VertexFrames) {
    let count: usize = frames.iter().map(<[Vec3]>::len).sum();
    assert_eq!(count, frames.len() * frames.vertex_count());
    let _ = frames.first_non_finite();
}

fn use_clip(clip: &Clip, character: &Character) {
    let (mut joints, mut transforms, mut body) = (Vec::new(), Vec::new(), Vec::new());
    for pose in &clip.poses {
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        character
            .weights
            .skin(&character.body.vertices, &transforms, &mut body);
    }
    assert!(clip.fps > 0.0 && clip.len() > 1);
}

fn use_character(character: &Character) {
    use_mesh(&character.body);
    let pose = character.skeleton.bind_pose();
    let clip = Clip {
        name: "bind".into(),
        fps: 30.0,
        poses: vec![pose.clone(), pose],
        ground_height: 0.0,
        wind: Vec::new(),
    };
    use_clip(&clip, character);
}

#[test]
fn characters() {
    let path = folder("character").join("character.npz");
    write_character(&path, &small_character()).unwrap();
    damage("character", &path, |path| {
        use_character(&read_character(path)?);
        Ok(())
    });
}

#[test]
fn smpl_pickles() {
    let path = folder("smpl").join("model.pkl");
    fs::write(&path, smpl_pickle()).unwrap();
    use_character(&read_character(&path).unwrap());
    damage("smpl", &path, |path| {
        use_character(&read_character(path)?);
        Ok(())
    });
}

#[test]
fn motion_arrays() {
    let path = folder("motion").join("motion.npz");
    write_motion(&path, &small_clip("motion", 12), &[]).unwrap();
    let character = small_character();
    let options = MotionOptions {
        fps: Some(24.0),
        ground: GroundPlacement::OnGround,
        feet: FootLock::Hold,
        low_pass: LowPass::Hertz(6.0),
        ..MotionOptions::default()
    };
    damage("motion", &path, |path| {
        use_clip(&import_motion(path, &character, &options)?.clip, &character);
        Ok(())
    });
}

/// A person of eleven joints who raises an arm and walks.
fn person() -> String {
    let mut text = String::from("HIERARCHY\n");
    let joints = [
        (0, "ROOT", "Hips", [0.0, 96.0, 0.0]),
        (1, "JOINT", "LeftUpLeg", [9.0, -6.0, 0.0]),
        (2, "JOINT", "LeftLeg", [0.0, -41.0, 0.0]),
        (3, "JOINT", "LeftFoot", [0.0, -41.0, -2.0]),
        (1, "JOINT", "RightUpLeg", [-9.0, -6.0, 0.0]),
        (2, "JOINT", "RightLeg", [0.0, -41.0, 0.0]),
        (3, "JOINT", "RightFoot", [0.0, -41.0, -2.0]),
        (1, "JOINT", "Spine", [0.0, 12.0, 0.0]),
        (2, "JOINT", "LeftArm", [18.0, 34.0, 0.0]),
        (3, "JOINT", "LeftForeArm", [27.0, 0.0, 0.0]),
        (2, "JOINT", "RightArm", [-18.0, 34.0, 0.0]),
        (3, "JOINT", "RightForeArm", [-27.0, 0.0, 0.0]),
        (2, "JOINT", "Head", [0.0, 40.0, 0.0]),
    ];
    let mut open = 0;
    let close = |text: &mut String, from: usize, to: usize| {
        if from > to {
            text.push_str("End Site\n{\nOFFSET 0 -3 12\n}\n");
        }
        (to..from).for_each(|_| text.push_str("}\n"));
    };
    for (depth, word, name, [x, y, z]) in joints {
        close(&mut text, open, depth);
        let channels = match depth {
            0 => "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
            _ => "3 Zrotation Xrotation Yrotation",
        };
        text += &format!("{word} {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS {channels}\n");
        open = depth + 1;
    }
    close(&mut text, open, 0);
    text += "MOTION\nFrames: 12\nFrame Time: 0.0333333\n";
    for t in 0..12 {
        let turns = (0..joints.len() * 3).map(|i| format!(" {}", (i * t) % 23));
        text += &format!("0 96 {t}{}\n", turns.collect::<String>());
    }
    text
}

#[test]
fn bvh_files() {
    let path = folder("bvh").join("walk.bvh");
    fs::write(&path, person()).unwrap();
    let character = humanoid();
    let options = MotionOptions {
        fps: Some(30.0),
        up: UpAxis::Y,
        ..MotionOptions::default()
    };
    damage("bvh", &path, |path| {
        let bvh = Bvh::read(path)?;
        let mut world = Vec::new();
        (0..bvh.len()).for_each(|t| bvh.world_from_joint(t, &mut world));
        use_clip(&import_motion(path, &character, &options)?.clip, &character);
        Ok(())
    });
}

#[test]
fn obj_meshes() {
    let path = folder("obj").join("garment.obj");
    write_obj(&path, &small_garment().rest).unwrap();
    damage("obj", &path, |path| {
        use_mesh(&read_obj(path)?);
        Ok(())
    });
}

/// Damage is found by the checksum; the tests of `unic-core` look behind it.
#[test]
fn motion_databases() {
    let path = folder("motion database").join("walks.unicmotn");
    write_motion_database(&path, &small_database()).unwrap();
    damage("motion database", &path, |path| {
        read_motion_database(path).map(drop)
    });
}

#[test]
fn obj_sequences() {
    let folder = folder("obj sequence").join("frames");
    let mut cache = VertexCacheWriter::create(&folder, &small_garment().rest, 30.0).unwrap();
    (0..3).for_each(|t| cache.push(&small_frame(t)).unwrap());
    cache.finish().unwrap();
    damage("obj sequence", &folder.join("frame_0001.obj"), |_| {
        use_frames(&read_vertex_cache(&folder)?.frames);
        Ok(())
    });
}

#[test]
fn vertex_caches() {
    for name in ["cache.pc2", "cache.npz"] {
        let path = folder(name).join(name);
        let mut cache = VertexCacheWriter::create(&path, &small_garment().rest, 30.0).unwrap();
        (0..3).for_each(|t| cache.push(&small_frame(t)).unwrap());
        cache.finish().unwrap();
        damage(name, &path, |path| {
            let cache = read_vertex_cache(path)?;
            use_frames(&cache.frames);
            cache.mesh.iter().for_each(use_mesh);
            Ok(())
        });
    }
}

#[test]
fn mdd_caches() {
    let path = folder("mdd").join("cache.mdd");
    let mut words: Vec<[u8; 4]> = [3, 4].map(i32::to_be_bytes).to_vec();
    words.extend([0.0_f32, 1.0 / 30.0, 2.0 / 30.0].map(f32::to_be_bytes));
    for frame in (0..3).map(small_frame) {
        words.extend(frame.iter().flat_map(|v| v.to_array()).map(f32::to_be_bytes));
    }
    fs::write(&path, words.as_flattened()).unwrap();
    damage("mdd", &path, |path| {
        use_frames(&read_vertex_cache(path)?.frames);
        Ok(())
    });
}

#[test]
fn alembic_files() {
    let path = folder("alembic").join("cache.abc");
    let mesh = small_garment().rest;
    let mut writer = AlembicWriter::create(&path, &[("garment", &mesh), ("other", &mesh)], 30.0).unwrap();
    (0..3).for_each(|t| writer.push(&[&small_frame(t), &small_frame(t + 1)]).unwrap());
    writer.finish().unwrap();
    damage("alembic", &path, |path| {
        let reader = AlembicReader::open(path)?;
        let mut animation = reader.animation(0)?;
        use_mesh(&animation.first_mesh()?);
        let mut positions = Vec::new();
        // A damaged count of frames may be large, and their positions equal.
        for frame in 0..animation.len().min(100) {
            animation.frame(frame, &mut positions)?;
            assert_eq!(positions.len(), animation.vertex_count());
        }
        let _ = animation.fps();
        Ok(())
    });
}

#[test]
fn gltf_files() {
    let path = folder("gltf").join("walk.glb");
    let (character, clip) = (small_character(), small_clip("walk", 12));
    let scene = GlbScene {
        name: "walk",
        character: &character,
        garment: &small_garment().rest,
        fps: 30.0,
        frames: clip.len(),
    };
    let mut writer = GlbWriter::create(&path, &scene).unwrap();
    for (t, pose) in clip.poses.iter().enumerate() {
        writer.push(pose, &small_frame(t)).unwrap();
    }
    writer.finish().unwrap();
    damage("gltf", &path, |path| {
        let read = read_character(path)?;
        use_character(&read);
        for target in [&read, &character] {
            use_clip(
                &import_motion(path, target, &MotionOptions::default())?.clip,
                target,
            );
        }
        Ok(())
    });
}

/// Damages a rod. The readers run in this process here: panics of their libraries are caught, and time
/// and memory must be bounded without help.
fn damage_rod(name: &str, file: &str, bytes: &[u8]) {
    let path = folder(name).join(file);
    fs::write(&path, bytes).unwrap();
    damage(name, &path, |path| {
        let read = read_character(path)?;
        use_character(&read);
        use_clip(
            &import_motion(path, &read, &MotionOptions::default())?.clip,
            &read,
        );
        Ok(())
    });
}

#[test]
fn binary_fbx() {
    damage_rod("fbx", "rod.fbx", &fbx_binary(&rod_fbx()));
}

#[test]
fn fbx_as_text() {
    damage_rod("fbx text", "rod.fbx", fbx_text(&rod_fbx()).as_bytes());
}

#[test]
fn usd_as_text() {
    damage_rod("usda", "rod.usda", ROD_USDA.as_bytes());
}

#[test]
fn numpy_arrays() {
    let path = folder("npy").join("frames.npy");
    let numbers: Vec<f32> = (0..60).map(|i| i as f32 * 0.1).collect();
    unic_io::npy::write_npy(&path, &[5, 4, 3], &numbers).unwrap();
    damage("npy", &path, |path| {
        use_frames(&read_vertex_cache(path)?.frames);
        Ok(())
    });
}

#[test]
fn archives_of_every_type() {
    let path = folder("npz").join("arrays.npz");
    let mut npz = unic_io::NpzWriter::create(&path).unwrap();
    npz.f64s("numbers", &[2, 3], &[0.5; 6]).unwrap();
    npz.i32s("counts", &[3], &[1, 2, 3]).unwrap();
    npz.bools("mask", &[true, false, true]).unwrap();
    npz.text("names", &["hip".into(), "knée".into()]).unwrap();
    npz.f64s("fps", &[], &[30.0]).unwrap();
    npz.finish().unwrap();
    damage("npz", &path, |path| {
        let mut npz = Npz::open(path)?;
        use unic_io::npy::Dim::{Any, Is};
        npz.array::<f32>("numbers", &[Any("N"), Is(3)])?;
        npz.array::<u32>("counts", &[Any("N")])?;
        npz.array::<bool>("mask", &[Is(3)])?;
        npz.text("names")?;
        npz.number("fps").map(drop)
    });
}

/// Writes a capture of one clip with all optional parts.
fn capture(root: &Path) {
    let mut manifest = Manifest::new("small", 30.0);
    manifest.contact_joints = Some([0, 1, 0, 1].map(JointReference::Index));
    manifest.provenance = "made by a test".into();
    let (character, garment) = (small_character(), small_garment());
    let attributes = VertexAttributes {
        pinned: Some(vec![true, false, false, false]),
        groups: Some(vec![0, 1, 1, 2]),
    };
    let mut writer = CaptureWriter::create(root, manifest, &character, &garment, &attributes).unwrap();
    let mut walk = small_clip("walk", 6);
    walk.wind = vec![Vec3::X; 6];
    let mut clip = writer.begin_clip(&walk, Split::Train).unwrap();
    (0..6).for_each(|t| clip.push(&small_frame(t)).unwrap());
    clip.finish().unwrap();
    writer.finish().unwrap();
}

fn load(root: &Path) -> unic_io::Result<()> {
    let capture = Capture::open(root)?;
    use_character(&capture.character);
    use_mesh(&capture.garment.rest);
    for (name, _) in capture.manifest.splits.iter() {
        capture.summarise_clip(name)?;
        let clip = capture.load_clip(name)?;
        use_clip(&clip.clip, &capture.character);
        use_frames(&clip.garment);
    }
    Ok(())
}

#[test]
fn captures() {
    for file in [
        "capture.toml",
        "character.npz",
        "garment.npz",
        "garment.obj",
        "clips/walk.npz",
        "clips/walk.garment.npy",
    ] {
        let name = format!("capture {}", file.replace('/', " "));
        let root = folder(&name).join("capture");
        capture(&root);
        damage(&name, &root.join(file), |_| load(&root));
    }
}

#[test]
fn garments_without_weights() {
    let folder = folder("garment").join("folder");
    fs::create_dir_all(&folder).unwrap();
    let character = small_character();
    write_obj(&folder.join("garment.obj"), &small_garment().rest).unwrap();
    damage("garment", &folder.join("garment.obj"), |_| {
        let (garment, _) = read_garment(&folder, &character)?;
        assert_eq!(garment.weights.len(), garment.rest.vertices.len());
        Ok(())
    });
}

/// Asserts that a valid file of an extreme shape is read in bounded time and memory.
fn assert_bounded(name: &str, bytes: &[u8], read: impl Fn(&Path) -> Refusal) {
    let path = folder("absurd").with_file_name(name);
    fs::write(&path, bytes).unwrap();
    let (outcome, cost) = measure(|| read(&path));
    eprintln!("{name}: {} bytes, {cost}, {outcome:?}", bytes.len());
    assert!(cost.is_bounded(bytes.len()), "{name}: {cost}");
}

#[test]
fn very_deep_skeletons_are_read_in_bounded_memory() {
    let chain = |count: usize| {
        let mut text = String::from("HIERARCHY\n");
        for j in 0..count {
            let word = if j == 0 { "ROOT" } else { "JOINT" };
            text += &format!("{word} j{j}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Zrotation\n");
        }
        text += &"}\n".repeat(count);
        text + "MOTION\nFrames: 2\nFrame Time: .1\n" + &"1 ".repeat(2 * count)
    };
    let character = humanoid();
    assert_bounded("deep.bvh", chain(20_000).as_bytes(), |path| {
        import_motion(path, &character, &MotionOptions::default())
            .map(drop)
            .map_err(|e| e.to_string())
    });
    let count = 200_000;
    let path = folder("absurd character").join("character.npz");
    let mut npz = unic_io::NpzWriter::create(&path).unwrap();
    npz.f32s(
        "vertices",
        &[3, 3],
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
    .unwrap();
    npz.i32s("faces", &[1, 3], &[0, 1, 2]).unwrap();
    npz.f32s("joints", &[count, 3], &vec![0.5; 3 * count]).unwrap();
    // Children before their parents, the root last.
    let parents: Vec<i32> = (1..count as i32).chain([-1]).collect();
    npz.i32s("parents", &[count], &parents).unwrap();
    npz.f32s("weights", &[3, count], &vec![1.0; 3 * count]).unwrap();
    npz.finish().unwrap();
    assert_bounded("deep character.npz", &fs::read(path).unwrap(), |path| {
        read_character(path)
            .map(|c| use_character(&c))
            .map_err(|e| e.to_string())
    });
}

#[test]
fn very_deep_and_long_text_is_read_in_bounded_memory() {
    let deep = format!("name = \"a\"\nfps = 30.0\nsource = {}", "[".repeat(200_000));
    assert_bounded("deep.toml", deep.as_bytes(), |path| {
        Manifest::read(path).map(drop).map_err(|e| e.to_string())
    });
    let keys = format!(
        "name = \"a\"\nfps = 30.0\nsource.{} = 1\n",
        vec!["a"; 100_000].join(".")
    );
    assert_bounded("dotted.toml", keys.as_bytes(), |path| {
        Manifest::read(path).map(drop).map_err(|e| e.to_string())
    });
    let fan = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1 2 3".repeat(200_000));
    assert_bounded("fan.obj", fan.as_bytes(), |path| {
        read_obj(path).map(drop).map_err(|e| e.to_string())
    });
    let line = format!("v 0 0 0\n{}", "v 1 2 \\\n".repeat(200_000));
    assert_bounded("continued.obj", line.as_bytes(), |path| {
        read_obj(path).map(drop).map_err(|e| e.to_string())
    });
    let weld = "v 0 0 0\n".repeat(200_000) + "f 1 2 3\n";
    let character = small_character();
    assert_bounded("garment.obj", weld.as_bytes(), |path| {
        read_garment(path.parent().unwrap(), &character)
            .map(drop)
            .map_err(|e| e.to_string())
    });
    assert_bounded("report.obj", weld.as_bytes(), |path| {
        inspect(path).map(drop).map_err(|e| e.to_string())
    });
}

#[test]
fn false_counts_are_refused() {
    let folder = folder("false counts");
    let refused = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).unwrap();
        let (read, cost) = measure(|| match name {
            "a.bvh" => Bvh::read(&path).map(drop),
            "a.obj" => read_obj(&path).map(drop),
            _ => read_vertex_cache(&path).map(drop),
        });
        assert!(read.is_err() && cost.is_bounded(bytes.len()), "{name}: {cost}");
    };
    let bvh = person();
    for count in ["999999999", "18446744073709551615", "-1", "0", "1e3"] {
        refused(
            "a.bvh",
            bvh.replace("Frames: 12", &format!("Frames: {count}")).as_bytes(),
        );
        refused(
            "a.bvh",
            bvh.replace("CHANNELS 3", &format!("CHANNELS {count}")).as_bytes(),
        );
    }
    for index in [
        "0",
        "4",
        "4294967297",
        "-4",
        "-9223372036854775808",
        "99999999999999999999",
    ] {
        refused(
            "a.obj",
            format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n").as_bytes(),
        );
        refused(
            "a.obj",
            format!("v 0 0 0\nvt 0 0\nf 1/1 1/1 1/{index}\n")
                .replace("/4\n", "/2\n")
                .as_bytes(),
        );
    }
    for (points, samples) in [(i32::MAX, i32::MAX), (-1, 1), (2, -1), (0, 1), (1, i32::MAX)] {
        let numbers = [1, points, 0, 0, samples].map(i32::to_le_bytes).concat();
        refused("a.pc2", &[&b"POINTCACHE2\0"[..], &numbers, &[0; 24]].concat());
    }
}
