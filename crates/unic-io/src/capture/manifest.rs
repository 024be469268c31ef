//! The manifest of a capture, `capture.toml`.

use crate::{
    atomic,
    error::{Error, Result},
    frame_rate::check_frame_rate,
    joint_names::feet_by_name,
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, path::Path};
use unic_core::skeleton::{SMPL_JOINT_NAMES, Skeleton};

/// Indices of L ankle, L foot, R ankle and R foot in [`SMPL_JOINT_NAMES`].
const SMPL_CONTACTS: [usize; 4] = [7, 10, 8, 11];

/// Version of the capture layout that this crate reads and writes.
pub const CAPTURE_VERSION: u32 = 1;

/// Content of `capture.toml`. Unknown keys are errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// A misspelt key would otherwise silently take its default.
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the layout; 1 without the key.
    #[serde(default = "first_version")]
    pub version: u32,
    /// Name of the capture.
    pub name: String,
    /// Frames per second of every clip.
    pub fps: f32,
    /// Source and licence of each part.
    #[serde(default)]
    pub provenance: String,
    /// Names of the joints. An empty list takes the character's own names, or SMPL's for 24 joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_names: Vec<String>,
    /// Joints that touch the ground: L ankle, L foot, R ankle, R foot. Without the key they are
    /// found by their names in the conventions of SMPL, Mixamo, Unreal and others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_joints: Option<[JointReference; 4]>,
    /// Up axis, always Y: importers convert.
    #[serde(default)]
    pub up: Up,
    /// Unit of length, always metres: importers convert.
    #[serde(default)]
    pub units: Units,
    /// Description of the source that the capture was converted from.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    // Tables come last: behind a table TOML has no way back to the keys of the top level.
    pub source: toml::Table,
    /// Purpose of each clip.
    #[serde(default)]
    pub splits: Splits,
}

/// A joint by its index or by its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum JointReference {
    /// Index of the joint; the first is 0.
    Index(usize),
    /// Name of the joint.
    Name(String),
}

/// Up axis of a capture. Other values are refused with an error of one line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// The axis +Y.
    #[default]
    Y,
}

/// Unit of length of a capture. Other values are refused with an error of one line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Metres.
    #[default]
    Metres,
}

/// Names of clips by purpose. A clip has one purpose.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Splits {
    /// Training clips, from which the model learns.
    #[serde(default)]
    pub train: Vec<String>,
    /// Validation clips, by which the best checkpoint is chosen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<String>,
    /// Test clips, which only the evaluation reads.
    #[serde(default)]
    pub test: Vec<String>,
}

/// Purpose of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Training: the model learns from the clip.
    Train,
    /// Validation: the clip helps to choose the best checkpoint.
    Validation,
    /// Test: only the evaluation reads the clip.
    Test,
}

impl Split {
    /// All splits, in the order of `capture.toml`.
    pub const ALL: [Split; 3] = [Split::Train, Split::Validation, Split::Test];

    /// Key of the split in `capture.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Validation => "validation",
            Split::Test => "test",
        }
    }
}

impl Splits {
    /// Names of the clips of one split, in the order of the file.
    pub fn of(&self, split: Split) -> &[String] {
        match split {
            Split::Train => &self.train,
            Split::Validation => &self.validation,
            Split::Test => &self.test,
        }
    }

    /// Mutable list of the clips of one split.
    pub fn of_mut(&mut self, split: Split) -> &mut Vec<String> {
        match split {
            Split::Train => &mut self.train,
            Split::Validation => &mut self.validation,
            Split::Test => &mut self.test,
        }
    }

    /// Iterates over the name and the split of every clip.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Split)> {
        Split::ALL
            .into_iter()
            .flat_map(|split| self.of(split).iter().map(move |name| (name.as_str(), split)))
    }

    /// Returns the split of a clip.
    pub fn split_of(&self, clip: &str) -> Option<Split> {
        self.iter()
            .find(|(name, _)| *name == clip)
            .map(|(_, split)| split)
    }
}

fn first_version() -> u32 {
    1
}

impl Manifest {
    /// Makes a manifest with the defaults of all other keys.
    pub fn new(name: impl Into<String>, fps: f32) -> Self {
        Self {
            version: CAPTURE_VERSION,
            name: name.into(),
            fps,
            provenance: String::new(),
            joint_names: Vec::new(),
            contact_joints: None,
            up: Up::Y,
            units: Units::Metres,
            source: toml::Table::new(),
            splits: Splits::default(),
        }
    }

