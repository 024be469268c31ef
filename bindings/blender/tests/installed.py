# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Blender with the extension as a user has it: built, checked and installed by Blender's own tools.

Importing this module installs the extension: into a folder that lasts as long as the process, or into that
of BLENDER_USER_RESOURCES, which the program `blender` reads before it runs a script.
"""

from __future__ import annotations

import importlib
import os
import tempfile
from pathlib import Path
from types import ModuleType

FOLDER = tempfile.TemporaryDirectory(prefix="unic_blender_")
# Blender reads it once, when it is loaded.
os.environ.setdefault("BLENDER_USER_RESOURCES", FOLDER.name)

import bpy
from blender_program import PACKAGE, extension_tool, install

SOURCE = Path(__file__).resolve().parents[1] / "unic"


def build() -> Path:
    """Checks and builds the extension."""
    def tool(*words: str | Path) -> None:
        done = extension_tool([str(word) for word in words])
        assert done.returncode == 0, done.stdout + done.stderr

    tool("validate", SOURCE)
    tool("build", "--source-dir", SOURCE, "--output-dir", FOLDER.name)
    archive = next(Path(FOLDER.name).glob("unic-*.zip"))
    tool("validate", archive)
    return archive


def module(name: str) -> ModuleType:
    """A module of the installed extension."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def set_paths(program: Path) -> None:
    """Sets the program in the preferences, as a user does."""
    bpy.context.preferences.addons[PACKAGE].preferences.program = str(program)


install(build())
