# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Bake of a trained garment to a mesh cache."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy

from . import program, settings
from .capture_files import frame_rate
from .export import write_motion
from .meshes import remove_object, shown_object
from .rig import Rig


class UNIC_OT_bake(bpy.types.Operator):
    """Animate the trained garment on the frame range and show it from a mesh cache"""

    bl_idname = "unic.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs a character and a garment."""
        chosen = settings.of(context)
        return chosen.character is not None and chosen.garment is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bakes, and hides the garment that the new object stands for."""
        try:
            made, frames, fps = bake(context)
        except program.UnicError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{made.name}: {frames} frames at {fps:g} fps")
        return {"FINISHED"}


def bake(context: bpy.types.Context) -> tuple[bpy.types.Object, int, float]:
    """Writes the cache and makes its object. Returns it with the cache's frames and their rate."""
    chosen = settings.of(context)
    garment = settings.chosen(chosen.garment, "garment")
    rig = Rig.of(settings.chosen(chosen.character, "character"))
    unic = settings.program(context)
    model, cache = settings.path(chosen.model, "model"), settings.path(chosen.cache, "cache").with_suffix(".pc2")
    cache.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".unic_bake_", dir=cache.parent) as name:
        folder = Path(name)
        write_motion(context, rig, folder / "motion.npz")
        words = ["animate", model, "--motion", "motion.npz", "--out", "baked.pc2"]
        if chosen.intersection == "OFF":
            words += ["--intersection", "off"]
        answer = program.run(unic, folder, *words)
        made = shown_object(context, f"{garment.name} baked", garment)
        if len(made.data.vertices) != answer["vertices"]:
            found = len(made.data.vertices)
            remove_object(made)
            raise program.UnicError(f"{garment.name}: expected {answer['vertices']} vertices as in {model.name}, found "
                                    f"{found}")
        # In the same folder, so that the cache appears complete.
        (folder / "baked.pc2").replace(cache)
    add_modifier(made, cache, context.scene, chosen.frame_start, answer["fps"])
    garment.hide_set(True)
    return made, answer["frames"], answer["fps"]


def add_modifier(made: bpy.types.Object, cache: Path, scene: bpy.types.Scene, start: int, fps: float) -> None:
    """Adds the cache to an object at the world's origin. Sample 0 is frame `start`."""
    modifier = made.modifiers.new("unic", "MESH_CACHE")
    modifier.cache_format, modifier.filepath = "PC2", shown_path(cache)
    # These axes turn unic's +Y up into Blender's +Z up.
    modifier.forward_axis, modifier.up_axis = "POS_Z", "NEG_Y"
    # Blender multiplies the frame first and then subtracts the start.
    modifier.frame_scale = fps / frame_rate(scene)
    modifier.frame_start = modifier.frame_scale * start


def shown_path(path: Path) -> str:
    """Path beside the Blender file where there is one, so that both can be moved."""
    if not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path))
    except ValueError:
        # Another drive of Windows.
        return str(path)


CLASSES = (UNIC_OT_bake,)
