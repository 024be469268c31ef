//! A model as ONNX graphs, for engines that run no code of ours.
//!
//! [`export`] returns the files of a folder:
//!
//! | file | content |
//! |---|---|
//! | `start.onnx` | poses of the first two frames to the state and the positions of the first one |
//! | `tick.onnx` | pose and state to positions and the next state |
//! | `motion.onnx`, `skinning.onnx`, `encoder.onnx`, `prior.onnx`, `field.onnx` | the stages of a tick, one by one |
//! | `mesh.bin` | the arrays of the garment that graphs read, faces and texture coordinates |
//! | `model.json` | joint order, units, every input and output, layout of `mesh.bin`, what is left out |
//!
//! The graphs hold no vertex: arrays with a row a vertex are inputs. So their number is free, and
//! a part of the vertices or another mesh of the garment takes the same graphs.
//!
//! The graphs end where the networks end. The strain projection, the replay and the intersection
//! handling of an [`Animator`](unic_core::Animator) are left out.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let model = unic_core::Model::from_bytes(&std::fs::read("tshirt.unic")?)?;
//! for file in unic_onnx::export(&model)? {
//!     std::fs::write(std::path::Path::new("onnx").join(file.name), file.bytes)?;
//! }
//! # Ok(())
//! # }
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test that cannot go on fails"))]

mod description;
mod graph;
mod heading;
mod kinematics;
mod mesh;
mod motion;
mod networks;
mod port;
mod protobuf;
mod rotation;
#[cfg(test)]
mod test_models;
mod tick;
mod vertices;

use description::Description;
use graph::LARGEST_FILE;
use mesh::MeshFile;
use thiserror::Error;
use unic_core::Model;

/// Name of the description, which is the last file of an export.
pub const DESCRIPTION: &str = "model.json";

/// Names of all files that an export may have. A model without a prior has no `prior.onnx`.
pub const FILES: [&str; 9] = [
    "start.onnx",
    "tick.onnx",
    "motion.onnx",
    "skinning.onnx",
    "encoder.onnx",
    "prior.onnx",
    "field.onnx",
    "mesh.bin",
    DESCRIPTION,
];

/// File of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportFile {
    /// Name within the folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Error: a model that no graph can be made of.
#[derive(Debug, Error)]
pub enum ExportError {
    /// A model whose networks are evaluated at some of its vertices.
    #[error(
        "ONNX: expected a model whose field is evaluated at all {vertices} vertices, found one with {samples} samples"
    )]
    Sampling {
        /// Number of vertices.
        vertices: usize,
        /// Number of vertices that the field is evaluated at.
        samples: usize,
    },
    /// A graph larger than readers of ONNX files take.
    #[error("ONNX: expected graphs of up to {LARGEST_FILE} bytes, found {bytes} in {name}")]
    Size {
        /// Name of the file.
        name: String,
        /// Size of the file, bytes.
        bytes: usize,
    },
    /// A description that cannot be written as JSON.
    #[error("ONNX: model.json cannot be written: {0}")]
    Description(#[from] serde_json::Error),
}

/// Makes the files of a model.
///
/// # Errors
/// A model with sampled vertices, a graph of 2 GiB or more.
pub fn export(model: &Model) -> Result<Vec<ExportFile>, ExportError> {
    if let Some(sampling) = model.sampling() {
        return Err(ExportError::Sampling {
            vertices: model.vertex_count(),
            samples: sampling.samples().len(),
        });
    }
    // Nothing in the graphs would move the replayed shapes.
    let still = model.without_replay();
    let graphs = tick::graphs(&still);
    let mut files = Vec::new();
    for graph in &graphs {
        let (name, bytes) = (format!("{}.onnx", graph.name()), graph.to_bytes());
        if bytes.len() > LARGEST_FILE {
            let bytes = bytes.len();
            return Err(ExportError::Size { name, bytes });
        }
        files.push(ExportFile { name, bytes });
    }
    let mut mesh = MeshFile::new(&still, &tick::sizes(&still));
    files.push(ExportFile {
        name: "mesh.bin".to_owned(),
        bytes: std::mem::take(&mut mesh.bytes),
    });
    let description = Description::new(model, &graphs, mesh);
    files.push(ExportFile {
        name: DESCRIPTION.to_owned(),
        bytes: serde_json::to_vec_pretty(&description)?,
    });
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_the_names_of_the_list_and_the_description_is_the_last() {
        for model in test_models::all() {
            let files = export(&model).unwrap();
            let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
            let expected = FILES.into_iter().filter(|name| names.contains(name));
            assert_eq!(names, expected.collect::<Vec<_>>());
            assert_eq!(names.last(), Some(&DESCRIPTION));
        }
    }

    #[test]
    fn the_same_model_gives_the_same_bytes() {
        let model = test_models::displacement(test_models::add_recurrence);
        assert_eq!(export(&model).unwrap(), export(&model).unwrap());
    }

    #[test]
    fn the_description_finds_every_array_in_the_mesh() {
        let model = test_models::displacement(|parts| {
            test_models::add_recurrence(parts);
            parts.garment.mask = Some(vec![1.0, 0.5, 0.0]);
        });
        let files = export(&model).unwrap();
        let bytes = |name: &str| &files.iter().find(|file| file.name == name).unwrap().bytes;
        let about: serde_json::Value = serde_json::from_slice(bytes(DESCRIPTION)).unwrap();
        let mut end = 0;
        for array in about["mesh"]["arrays"].as_array().unwrap() {
            assert_eq!(array["offset"], end, "{array}");
            let shape = array["shape"].as_array().unwrap();
            end += 4 * shape.iter().map(|n| n.as_u64().unwrap()).product::<u64>();
        }
        assert_eq!(bytes("mesh.bin").len() as u64, end);
        let mask = about["mesh"]["arrays"].as_array().unwrap();
        let mask = mask.iter().find(|array| array["name"] == "mask").unwrap();
        let offset = mask["offset"].as_u64().unwrap() as usize;
        let expected: Vec<u8> = [1.0f32, 0.5, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        assert_eq!(bytes("mesh.bin")[offset..offset + 12], expected);
    }

    #[test]
    fn the_description_says_what_the_graphs_leave_out() {
        let files = export(&test_models::displacement(|_| ())).unwrap();
        let about: serde_json::Value = serde_json::from_slice(&files.last().unwrap().bytes).unwrap();
        let in_model = |name: &str| {
            let parts = about["outside"].as_array().unwrap();
            let part = parts.iter().find(|part| part["name"] == name);
            part.unwrap()["in_model"].as_bool().unwrap()
        };
        assert!(in_model("intersection_handling") && in_model("normals"));
        assert!(!in_model("strain_projection") && !in_model("replay"));
        assert_eq!(about["joints"][1]["parent"], 0);
        assert_eq!(about["fps"], 30.0);
    }

    #[test]
    fn sampled_models_are_refused() {
        let model = test_models::displacement(|_| ()).with_sampling(0.5).unwrap();
        let error = export(&model).unwrap_err().to_string();
        assert!(error.contains("all 3 vertices"), "{error}");
    }
}
