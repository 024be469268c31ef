//! Summaries of models: the safetensors header and the checksum.

use super::report::{FileKind, Inspection};
use crate::error::{Error, Result};
use serde_json::{Map, Value, json};
use std::{fs::File, io::Read, path::Path};
use unic_core::{ModelFileError, model_file::verify_checksum};

/// Longest header, bytes: the format's own limit.
const MAX_HEADER: u64 = 100_000_000;

/// Length to which metadata values are cut, characters.
const MAX_VALUE: usize = 200;

pub(super) fn inspect(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Model);
    let Some(header) = report.ok_or_problem(read_header(path)) else {
        return report;
    };
    for (key, value) in metadata(&header) {
        report.fact(key, shortened(&value));
    }
    let tensors: Vec<_> = header
        .iter()
        .filter(|(name, _)| *name != "__metadata__")
        .collect();
    report.fact("tensors", tensors.len());
    for (name, tensor) in tensors {
        let (dtype, shape) = (&tensor["dtype"], &tensor["shape"]);
        report.measured(
            format!("tensor {name}"),
            format!("{} {shape}", dtype.as_str().unwrap_or("?")),
            json!({ "type": dtype, "shape": shape }),
        );
    }
    checksum(&mut report);
    report
}

fn checksum(report: &mut Inspection) {
    let path = report.path.clone();
    let Some(bytes) = report.ok_or_problem(std::fs::read(&path).map_err(Error::io(&path, "read"))) else {
        return;
    };
    // The whole file is read: a header alone does not show damaged weights.
    match verify_checksum(&bytes) {
        Ok(Some(_)) => report.fact("checksum", "as written"),
        Ok(None) => report.fact("checksum", "none: the file was written before there was one"),
        // Tensors of another program have no checksum of this project.
        Err(ModelFileError::NotUnic) => {}
        Err(error) => report.problem(format!("{}: {error}", path.display())),
    }
}

/// Returns the metadata as pairs of key and text. Values are strings; a string that is a JSON
/// object yields a pair for each of its keys.
fn metadata(header: &Map<String, Value>) -> Vec<(String, String)> {
    let Some(Value::Object(metadata)) = header.get("__metadata__") else {
        return Vec::new();
    };
    let mut facts = Vec::new();
    for (key, value) in metadata {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_string);
        match serde_json::from_str::<Value>(&text) {
            Ok(Value::Object(inner)) => {
                facts.extend(inner.iter().map(|(k, v)| (format!("{key}.{k}"), v.to_string())));
            }
            _ => facts.push((key.clone(), text)),
        }
    }
    facts
}

/// Cuts a long value.
fn shortened(value: &str) -> String {
    match value.char_indices().nth(MAX_VALUE) {
        None => value.into(),
        Some((end, _)) => format!("{}...", &value[..end]),
    }
}

fn read_header(path: &Path) -> Result<Map<String, Value>> {
    let mut file = File::open(path).map_err(Error::io(path, "open"))?;
    let length = file.metadata().map_err(Error::io(path, "read"))?.len();
    let mut prefix = [0; 8];
    file.read_exact(&mut prefix).map_err(Error::io(path, "read"))?;
    let declared = u64::from_le_bytes(prefix);
    // Checked before the header is read: a damaged length must not allocate gigabytes.
    if declared > MAX_HEADER.min(length.saturating_sub(8)) {
        let found = format!("a header of {declared} bytes in a file of {length}");
        return Err(Error::content(path, "a model (safetensors)", found));
    }
    let mut json = Vec::new();
    file.take(declared)
        .read_to_end(&mut json)
        .map_err(Error::io(path, "read"))?;
    serde_json::from_slice(&json)
        .map_err(|e| Error::content(path, "a model (safetensors)", format!("a damaged header ({e})")))
}
