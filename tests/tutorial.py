"""Runs every command of docs/tutorial.md: blocks of `sh` in a shell, blocks of `python` in Blender.

Contract: each block succeeds in its order, and at the end the scene has a baked garment whose positions
are those of `unic animate`.

    python3 tests/tutorial.py

The test needs `pip install bpy numpy`, and is skipped without bpy. It works in the folder `takes` of the
repository, which must not exist, and removes it.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

if importlib.util.find_spec("bpy") is None:
    print("skipped: no Blender (pip install bpy)")
    sys.exit(0)

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
TESTS = ROOT / "bindings/blender/tests"
TAKES = ROOT / "takes"
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.M | re.S)
# The bake's cache holds the same bytes; Blender turns them.
LARGEST_M = 1e-5


class Shell:
    """A shell whose folder and environment last from block to block."""

    def __init__(self, scratch):
        self.state = scratch / "state"
        self.folder, self.environment = ROOT, dict(os.environ)
        programs = scratch / "bin"
        programs.mkdir()
        (programs / "blender").write_text(f'#!/bin/sh\nexec "{sys.executable}" "{TESTS}/blender_program.py" "$@"\n')
        (programs / "blender").chmod(0o755)
        # Where the build goes if not to `target`, which the tutorial puts first and where it puts an archive.
        (ROOT / "target").mkdir(exist_ok=True)
        built = Path(os.environ.get("CARGO_TARGET_DIR", "target")).resolve() / "release"
        self.environment["PATH"] = f"{programs}:{built}:{self.environment['PATH']}"

    def run(self, block):
        script = f'set -euo pipefail\n{block}\npwd > "{self.state}"\nenv -0 >> "{self.state}"\n'
        subprocess.run(["bash", "-c", script], cwd=self.folder, env=self.environment, check=True)
        folder, variables = self.state.read_text().split("\n", 1)
        self.folder = Path(folder)
        self.environment = dict(line.split("=", 1) for line in variables.split("\0") if "=" in line)


class Console:
    """Blender's Python console in the shell's folder, with the extension that the shell has installed."""

    def __init__(self):
        self.names = None

    def run(self, block, shell):
        os.chdir(shell.folder)
        os.environ["PATH"] = shell.environment["PATH"]
        if self.names is None:
            # Blender begins here, after the installation.
            sys.path.insert(0, str(TESTS))
            import blender_program

            blender_program.enable()
            self.names = {"bpy": blender_program.bpy}
        exec(compile(block, "docs/tutorial.md", "exec"), self.names)


def check_bake(bpy):
    """Compares the bake with the motion of the held-out clip, animated by the program."""
    from bl_ext.user_default.unic.meshes import current, world_positions

    # The motion of the capture has gone through a file more, so that the last digits differ: without
    # intersection handling, because that decides by the last digit.
    settings = bpy.context.scene.unic
    settings.intersection, settings.cache = "OFF", "//check.pc2"
    settings.garment.hide_set(False)
    bpy.ops.unic.bake()
    subprocess.run(["unic", "animate", "coat.unic", "--motion", "capture/clips/dance.npz", "--out", "check.npz",
                    "--intersection", "off"], check=True)
    expected = np.load("check.npz")["vertices"]
    worst = 0.0
    for row in (0, 1, len(expected) // 2, len(expected) - 1):
        bpy.context.scene.frame_set(settings.frame_start + row)
        x, y, z = world_positions(bpy.data.objects["coat baked"], current(bpy.context)).T
        worst = max(worst, np.abs(np.stack([x, z, -y], axis=1) - expected[row]).max())
    assert worst < LARGEST_M, f"{worst} m"
    return worst


def main():
    assert not TAKES.exists(), f"{TAKES}: expected no such folder, found one"
    blocks = BLOCK.findall((ROOT / "docs/tutorial.md").read_text())
    with tempfile.TemporaryDirectory() as name:
        os.environ["BLENDER_USER_RESOURCES"] = name
        shell, console = Shell(Path(name)), Console()
        try:
            for kind, block in blocks:
                started = time.monotonic()
                print(f"---- {kind}\n{block}", end="", flush=True)
                shell.run(block) if kind == "sh" else console.run(block, shell)
                print(f"---- {time.monotonic() - started:.0f} s", flush=True)
            worst = check_bake(console.names["bpy"])
        finally:
            os.chdir(ROOT)
            shutil.rmtree(TAKES, ignore_errors=True)
    print(f"tutorial: {len(blocks)} blocks, the bake is within {1e3 * worst:.4f} mm")


if __name__ == "__main__":
    main()
