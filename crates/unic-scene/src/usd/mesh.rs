//! Meshes, and how skeletons move them.

use super::{
    outline,
    sampled::Sampled,
    skeleton::Skeleton,
    skeleton_at,
    stage::{Prims, fault},
    value,
};
use crate::{
    fault::Fault,
    scene::{Mesh, Shape},
};
use glam::{DMat4, Vec3};
use openusd::sdf;

const INDICES: &str = "primvars:skel:jointIndices";
const WEIGHTS: &str = "primvars:skel:jointWeights";

/// A mesh and the skeleton that moves it.
pub(super) struct Binding<'a> {
    pub(super) path: &'a sdf::Path,
    /// Index of the skeleton, which is that of its skin too.
    pub(super) skeleton: Option<usize>,
}

impl<'a> Binding<'a> {
    pub(super) fn of(prims: &Prims, path: &'a sdf::Path, skeletons: &[Skeleton]) -> Result<Self, Fault> {
        let has_weights = prims.value(path, INDICES)?.is_some();
        let target = match has_weights {
            true => prims.inherited_target(path, "skel:skeleton")?,
            false => None,
        };
        let found = target.and_then(|target| skeleton_at(skeletons, &target));
        Ok(Self {
            path,
            skeleton: found.map(|(index, _)| index),
        })
    }

    /// Name of the mesh: its path.
    pub(super) fn name(&self) -> String {
        self.path.as_str().to_owned()
    }

    /// The mesh with its counts alone.
    pub(super) fn outline(&self, prims: &Prims) -> Result<Mesh, Fault> {
        let points = prims.stage.prim(self.path.clone()).attribute("points");
        let samples = points.time_sample_times().map_err(fault)?.len();
        let vertices = match points.get::<sdf::Value>().map_err(fault)? {
            Some(points) => value::vectors(points).map_or(0, |points| points.len()),
            None => {
                let first = self.points(prims)?;
                first.map_or(0, |points| points.len())
            }
        };
        Ok(outline(self.name(), vertices, samples, self.skeleton))
    }

    /// Points outside any animation, or of the first sample.
    fn points(&self, prims: &Prims) -> Result<Option<Vec<Vec3>>, Fault> {
        let points = Sampled::read(prims, self.path, "points", value::vectors)?;
        Ok(points.and_then(|points| points.first().cloned()))
    }

    /// The mesh in the space of its skin.
    pub(super) fn with_shape(&self, prims: &Prims, skeletons: &[Skeleton]) -> Result<Mesh, Fault> {
        let points = match prims.value(self.path, "points")?.and_then(value::vectors) {
            Some(points) => points,
            None => self.points(prims)?.unwrap_or_default(),
        };
        let bind = prims.value(self.path, "primvars:skel:geomBindTransform")?;
        let skin_from_mesh = bind.and_then(value::matrix).unwrap_or(DMat4::IDENTITY);
        let skeleton = self.skeleton.and_then(|index| skeletons.get(index));
        let shape = Shape {
            weights: match skeleton {
                Some(skeleton) => weights(prims, self.path, skeleton, points.len())?,
                None => Vec::new(),
            },
            faces: faces(prims, self.path, points.len())?,
            points: (points.iter())
                .map(|point| skin_from_mesh.transform_point3(point.as_dvec3()).as_vec3())
                .collect(),
        };
        Ok(Mesh {
            triangles: shape.faces.len(),
            vertices: shape.points.len(),
            shape: Some(shape),
            ..outline(self.name(), 0, 0, self.skeleton)
        })
    }
}

