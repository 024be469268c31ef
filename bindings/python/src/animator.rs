//! Animators: garments in motion.

use crate::{
    arrays::{copied, handed_over},
    collider::Collider,
    error::{Error, Result, detached},
    model::Model,
    motion::Motion,
    names::choose,
    numbers::vectors,
    pose::Pose,
    stepping::{Instance, Stepping},
    targets::Targets,
    threads::Workers,
};
use glam::Vec3;
use numpy::{PyArray2, PyArray3, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyBytes};
use std::sync::Arc;
use unic_cli::{args::IntersectionName, model_file};
use unic_core::{Layers, Start};

/// Garment in motion.
///
/// `precision` and `sampling` are those of `Model.with_precision` and `Model.with_sampling`;
/// `intersections` replaces the model's own handling. `threads` is the number of threads that a step
/// works on: one for every core unless given. Results are the same bytes for every number.
///
/// One thread at a time may use an animator; another one gets an error. Calls release the
/// interpreter's lock. Each returns a new array of positions of shape (V, 3), or fills `out` and
/// returns it. `normals` gets the unit normals. Both are arrays of float32 in C order.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Animator {
    stepping: Stepping,
    model: Py<Model>,
}

const INTERSECTIONS: [(&str, IntersectionName); 3] = [
    ("off", IntersectionName::Off),
    ("paper", IntersectionName::Paper),
    ("robust", IntersectionName::Robust),
];

impl Animator {
    /// Runs a call on the garment without the interpreter's lock, and returns its positions.
    fn frame<'py>(
        &self,
        py: Python<'py>,
        targets: Targets<'py>,
        work: impl FnOnce(&mut Instance) -> Result<()> + Send,
    ) -> Result<Bound<'py, PyAny>> {
        let mut taken = self.stepping.take()?;
        let instance = &mut *taken;
        detached(py, || work(instance))?;
        let shown = instance.animator.garment();
        targets.write(py, shown.positions, shown.normals)
    }
}

#[pymethods]
impl Animator {
    #[new]
    #[pyo3(signature = (model, *, precision=None, sampling=None, intersections=None, threads=None))]
    fn new(
        model: &Bound<'_, Model>,
        precision: Option<&str>,
        sampling: Option<f32>,
        intersections: Option<&str>,
        threads: Option<i64>,
    ) -> Result<Self> {
        let py = model.py();
        let given = model.get();
        let workers = Workers::new(threads)?;
        let handling = intersections
            .map(|name| choose("intersections", name, &INTERSECTIONS))
            .transpose()?;
        let precision = precision
            .map(|name| given.precision_of(py, name, unic_core::Model::ALLOWED_PRECISION_ERROR))
            .transpose()?
            .filter(|&precision| precision != given.model.precision());
        let (changed, stepping) = detached(py, || {
            let changed = match (precision, sampling) {
                (None, None) => None,
                _ => Some(given.changed(variant(&given.model, precision, sampling)?)),
            };
            let used = Arc::clone(&changed.as_ref().unwrap_or(given).model);
            let mode = handling.map(|name| model_file::intersection(&used, name));
            let mut animator = unic_core::Animator::new(used);
            if let Some(mode) = mode {
                animator.set_intersection(mode);
            }
            Ok((changed, Stepping::new(animator, workers)?))
        })?;
        Ok(Self {
            stepping,
            model: match changed {
                Some(changed) => Py::new(py, changed)?,
                None => model.clone().unbind(),
            },
        })
    }

    /// Model with the animator's precision and sampling.
    #[getter]
    fn model(&self, py: Python<'_>) -> Py<Model> {
        self.model.clone_ref(py)
    }

