# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The scene that the checks of the extension work on, and what they compare it with."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
from installed import module
from mathutils import Matrix

from example_scene import BLENDER_FROM_UNIC, FIRST_FRAME

# Words behind `--` where Blender has a command line of its own.
WORDS = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
UNIC = Path(WORDS[0]).resolve()
SHORT_TRAINING_MINUTES = 5 / 60


def unic(*arguments: str | Path) -> None:
    """Runs the program, which must succeed."""
    done = subprocess.run([UNIC, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def distance(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest distance between positions, in metres."""
    assert found.shape == expected.shape, (found.shape, expected.shape)
    return float(np.linalg.norm(found - expected, axis=-1).max())


def shown(name: str) -> np.ndarray:
    """World positions of an object in the current frame, in unic's axes."""
    meshes = module("meshes")
    return meshes.world_positions(bpy.data.objects[name], meshes.current(bpy.context)) @ BLENDER_FROM_UNIC


def refused(operator: Callable[..., object], words: str, **options: object) -> None:
    """Checks that an operator ends with an error of these words."""
    try:
        operator(**options)
    except RuntimeError as error:
        assert words in str(error), f"expected `{words}`, found: {error}"
        return
    raise AssertionError(f"expected an error with `{words}`, found none")


class Scene:
    """The scene of a clip, and what is known about it."""

    def __init__(self, folder: Path, capture: Path, clip: str) -> None:
        self.folder, self.capture, self.clip = folder, capture, clip
        self.motion = capture / f"clips/{clip}.npz"
        self.garment = np.load(capture / f"clips/{clip}.garment.npy")
        self.blend = folder / "scene.blend"

    def open(self) -> bpy.types.PropertyGroup:
        """Opens the scene anew, with character, garment and frames chosen. Returns the settings."""
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        settings = bpy.context.scene.unic
        settings.character, settings.garment = bpy.data.objects["body"], bpy.data.objects["coat"]
        settings.frame_start, settings.frame_end = FIRST_FRAME, FIRST_FRAME + len(self.garment) - 1
        settings.capture, settings.model, settings.cache = "//capture", "//coat.unic", "//baked.pc2"
        settings.budget = SHORT_TRAINING_MINUTES
        return settings

    def animated(self, intersection: str) -> np.ndarray:
        """Garment (T, V, 3) that the program makes of the clip."""
        out = self.folder / f"{intersection}.npz"
        words = ["--intersection", "off"] if intersection == "OFF" else []
        if not out.exists():
            unic("animate", self.folder / "coat.unic", "--motion", self.motion, "--out", out, *words)
        return np.load(out)["vertices"]

    def frames(self) -> Iterator[tuple[int, int]]:
        """Sets every frame. Gives its number in the scene, and in the clip."""
        for row in range(len(self.garment)):
            bpy.context.scene.frame_set(FIRST_FRAME + row)
            yield FIRST_FRAME + row, row


def posed_body(character: Path, motion: Path, row: int) -> np.ndarray:
    """Body of a capture in a frame, by the kinematics of docs/reference/capture.md, without a rest pose."""
    c, m = np.load(character), np.load(motion)
    names = [str(name) for name in c["joint_names"]]
    order = [[str(name) for name in m["joint_names"]].index(name) for name in names]
    turns = m["poses"][row].reshape(-1, 3)[order].astype(float)
    quaternion = [Matrix.Rotation(np.linalg.norm(t), 3, t) if np.linalg.norm(t) > 0 else Matrix.Identity(3)
                  for t in turns]
    turned, places = [None] * len(names), [None] * len(names)
    joints = c["joints"].astype(float)
    waiting = list(range(len(names)))
    while waiting:
        j = waiting.pop(0)
        parent = c["parents"][j]
        if parent >= 0 and turned[parent] is None:
            waiting.append(j)
            continue
        own = np.array(quaternion[j], float)
        turned[j] = own if parent < 0 else turned[parent] @ own
        places[j] = (joints[j] + m["trans"][row] if parent < 0
                     else places[parent] + turned[parent] @ (joints[j] - joints[parent]))
    weights = c["weights"] / c["weights"].sum(axis=1, keepdims=True)
    rest = c["vertices"].astype(float)
    return sum(weights[:, j:j + 1] * ((rest - joints[j]) @ turned[j].T + places[j]) for j in range(len(names)))


def curves(owner: bpy.types.Object) -> Iterator[bpy.types.FCurve]:
    """Curves of an object's action. Actions of Blender 5 have them in channel bags."""
    action = owner.animation_data.action
    if hasattr(action, "fcurves"):
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def read_pc2(path: Path) -> np.ndarray:
    """Positions (T, V, 3) of a point cache."""
    data = path.read_bytes()
    points, samples = (int(np.frombuffer(data, "<i4", 1, at)[0]) for at in (16, 28))
    return np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)
