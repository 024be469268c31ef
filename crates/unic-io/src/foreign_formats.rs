//! File formats that most readers do not read, recognised so that errors can name them.

use crate::error::{Error, Result};
use std::{fs::File, io::Read, path::Path};

/// Format that some readers read. All others refuse it, with a message that names its use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PartlyReadFormat {
    /// Animated meshes.
    Alembic,
    /// Skinned characters and their motion.
    Fbx,
    /// Skinned characters and their motion.
    Gltf,
    /// Vertex animation.
    Mdd,
    /// Body models of SMPL; sequences of data sets.
    Pickle,
    /// Skinned characters and their motion, animated meshes.
    Usd,
}

impl PartlyReadFormat {
    /// Use that the program makes of the format, as the end of a sentence.
    fn use_of_it(self) -> &'static str {
        match self {
            Self::Alembic => "as the animation of a garment by `unic import`",
            Self::Fbx | Self::Gltf => "as a character or its motion",
            Self::Mdd => "as a vertex animation",
            Self::Pickle => {
                "as a body model of SMPL, or as a sequence of a data set by `unic eval --protocol`"
            }
            Self::Usd => "as a character, its motion, or the animation of a garment by `unic import`",
        }
    }
}

/// A format that is recognised and not read, or not by all readers.
struct ForeignFormat {
    name: &'static str,
    /// Readers of the format, if there are any.
    reader: Option<PartlyReadFormat>,
    /// First bytes of its files. Empty for formats that only the file name extension identifies.
    signatures: &'static [&'static [u8]],
    /// File name extensions in lower case, without the dot.
    extensions: &'static [&'static str],
}

/// Advice that every error about a foreign format ends with.
const ADVICE: &str = "export motion as BVH, GLB or FBX, characters as GLB or FBX, meshes as OBJ, and vertex animation as PC2 or a \
     folder of OBJ files";

// Signatures come from the formats' specifications. A format without one, such as a zip container
// or a text format, is recognised by its extension only.
static FOREIGN_FORMATS: [ForeignFormat; 12] = [
    ForeignFormat {
        name: "FBX",
        reader: Some(PartlyReadFormat::Fbx),
        signatures: &[b"Kaydara FBX", b"; FBX"],
        extensions: &["fbx"],
    },
    ForeignFormat {
        name: "Alembic",
        reader: Some(PartlyReadFormat::Alembic),
        signatures: &[b"Ogawa"],
        extensions: &["abc"],
    },
    ForeignFormat {
        name: "USD",
        reader: Some(PartlyReadFormat::Usd),
        signatures: &[b"PXR-USDC", b"#usda"],
        extensions: &["usd", "usda", "usdc", "usdz"],
    },
    ForeignFormat {
        name: "glTF",
        reader: Some(PartlyReadFormat::Gltf),
        signatures: &[b"glTF"],
        extensions: &["glb", "gltf"],
    },
    ForeignFormat {
        name: "Blender",
        reader: None,
        signatures: &[b"BLENDER"],
        extensions: &["blend"],
    },
    ForeignFormat {
        name: "Maya",
        reader: None,
        signatures: &[b"//Maya"],
        extensions: &["ma", "mb"],
    },
    ForeignFormat {
        name: "COLLADA",
        reader: None,
        signatures: &[],
        extensions: &["dae"],
    },
    ForeignFormat {
        name: "PLY",
        reader: None,
        signatures: &[b"ply\n", b"ply\r"],
        extensions: &["ply"],
    },
    ForeignFormat {
        name: "STL",
        reader: None,
        signatures: &[],
        extensions: &["stl"],
    },
    ForeignFormat {
        name: "C3D",
        reader: None,
        signatures: &[],
        extensions: &["c3d"],
    },
    ForeignFormat {
        name: "MDD",
        reader: Some(PartlyReadFormat::Mdd),
        signatures: &[],
        extensions: &["mdd"],
    },
    ForeignFormat {
        name: "Python pickle",
        reader: Some(PartlyReadFormat::Pickle),
        signatures: &[],
        extensions: &["pkl"],
    },
];

/// Bytes read from the start of a file; no signature is longer.
const SIGNATURE_BYTES: u64 = 16;

/// Finds the format of a file by its first bytes or its extension.
///
/// Missing and unreadable files have none: their error is reported by whoever reads them.
fn foreign_format(path: &Path) -> Option<&'static ForeignFormat> {
    let mut start = Vec::new();
    let file = File::open(path).ok()?;
    file.take(SIGNATURE_BYTES).read_to_end(&mut start).ok()?;
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let begins = |format: &&ForeignFormat| format.signatures.iter().any(|s| start.starts_with(s));
    let ends = |format: &&ForeignFormat| format.extensions.contains(&extension.as_str());
    // The content decides before the name: files are often renamed.
    let formats = || FOREIGN_FORMATS.iter();
    formats().find(begins).or_else(|| formats().find(ends))
}

/// Refuses a file of a foreign format with an error that names the format and gives advice.
///
/// Readers of a format that others refuse ask for it first.
///
/// # Errors
/// A file of a format that is recognised here. All other files pass, missing ones too.
pub fn refuse_foreign(path: &Path, expected: &str) -> Result<()> {
    let Some(format) = foreign_format(path) else {
        return Ok(());
    };
    let name = format.name;
    let found = match format.reader {
        Some(reader) => format!("{name}, which is read {}: {ADVICE}", reader.use_of_it()),
        None => format!("{name}, which is not read: {ADVICE}"),
    };
    Err(Error::content(path, expected, found))
}

/// Returns whether a file is of a format that is recognised and that no reader reads.
pub(crate) fn is_foreign(path: &Path) -> bool {
    foreign_format(path).is_some_and(|format| format.reader.is_none())
}

/// Returns the format of a file if some readers read it.
pub(crate) fn partly_read(path: &Path) -> Option<PartlyReadFormat> {
    foreign_format(path)?.reader
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
            let found = foreign_format(&path).map(|format| format.name);
            assert_eq!(found, expected, "{name}");
            let message =
                refuse_foreign(&path, "a motion").map_or_else(|e| e.to_string(), |()| String::new());
            assert_eq!(
                message.contains("export motion as BVH"),
                expected.is_some(),
                "{message}"
            );
        }
        assert!(foreign_format(&folder.path().join("nothing.xyz")).is_none());
    }
}
