# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Blender with the extension as a user has it: built, checked and installed by Blender's own tools.

Importing this module installs the extension: into a folder that lasts as long as the process, or into that
of BLENDER_USER_RESOURCES, which the program `blender` reads before it runs a script.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType

FOLDER = tempfile.TemporaryDirectory(prefix="unic_blender_")
# Blender reads it once, when it is loaded.
os.environ.setdefault("BLENDER_USER_RESOURCES", FOLDER.name)

import bpy

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "bl_ext.user_default.unic"


def extension_tool(*arguments: str | Path) -> str:
    """Runs Blender's tool for extensions, which `blender --command extension` is."""
    paths = (Path(path) / "addons_core/bl_pkg/cli/blender_ext.py" for path in bpy.utils.script_paths())
    tool = next(path for path in paths if path.is_file())
    done = subprocess.run([sys.executable, tool, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def install() -> None:
    """Builds, checks and installs the extension."""
    extension_tool("validate", ROOT / "unic")
    extension_tool("build", "--source-dir", ROOT / "unic", "--output-dir", FOLDER.name)
    archive = next(Path(FOLDER.name).glob("unic-*.zip"))
    extension_tool("validate", archive)
    bpy.ops.extensions.package_install_files(filepath=str(archive), repo="user_default", enable_on_install=False)
    # Python may have looked into the folder in the same tick of the clock, before the files were there.
    importlib.invalidate_caches()
    bpy.ops.preferences.addon_enable(module=PACKAGE)


def module(name: str) -> ModuleType:
    """A module of the installed extension."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def set_paths(program: Path) -> None:
    """Sets the program in the preferences, as a user does."""
    bpy.context.preferences.addons[PACKAGE].preferences.program = str(program)


install()
