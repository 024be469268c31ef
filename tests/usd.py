"""Opens the USD files of `unic animate` with Pixar's library and compares every vertex with the .npz file.

Contract: a .usdc and its .usda hold the same layer: metres, +Y up, the model's frame rate, one time sample a
frame. Positions are those of the .npz bit by bit, normals are unit vectors, bounds are those of the positions.

    python3 tests/usd.py target/release/unic MODEL.unic MOTION.npz

The test needs `pip install usd-core` and numpy. It is skipped without usd-core.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

try:
    from pxr import Usd, UsdGeom
except ImportError:
    print("skipped: no USD (pip install usd-core)")
    sys.exit(0)

import numpy as np


def check_stage(stage, fps, frames):
    """Compares the metadata of a layer with what captures have."""
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetFramesPerSecond() == stage.GetTimeCodesPerSecond() == fps
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, frames - 1)
    assert stage.GetDefaultPrim().GetPath() == "/animation"


def check_mesh(mesh, truth):
    """Compares a mesh with the arrays of an .npz file, frame by frame."""
    vertices = truth["vertices"]
    assert mesh.GetPointsAttr().GetTimeSamples() == list(range(len(vertices)))
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert mesh.GetNormalsInterpolation() == "vertex"
    faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    assert (faces == truth["faces"]).all() and set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
    for frame, expected in enumerate(vertices):
        assert (np.array(mesh.GetPointsAttr().Get(frame)) == expected).all(), f"frame {frame}"
        low, high = np.array(mesh.GetExtentAttr().Get(frame))
        assert (low == expected.min(0)).all() and (high == expected.max(0)).all()
    corners = vertices[-1][faces]
    sums = np.zeros_like(vertices[-1])
    np.add.at(sums, faces.ravel(), np.repeat(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), 3, 0))
    normals = np.array(mesh.GetNormalsAttr().Get(len(vertices) - 1))
    assert ((sums * normals).sum(1) > 0.999 * np.linalg.norm(sums, axis=1)).all()
    coordinates = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    if coordinates.IsDefined():
        assert coordinates.GetInterpolation() == "faceVarying"
        assert len(coordinates.GetIndices()) == faces.size
        assert max(coordinates.GetIndices()) < len(coordinates.Get())
    return coordinates.IsDefined()


def check(unic, model, motion, folder):
    for name in ["walk.npz", "walk.usdc", "walk.usda"]:
        subprocess.run([unic, "animate", model, "--motion", motion, "--frames", "0..40", "--out", name, "--picture",
                        f"{name}.png"], cwd=folder, check=True, capture_output=True)
    truth = {"garment": np.load(folder / "walk.npz"), "body": np.load(folder / "walk.body.npz")}
    texts, textured = [], 0
    for name in ["walk.usdc", "walk.usda"]:
        stage = Usd.Stage.Open(str(folder / name))
        check_stage(stage, float(truth["garment"]["fps"]), len(truth["garment"]["vertices"]))
        for mesh, arrays in truth.items():
            textured += check_mesh(UsdGeom.Mesh(stage.GetPrimAtPath(f"/animation/{mesh}")), arrays)
        texts.append(stage.GetRootLayer().ExportToString())
    assert texts[0] == texts[1]
    assert textured, "expected a garment with texture coordinates"
    print(f"{len(truth['garment']['vertices'])} frames of USD are those of the .npz")


if __name__ == "__main__":
    unic, model, motion = (str(Path(path).resolve()) for path in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as folder:
        check(unic, model, motion, Path(folder))
