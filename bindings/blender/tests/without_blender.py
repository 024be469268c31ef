# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The parts of the extension that need no Blender.

Contract:
- Every module compiles, and the manifest has what Blender asks for.
- The structs and numbers of the C interface are those of `unic.h`.
- A training reports its progress while it runs, saves itself when it is cancelled, and gives its result or
  its error.

    python3 bindings/blender/tests/without_blender.py

It needs numpy, and is skipped without.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import stat
import sys
import tempfile
import time
import tomllib
import types
from pathlib import Path

if importlib.util.find_spec("numpy") is None:
    print("skipped: no numpy")
    sys.exit(0)

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "unic"
HEADER = ROOT.parents[1] / "crates/unic-ffi/include/unic.h"

# The package without its `__init__`, which needs Blender.
package = types.ModuleType("unic")
package.__path__ = [str(SOURCE)]
sys.modules["unic"] = package
library, program, rotations, training = (importlib.import_module(f"unic.{name}")
                                         for name in ("library", "program", "rotations", "training"))

# A program that trains like `unic train`: progress on stderr, an object on stdout, saved on Ctrl-C.
STAND_IN = """#!{python}
import json, signal, sys, time
arguments = sys.argv[1:]
def saved(*_):
    print(json.dumps({{"error": {{"message": "stopped; saved", "kind": "interrupted", "exit_code": 130}}}}))
    sys.exit(130)
signal.signal(signal.SIGINT, saved)
print("training 1/9  loss 0.5", file=sys.stderr, flush=True)
if "{patience}" == "wrong":
    print(json.dumps({{"error": {{"message": "capture: no such folder", "kind": "failed", "exit_code": 1}}}}))
    sys.exit(1)
time.sleep({patience})
print(json.dumps({{"seconds": 1.5, "arguments": arguments}}))
"""


def stand_in(folder: Path, patience: float | str) -> Path:
    """Writes the program that stands for `unic`."""
    path = folder / "unic"
    path.write_text(STAND_IN.format(python=sys.executable, patience=patience))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def start(folder: Path, patience: float | str) -> training.Training:
    """Starts a training by the stand-in."""
    return training.Training(stand_in(folder, patience), folder / "capture", folder / "coat.unic", training.Start.NEW,
                             90.0)


def failure(running: training.Training) -> str:
    """Sentence of a training that must fail."""
    try:
        running.wait()
    except program.UnicError as error:
        return str(error)
    raise AssertionError("expected an error, found none")


# ---- checks ------------------------------------------------------------------------------------


def check_modules(_folder: Path) -> None:
    """Parses every module, which must state its licence and what it does."""
    for path in sorted(SOURCE.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later"), path
        assert ast.get_docstring(ast.parse(text)), path


def check_manifest(_folder: Path) -> None:
    """Checks the manifest by the rules of Blender's page on extensions."""
    manifest = tomllib.loads((SOURCE / "blender_manifest.toml").read_text())
    assert manifest["schema_version"] == "1.0.0" and manifest["type"] == "add-on"
    assert manifest["id"] == "unic" and manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert tuple(map(int, manifest["blender_version_min"].split("."))) >= (4, 2, 0)
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= 64 and text[-1].isalnum(), text
    workspace = tomllib.loads((ROOT.parents[1] / "Cargo.toml").read_text())["workspace"]["package"]
    assert manifest["version"] == workspace["version"]


def check_structs(_folder: Path) -> None:
    """Compares the structs with those of the header: names, in their order, and types."""
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.S)
    kinds = {"uint32_t": library.c_uint32, "int32_t": library.c_int32, "float": library.c_float,
             "size_t": library.c_size_t}
    for name in ("ModelInfo", "Options", "Pose", "StepInput", "Vertices"):
        body = re.search(rf"typedef struct Unic{name} {{(.*?)}} Unic{name};", text, re.S)[1]
        fields = re.findall(r"([\w ]+?) ?(\**)(\w+)(?:\[(\d+)\])?;", body)
        ours = getattr(library, name)._fields_
        assert [field[2] for field in fields] == [field[0] for field in ours], name
        for (kind, pointer, _, count), (_, found) in zip(fields, ours, strict=True):
            expected = kinds.get(kind.strip())
            if pointer or expected is None:
                # Pointers and callbacks.
                assert library.sizeof(found) == library.sizeof(library.c_void_p), (name, kind)
            else:
                assert found == (expected * int(count) if count else expected), (name, kind)


