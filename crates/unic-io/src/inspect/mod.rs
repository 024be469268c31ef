//! What a file holds, and what is wrong with it.

mod arrays;
mod capture;
mod mesh;
mod model;
mod motion;

use crate::{
    atomic::parent_folder,
    cache,
    check::Finding,
    error::{Error, Result},
    formats::{CHARACTER, GARMENT, NOTHING_KNOWN, folder_that_is_no_capture, is_foreign, refuse_foreign},
    motion::is_bvh,
};
use serde::{Serialize, Serializer};
use serde_json::Value;
use std::{
    fmt::{self, Display},
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};
use unic_core::shown::shown;

/// What was found at a path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// The file or folder.
    pub path: PathBuf,
    /// What it is.
    pub kind: Kind,
    /// Facts about the content, in reading order; an object in JSON.
    #[serde(serialize_with = "as_object")]
    pub facts: Vec<Fact>,
    /// One sentence for each thing that is wrong; empty when nothing is.
    pub problems: Vec<String>,
}

/// Something that a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// The subject.
    pub name: String,
    /// For people.
    pub text: String,
    /// For programs: numbers as numbers.
    pub value: Value,
}

impl Fact {
    /// A number, or text that is no number.
    pub fn plain(name: impl Into<String>, value: impl Into<Value>) -> Self {
        let value = value.into();
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Self {
            name: name.into(),
            text,
            value,
        }
    }

    /// Words for people, and the same as numbers.
    pub fn measured(name: impl Into<String>, text: impl Into<String>, value: Value) -> Self {
        Self {
            name: name.into(),
            text: text.into(),
            value,
        }
    }
}

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A folder with `capture.toml`.
    Capture,
    /// An npz with vertices, joints and weights.
    Character,
    /// An npz with poses, or BVH.
    Motion,
    /// An npz with weights or attributes of garment vertices.
    Garment,
    /// An npz with positions over time.
    VertexAnimation,
    /// Any other npz.
    Npz,
    /// One numpy array.
    Npy,
    /// An OBJ file.
    Mesh,
    /// A folder of OBJ files.
    MeshSequence,
    /// A PC2 file.
    PointCache,
    /// Any other folder.
    Folder,
    /// A trained model: safetensors.
    Model,
    /// None of these.
    Unknown,
}

impl Report {
    pub(crate) fn new(path: &Path, kind: Kind) -> Self {
        Self {
            path: path.to_path_buf(),
            kind,
            facts: Vec::new(),
            problems: Vec::new(),
        }
    }

    pub(crate) fn fact(&mut self, name: impl Into<String>, value: impl Into<Value>) {
        self.facts.push(Fact::plain(name, value));
    }

    pub(crate) fn measured(&mut self, name: impl Into<String>, text: impl Into<String>, value: Value) {
        self.facts.push(Fact::measured(name, text, value));
    }

    pub(crate) fn findings(&mut self, findings: impl IntoIterator<Item = Finding>) {
        findings.into_iter().for_each(|finding| self.problem(finding));
    }

    pub(crate) fn problem(&mut self, sentence: impl Display) {
        self.problems.push(sentence.to_string());
    }

    /// Value of a result; its error becomes a problem.
    pub(crate) fn take<T, E: Display>(&mut self, result: std::result::Result<T, E>) -> Option<T> {
        result.map_err(|e| self.problem(e)).ok()
    }

    /// The first fact of a name.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.facts
            .iter()
            .find(|fact| fact.name == name)
            .map(|fact| fact.text.as_str())
    }
}

fn as_object<S: Serializer>(facts: &[Fact], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_map(facts.iter().map(|fact| (&fact.name, &fact.value)))
}

impl Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Capture => "capture",
            Kind::Character => "character",
            Kind::Motion => "motion",
            Kind::Garment => "garment arrays",
            Kind::VertexAnimation => "vertex animation",
            Kind::Npz => "npz archive",
            Kind::Npy => "numpy array",
            Kind::Mesh => "OBJ mesh",
            Kind::MeshSequence => "OBJ sequence",
            Kind::PointCache => "PC2 point cache",
            Kind::Folder => "folder",
            Kind::Model => "model",
            Kind::Unknown => "unknown",
        })
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.path.display(), self.kind)?;
        let width = self
            .facts
            .iter()
            .map(|fact| fact.name.chars().count())
            .max()
            .unwrap_or(0);
        for Fact { name, text, .. } in &self.facts {
            writeln!(f, "  {:width$}  {}", shown(name).to_string(), shown(text))?;
        }
        match self.problems.as_slice() {
            [] => writeln!(f, "no problems found"),
            problems => problems
                .iter()
                .try_for_each(|p| writeln!(f, "problem: {}", shown(p))),
        }
    }
}

/// Looks at a file or folder of any kind that the project knows.
///
/// What is wrong with it becomes [`Report::problems`]; only a path that cannot be opened at all is
/// an error.
///
/// # Errors
/// No such file or folder.
pub fn inspect(path: &Path) -> Result<Report> {
    if path.is_dir() {
        return inspect_folder(path);
    }
    if path.file_name().is_some_and(|n| n == "capture.toml") {
        return inspect_folder(parent_folder(path));
    }
    let mut start = Vec::new();
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    file.take(12)
        .read_to_end(&mut start)
        .map_err(Error::io(path, "read"))?;
    Ok(if is_foreign(path) {
        unknown(path, &start)
    } else if start.starts_with(b"PK") {
        arrays::npz(path)
    } else if start.starts_with(b"\x93NUMPY") {
        arrays::npy(path)
    } else if start.starts_with(b"POINTCACHE2") {
        arrays::point_cache(path)
    } else if is_bvh(path)? {
        motion::bvh(path)
    } else if start.get(8) == Some(&b'{') {
        model::inspect(path)
    } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        mesh::inspect(path)
    } else {
        unknown(path, &start)
    })
}

fn inspect_folder(folder: &Path) -> Result<Report> {
    if folder.join("capture.toml").exists() {
        return Ok(capture::inspect(folder));
    }
    let found = folder_that_is_no_capture(folder);
    if found != NOTHING_KNOWN || cache::obj_files(folder)?.is_empty() {
        let mut report = Report::new(folder, Kind::Folder);
        report.fact("folder", found);
        if found != CHARACTER && found != GARMENT {
            report.problem(format!(
                "expected a capture or a folder of .obj files, found {found}"
            ));
        }
        return Ok(report);
    }
    Ok(arrays::mesh_sequence(folder))
}

fn unknown(path: &Path, start: &[u8]) -> Report {
    let mut report = Report::new(path, Kind::Unknown);
    if report
        .take(refuse_foreign(path, "a file that unic reads"))
        .is_none()
    {
        return report;
    }
    report.problem(format!(
        "{}: expected an npz, npy, OBJ, PC2, BVH or model file or a capture folder, found a file that \
         begins with \"{}\"",
        path.display(),
        start.escape_ascii()
    ));
    report
}
