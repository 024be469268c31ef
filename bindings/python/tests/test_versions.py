"""Contract: the lock file has the root's versions, so that dependencies are built once for both
workspaces."""

from pathlib import Path

import pytest

tomllib = pytest.importorskip("tomllib")
HERE = Path(__file__).resolve().parents[1]


def versions(lock):
    found = {}
    for package in tomllib.loads(lock.read_text())["package"]:
        found.setdefault(package["name"], set()).add(package["version"])
    return found


def test_crates_have_the_versions_of_the_root():
    root = versions(HERE.parents[1] / "Cargo.lock")
    other = {name: found for name, found in versions(HERE / "Cargo.lock").items() if not found <= root.get(name, found)}
    advice = "cp Cargo.lock bindings/python/ && (cd bindings/python && cargo metadata > /dev/null)"
    assert not other, f"other versions than in the root's lock file; {advice} takes them over"