    /// Begins a sequence, at its first frame or after a cut.
    ///
    /// The garment starts in the mean shape of training, or at the positions `start`.
    #[pyo3(signature = (pose, *, start=None, out=None, normals=None))]
    fn reset<'py>(
        &self,
        py: Python<'py>,
        pose: &Pose,
        start: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        let targets = Targets::new(self.model.get(), out, normals)?;
        let start = start.map(|start| vectors("start", start, "V")).transpose()?;
        self.frame(py, targets, |instance| {
            instance.reset(&pose.input(), start_of(start.as_deref()))
        })
    }

    /// Advances the garment by one tick of 1 / `Model.fps` seconds, to a new pose.
    #[pyo3(signature = (pose, *, out=None, normals=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        pose: &Pose,
        out: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        let targets = Targets::new(self.model.get(), out, normals)?;
        self.frame(py, targets, |instance| instance.step(&pose.input()))
    }

    /// Garment on any pose, a share of the way from the previous tick (0) to the last one (1).
    #[pyo3(signature = (pose, share, *, out=None, normals=None))]
    fn display<'py>(
        &self,
        py: Python<'py>,
        pose: &Pose,
        share: f32,
        out: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        let targets = Targets::new(self.model.get(), out, normals)?;
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::value("share", "a number from 0 to 1", share));
        }
        let mut taken = self.stepping.take()?;
        let instance = &mut *taken;
        let shown = detached(py, || Ok(instance.show(&pose.pose, share)?))?;
        targets.write(py, shown.positions, shown.normals)
    }

    /// Resets and steps through a motion of the model's rate. Ctrl-C stops it.
    ///
    /// The result, shape (T, V, 3), is handed over without a copy.
    #[pyo3(signature = (motion, *, start=None))]
    fn animate<'py>(
        &self,
        py: Python<'py>,
        motion: &Bound<'py, Motion>,
        start: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyArray3<f32>>> {
        let start = start.map(|start| vectors("start", start, "V")).transpose()?;
        let clip = Arc::clone(&motion.get().clip);
        let mut taken = self.stepping.take()?;
        let numbers = taken.animate(py, &clip, start_of(start.as_deref()))?;
        handed_over(
            py,
            numbers,
            [clip.len(), self.model.get().model.vertex_count(), 3],
        )
    }

    /// Positions at the last tick, shape (V, 3), a copy.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        copied(py, self.stepping.take()?.animator.garment().positions)
    }

    /// Unit normals at the last tick, shape (V, 3), a copy.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        copied(py, self.stepping.take()?.animator.garment().normals)
    }

    /// Positions of the body's vertices at the last tick, shape (B, 3).
    fn body<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        let taken = self.stepping.take()?;
        let animator = &taken.animator;
        let positions = detached(py, || {
            let mut positions = Vec::new();
            animator.body(&mut positions);
            Ok(positions)
        })?;
        copied(py, &positions)
    }

    /// Saves everything that the next step depends on, in the form of the C interface.
    fn state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let mut saved = Vec::new();
        let checksum = self.model.get().checksum;
        self.stepping
            .take()?
            .animator
            .state()
            .save(checksum, &mut saved)?;
        Ok(PyBytes::new(py, &saved))
    }

    /// Restores a saved state of the same model. Later steps give the same bytes as after it.
    fn restore<'py>(&self, py: Python<'py>, state: &Bound<'py, PyBytes>) -> Result<Bound<'py, PyAny>> {
        let (model, saved) = (self.model.get(), state.as_bytes());
        let targets = Targets::new(model, None, None)?;
        self.frame(py, targets, |instance| instance.restore(saved, model.checksum))
    }

    /// Replaces the garment at the current frame, shape (V, 3).
    fn set_positions(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> Result<()> {
        let positions = vectors("positions", positions, "V")?;
        let mut taken = self.stepping.take()?;
        let instance = &mut *taken;
        detached(py, || instance.replace(&positions))
    }

    /// Sets ground and props, for intersection handling "robust". Resets keep them.
    fn set_colliders(&self, colliders: Vec<Bound<'_, Collider>>) -> Result<()> {
        let colliders = colliders.iter().map(|collider| collider.get().0.clone());
        self.stepping.take()?.animator.set_colliders(colliders);
        Ok(())
    }

    /// Sets the layer of each vertex, shape (V,); unless given by connected parts.
    #[pyo3(signature = (layer_of_vertex=None))]
    fn set_layers(&self, py: Python<'_>, layer_of_vertex: Option<PyReadonlyArray1<'_, u32>>) -> Result<()> {
        let given = layer_of_vertex.map(|layers| layers.as_array().to_vec());
        let model = &self.model.get().model;
        let (character, garment) = (model.character(), model.garment());
        let mut taken = self.stepping.take()?;
        let instance = &mut *taken;
        detached(py, || {
            let layers = match given {
                None => Layers::from_components(character, garment),
                Some(given) => {
                    Layers::new(character, garment, given).map_err(|e| Error::Value(e.to_string()))?
                }
            };
            Ok(instance.animator.set_layers(layers)?)
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<unic.Animator of {}>", self.model.bind(py).repr()?))
    }
}

fn start_of(positions: Option<&[Vec3]>) -> Start<'_> {
    positions.map_or(Start::MeanShape, Start::Positions)
}

/// Makes the model in another precision or sampling.
fn variant(
    model: &unic_core::Model,
    precision: Option<unic_core::Precision>,
    sampling: Option<f32>,
) -> Result<unic_core::Model> {
    let packed = match precision {
        Some(precision) => model.clone().with_precision(precision),
        None => model.clone(),
    };
    match sampling {
        Some(share) => Ok(packed.with_sampling(share)?),
        None => Ok(packed),
    }
}
