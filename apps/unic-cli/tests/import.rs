//! Contract: `unic import` makes captures of the files of other programs, or adds clips to them. The
//! positions stay within 1e-4 m of the truth, each conversion is stated, and a refusal leaves
//! everything as it was.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use glam::Vec3;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};
use tempfile::TempDir;
use unic_core::skeleton::Skeleton;
use unic_io::{
    Capture, NpzWriter, Split, VertexCacheWriter, VertexFrames,
    capture::{StagedClip, real_path},
    read_obj, write_character, write_motion, write_obj,
};

/// Largest distance of an imported vertex from the truth, metres.
const TOLERANCE_M: f32 = 1e-4;

/// Options of every import of the tube.
const TUBE: &str = "--character tube/character.npz --rest tube/garment.obj --contacts 4,4,5,5";

fn largest_distance(found: &VertexFrames, expected: impl Iterator<Item = Vec<Vec3>>) -> f32 {
    let far = |(found, expected): (&[Vec3], Vec<Vec3>)| {
        assert_eq!(found.len(), expected.len());
        let distances = found.iter().zip(&expected).map(|(a, b)| a.distance(*b));
        distances.fold(0.0, f32::max)
    };
    found.iter().zip(expected).map(far).fold(0.0, f32::max)
}

/// Writes the frames of a garment in the format that the name asks for.
fn write_frames(folder: &Path, name: &str, frames: &[Vec<Vec3>]) {
    let mut cache = VertexCacheWriter::create(&folder.join(name), &garment().rest, FPS).unwrap();
    frames.iter().for_each(|frame| cache.push(frame).unwrap());
    cache.finish().unwrap();
}

/// Bytes of an MDD file: big-endian counts, times and positions.
fn mdd(frames: &[Vec<Vec3>]) -> Vec<u8> {
    let counts = [frames.len(), VERTICES].map(|count| (count as i32).to_be_bytes());
    let times = (0..frames.len()).map(|t| (t as f32 / FPS).to_be_bytes());
    let positions = frames.iter().flatten().flat_map(|v| v.to_array());
    let words = counts
        .into_iter()
        .chain(times)
        .chain(positions.map(f32::to_be_bytes));
    words.flatten().collect()
}

/// Folder with the capture `tube`, and clip `one` of it as `one.pc2` and `one.npz`.
fn fresh() -> (TempDir, Vec<Vec<Vec3>>) {
    let folder = tempfile::tempdir().unwrap();
    let root = write_capture(folder.path());
    let clip = Capture::open(&root).unwrap().load_clip("one").unwrap();
    let frames: Vec<Vec<Vec3>> = clip.garment.iter().map(<[Vec3]>::to_vec).collect();
    write_frames(folder.path(), "one.pc2", &frames);
    write_motion(&folder.path().join("one.npz"), &clip.clip, &[]).unwrap();
    (folder, frames)
}

fn import(folder: &Path, line: &str) -> serde_json::Value {
    json(folder, &format!("import {line} --json"))
}

/// Names and bytes of all files below a folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => all.extend(contents(&path)),
            false => drop(all.insert(path.clone(), fs::read(&path).unwrap())),
        }
    }
    all
}

