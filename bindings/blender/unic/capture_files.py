# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The scene as files that `unic import` and `unic animate` read.

Axes are unic's: +Y up, the character faces +Z, metres. All weights are kept.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt

from .meshes import (
    coordinates,
    current,
    only_modifiers,
    rest_object,
    rest_position,
    triangles,
    world_positions,
    write_obj,
)
from .program import UnicError
from .rig import Rig
from .rotations import UNIC_FROM_BLENDER, Array, axis_angles, to_unic

Indices = npt.NDArray[np.int32]


def frame_rate(scene: bpy.types.Scene) -> float:
    """Frames per second of a scene."""
    return scene.render.fps / scene.render.fps_base


class Body:
    """The character in its rest pose, in the rest space of its rig, in Blender's axes."""

    def __init__(self, context: bpy.types.Context, character: bpy.types.Object, rig: Rig) -> None:
        self.character, self.rig = character, rig
        with only_modifiers(character, {"ARMATURE"}), rest_position(rig.armature):
            world = world_positions(character, current(context))
        self.faces = triangles(character.data)[0]
        into = rig.rest_from_armature @ np.linalg.inv(np.array(rig.armature.matrix_world, np.float64))
        self.vertices = world @ into[:3, :3].T + into[:3, 3]
        self.weights = weights(character, rig.names)

    def posed(self, world_from_rest: Array) -> Array:
        """World positions (V, 3) of the body by linear blend skinning with rigid joints."""
        total = self.weights.sum(axis=1, keepdims=True)
        moved = np.einsum("jab,vb->vja", world_from_rest[:, :3, :3], self.vertices) + world_from_rest[:, :3, 3]
        return np.einsum("vj,vja->va", self.weights / total, moved)

    def write(self, path: Path) -> None:
        """Writes `character.npz`."""
        np.savez(path, vertices=to_unic(self.vertices).astype(np.float32), faces=self.faces,
                 joints=to_unic(self.rig.rest_joints()).astype(np.float32),
                 parents=np.array(self.rig.parents, np.int32), weights=self.weights.astype(np.float32),
                 joint_names=np.array(self.rig.names))


def weights(character: bpy.types.Object, names: list[str]) -> Array:
    """Skinning weights (V, J) of a character's vertices for the named bones."""
    joints = {name: j for j, name in enumerate(names)}
    of_group = {group.index: joints.get(group.name) for group in character.vertex_groups}
    table = np.zeros((len(character.data.vertices), len(names)))
    for vertex in character.data.vertices:
        for entry in vertex.groups:
            joint = of_group.get(entry.group)
            if joint is not None:
                table[vertex.index, joint] = entry.weight
    bare = int((table.sum(axis=1) <= 0).sum())
    if bare:
        raise UnicError(f"{character.name}: expected weights at every vertex, found {bare} vertices without any")
    return table


class MotionRecorder:
    """Poses of a rig, frame by frame."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._poses: list[Array] = []
        self._trans: list[Array] = []

    def record(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Records the current frame."""
        root, rotations = self.rig.root_and_rotations(depsgraph)
        turned = UNIC_FROM_BLENDER @ rotations @ UNIC_FROM_BLENDER.T
        local = turned.copy()
        local[1:] = turned[self.rig.parents[1:]].transpose(0, 2, 1) @ turned[1:]
        self._poses.append(axis_angles(local).ravel())
        self._trans.append(to_unic(root - self.rig.rest_joints()[0]))

    def write(self, path: Path, fps: float) -> None:
        """Writes a motion file."""
        np.savez(path, poses=np.array(self._poses), trans=np.array(self._trans), mocap_framerate=fps,
                 joint_names=np.array(self.rig.names))


class GarmentRecorder:
    """Positions of a garment, frame by frame, in a file that grows on the disk and not in memory."""

    def __init__(self, garment: bpy.types.Object, path: Path, frames: int, vertices: int) -> None:
        self.garment = garment
        self._rows = np.lib.format.open_memmap(path, "w+", np.float32, (frames, vertices, 3))

    def record(self, depsgraph: bpy.types.Depsgraph, row: int) -> None:
        """Records the current frame as a row of the file."""
        world = world_positions(self.garment, depsgraph)
        if len(world) != self._rows.shape[1]:
            raise UnicError(f"{self.garment.name}: expected {self._rows.shape[1]} vertices as in its rest shape, found "
                            f"{len(world)} in frame {depsgraph.scene.frame_current}")
        self._rows[row] = to_unic(world)

    def close(self) -> None:
        """Completes the file."""
        self._rows.flush()

    def write_npz(self, path: Path, faces: Indices, fps: float) -> None:
        """Writes the positions with faces (F, 3), from which a rest shape can be made."""
        np.savez(path, vertices=self._rows, faces=faces, fps=fps)


def write_rest_shape(context: bpy.types.Context, garment: bpy.types.Object, rig: Rig,
                     path: Path) -> tuple[int, Indices]:
    """Writes the garment without its deformation, in the rest space, as OBJ.

    Returns its number of vertices, and its faces (F, 3).
    """
    armature = np.array(rig.armature.matrix_world, np.float64)
    into = rig.rest_from_armature @ np.linalg.inv(armature) @ np.array(garment.matrix_world, np.float64)
    with rest_object(context, garment) as rest:
        mesh = rest.to_mesh()
        local = coordinates(mesh).astype(np.float64)
        write_obj(path, to_unic(local @ into[:3, :3].T + into[:3, 3]), mesh)
        faces = triangles(mesh)[0]
        rest.to_mesh_clear()
    return len(local), faces


def body_deviation(context: bpy.types.Context, body: Body, frames: list[int]) -> float:
    """Largest distance in metres between the body as Blender shows it and as unic poses it.

    Joints of unic are rigid: bones that stretch, grow or leave their parents differ.
    """
    largest = 0.0
    with only_modifiers(body.character, {"ARMATURE"}):
        for frame in frames:
            context.scene.frame_set(frame)
            depsgraph = current(context)
            posed = body.posed(body.rig.rigid(*body.rig.root_and_rotations(depsgraph)))
            shown = world_positions(body.character, depsgraph)
            largest = max(largest, float(np.linalg.norm(posed - shown, axis=1).max()))
    return largest
