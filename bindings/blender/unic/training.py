# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""A training in a process of its own, and what is known of its progress. Does not need Blender."""

from __future__ import annotations

import atexit
import json
import signal
import subprocess
import sys
import tempfile
import time
from enum import Enum
from pathlib import Path
from typing import Any

from .program import UnicError, answer

# Seconds that the end of Blender waits for a training that saves itself.
PATIENCE_S = 10.0
# Exit code of a program that has saved its work on Ctrl-C.
INTERRUPTED = 130


class Start(Enum):
    """How a training begins."""

    NEW = "new"
    REPLACE = "replace"
    RESUME = "resume"


def run_folder(model: Path) -> Path:
    """Folder that `unic train` keeps beside a model."""
    return model.with_suffix(".run")


def validation_mm(metrics: Path) -> float | None:
    """Newest error on a held-out clip in `metrics.jsonl`, in mm."""
    try:
        lines = metrics.read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    for line in reversed(lines):
        # The last line may be half written.
        try:
            value = json.loads(line).get("validation_rmse_mm")
        except (json.JSONDecodeError, AttributeError):
            continue
        if value is not None:
            return float(value)
    return None


def arguments(capture: Path, model: Path, start: Start, budget_s: float) -> list[str]:
    """Command line of a training, without the program."""
    words = ["train", str(capture), "--out", str(model), "--json"]
    if start is Start.RESUME:
        # The run has kept the steps that its budget gave.
        return [*words, "--resume"]
    words += ["--budget", f"{max(1, round(budget_s))}s"]
    return [*words, "--overwrite"] if start is Start.REPLACE else words


class Training:
    """`unic train` as a child process."""

    def __init__(self, program: Path, capture: Path, model: Path, start: Start, budget_s: float) -> None:
        self.model = model
        self.budget_s = budget_s
        self.started = time.monotonic()
        self.is_cancelled = False
        # Files, not pipes: a pipe that nobody reads stops the child when it is full.
        self._logs = tempfile.TemporaryDirectory(prefix="unic_train_")
        # A group of its own: Windows sends its Ctrl-Break to groups, and Blender's must not get it.
        flags = subprocess.CREATE_NEW_PROCESS_GROUP if sys.platform == "win32" else 0
        command = [str(program), *arguments(capture, model, start, budget_s)]
        try:
            with self._log("out").open("wb") as out, self._log("err").open("wb") as err:
                self._child = subprocess.Popen(command, stdout=out, stderr=err, creationflags=flags)
        except OSError as error:
            raise UnicError(f"{program}: cannot run: {error.strerror}") from error
        atexit.register(self.stop)

    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self._child.poll() is None

    def share(self) -> float:
        """Share of the budget that is used, below 1 until the process ends."""
        if not self.is_running():
            return 1.0
        return min((time.monotonic() - self.started) / max(self.budget_s, 1.0), 0.99)

    def status(self) -> str:
        """Newest line of the program's progress."""
        lines = self._read("err").strip().splitlines()
        return " ".join(lines[-1].split()) if lines else "starting"

    def held_out_mm(self) -> float | None:
        """Newest error on held-out motion in mm, once there is one."""
        return validation_mm(run_folder(self.model) / "metrics.jsonl")

    def cancel(self) -> None:
        """Asks the program to save and end, as Ctrl-C does. Returns at once."""
        if self.is_running():
            self.is_cancelled = True
            # On Windows a process group takes Ctrl-Break only.
            self._child.send_signal(signal.CTRL_BREAK_EVENT if sys.platform == "win32" else signal.SIGINT)

    def stop(self) -> None:
        """Cancels and waits a while for the end."""
        self.cancel()
        try:
            self._child.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._child.kill()

    def wait(self) -> dict[str, Any]:
        """Waits for the end and returns the program's JSON object."""
        self._child.wait()
        return self.result()

    def result(self) -> dict[str, Any]:
        """JSON object of a training that has ended, or its error as an exception."""
        atexit.unregister(self.stop)
        return answer(self._read("out"), self._read("err"), self._child.returncode)

    def is_saved(self) -> bool:
        """Whether the program has ended on Ctrl-C, with its work saved."""
        return self._child.returncode == INTERRUPTED

    def _log(self, name: str) -> Path:
        return Path(self._logs.name) / name

    def _read(self, name: str) -> str:
        return self._log(name).read_text(encoding="utf-8", errors="replace")