/// Runs an import that must fail and change no files. Returns the last line of stderr.
fn refusal(folder: &Path, line: &str) -> String {
    let before = contents(folder);
    let output = unic(folder, &format!("import {line}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(matches!(output.status.code(), Some(1 | 2)), "{line}: {stderr}");
    assert!(contents(folder) == before, "{line} changes files");
    assert!(!stderr.contains(".import."), "{stderr}");
    stderr.lines().last().unwrap_or_default().to_owned()
}

#[test]
fn clips_make_a_capture_and_are_added_to_it() {
    let (folder, frames) = fresh();
    let line = format!("--garment one.pc2 --motion one.npz {TUBE} --out made/tube");
    let made = import(folder.path(), &line);
    assert_eq!(made["clip"], "one");
    assert_eq!(made["split"], "train");
    assert_eq!(made["frames"], FRAMES);
    assert_eq!(made["vertices"], VERTICES);
    // The second clip needs neither the character nor the rest shape.
    fs::write(folder.path().join("two.mdd"), mdd(&frames)).unwrap();
    let line = "--garment two.mdd --motion one.npz --clip two --test two --out made/tube";
    assert_eq!(import(folder.path(), line)["split"], "test");
    let root = folder.path().join("made/tube");
    let capture = Capture::open(&root).unwrap();
    assert_eq!(capture.manifest.name, "tube");
    assert_eq!(capture.clip_names(Split::Train), ["one"]);
    assert_eq!(capture.clip_names(Split::Test), ["two"]);
    assert_eq!(capture.contact_joints, [4, 4, 5, 5]);
    let provenance = "imported from one.pc2, character.npz, garment.obj, one.npz; licence not stated";
    assert_eq!(capture.manifest.provenance, provenance);
    assert!(capture.manifest.source["imports"]["two"]["garment"].as_str() == Some("two.mdd"));
    for name in ["one", "two"] {
        let clip = capture.load_clip(name).unwrap();
        let garment = &clip.garment;
        assert!(largest_distance(garment, frames.iter().cloned()) < 1e-6);
    }
    assert_eq!(fs::read_dir(&root).unwrap().count(), 5, "nothing is left over");
    succeeds(folder.path(), "inspect made/tube");
}

#[test]
fn units_axes_and_rates_that_files_do_not_state_are_options() {
    let (folder, frames) = fresh();
    // Centimetres, Z up.
    let turned = |v: &Vec3| 100.0 * Vec3::new(v.x, -v.z, v.y);
    let there: Vec<Vec<Vec3>> = (frames.iter())
        .map(|frame| frame.iter().map(turned).collect())
        .collect();
    write_frames(folder.path(), "z.pc2", &there);
    let mut rest = read_obj(&folder.path().join("tube/garment.obj")).unwrap();
    rest.vertices.iter_mut().for_each(|v| *v = turned(v));
    write_obj(&folder.path().join("z.obj"), &rest).unwrap();
    // A motion without a frame rate.
    let clip = Capture::open(&folder.path().join("tube"))
        .unwrap()
        .load_clip("one")
        .unwrap()
        .clip;
    let poses: Vec<f32> = (clip.poses.iter().flat_map(|pose| &pose.local))
        .flat_map(|rotation| rotation.to_scaled_axis().to_array())
        .collect();
    let trans: Vec<f32> = clip.poses.iter().flat_map(|pose| pose.trans.to_array()).collect();
    let mut npz = NpzWriter::create(&folder.path().join("bare.npz")).unwrap();
    npz.f32s("poses", &[FRAMES, 3 * JOINTS], &poses).unwrap();
    npz.f32s("trans", &[FRAMES, 3], &trans).unwrap();
    npz.finish().unwrap();

    let line = "--garment z.pc2 --rest z.obj --up z --scale 0.01 --motion bare.npz --motion-up y --contacts \
                4,4,5,5 --character tube/character.npz --out made";
    let message = refusal(folder.path(), line);
    assert!(
        message.contains("bare.npz") && message.contains("frame rate"),
        "{message}"
    );
    let summary = import(folder.path(), &format!("{line} --fps {FPS}"));
    let notes = summary["notes"].to_string();
    for word in [
        "z.pc2: Z up converted to Y up",
        "z.obj: scaled by 0.01",
        "bare.npz: no frame rate",
    ] {
        assert!(notes.contains(word), "{word} in {notes}");
    }
    let clip = Capture::open(&folder.path().join("made"))
        .unwrap()
        .load_clip("bare")
        .unwrap();
    let garment = &clip.garment;
    assert!(largest_distance(garment, frames.into_iter()) < 1e-5);
}

#[test]
fn frames_that_belong_together_are_chosen_by_offset_and_range() {
    let (folder, frames) = fresh();
    // Three frames of preroll.
    let late: Vec<Vec<Vec3>> = frames[..1]
        .iter()
        .cycle()
        .take(3)
        .chain(&frames)
        .cloned()
        .collect();
    write_frames(folder.path(), "late.npz", &late);
    let line = format!("--garment late.npz --motion one.npz {TUBE} --out made");
    let summary = import(folder.path(), &format!("{line} --offset 3 --frames 5..25"));
    assert_eq!(summary["frames"], 20);
    let notes = summary["notes"].to_string();
    assert!(
        notes.contains("frames 5 to 24 of 30 go with frames 8 to 27 of 33"),
        "{notes}"
    );
    let clip = Capture::open(&folder.path().join("made"))
        .unwrap()
        .load_clip("one")
        .unwrap();
    let garment = &clip.garment;
    assert!(largest_distance(garment, frames[5..25].iter().cloned()) < 1e-6);
    let message = refusal(folder.path(), &format!("{line} --overwrite --frames 5..40"));
    assert!(message.contains("within 0..30, found 5..40"), "{message}");
}

#[test]
fn mistakes_change_nothing() {
    let (folder, frames) = fresh();
    let path = folder.path();
    import(
        path,
        &format!("--garment one.pc2 --motion one.npz {TUBE} --out made"),
    );
    let mut shuffled = frames.clone();
    let mut places: Vec<usize> = (0..VERTICES).collect();
    // Hashes in place of random numbers: a regular order may keep edges short.
    places.sort_by_key(|v| (*v as u32).pow(3).wrapping_mul(0x9E37_79B9));
    for (frame, truth) in shuffled.iter_mut().zip(&frames) {
        *frame = places.iter().map(|place| truth[*place]).collect();
    }
    write_frames(path, "shuffled.pc2", &shuffled);
    let scaled: Vec<Vec<Vec3>> = (frames.iter())
        .map(|frame| frame.iter().map(|v| 100.0 * *v).collect())
        .collect();
    write_frames(path, "scaled.pc2", &scaled);
    let fewer: Vec<Vec3> = frames[0][1..].to_vec();
    let mut cache = unic_io::pc2::Pc2Writer::create(&path.join("fewer.pc2"), fewer.len(), 0.0, 1.0).unwrap();
    (0..FRAMES).for_each(|_| cache.push(&fewer).unwrap());
    cache.finish().unwrap();
    let mut broken = frames.clone();
    broken[7][3].y = f32::NAN;
    write_frames(path, "broken.pc2", &broken);
    fs::copy(path.join("made/clips/one.npz"), path.join("two.npz")).unwrap();
    for (line, words) in [
        ("--garment one.pc2 --motion one.npz --out made", "--overwrite"),
        (
            "--garment one.pc2 --motion made/clips/one.npz --out made --overwrite",
            "found the input",
        ),
        (
            "--garment made/clips/one.garment.npy --motion one.npz --out made --overwrite",
            "found the input",
        ),
        (
            "--garment one.pc2 --motion two.npz --out made --test three",
            "found three",
        ),
        (
            "--garment one.pc2 --motion two.npz --out made --fps 24",
            "expected the 30 frames per second",
        ),
        (
            "--garment one.pc2 --motion two.npz --out made --object coat",
            "--object",
        ),
        ("--garment one.pc2 --motion two.npz --out made --clip a/b", "a/b"),
        (
            "--garment one.pc2 --motion two.npz --out made --offset 40",
            "in common",
        ),
        (
            "--garment scaled.pc2 --motion two.npz --out made",
            "scale the garment's positions by 0.01",
        ),
        (
            "--garment shuffled.pc2 --motion two.npz --out made",
            "another order",
        ),
        ("--garment fewer.pc2 --motion two.npz --out made", "vertices"),
        (
            "--garment broken.pc2 --motion two.npz --out made",
            "vertex 3 of frame 7",
        ),
        (
            "--garment one.pc2 --motion two.npz --out made/clips",
            "a part of the capture",
        ),
        (
            "--garment nothing.abc --motion two.npz --out made",
            "nothing.abc: cannot open",
        ),
        ("--garment one.pc2 --motion two.npz --out new", "--character"),
        (
            "--garment one.pc2 --motion two.npz --character tube/character.npz --out new",
            "--rest",
        ),
    ] {
        let message = refusal(path, line);
        assert!(message.contains(words), "{line}: {message}");
        assert!(!path.join("new").exists(), "{line}");
    }
    let again = "--garment one.pc2 --motion one.npz --out made --overwrite";
    assert_eq!(import(path, again)["clips"], 1);
}

#[test]
fn leftovers_of_killed_imports_are_removed() {
    let (folder, _) = fresh();
    let root = folder.path().join("made");
    let line = format!("--garment one.pc2 --motion one.npz {TUBE} --out made");
    import(folder.path(), &line);
    std::mem::forget(StagedClip::create_in(&root).unwrap());
    assert_eq!(fs::read_dir(&root).unwrap().count(), 6);
    import(folder.path(), &format!("{line} --clip two"));
    assert_eq!(fs::read_dir(&root).unwrap().count(), 5);
}

#[test]
fn contact_joints_of_a_capture_hold_for_its_further_clips() {
    let (folder, _) = fresh();
    // Joints whose names tell no feet.
    let mut character = character();
    let mut parts = character.skeleton.to_parts();
    parts.names = (0..JOINTS).map(|joint| format!("part {joint}")).collect();
    character.skeleton = Skeleton::new(parts).unwrap();
    write_character(&folder.path().join("nameless.npz"), &character).unwrap();
    let line =
        "--garment one.pc2 --motion one.npz --rest tube/garment.obj --character nameless.npz --out made";
    let motion = Capture::open(&folder.path().join("tube"))
        .unwrap()
        .load_clip("one")
        .unwrap()
        .clip;
    write_motion(
        &folder.path().join("one.npz"),
        &motion,
        character.skeleton.names(),
    )
    .unwrap();
    let message = refusal(folder.path(), line);
    assert!(message.contains("--contacts names them"), "{message}");
    import(folder.path(), &format!("{line} --contacts 4,4,5,5"));
    import(
        folder.path(),
        "--garment one.pc2 --motion one.npz --clip two --out made",
    );
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    assert_eq!(capture.contact_joints, [4, 4, 5, 5]);
}

/// Path of a file beside the checkout, unless it is missing.
fn data(name: &str) -> Option<String> {
    let root = real_path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    let path = root.join(name);
    match path.exists() {
        true => Some(path.display().to_string()),
        false => {
            eprintln!("skipped: {} is not there", path.display());
            None
        }
    }
}

/// Options for the clip that Blender exported, and the clip itself.
fn walk() -> Option<(String, VertexFrames)> {
    let motion = data("captures/tshirt_blender/clips/walk_02_01.npz")?;
    let (character, rest) = (data("body/character.npz")?, data("interop/tshirt_rest.obj")?);
    let capture = Capture::open(data("captures/tshirt_blender")?.as_ref()).unwrap();
    let line = format!("--character {character} --rest {rest} --motion {motion} --out made");
    let clip = capture.load_clip("walk_02_01").unwrap();
    let truth = &clip.garment;
    Some((line, truth.clone()))
}

#[test]
fn files_of_blender_are_imported_exactly() {
    let Some((line, truth)) = walk() else { return };
    for (file, frames) in [
        ("interop/tshirt_walk.pc2", 150),
        ("interop/obj_sequence", 10),
        ("interop/tshirt_walk.abc", 150),
        ("interop/tshirt_walk_30frames.usdc", 30),
    ] {
        let Some(garment) = data(file) else { return };
        let folder = tempfile::tempdir().unwrap();
        let summary = import(folder.path(), &format!("--garment {garment} {line}"));
        assert_eq!(summary["frames"], frames, "{file}");
        assert_eq!(summary["fps"], 30.0, "{file}");
        let capture = Capture::open(&folder.path().join("made")).unwrap();
        let clip = capture.load_clip("walk_02_01").unwrap();
        let found = &clip.garment;
        let far = largest_distance(found, truth.iter().map(<[Vec3]>::to_vec));
        println!("{file}: {:.4} mm", 1e3 * far);
        assert!(far < TOLERANCE_M, "{file}: {far} m");
    }
}

/// A character and its motion from glTF, a garment from Alembic: no file of our own.
#[test]
fn a_capture_is_made_of_files_of_blender_alone() {
    let (Some(glb), Some(abc)) = (data("interop/body_walk.glb"), data("interop/tshirt_walk.abc")) else {
        return;
    };
    let (Some(rest), Some((_, truth))) = (data("interop/tshirt_rest.obj"), walk()) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let line = format!("--garment {abc} --character {glb} --motion {glb} --rest {rest} --out made");
    let message = refusal(folder.path(), &format!("{line} --object Coat"));
    assert!(message.contains("/Garment/Garment, /Rig/Body/Body"), "{message}");
    import(folder.path(), &format!("{line} --object Garment"));
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    let clip = capture.load_clip("body_walk").unwrap();
    let far = largest_distance(&clip.garment, truth.iter().map(<[Vec3]>::to_vec));
    assert!(far < TOLERANCE_M && clip.garment.len() == truth.len(), "{far} m");
    let skeleton = &capture.character.skeleton;
    let contacts = capture
        .contact_joints
        .map(|joint| skeleton.names()[joint].as_str());
    assert_eq!(contacts, ["left_ankle", "left_foot", "right_ankle", "right_foot"]);
}

/// A character and its motion from FBX, a garment from USD.
#[test]
fn a_capture_is_made_of_fbx_and_usd_alone() {
    let (Some(fbx), Some(usd)) = (
        data("interop/body_walk.fbx"),
        data("interop/tshirt_walk_30frames.usdc"),
    ) else {
        return;
    };
    let (Some(rest), Some((_, truth))) = (data("interop/tshirt_rest.obj"), walk()) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let line = format!("--garment {usd} --character {fbx} --motion {fbx} --rest {rest} --out made");
    let message = refusal(folder.path(), &format!("{line} --object Coat"));
    assert!(
        message.contains("Garment/Garment, ") && message.contains("Rig/Body/Body"),
        "{message}"
    );
    let message = refusal(folder.path(), &format!("{line} --object Body"));
    assert!(message.contains("one that a skeleton moves"), "{message}");
    let swapped = format!("--garment {fbx} --character {usd} --motion {usd} --rest {rest} --out made");
    let message = refusal(folder.path(), &swapped);
    assert!(message.contains("export Alembic, USD or PC2"), "{message}");
    let summary = import(folder.path(), &line);
    let notes = summary["notes"].to_string();
    for words in ["Z up converted to Y up", "centimetres converted to metres"] {
        assert!(notes.contains(words), "{words} in {notes}");
    }
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    let clip = capture.load_clip("body_walk").unwrap();
    assert_eq!(clip.garment.len(), 30);
    let far = largest_distance(&clip.garment, truth.iter().map(<[Vec3]>::to_vec).take(30));
    assert!(far < TOLERANCE_M, "{far} m");
}

/// A folder as users of Marvelous Designer and CLO keep a sequence: frames of OBJ beside an FBX file.
#[test]
fn a_sequence_folder_is_a_clip_by_itself() {
    let (Some(fbx), Some(frames)) = (data("interop/body_walk.fbx"), data("interop/obj_sequence")) else {
        return;
    };
    let Some((_, truth)) = walk() else { return };
    let folder = tempfile::tempdir().unwrap();
    let sequence = folder.path().join("sequence_01");
    fs::create_dir_all(sequence.join("deformation")).unwrap();
    for file in fs::read_dir(&frames).unwrap().map(|entry| entry.unwrap().path()) {
        fs::copy(
            &file,
            sequence.join("deformation").join(file.file_name().unwrap()),
        )
        .unwrap();
    }
    fs::copy(&fbx, sequence.join("animation.fbx")).unwrap();
    let rest = data("interop/tshirt_rest.obj").unwrap();
    let line = format!("--garment sequence_01 --rest {rest} --out made");
    assert_eq!(import(folder.path(), &line)["frames"], 10);
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    let clip = capture.load_clip("sequence_01").unwrap();
    let far = largest_distance(&clip.garment, truth.iter().map(<[Vec3]>::to_vec).take(10));
    assert!(far < TOLERANCE_M, "{far} m");
    // A second sequence has the character of the first.
    fs::rename(&sequence, folder.path().join("sequence_02")).unwrap();
    import(folder.path(), "--garment sequence_02 --out made");
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    assert_eq!(capture.clip_names(unic_io::Split::Train).len(), 2);
}

/// A file that crashes a library ends in one sentence: the library runs in another process.
#[test]
fn damaged_files_of_other_programs_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["interop/body_walk.fbx", "interop/tshirt_walk_30frames.usdc"] {
        let Some(path) = data(name) else { return };
        let bytes = fs::read(&path).unwrap();
        let file = Path::new(name)
            .file_name()
            .unwrap()
            .to_string_lossy()
            .into_owned();
        let mut flipped = bytes.clone();
        // The tables at the end of a USD file, the nodes of an FBX file.
        for place in (flipped.len() / 2..flipped.len()).step_by(97) {
            flipped[place] ^= 0x55;
        }
        for damaged in [&bytes[..bytes.len() / 2], &bytes[..40], &flipped] {
            fs::write(folder.path().join(&file), damaged).unwrap();
            let line = format!("--garment {file} --character {file} --motion {file} --out made");
            let message = refusal(folder.path(), &line);
            assert!(
                message.contains(&file) && message.contains("expected"),
                "{message}"
            );
            assert!(!folder.path().join("made/capture.toml").exists());
        }
    }
}
