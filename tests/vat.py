"""Opens vertex animation textures in Blender and compares every texel with the .npz of the same animation.

Contract: texels of an .exr are the positions of the .npz bit by bit, those of a .png lie within 16 bits of the
bounds. The second texture coordinate of each vertex of the mesh leads to its texel in frame 0.

    python3 tests/vat.py target/release/unic MODEL.unic MOTION.npz

The test needs `pip install bpy` (4.2 or later, 370 MB) and numpy. It is skipped without bpy.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import bpy
except ImportError:
    print("skipped: no Blender (pip install bpy)")
    sys.exit(0)

import numpy as np

from gltf import Glb


def texels(path):
    """Texels (height, width, 3) of a picture, the first row at the top."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], image.channels)[::-1, :, :3]


def by_vertex(rows, about):
    """Values (frames, vertices, 3) of the texels."""
    return rows.reshape(about["frames"], -1, 3)[:, :about["vertices"]]


def check_lookup(path, about, expected):
    """Compares the positions of the mesh with the texels that its vertices lead to."""
    glb = Glb(path)
    positions, lookup = (glb.attribute("garment", name) for name in ["POSITION", "TEXCOORD_1"])
    column = np.floor(lookup[:, 0] * about["width"]).astype(int)
    row = np.floor(lookup[:, 1] * about["height"]).astype(int)
    assert row.max() < about["rows_a_frame"] and len(positions) >= about["vertices"]
    assert (positions == expected[row * about["width"] + column]).all()


def check(unic, model, motion, folder):
    options = [unic, "animate", model, "--motion", motion, "--frames", "0..40"]
    for name, vat in [("walk.npz", "walk.exr"), ("other.npz", "other_vat.png")]:
        subprocess.run([*options, "--out", name, "--vat", vat], cwd=folder, check=True, capture_output=True)
    truth = np.load(folder / "walk.npz")["vertices"]
    about = json.loads((folder / "walk.vat.json").read_text())
    assert (about["frames"], about["vertices"]) == truth.shape[:2]
    assert (by_vertex(texels(folder / "walk.exr"), about) == truth).all()
    check_lookup(folder / "walk.vat.glb", about, truth[0])
    normals = 2 * by_vertex(texels(folder / "walk.normals.png"), about) - 1
    assert abs(np.linalg.norm(normals, axis=2) - 1).max() < 0.01
    about = json.loads((folder / "other_vat.vat.json").read_text())
    low, high = np.array(about["minimum"]), np.array(about["maximum"])
    found = low + by_vertex(texels(folder / "other_vat.png"), about) * (high - low)
    off = abs(found - truth).max()
    assert off < 0.6 * (high - low).max() / 65535 + 1e-6, off
    print(f"textures of {about['frames']} frames: .exr exact, .png within {1e3 * off:.4f} mm")


if __name__ == "__main__":
    unic, model, motion = (str(Path(path).resolve()) for path in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as folder:
        check(unic, model, motion, Path(folder))
