"""Contract: the type stubs describe the extension as it is, in types and in words."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
import unic


def described():
    """Names in the stubs with their descriptions, such as `Model.load`."""
    stubs = Path(unic.__file__).parent / "_unic.pyi"
    for node in ast.parse(stubs.read_text()).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            yield node.name, ast.get_docstring(node)
        for member in getattr(node, "body", []):
            if isinstance(node, ast.ClassDef) and isinstance(member, ast.FunctionDef):
                yield f"{node.name}.{member.name}", ast.get_docstring(member)


def test_descriptions_are_the_same_at_run_time():
    checked = 0
    for name, text in described():
        if text:
            found = unic._unic
            for part in name.split("."):
                found = getattr(found, part)
            assert inspect.getdoc(found) == text, name
            checked += 1
    assert checked > 50


def test_stubs_have_the_signatures_of_the_extension(tmp_path):
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy.stubtest", "unic", "--ignore-missing-stub", "--concise"]
    ran = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stdout + ran.stderr
