# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""A character's armature as unic sees it: joints, their parents, rest pose and poses.

The rest space is where the character stands upright at the world's origin, in Blender's axes. It
follows from the armature's own rest pose, so that it is the same for every clip.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import bpy
import numpy as np
from mathutils import Euler, Matrix

from .program import UnicError
from .rotations import Array, nearest_rotations


def armature_modifier(character: bpy.types.Object) -> bpy.types.ArmatureModifier:
    """The armature modifier of a character, whose deformation must be linear blend skinning."""
    found = [m for m in character.modifiers if m.type == "ARMATURE" and m.object and m.show_viewport]
    if len(found) != 1:
        raise UnicError(f"{character.name}: expected one Armature modifier with an armature, found {len(found)}")
    modifier = found[0]
    if modifier.use_deform_preserve_volume:
        raise UnicError(f"{character.name}: expected linear skinning, found Preserve Volume; switch it off")
    if modifier.use_bone_envelopes or not modifier.use_vertex_groups:
        raise UnicError(f"{character.name}: expected bones that are bound to Vertex Groups alone, found Envelopes")
    return modifier


@dataclass(frozen=True)
class Rig:
    """Joints of an armature. Those that `of` finds have parents before children."""

    armature: bpy.types.Object
    names: list[str]
    parents: list[int]
    # Matrices (J, 4, 4) of the bones in the armature's rest pose, in the armature's space.
    rest_bones: Array
    # Matrix (4, 4) from the armature's space to the rest space.
    rest_from_armature: Array

    @staticmethod
    def of(character: bpy.types.Object) -> Rig:
        """The rig that moves a character: bones with weights, and those between them."""
        armature = armature_modifier(character).object
        bones = connected(armature, weighted_bones(character, armature))
        names = [bone.name for bone in bones]
        index = {name: i for i, name in enumerate(names)}
        parents = [-1] + [index[bone.parent.name] for bone in bones[1:]]
        rest = np.array([bone.matrix_local for bone in bones], np.float64)
        return Rig(armature, names, parents, rest, np.array(rest_space(armature), np.float64))

    @staticmethod
    def named(armature: bpy.types.Object, names: list[str], parents: list[int]) -> Rig:
        """The rig with the given joints, which are bones of the armature."""
        missing = [name for name in names if name not in armature.data.bones]
        if missing:
            raise UnicError(f"{armature.name}: expected the bones of the model's character, missing: "
                            f"{', '.join(missing[:5])}{' and more' if len(missing) > 5 else ''}")
        rest = np.array([armature.data.bones[name].matrix_local for name in names], np.float64)
        return Rig(armature, names, parents, rest, np.array(rest_space(armature), np.float64))

    def root(self) -> int:
        """Index of the root joint."""
        return self.parents.index(-1)

    def rest_joints(self) -> Array:
        """Positions (J, 3) of the joints in the rest space."""
        return (self.rest_from_armature @ self.rest_bones)[:, :3, 3]

    def world_from_rest(self, depsgraph: bpy.types.Depsgraph) -> Array:
        """Matrices (J, 4, 4) that move the rest space with each joint, in the current frame."""
        armature = self.armature.evaluated_get(depsgraph)
        world = np.array(armature.matrix_world, np.float64)
        bones = armature.pose.bones
        posed = np.array([bones[name].matrix for name in self.names], np.float64)
        back = np.linalg.inv(self.rest_bones) @ np.linalg.inv(self.rest_from_armature)
        return world @ posed @ back

    def root_and_rotations(self, depsgraph: bpy.types.Depsgraph) -> tuple[Array, Array]:
        """World position (3,) of the root and rotations (J, 3, 3) from rest, in the current frame."""
        moved = self.world_from_rest(depsgraph)
        of_root = moved[self.root()]
        root = of_root[:3, :3] @ self.rest_joints()[self.root()] + of_root[:3, 3]
        return root, nearest_rotations(moved[:, :3, :3])

    def rigid(self, root: Array, rotations: Array) -> Array:
        """Matrices (J, 4, 4) that move the rest space with each joint of a skeleton that does not stretch."""
        rest = self.rest_joints()
        places = np.empty_like(rest)
        for j, parent in enumerate(self.parents):
            places[j] = root if parent < 0 else places[parent] + rotations[parent] @ (rest[j] - rest[parent])
        moved = np.tile(np.eye(4), (len(rest), 1, 1))
        moved[:, :3, :3] = rotations
        moved[:, :3, 3] = places - np.einsum("jab,jb->ja", rotations, rest)
        return moved


def rest_space(armature: bpy.types.Object) -> Matrix:
    """Matrix from the armature's space to the rest space: its scale and its quarter turns.

    Importers of Y-up files turn the armature by 90° about X and scale it by 0.01; both belong to the
    rest pose. Its place, its heading and smaller turns are motion.
    """
    _, rotation, scale = armature.matrix_world.decompose()
    if max(scale) - min(scale) > 1e-4 * max(scale) or min(scale) <= 0:
        raise UnicError(f"{armature.name}: expected one scale in all directions, found {tuple(scale)}; apply it")
    euler = rotation.to_euler("XYZ")
    quarter = Euler((round(euler.x / (pi / 2)) * pi / 2, round(euler.y / (pi / 2)) * pi / 2, 0.0), "XYZ")
    return Matrix.LocRotScale(None, quarter, scale)


def weighted_bones(character: bpy.types.Object, armature: bpy.types.Object) -> set[str]:
    """Names of the bones that move a vertex of the character."""
    groups = {group.index: group.name for group in character.vertex_groups}
    used = {g.group for vertex in character.data.vertices for g in vertex.groups if g.weight > 0}
    bones = armature.data.bones
    names = {groups[i] for i in used if groups.get(i) in bones and bones[groups[i]].use_deform}
    if not names:
        raise UnicError(f"{character.name}: expected vertex groups with the names of bones, found none")
    return names


def connected(armature: bpy.types.Object, names: set[str]) -> list[bpy.types.Bone]:
    """The named bones and those between them and their nearest common parent, parents first."""
    bones = armature.data.bones
    chains = [[bones[name], *bones[name].parent_recursive] for name in sorted(names)]
    common = set.intersection(*({bone.name for bone in chain} for chain in chains))
    top = next((bone.name for bone in chains[0] if bone.name in common), None)
    if top is None:
        roots = sorted({chain[-1].name for chain in chains})
        raise UnicError(f"{armature.name}: expected one root bone, found {', '.join(roots[:5])}; parent them to one")
    below = {bone.name for chain in chains for bone in chain[: [b.name for b in chain].index(top) + 1]}
    # `bones` lists parents before their children.
    return [bone for bone in bones if bone.name in below]
