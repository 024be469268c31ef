# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Settings: of the add-on in the preferences, and of a scene in its file."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .program import UnicError, find_library, find_program

# Without this option Blender 5 warns of paths that begin with the folder of its file; Blender 4.2 does
# not know the option.
RELATIVE = {"options": {"PATH_SUPPORTS_BLEND_RELATIVE"}} if bpy.app.version >= (5, 0, 0) else {}


def is_mesh(_settings: Settings, owner: bpy.types.Object) -> bool:
    """Whether an object may be chosen as character or garment."""
    return owner.type == "MESH"


class Preferences(bpy.types.AddonPreferences):
    """Paths of the program and of the library."""

    bl_idname = __package__

    program: StringProperty(
        name="Program", subtype="FILE_PATH",
        description="The program unic. Empty: the one that is found on PATH")
    library: StringProperty(
        name="Library", subtype="FILE_PATH",
        description="The library of unic, for live playing. Empty: the one beside the program")

    def draw(self, _context: bpy.types.Context) -> None:
        """Draws the preferences."""
        self.layout.prop(self, "program")
        self.layout.prop(self, "library")


class Settings(bpy.types.PropertyGroup):
    """What the panel shows."""

    character: PointerProperty(
        name="Character", type=bpy.types.Object, poll=is_mesh,
        description="Body mesh with an Armature modifier, without hair and clothes")
    garment: PointerProperty(
        name="Garment", type=bpy.types.Object, poll=is_mesh,
        description="Mesh of the garment, simulated or from a cache; its mesh without modifiers is its rest shape")
    rest: EnumProperty(
        name="Rest Shape", default="AUTO", description="The garment as it was made, on the character in its rest "
        "position. It defines the lengths of the cloth",
        items=[("AUTO", "Automatic", "The mesh; for Alembic and USD caches, whose mesh is a frame, the first frame"),
               ("MESH", "Mesh", "The mesh without the modifiers that deform it"),
               ("FRAME", "First Frame", "The first frame, moved back to the rest pose, wrinkles included")])
    frame_start: IntProperty(name="Start", default=1, min=0, description="First frame")
    frame_end: IntProperty(name="End", default=250, min=1, description="Last frame")
    clip: StringProperty(
        name="Clip", description="Name of the clip in the capture. Empty: that of the armature's action")
    purpose: EnumProperty(
        name="Use", default="TRAIN", description="What the clip is for",
        items=[("TRAIN", "Training", "The model learns from this clip"),
               ("TEST", "Held out", "The model never sees this clip; `unic eval` measures it there")])
    contacts: StringProperty(
        name="Feet", description="Left ankle, left foot, right ankle, right foot: names of bones, with commas "
        "between. Empty: found by their names")
    replaces: BoolProperty(name="Replace", description="Replace a clip of the same name")
    capture: StringProperty(
        name="Capture", subtype="DIR_PATH", default="//capture", description="Folder of the capture", **RELATIVE)
    budget: FloatProperty(
        name="Minutes", default=20.0, min=0.05, soft_max=600.0, description="Time for the training in minutes")
    model: StringProperty(
        name="Model", subtype="FILE_PATH", default="//garment.unic", description="Trained model", **RELATIVE)
    intersection: EnumProperty(
        name="Body", default="MODEL", description="What happens to cloth inside the body",
        items=[("MODEL", "Keep Out", "Vertices inside the body are moved out of it, as the model was trained"),
               ("OFF", "Ignore", "Vertices inside the body stay there")])
    cache: StringProperty(
        name="Cache", subtype="FILE_PATH", default="//garment.pc2", description="Mesh cache that Bake writes",
        **RELATIVE)


def of(context: bpy.types.Context) -> Settings:
    """Settings of the current scene."""
    return context.scene.unic


def preferences(context: bpy.types.Context) -> Preferences | None:
    """Preferences of the add-on. None while it is registered without being enabled, as in tests."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def program(context: bpy.types.Context) -> Path:
    """The program that the preferences name."""
    stored = preferences(context)
    return find_program(absolute_text(stored.program) if stored else "")


def library(context: bpy.types.Context) -> Path:
    """The library that the preferences name, or the one beside the program."""
    stored = preferences(context)
    if stored and stored.library:
        return find_library(absolute_text(stored.library), None)
    return find_library("", program(context))


def absolute_text(text: str) -> str:
    """A path in which `//` is the folder of the Blender file; empty for an empty one."""
    return os.path.abspath(bpy.path.abspath(text)) if text else ""


def path(text: str, name: str) -> Path:
    """The absolute path of a setting, which must be given, in a folder that must be known."""
    if not text:
        raise UnicError(f"{name}: expected a path, found none")
    if text.startswith("//") and not bpy.data.filepath:
        raise UnicError(f"{text}: expected a saved Blender file, in whose folder the path is, found none; save it")
    return Path(absolute_text(text))


def chosen(owner: bpy.types.Object | None, name: str) -> bpy.types.Object:
    """The object of a setting, which must be chosen."""
    if owner is None:
        raise UnicError(f"{name}: expected an object, found none; choose it in the panel")
    return owner


def frames(settings: Settings) -> range:
    """Frames of the range, both ends included: at least two."""
    found = range(settings.frame_start, settings.frame_end + 1)
    if len(found) < 2:
        raise UnicError(f"frames: expected at least two, found {settings.frame_start} to {settings.frame_end}")
    return found


CLASSES = (Preferences, Settings)


def register() -> None:
    """Adds the settings to scenes."""
    bpy.types.Scene.unic = PointerProperty(type=Settings)


def unregister() -> None:
    """Removes the settings from scenes."""
    del bpy.types.Scene.unic