def check_numbers(_folder: Path) -> None:
    """Compares the constants with those of the header."""
    text = HEADER.read_text()
    numbers = {name: int(value) for name, value in re.findall(r"\b(UNIC_\w+)\s*=?\s+(\d+)\b", text)}
    assert numbers["UNIC_ABI_VERSION"] == library.ABI_VERSION
    for name in ("STATUS_OK", "AXES_BLENDER", "THREADS_POOL", "ROOT_POSITION", "ROTATIONS_FROM_REST"):
        assert numbers[f"UNIC_{name}"] == getattr(library, name), name
    for value in library.Intersection:
        assert numbers[f"UNIC_INTERSECTION_{value.name}"] == value, value
    for name in library.SIGNATURES:
        assert re.search(rf"\bUnicStatus {name}\(", text), name


def check_rotations(_folder: Path) -> None:
    """Turns random axis-angle vectors, half turns included, to matrices and back."""
    random = np.random.default_rng(1)
    axes = random.normal(size=(500, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.concatenate([random.uniform(0, np.pi, 496), [0.0, 1e-9, np.pi - 1e-9, np.pi]])
    vectors = axes * angles[:, None]
    found = rotations.axis_angles(matrices(vectors))
    # Half a turn is the same about both directions of its axis.
    error = np.minimum(np.linalg.norm(found - vectors, axis=1),
                       np.where(angles > 3, np.linalg.norm(found + vectors, axis=1), np.inf))
    assert error.max() < 1e-7, error.max()
    sheared = matrices(vectors) * 0.01 + 1e-6
    assert np.abs(rotations.nearest_rotations(sheared) - matrices(vectors)).max() < 1e-3
    quaternions = rotations.quaternions(matrices(vectors))
    half = rotations.between(quaternions, rotations.quaternions(np.tile(np.eye(3), (500, 1, 1))), 0.5)
    turned = rotations.quaternions(matrices(vectors / 2))
    # The way of exactly half a turn goes either way.
    assert np.abs(np.abs((half * turned).sum(axis=1)) - 1)[:-1].max() < 1e-6


def matrices(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) of axis-angle vectors, by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = (vectors / np.maximum(angle[:, :, 0], 1e-12)).T
    o = np.zeros_like(x)
    k = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def check_training(folder: Path) -> None:
    """Follows a training to its end."""
    running = start(folder, 0.5)
    (folder / "coat.run").mkdir()
    metrics = folder / "coat.run/metrics.jsonl"
    metrics.write_text('{"step": 1, "validation_rmse_mm": 12.34}\n{"step": 50, "loss": 0.1}\n{"step": 1')
    deadline = time.monotonic() + 10
    while "loss 0.5" not in running.status() and time.monotonic() < deadline:
        assert 0 <= running.share() < 1
        time.sleep(0.02)
    assert running.status() == "training 1/9 loss 0.5" and running.held_out_mm() == 12.34, running.status()
    answer = running.wait()
    assert running.share() == 1 and answer["seconds"] == 1.5
    assert answer["arguments"] == ["train", str(folder / "capture"), "--out", str(folder / "coat.unic"), "--json",
                                   "--budget", "90s"], answer


def check_cancel(folder: Path) -> None:
    """Cancels a training, which saves itself."""
    running = start(folder, 60)
    deadline = time.monotonic() + 10
    while "loss" not in running.status() and time.monotonic() < deadline:
        time.sleep(0.02)
    running.cancel()
    assert failure(running) == "stopped; saved" and running.is_saved() and running.is_cancelled


def check_errors(folder: Path) -> None:
    """Reads the sentences of failures."""
    assert failure(start(folder, "wrong")) == "capture: no such folder"
    for preferred in (folder / "missing", folder):
        try:
            program.find_program(str(preferred))
            raise AssertionError("expected an error, found none")
        except program.UnicError as error:
            assert str(error).startswith(f"{preferred}: expected the program unic, found none"), error
    for stdout, stderr, words in (("", "unic: panic\n", "unic: panic"), ("{", "", "exit code 3")):
        try:
            program.answer(stdout, stderr, 3)
            raise AssertionError("expected an error, found none")
        except program.UnicError as error:
            assert words in str(error), error


CHECKS = [check_modules, check_manifest, check_structs, check_numbers, check_rotations, check_training, check_cancel,
          check_errors]


def main() -> int:
    """Runs all checks."""
    failed = 0
    for check in CHECKS:
        title = check.__name__.removeprefix("check_")
        try:
            with tempfile.TemporaryDirectory() as folder:
                check(Path(folder))
            print(f"{title}: ok")
        except Exception as error:  # A failed check must not hide the others.
            failed += 1
            print(f"{title}: FAILED\n  {type(error).__name__}: {error}")
    print(f"extension without Blender: {len(CHECKS) - failed} passed, {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
