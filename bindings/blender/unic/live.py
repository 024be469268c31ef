# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Live playing: the garment follows the rig frame by frame, by the library of unic.

The garment has a memory, so frames must follow each other. The next frame, or one a few frames
ahead as when Blender drops frames, is stepped to. Any other frame begins a new sequence at rest.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import program, settings
from .capture_files import frame_rate
from .library import Garment, Intersection, Library
from .meshes import remove_object, set_coordinates, shown_object
from .rig import Rig, armature_modifier
from .rotations import Array, between, quaternions

# Frames that are bridged by poses between the two that are known.
MOST_BRIDGED = 8
# Largest distance in metres between a joint of the model and that of the armature, at rest.
LARGEST_REST_DISTANCE_M = 0.002
# Largest relative difference of frame rates: 29.97 is not 30.
LARGEST_RATE_DIFFERENCE = 1e-4


class LiveGarment:
    """A garment that follows an armature. Objects are kept by name: undo makes new ones."""

    def __init__(self, garment: Garment, armature: bpy.types.Object, hidden: str) -> None:
        self.garment = garment
        self.armature, self.hidden, self.shown = armature.name, hidden, ""
        self.names, self.parents = garment.joint_names(), garment.joint_parents()
        self._check_rest(armature)
        self._frame: int | None = None
        self._root: Array = np.zeros(3)
        self._rotations: Array = np.zeros((len(self.names), 4))

    def _check_rest(self, armature: bpy.types.Object) -> None:
        rest = Rig.named(armature, self.names, self.parents).rest_joints()
        distances = np.linalg.norm(rest - self.garment.rest_joints(), axis=1)
        worst = int(distances.argmax())
        if distances[worst] > LARGEST_REST_DISTANCE_M:
            raise program.UnicError(f"{armature.name}: expected the rest pose of the model's character, found bone "
                                    f"{self.names[worst]} {1e3 * distances[worst]:.0f} mm away")

    def follow(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        """Moves the garment to the current frame."""
        armature, shown = scene.objects.get(self.armature), scene.objects.get(self.shown)
        if armature is None or shown is None or scene.frame_current == self._frame:
            return
        root, matrices = Rig.named(armature, self.names, self.parents).root_and_rotations(depsgraph)
        set_coordinates(shown.data, self._moved(scene.frame_current, root, quaternions(matrices)))

    def _moved(self, frame: int, root: Array, rotations: Array) -> Any:
        ahead = frame - self._frame if self._frame is not None else 0
        if not 1 <= ahead <= MOST_BRIDGED:
            positions = self.garment.reset(root, rotations)
        for tick in range(1, ahead + 1) if 1 <= ahead <= MOST_BRIDGED else ():
            share = tick / ahead
            positions = self.garment.step(self._root + share * (root - self._root),
                                          between(self._rotations, rotations, share))
        self._frame, self._root, self._rotations = frame, root, rotations
        return positions


# The garment that is live. One at a time.
_live: LiveGarment | None = None
_error = ""


def is_live() -> bool:
    """Whether a garment follows the rig."""
    return _live is not None


def last_error() -> str:
    """Sentence on why the last garment stopped. Empty where none did."""
    return _error


class UNIC_OT_play_live(bpy.types.Operator):
    """Let the trained garment follow the rig while frames are played"""

    bl_idname = "unic.play_live"
    bl_label = "Play Live"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs a character and a garment."""
        chosen = settings.of(context)
        return _live is None and chosen.character is not None and chosen.garment is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Starts at the current frame."""
        try:
            start(context)
        except program.UnicError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class UNIC_OT_stop_live(bpy.types.Operator):
    """Remove the live garment and show the other one again"""

    bl_idname = "unic.stop_live"
    bl_label = "Stop"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Needs a live garment."""
        return _live is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Stops."""
        if _live:
            shown, hidden = (context.scene.objects.get(name) for name in (_live.shown, _live.hidden))
            if shown is not None:
                remove_object(shown)
            if hidden is not None:
                hidden.hide_set(False)
        forget()
        return {"FINISHED"}


def start(context: bpy.types.Context) -> None:
    """Makes the garment live at the current frame."""
    global _live, _error
    chosen = settings.of(context)
    original = settings.chosen(chosen.garment, "garment")
    armature = armature_modifier(settings.chosen(chosen.character, "character")).object
    garment = Garment(Library(settings.library(context)), settings.path(chosen.model, "model"),
                      Intersection[chosen.intersection])
    try:
        check_rate(context.scene, garment.info.fps)
        made = LiveGarment(garment, armature, original.name)
        shown = shown_object(context, f"{original.name} live", original)
        if len(shown.data.vertices) != garment.info.vertex_count:
            found = len(shown.data.vertices)
            remove_object(shown)
            raise program.UnicError(f"{original.name}: expected {garment.info.vertex_count} vertices as in the model, "
                                    f"found {found}")
    except program.UnicError:
        garment.close()
        raise
    # Blender shortens long names, and numbers those that are taken.
    made.shown = shown.name
    _live, _error = made, ""
    original.hide_set(True)
    made.follow(context.scene, context.evaluated_depsgraph_get())


def check_rate(scene: bpy.types.Scene, fps: float) -> None:
    """Refuses a scene with another frame rate than the model's."""
    found = frame_rate(scene)
    if abs(found - fps) > LARGEST_RATE_DIFFERENCE * fps:
        raise program.UnicError(f"frame rate: expected the model's, {fps:g}, found {found:g}; Bake takes any rate")


@bpy.app.handlers.persistent
def forget(*_arguments: Any) -> None:
    """Releases the live garment without a change of the scene."""
    global _live
    if _live:
        _live.garment.close()
    _live = None


@bpy.app.handlers.persistent
def frame_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Handler that Blender calls after each change of the frame."""
    global _error
    if _live is None:
        return
    try:
        _live.follow(scene, depsgraph)
    except program.UnicError as error:
        _error = str(error)
        forget()


CLASSES = (UNIC_OT_play_live, UNIC_OT_stop_live)


def register() -> None:
    """Adds the handlers."""
    bpy.app.handlers.frame_change_post.append(frame_changed)
    bpy.app.handlers.load_pre.append(forget)


def unregister() -> None:
    """Removes the handlers and the live garment."""
    forget()
    bpy.app.handlers.frame_change_post.remove(frame_changed)
    bpy.app.handlers.load_pre.remove(forget)
