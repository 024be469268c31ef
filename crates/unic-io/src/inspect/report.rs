//! The result of an inspection.

use crate::finding::Finding;
use serde::{Serialize, Serializer};
use serde_json::Value;
use std::{
    fmt::{self, Display},
    path::{Path, PathBuf},
};
use unic_core::printable::printable;

/// Summary of a file or folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// Path of the file or folder.
    pub path: PathBuf,
    /// Kind of the content.
    pub kind: FileKind,
    /// Facts about the content, in reading order; an object in JSON.
    #[serde(serialize_with = "as_object")]
    pub facts: Vec<Fact>,
    /// Problems of the content, one sentence each.
    pub problems: Vec<String>,
}

/// A fact about the content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// Subject of the fact; the key in JSON.
    pub name: String,
    /// Text for readers.
    pub text: String,
    /// Value for programs, with numbers as numbers.
    pub value: Value,
}

impl Fact {
    /// Makes a fact whose text is its value: a number, a text or a truth value.
    pub fn plain(name: impl Into<String>, value: impl Into<Value>) -> Self {
        let value = value.into();
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Self {
            name: name.into(),
            text,
            value,
        }
    }

    /// Makes a fact with a text for readers and the same content as numbers.
    pub fn measured(name: impl Into<String>, text: impl Into<String>, value: Value) -> Self {
        Self {
            name: name.into(),
            text: text.into(),
            value,
        }
    }
}

/// Kind of a file or folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FileKind {
    /// A folder with `capture.toml`.
    Capture,
    /// An npz with vertices, joints and weights, or a file with a skinned mesh.
    Character,
    /// An npz with poses, a BVH file, or a file with an animation of joints and no skinned mesh.
    Motion,
    /// Clips for motion matching.
    MotionDatabase,
    /// An npz with weights or attributes of garment vertices.
    Garment,
    /// An npz with positions over time, or a file with a mesh whose points change and no rig.
    VertexAnimation,
    /// Any other npz.
    Npz,
    /// One numpy array.
    Npy,
    /// An OBJ file.
    Mesh,
    /// A folder of OBJ files.
    MeshSequence,
    /// A PC2 or MDD file.
    PointCache,
    /// An Alembic file.
    Alembic,
    /// Any other folder.
    Folder,
    /// A safetensors file, such as a trained model.
    Model,
    /// A file of no known kind.
    Unknown,
}

impl Inspection {
    /// Makes an empty summary.
    pub(crate) fn new(path: &Path, kind: FileKind) -> Self {
        Self {
            path: path.to_path_buf(),
            kind,
            facts: Vec::new(),
            problems: Vec::new(),
        }
    }

    /// Adds a fact whose text is its value.
    pub(crate) fn fact(&mut self, name: impl Into<String>, value: impl Into<Value>) {
        self.facts.push(Fact::plain(name, value));
    }

    /// Adds a fact with a text for readers and a value for programs.
    pub(crate) fn measured(&mut self, name: impl Into<String>, text: impl Into<String>, value: Value) {
        self.facts.push(Fact::measured(name, text, value));
    }

    /// Adds probable mistakes as problems.
    pub(crate) fn findings(&mut self, findings: impl IntoIterator<Item = Finding>) {
        findings.into_iter().for_each(|finding| self.problem(finding));
    }

    /// Adds a problem.
    pub(crate) fn problem(&mut self, sentence: impl Display) {
        self.problems.push(sentence.to_string());
    }

    /// Returns the value of a result; an error becomes a problem.
    pub(crate) fn ok_or_problem<T, E: Display>(&mut self, result: std::result::Result<T, E>) -> Option<T> {
        result.map_err(|e| self.problem(e)).ok()
    }

    /// Returns the text of the first fact of a name.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.facts
            .iter()
            .find(|fact| fact.name == name)
            .map(|fact| fact.text.as_str())
    }
}

fn as_object<S: Serializer>(facts: &[Fact], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    // A list in memory keeps the reading order; in JSON, names are keys.
    serializer.collect_map(facts.iter().map(|fact| (&fact.name, &fact.value)))
}

impl Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FileKind::Capture => "capture",
            FileKind::Character => "character",
            FileKind::Motion => "motion",
            FileKind::MotionDatabase => "motion database",
            FileKind::Garment => "garment arrays",
            FileKind::VertexAnimation => "vertex animation",
            FileKind::Npz => "npz archive",
            FileKind::Npy => "numpy array",
            FileKind::Mesh => "OBJ mesh",
            FileKind::MeshSequence => "OBJ sequence",
            FileKind::PointCache => "point cache",
            FileKind::Alembic => "Alembic file",
            FileKind::Folder => "folder",
            FileKind::Model => "model",
            FileKind::Unknown => "unknown",
        })
    }
}

impl Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.path.display(), self.kind)?;
        let width = self
            .facts
            .iter()
            // Columns are aligned by characters: names of arrays come from files and may be of any
            // script.
            .map(|fact| fact.name.chars().count())
            .max()
            .unwrap_or(0);
        for Fact { name, text, .. } in &self.facts {
            // Names and texts come from files: control characters are escaped.
            writeln!(f, "  {:width$}  {}", printable(name).to_string(), printable(text))?;
        }
        match self.problems.as_slice() {
            [] => writeln!(f, "no problems found"),
            problems => problems
                .iter()
                .try_for_each(|p| writeln!(f, "problem: {}", printable(p))),
        }
    }
}
