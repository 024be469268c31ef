"""Mistakes that users plausibly make, and signals that stop commands.

Contract:
- Every mistake is refused with exit code 1 or 2 and one sentence that names the problem.
- With --json, stdout is one object whose `error` holds the same sentence.
- No file is written, changed or removed.
- Every command ends within two seconds of SIGTERM.

    python3 tests/mistakes.py target/release/unic [--table]

`--table` prints every mistake with its error message, in Markdown.
"""

import hashlib
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np

from figures import FPS, motion, write_capture

UNIC = Path(sys.argv[1]).resolve()
# Commands of the program for research; all others are those of `unic`.
LAB_COMMANDS = {"accuracy", "lasting"}
# Longest time of a refusal in seconds. A command that takes longer has begun to work.
LONGEST_S = 20.0
# Longest time from SIGTERM to the end, in seconds, on a machine with other work.
PATIENCE_S = 2.0
SHORT = ["--preset", "tiny", "--steps", "10", "--set", "optimiser.warmup=0.2"]


def program(arguments):
    """The program that has this command: `unic-lab` lies beside `unic`."""
    return UNIC.with_name("unic-lab") if arguments[0] in LAB_COMMANDS else UNIC


def run(folder, arguments):
    return subprocess.run([program(arguments), *map(str, arguments)], cwd=folder, capture_output=True, text=True)


def succeed(folder, *arguments):
    done = run(folder, arguments)
    assert done.returncode == 0, f"unic {arguments}: {done.stderr}"


# ---- files for the mistakes --------------------------------------------------------------------


def write_motion(path, poses, trans, **more):
    np.savez(path, poses=poses, trans=trans, mocap_framerate=float(FPS), **more)


def make_scene(folder):
    """Makes a capture, a model of it, motions, meshes, and a character of 24 joints."""
    write_capture(folder / "tube")
    poses, trans = motion(9)
    write_motion(folder / "walk.npz", poses, trans)
    succeed(folder, "train", "tube", *SHORT, "--out", "tube.unic")
    (folder / "tube.run").rename(folder / "other.run")
    shutil.copytree(folder / "tube", folder / "named")
    arrays(folder / "tube/character.npz", folder / "named/character.npz", joint_names=np.array(list("abcdef")))
    succeed(folder, "train", "named", *SHORT, "--out", "named.unic")
    shutil.rmtree(folder / "named.run")
    write_motion(folder / "long.npz", np.tile(poses, (4000, 1)), np.tile(trans, (4000, 1)))
    succeed(folder, "simulate", "--motion", "dance", "--seconds", "0.1", "--self-collision", "off", "--out", "person")
    (folder / "s.toml").write_text("seed = 2\n")
    for name in ["page.html", "walk.pc2", "pictures/d.png", "dumps/d.npz", "strips/dance.png"]:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("mine")
    os.symlink("tube/clips", folder / "link")
    os.link(folder / "walk.npz", folder / "hard.npz")


def obj(scene, name, change):
    """Writes a copy of the capture's rest shape; `change` maps its vertices (V, 3) to new ones."""
    lines = (scene / "tube/garment.obj").read_text().splitlines()
    places = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    moved = iter(change(places))
    changed = [f"v {x} {y} {z}" if line.startswith("v ") else line
               for line in lines for x, y, z in [next(moved) if line.startswith("v ") else (0, 0, 0)]]
    (scene / name).write_text("\n".join(changed) + "\n")


def arrays(source, target, **changes):
    """Writes a copy of an npz with changed arrays: values, or functions of all arrays.

    None removes an array.
    """
    values = dict(np.load(source))
    for name, change in changes.items():
        values[name] = change(values) if callable(change) else change
        if values[name] is None:
            del values[name]
    np.savez(target, **values)


def clip(scene, change):
    """Changes the garment (T, V, 3) of the capture's clip `a`."""
    path = scene / "tube/clips/a.garment.npy"
    np.save(path, change(np.load(path)).astype(np.float32))


def fan(path):
    """Writes a mesh of one polygon with 3,019 corners."""
    angle = 2 * np.pi * np.arange(3019) / 3019
    lines = [f"v {0.3 * x} 1.0 {0.3 * z}" for x, z in zip(np.cos(angle), np.sin(angle))]
    path.write_text("\n".join(lines) + "\nf " + " ".join(str(i + 1) for i in range(3019)) + "\n")


