"""Imports the files of `unic animate` into Blender and compares every vertex with the .npz file.

Contract: after an import by docs/guides/animate.md, body and garment of a .glb, an .abc, a .usdc, a .usda, a
.pc2 or .mdd on its .obj and a folder of OBJ files are upright in Blender's world (+Z up), in metres. In each frame their vertices
are within 0.01 mm of those of the .npz. Files that state a frame rate keep it in a scene of another rate. The
same holds for a garment with sixteen times the triangles: 59,678 vertices on the demo's T-shirt. What Blender
writes of that garment again, as Alembic and USD, is imported as a capture within 0.01 mm.

    python3 tests/blender_readers.py target/release/unic                         makes its own capture
    python3 tests/blender_readers.py target/release/unic MODEL.unic MOTION.npz   at most 300 frames of motion

The test needs `pip install bpy` (4.2 or later, 370 MB), numpy and safetensors. It is skipped without
bpy.
"""

import sys
import tempfile
from pathlib import Path

try:
    import bpy
except ImportError:
    print("skipped: no Blender (pip install bpy)")
    sys.exit(0)

import numpy as np
from safetensors import safe_open

from gltf import Glb
from readers import unic, write_capture

LARGEST_MM = 0.01
# Frames of the fine garment: three seconds of a file would be 200 MB.
FINE_FRAMES = 10


def empty_scene(fps):
    """Empties the scene and sets its frame rate, by which importers place key frames."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(fps)


def positions(object):
    """World positions (V, 3) in the current frame, turned from Blender's +Z up to +Y up."""
    evaluated = object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    evaluated.to_mesh_clear()
    world = np.array(evaluated.matrix_world)
    x, y, z = (flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]).T
    return np.stack([x, z, -y], axis=1)


def largest_mm(found, expected):
    """Largest distance in mm; a .glb has copies of vertices after those of the garment."""
    return 1e3 * np.linalg.norm(found[:len(expected)] - expected, axis=1).max()


