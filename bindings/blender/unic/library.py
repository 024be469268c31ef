# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The C interface of unic (`unic.h`) by ctypes: models and garments in motion.

Does not need Blender. All positions and rotations are in Blender's axes, in metres.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, byref, c_char_p, c_float, c_int32, c_size_t, c_uint32, c_void_p, sizeof
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .program import UnicError

ABI_VERSION = 1
STATUS_OK = 0
AXES_BLENDER = 3
THREADS_POOL = 1
ROOT_POSITION = 0
ROTATIONS_FROM_REST = 2


class Intersection(IntEnum):
    """`UnicIntersection`: what happens to vertices inside the body."""

    MODEL = 0
    OFF = 1


Floats = npt.NDArray[np.float32]


class ModelInfo(ctypes.Structure):
    """`UnicModelInfo`."""

    _fields_ = [("size", c_uint32), ("joint_count", c_uint32), ("root_joint", c_uint32),
                ("vertex_count", c_uint32), ("face_count", c_uint32), ("body_vertex_count", c_uint32),
                ("body_face_count", c_uint32), ("fps", c_float)]


class Options(ctypes.Structure):
    """`UnicOptions`."""

    _fields_ = [("size", c_uint32), ("precision", c_uint32), ("sampling", c_float), ("intersection", c_uint32),
                ("intersection_distance_m", c_float), ("axes", c_uint32), ("custom_axes", c_int32 * 3),
                ("metres_per_unit", c_float), ("vertex_layout", c_uint32), ("threads", c_uint32),
                ("thread_count", c_uint32), ("precision_error", c_float), ("parallel_for", c_void_p),
                ("parallel_context", c_void_p)]


class Pose(ctypes.Structure):
    """`UnicPose`."""

    _fields_ = [("root", c_float * 3), ("root_kind", c_uint32), ("rotation_kind", c_uint32),
                ("joint_count", c_uint32), ("rotations", c_void_p), ("rotation_stride", c_size_t)]


class StepInput(ctypes.Structure):
    """`UnicStepInput`."""

    _fields_ = [("size", c_uint32), ("ground_height", c_float), ("wind", c_float * 3), ("reserved", c_uint32),
                ("pose", POINTER(Pose)), ("next_pose", POINTER(Pose))]


class Vertices(ctypes.Structure):
    """`UnicVertices`."""

    _fields_ = [("positions", c_void_p), ("position_stride", c_size_t), ("normals", c_void_p),
                ("normal_stride", c_size_t), ("count", c_size_t)]


# Arguments after which a function is called. Handles are `c_void_p`, statuses `c_uint32`.
SIGNATURES: dict[str, list[Any]] = {
    "unic_model_from_path": [c_char_p, POINTER(c_void_p)],
    "unic_model_release": [c_void_p],
    "unic_model_info": [c_void_p, POINTER(ModelInfo)],
    "unic_model_joint_name": [c_void_p, c_uint32, POINTER(c_char_p)],
    "unic_model_joint_parents": [c_void_p, c_void_p, c_size_t],
    "unic_options_init": [POINTER(Options), c_uint32],
    "unic_instance_create": [c_void_p, POINTER(Options), POINTER(c_void_p)],
    "unic_instance_release": [c_void_p],
    "unic_instance_reset": [c_void_p, POINTER(StepInput), POINTER(Vertices)],
    "unic_instance_step": [c_void_p, POINTER(StepInput), POINTER(Vertices)],
    "unic_instance_rest_joints": [c_void_p, c_void_p, c_void_p, c_size_t],
}


