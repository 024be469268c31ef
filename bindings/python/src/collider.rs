//! Ground and props.

use crate::{
    error::{Error, Result, detached},
    mesh::Mesh,
    numbers::{Numbers, vector},
};
use glam::{Quat, Vec3};
use pyo3::prelude::*;
use std::sync::Arc;
use unic_core::{collider, surface::Surface, transform::Rigid};

/// Solid shape with its place in the world: the ground or a prop.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Collider(pub(crate) collider::Collider);

#[pymethods]
impl Collider {
    #[staticmethod]
    #[pyo3(signature = (height=0.0))]
    fn ground(height: f32) -> Result<Self> {
        Ok(Self(collider::Collider::ground(number(
            "height",
            height,
            f32::NEG_INFINITY,
        )?)))
    }

    #[staticmethod]
    fn sphere(radius: f32, centre: &Bound<'_, PyAny>) -> Result<Self> {
        let (radius, centre) = (number("radius", radius, 0.0)?, point("centre", centre)?);
        Ok(Self(collider::Collider::sphere(radius, centre)))
    }

    #[staticmethod]
    fn capsule(radius: f32, start: &Bound<'_, PyAny>, end: &Bound<'_, PyAny>) -> Result<Self> {
        let (start, end) = (point("start", start)?, point("end", end)?);
        Ok(Self(collider::Collider::capsule(
            number("radius", radius, 0.0)?,
            start,
            end,
        )))
    }

    /// Inner side of a mesh with outward normals.
    #[staticmethod]
    #[pyo3(signature = (mesh, rotation=None, translation=None))]
    fn mesh(
        py: Python<'_>,
        mesh: &Bound<'_, Mesh>,
        rotation: Option<&Bound<'_, PyAny>>,
        translation: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self> {
        let world_from_mesh = Rigid::new(
            rotation.map_or(Ok(Quat::IDENTITY), quaternion)?,
            translation.map_or(Ok(Vec3::ZERO), |t| point("translation", t))?,
        );
        let mesh = mesh.get();
        let surface = detached(py, || {
            let mesh = mesh.mesh();
            mesh.check().map_err(|e| Error::Value(e.to_string()))?;
            match mesh.faces.is_empty() {
                true => Err(Error::value("mesh", "at least one face", "none")),
                false => Ok(Surface::build(mesh)),
            }
        })?;
        Ok(Self(collider::Collider::mesh(Arc::new(surface), world_from_mesh)))
    }

    /// Same shape at another place; None keeps the rotation. A mesh is shared.
    #[pyo3(signature = (rotation, translation))]
    fn at(&self, rotation: Option<&Bound<'_, PyAny>>, translation: &Bound<'_, PyAny>) -> Result<Self> {
        let own = self.0.world_from_collider.rotation;
        let rotation = rotation.map_or(Ok(own), quaternion)?;
        Ok(Self(collider::Collider {
            world_from_collider: Rigid::new(rotation, point("translation", translation)?),
            ..self.0.clone()
        }))
    }
}

/// Checks a number: finite and at least `least`.
fn number(what: &str, value: f32, least: f32) -> Result<f32> {
    match value.is_finite() && value >= least {
        true => Ok(value),
        false if least == 0.0 => Err(Error::value(what, "metres, at least 0", value)),
        false => Err(Error::value(what, "metres", value)),
    }
}

fn point(what: &str, value: &Bound<'_, PyAny>) -> Result<Vec3> {
    let point = vector(what, value)?;
    match point.is_finite() {
        true => Ok(point),
        false => Err(Error::value(what, "finite numbers", point)),
    }
}

fn quaternion(value: &Bound<'_, PyAny>) -> Result<Quat> {
    let numbers = Numbers::read("rotation", value)?;
    let [4] = numbers.shape[..] else {
        return Err(numbers.wrong_shape("rotation", "(4,), a quaternion x, y, z, w"));
    };
    let rotation = Quat::from_slice(&numbers.data);
    match rotation.is_finite() && rotation.is_normalized() {
        true => Ok(rotation),
        false => Err(Error::value("rotation", "a unit quaternion", rotation)),
    }
}
