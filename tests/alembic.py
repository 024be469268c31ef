"""Exchanges Alembic files between Blender and crate `ogawa`, and compares every vertex of every frame.

Contract: positions, polygons and texture coordinates that Blender exports are read exactly, below
moving parents too. What is read and written again is imported into Blender with the same vertices in
the same frames, upright, in metres. Vertices differ by at most 0.01 mm.

    cargo build --release -p ogawa --examples
    python3 tests/alembic.py target/release/examples

The test needs `pip install bpy` (4.2 or later, 370 MB) and numpy. It is skipped without bpy.
"""

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

LARGEST_MM = 0.01
LARGEST_UV = 1e-6
# Blender stores imported normals as two numbers of 16 bits.
LARGEST_NORMAL = 1e-3
FPS = 25
FIRST, LAST = 3, 40
# Beside the checkout on machines of developers; a file of Blender with its point cache.
SHARED = Path(__file__).resolve().parents[1] / "../shared/data/interop"


def empty_scene(fps):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = fps


def key(object, frame, location, rotation, scale):
    """Sets a key frame of an object's transform."""
    object.location, object.rotation_euler, object.scale = location, rotation, scale
    for path in ("location", "rotation_euler", "scale"):
        object.keyframe_insert(path, frame=frame)


def moving_scene():
    """A waving sheet of quads, and a still sphere of triangles and quads below two moving parents."""
    empty_scene(FPS)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=14, y_subdivisions=9, size=1.5, calc_uvs=True)
    sheet = bpy.context.active_object
    sheet.name = "sheet"
    wave = sheet.modifiers.new("wave", "WAVE")
    wave.height, wave.width, wave.speed = 0.2, 0.4, 0.05
    key(sheet, FIRST, (0, 0, 1), (0.1, 0, 0.2), (1, 1, 1))
    key(sheet, LAST, (1, 2, 3), (0.9, -0.3, 1.2), (1, 0.5, 2))
    parents = []
    for i in range(2):
        bpy.ops.object.empty_add()
        parents.append(bpy.context.active_object)
        key(parents[i], FIRST, (i, 2, 3), (0.3 * i, 0.2, 0.1), (1, 1, 1))
        key(parents[i], LAST, (0, 1, i), (0.5, 0.7 - i, 0.9), (1.5, 0.7, 1))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=9, ring_count=7, radius=0.4, calc_uvs=True)
    sphere = bpy.context.active_object
    sphere.name = "sphere"
    parents[1].parent, sphere.parent = parents[0], parents[1]
    return [sheet.name, sphere.name]


def turned(points):
    """Blender's +Z up to +Y up."""
    x, y, z = np.asarray(points).T
    return np.stack([x, z, -y], axis=1)


def mesh_of(name):
    """World positions, polygons, texture coordinates and normals by corner in the current frame."""
    evaluated = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    polygons = [list(polygon.vertices) for polygon in mesh.polygons]
    uvs = np.empty(0, np.float32)
    if mesh.uv_layers:
        uvs = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uvs)
    world = np.array(evaluated.matrix_world)
    normals = turned([corner.vector[:] for corner in mesh.corner_normals])
    evaluated.to_mesh_clear()
    positions = turned(flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3])
    return positions, polygons, uvs.reshape(-1, 2), normals


def all_frames(names, frames):
    truth = {name: [] for name in names}
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        for name in names:
            truth[name].append(mesh_of(name))
    return truth


def import_abc(path, fps):
    """Imports a file with the default settings of the menu."""
    empty_scene(fps)
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)


def read_obj(text):
    """World positions, polygons, texture coordinates and normals by corner, as `abc_frame` prints them."""
    lines = [line.split() for line in text.splitlines()]
    positions = np.array([line[1:] for line in lines if line[0] == "v"], np.float64)
    values = [np.array([line[1:] for line in lines if line[0] == key], np.float64) for key in ("vt", "vn")]
    faces = [[corner.split("/") for corner in line[1:]] for line in lines if line[0] == "f"]
    polygons = [[int(corner[0]) - 1 for corner in face] for face in faces]
    uvs, normals = ([int(corner[i]) - 1 for face in faces for corner in face] for i in (1, 2))
    return positions, polygons, values[0][uvs], values[1][normals]


def largest_mm(found, expected):
    return 1e3 * np.linalg.norm(np.asarray(found, np.float64) - expected, axis=1).max()


def compare(found, expected):
    """Largest difference in mm. Polygons must be equal corner by corner, as their order is kept."""
    assert found[1] == expected[1], "polygons differ"
    assert found[2].shape == expected[2].shape, f"{found[2].shape} texture coordinates"
    if len(expected[2]):
        assert np.abs(found[2] - expected[2]).max() < LARGEST_UV, "texture coordinates differ"
    return largest_mm(found[0], expected[0])


