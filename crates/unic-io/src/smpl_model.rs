//! Body models of SMPL (Loper et al. 2015) as characters: the npz files and the pickles of chumpy and
//! scipy in which their authors publish them.
//!
//! | array | shape | content |
//! |---|---|---|
//! | `v_template` | (V, 3) | body in the T-pose, metres, +Y up |
//! | `f` | (F, 3) | faces |
//! | `weights` | (V, 24) | skinning weights |
//! | `J_regressor` | (24, V) | joints from vertices, dense or sparse |
//! | `kintree_table` | (2, 24) | parents in the first row |
//!
//! The mean shape is taken. The correctives of shape and pose are left out: the body is skinned
//! linearly, as all characters are.

use crate::{
    error::{Error, Result},
    npy::Dim,
    npz::Npz,
    pickle::{Numbers, Pickle},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Names of the arrays, in the order of [`Arrays`].
const NAMES: [&str; 5] = ["v_template", "f", "weights", "J_regressor", "kintree_table"];
/// Joints of the model.
const JOINTS: usize = SMPL_JOINT_NAMES.len();

/// Note about the parts that are left out.
pub(crate) const NOTE: &str = "an SMPL model in its mean shape: correctives of shape and pose are left out";

/// Arrays of a model as they are in its file.
struct Arrays {
    template: Numbers,
    faces: Numbers,
    weights: Numbers,
    regressor: Numbers,
    tree: Numbers,
}

/// Returns whether an npz archive is a body model.
pub(crate) fn is_model(npz: &Npz) -> bool {
    npz.contains(NAMES[0]) && npz.contains(NAMES[4])
}

/// Reads a body model from an npz archive.
///
/// # Errors
/// Missing arrays, shapes that contradict each other, another number of joints than 24.
pub(crate) fn read_npz(npz: &mut Npz) -> Result<Character> {
    let path = npz.path().to_path_buf();
    let mut array = |name: &str, columns: Option<usize>| {
        let columns = columns.map_or(Dim::Any("V"), Dim::Is);
        let array = npz.finite::<f32>(name, &[Dim::Any("N"), columns])?;
        Ok::<_, Error>(Numbers {
            shape: array.shape,
            data: array.data.into_iter().map(f64::from).collect(),
        })
    };
    let arrays = Arrays {
        template: array(NAMES[0], Some(3))?,
        faces: array(NAMES[1], Some(3))?,
        weights: array(NAMES[2], Some(JOINTS))?,
        regressor: array(NAMES[3], None)?,
        tree: array(NAMES[4], Some(JOINTS))?,
    };
    arrays.character(&path)
}

/// Reads a body model from a pickle.
///
/// # Errors
/// No pickle; missing arrays, shapes that contradict each other, another number of joints than 24.
pub(crate) fn read_pickle(path: &Path) -> Result<Character> {
    let bytes = std::fs::read(path).map_err(Error::io(path, "open"))?;
    let pickle = Pickle::read(path, &bytes)?;
    let array = |name: &str| {
        let found = pickle.value(pickle.root(), &[name]);
        let array = found.and_then(|index| array(&pickle, index));
        array.ok_or_else(|| {
            let expected = format!("a body model of SMPL with the arrays {}", NAMES.join(", "));
            Error::content(path, expected, format!("no array {name}"))
        })
    };
    let arrays = Arrays {
        template: array(NAMES[0])?,
        faces: array(NAMES[1])?,
        weights: array(NAMES[2])?,
        regressor: array(NAMES[3])?,
        tree: array(NAMES[4])?,
    };
    arrays.character(path)
}

/// Reads a numpy array, one inside an object of chumpy, or a sparse one of scipy.
fn array(pickle: &Pickle<'_>, index: usize) -> Option<Numbers> {
    if let Some(numbers) = pickle.numbers(index) {
        return Some(numbers);
    }
    let state = pickle.state(index)?;
    match pickle.value(state, &["x"]) {
        Some(inner) => pickle.numbers(inner),
        None => sparse(pickle, state),
    }
}

/// Reads a matrix of scipy in compressed rows (CSR) or columns (CSC), which the number of their
/// starts tells apart.
fn sparse(pickle: &Pickle<'_>, state: usize) -> Option<Numbers> {
    let part = |name: &str| pickle.numbers(pickle.value(state, &[name])?);
    let (data, indices, starts) = (part("data")?, part("indices")?, part("indptr")?);
    let shape = pickle.shape(pickle.value(state, &["_shape", "shape"])?)?;
    let [rows, columns] = *shape.as_slice() else {
        return None;
    };
    // One start for each vertex of a model or each of its joints: nothing larger is allocated.
    let is_by_rows = starts.data.len() == rows.checked_add(1)?;
    let is_by_columns = starts.data.len() == columns.checked_add(1)?;
    let ascends = starts.data.windows(2).all(|pair| pair[0] <= pair[1]);
    let ends = [starts.data.first(), starts.data.last()] == [Some(&0.0), Some(&(data.data.len() as f64))];
    // Starts that ascend name each entry once: a damaged file must not cause an endless loop.
    let is_sound = (is_by_rows || is_by_columns) && ascends && ends && data.data.len() == indices.data.len();
    // A model has more bytes than vertices: a damaged shape must not cause an allocation.
    if rows != JOINTS || columns > pickle.bytes.len() || !is_sound {
        return None;
    }
    let mut dense = vec![0.0; rows.checked_mul(columns)?];
    for (line, range) in starts.data.windows(2).enumerate() {
        for entry in range[0] as usize..range[1] as usize {
            let across = indices.data[entry] as usize;
            let [row, column] = if is_by_rows {
                [line, across]
            } else {
                [across, line]
            };
            if row >= rows || column >= columns {
                return None;
            }
            dense[row * columns + column] += data.data[entry];
        }
    }
    Some(Numbers { shape, data: dense })
}

impl Arrays {
    /// Makes the character in its rest pose, the T-pose.
    fn character(&self, path: &Path) -> Result<Character> {
        let count = self.template.shape.first().copied().unwrap_or(0);
        self.check_shapes(path, count)?;
        let vertices: Vec<Vec3> = (self.template.data.chunks_exact(3))
            .map(|v| Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32))
            .collect();
        let joint = |row: &[f64]| {
            let weighted = row.iter().zip(&vertices);
            // In f64: thousands of small weights are added.
            let sum: glam::DVec3 = weighted.map(|(&weight, v)| weight * v.as_dvec3()).sum();
            sum.as_vec3()
        };
        let joints: Vec<Vec3> = self.regressor.data.chunks_exact(count).map(joint).collect();
        // Negative and other impossible numbers become an index that the mesh refuses.
        let index = |i: f64| if i >= 0.0 { i as u32 } else { u32::MAX };
        let face = |f: &[f64]| [index(f[0]), index(f[1]), index(f[2])];
        let faces = self.faces.data.chunks_exact(3).map(face).collect();
        let body = TriMesh::new(vertices, faces).map_err(|source| Error::Mesh {
            path: path.to_path_buf(),
            source,
        })?;
        // The root's parent is -1, as an unsigned number in some files.
        let parent = |&p: &f64| if p < JOINTS as f64 { p as i64 } else { -1 };
        let skeleton = Skeleton::new(SkeletonParts {
            names: SMPL_JOINT_NAMES.map(str::to_owned).to_vec(),
            parents: self.tree.data.iter().take(JOINTS).map(parent).collect(),
            joints,
            rest_pose: Vec::new(),
        })
        .map_err(|source| Error::Skeleton {
            path: path.to_path_buf(),
            source,
        })?;
        let weights: Vec<f32> = self.weights.data.iter().map(|&w| w as f32).collect();
        let weights =
            SkinningWeights::from_dense(&weights, count, JOINTS).map_err(|source| Error::Weights {
                path: path.to_path_buf(),
                source,
            })?;
        Ok(Character {
            body,
            skeleton,
            weights,
            file_mesh: None,
        })
    }

    fn check_shapes(&self, path: &Path, vertices: usize) -> Result<()> {
        let faces = self.faces.shape.first().copied().unwrap_or(0);
        let expected = [
            (NAMES[0], &self.template, [vertices, 3]),
            (NAMES[1], &self.faces, [faces, 3]),
            (NAMES[2], &self.weights, [vertices, JOINTS]),
            (NAMES[3], &self.regressor, [JOINTS, vertices]),
            (NAMES[4], &self.tree, [2, JOINTS]),
        ];
        let wrong = expected
            .iter()
            .find(|(_, array, shape)| array.shape != *shape || vertices == 0);
        match wrong {
            None => Ok(()),
            Some((name, array, shape)) => {
                let expected = format!("a body model of SMPL of 24 joints, with {name} of shape {shape:?}");
                Err(Error::content(path, expected, format!("{:?}", array.shape)))
            }
        }
    }
}
