"""JSON output of every command, compared with its schema.

Contract: the object that a command prints with --json, also when it fails, matches
docs/json.schema.json. docs/reference/json.md names every key.

    python3 tests/contract.py target/release/unic

The program `unic-lab` must be in the same folder as `unic`.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import jsonschema
import numpy as np

from figures import FPS, motion, write_capture

UNIC = Path(sys.argv[1]).resolve()
PROGRAMS = {"unic": UNIC, "unic-lab": UNIC.with_name("unic-lab")}
DOCS = Path(__file__).resolve().parent.parent / "docs"
SCHEMA = json.loads((DOCS / "json.schema.json").read_text())
SHORT = ["--preset", "tiny", "--steps", "10", "--set", "optimiser.warmup=0.2"]

# Name of the schema, arguments of the command, exit code.
COMMANDS = [
    ("train", ["train", "tube", *SHORT, "--out", "tube.unic"], 0),
    ("eval", ["eval", "tube.unic", "tube"], 0),
    ("eval", ["eval", "--baselines", "tube"], 0),
    ("eval", ["eval", "--baselines", "tube", "--control", "tube"], 0),
    ("animate", ["animate", "tube.unic", "--motion", "walk.npz", "--out", "walk.pc2"], 0),
    ("export", ["export", "tube.unic", "--onnx", "tube_onnx"], 0),
    ("inspect", ["inspect", "tube"], 0),
    ("inspect", ["inspect", "tube.unic"], 0),
    ("inspect", ["inspect", "walk.npz"], 0),
    ("inspect", ["inspect", "walk.pc2"], 0),
    ("inspect", ["inspect", "tube/character.npz"], 0),
    ("inspect", ["inspect", "tube/garment.obj"], 0),
    ("inspect", ["inspect", "nothing_known"], 1),
    ("coverage", ["inspect", "--coverage", "tube", "walk.npz"], 0),
    ("simulate", ["simulate", "--character", "tube/character.npz", "--garment", "tube/garment.obj", "--motion",
                  "walk.npz", "--seconds", "0.3", "--contacts", "1,1,1,1", "--out", "made"], 0),
    ("import", ["import", "--garment", "tube/clips/a.garment.npy", "--rest", "tube/garment.obj", "--motion",
                "tube/clips/a.npz", "--character", "tube/character.npz", "--contacts", "1,1,1,1", "--out",
                "imported"], 0),
    ("retarget", ["retarget", "tube/clips/a.npz", "--to", "tube/character.npz", "--out", "takes/one/take.bvh"], 0),
    ("import sequences", ["import", "--garment", "takes", "--rest", "tube/garment.obj", "--character",
                          "tube/character.npz", "--contacts", "1,1,1,1", "--fps", str(FPS), "--out", "sequences"], 0),
    ("bench", ["bench", "--model", "tube.unic", "--motion", "walk.npz", "--frames", "10"], 0),
    ("bench control", ["bench", "control"], 0),
    ("play", ["play", "--record", "walk.gif", "--seconds", "0.4", "--size", "64x48", "--renderer", "software"], 0),
    ("view", ["view", "tube", "tube.unic", "--screenshot", "view.png", "--size", "96x64", "--renderer", "software"], 0),
    ("retarget", ["retarget", "walk.npz", "--to", "tube/character.npz", "--out", "transferred.bvh"], 0),
    ("motion-database", ["motion-database", "--out", "walks.unicmotn"], 0),
    ("inspect", ["inspect", "walks.unicmotn"], 0),
    ("unic-lab accuracy", ["accuracy", "tube", "--rows", "tiny.toml", "--steps", "10", "--seeds", "1", "--out",
                           "accuracy"], 0),
    ("unic-lab lasting", ["lasting", "tube.unic", "tube", "--frames", "60"], 0),
    ("failure", ["animate", "nothing.unic", "--motion", "walk.npz", "--out", "new.pc2"], 1),
    ("failure", ["train", "tube", "--stepz", "3"], 2),
    ("failure", ["--threads", "0", "inspect", "tube"], 2),
]


def check(name, folder, arguments, code):
    """Runs a command and compares its exit code and its object with those expected."""
    program = "unic-lab" if name.startswith("unic-lab ") else "unic"
    done = subprocess.run([PROGRAMS[program], *arguments, "--json"], cwd=folder, capture_output=True, text=True)
    about = f"{program} {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}"
    assert done.returncode == code, about
    found = json.loads(done.stdout)
    validator = jsonschema.Draft202012Validator({"$ref": f"#/$defs/{name}", "$defs": SCHEMA["$defs"]})
    errors = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(found)]
    assert not errors, f"{about}{errors}"


def check_page():
    """Checks that docs/reference/json.md has a row for every command and names all of its keys."""
    page = (DOCS / "reference/json.md").read_text()
    rows = dict(re.findall(r"^\| `([^`]+)` \| (.+) \|$", page, re.M))
    names = {"coverage": "inspect --coverage", "import sequences": "import SEQUENCES"}
    for name, schema in SCHEMA["$defs"].items():
        row = rows.get(names.get(name, name))
        if row is None:
            assert name in {"error", "failure", "metrics", "band", "by_mode", "evaluation", "code", "timing"}, name
            continue
        if name == "unic-lab lasting":
            continue
        for key in schema["properties"]:
            assert f"`{key}`" in row or key == "protocol", f"docs/reference/json.md, {name}: {key}"


def write_sequence(folder, capture):
    """Writes the frames of a clip as OBJ files."""
    folder.mkdir(parents=True)
    lines = (capture / "garment.obj").read_text().splitlines()
    # Indices of vertices alone: the frames have no texture coordinates.
    corners = [[corner.split("/")[0] for corner in line.split()[1:]] for line in lines if line.startswith("f ")]
    faces = "".join(f"f {' '.join(face)}\n" for face in corners)
    for t, frame in enumerate(np.load(capture / "clips/a.garment.npy")):
        vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in frame)
        (folder / f"{t:04}.obj").write_text(vertices + faces)


def main():
    check_page()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        write_capture(folder / "tube")
        poses, trans = motion(9)
        np.savez(folder / "walk.npz", poses=poses, trans=trans, mocap_framerate=float(FPS))
        write_sequence(folder / "takes/one/deformation", folder / "tube")
        (folder / "nothing_known").mkdir()
        (folder / "tiny.toml").write_text('title = "tiny"\npreset = "tiny"\n[optimiser]\nwarmup = 0.2\n')
        for name, arguments, code in COMMANDS:
            check(name, folder, arguments, code)
    print(f"{len(COMMANDS)} objects match their schema")


main()