def linked_clips(scene):
    (scene / "linked").mkdir()
    os.symlink("../tube/clips", scene / "linked/clips")


# Indices of SMPL's joints, depth first, which is the order in which Blender lists bones.
BLENDER = [0, 1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12, 15, 13, 16, 18, 20, 22, 14, 17, 19, 21, 23]


def in_blenders_order(values):
    parents = values["parents"]
    place = {joint: i for i, joint in enumerate(BLENDER)}
    return np.array([place.get(int(parents[joint]), -1) for joint in BLENDER])


def bytes_of(name, start):
    return lambda scene: (scene / name).write_bytes(start + bytes(64))


def flipped(path):
    """Changes one bit of the last tensor of a model."""
    data = bytearray(path.read_bytes())
    data[-9] ^= 0x10
    path.write_bytes(data)


def bomb(path):
    """Writes a motion of 200 MB of zeros in an archive of 200 KB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("poses.npy", "w") as entry:
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f4", "fortran_order": False, "shape": (50_000_000, 1)})
        for _ in range(200):
            entry.write(bytes(1_000_000))


TURN = lambda v: v @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
HUMAN = "person/character.npz"
TRAIN = ["train", "tube", *SHORT, "--out", "new.unic"]
EVAL = ["eval", "tube.unic", "tube"]
ANIMATE = ["animate", "tube.unic", "--motion", "walk.npz", "--out", "new.pc2"]
BENCH = ["bench", "--model", "tube.unic", "--motion", "walk.npz"]
SIMULATE = ["simulate", "--character", "tube/character.npz", "--motion", "walk.npz", "--contacts", "1,1,1,1",
            "--out", "new"]


def on(garment):
    return [*SIMULATE, "--garment", garment]


def with_character(change):
    return lambda scene: arrays(scene / HUMAN, scene / "rig.npz", **change)


def rig(*more):
    return ["simulate", "--character", "rig.npz", "--motion", "dance", "--seconds", "1", "--out", "new", *more]


def moving(**change):
    return lambda scene: arrays(scene / "walk.npz", scene / "moved.npz", **change)


MOVED = ["animate", "tube.unic", "--motion", "moved.npz", "--out", "new.pc2"]


def capture_of(folder, **change):
    return lambda scene: arrays(scene / folder / "character.npz", scene / folder / "character.npz", **change)


# Title, preparation, command, and words of the error message.
MISTAKES = [
    # ---- outputs that would lose files
    ("dump into a capture's clips", None, [*EVAL, "--dump", "tube/clips"], "a part of the capture"),
    ("dump through a link", None, [*EVAL, "--dump", "link", "--overwrite"], "a part of the capture"),
    ("dump onto files", None, [*EVAL, "--dump", "dumps"], "--overwrite replaces it"),
    ("report onto a page", None, [*EVAL, "--report", "page.html"], "--overwrite replaces it"),
    ("report without an ending", None, [*EVAL, "--report", "tube.unic"], ".html"),
    ("pictures onto pictures", None, [*EVAL, "--pictures", "pictures"], "--overwrite replaces it"),
    ("pictures into a capture", None, [*EVAL, "--pictures", "tube", "--overwrite"], "is no input"),
    ("train onto a model", None, ["train", "tube", *SHORT, "--out", "tube.unic"], "--overwrite replaces it"),
    ("train onto the settings", None, [*TRAIN[:-1], "s.toml", "--config", "s.toml", "--overwrite"], "is no input"),
    ("train onto a capture's mesh", None, [*TRAIN[:-1], "tube/garment.obj", "--overwrite"], "part of the capture"),
    ("train into a folder", None, [*TRAIN[:-1], "tube"], "tube"),
    ("animate onto a file", None, [*ANIMATE[:-1], "walk.pc2"], "--overwrite replaces it"),
    ("animate onto its motion", None, [*ANIMATE[:-1], "walk.npz", "--overwrite"], "is no input"),
    ("animate onto a hard link of it", None, [*ANIMATE[:-1], "hard.npz", "--overwrite"], "is no input"),
    ("animate into a capture's clips", None, [*ANIMATE[:-1], "tube/clips/new.npz"], "a part of the capture"),
    ("picture onto the model", None, [*ANIMATE, "--picture", "tube.unic", "--overwrite"], "is no input"),
    ("one name for two outputs", None, [*ANIMATE, "--picture", "new.pc2"], "found two"),
    ("simulate onto a capture", None, ["simulate", "--motion", "dance", "--out", "person"], "--overwrite replaces it"),
    ("simulate into a capture's clips", None, [*SIMULATE[:-1], "tube/clips/new", "--garment", "tube/garment.obj"],
     "a part of the capture"),
    ("simulate onto its own inputs", None, [*SIMULATE[:-1], "tube", "--garment", "tube/garment.obj", "--overwrite"],
     "holds none of the inputs"),
    ("simulate through linked clips", lambda s: linked_clips(s), ["simulate", "--motion", "dance", "--out", "linked",
                                                                  "--overwrite"], "the link linked/clips"),
    ("strips onto strips", None, ["simulate", "--motion", "dance", "--out", "new", "--pictures", "strips"],
     "--overwrite replaces it"),
    ("bench onto a model", None, [*BENCH, "--budget", "9s", "--precision", "f32", "--out", "tube.unic"], "tube.unic"),
    ("benchmark into a capture", None, ["accuracy", "tube", "--steps", "1", "--out", "tube"], "is no input"),
    ("benchmark beside its capture", None, ["accuracy", "tube", "--steps", "1", "--out", "."], "is no input"),
    ("train onto the settings in its run", lambda s: (s / "other.run").rename(s / "tube.run"),
     ["train", "tube", "--config", "tube.run/config.toml", "--out", "tube.unic", "--overwrite"], "is no input"),
    ("demo into a capture", None, ["demo", "--quick", "--out", "tube"], "a part of the capture"),
    # ---- limits
    ("9999 threads", None, ["--threads", "9999", *ANIMATE], "a whole number from 1"),
    ("no threads", None, ["--threads", "0", *ANIMATE], "a whole number from 1"),
    ("a garment of a billion vertices", None, ["bench", "--vertices", "1000000000"], "1000000"),
    ("a billion instances", None, [*BENCH, "--precision", "f32", "--on-threads", "1", "--instances", "1000000000"],
     "half of the free memory"),
    ("a polygon of 3,019 corners", lambda s: fan(s / "fan.obj"), on("fan.obj"), "polygon of many corners"),
    ("a billion frames a second", None, ["simulate", "--motion", "dance", "--fps", "1e9", "--out", "new"], "1 to 1000"),
    ("100,000 substeps", None, [*on("tube/garment.obj"), "--substeps", "100000"], "1..=1000"),
    ("frames that are not there", None, [*ANIMATE, "--frames", "0..9000"], "found 0..9000"),
    # ---- plausible mistakes in captures
    ("vertices shuffled, trained", lambda s: clip(s, lambda g: g[:, np.random.default_rng(1).permutation(g.shape[1])]),
     TRAIN, "another order"),
    ("vertices shuffled, measured", lambda s: clip(s, lambda g: g[:, ::-1][:, np.arange(g.shape[1]) * 31 % g.shape[1]]),
     EVAL, "another order"),
    ("vertices shuffled, lasting",
     lambda s: clip(s, lambda g: g[:, np.random.default_rng(2).permutation(g.shape[1])]),
     ["lasting", "tube.unic", "tube"], "another order"),
    ("a clip in centimetres", lambda s: clip(s, lambda g: 100 * g), TRAIN, "centimetres"),
    ("a garment 9 frames late", lambda s: clip(s, lambda g: g[np.maximum(np.arange(len(g)) - 9, 0)]), TRAIN,
     "frames after its body"),
    ("a garment that does not move", lambda s: clip(s, lambda g: np.repeat(g[:1], len(g), 0)), TRAIN,
     "does not move"),
    ("a garment beside its body", lambda s: clip(s, lambda g: g + [2, 0, 0]), TRAIN, "from the skinned rest shape"),
    ("a position that is no number", lambda s: clip(s, lambda g: np.where(g == g[3, 4, 1], np.nan, g)), TRAIN,
     "finite"),
    ("a clip of another length", lambda s: clip(s, lambda g: g[:-1]), TRAIN, "shape"),
    ("a clip that is not there", lambda s: (s / "tube/clips/a.npz").unlink(), TRAIN, "a.npz"),
    ("vertices shuffled, covered",
     lambda s: clip(s, lambda g: g[:, np.random.default_rng(3).permutation(g.shape[1])]),
     ["inspect", "--coverage", "tube", "walk.npz"], "another order"),
    ("a rest shape in millimetres", lambda s: obj(s, "tube/garment.obj", lambda v: 1000 * v), TRAIN, "millimetres"),
    # ---- in garments and meshes
    ("a garment in millimetres", lambda s: obj(s, "mm.obj", lambda v: 1000 * v), on("mm.obj"), "millimetres"),
    ("a garment in centimetres", lambda s: obj(s, "cm.obj", lambda v: 100 * v), on("cm.obj"), "centimetres"),
    ("a garment with Z up", lambda s: obj(s, "z.obj", TURN), on("z.obj"), "Z up"),
    ("a garment beside the body", lambda s: obj(s, "far.obj", lambda v: v + [3, 0, 0]), on("far.obj"), "bind pose"),
    ("another mesh in millimetres", lambda s: obj(s, "mm.obj", lambda v: 1000 * v), [*ANIMATE, "--mesh", "mm.obj"],
     "millimetres"),
    ("another mesh with Z up", lambda s: obj(s, "z.obj", TURN), [*ANIMATE, "--mesh", "z.obj"], "Z up"),
    ("a start in millimetres", lambda s: obj(s, "start.obj", lambda v: 1000 * v), [*ANIMATE, "--start", "start.obj"],
     "millimetres"),
    ("a start in another order", lambda s: obj(s, "start.obj", lambda v: np.random.default_rng(4).permutation(v)),
     [*ANIMATE, "--start", "start.obj"], "another order"),
    ("the mesh of another garment", None, [*ANIMATE, "--mesh", "person/garment.obj"], "another garment"),
    # ---- in bodies
    ("a body in centimetres",
     with_character({"vertices": lambda v: 100 * v["vertices"], "joints": lambda v: 100 * v["joints"]}), rig(),
     "centimetres"),
    ("a body with Z up", with_character({"vertices": lambda v: TURN(v["vertices"]), "joints": lambda v: TURN(v["joints"])}),
     rig(), "Z up"),
    ("a body that faces -Z", with_character({"vertices": lambda v: v["vertices"] * [-1, 1, -1],
                                             "joints": lambda v: v["joints"] * [-1, 1, -1]}), rig(), "face +Z"),
    ("a body inside out", with_character({"faces": lambda v: v["faces"][:, ::-1]}), rig(), "flip the normals"),
    ("a body without its skin",
     with_character({"weights": lambda v: np.eye(24)[np.zeros(len(v["weights"]), int)]}), rig(), "bind the mesh"),
    ("weights that are all zero", with_character({"weights": lambda v: 0 * v["weights"]}), rig(), "rig.npz"),
    ("two joints of one name", with_character({"joint_names": lambda v: np.array(["hip"] * 24)}), rig(),
     "two joints named"),
    ("a rig in Blender's order without names", with_character({
        "parents": in_blenders_order, "joints": lambda v: v["joints"][BLENDER],
        "rest_pose": lambda v: v["rest_pose"][BLENDER], "weights": lambda v: v["weights"][:, BLENDER],
        "joint_names": lambda v: None}), rig(), "another tree than SMPL's"),
    ("joints in centimetres", with_character({"joints": lambda v: 100 * v["joints"]}), rig(), "centimetres"),
    # ---- in motions
    ("a motion in centimetres", moving(trans=lambda v: 100 * (v["trans"] + [0, 0.9, 0])), MOVED, "centimetres"),
    ("rotations in degrees", moving(poses=lambda v: np.degrees(v["poses"])), MOVED, "degrees"),
    ("two frames of constant channels",
     moving(poses=lambda v: v["poses"][[0, 0]], trans=lambda v: v["trans"][[0, 0]]), MOVED, "bake"),
    ("a jump between two takes", moving(trans=lambda v: v["trans"] + 5.0 * (np.arange(40) > 20)[:, None]), MOVED,
     "two takes"),
    ("joints of another rig", moving(joint_names=lambda v: np.array([f"bone{j}" for j in range(6)])),
     ["animate", "named.unic", "--motion", "moved.npz", "--out", "new.pc2"], "joint_names"),
    ("another number of joints", moving(poses=lambda v: np.zeros((40, 72))), MOVED, "numbers a frame"),
    ("no frame rate", moving(mocap_framerate=lambda v: None), MOVED, "frame rate"),
    # ---- joints of captures
    ("a model of another joint order", capture_of("named", joint_names=lambda v: np.array(list("abcdfe"))),
     ["eval", "named.unic", "named"],
     "in the place of"),
    ("names exchanged in capture.toml", lambda s: (s / "person/capture.toml").write_text(
        (s / "person/capture.toml").read_text().replace('"L_hip"', '"?"').replace('"R_hip"', '"L_hip"')
        .replace('"?"', '"R_hip"')), ["eval", "--baselines", "person"], "joint_names"),
    ("contacts that joint names do not tell", lambda s: (s / "tube/capture.toml").write_text(
        (s / "tube/capture.toml").read_text().replace("contact_joints = [1, 1, 1, 1]\n", "")), TRAIN,
     "contact_joints"),
    # ---- files of another kind
    ("FBX as a motion", bytes_of("x.fbx", b"Kaydara FBX Binary  "), [*ANIMATE, "--motion", "x.fbx"][:2]
     + ["--motion", "x.fbx", "--out", "new.pc2"], "expected an FBX file"),
    ("Alembic as a garment", bytes_of("x.abc", b"Ogawa\xff"), on("x.abc"), "Alembic"),
    ("a damaged Alembic file imported", bytes_of("x.abc", b"Ogawa\xff"), [
        "import", "--garment", "x.abc", "--motion", "walk.npz", "--character", "tube/character.npz", "--out", "new"],
     "x.abc"),
    ("an import over its own input", None, ["import", "--garment", "tube/clips/a.garment.npy", "--motion",
                                            "tube/clips/a.npz", "--out", "tube", "--overwrite"], "found the input"),
    ("an import in millimetres", lambda s: np.save(s / "mm.npy", 1000 * np.load(s / "tube/clips/a.garment.npy")), [
        "import", "--garment", "mm.npy", "--motion", "tube/clips/a.npz", "--clip", "new", "--out", "tube"],
     "by 0.001"),
    ("USD as a character", bytes_of("x.usdc", b"PXR-USDC"), [*rig()[:2], "x.usdc", *rig()[3:]], "USD"),
    ("glTF as a mesh", bytes_of("x.glb", b"glTF\x02\x00"), [*ANIMATE, "--mesh", "x.glb"], "glTF"),
    ("a Blender file inspected", bytes_of("x.blend", b"BLENDER-v300"), ["inspect", "x.blend"], "Blender"),
    ("a capture without capture.toml", lambda s: (s / "tube/capture.toml").unlink(), TRAIN, "without its capture.toml"),
    ("a simulation that was killed", lambda s: (s / "tube/capture.toml").rename(s / "tube/simulation.toml"), TRAIN,
     "--resume goes on"),
    ("the same inspected", lambda s: (s / "tube/capture.toml").rename(s / "tube/simulation.toml"),
     ["inspect", "tube"], "--resume goes on"),
    ("a run folder as a capture", None, ["train", "other.run", *SHORT, "--out", "new.unic"], "run folder"),
    ("a model as a capture", None, ["train", "tube.unic", *SHORT, "--out", "new.unic"], "found a file"),
    ("a capture as a model", None, ["eval", "tube", "tube"], "found a folder"),
    ("a mistyped setting", None, [*TRAIN, "--set", "optimizer.step=5"], "did you mean `optimiser.steps`"),
    ("a setting of another type", None, [*TRAIN, "--set", "batch.windows=many"], "batch.windows"),
    ("a mistyped option", None, [*TRAIN, "--stepz", "5"], "--stepz"),
    ("a clip of no split", None, [*EVAL, "--clips", "walk"], "walk"),
    ("a model with a flipped bit", lambda s: flipped(s / "tube.unic"), EVAL, "the file is damaged"),
    ("an archive of zeros", lambda s: bomb(s / "moved.npz"), MOVED, "moved.npz"),
    ("an archive of zeros inspected", lambda s: bomb(s / "moved.npz"), ["inspect", "moved.npz"], "moved.npz"),
    ("a model cut short", lambda s: (s / "tube.unic").write_bytes((s / "tube.unic").read_bytes()[:-100]), EVAL,
     "tube.unic"),
]


# ---- running the commands ----------------------------------------------------------------------


def contents(folder):
    """Paths and hashes of all files in a folder."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha1(path.read_bytes()).hexdigest() for path in files}


