//! Contract: programs in C and C++ compile against the header without a warning, link the shared and
//! the static library, and get the bits of the Rust animator; valgrind finds no fault; the example
//! of docs/engines.md is such a program. The component of docs/engines/unreal.md compiles.
//!
//! Skipped, with a line that says so, where `cc`, `c++` or `valgrind` are missing.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]
#![cfg(target_os = "linux")]

mod common;

use common::*;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};
use unic_core::Pose;

const C: [&str; 5] = ["cc", "-std=c11", "-Wall", "-Wextra", "-Werror"];
const CPP: [&str; 5] = ["c++", "-std=c++17", "-Wall", "-Wextra", "-Werror"];

/// Libraries that a Rust static library asks for.
const SYSTEM: [&str; 5] = ["-pthread", "-ldl", "-lm", "-lrt", "-lutil"];

enum Link {
    Shared,
    Static,
}

/// Folder of libunic.so and libunic.a: cargo builds them beside the tests.
fn library_folder() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().unwrap().to_owned();
    for name in ["libunic.so", "libunic.a"] {
        assert!(folder.join(name).exists(), "no {name} in {}", folder.display());
    }
    folder
}

fn is_installed(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok();
    if !found {
        println!("skipped: {program} is not installed");
    }
    found
}

#[track_caller]
fn succeeds(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{text}", output.status);
    output
}

/// Compiles a program; none if there is no compiler.
fn compile(compiler: [&str; 5], source: &Path, link: Link, folder: &Path) -> Option<PathBuf> {
    if !is_installed(compiler[0]) {
        return None;
    }
    let (libraries, program) = (library_folder(), folder.join("program"));
    let mut command = Command::new(compiler[0]);
    command
        .args(&compiler[1..])
        .args(["-pedantic", "-g", "-O1", "-o"]);
    command.arg(&program).arg(source);
    command
        .arg("-I")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"));
    match link {
        Link::Shared => {
            let path = libraries.to_str().unwrap();
            command
                .arg("-L")
                .arg(path)
                .arg("-lunic")
                .arg(format!("-Wl,-rpath,{path}"));
        }
        Link::Static => {
            command.arg(libraries.join("libunic.a"));
        }
    }
    succeeds(command.args(SYSTEM));
    Some(program)
}

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c").join(name)
}

/// Bytes of a motion for check.c.
fn motion_bytes(poses: &[Pose]) -> Vec<u8> {
    let joints = poses[0].local.len();
    let mut bytes: Vec<u8> = [poses.len() as u32, joints as u32]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    for pose in poses {
        let rotations = pose.local.iter().flat_map(|q| q.to_array());
        let numbers = pose.trans.to_array().into_iter().chain(rotations);
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
    }
    bytes
}

/// Runs check.c, below the words of `before`, and compares what it wrote.
fn check_c(link: Link, before: &[&str], frames: usize) {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = compile(C, &source("check.c"), link, folder.path()) else {
        return;
    };
    let model = core_model();
    let poses = motion(&model, frames);
    let (given, found) = (folder.path().join("poses"), folder.path().join("out"));
    fs::write(&given, motion_bytes(&poses)).unwrap();
    let words = before.iter().map(Path::new).chain([program.as_path()]);
    let words: Vec<&Path> = words.collect();
    let mut command = Command::new(words[0]);
    command
        .args(&words[1..])
        .arg(garment_path())
        .args([&given, &found]);
    succeeds(&mut command);
    // valgrind's processor has other instructions, and so other bits.
    if before.is_empty() {
        let frames = core_frames(&model, &poses);
        let again = &frames[poses.len() / 2 + 1..];
        let rows = frames
            .iter()
            .chain(again)
            .flat_map(|[positions, normals]| positions.iter().zip(normals));
        let numbers = rows.flat_map(|(p, n)| p.iter().chain(n).copied());
        let expected: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        assert!(
            fs::read(&found).unwrap() == expected,
            "other bits than those of the Rust animator"
        );
    }
}

#[test]
fn a_c_program_gets_the_bits_of_the_rust_animator() {
    check_c(Link::Shared, &[], 8);
    check_c(Link::Static, &[], 3);
}

#[test]
fn valgrind_finds_no_fault() {
    if is_installed("valgrind") {
        // Threads of a pool live as long as the process, so their memory is possibly lost at its
        // end. In a build with other crates, which turn the feature `rayon` of unic-core on, it has one.
        let leaks = "--errors-for-leak-kinds=definite";
        let valgrind = ["valgrind", "--error-exitcode=9", "--leak-check=full", leaks, "-q"];
        check_c(Link::Shared, &valgrind, 4);
    }
}

#[test]
fn a_cpp_program_gets_the_same_bytes_in_all_threads() {
    let folder = tempfile::tempdir().unwrap();
    if let Some(program) = compile(CPP, &source("check.cpp"), Link::Shared, folder.path()) {
        assert_eq!(
            succeeds(Command::new(program).arg(garment_path())).stdout,
            b"ok\n"
        );
    }
}

/// The C program of the page, as its readers copy it.
#[test]
fn the_example_of_the_documentation_compiles_and_runs() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/engines.md");
    let text = fs::read_to_string(page).unwrap();
    let example = text
        .split("```c\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .unwrap();
    assert!(example.lines().count() <= 45, "{} lines", example.lines().count());
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/c/example.c");
    let file = fs::read_to_string(&path).unwrap();
    assert!(file == example, "{} differs from the page", path.display());
    if let Some(program) = compile(C, &path, Link::Shared, folder.path()) {
        let output = succeeds(Command::new(program).arg(garment_path()));
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains("3788 vertices"), "{text}");
    }
}

/// The component of the page about Unreal, whose types are stubs here.
#[test]
fn the_component_for_unreal_compiles_against_stubs() {
    if !is_installed(CPP[0]) {
        return;
    }
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = crate_folder.join("../../docs/engines/unreal.md");
    let text = fs::read_to_string(page).unwrap();
    let blocks: Vec<&str> = (text.split("```cpp\n").skip(1))
        .map(|rest| rest.split("```").next().unwrap())
        .collect();
    let [component] = blocks[..] else {
        panic!("{} blocks of code", blocks.len());
    };
    assert!(component.lines().all(|line| line.len() <= 110), "a long line");
    let without_comments = component
        .lines()
        .map(|line| line.split("//").next().unwrap().trim());
    let code: Vec<&str> = without_comments.filter(|line| !line.is_empty()).collect();
    let count = |part: &str| code.iter().map(|line| line.matches(part).count()).sum::<usize>();
    // The head of a loop has two semicolons, the end of the class one.
    let size = format!(
        "{} statements, {} lines",
        count(";") - 2 * count("for (") - 1,
        code.len()
    );
    assert!(text.contains(&size), "expected {size}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("component.cpp");
    let includes = "#include \"unic.h\"\n#include \"unreal_stubs.h\"\n";
    fs::write(&path, [includes, component].concat()).unwrap();
    let mut command = Command::new(CPP[0]);
    command.args(["-std=c++20", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]);
    // Fields that a designated initialiser does not name are zero.
    command.arg("-Wno-missing-field-initializers");
    command.arg("-I").arg(crate_folder.join("include"));
    command.arg("-I").arg(crate_folder.join("tests/c"));
    succeeds(command.arg(&path));
}
