//! Points of meshes over time.

use super::{
    mesh::{Binding, faces},
    outline,
    sampled::Sampled,
    stage::Prims,
    units::Conversion,
    value,
    xform::Xforms,
};
use crate::{
    fault::Fault,
    scene::{Mesh, PointSamples, Shape},
};
use glam::{DMat4, Vec3};

/// Largest relative difference between a step in time and the mean one of uniform samples.
const UNIFORM: f64 = 1e-3;

/// The mesh with its points in world space at the time of each sample.
pub(super) fn with_samples(
    mesh: &Binding,
    prims: &Prims,
    xforms: &Xforms,
    conversion: &Conversion,
) -> Result<Mesh, Fault> {
    let samples = match Sampled::read(prims, mesh.path, "points", value::vectors)? {
        Some(Sampled::Over(samples)) => samples,
        Some(Sampled::Constant(_)) | None => return mesh.outline(prims),
    };
    let times: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
    // Every mesh is a node.
    let world = |time| {
        xforms
            .node(mesh.path)
            .map_or(DMat4::IDENTITY, |node| xforms.world(node, Some(time)))
    };
    let place = |(time, points): (f64, Vec<Vec3>)| -> Vec<Vec3> {
        let world_from_mesh: DMat4 = world(time);
        let points = points.into_iter();
        points
            .map(|point| world_from_mesh.transform_point3(point.as_dvec3()).as_vec3())
            .collect()
    };
    let frames: Vec<Vec<Vec3>> = samples.into_iter().map(place).collect();
    let vertices = frames.first().map_or(0, Vec::len);
    let shape = Shape {
        points: frames.first().cloned().unwrap_or_default(),
        faces: faces(prims, mesh.path, vertices)?,
        weights: Vec::new(),
    };
    Ok(Mesh {
        triangles: shape.faces.len(),
        vertices,
        samples: frames.len(),
        shape: Some(shape),
        points: Some(PointSamples {
            fps: fps(&times, conversion),
            frames,
        }),
        ..outline(mesh.name(), 0, 0, mesh.skeleton)
    })
}

/// Samples per second, if they are at equal distances and the file or the caller tells its rate.
fn fps(times: &[f64], conversion: &Conversion) -> Option<f32> {
    conversion.fps?;
    let step = uniform_step(times)?;
    Some((conversion.codes_per_second / step) as f32)
}

/// Distance in time codes between samples at equal distances.
pub(super) fn uniform_step(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let steps = times.len().checked_sub(1).filter(|steps| *steps > 0)?;
    let mean = (last - first) / steps as f64;
    let is_uniform = |pair: &[f64]| (pair[1] - pair[0] - mean).abs() < UNIFORM * mean;
    times.windows(2).all(is_uniform).then_some(mean)
}
