//! Motions: poses at a frame rate.

use crate::{
    arrays::copied,
    character::Wearer,
    error::{Error, Result, detached},
    motion_options::{Findings, Options},
    numbers::{Numbers, vectors},
    pose::{Pose, rotations_of},
};
use glam::{Quat, Vec3};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::{
    exceptions::PyIndexError,
    prelude::*,
    types::{PyDict, PySlice},
};
use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};
use unic_builtin::motion::{STANDARD_CLIPS, STANDARD_SEED, standard_clip};
use unic_core::{StepInput, clip::Clip};
use unic_io::import_motion;

/// Motion of a character: a sequence of poses. A slice of step 1 is a motion too.
///
/// The constructor takes `rotations` of shape (T, J, 4) or (T, J, 3), `translations` of shape (T, 3)
/// and `wind` of shape (T, 3), with the meanings of `Pose`.
#[pyclass(frozen, module = "unic", sequence)]
pub(crate) struct Motion {
    pub(crate) clip: Arc<Clip>,
    notes: Vec<String>,
}

/// Iterator over the poses of a motion.
#[pyclass(frozen, module = "unic._unic")]
struct Poses {
    motion: Py<Motion>,
    next: AtomicUsize,
}

/// Frames that an index names.
enum Index<'py> {
    Frame(isize),
    Frames(Bound<'py, PySlice>),
}

impl<'py> FromPyObject<'_, 'py> for Index<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match value.cast::<PySlice>() {
            Ok(slice) => Ok(Self::Frames(slice.to_owned())),
            Err(_) => Ok(Self::Frame(value.extract()?)),
        }
    }
}

impl Motion {
    pub(crate) fn new(clip: Clip) -> Self {
        Self {
            clip: Arc::new(clip),
            notes: Vec::new(),
        }
    }
}

