# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Makes a Blender scene of clips of a capture: a rigged character that moves, and its garment.

    blender --background --python example_scene.py -- CAPTURE CLIP... SCENE.blend
    python3 example_scene.py CAPTURE CLIP... SCENE.blend                            with `pip install bpy numpy`

The character is a mesh `body` with vertex groups, an Armature modifier and a keyed armature `rig`. The
garment `coat` is a mesh with the clips' positions in a mesh cache, `SCENE.coat.pc2`. The clips follow each
other on the timeline from frame 1 on. A marker names the first frame of each.
"""

from __future__ import annotations

import struct
import sys
import tomllib
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

FIRST_FRAME = 1
# unic has +Y up and characters that face +Z; Blender has +Z up and characters that face -Y.
BLENDER_FROM_UNIC = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
BONE_LENGTH_M = 0.08


def read_obj(path: Path) -> tuple[np.ndarray, list[list[int]], list[tuple[float, float]]]:
    """Vertices (V, 3), faces, and the texture coordinates of their corners, one after the other."""
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([row[1:4] for row in rows if row[:1] == ["v"]], float)
    uvs = [(float(row[1]), float(row[2])) for row in rows if row[:1] == ["vt"]]
    corners = [[corner.split("/") for corner in row[1:]] for row in rows if row[:1] == ["f"]]
    faces = [[int(corner[0]) - 1 for corner in face] for face in corners]
    used = [uvs[int(corner[1]) - 1] for face in corners for corner in face] if uvs else []
    return vertices, faces, used


def add_mesh(name: str, vertices: np.ndarray, faces: list[list[int]], colour: tuple[float, ...]) -> bpy.types.Object:
    """Adds a mesh; vertices are in unic's axes."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata((vertices @ BLENDER_FROM_UNIC.T).tolist(), [], faces)
    mesh.shade_smooth()
    material = bpy.data.materials.new(name)
    material.diffuse_color = colour
    mesh.materials.append(material)
    added = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(added)
    return added


def add_rig(character: dict[str, np.ndarray]) -> bpy.types.Object:
    """Adds an armature with a bone at each joint of a character."""
    rig = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    joints = character["joints"].astype(float) @ BLENDER_FROM_UNIC.T
    bones = [rig.data.edit_bones.new(str(name)) for name in character["joint_names"]]
    for j, (bone, parent) in enumerate(zip(bones, character["parents"], strict=True)):
        bone.head = joints[j]
        # Bones point away from their parents, so that their axes differ from the world's.
        away = joints[j] - joints[parent] if parent >= 0 else np.array([0.0, 0.0, 1.0])
        bone.tail = joints[j] + BONE_LENGTH_M * away / np.linalg.norm(away)
        if parent >= 0:
            bone.parent = bones[parent]
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def add_character(character: dict[str, np.ndarray]) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Adds body and rig, and binds them."""
    rig = add_rig(character)
    body = add_mesh("body", character["vertices"].astype(float), character["faces"].tolist(), (0.75, 0.6, 0.5, 1.0))
    for j, name in enumerate(character["joint_names"]):
        group = body.vertex_groups.new(name=str(name))
        for vertex in np.flatnonzero(character["weights"][:, j]):
            group.add([int(vertex)], float(character["weights"][vertex, j]), "REPLACE")
    body.parent = rig
    body.modifiers.new("rig", "ARMATURE").object = rig
    return body, rig


def key(rig: bpy.types.Object, clip: dict[str, np.ndarray], names: list[str], first: int) -> None:
    """Keys the motion of a clip from a frame on. Its rest pose must be that of the rig."""
    to_blender = Matrix(BLENDER_FROM_UNIC.tolist())
    poses = clip["poses"].reshape(len(clip["poses"]), -1, 3).astype(float)
    root_turn = rig.data.bones[names[0]].matrix_local.to_3x3().inverted()
    for frame, (pose, offset) in enumerate(zip(poses, clip["trans"].astype(float), strict=True), first):
        for name, turn in zip(names, pose, strict=True):
            bone = rig.pose.bones[name]
            rest = rig.data.bones[name].matrix_local.to_3x3()
            axis = to_blender @ Vector(turn)
            in_world = Quaternion(axis.normalized(), axis.length).to_matrix()
            bone.rotation_quaternion = (rest.inverted() @ in_world @ rest).to_quaternion()
            bone.keyframe_insert("rotation_quaternion", frame=frame)
        root = rig.pose.bones[names[0]]
        root.location = root_turn @ (to_blender @ Vector(offset))
        root.keyframe_insert("location", frame=frame)


def write_pc2(path: Path, clips: list[np.ndarray]) -> None:
    """Writes the positions (T, V, 3) of clips, one after the other, as a point cache."""
    with path.open("wb") as file:
        samples = sum(map(len, clips))
        file.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, clips[0].shape[1], 0.0, 1.0, samples))
        for clip in clips:
            file.write(np.ascontiguousarray(clip, "<f4").tobytes())


def add_garment(capture: Path, clips: list[np.ndarray], cache: Path) -> bpy.types.Object:
    """Adds the garment with its positions in a cache, which is in Blender's axes."""
    vertices, faces, uvs = read_obj(capture / "garment.obj")
    coat = add_mesh("coat", vertices, faces, (0.1, 0.3, 0.6, 1.0))
    if uvs:
        coat.data.uv_layers.new().data.foreach_set("uv", np.array(uvs, np.float32).ravel())
    write_pc2(cache, [clip @ BLENDER_FROM_UNIC.T for clip in clips])
    modifier = coat.modifiers.new("simulation", "MESH_CACHE")
    modifier.cache_format, modifier.filepath, modifier.frame_start = "PC2", str(cache), FIRST_FRAME
    return coat


def make_scene(capture: Path, clips: list[str], path: Path) -> None:
    """Makes the scene and saves it."""
    # Preferences stay, and with them the add-ons that are enabled.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    character = dict(np.load(capture / "character.npz"))
    scene = bpy.context.scene
    fps = tomllib.loads((capture / "capture.toml").read_text())["fps"]
    scene.render.fps, scene.render.fps_base = round(fps), round(fps) / fps
    body, rig = add_character(character)
    frames = [np.load(capture / f"clips/{clip}.garment.npy", mmap_mode="r") for clip in clips]
    first = FIRST_FRAME
    for clip, garment in zip(clips, frames, strict=True):
        scene.timeline_markers.new(clip, frame=first)
        key(rig, dict(np.load(capture / f"clips/{clip}.npz")), [str(name) for name in character["joint_names"]], first)
        first += len(garment)
    rig.animation_data.action.name = "_".join(clips)
    add_garment(capture, frames, path.with_suffix(".coat.pc2").absolute())
    scene.frame_start, scene.frame_end = FIRST_FRAME, first - 1
    bpy.context.view_layer.objects.active = body
    scene.frame_set(FIRST_FRAME)
    bpy.ops.wm.save_as_mainfile(filepath=str(path.absolute()))


def main() -> None:
    """Reads the command line: behind `--` where Blender has one of its own."""
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    if len(words) < 3:
        sys.exit(__doc__)
    capture, *clips, path = words
    make_scene(Path(capture), clips, Path(path))
    print(f"{path}: {', '.join(f'{marker.name} from frame {marker.frame}' for marker in markers())}; "
          f"{bpy.context.scene.frame_end} frames")


def markers() -> list[bpy.types.TimelineMarker]:
    """Markers of the scene in their order."""
    return sorted(bpy.context.scene.timeline_markers, key=lambda marker: marker.frame)


if __name__ == "__main__":
    main()
