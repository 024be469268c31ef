"""States are the same bytes in Python and in the C interface: what one has saved, the other continues
with the same positions.

Skipped unless $UNIC_LIBRARY names the folder of a libunic.so of the same sources, for an older one is another
interface: `cargo rustc --release -p unic-ffi --lib --crate-type cdylib`.
"""

import os
from ctypes import CDLL, POINTER, Structure, byref, c_char_p, c_float, c_size_t, c_uint32, c_void_p, sizeof
from pathlib import Path

import numpy as np
import pytest
import unic

TRANSLATION = 1
LOCAL = 0


class Pose(Structure):
    _fields_ = [("root", c_float * 3), ("root_kind", c_uint32), ("rotation_kind", c_uint32),
                ("joint_count", c_uint32), ("rotations", c_void_p), ("rotation_stride", c_size_t)]


class StepInput(Structure):
    _fields_ = [("size", c_uint32), ("ground_height", c_float), ("wind", c_float * 3), ("reserved", c_uint32),
                ("pose", POINTER(Pose)), ("next_pose", POINTER(Pose))]


class Vertices(Structure):
    _fields_ = [("positions", c_void_p), ("position_stride", c_size_t), ("normals", c_void_p),
                ("normal_stride", c_size_t), ("count", c_size_t)]


class Instance:
    """A garment in motion by the C interface, with the default options."""

    def __init__(self, library, model_path, vertex_count):
        self.library, self.vertex_count = library, vertex_count
        model, self.handle = c_void_p(), c_void_p()
        self.call("unic_model_from_path", str(model_path).encode(), byref(model))
        self.call("unic_instance_create", model, None, byref(self.handle))
        self.call("unic_model_release", model)

    def call(self, name, *arguments):
        if getattr(self.library, name)(*arguments) != 0:
            raise AssertionError(self.library.unic_last_error().decode())

    def play(self, name, pose):
        """Resets or steps. Returns the positions."""
        rotations = np.ascontiguousarray(pose.rotations, np.float32)
        given = Pose(tuple(map(float, pose.translation)), TRANSLATION, LOCAL, len(rotations), rotations.ctypes.data)
        positions = np.empty((self.vertex_count, 3), np.float32)
        step = StepInput(size=sizeof(StepInput), ground_height=pose.ground_height)
        step.pose.contents = given
        to = Vertices(positions=positions.ctypes.data, count=len(positions))
        self.call(name, self.handle, byref(step), byref(to))
        return positions

    def state(self):
        size = c_size_t()
        self.call("unic_instance_save", self.handle, None, c_size_t(0), byref(size))
        saved = np.empty(size.value, np.uint8)
        self.call("unic_instance_save", self.handle, c_void_p(saved.ctypes.data), size, byref(size))
        return saved.tobytes()

    def restore(self, state):
        self.call("unic_instance_restore", self.handle, state, c_size_t(len(state)), None)

    def release(self):
        self.call("unic_instance_release", self.handle)


@pytest.fixture
def instance(model_path, model):
    folder = os.environ.get("UNIC_LIBRARY")
    if folder is None:
        pytest.skip("UNIC_LIBRARY is not set: it names the folder of libunic.so")
    library = CDLL(str(Path(folder) / "libunic.so"))
    library.unic_last_error.restype = c_char_p
    made = Instance(library, model_path, model.vertex_count)
    yield made
    made.release()


def test_c_continues_a_state_of_python_and_gives_it_back(instance, model, motion):
    animator = unic.Animator(model)
    animator.reset(motion[0])
    for pose in motion[1:4]:
        animator.step(pose)
    instance.restore(animator.state())
    assert instance.state() == animator.state()
    for pose in motion[4:7]:
        assert instance.play("unic_instance_step", pose).tobytes() == animator.step(pose).tobytes()
    other = unic.Animator(model)
    other.restore(instance.state())
    assert other.step(motion[7]).tobytes() == animator.step(motion[7]).tobytes()


def test_python_continues_a_state_of_c(instance, model, motion):
    instance.play("unic_instance_reset", motion[0])
    for pose in motion[1:4]:
        instance.play("unic_instance_step", pose)
    animator = unic.Animator(model)
    animator.restore(instance.state())
    for pose in motion[4:7]:
        assert animator.step(pose).tobytes() == instance.play("unic_instance_step", pose).tobytes()