class Library:
    """The loaded library."""

    def __init__(self, path: Path) -> None:
        try:
            self._functions = ctypes.CDLL(str(path))
        except OSError as error:
            raise UnicError(f"{path}: expected the library of unic, cannot load: {error}") from error
        try:
            self._declare()
        except AttributeError as error:
            raise UnicError(f"{path}: expected the library of unic, found another one: {error}") from error
        version = self._functions.unic_abi_version()
        if version != ABI_VERSION:
            raise UnicError(f"{path}: expected interface {ABI_VERSION}, found {version}; the add-on and the "
                            "library are of different versions")

    def _declare(self) -> None:
        for name, arguments in SIGNATURES.items():
            function = getattr(self._functions, name)
            function.argtypes, function.restype = arguments, c_uint32
        self._functions.unic_abi_version.restype = c_uint32
        self._functions.unic_last_error.restype = c_char_p

    def call(self, name: str, *arguments: Any) -> None:
        """Calls a function that returns a status. An error is raised with the library's sentence."""
        if getattr(self._functions, name)(*arguments) != STATUS_OK:
            raise UnicError(self._functions.unic_last_error().decode("utf-8", "replace"))


class Garment:
    """A model with one garment in motion on one character."""

    def __init__(self, library: Library, model: Path, intersection: Intersection) -> None:
        self._library = library
        self._model, self._instance = c_void_p(), c_void_p()
        library.call("unic_model_from_path", str(model).encode(), byref(self._model))
        try:
            self.info = ModelInfo(size=sizeof(ModelInfo))
            library.call("unic_model_info", self._model, byref(self.info))
            options = Options()
            library.call("unic_options_init", byref(options), sizeof(options))
            options.intersection = intersection
            options.axes, options.threads = AXES_BLENDER, THREADS_POOL
            library.call("unic_instance_create", self._model, byref(options), byref(self._instance))
        except UnicError:
            self.close()
            raise

    def close(self) -> None:
        """Releases the model and the garment. Further calls of this method do nothing."""
        if self._instance:
            self._library.call("unic_instance_release", self._instance)
        if self._model:
            self._library.call("unic_model_release", self._model)
        self._instance, self._model = c_void_p(), c_void_p()

    def joint_names(self) -> list[str]:
        """Names of the joints in the model's order."""
        name, names = c_char_p(), []
        for joint in range(self.info.joint_count):
            self._library.call("unic_model_joint_name", self._model, joint, byref(name))
            names.append((name.value or b"").decode())
        return names

    def joint_parents(self) -> list[int]:
        """Indices of the joints' parents, -1 for the root."""
        parents = np.empty(self.info.joint_count, np.int32)
        self._library.call("unic_model_joint_parents", self._model, parents.ctypes.data, len(parents))
        return [int(parent) for parent in parents]

    def rest_joints(self) -> Floats:
        """Positions (J, 3) of the joints in the rest pose."""
        joints = np.empty((self.info.joint_count, 3), np.float32)
        self._library.call("unic_instance_rest_joints", self._instance, joints.ctypes.data, None, len(joints))
        return joints

    def reset(self, root: Floats, rotations: Floats) -> Floats:
        """Begins a sequence in a pose and returns the garment (V, 3).

        `root` is the world position of the root joint, `rotations` (J, 4) are quaternions x, y, z, w
        in the world, from the rest pose.
        """
        return self._advance("unic_instance_reset", root, rotations)

    def step(self, root: Floats, rotations: Floats) -> Floats:
        """Advances by one tick to a pose, described as in `reset`, and returns the garment (V, 3)."""
        return self._advance("unic_instance_step", root, rotations)

    def _advance(self, name: str, root: Floats, rotations: Floats) -> Floats:
        rotations = np.ascontiguousarray(rotations, np.float32)
        pose = Pose(root=tuple(map(float, root)), root_kind=ROOT_POSITION, rotation_kind=ROTATIONS_FROM_REST,
                    joint_count=len(rotations), rotations=rotations.ctypes.data)
        step = StepInput(size=sizeof(StepInput), pose=ctypes.pointer(pose))
        positions = np.empty((self.info.vertex_count, 3), np.float32)
        to = Vertices(positions=positions.ctypes.data, count=len(positions))
        self._library.call(name, self._instance, byref(step), byref(to))
        return positions