/// Cuts the polygons of a mesh into fans around their first corners.
pub(super) fn faces(prims: &Prims, path: &sdf::Path, vertices: usize) -> Result<Vec<[u32; 3]>, Fault> {
    let integers = |name| -> Result<Vec<i32>, Fault> {
        let list = Sampled::read(prims, path, name, value::integers)?;
        match list {
            // Points of another frame would not fit the faces of this one. Some writers sample faces
            // that do not change.
            Some(Sampled::Over(samples)) if samples.windows(2).any(|pair| pair[0].1 != pair[1].1) => {
                let found = format!("{path}, whose faces change");
                Err(Fault::new("a mesh with the same faces in all frames", found))
            }
            list => Ok(list.and_then(|list| list.first().cloned()).unwrap_or_default()),
        }
    };
    let (counts, indices) = (integers("faceVertexCounts")?, integers("faceVertexIndices")?);
    let is_mirrored = prims
        .value(path, "orientation")?
        .and_then(value::token)
        .as_deref()
        == Some("leftHanded");
    let mut faces = Vec::new();
    let mut first = 0_usize;
    let wrong = |found: String| Fault::new(format!("polygons of {vertices} vertices at {path}"), found);
    for count in counts {
        let count = usize::try_from(count).map_err(|_| wrong(format!("one of {count} corners")))?;
        let corners = (first.checked_add(count)).and_then(|end| indices.get(first..end));
        let corners = corners.ok_or_else(|| wrong(format!("{} corners", indices.len())))?;
        first += count;
        let vertex = |index: i32| {
            u32::try_from(index)
                .ok()
                .filter(|index| (*index as usize) < vertices)
        };
        for pair in corners.windows(2).skip(1) {
            let [Some(a), Some(b), Some(c)] = [corners[0], pair[0], pair[1]].map(vertex) else {
                return Err(wrong(format!("one of {:?}", [corners[0], pair[0], pair[1]])));
            };
            faces.push(match is_mirrored {
                true => [a, c, b],
                false => [a, b, c],
            });
        }
    }
    Ok(faces)
}

/// Reads the joints and weights of each vertex.
fn weights(
    prims: &Prims,
    path: &sdf::Path,
    skeleton: &Skeleton,
    vertices: usize,
) -> Result<Vec<Vec<(u16, f32)>>, Fault> {
    let indices = prims
        .value(path, INDICES)?
        .and_then(value::integers)
        .unwrap_or_default();
    let weights = prims
        .value(path, WEIGHTS)?
        .and_then(value::floats)
        .unwrap_or_default();
    // Without a list of its own a mesh names the joints of its skeleton.
    let subset = prims.tokens(path, "skel:joints")?;
    let places = match subset.as_slice() {
        [] => (0..skeleton.joints.len()).map(Some).collect(),
        names => skeleton.places(names),
    };
    let attribute = prims.stage.prim(path.clone()).attribute(INDICES);
    let metadata = |key| attribute.get_metadata::<sdf::Value>(key).map_err(fault);
    let size = metadata("elementSize")?.and_then(value::number).unwrap_or(1.0) as usize;
    let is_rigid = metadata("interpolation")?.and_then(value::token).as_deref() == Some("constant");
    let rows = if is_rigid { 1 } else { vertices };
    if size == 0 || weights.len() != indices.len() || rows.checked_mul(size) != Some(indices.len()) {
        let expected = format!("{size} joints and weights for each of {rows} vertices at {path}");
        return Err(Fault::new(
            expected,
            format!("{} and {}", indices.len(), weights.len()),
        ));
    }
    let row = |(indices, weights): (&[i32], &[f32])| {
        let entries = indices.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
        entries
            .map(|(index, weight)| {
                let joint = usize::try_from(*index).ok().and_then(|index| *places.get(index)?);
                let joint = joint.and_then(|joint| u16::try_from(joint).ok());
                joint.map(|joint| (joint, *weight)).ok_or_else(|| {
                    let expected = format!("indices of {} joints at {path}", places.len());
                    Fault::new(expected, index.to_string())
                })
            })
            .collect()
    };
    let read: Result<Vec<Vec<(u16, f32)>>, Fault> = indices
        .chunks_exact(size)
        .zip(weights.chunks_exact(size))
        .map(row)
        .collect();
    let read = read?;
    match read.first() {
        Some(first) if is_rigid => Ok(vec![first.clone(); vertices]),
        _ => Ok(read),
    }
}