def check(title, prepare, command, words, template):
    """Makes a mistake. Returns the seconds to the refusal and the error message."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene"
        shutil.copytree(template, scene, symlinks=True)
        (scene / "hard.npz").unlink()
        os.link(scene / "walk.npz", scene / "hard.npz")
        if prepare:
            prepare(scene)
        before = contents(scene)
        begun = time.monotonic()
        done = run(scene, [*command, "--json"])
        seconds = time.monotonic() - begun
        told, name = done.stderr.strip().splitlines(), program(command).name
        about = f"{title}: {name} {' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}{done.stdout}"
        assert done.returncode in (1, 2), about
        error = json.loads(done.stdout)["error"]
        assert error["exit_code"] == done.returncode and words in error["message"], f"expected {words}: {about}"
        assert "panicked" not in done.stderr and error["kind"] != "internal", about
        if not done.stderr.startswith("error: "):
            assert told[-1] == f"{name}: {error['message']}", about
        assert seconds < LONGEST_S, f"{seconds:.1f} s: {about}"
        changed = {name for name, digest in contents(scene).items() if before.get(name) != digest}
        assert not changed and before.keys() == contents(scene).keys(), f"changed {changed}: {about}"
        return seconds, error["message"]


# Mistakes that `--force` accepts.
FORCED = [
    ("a garment 9 frames late", [*TRAIN, "--force"]),
    ("two frames of constant channels", [*MOVED, "--force"]),
    ("another mesh with Z up", [*ANIMATE, "--mesh", "z.obj", "--force"]),
]


def check_forced(title, command, template):
    """Checks that --force prints the warning and does the work."""
    prepare = next(prepare for named, prepare, _, _ in MISTAKES if named == title)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene"
        shutil.copytree(template, scene, symlinks=True)
        prepare(scene)
        done = run(scene, command)
        assert done.returncode == 0 and "probably" in done.stderr, f"forced: {title}: {done.stderr}"


# Commands that run for a long time.
STOPPED = [
    ["simulate", "--out", "new"],
    ["train", "tube", "--preset", "standard", "--steps", "100000", "--out", "new.unic"],
    ["eval", "tube.unic", "tube", "--dump", "new"],
    ["animate", "tube.unic", "--motion", "long.npz", "--out", "new.npz"],
    ["bench", "--vertices", "200000"],
    ["accuracy", "tube", "--budget", "1h", "--out", "new"],
    ["lasting", "tube.unic", "tube", "--frames", "1000000"],
    ["demo", "--out", "new"],
]


def check_stop(command, template, after):
    """Stops a command `after` some seconds. Returns the seconds from SIGTERM to its end.

    Returns None if the command has ended by itself.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene"
        shutil.copytree(template, scene, symlinks=True)
        running = subprocess.Popen([program(command), *command, "--json"], cwd=scene, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(after)
        if running.poll() is not None:
            running.communicate()
            return None
        begun = time.monotonic()
        running.send_signal(signal.SIGTERM)
        stdout, stderr = running.communicate()
        seconds = time.monotonic() - begun
        about = f"{program(command).name} {' '.join(command)} after {after} s: exit code {running.returncode}, {seconds:.1f} s\n{stderr}"
        if running.returncode == 0:
            return None
        assert running.returncode == 130, about
        assert '"kind": "interrupted"' in stdout and json.loads(stdout)["error"], f"{about}{stdout}"
        assert seconds < PATIENCE_S, about
        left = [str(path) for path in scene.rglob("*") if path.name.endswith(".tmp")]
        assert not left, f"{left}: {about}"
        return seconds


def main():
    with tempfile.TemporaryDirectory() as folder:
        template = Path(folder)
        make_scene(template)
        rows, stops, failures = [], [], []
        for title, prepare, command, words in MISTAKES:
            try:
                rows.append((title, *check(title, prepare, command, words, template)))
            except AssertionError as failure:
                failures.append(str(failure))
        for title, command in FORCED:
            try:
                check_forced(title, command, template)
            except AssertionError as failure:
                failures.append(str(failure))
        for command, after in [(command, after) for command in STOPPED for after in (0.3, 2.0)]:
            try:
                stops.append(check_stop(command, template, after))
            except AssertionError as failure:
                failures.append(str(failure))
    if "--table" in sys.argv:
        print("| mistake | message | s |\n|---|---|---|")
        for title, seconds, message in rows:
            print(f"| {title} | {message.replace('|', '/')} | {seconds:.2f} |")
    median = statistics.median(seconds for _, seconds, _ in rows)
    slowest = max((seconds for seconds in stops if seconds is not None), default=0.0)
    print("\n\n".join(failures))
    print(f"{len(rows)} mistakes refused, median {median:.2f} s; {len(stops)} stops, the slowest {slowest:.2f} s")
    sys.exit(bool(failures))


main()