    /// Reads and checks a `capture.toml`.
    ///
    /// # Errors
    /// No such file, unknown keys, another version, a frame rate outside 1 to 1000, clip names that
    /// are no file names, clips in two splits.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path, "open"))?;
        let manifest: Self = toml::from_str(&text).map_err(|e| toml_error(path, &text, &e))?;
        manifest.check(path)?;
        Ok(manifest)
    }

    /// Writes the manifest as TOML, atomically.
    ///
    /// # Errors
    /// A manifest that [`Manifest::read`] would refuse; the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        // A manifest that cannot be read again must not be written.
        self.check(path)?;
        let text = toml::to_string(self)
            .map_err(|e| Error::content(path, "a table that TOML can hold", e.to_string()))?;
        atomic::write(path, text.as_bytes())
    }

    fn check(&self, path: &Path) -> Result<()> {
        if self.version != CAPTURE_VERSION {
            // A newer layout may change the meaning of known keys, so that even a partial reading
            // is wrong.
            let expected = format!("version {CAPTURE_VERSION} of the capture layout");
            return Err(Error::content(
                path,
                expected,
                format!("version {}", self.version),
            ));
        }
        check_frame_rate(f64::from(self.fps))
            .map_err(|found| Error::content(path, "fps from 1 to 1000", found))?;
        // A clip in two splits would be tested after it was trained on, and the result would be too
        // good.
        let mut seen = BTreeMap::new();
        for (clip, split) in self.splits.iter() {
            check_clip_name(path, clip)?;
            if let Some(other) = seen.insert(clip, split) {
                let expected = format!("clip `{clip}` once among the splits");
                let found = format!("it in {} and {}", other.name(), split.name());
                return Err(Error::content(path, expected, found));
            }
        }
        Ok(())
    }

    /// Returns the indices of the contact joints: L ankle, L foot, R ankle, R foot.
    ///
    /// # Errors
    /// A joint that the skeleton does not have.
    pub(crate) fn contacts(&self, path: &Path, skeleton: &Skeleton) -> Result<[usize; 4]> {
        let references = match &self.contact_joints {
            Some(references) => references.clone(),
            None => match feet_by_name(skeleton.names()) {
                Some(feet) => return Ok(feet),
                // SMPL's names are not found either; they appear in the error.
                None => SMPL_CONTACTS.map(|j| JointReference::Name(SMPL_JOINT_NAMES[j].into())),
            },
        };
        let mut contacts = [0; 4];
        for (contact, reference) in contacts.iter_mut().zip(&references) {
            *contact = index_of(path, reference, skeleton)?;
        }
        Ok(contacts)
    }
}

/// Converts a TOML error, which has several lines, to one line with the line number.
fn toml_error(path: &Path, text: &str, error: &toml::de::Error) -> Error {
    // The span is a range of bytes; `get` is safe against one inside a character.
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = before.map_or(1, |before| before.matches('\n').count() + 1);
    let message = error.message().lines().collect::<Vec<_>>().join(", ");
    Error::content(path, "a capture manifest", format!("{message} (line {line})"))
}

fn index_of(path: &Path, reference: &JointReference, skeleton: &Skeleton) -> Result<usize> {
    let (index, found) = match reference {
        JointReference::Index(index) => (Some(*index), index.to_string()),
        JointReference::Name(name) => (skeleton.joint(name), format!("`{name}`")),
    };
    index.filter(|&i| i < skeleton.len()).ok_or_else(|| {
        let joints = skeleton.len();
        let expected = format!("contact_joints among the {joints} joints of the character");
        Error::content(path, expected, found)
    })
}

/// Checks that a clip's name is a file name. It becomes part of a path and must not lead out of the
/// folder.
///
/// # Errors
/// An empty name, a leading dot, separators of folders or drives, control characters.
pub(crate) fn check_clip_name(path: &Path, name: &str) -> Result<()> {
    // A colon names a drive or a stream on Windows. A leading dot would make the file a hidden or
    // temporary one.
    let bad = |c: char| matches!(c, '/' | '\\' | ':') || c.is_control();
    if name.is_empty() || name.starts_with('.') || name.contains(bad) {
        let expected = "clip names without folders";
        return Err(Error::content(
            path,
            expected,
            format!("`{}`", name.escape_debug()),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Manifest> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.toml");
        std::fs::write(&path, text).unwrap();
        Manifest::read(&path)
    }

    #[test]
    fn missing_keys_take_their_defaults() {
        let manifest = read("name = \"a\"\nfps = 30.0\n").unwrap();
        assert_eq!(manifest, Manifest::new("a", 30.0));
    }

    #[test]
    fn full_manifest_is_read_back() {
        let mut manifest = Manifest::new("a", 29.97);
        manifest.joint_names = vec!["hip".into(), "knee".into()];
        let knee = || JointReference::Name("knee".into());
        manifest.contact_joints = Some([knee(), JointReference::Index(0), knee(), knee()]);
        manifest.source.insert("path".into(), "a.abc".into());
        manifest.splits.train = vec!["x".into()];
        manifest.splits.validation = vec!["y".into()];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.toml");
        manifest.write(&path).unwrap();
        assert_eq!(Manifest::read(&path).unwrap(), manifest);
    }

    #[test]
    fn errors_are_one_line() {
        for (text, words) in [
            ("fps = 30", "name"),
            ("name = \"a\"\nfps = 30\nfsp = 3", "fsp"),
            ("name = \"a\"\nfps = 0", "1 to 1000"),
            ("name = \"a\"\nfps = nan", "1 to 1000"),
            ("name = \"a\"\nfps = 30\nup = \"z\"", "`z`"),
            ("name = \"a\"\nfps = 30\nunits = \"cm\"", "`cm`"),
            ("name = \"a\"\nfps = 30\nversion = 2", "version 2"),
            (
                "name = \"a\"\nfps = 30\n[splits]\ntrain = [\"b\"]\ntest = [\"b\"]",
                "train and test",
            ),
            ("name = \"a\"\nfps = 30\n[splits]\ntrain = [\"../b\"]", "`../b`"),
            ("name = \"a", "line 1"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(words) && !message.contains('\n'), "{message}");
        }
    }
}
