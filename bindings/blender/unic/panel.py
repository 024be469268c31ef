# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Panels in the 3D view's sidebar, tab unic."""

from __future__ import annotations

import textwrap
from pathlib import Path

import bpy

from . import live, settings, train
from .training import Start, run_folder

# Mean width of a letter in pixels.
LETTER_WIDTH = 8.0


class Panel:
    """Place of the panels."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "unic"
    layout: bpy.types.UILayout


class UNIC_PT_scene(Panel, bpy.types.Panel):
    """Character, garment and frames, which all steps use"""

    bl_idname = "UNIC_PT_scene"
    bl_label = "Scene"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the panel."""
        layout, chosen = prepared(self.layout), settings.of(context)
        layout.prop(chosen, "character")
        layout.prop(chosen, "garment")
        layout.prop(chosen, "rest")
        column = layout.column(align=True)
        column.prop(chosen, "frame_start")
        column.prop(chosen, "frame_end")


class UNIC_PT_capture(Panel, bpy.types.Panel):
    """Export of a clip"""

    bl_idname = "UNIC_PT_capture"
    bl_label = "1  Capture"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the panel."""
        layout, chosen = prepared(self.layout), settings.of(context)
        layout.prop(chosen, "capture")
        layout.prop(chosen, "clip")
        layout.prop(chosen, "purpose")
        layout.prop(chosen, "contacts")
        layout.prop(chosen, "replaces")
        layout.operator("unic.export_capture", icon="EXPORT")


class UNIC_PT_train(Panel, bpy.types.Panel):
    """Training and its progress"""

    bl_idname = "UNIC_PT_train"
    bl_label = "2  Train"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the panel."""
        layout, chosen = prepared(self.layout), settings.of(context)
        layout.prop(chosen, "model")
        layout.prop(chosen, "budget")
        training = train.running()
        if training:
            layout.progress(factor=training.share(), text=f"{100 * training.share():.0f} %")
            error = training.held_out_mm()
            draw_text(layout, context, "Saving" if training.is_cancelled else training.status())
            if error is not None:
                layout.label(text=f"Held-out motion: {error:.1f} mm")
            layout.operator("unic.cancel_training", icon="CANCEL")
            return
        draw_starts(layout, Path(settings.absolute_text(chosen.model)))
        if train.last_message():
            draw_text(layout, context, train.last_message())


class UNIC_PT_use(Panel, bpy.types.Panel):
    """The trained garment on the rig"""

    bl_idname = "UNIC_PT_use"
    bl_label = "3  Animate"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the panel."""
        layout, chosen = prepared(self.layout), settings.of(context)
        layout.prop(chosen, "intersection")
        if live.is_live():
            layout.operator("unic.stop_live", icon="PAUSE")
        else:
            layout.operator("unic.play_live", icon="PLAY")
        if live.last_error():
            draw_text(layout, context, live.last_error())
        layout.prop(chosen, "cache")
        layout.operator("unic.bake", icon="FILE_CACHE")


def prepared(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """Layout with names to the left of values."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


def draw_text(layout: bpy.types.UILayout, context: bpy.types.Context, text: str) -> None:
    """Draws a sentence on as many lines as the panel's width asks for."""
    letters = int(context.region.width / (LETTER_WIDTH * context.preferences.system.ui_scale))
    column = layout.column(align=True)
    for line in textwrap.wrap(text, max(letters, 20)):
        column.label(text=line)


def draw_starts(layout: bpy.types.UILayout, model: Path) -> None:
    """Buttons that start a training: with a model or a run on the disk, the user chooses."""
    if model.exists() or run_folder(model).is_dir():
        row = layout.row(align=True)
        row.operator("unic.train", text="Train Anew", icon="FILE_REFRESH").start = Start.REPLACE.value
        row.operator("unic.train", text="Continue", icon="PLAY").start = Start.RESUME.value
        return
    layout.operator("unic.train", icon="PLAY").start = Start.NEW.value


CLASSES = (UNIC_PT_scene, UNIC_PT_capture, UNIC_PT_train, UNIC_PT_use)