def frame_by_ogawa(examples, path, name, frame):
    command = [examples / "abc_frame", path, name, str(frame)]
    return read_obj(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def full_names(examples, path):
    """Full name of each mesh by the name of its object in Blender, which is that of its parent."""
    text = subprocess.run([examples / "abc_info", path], check=True, capture_output=True, text=True).stdout
    names = [line.split('"')[1] for line in text.splitlines() if line.startswith("mesh ")]
    return {name.split("/")[-2]: name for name in names}


def check_export(examples, path, truth):
    """Reads by `ogawa` what Blender has exported."""
    errors = {}
    for name, full_name in full_names(examples, path).items():
        found = [frame_by_ogawa(examples, path, full_name, t) for t in range(len(truth[name]))]
        errors[f"{name}, exported by Blender"] = max(compare(a, b) for a, b in zip(found, truth[name]))
        assert max(np.abs(a[3] - b[3]).max() for a, b in zip(found, truth[name])) < LARGEST_NORMAL
    return errors


def check_import(path, truth, frames, fps):
    """Imports into Blender what `ogawa` has written."""
    import_abc(path, fps)
    scene = bpy.context.scene
    assert (scene.frame_start, scene.frame_end) == (frames[0], frames[-1]), (scene.frame_start, scene.frame_end)
    found = all_frames(truth, frames)
    errors = {
        f"{name}, imported into Blender": max(compare(a, b) for a, b in zip(found[name], truth[name]))
        for name in truth
    }
    scene.frame_set(frames[3], subframe=0.5)
    for name in truth:
        halfway = (truth[name][3][0] + truth[name][4][0]) / 2
        errors[f"{name}, imported into Blender, halfway"] = largest_mm(mesh_of(name)[0], halfway)
    return errors


def copied(examples, path, folder):
    copy = folder / "copy.abc"
    subprocess.run([examples / "abc_copy", path, copy], check=True)
    return copy


def check_moving(examples, folder):
    names = moving_scene()
    truth = all_frames(names, range(FIRST, LAST + 1))
    path = folder / "blender.abc"
    options = {"start": FIRST, "end": LAST, "apply_subdiv": False, "as_background_job": False}
    bpy.ops.wm.alembic_export(filepath=str(path), **options)
    copy = copied(examples, path, folder)
    errors = check_export(examples, path, truth)
    return errors | check_import(copy, truth, range(FIRST, LAST + 1), FPS)


def check_one_frame(examples, folder):
    """A mesh of one frame, which Blender imports without a cache."""
    names = moving_scene()
    truth = all_frames(names, [7])
    path = folder / "one.abc"
    bpy.ops.wm.alembic_export(filepath=str(path), start=7, end=7, as_background_job=False)
    import_abc(copied(examples, path, folder), FPS)
    bpy.context.scene.frame_set(7)
    return {f"{name}, one frame": compare(mesh_of(name), truth[name][0]) for name in names}


def check_shared(examples, folder):
    """A garment that Blender has exported, by the point cache of the same animation."""
    path = SHARED / "tshirt_walk.abc"
    if not path.exists():
        print(f"skipped: {path} is not there")
        return {}
    truth = np.fromfile(SHARED / "tshirt_walk.pc2", np.float32, offset=32).reshape(150, -1, 3)
    import_abc(copied(examples, path, folder), 30)
    worst = 0.0
    for t in range(0, 150, 7):
        # Its first frame is frame 1 of Blender.
        bpy.context.scene.frame_set(t + 1)
        worst = max(worst, largest_mm(mesh_of("Garment")[0], truth[t]))
    return {"garment of Blender's cloth": worst}


def check_flag(examples, folder):
    """Positions, texture coordinates and normals by vertex, by the formula of the example."""
    subprocess.run([examples / "abc_flag", folder / "flag.abc"], check=True)
    import_abc(folder / "flag.abc", FPS)
    worst = 0.0
    for frame in (0, 1, 39):
        bpy.context.scene.frame_set(frame)
        positions, polygons, uvs, found = mesh_of("flag")
        assert polygons[12] == [13, 14, 26, 25], polygons[12]
        corners = np.concatenate(polygons)
        u, v = np.repeat(np.arange(12)[None] / 11, 7, 0).ravel(), np.repeat(np.arange(7) / 6, 12)
        assert np.abs(uvs - np.stack([u, v], axis=1)[corners]).max() < LARGEST_UV
        phase = 9 * u - 0.2 * frame
        worst = max(worst, largest_mm(positions, np.stack([u, v / 2, 0.1 * np.sin(phase)], axis=1)))
        slope = 0.9 * np.cos(phase)
        normals = np.stack([-slope, 0 * slope, 1 + 0 * slope], axis=1) / np.hypot(slope, 1)[:, None]
        assert np.abs(found - normals[corners]).max() < LARGEST_NORMAL
    return {"flag": worst}


def main():
    examples = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        errors = {}
        for check in (check_moving, check_one_frame, check_flag, check_shared):
            errors |= check(examples, Path(name))
    print(f"Blender {bpy.app.version_string}, largest difference in mm:")
    for name, error in errors.items():
        print(f"  {name}: {error:.5f}{'' if error < LARGEST_MM else '  FAILED'}")
    return int(max(errors.values()) >= LARGEST_MM)


if __name__ == "__main__":
    sys.exit(main())
