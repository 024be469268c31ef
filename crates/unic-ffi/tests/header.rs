//! Contract: `include/unic.h` is what cbindgen makes of the sources.
//!
//! ```sh
//! UNIC_WRITE_HEADER=1 cargo test --release -p unic-ffi --test header
//! ```
//!
//! writes it anew.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use cbindgen::{Builder, Config, EnumConfig, ExportConfig, Language, RenameRule, Style};
use std::{fs, path::Path};

/// Sources in the order of the header.
const SOURCES: [&str; 13] = [
    "version", "status", "error", "model", "options", "job", "mesh", "pose", "instance", "collider", "step",
    "queries", "state",
];

const ENUMERATIONS: [&str; 10] = [
    "UnicFeature",
    "UnicPrecision",
    "UnicIntersection",
    "UnicAxes",
    "UnicVertexLayout",
    "UnicThreads",
    "UnicMesh",
    "UnicRoot",
    "UnicRotations",
    "UnicShape",
];

const PREAMBLE: &str = "\
/* unic: neural garments, the C interface. Made by cbindgen; do not edit.
 *
 * Functions return a UnicStatus; unic_last_error() has the sentence for the last error of the
 * calling thread. A call that fails changes nothing; unic_instance_save alone writes the size that a
 * buffer must have. Models may be used by all threads, an instance by one thread at a time. Positions
 * are in the axes and the unit of the instance's options.
 *
 * The library checks what it can see: null, alignment, counts, strides, numbers. The caller promises
 * that memory is as large as stated and that nobody else changes it during a call.
 */";

fn header() -> String {
    let config = Config {
        language: Language::C,
        cpp_compat: true,
        include_guard: Some("UNIC_H".to_owned()),
        header: Some(PREAMBLE.to_owned()),
        style: Style::Both,
        usize_is_size_t: true,
        documentation: true,
        // Enumerations of the values that structs hold as numbers: no function names them.
        export: ExportConfig {
            include: ENUMERATIONS.map(str::to_owned).to_vec(),
            ..ExportConfig::default()
        },
        enumeration: EnumConfig {
            rename_variants: RenameRule::QualifiedScreamingSnakeCase,
            ..EnumConfig::default()
        },
        sys_includes: ["stddef.h", "stdint.h"].map(str::to_owned).to_vec(),
        no_includes: true,
        line_length: 100,
        ..Config::default()
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let builder = SOURCES
        .iter()
        .fold(Builder::new().with_config(config), |builder, name| {
            builder.with_src(folder.join(name).with_extension("rs"))
        });
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    String::from_utf8(text).unwrap()
}

#[test]
fn the_header_is_that_of_the_sources() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/unic.h");
    let made = header();
    if std::env::var_os("UNIC_WRITE_HEADER").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == made,
        "{} differs from the sources; write it anew with UNIC_WRITE_HEADER=1",
        path.display()
    );
}

/// A function that the header lacks cannot be called from C.
#[test]
fn the_header_has_all_functions() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let header = header();
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let source = fs::read_to_string(entry.unwrap().path()).unwrap();
        for (_, after) in source
            .match_indices("extern \"C\" fn unic_")
            .map(|(at, m)| (at, &source[at + m.len()..]))
        {
            let name = after.split('(').next().unwrap();
            assert!(header.contains(&format!("unic_{name}(")), "unic_{name}");
            count += 1;
        }
    }
    assert!(count > 20, "{count}");
}
