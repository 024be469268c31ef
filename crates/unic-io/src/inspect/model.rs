//! Models: the safetensors header, and whether the bytes are those that were written.

use super::{Kind, Report};
use crate::error::{Error, Result};
use serde_json::{Map, Value, json};
use std::{fs::File, io::Read, path::Path};
use unic_core::{ModelFileError, verify_checksum};

/// The format's own limit.
const LONGEST_HEADER: u64 = 100_000_000;

/// Longer metadata is cut in a report.
const LONGEST_VALUE: usize = 200;

pub(super) fn inspect(path: &Path) -> Report {
    let mut report = Report::new(path, Kind::Model);
    let Some(header) = report.take(read_header(path)) else {
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

fn checksum(report: &mut Report) {
    let path = report.path.clone();
    let Some(bytes) = report.take(std::fs::read(&path).map_err(Error::io(&path, "read"))) else {
        return;
    };
    match verify_checksum(&bytes) {
        Ok(Some(_)) => report.fact("checksum", "as written"),
        Ok(None) => report.fact("checksum", "none: the file was written before there was one"),
        // Tensors of somebody else.
        Err(ModelFileError::NotUnic) => {}
        Err(error) => report.problem(format!("{}: {error}", path.display())),
    }
}

/// Metadata values are strings; those that hold a JSON object themselves are opened.
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

fn shortened(value: &str) -> String {
    match value.char_indices().nth(LONGEST_VALUE) {
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
    if declared > LONGEST_HEADER.min(length.saturating_sub(8)) {
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
