# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Export of the scene as a clip of a capture."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from . import program, settings
from .capture_files import Body, GarmentRecorder, MotionRecorder, body_deviation, frame_rate, write_rest_shape
from .meshes import check_visible, current
from .rig import Rig

# Distance between the body of Blender and that of unic from which the user is told, in metres.
TOLD_DEVIATION_M = 0.001
# Modifiers that depend on the frames before.
SIMULATED = {"CLOTH", "SOFT_BODY"}


class UNIC_OT_export(bpy.types.Operator):
    """Write character, garment and frame range as a clip of a capture"""

    bl_idname = "unic.export_capture"
    bl_label = "Export Clip"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs a character and a garment."""
        chosen = settings.of(context)
        return chosen.character is not None and chosen.garment is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Exports, and reports what the capture has got."""
        try:
            answer, deviation = export(context)
        except program.UnicError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if deviation > TOLD_DEVIATION_M:
            self.report({"WARNING"}, f"The body of unic differs by up to {1e3 * deviation:.1f} mm: its bones do not "
                        "stretch and do not leave their parents")
        self.report({"INFO"}, f"Clip {answer['clip']}: {answer['frames']} frames at {answer['fps']:g} fps, "
                    f"{answer['vertices']} vertices; the capture has {answer['clips']} clips")
        return {"FINISHED"}


def export(context: bpy.types.Context) -> tuple[dict[str, Any], float]:
    """Adds the frame range as a clip to the capture, or makes the capture.

    Returns what `unic import` prints, and the deviation of the body in metres.
    """
    chosen = settings.of(context)
    unic = settings.program(context)
    capture = settings.path(chosen.capture, "capture")
    capture.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".unic_export_", dir=capture.parent) as folder:
        deviation = write_scene(context, Path(folder))
        answer = program.run(unic, Path(folder), *arguments(context, capture))
    return answer, deviation


def write_scene(context: bpy.types.Context, folder: Path) -> float:
    """Writes character, garment and motion of the frame range into a folder.

    Returns the deviation of the body in metres.
    """
    chosen = settings.of(context)
    character = settings.chosen(chosen.character, "character")
    garment = settings.chosen(chosen.garment, "garment")
    for owner in (character, garment):
        check_visible(owner)
    frames = settings.frames(chosen)
    with kept_frame(context.scene):
        # Where the mesh of a simulated garment is on the character.
        context.scene.frame_set(simulated_from(garment, frames))
        rig = Rig.of(character)
        body = Body(context, character, rig)
        body.write(folder / "character.npz")
        vertices, faces = write_rest_shape(context, garment, rig, folder / "garment.obj")
        motion = MotionRecorder(rig)
        recorder = GarmentRecorder(garment, folder / "garment.npy", len(frames), vertices)
        for frame in visited(context, simulated_from(garment, frames), frames[-1]):
            if frame in frames:
                depsgraph = current(context)
                motion.record(depsgraph)
                recorder.record(depsgraph, frame - frames[0])
        recorder.close()
        if rest_is_first_frame(chosen):
            recorder.write_npz(folder / "garment.npz", faces, frame_rate(context.scene))
        motion.write(folder / "motion.npz", frame_rate(context.scene))
        return body_deviation(context, body, [frames[0], frames[len(frames) // 2], frames[-1]])


def write_motion(context: bpy.types.Context, rig: Rig, path: Path) -> None:
    """Writes the motion of a rig in the frame range."""
    motion = MotionRecorder(rig)
    frames = settings.frames(settings.of(context))
    with kept_frame(context.scene):
        for _ in visited(context, frames[0], frames[-1]):
            motion.record(current(context))
    motion.write(path, frame_rate(context.scene))


def arguments(context: bpy.types.Context, capture: Path) -> list[str | Path]:
    """Command line of the import in the folder of the files, without the program."""
    chosen = settings.of(context)
    name = clip_name(context)
    garment = ["garment.npz"] if rest_is_first_frame(chosen) else ["garment.npy", "--rest", "garment.obj"]
    words: list[str | Path] = ["import", "--garment", *garment, "--character", "character.npz",
                               "--motion", "motion.npz", "--fps", f"{frame_rate(context.scene):.9g}",
                               "--clip", name, "--out", capture, "--provenance", provenance()]
    if chosen.purpose == "TEST":
        words += ["--test", name]
    if chosen.contacts:
        words += ["--contacts", chosen.contacts]
    if chosen.replaces:
        words.append("--overwrite")
    return words


def rest_is_first_frame(chosen: settings.Settings) -> bool:
    """Whether the first frame is the rest shape: where the garment's mesh is only a frame of a cache."""
    is_cached = any(m.type == "MESH_SEQUENCE_CACHE" and m.show_viewport for m in chosen.garment.modifiers)
    return chosen.rest == "FRAME" or (chosen.rest == "AUTO" and is_cached)


def provenance() -> str:
    """Sentence on the source, which travels into models."""
    name = Path(bpy.data.filepath).name or "a Blender scene"
    return f"exported from {name} by Blender {bpy.app.version_string}; licence not stated"


def clip_name(context: bpy.types.Context) -> str:
    """Name of the clip: as chosen, or that of the armature's action."""
    chosen = settings.of(context)
    if chosen.clip:
        return str(chosen.clip)
    motion = Rig.of(chosen.character).armature.animation_data
    name = motion.action.name if motion and motion.action else "clip"
    return re.sub(r"[^\w-]+", "_", name)


def simulated_from(garment: bpy.types.Object, frames: range) -> int:
    """Frame from which Blender must visit every frame: that of the simulation's first one."""
    starts = [m.point_cache.frame_start for m in garment.modifiers if m.type in SIMULATED and m.show_viewport]
    return min([frames[0], *starts])


@contextmanager
def kept_frame(scene: bpy.types.Scene) -> Iterator[None]:
    """Sets the current frame back afterwards."""
    before = scene.frame_current
    try:
        yield
    finally:
        scene.frame_set(before)


def visited(context: bpy.types.Context, first: int, last: int) -> Iterator[int]:
    """Sets one frame after the other, with progress at the mouse pointer."""
    manager = context.window_manager
    manager.progress_begin(first, last + 1)
    try:
        for frame in range(first, last + 1):
            context.scene.frame_set(frame)
            manager.progress_update(frame)
            yield frame
    finally:
        manager.progress_end()


CLASSES = (UNIC_OT_export,)
