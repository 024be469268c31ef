# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The program `unic`: where it is, and its commands. Does not need Blender."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any


class UnicError(Exception):
    """A sentence for the user: what was expected, and what was found."""


def find_program(preferred: str) -> Path:
    """Path of the program: the preferred one, else the one on PATH."""
    if preferred:
        path = Path(preferred).expanduser()
        if path.is_file() and os.access(path, os.X_OK):
            return path
        raise UnicError(f"{path}: expected the program unic, found none; set it in the add-on's preferences")
    found = shutil.which("unic")
    if not found:
        raise UnicError("unic: expected the program on PATH, found none; set it in the add-on's preferences")
    return Path(found)


def find_library(preferred: str, program: Path | None) -> Path:
    """Path of the library: the preferred one, else the one beside the program."""
    if preferred:
        path = Path(preferred).expanduser()
        if path.is_file():
            return path
        raise UnicError(f"{path}: expected the library of unic, found none; set it in the add-on's preferences")
    beside = library_beside(program) if program else None
    if beside and beside.is_file():
        return beside
    raise UnicError(f"{beside or library_name()}: expected the library of unic, found none; set it in the "
                    "add-on's preferences")


def library_name() -> str:
    """Name of the library's file on this system."""
    names = {"win32": "unic.dll", "darwin": "libunic.dylib"}
    return names.get(sys.platform, "libunic.so")


def library_beside(program: Path) -> Path:
    """Path of the library in the folder of the program, symbolic links followed."""
    return program.resolve().parent / library_name()


def run(program: Path, folder: Path, *arguments: str | Path) -> dict[str, Any]:
    """Runs a command in a folder to its end and returns its JSON object.

    A command that fails raises the sentence of its `error`.
    """
    command = [str(program), *map(str, arguments), "--json"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=folder, check=False)
    except OSError as error:
        raise UnicError(f"{program}: cannot run: {error.strerror}") from error
    return answer(done.stdout, done.stderr, done.returncode)


def answer(stdout: str, stderr: str, code: int) -> dict[str, Any]:
    """JSON object of a command that has ended, or its error as an exception."""
    try:
        value = json.loads(stdout)
    except json.JSONDecodeError:
        value = None
    if code == 0 and isinstance(value, dict):
        return value
    if isinstance(value, dict) and isinstance(value.get("error"), dict):
        raise UnicError(str(value["error"].get("message", "unic failed")))
    last = stderr.strip().splitlines()[-1:] or [f"unic ended with exit code {code}"]
    raise UnicError(last[0])
