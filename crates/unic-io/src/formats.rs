//! Files and folders of others: what they are, and the way that works.

use crate::{
    capture::UNFINISHED,
    error::{Error, Result},
};
use std::{fs::File, io::Read, path::Path};

/// A format that is known and not read.
struct Foreign {
    name: &'static str,
    /// How its files begin; nothing where only their ending tells.
    starts: &'static [&'static [u8]],
    /// In lower case.
    endings: &'static [&'static str],
}

const SCENES: &str =
    "export motion as BVH, meshes as OBJ, and vertex animation as PC2 or a folder of OBJ files";

const FOREIGN: [Foreign; 12] = [
    Foreign {
        name: "FBX",
        starts: &[b"Kaydara FBX", b"; FBX"],
        endings: &["fbx"],
    },
    Foreign {
        name: "Alembic",
        starts: &[b"Ogawa"],
        endings: &["abc"],
    },
    Foreign {
        name: "USD",
        starts: &[b"PXR-USDC", b"#usda"],
        endings: &["usd", "usda", "usdc", "usdz"],
    },
    Foreign {
        name: "glTF",
        starts: &[b"glTF"],
        endings: &["glb", "gltf"],
    },
    Foreign {
        name: "Blender",
        starts: &[b"BLENDER"],
        endings: &["blend"],
    },
    Foreign {
        name: "Maya",
        starts: &[b"//Maya"],
        endings: &["ma", "mb"],
    },
    Foreign {
        name: "COLLADA",
        starts: &[],
        endings: &["dae"],
    },
    Foreign {
        name: "PLY",
        starts: &[b"ply\n", b"ply\r"],
        endings: &["ply"],
    },
    Foreign {
        name: "STL",
        starts: &[],
        endings: &["stl"],
    },
    Foreign {
        name: "C3D",
        starts: &[],
        endings: &["c3d"],
    },
    Foreign {
        name: "MDD",
        starts: &[],
        endings: &["mdd"],
    },
    Foreign {
        name: "Python pickle",
        starts: &[],
        endings: &["pkl"],
    },
];

/// Bytes that tell a format.
const START: u64 = 16;

/// The name of a format that is not read yet, by a file's first bytes or its ending.
fn foreign(path: &Path) -> Option<&'static str> {
    let mut start = Vec::new();
    File::open(path).ok()?.take(START).read_to_end(&mut start).ok()?;
    let ending = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let is = |format: &&Foreign| {
        format.starts.iter().any(|s| start.starts_with(s)) || format.endings.contains(&ending.as_str())
    };
    FOREIGN.iter().find(is).map(|format| format.name)
}

/// Names the format of a file that is not read yet, with the way that works.
///
/// # Errors
/// Such a file. All others pass, missing ones too.
pub fn refuse_foreign(path: &Path, expected: &str) -> Result<()> {
    match foreign(path) {
        None => Ok(()),
        Some(name) => Err(Error::content(
            path,
            expected,
            format!("{name}, which is not read: {SCENES}"),
        )),
    }
}

/// Whether a file is of a format that is known and not read.
pub(crate) fn is_foreign(path: &Path) -> bool {
    foreign(path).is_some()
}

/// Description of a folder that `unic simulate --character` takes.
pub(crate) const CHARACTER: &str = "a folder with a character, for `unic simulate --character`";
/// Description of a folder that `unic simulate --garment` takes.
pub(crate) const GARMENT: &str = "a folder with a garment, for `unic simulate --garment`";
/// Description of a folder that is nothing of the project's.
pub(crate) const NOTHING_KNOWN: &str = "a folder without capture.toml";

/// Description of a folder that is no capture, as far as its files tell, with the way on.
pub(crate) fn folder_that_is_no_capture(folder: &Path) -> &'static str {
    let has = |name: &str| folder.join(name).exists();
    if has(UNFINISHED) {
        "a simulation that is not finished: the same `unic simulate` with --resume goes on"
    } else if has("clips") && (has("character.npz") || has("garment.obj")) {
        "a capture without its capture.toml: write one, as docs/capture.md describes"
    } else if has("config.toml") && has("checkpoints") {
        "the run folder of a training: its model lies beside it"
    } else if has("demo.toml") {
        "the folder of a demo: its capture is in capture/ below it"
    } else if has("character.npz") {
        CHARACTER
    } else if has("garment.obj") {
        GARMENT
    } else if !folder.exists() {
        "no such folder"
    } else if folder.is_file() {
        "a file"
    } else {
        NOTHING_KNOWN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_bytes_or_ending() {
        let folder = tempfile::tempdir().unwrap();
        for (name, start, expected) in [
            ("walk.fbx", &b"Kaydara FBX Binary  "[..], Some("FBX")),
            ("walk.npz", b"Ogawa\xff\x00", Some("Alembic")),
            ("scene.usdz", b"PK\x03\x04", Some("USD")),
            ("body", b"glTF\x02\x00", Some("glTF")),
            ("walk.npz", b"PK\x03\x04", None),
            ("walk.bvh", b"HIERARCHY", None),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, start).unwrap();
            assert_eq!(foreign(&path), expected, "{name}");
            let told = refuse_foreign(&path, "a motion").map_or_else(|e| e.to_string(), |()| String::new());
            assert_eq!(
                told.contains("export motion as BVH"),
                expected.is_some(),
                "{told}"
            );
        }
        assert_eq!(foreign(&folder.path().join("nothing.xyz")), None);
    }
}
