//! Poses: the input of a step.

use crate::{
    arrays::copied,
    character::Wearer,
    error::{Error, Result},
    names::choose,
    numbers::{Numbers, vector},
};
use glam::{Quat, Vec3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use unic_core::{
    StepInput,
    skeleton::{Skeleton, rotation},
};

/// Pose of a character in one frame, with the ground and the air around it.
///
/// `rotations` are relative to the parent, and to the world at the root: quaternions of shape
/// (J, 4) or axes times angles of shape (J, 3). `translation` is the position of the root joint
/// minus its rest position. `wind` is the velocity of the air in m/s. `next` is the pose of the next
/// frame where it is known, which only models of the preset `paper` read.
#[pyclass(frozen, module = "unic")]
#[derive(Clone)]
pub(crate) struct Pose {
    pub(crate) pose: unic_core::Pose,
    pub(crate) next: Option<unic_core::Pose>,
    pub(crate) ground_height: f32,
    pub(crate) wind: Vec3,
}

/// Meaning of rotations in the world.
#[derive(Clone, Copy)]
enum Space {
    /// Orientations of the joints.
    World,
    /// Rotations from the rest pose, those of skinning matrices.
    FromRest,
}

impl Pose {
    pub(crate) fn input(&self) -> StepInput<'_> {
        StepInput {
            pose: &self.pose,
            next_pose: self.next.as_ref(),
            ground_height: self.ground_height,
            wind: self.wind,
        }
    }

    pub(crate) fn of(input: &StepInput<'_>) -> Self {
        Self {
            pose: input.pose.clone(),
            next: input.next_pose.cloned(),
            ground_height: input.ground_height,
            wind: input.wind,
        }
    }
}

#[pymethods]
impl Pose {
    #[new]
    #[pyo3(signature = (rotations, translation=None, *, ground_height=0.0, wind=None, next=None))]
    fn new(
        rotations: &Bound<'_, PyAny>,
        translation: Option<&Bound<'_, PyAny>>,
        ground_height: f32,
        wind: Option<&Bound<'_, PyAny>>,
        next: Option<&Bound<'_, Pose>>,
    ) -> Result<Self> {
        let numbers = Numbers::read("rotations", rotations)?;
        let local = match numbers.shape[..] {
            [_, width] => rotations_of(&numbers.data, width),
            _ => None,
        };
        let expected = "(J, 4), quaternions x, y, z, w, or (J, 3), axis and angle";
        let optional =
            |what, value: Option<&Bound<'_, PyAny>>| value.map_or(Ok(Vec3::ZERO), |v| vector(what, v));
        Ok(Self {
            pose: unic_core::Pose {
                trans: optional("translation", translation)?,
                local: local.ok_or_else(|| numbers.wrong_shape("rotations", expected))?,
            },
            next: next.map(|pose| pose.get().pose.clone()),
            ground_height,
            wind: optional("wind", wind)?,
        })
    }

    /// Pose of rotations in the world, shape (J, 4), and the position of the root joint.
    ///
    /// "from_rest" rotations are those of skinning matrices: the identity in the rest pose, whatever
    /// the axes of a rig's bones.
    #[staticmethod]
    #[pyo3(signature = (character, rotations, root, *, rotations_are="world", ground_height=0.0, wind=None))]
    fn from_world(
        character: Wearer<'_>,
        rotations: &Bound<'_, PyAny>,
        root: &Bound<'_, PyAny>,
        rotations_are: &str,
        ground_height: f32,
        wind: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self> {
        let names = [("world", Space::World), ("from_rest", Space::FromRest)];
        let space = choose("rotations_are", rotations_are, &names)?;
        let numbers = Numbers::read("rotations", rotations)?;
        let character = character.source();
        let skeleton = &character.get().skeleton;
        let joints = skeleton.len();
        let given = match numbers.shape[..] {
            [found, 4] if found == joints => rotations_of(&numbers.data, 4),
            _ => None,
        };
        let expected = format!("({joints}, 4), quaternions x, y, z, w");
        let given = given.ok_or_else(|| numbers.wrong_shape("rotations", &expected))?;
        Ok(Self {
            pose: local_pose(skeleton, &given, space, vector("root", root)?),
            next: None,
            ground_height,
            wind: wind.map_or(Ok(Vec3::ZERO), |wind| vector("wind", wind))?,
        })
    }

    /// Rest pose of a character.
    #[staticmethod]
    fn rest(character: Wearer<'_>) -> Self {
        Self {
            pose: character.source().get().skeleton.bind_pose(),
            next: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        }
    }

    /// Rotations relative to the parents, shape (J, 4), a copy.
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f32>>> {
        let numbers: Vec<f32> = bytemuck::cast_slice(&self.pose.local).to_vec();
        Ok(PyArray1::from_vec(py, numbers).reshape([self.pose.local.len(), 4])?)
    }

    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.pose.trans.to_array())
    }

    #[getter]
    fn wind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.wind.to_array())
    }

    #[getter]
    fn ground_height(&self) -> f32 {
        self.ground_height
    }

    /// Positions of the joints in the world, shape (J, 3).
    fn joints<'py>(&self, py: Python<'py>, character: Wearer<'_>) -> Result<Bound<'py, PyArray2<f32>>> {
        let character = character.source();
        let skeleton = &character.get().skeleton;
        let (expected, found) = (skeleton.len(), self.pose.local.len());
        if expected != found {
            return Err(Error::value("pose", format!("one of {expected} joints"), found));
        }
        let mut world_from_joint = Vec::new();
        skeleton.forward_kinematics(&self.pose, &mut world_from_joint);
        let positions: Vec<Vec3> = world_from_joint.iter().map(|joint| joint.translation).collect();
        copied(py, &positions)
    }

    fn __repr__(&self) -> String {
        format!(
            "<unic.Pose of {} joints at {}>",
            self.pose.local.len(),
            self.pose.trans
        )
    }
}

/// Rotations of rows of four or three numbers: quaternions, or axes times angles.
pub(crate) fn rotations_of(numbers: &[f32], width: usize) -> Option<Vec<Quat>> {
    match width {
        4 => Some(numbers.chunks_exact(4).map(Quat::from_slice).collect()),
        3 => Some(
            (numbers.chunks_exact(3))
                .map(|a| rotation(Vec3::from_slice(a)))
                .collect(),
        ),
        _ => None,
    }
}

/// Makes a pose of rotations in the world, one for each joint.
fn local_pose(skeleton: &Skeleton, given: &[Quat], space: Space, root: Vec3) -> unic_core::Pose {
    let mut rest = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut rest);
    let world_from_joint: Vec<Quat> = match space {
        Space::World => given.to_vec(),
        Space::FromRest => (given.iter().zip(&rest))
            .map(|(g, rest)| *g * rest.rotation)
            .collect(),
    };
    let local = |(joint, parent): (usize, &Option<usize>)| match parent {
        None => world_from_joint[joint],
        // Products of unit quaternions lose unit length in the last digits.
        Some(parent) => (world_from_joint[*parent].inverse() * world_from_joint[joint]).normalize(),
    };
    unic_core::Pose {
        trans: root - skeleton.joints()[skeleton.root()],
        local: skeleton.parents().iter().enumerate().map(local).collect(),
    }
}
