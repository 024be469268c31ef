"""Contract: the example runs as its page says, and writes a picture."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "quickstart.py"


def test_the_quickstart_draws_a_plot(model, model_path, motion, tmp_path):
    pytest.importorskip("matplotlib")
    motion.save(tmp_path / "walk.npz", model)
    words = [sys.executable, EXAMPLE, model_path, tmp_path / "walk.npz", "--out", tmp_path / "plot.png"]
    ran = subprocess.run(words, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "plot.png").stat().st_size > 20_000 and "15 frames" in ran.stdout
