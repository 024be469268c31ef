"""What the tests share: shipped garments, a short motion, the program, data that may be absent."""

import subprocess
import sys
from pathlib import Path

import pytest
import unic

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def model_path():
    return ROOT / "apps/unic-cli/garments/tshirt.unic"


@pytest.fixture(scope="session")
def model(model_path):
    return unic.Model.load(model_path)


@pytest.fixture(scope="session")
def motion(model):
    """Half a second of walking."""
    return unic.Motion.built_in("walk_circles", model)[30:45]


@pytest.fixture(scope="session")
def animated(model, motion):
    return unic.Animator(model).animate(motion)


@pytest.fixture(scope="session")
def program():
    """Runs the program of the package. Returns the completed process."""

    def run(*words, **options):
        command = [sys.executable, "-m", "unic", *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)

    return run


@pytest.fixture(scope="session")
def data():
    """Finds a file of the test data, or skips the test."""

    def find(name):
        path = DATA / name
        if not path.exists():
            pytest.skip(f"no {path}")
        return path

    return find
