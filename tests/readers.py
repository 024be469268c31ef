"""Independent readers and writers of the files of `unic`, without any of its code.

Contract:
- A capture written with numpy by docs/reference/capture.md can be trained on.
- The tensors of a model are those of docs/reference/model-file.md.
- The settings of every preset are those of docs/reference/settings.md.
- Animations in all formats hold the same positions.
- The body in them follows the kinematics of docs/reference/capture.md.
- The errors that `unic eval` prints are those of the positions that it dumps.

    python3 tests/readers.py target/release/unic
"""

import importlib.util
import json
import re
import struct
import subprocess
import sys
import tempfile
import tomllib
import zlib
from pathlib import Path

import numpy as np
from safetensors import safe_open

from figures import FPS, FRAMES, matrices, motion, skinned, tube, unrolled, write_capture, write_character
from gltf import Glb

UNIC = str(Path(sys.argv[1]).resolve())
DOCS = Path(__file__).resolve().parent.parent / "docs"
PRESETS = ["paper", "standard", "tiny"]


def unic(*arguments):
    """Runs the program and returns its JSON object."""
    done = subprocess.run([UNIC, *map(str, arguments), "--json"], capture_output=True, text=True)
    assert done.returncode == 0, f"unic {arguments}: {done.stderr}"
    return json.loads(done.stdout)


# ---- tables of the documentation ---------------------------------------------------------------


def table(page, first_column):
    """Rows of the tables of a page whose first heading is given, as lists of cells."""
    rows, inside = [], False
    for line in (DOCS / page).read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if cells and cells[0] == first_column:
            inside = True
        elif inside and not cells:
            inside = False
        elif inside and not set(cells[0]) <= set("-: "):
            rows.append(cells)
    assert rows, f"{page}: a table that begins with {first_column}"
    return rows


def flattened(value, prefix=""):
    """Nested dictionaries as one dictionary with dotted keys."""
    if not isinstance(value, dict):
        return {prefix: value}
    parts = (flattened(inner, f"{prefix}.{key}" if prefix else key) for key, inner in value.items())
    return {key: leaf for part in parts for key, leaf in part.items()}


def bound(size, letters):
    """Number for a size such as 3, V or 2D, with the numbers that the letters stand for."""
    number, letter = re.fullmatch(r"(\d*)([A-Z]?)", size).groups()
    return int(number or 1) * (letters[letter] if letter else 1)


# ---- checks ------------------------------------------------------------------------------------


def check_settings(folder, preset):
    """Compares docs/reference/settings.md with the config.toml of a preset."""
    stored = flattened(tomllib.loads((folder / f"{preset}.run/config.toml").read_text()))
    column = 1 + PRESETS.index(preset)
    page = {row[0].strip("`"): row[column].strip("`") for row in table("reference/settings.md", "setting")}
    page = {key: tomllib.loads(f"v = {value}")["v"] for key, value in page.items() if value != "absent"}
    # The models are trained with --steps, which replaces the epochs of a preset too.
    page["optimiser.steps"] = stored["optimiser.steps"]
    page.pop("optimiser.epochs", None)
    assert page == stored, f"{preset}: {set(map(str, page.items())) ^ set(map(str, stored.items()))}"


def check_tensors(path):
    """Compares docs/reference/model-file.md with a model.

    Every tensor has one row, with its type and shape.
    """
    rows = []
    for name, dtype, shape, *_ in table("reference/model-file.md", "tensor"):
        pattern = re.escape(name.strip("`")).replace("N", r"\d+")
        rows.append((pattern, dtype, [size for size in shape.split(" × ")]))
    types = {"f32": np.float32, "i8": np.int8, "i16": np.int16, "u16": np.uint16, "u32": np.uint32, "i64": np.int64}
    with safe_open(path, "np") as file:
        names = list(file.keys())
        letters = {}
        found = {}
        for name in names:
            matching = [row for row in rows if re.fullmatch(row[0], name)]
            assert len(matching) == 1, f"{name} has {len(matching)} rows in reference/model-file.md"
            found[name] = (file.get_tensor(name), matching[0])
        for tensor, (_, dtype, shape) in found.values():
            assert tensor.dtype == types[dtype] and tensor.ndim == len(shape), (tensor.dtype, dtype)
            letters.update({size: n for size, n in zip(shape, tensor.shape) if re.fullmatch("[A-Z]", size)})
        for name, (tensor, (_, _, shape)) in found.items():
            sizes = [n if size == "·" else bound(size, letters) for size, n in zip(shape, tensor.shape)]
            assert list(tensor.shape) == sizes, f"{name}: {tensor.shape}, {shape} with {letters}"
        metadata = json.loads(file.metadata()["unic"])
    assert set(metadata) == {row[0].strip("`") for row in table("reference/model-file.md", "key")}, set(metadata)
    for owner in ("character", "garment"):
        counts, weights = (found[f"{owner}.skinning.{part}"][0] for part in ("counts", "weights"))
        counts = counts.astype(int)
        sums = np.add.reduceat(weights, np.concatenate([[0], np.cumsum(counts[:-1])]))
        assert counts.sum() == len(weights) and np.abs(sums - 1).max() < 1e-5, owner


