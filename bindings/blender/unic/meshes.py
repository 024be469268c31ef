# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Vertices and faces of Blender's objects as arrays, and objects that show a garment."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt

from .program import UnicError
from .rotations import Array

# Modifiers that make the mesh what it is. All others move its vertices and are off in its rest shape.
GENERATING = {"ARRAY", "BEVEL", "BUILD", "DECIMATE", "EDGE_SPLIT", "MIRROR", "NODES", "REMESH", "SCREW", "SOLIDIFY",
              "SUBSURF", "TRIANGULATE", "WELD", "WIREFRAME", "MULTIRES", "MASK", "BOOLEAN", "SKIN"}


@contextmanager
def only_modifiers(owner: bpy.types.Object, kinds: set[str]) -> Iterator[None]:
    """Switches off all modifiers of an object whose type is not among `kinds`."""
    before = [(modifier, modifier.show_viewport) for modifier in owner.modifiers]
    try:
        for modifier, shown in before:
            modifier.show_viewport = shown and modifier.type in kinds
        yield
    finally:
        for modifier, shown in before:
            modifier.show_viewport = shown


@contextmanager
def rest_position(armature: bpy.types.Object) -> Iterator[None]:
    """Puts an armature into its rest pose."""
    before = armature.data.pose_position
    try:
        armature.data.pose_position = "REST"
        yield
    finally:
        armature.data.pose_position = before


def current(context: bpy.types.Context) -> bpy.types.Depsgraph:
    """The evaluated scene in the current frame, after all changes so far."""
    context.view_layer.update()
    return context.evaluated_depsgraph_get()


def coordinates(mesh: bpy.types.Mesh) -> npt.NDArray[np.float32]:
    """Vertex positions (V, 3) of a mesh in its own space."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def set_coordinates(mesh: bpy.types.Mesh, positions: npt.NDArray[np.float32]) -> None:
    """Moves all vertices of a mesh; positions (V, 3) are in its own space."""
    mesh.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(positions, np.float32).ravel())
    mesh.update()


def world_positions(owner: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Array:
    """World positions (V, 3) of an object's vertices, with the modifiers that the viewport shows."""
    evaluated = owner.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        local = coordinates(mesh).astype(np.float64)
    finally:
        evaluated.to_mesh_clear()
    world = np.array(evaluated.matrix_world, np.float64)
    return local @ world[:3, :3].T + world[:3, 3]


def triangles(mesh: bpy.types.Mesh) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Vertices (F, 3) and corners (F, 3) of a mesh's triangles, counter-clockwise outside."""
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.loop_triangles), np.int32)
    corners = np.empty_like(vertices)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.loop_triangles.foreach_get("loops", corners)
    return vertices.reshape(-1, 3), corners.reshape(-1, 3)


def texture_coordinates(mesh: bpy.types.Mesh) -> npt.NDArray[np.float32] | None:
    """Texture coordinates (L, 2) of a mesh's corners, where it has them."""
    if mesh.uv_layers.active is None:
        return None
    flat = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", flat)
    return flat.reshape(-1, 2)


def write_obj(path: Path, positions: Array, mesh: bpy.types.Mesh) -> None:
    """Writes positions (V, 3) with the triangles and texture coordinates of a mesh as OBJ."""
    faces, corners = triangles(mesh)
    uvs = texture_coordinates(mesh)
    with path.open("w", encoding="ascii") as file:
        # Nine digits give back every f32.
        file.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in positions.astype(np.float32).tolist())
        if uvs is None:
            file.writelines(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist())
            return
        # Corners that share a place share its number: readers take others for seams.
        places, numbers = np.unique(uvs, axis=0, return_inverse=True)
        file.writelines(f"vt {u:.9g} {v:.9g}\n" for u, v in places.tolist())
        pairs = zip((faces + 1).tolist(), (numbers.ravel()[corners] + 1).tolist(), strict=True)
        file.writelines(f"f {a}/{i} {b}/{j} {c}/{k}\n" for (a, b, c), (i, j, k) in pairs)


@contextmanager
def rest_object(context: bpy.types.Context, garment: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """A garment as an object whose mesh is its rest shape: its own mesh with the modifiers that make
    it, and without those that deform it."""
    if not any(m.show_viewport and m.type in GENERATING for m in garment.modifiers):
        # Modifiers stay as they are: a switched one would make Blender forget a simulation.
        yield garment
        return
    with only_modifiers(garment, GENERATING), visible(garment):
        yield garment.evaluated_get(current(context))


@contextmanager
def visible(owner: bpy.types.Object) -> Iterator[None]:
    """Shows an object, because Blender does not evaluate hidden ones."""
    before = owner.hide_get()
    try:
        owner.hide_set(False)
        yield
    finally:
        owner.hide_set(before)


def shown_object(context: bpy.types.Context, name: str, garment: bpy.types.Object) -> bpy.types.Object:
    """Makes an object at the world's origin with the rest mesh and the materials of a garment.

    An object of that name which an earlier call has made is replaced.
    """
    with rest_object(context, garment) as rest:
        mesh = bpy.data.meshes.new_from_object(rest)
    before = bpy.data.objects.get(name)
    if before is not None and before.get("unic"):
        remove_object(before)
    mesh.name = name
    made = bpy.data.objects.new(name, mesh)
    made["unic"] = True
    for collection in garment.users_collection:
        collection.objects.link(made)
    return made


def remove_object(owner: bpy.types.Object) -> None:
    """Removes an object and its mesh."""
    mesh = owner.data
    bpy.data.objects.remove(owner)
    if mesh.users == 0:
        bpy.data.meshes.remove(mesh)


def check_visible(owner: bpy.types.Object) -> None:
    """Refuses an object that is hidden, because Blender does not evaluate it."""
    if not owner.visible_get():
        raise UnicError(f"{owner.name}: expected a visible object, found a hidden one; show it")
