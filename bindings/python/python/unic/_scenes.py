"""FBX and USD files are read in a process of their own: damaged ones bring their readers down."""

import sys
from pathlib import Path

from . import _unic

# Loads the extension by its path: the process needs no packages, and none that shadows this one.
_READ = """
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location

path = sys.argv[1]
spec = spec_from_file_location("_unic", path, loader=ExtensionFileLoader("_unic", path))
module = module_from_spec(spec)
spec.loader.exec_module(module)
sys.exit(module.read_scene())
"""


def read_in_processes() -> None:
    """Lets the library start an interpreter for each FBX or USD file.

    Where the program is no interpreter, as in an application that embeds Python, the files are read
    in this process.
    """
    program = sys.executable
    if program and Path(program).name.lower().startswith("python"):
        _unic.read_scenes_with([program, "-I", "-S", "-c", _READ, _unic.__file__])
