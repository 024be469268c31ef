# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The program `blender` without a window, made of its Python package: what docs/tutorial.md uses of it.

    python3 blender_program.py --command extension build --source-dir FOLDER --output-dir FOLDER
    python3 blender_program.py --command extension install-file --repo user_default --enable FILE.zip
    python3 blender_program.py --background --python SCRIPT -- WORD...
"""

from __future__ import annotations

import importlib
import runpy
import subprocess
import sys
from pathlib import Path

import bpy

PACKAGE = "bl_ext.user_default.unic"


def extension_tool(words: list[str]) -> subprocess.CompletedProcess[str]:
    """Runs Blender's tool for extensions, which `blender --command extension` is."""
    paths = (Path(path) / "addons_core/bl_pkg/cli/blender_ext.py" for path in bpy.utils.script_paths())
    tool = next(path for path in paths if path.is_file())
    return subprocess.run([sys.executable, tool, *words], capture_output=True, text=True, check=False)


def enable() -> None:
    """Enables the extension, which must be installed."""
    # Python may have looked into the folder in the same tick of the clock, before the files were there.
    importlib.invalidate_caches()
    bpy.ops.preferences.addon_enable(module=PACKAGE)


def install(archive: Path) -> None:
    """Installs the extension from an archive, and enables it."""
    bpy.ops.extensions.package_install_files(filepath=str(archive), repo="user_default", enable_on_install=False)
    enable()


def main(words: list[str]) -> int:
    """Does what a command line says."""
    match words:
        case ["--command", "extension", "install-file", "--repo", "user_default", "--enable", archive]:
            install(Path(archive).resolve())
        case ["--command", "extension", *rest]:
            done = extension_tool(rest)
            print(done.stdout, done.stderr, sep="", end="")
            return done.returncode
        case ["--background", "--python", script, "--", *rest]:
            sys.argv = [script, "--", *rest]
            runpy.run_path(script, run_name="__main__")
        case _:
            print(f"expected a command line of this file's first lines, found {' '.join(words)}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