#[pymethods]
impl Motion {
    #[new]
    #[pyo3(signature = (rotations, translations, fps, *, ground_height=0.0, wind=None, name=""))]
    fn from_arrays(
        rotations: &Bound<'_, PyAny>,
        translations: &Bound<'_, PyAny>,
        fps: f32,
        ground_height: f32,
        wind: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> Result<Self> {
        let fps = check_fps(fps)?;
        let numbers = Numbers::read("rotations", rotations)?;
        let wrong = || {
            numbers.wrong_shape(
                "rotations",
                "(T, J, 4), quaternions x, y, z, w, or (T, J, 3), axis and angle",
            )
        };
        let [frames, joints, width] = numbers.shape[..] else {
            return Err(wrong());
        };
        let local = rotations_of(&numbers.data, width).ok_or_else(wrong)?;
        let trans = vectors("translations", translations, "T")?;
        let wind = wind.map_or(Ok(Vec::new()), |wind| vectors("wind", wind, "T"))?;
        for (what, found) in [("translations", trans.len()), ("wind", wind.len())] {
            if found != frames && !(what == "wind" && found == 0) {
                return Err(Error::value(
                    what,
                    format!("{frames} frames as in rotations"),
                    found,
                ));
            }
        }
        let pose = |(frame, trans): (usize, Vec3)| unic_core::Pose {
            trans,
            local: local[frame * joints..(frame + 1) * joints].to_vec(),
        };
        let poses = trans.into_iter().enumerate().map(pose).collect();
        Ok(Self::new(Clip {
            name: name.to_owned(),
            fps,
            poses,
            ground_height,
            wind,
        }))
    }

    /// Reads a motion file for a character: npz, BVH, glTF, FBX or USD, as `unic animate` does.
    ///
    /// The motion is resampled to `fps`: unless given that of the model or the capture, and for a
    /// character that of the file. `low_pass` is a cutoff in Hz, 0 for none. A probable mistake in
    /// the file is an error; with `force` it is a note.
    #[staticmethod]
    #[pyo3(signature = (path, character, **options), text_signature = "(path, character, *, fps=None, \
fps_of_file=None, metres_per_unit=None, up='auto', ground='auto', feet='auto', low_pass=None, repeat=None, \
bone_map=None, force=False)")]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        character: Wearer<'_>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> Result<Self> {
        let Options { reading, findings } = Options::read(character.fps(), options)?;
        let character = character.source();
        let import = detached(py, || Ok(import_motion(&path, character.get(), &reading)?))?;
        let mut notes = import.notes;
        match (&import.findings[..], findings) {
            ([], _) => {}
            (found, Findings::Note) => notes.extend(found.iter().map(ToString::to_string)),
            ([first, ..], Findings::Refuse) => {
                let text = format!("{}: {first}, or continue with force=True", path.display());
                return Err(Error::File { text, errno: None });
            }
        }
        Ok(Self {
            clip: Arc::new(import.clip),
            notes,
        })
    }

    /// Makes a built-in motion, one of those of `unic simulate --motion`.
    #[staticmethod]
    #[pyo3(signature = (name, character, fps=None))]
    fn built_in(py: Python<'_>, name: &str, character: Wearer<'_>, fps: Option<f32>) -> Result<Self> {
        let fps = check_fps(fps.or(character.fps()).unwrap_or(30.0))?;
        let character = character.source();
        let clip = detached(py, || {
            let clip = standard_clip(character.get(), name, STANDARD_SEED, fps);
            clip.map_err(|e| Error::Value(e.to_string()))
        })?;
        let unknown = || Error::value("name", format!("one of {}", STANDARD_CLIPS.join(", ")), name);
        clip.map(Self::new).ok_or_else(unknown)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.clip.name
    }

    #[getter]
    fn fps(&self) -> f32 {
        self.clip.fps
    }

    #[getter]
    fn ground_height(&self) -> f32 {
        self.clip.ground_height
    }

    /// Conversions that made the motion, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Rotations relative to the parents, shape (T, J, 4), a copy.
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray3<f32>>> {
        let joints = self.clip.poses.first().map_or(0, |pose| pose.local.len());
        let all: Vec<Quat> = self
            .clip
            .poses
            .iter()
            .flat_map(|pose| pose.local.iter().copied())
            .collect();
        let numbers: Vec<f32> = bytemuck::cast_slice(&all).to_vec();
        Ok(PyArray1::from_vec(py, numbers).reshape([self.clip.len(), joints, 4])?)
    }

    /// Positions of the root joint minus its rest position, shape (T, 3), a copy.
    #[getter]
    fn translations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        let all: Vec<Vec3> = self.clip.poses.iter().map(|pose| pose.trans).collect();
        copied(py, &all)
    }

    /// Velocity of the air, shape (T, 3), a copy.
    #[getter]
    fn wind<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        let all: Vec<Vec3> = (0..self.clip.len()).map(|t| self.clip.wind_at(t)).collect();
        copied(py, &all)
    }

    /// Same motion at another frame rate.
    fn resampled(&self, fps: f32) -> Result<Self> {
        Ok(Self::new(self.clip.resampled(check_fps(fps)?)))
    }

    /// Writes an npz file with the character's joint names, in the layout of AMASS.
    fn save(&self, py: Python<'_>, path: PathBuf, character: Wearer<'_>) -> Result<()> {
        let character = character.source();
        let names = character.get().skeleton.names();
        let found = self.clip.poses.first().map_or(0, |pose| pose.local.len());
        if found != names.len() {
            return Err(Error::value(
                "motion",
                format!("{} joints as in the character", names.len()),
                found,
            ));
        }
        detached(py, || Ok(unic_io::write_motion(&path, &self.clip, names)?))
    }

    fn __len__(&self) -> usize {
        self.clip.len()
    }

    fn __iter__(this: Bound<'_, Self>) -> Poses {
        Poses {
            motion: this.unbind(),
            next: AtomicUsize::new(0),
        }
    }

    fn __getitem__<'py>(&self, py: Python<'py>, index: Index<'py>) -> PyResult<Bound<'py, PyAny>> {
        let len = self.clip.len();
        match index {
            Index::Frame(frame) => {
                let from_start = if frame < 0 {
                    frame.checked_add_unsigned(len)
                } else {
                    Some(frame)
                };
                let found = from_start
                    .and_then(|frame| usize::try_from(frame).ok())
                    .filter(|&frame| frame < len);
                let frame = found.ok_or_else(|| {
                    PyIndexError::new_err(format!("motion: expected a frame below {len}, found {frame}"))
                })?;
                let pose = Pose::of(&StepInput::of_clip(&self.clip, frame));
                Ok(Bound::new(py, pose)?.into_any())
            }
            Index::Frames(slice) => {
                let range = slice.indices(isize::try_from(len).unwrap_or(isize::MAX))?;
                if range.step != 1 {
                    return Err(Error::value("motion", "a slice of step 1", range.step).into());
                }
                let start = range.start.unsigned_abs();
                let clip = Clip::clone(&self.clip).part(start..start + range.slicelength);
                Ok(Bound::new(py, Self::new(clip))?.into_any())
            }
        }
    }

    fn __repr__(&self) -> String {
        let Clip { name, fps, .. } = &*self.clip;
        format!(
            "<unic.Motion '{name}' of {} frames at {fps} fps>",
            self.clip.len()
        )
    }
}

#[pymethods]
impl Poses {
    fn __iter__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    fn __next__(&self) -> Option<Pose> {
        let clip = &self.motion.get().clip;
        let frame = self.next.fetch_add(1, Ordering::Relaxed);
        (frame < clip.len()).then(|| Pose::of(&StepInput::of_clip(clip, frame)))
    }
}

/// Checks a frame rate, in the range of all files.
fn check_fps(fps: f32) -> Result<f32> {
    match (1.0..=1000.0).contains(&fps) {
        true => Ok(fps),
        false => Err(Error::value("fps", "a frame rate from 1 to 1000", fps)),
    }
}
