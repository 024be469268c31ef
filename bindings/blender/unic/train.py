# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Training from the panel: a process beside Blender, its progress and its end."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from . import program, settings
from .training import Start, Training, run_folder

# Seconds between two looks at the process.
INTERVAL_S = 0.5

# The training of this Blender. One at a time: it takes all cores.
_running: Training | None = None
_last_message = ""


def running() -> Training | None:
    """The training that is at work."""
    return _running


def last_message() -> str:
    """Sentence on how the last training ended. Empty before."""
    return _last_message


class UNIC_OT_train(bpy.types.Operator):
    """Train a model on the capture, in a process beside Blender"""

    bl_idname = "unic.train"
    bl_label = "Train"

    start: EnumProperty(
        name="Start", default="new", options={"SKIP_SAVE"},
        items=[(Start.NEW.value, "New", "A model that does not exist yet"),
               (Start.REPLACE.value, "Replace", "Discard the model and its run"),
               (Start.RESUME.value, "Continue", "Continue a run that was cancelled")])

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """One training at a time."""
        return _running is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Starts the process. Without a window it waits for the end."""
        global _running
        try:
            _running = begin(context, Start(self.start))
        except program.UnicError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            bpy.app.timers.register(watch, first_interval=INTERVAL_S, persistent=True)
            return {"FINISHED"}
        is_trained = finish(_running, wait=True)
        self.report({"INFO"} if is_trained else {"ERROR"}, _last_message)
        return {"FINISHED"} if is_trained else {"CANCELLED"}


class UNIC_OT_cancel_training(bpy.types.Operator):
    """Save the training and end it. Train > Continue goes on from there"""

    bl_idname = "unic.cancel_training"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Needs a training."""
        return _running is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Asks the process to end."""
        if _running:
            _running.cancel()
        return {"FINISHED"}


def begin(context: bpy.types.Context, start: Start) -> Training:
    """Starts a training by the settings of the scene."""
    chosen = settings.of(context)
    capture = settings.path(chosen.capture, "capture")
    model = settings.path(chosen.model, "model")
    if start is Start.RESUME and not run_folder(model).is_dir():
        raise program.UnicError(f"{run_folder(model)}: expected a run to continue, found none")
    return Training(settings.program(context), capture, model, start, 60.0 * chosen.budget)


def watch() -> float | None:
    """Looks at the process: a timer of Blender, which ends with the process."""
    if _running is None:
        return None
    redraw()
    if _running.is_running():
        return INTERVAL_S
    finish(_running, wait=False)
    redraw()
    return None


def finish(training: Training, *, wait: bool) -> bool:
    """Takes the result of a process that has ended. Returns whether there is a model."""
    global _running, _last_message
    try:
        answer = training.wait() if wait else training.result()
        error = answer.get("validation_rmse_mm")
        held_out = f", {error:.1f} mm on held-out motion" if error is not None else ""
        _last_message = f"Trained in {answer['seconds']:.0f} s{held_out}"
        return True
    except program.UnicError as error:
        _last_message = str(error)
        return False
    finally:
        _running = None


def redraw() -> None:
    """Asks the 3D views to draw the panel again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


CLASSES = (UNIC_OT_train, UNIC_OT_cancel_training)


def unregister() -> None:
    """Saves and ends a training that is at work."""
    global _running
    if _running:
        _running.stop()
        _running = None
    if bpy.app.timers.is_registered(watch):
        bpy.app.timers.unregister(watch)
