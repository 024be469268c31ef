//! File formats that are recognised and not read, so that errors can name them.

use crate::error::{Error, Result};
use std::{fs::File, io::Read, path::Path};

/// A format that is recognised and not read.
struct ForeignFormat {
    name: &'static str,
    /// First bytes of its files. Empty for formats that only the file name extension identifies.
    signatures: &'static [&'static [u8]],
    /// File name extensions in lower case, without the dot.
    extensions: &'static [&'static str],
}

/// Advice that every error about a foreign format ends with.
const ADVICE: &str =
    "export motion as BVH, meshes as OBJ, and vertex animation as PC2 or a folder of OBJ files";

// Signatures come from the formats' specifications. A format without one, such as a zip container
// or a text format, is recognised by its extension only.
const FOREIGN_FORMATS: [ForeignFormat; 12] = [
    ForeignFormat {
        name: "FBX",
        signatures: &[b"Kaydara FBX", b"; FBX"],
        extensions: &["fbx"],
    },
    ForeignFormat {
        name: "Alembic",
        signatures: &[b"Ogawa"],
        extensions: &["abc"],
    },
    ForeignFormat {
        name: "USD",
        signatures: &[b"PXR-USDC", b"#usda"],
        extensions: &["usd", "usda", "usdc", "usdz"],
    },
    ForeignFormat {
        // Written by this crate, but not read.
        name: "glTF",
        signatures: &[b"glTF"],
        extensions: &["glb", "gltf"],
    },
    ForeignFormat {
        name: "Blender",
        signatures: &[b"BLENDER"],
        extensions: &["blend"],
    },
    ForeignFormat {
        name: "Maya",
        signatures: &[b"//Maya"],
        extensions: &["ma", "mb"],
    },
    ForeignFormat {
        name: "COLLADA",
        signatures: &[],
        extensions: &["dae"],
    },
    ForeignFormat {
        name: "PLY",
        signatures: &[b"ply\n", b"ply\r"],
        extensions: &["ply"],
    },
    ForeignFormat {
        name: "STL",
        signatures: &[],
        extensions: &["stl"],
    },
    ForeignFormat {
        name: "C3D",
        signatures: &[],
        extensions: &["c3d"],
    },
    ForeignFormat {
        name: "MDD",
        signatures: &[],
        extensions: &["mdd"],
    },
    ForeignFormat {
        name: "Python pickle",
        signatures: &[],
        extensions: &["pkl"],
    },
];

/// Bytes read from the start of a file; no signature is longer.
const SIGNATURE_BYTES: u64 = 16;

/// Returns the name of the foreign format of a file, by its first bytes or its extension.
///
/// Missing and unreadable files have none: their error is reported by whoever reads them.
fn foreign_format(path: &Path) -> Option<&'static str> {
    let mut start = Vec::new();
    let file = File::open(path).ok()?;
    file.take(SIGNATURE_BYTES).read_to_end(&mut start).ok()?;
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let is = |format: &&ForeignFormat| {
        format.signatures.iter().any(|s| start.starts_with(s))
            || format.extensions.contains(&extension.as_str())
    };
    FOREIGN_FORMATS.iter().find(is).map(|format| format.name)
}

/// Refuses a file of a foreign format with an error that names the format and gives advice.
///
/// # Errors
/// A file of a format that is recognised and not read. All other files pass, missing ones too.
pub fn refuse_foreign(path: &Path, expected: &str) -> Result<()> {
    match foreign_format(path) {
        None => Ok(()),
        Some(name) => Err(Error::content(
            path,
            expected,
            format!("{name}, which is not read: {ADVICE}"),
        )),
    }
}

/// Returns whether a file is of a format that is recognised and not read.
pub(crate) fn is_foreign(path: &Path) -> bool {
    foreign_format(path).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_recognised_by_signature_or_extension() {
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
            assert_eq!(foreign_format(&path), expected, "{name}");
            let message =
                refuse_foreign(&path, "a motion").map_or_else(|e| e.to_string(), |()| String::new());
            assert_eq!(
                message.contains("export motion as BVH"),
                expected.is_some(),
                "{message}"
            );
        }
        assert_eq!(foreign_format(&folder.path().join("nothing.xyz")), None);
    }
}