def sample_frames(count):
    """Frames to compare: some at the beginning, in the middle and at the end."""
    return sorted({0, 1, 2, count // 3, count // 2, count - 2, count - 1})


def largest_over_frames(truth, current, rate=1):
    """Largest difference in mm over some frames; `current` returns the positions in a frame.

    The scene has `rate` frames for each frame of the truth.
    """
    worst = 0.0
    for frame in sample_frames(len(truth)):
        bpy.context.scene.frame_set(rate * frame)
        found = current()
        assert np.isfinite(found).all()
        worst = max(worst, largest_mm(found, truth[frame]))
    return worst


def import_glb(path):
    bpy.ops.import_scene.gltf(filepath=str(path))


def import_abc(path):
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)


def check_glb(folder, truth):
    import_glb(folder / "d.glb")
    objects = bpy.data.objects
    errors = {f"{name} of a .glb": largest_over_frames(truth[name], lambda: positions(objects[name]))
              for name in truth}
    # Between two key frames positions are interpolated linearly.
    bpy.context.scene.frame_set(3, subframe=0.5)
    halfway = (truth["garment"][3] + truth["garment"][4]) / 2
    errors["garment of a .glb, halfway"] = largest_mm(positions(objects["garment"]), halfway)
    return errors


def check_abc(folder, truth):
    import_abc(folder / "d.abc")
    objects = bpy.data.objects
    return {f"{name} of an .abc": largest_over_frames(truth[name], lambda: positions(objects[name]))
            for name in truth}


def check_usd(folder, truth):
    """Imports both forms of USD. Blender shows a time code a frame, whatever the scene's rate."""
    errors = {}
    for name in ("d.usdc", "d.usda"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.usd_import(filepath=str(folder / name))
        scene = bpy.context.scene
        assert (scene.frame_start, scene.frame_end) == (0, len(truth["garment"]) - 1), scene.frame_end
        errors |= {f"{part} of {name}": largest_over_frames(truth[part], lambda: positions(bpy.data.objects[part]))
                   for part in truth}
    return errors


def check_rates(folder, truth, fps):
    """Imports files into a scene of twice their rate: every second frame is one of theirs."""
    errors = {}
    for name, load in (("d.glb", import_glb), ("d.abc", import_abc)):
        empty_scene(2 * fps)
        load(folder / name)
        for part in truth:
            errors[f"{part} of {name} at twice the rate"] = largest_over_frames(
                truth[part], lambda: positions(bpy.data.objects[part]), rate=2)
    return errors


def import_obj(path):
    """Imports an OBJ with the default settings of the menu, Forward -Z and Up Y.

    They turn the object and leave its vertices as they are in the file.
    """
    bpy.ops.wm.obj_import(filepath=str(path))
    return bpy.context.selected_objects[0]


def check_caches(folder, truth):
    """Adds Mesh Cache modifiers with their default settings, Forward +Y and Up +Z.

    They move vertices before the object is turned.
    """
    errors = {}
    for name, stem in (("garment", "d"), ("body", "d.body")):
        object = import_obj(folder / f"{stem}.obj")
        cache = object.modifiers.new("cache", "MESH_CACHE")
        for kind in ("PC2", "MDD"):
            cache.cache_format, cache.frame_start = kind, 0
            cache.filepath = str(folder / f"{stem}.{kind.lower()}")
            errors[f"{name} of a .{kind.lower()}"] = largest_over_frames(truth[name], lambda: positions(object))
    return errors


def check_obj_folder(folder, truth):
    errors = {}
    for name, part in (("garment", "d"), ("body", "d_body")):
        last = len(truth[name]) - 1
        object = import_obj(folder / part / f"frame_{last:04}.obj")
        errors[f"{name} of a folder of OBJ files"] = largest_mm(positions(object), truth[name][last])
    return errors


def refined(vertices, faces):
    """Vertices and faces with each triangle cut into four at the middles of its edges."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, middle = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = middle.reshape(3, -1) + len(vertices)
    (a, b, c) = faces.T
    smaller = np.concatenate([np.stack(corners, axis=1) for corners in
                              ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return np.concatenate([vertices, vertices[edges].mean(axis=1)]), smaller


def fine_garment(folder, model):
    """Writes the rest shape of a model's garment with sixteen times the triangles as OBJ."""
    with safe_open(model, "np") as file:
        vertices, faces = file.get_tensor("garment.vertices"), file.get_tensor("garment.faces").astype(int)
    for _ in range(2):
        vertices, faces = refined(vertices, faces)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist()]
    (folder / "fine.obj").write_text("".join(lines))
    return folder / "fine.obj"


def animate(folder, model, motion, *more):
    """Animates in every format. Returns positions (T, V, 3) of garment and body by name, and the frame rate."""
    for out in ("d.npz", "d.glb", "d.abc", "d.usdc", "d.usda", "d.pc2", "d.mdd", "d"):
        unic("animate", model, "--motion", motion, "--up", "y", "--overwrite", "--out", folder / out, *more)
    caches = {name: np.load(folder / f"{file}.npz") for name, file in (("garment", "d"), ("body", "d.body"))}
    return {name: cache["vertices"] for name, cache in caches.items()}, float(caches["garment"]["fps"])


def compare(folder, truth, fps):
    """Largest differences in mm, by what is compared."""
    errors = {}
    for check in (check_glb, check_abc, check_usd, check_caches, check_obj_folder):
        empty_scene(fps)
        errors |= check(folder, truth)
    return errors


def import_written_again(folder, motion, truth):
    """Lets Blender write the animation again, and imports that as a capture."""
    frames, errors = len(truth), {}
    character = Path(motion).resolve().parents[1] / "character.npz"
    for name, load, save in (
        ("abc", import_abc, lambda path: bpy.ops.wm.alembic_export(
            filepath=path, start=0, end=frames - 1, as_background_job=False)),
        ("usdc", lambda path: bpy.ops.wm.usd_import(filepath=str(path)), lambda path: bpy.ops.wm.usd_export(
            filepath=path, export_animation=True)),
    ):
        empty_scene(bpy.context.scene.render.fps)
        load(folder / f"d.{name}")
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 0, frames - 1
        again = folder / f"again.{name}"
        save(str(again))
        unic("import", "--garment", again, "--object", "garment", "--rest", folder.parent / "fine.obj", "--character",
             character, "--motion", motion, "--clip", name, "--frames", f"0..{frames}", "--out", folder / name)
        clip = folder / name / "clips" / f"{name}.garment.npy"
        # Small clips hold the garment themselves.
        found = np.load(clip) if clip.exists() else np.load(clip.with_name(f"{name}.npz"))["garment"]
        errors[f"garment that Blender writes again as {name}"] = max(map(largest_mm, found, truth))
    return errors


def four_influences(folder, truth):
    """Mean and largest error in mm of the body in readers that use four influences per vertex."""
    glb = Glb(folder / "d.glb")
    frames = sample_frames(len(truth))
    errors = np.concatenate([np.linalg.norm(glb.body(t, sets=1) - truth[t], axis=1) for t in frames])
    return 1e3 * errors.mean(), 1e3 * errors.max()


def small_model(folder):
    write_capture(folder / "tube")
    model = folder / "tiny.unic"
    unic("train", folder / "tube", "--preset", "tiny", "--steps", 2, "--out", model)
    return model, folder / "tube/clips/d.npz"


def main():
    with tempfile.TemporaryDirectory() as name:
        folder, fine = Path(name), Path(name) / "fine"
        fine.mkdir()
        model, motion = sys.argv[2:4] if len(sys.argv) > 3 else small_model(folder)
        truth, fps = animate(folder, model, motion)
        errors = compare(folder, truth, fps) | check_rates(folder, truth, fps)
        mean, largest = four_influences(folder, truth["body"])
        options = ("--mesh", fine_garment(folder, model), "--frames", f"0..{FINE_FRAMES}")
        fine_truth, _ = animate(fine, model, motion, *options)
        vertices = fine_truth["garment"].shape[1]
        errors |= {f"{name}, {vertices} vertices": error for name, error in compare(fine, fine_truth, fps).items()
                   if name.startswith("garment")}
        errors |= import_written_again(fine, motion, fine_truth["garment"])
    print(f"Blender {bpy.app.version_string}, {len(truth['garment'])} frames, largest difference in mm:")
    for name, error in errors.items():
        print(f"  {name}: {error:.4f}{'' if error < LARGEST_MM else '  FAILED'}")
    print(f"  (body of the .glb with four influences per vertex: {largest:.4f}, mean {mean:.4f})")
    return int(max(errors.values()) >= LARGEST_MM)


if __name__ == "__main__":
    sys.exit(main())