def check_checksum(path):
    """Checks the CRC-32 of the whole file, whose own digits count as zeros."""
    data = path.read_bytes()
    with safe_open(path, "np") as file:
        checksum = json.loads(file.metadata()["unic"])["checksum"]
    plain = data.replace(checksum.encode(), b"crc32:00000000", 1)
    assert checksum == f"crc32:{zlib.crc32(plain):08x}", checksum
    damaged = path.with_name("damaged.unic")
    damaged.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    run = subprocess.run([UNIC, "inspect", damaged], capture_output=True, text=True)
    assert run.returncode != 0 and "the file is damaged" in run.stdout, run


def read_pc2(path):
    data = path.read_bytes()
    signature, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
    assert (signature, version, start, rate) == (b"POINTCACHE2\0", 1, 0.0, 1.0), data[:32]
    return np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(x) for x in line[1:4]] for line in lines if line[:1] == ["v"]]
    faces = [[int(corner.split("/")[0]) - 1 for corner in line[1:]] for line in lines if line[:1] == ["f"]]
    return np.array(vertices), np.array(faces)


def check_animations(folder, capture):
    """Checks that garment and body are the same in every format, and that the picture is a PNG."""
    model, clip = folder / "tiny.unic", capture / "clips/d.npz"
    for out in ("d.npz", "d.pc2", "d", "d.glb"):
        picture = folder / f"{out}.png"
        unic("animate", model, "--motion", clip, "--up", "y", "--out", folder / out, "--picture", picture)
        assert picture.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    for part, folder_part in (("", ""), (".body", "_body")):
        npz = np.load(folder / f"d{part}.npz")
        positions, faces = npz["vertices"], npz["faces"]
        assert positions.dtype == np.float32 and len(positions) == FRAMES and npz["fps"] == FPS
        assert np.isfinite(positions).all()
        assert np.array_equal(read_pc2(folder / f"d{part}.pc2"), positions)
        objs = sorted((folder / f"d{folder_part}").glob("frame_*.obj"))
        assert len(objs) == FRAMES
        for frame, path in enumerate(objs):
            vertices, obj_faces = read_obj(path)
            assert np.abs(vertices - positions[frame]).max() < 1e-6 and np.array_equal(obj_faces, faces)
        mesh_faces = read_obj(folder / f"d{part}.obj")[1]
        assert np.array_equal(mesh_faces, faces)


def check_glb(folder, capture):
    """Compares every frame of the GLB, and its texture coordinates, with the .npz."""
    glb = Glb(folder / "d.glb")
    garment, body = (np.load(folder / f"d{part}.npz")["vertices"] for part in ("", ".body"))
    assert np.allclose(glb.times, np.arange(FRAMES) / FPS), glb.times
    for frame in range(FRAMES):
        error = np.abs(glb.garment(frame)[:garment.shape[1]] - garment[frame]).max()
        assert error < 1e-6, f"garment, frame {frame}: {error} m"
        error = np.abs(glb.body(frame) - body[frame]).max()
        assert error < 3e-6, f"body, frame {frame}: {error} m"
    corners = glb.array(glb.primitive("garment")["indices"]).reshape(-1, 3)
    faces = np.load(folder / "d.npz")["faces"]
    expected_uvs, numbers = unrolled(faces)
    assert np.allclose(glb.attribute("garment", "TEXCOORD_0")[corners], expected_uvs[numbers] * [1, -1] + [0, 1])
    assert np.allclose(glb.garment(FRAMES - 1)[corners], garment[-1][faces], atol=1e-6)
    assert "JOINTS_1" in glb.primitive("body")["attributes"]


