//! Contract: whatever a file does to the library that reads it, the program gets a scene that is valid
//! or one sentence, in bounded time.
//!
//! This program is its own child: it has no test harness, whose words would be part of the answer.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use glam::Vec3;
use openusd::{usda, usdc::CrateWriter, usdz::ArchiveWriter};
use std::{
    env, fs,
    io::{Cursor, Write},
    path::{Path, PathBuf},
    process::Command,
    sync::Mutex,
    thread,
    time::{Duration, Instant},
};
use unic_mutation::{Container, Effort, FuzzTarget, fuzz_with, scratch_folder};
use unic_scene::{Content, Fault, Format, Mesh, Request, Scene, Shape, guard, read};
use unic_testdata::rod::{ROD_USDA, fbx_binary, rod_fbx, rod_garment_usda};

/// Time that a child has.
const TIME: Duration = Duration::from_millis(700);

/// Deed of the next child.
static DEED: Mutex<&str> = Mutex::new("serve");

fn main() {
    if let Some(deed) = env::args()
        .nth(1)
        .and_then(|word| word.strip_prefix("--child=").map(str::to_owned))
    {
        std::process::exit(child(&deed).into());
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rod.usdc");
    fs::write(&path, binary(ROD_USDA)).unwrap();
    let here = read(&path, Format::Usd, &request(Content::Skinned)).unwrap();
    let program = env::current_exe().unwrap();
    guard::use_child_within(TIME, move || {
        let mut command = Command::new(&program);
        command.arg(format!("--child={}", DEED.lock().unwrap()));
        command
    });
    let there = read(&path, Format::Usd, &request(Content::Skinned)).unwrap();
    assert_eq!(here, there, "a child reads what this process reads");
    misdeeds(&path);
    damaged_files();
    println!("test result: ok");
}

/// Acts as a child.
fn child(deed: &str) -> u8 {
    let answer = |bytes: &[u8]| std::io::stdout().write_all(bytes).unwrap();
    match deed {
        "abort" => std::process::abort(),
        "sleep" => thread::sleep(Duration::from_secs(100)),
        "garbage" => answer(&[0xff; 1000]),
        "silence" => {}
        "tail" => {
            guard::serve();
            answer(b"tail");
        }
        // As damaged memory would: a face beyond the vertices.
        "lie" => answer(&postcard::to_stdvec(&Ok::<Scene, Fault>(impossible())).unwrap()),
        "memory" => {
            // Serves a job, which sets the limit, then asks for more. An answer with a tail is refused.
            let code = guard::serve();
            if Vec::<u8>::new().try_reserve_exact(6 << 30).is_ok() {
                answer(b"tail");
            }
            return code;
        }
        _ => return guard::serve(),
    }
    0
}

fn impossible() -> Scene {
    let shape = Shape {
        points: vec![Vec3::ZERO; 3],
        faces: vec![[0, 1, 3]],
        weights: Vec::new(),
    };
    Scene {
        meshes: vec![Mesh {
            name: "lie".into(),
            vertices: 3,
            triangles: 1,
            samples: 0,
            skin: None,
            shape: Some(shape),
            points: None,
        }],
        ..Scene::default()
    }
}

fn request(content: Content) -> Request {
    Request {
        content,
        ..Request::default()
    }
}

fn misdeeds(path: &Path) {
    for (deed, words) in [
        ("abort", "its reader ended"),
        ("sleep", "not read within"),
        ("garbage", "its reader ended"),
        ("silence", "its reader ended"),
        ("tail", "its reader ended"),
        (
            "lie",
            "faces of vertices below 3 in the mesh lie, found [0, 1, 3]",
        ),
    ] {
        *DEED.lock().unwrap() = deed;
        let start = Instant::now();
        let sentence = read(path, Format::Usd, &request(Content::Skinned))
            .unwrap_err()
            .to_string();
        assert!(sentence.contains(words), "{deed}: {sentence}");
        assert!(start.elapsed() < 10 * TIME, "{deed}: {:?}", start.elapsed());
        println!("{deed}: {sentence}");
    }
    if cfg!(unix) {
        *DEED.lock().unwrap() = "memory";
        assert!(read(path, Format::Usd, &request(Content::Skinned)).is_ok());
    }
    *DEED.lock().unwrap() = "serve";
}

/// Writes a USD file of text as a binary one.
fn binary(text: &str) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    CrateWriter::write(&usda::parse(text).unwrap(), &mut bytes).unwrap();
    bytes.into_inner()
}

fn archive(text: &str) -> Vec<u8> {
    let mut archive = ArchiveWriter::new(Cursor::new(Vec::new()));
    archive.add_layer("rod.usdc", &binary(text)).unwrap();
    archive.finish().unwrap().into_inner()
}

/// Damages a file of each format. Text has this test in `unic-io`.
fn damaged_files() {
    let cloth = rod_garment_usda(
        "metersPerUnit = 0.01\n upAxis = \"Z\"\n timeCodesPerSecond = 24",
        4,
    );
    let files = [
        ("rod.usdc", binary(ROD_USDA), Container::Plain, Content::Skinned),
        ("walk.usdc", binary(ROD_USDA), Container::Plain, Content::Motion),
        ("cloth.usdc", binary(&cloth), Container::Plain, Content::Points(0)),
        ("rod.usdz", archive(ROD_USDA), Container::Zip, Content::Skinned),
        (
            "rod.fbx",
            fbx_binary(&rod_fbx()),
            Container::Plain,
            Content::Skinned,
        ),
    ];
    thread::scope(|scope| {
        for (name, bytes, container, content) in files {
            scope.spawn(move || damage(name, &bytes, container, content));
        }
    });
}

fn damage(name: &str, bytes: &[u8], container: Container, content: Content) {
    let path: PathBuf = scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), name).join(name);
    fs::write(&path, bytes).unwrap();
    let target = FuzzTarget {
        name,
        path: &path,
        container,
    };
    let effort = Effort {
        cuts: 60,
        time: Duration::from_millis(500),
    };
    let format = match name.ends_with("fbx") {
        true => Format::Fbx,
        false => Format::Usd,
    };
    let tally = fuzz_with(&target, effort, |path| {
        // Whoever prints a fault escapes words of the file.
        let sentence = |fault: Fault| fault.to_string().replace(|c: char| c.is_control(), " ");
        read(path, format, &request(content)).map(drop).map_err(sentence)
    });
    assert!(tally.refused > 20, "{name}: {tally}");
}
