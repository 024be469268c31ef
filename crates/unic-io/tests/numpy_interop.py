"""The other side of numpy.rs: numpy itself reads what unic-io wrote and writes what it reads.

usage: numpy_interop.py write FOLDER | numpy_interop.py check FOLDER
Every array written holds value(index) = index in C order, minus 3, unless noted otherwise.
"""

import sys
from pathlib import Path

import numpy as np


def ramp(shape, dtype, order="C"):
    values = np.arange(np.prod(shape, dtype=int)).reshape(shape) - 3
    return np.asarray(values.astype(dtype), order=order)


def write(folder):
    arrays = {}
    for code in ["f2", "f4", "f8", "i1", "i2", "i4", "i8"]:
        for endian, name in [("<", "little"), (">", "big")]:
            for order in "CF":
                arrays[f"{code}_{name}_{order}"] = ramp((2, 3, 4), endian + code, order)
    for code in ["u1", "u2", "u4", "u8"]:
        arrays[f"{code}_plus_3"] = (ramp((5,), "i8") + 3).astype(code)
    arrays["bool"] = np.array([True, False, True])
    arrays["scalar"] = np.float64(29.97)
    arrays["empty"] = np.zeros((0, 3), np.float32)
    arrays["text"] = np.array(["pelvis", "L_hüft", ""])
    arrays["bytes"] = np.array([b"ab", b"c"])
    arrays["objects"] = np.array([{"a": 1}, None], dtype=object)
    arrays["structure"] = np.zeros(2, dtype=[("x", "<f4"), ("y", "<i4")])
    arrays["complex"] = np.zeros(2, np.complex64)
    arrays["nan"] = np.array([0.0, np.nan])
    np.savez(folder / "stored.npz", **arrays)
    np.savez_compressed(folder / "deflated.npz", **arrays)
    np.save(folder / "plain.npy", ramp((4, 5, 3), "<f4"))
    np.save(folder / "fortran.npy", ramp((4, 5, 3), ">f8", "F"))
    with open(folder / "version2.npy", "wb") as file:
        np.lib.format.write_array(file, ramp((4, 5, 3), "<f4"), version=(2, 0))


def check(folder):
    with np.load(folder / "ours.npz", allow_pickle=False) as npz:
        assert sorted(npz.files) == ["bools", "f32", "f64", "i32", "scalar", "text", "u32"], npz.files
        assert npz["f32"].dtype == np.float32 and (npz["f32"] == ramp((2, 3, 4), "f4")).all()
        assert npz["f64"].dtype == np.float64 and (npz["f64"] == ramp((6,), "f8")).all()
        assert npz["i32"].dtype == np.int32 and (npz["i32"] == ramp((3, 2), "i4")).all()
        assert npz["u32"].dtype == np.uint32 and (npz["u32"] == [0, 2**32 - 1]).all()
        assert npz["bools"].dtype == bool and (npz["bools"] == [True, False]).all()
        assert npz["scalar"].shape == () and npz["scalar"] == 29.97
        assert list(npz["text"]) == ["pelvis", "knée", ""]
    frames = ramp((4, 5, 3), "f4")
    streamed = np.load(folder / "streamed.npy", mmap_mode="r", allow_pickle=False)
    assert streamed.dtype == np.float32 and (streamed == frames).all()
    assert (np.load(folder / "whole.npy") == frames).all()
    with np.load(folder / "animation.npz", allow_pickle=False) as npz:
        assert npz["vertices"].dtype == np.float32 and (npz["vertices"] == frames).all()
        assert (npz["faces"] == [[0, 1, 2], [2, 3, 4]]).all() and npz["fps"] == 24.0
    check_pc2(folder / "animation.pc2", frames)
    check_obj(folder / "animation", frames)
    check_capture(folder / "capture")


def check_pc2(path, frames):
    data = path.read_bytes()
    head = np.frombuffer(data, np.dtype([
        ("magic", "S12"), ("version", "<i4"), ("points", "<i4"),
        ("start", "<f4"), ("rate", "<f4"), ("samples", "<i4"),
    ]), count=1)[0]
    assert head["magic"] == b"POINTCACHE2" and head["version"] == 1
    assert (head["points"], head["samples"], head["rate"]) == (5, 4, 1.0)
    assert (np.frombuffer(data, "<f4", offset=32).reshape(4, 5, 3) == frames).all()


def check_obj(folder, frames):
    files = sorted(folder.iterdir())
    assert [f.name for f in files] == [f"frame_{t:04}.obj" for t in range(4)], files
    for path, frame in zip(files, frames):
        lines = [line.split() for line in path.read_text().splitlines()]
        vertices = np.array([line[1:] for line in lines if line[0] == "v"], np.float32)
        assert (vertices == frame).all()
        assert [line[1:] for line in lines if line[0] == "f"] == [["1", "2", "3"], ["3", "4", "5"]]


def check_capture(root):
    import tomllib

    manifest = tomllib.loads((root / "capture.toml").read_text())
    assert manifest["version"] == 1 and manifest["up"] == "y" and manifest["units"] == "metres"
    assert manifest["splits"] == {"train": ["walk"], "test": []}, manifest
    with np.load(root / "clips/walk.npz", allow_pickle=False) as npz:
        assert npz["poses"].shape == (3, 6) and npz["trans"].shape == (3, 3)
        assert np.allclose(npz["poses"][2], [0.2, 0.2, -0.3, 0.4, 0, 0], atol=1e-6)
        assert npz["mocap_framerate"] == 30.0 and npz["ground_height"] == -0.125
    with np.load(root / "character.npz", allow_pickle=False) as npz:
        assert npz["weights"].shape == (4, 2) and list(npz["parents"]) == [-1, 0]
        assert list(npz["joint_names"]) == ["hip", "knée"]
    assert np.load(root / "clips/walk.garment.npy", mmap_mode="r").shape == (3, 4, 3)


if __name__ == "__main__":
    {"write": write, "check": check}[sys.argv[1]](Path(sys.argv[2]))
