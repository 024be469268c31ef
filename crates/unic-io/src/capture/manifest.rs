//! `capture.toml`.

use crate::{
    atomic,
    error::{Error, Result},
    motion::check_frame_rate,
    retarget::feet_by_name,
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, path::Path};
use unic_core::skeleton::{SMPL_JOINT_NAMES, Skeleton};

/// L ankle, L foot, R ankle, R foot among [`SMPL_JOINT_NAMES`].
const SMPL_CONTACTS: [usize; 4] = [7, 10, 8, 11];

/// The version that this crate reads and writes.
pub const CAPTURE_VERSION: u32 = 1;

/// What `capture.toml` says; keys that it does not know are errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the layout; 1 where missing.
    #[serde(default = "first_version")]
    pub version: u32,
    /// Name of the capture.
    pub name: String,
    /// Frames per second of every clip.
    pub fps: f32,
    /// Source and licence of each part.
    #[serde(default)]
    pub provenance: String,
    /// One a joint; empty takes the character's own names, or SMPL's for 24 joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_names: Vec<String>,
    /// Joints that touch the ground: L ankle, L foot, R ankle, R foot. Where missing, those that are named so, as
    /// SMPL, Mixamo, Unreal and others name them; 24 joints without names have SMPL's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_joints: Option<[JointReference; 4]>,
    /// Always Y: importers convert.
    #[serde(default)]
    pub up: Up,
    /// Always metres: importers convert.
    #[serde(default)]
    pub units: Units,
    /// What the capture was converted from.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub source: toml::Table,
    /// Which clips are for what.
    #[serde(default)]
    pub splits: Splits,
}

/// A joint by its index or by its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum JointReference {
    /// Index from 0 on.
    Index(usize),
    /// One of the joint names.
    Name(String),
}

/// The up axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// +Y.
    #[default]
    Y,
}

/// The unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Metres.
    #[default]
    Metres,
}

/// Names of clips by purpose; no clip serves two.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Splits {
    /// Seen in training.
    #[serde(default)]
    pub train: Vec<String>,
    /// For choices made during training.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<String>,
    /// Opened by evaluation alone.
    #[serde(default)]
    pub test: Vec<String>,
}

/// Purpose of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Seen in training.
    Train,
    /// For choices made during training.
    Validation,
    /// Opened by evaluation alone.
    Test,
}

impl Split {
    /// All of them.
    pub const ALL: [Split; 3] = [Split::Train, Split::Validation, Split::Test];

    /// The key in `capture.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Validation => "validation",
            Split::Test => "test",
        }
    }
}

impl Splits {
    /// Names of one split, in the order of the file.
    pub fn of(&self, split: Split) -> &[String] {
        match split {
            Split::Train => &self.train,
            Split::Validation => &self.validation,
            Split::Test => &self.test,
        }
    }

    /// The list of one split.
    pub fn of_mut(&mut self, split: Split) -> &mut Vec<String> {
        match split {
            Split::Train => &mut self.train,
            Split::Validation => &mut self.validation,
            Split::Test => &mut self.test,
        }
    }

    /// (clip, split) of every clip.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Split)> {
        Split::ALL
            .into_iter()
            .flat_map(|split| self.of(split).iter().map(move |name| (name.as_str(), split)))
    }

    /// The split of a clip.
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
    /// A manifest with the defaults that a missing key takes.
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
    /// No such file, unknown keys, another version, a frame rate outside 1 to 1000, names that are
    /// no file names, clips in two splits.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path, "open"))?;
        let manifest: Self = toml::from_str(&text).map_err(|e| toml_error(path, &text, &e))?;
        manifest.check(path)?;
        Ok(manifest)
    }

    /// Writes it, atomically.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        self.check(path)?;
        let text = toml::to_string(self)
            .map_err(|e| Error::content(path, "a table that TOML can hold", e.to_string()))?;
        atomic::write(path, text.as_bytes())
    }

    fn check(&self, path: &Path) -> Result<()> {
        if self.version != CAPTURE_VERSION {
            let expected = format!("version {CAPTURE_VERSION} of the capture layout");
            return Err(Error::content(
                path,
                expected,
                format!("version {}", self.version),
            ));
        }
        check_frame_rate(f64::from(self.fps))
            .map_err(|found| Error::content(path, "fps from 1 to 1000", found))?;
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

    /// The contact joints as indices: L ankle, L foot, R ankle, R foot.
    pub(crate) fn contacts(&self, path: &Path, skeleton: &Skeleton) -> Result<[usize; 4]> {
        let references = match &self.contact_joints {
            Some(references) => references.clone(),
            None => match feet_by_name(skeleton.names()) {
                Some(feet) => return Ok(feet),
                // Of an error, then.
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

/// In one line, with the number of the line that it is about.
fn toml_error(path: &Path, text: &str, error: &toml::de::Error) -> Error {
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

/// A clip's name becomes part of a path: it must not lead out of the folder.
pub(crate) fn check_clip_name(path: &Path, name: &str) -> Result<()> {
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
    fn a_full_manifest_comes_back() {
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
    fn what_is_wrong_is_said_in_one_line() {
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