def check_trimesh(folder, capture):
    """Checks that a reader without animation shows the garment's first frame and the bind pose."""
    import trimesh

    scene = trimesh.load(folder / "d.glb", process=False)
    garment, faces = (np.load(folder / "d.npz")[name] for name in ("vertices", "faces"))
    meshes = {name: scene.geometry[geometry].copy().apply_transform(transform) for name in ("garment", "body")
              for transform, geometry in [scene.graph[name]]}
    assert np.abs(meshes["garment"].triangles - garment[0][faces]).max() < 1e-6
    rest = np.load(capture / "character.npz")
    assert np.abs(meshes["body"].triangles - rest["vertices"][rest["faces"]]).max() < 1e-6


def check_body(folder, capture):
    """Compares the body beside the garment with skinning by numpy."""
    character, (poses, trans) = np.load(capture / "character.npz"), motion(3)
    expected = skinned(character, poses, trans, character["vertices"].astype(float), character["weights"])
    error = np.abs(np.load(folder / "d.body.npz")["vertices"] - expected).max()
    assert error < 2e-6, f"{error} m"


METRICS = {
    "rmse_mm", "mean_vertex_error_mm", "hausdorff_mm", "intersecting_vertices_percent_paper",
    "intersecting_vertices_percent_closest", "intersecting_frames_percent", "jitter_ratio",
    "rmse_mm_at_1s", "rmse_mm_at_5s", "rmse_mm_at_10s", "rmse_mm_at_60s", "drift_mm",
}
BASELINES = {
    "hold": "one_step", "mean_shape": "free_running", "skinning": "free_running",
    "skinning_mean": "free_running", "ridge": "free_running", "linear_dynamics": "free_running",
}


def check_scores(scores):
    rows = [scores["model"]["one_step"], scores["model"]["free_running"]]
    rows += [scores["baselines"][name][mode] for name, mode in BASELINES.items()]
    # Only models with a prior have this row; preset tiny is one.
    rows.append(scores["baselines"]["prior"]["free_running"])
    for row in rows:
        assert METRICS <= set(row), METRICS - set(row)


def check_evaluation(folder, capture):
    """Checks the keys of `unic eval`, and computes its errors again from the dumped positions."""
    scores = unic("eval", folder / "tiny.unic", capture, "--dump", folder / "dump")
    check_scores(scores)
    check_scores(scores["clips"]["d"])
    dump = np.load(folder / "dump/d.npz")
    truth = np.load(capture / "clips/d.garment.npy")
    assert np.array_equal(dump["truth"], truth)
    rows = {f"{name}.{mode}": m for name, modes in scores["baselines"].items() for mode, m in modes.items()}
    rows |= {f"model.{mode}": m for mode, m in scores["model"].items()}
    assert set(dump.files) == {"truth", *rows}, dump.files
    for name, metrics in rows.items():
        error = np.linalg.norm(dump[name][1:].astype(float) - truth[1:], axis=2)
        second = error[:FPS]
        for key, value in (("rmse_mm", np.sqrt((error**2).mean())), ("mean_vertex_error_mm", error.mean()),
                           ("rmse_mm_at_1s", np.sqrt((second**2).mean()))):
            if metrics[key] is not None:
                assert abs(metrics[key] - 1e3 * value) < 1e-3, (name, key, metrics[key], 1e3 * value)


def checks(folder):
    """Names and functions of the checks. Later ones use the files of earlier ones."""
    capture = folder / "tube"

    def trains(preset):
        unic("train", capture, "--preset", preset, "--steps", 2, "--out", folder / f"{preset}.unic")

    yield "a capture written by numpy", lambda: (write_capture(capture), unic("inspect", capture))
    for preset in PRESETS:
        yield f"training with preset {preset}", lambda: trains(preset)
        yield f"settings of preset {preset}", lambda: check_settings(folder, preset)
        yield f"tensors of a model of preset {preset}", lambda: check_tensors(folder / f"{preset}.unic")
    yield "checksum of a model", lambda: check_checksum(folder / "tiny.unic")
    yield "animations as npz, PC2 and OBJ", lambda: check_animations(folder, capture)
    yield "animations as GLB", lambda: check_glb(folder, capture)
    if importlib.util.find_spec("trimesh"):
        yield "GLB in trimesh", lambda: check_trimesh(folder, capture)
    else:
        print("skipped: no trimesh")
    yield "the body's kinematics", lambda: check_body(folder, capture)
    yield "evaluation", lambda: check_evaluation(folder, capture)


def main():
    passed = failed = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, check in checks(Path(folder)):
            try:
                check()
                passed += 1
                print(f"{name}: ok")
            except Exception as error:  # A failed check must not hide the others.
                failed += 1
                print(f"{name}: FAILED\n  {type(error).__name__}: {error}")
    print(f"readers: {passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
