# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Checks of the export: what a capture gets of a scene. `extension.py` runs them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix
from scenes import Scene, curves, distance, posed_body, refused, shown

from example_scene import FIRST_FRAME

DATA = Path(__file__).resolve().parents[3].parent / "shared/data"
# The files of the data have this error.
IMPORTED_M = 2e-5
EXPORT_M = 1e-5


def check_export(scene: Scene) -> str:
    """Exports two clips and compares the first with the clip that the scene is made of."""
    settings = scene.open()
    refused(bpy.ops.unic.bake, "coat.unic")
    bpy.ops.unic.export_capture()
    refused(bpy.ops.unic.export_capture, "--overwrite")
    settings.replaces = True
    bpy.ops.unic.export_capture()
    settings.clip, settings.purpose = "part", "TEST"
    settings.frame_end = FIRST_FRAME + 9
    bpy.ops.unic.export_capture()
    made = scene.folder / "capture"
    text = (made / "capture.toml").read_text()
    assert 'test = ["part"]' in text and f'train = ["{scene.clip}"]' in text, text
    garment = distance(np.load(made / f"clips/{scene.clip}.garment.npy"), scene.garment)
    body = max(distance(posed_body(made / "character.npz", made / f"clips/{scene.clip}.npz", row),
                        posed_body(scene.capture / "character.npz", scene.motion, row))
               for row in (0, 1, len(scene.garment) - 1))
    assert max(garment, body) < EXPORT_M, (garment, body)
    assert not list(scene.folder.glob(".unic*")), "temporary folders stay"
    return f"garment {1e3 * garment:.5f} mm, body {1e3 * body:.5f} mm"


def check_placed(scene: Scene) -> str:
    """Exports with the armature turned, scaled and moved, as importers of other programs leave it."""
    placed = Matrix.LocRotScale((3.0, -2.0, 0.0), Euler((0.0, 0.0, 0.7)), None)
    upright = Matrix.Rotation(np.pi / 2, 4, "X") @ Matrix.Scale(0.01, 4)
    worst = 0.0
    for name, matrix, stored in (("heading", placed, Matrix()), ("Y up, centimetres", upright, upright.inverted()),
                                 ("both", placed @ upright, upright.inverted())):
        settings = scene.open()
        rig, body = bpy.data.objects["rig"], bpy.data.objects["body"]
        # Bones and body are stored in other axes; the armature's own matrix brings them back.
        rig.data.transform(stored)
        body.data.transform(stored)
        scale = stored.to_scale()[0]
        for curve in curves(rig):
            if curve.data_path.endswith("location"):
                for point in curve.keyframe_points:
                    point.co.y *= scale
        rig.matrix_world = matrix
        bpy.data.objects["coat"].matrix_world = matrix @ stored
        settings.capture = f"//{name}"
        bpy.ops.unic.export_capture()
        made = scene.folder / name
        rest = np.load(made / "character.npz")["vertices"]
        worst = max(worst, distance(rest, np.load(scene.capture / "character.npz")["vertices"]))
        for row in (0, len(scene.garment) // 2):
            bpy.context.scene.frame_set(FIRST_FRAME + row)
            posed = posed_body(made / "character.npz", made / f"clips/{scene.clip}.npz", row)
            garment = np.load(made / f"clips/{scene.clip}.garment.npy")[row]
            worst = max(worst, distance(posed, shown("body")), distance(garment, shown("coat")))
    assert worst < EXPORT_M, worst
    return f"{1e3 * worst:.5f} mm"


def check_refusals(scene: Scene) -> str:
    """Tries what the extension cannot export."""
    def spoilt(words: str, spoil: Callable[[bpy.types.Object, bpy.types.Object], object]) -> None:
        settings = scene.open()
        settings.capture = "//refused"
        spoil(bpy.data.objects["body"], bpy.data.objects["coat"])
        refused(bpy.ops.unic.export_capture, words)
        assert not (scene.folder / "refused").exists()

    spoilt("Preserve Volume", lambda body, _: setattr(body.modifiers[0], "use_deform_preserve_volume", True))
    spoilt("found Envelopes", lambda body, _: setattr(body.modifiers[0], "use_bone_envelopes", True))
    spoilt("expected one Armature modifier", lambda body, _: body.modifiers.clear())
    spoilt("found 1 vertices without any", lambda body, _: [g.remove([7]) for g in body.vertex_groups])
    spoilt("expected vertex groups", lambda body, _: body.vertex_groups.clear())
    spoilt("expected a visible object", lambda _, coat: coat.hide_set(True))
    spoilt("expected at least two", lambda _, coat: setattr(bpy.context.scene.unic, "frame_end", FIRST_FRAME))
    spoilt("apply it", lambda body, _: setattr(body.parent, "scale", (1.0, 1.0, 2.0)))
    return "8 mistakes"


def check_cloth(scene: Scene) -> str:
    """Exports Blender's own simulation, which must run from its first frame on."""
    settings = scene.open()
    coat, body = settings.garment, settings.character
    coat.modifiers.clear()
    body.modifiers.new("collision", "COLLISION")
    coat.modifiers.new("cloth", "CLOTH").settings.quality = 2
    settings.capture, settings.clip = "//cloth", "cloth"
    settings.frame_start, settings.frame_end = FIRST_FRAME + 4, FIRST_FRAME + 9
    bpy.ops.unic.export_capture()
    exported = np.load(scene.folder / "cloth/clips/cloth.garment.npy")
    worst = 0.0
    for frame in range(FIRST_FRAME, settings.frame_end + 1):
        bpy.context.scene.frame_set(frame)
        if frame >= settings.frame_start:
            worst = max(worst, distance(shown("coat"), exported[frame - settings.frame_start]))
    fallen = distance(exported[0], exported[-1])
    assert worst < EXPORT_M and fallen > 1e-3, (worst, fallen)
    return f"{1e3 * worst:.5f} mm"


def check_imported(scene: Scene) -> str:
    """Exports a rig and an Alembic cache that Blender has imported, and compares with their source."""
    if not DATA.is_dir():
        return f"skipped: no {DATA}"
    if not bpy.app.build_options.alembic:
        return "skipped: this Blender is built without Alembic"
    worst = 0.0
    for rig, load in (("body_walk.fbx", bpy.ops.import_scene.fbx), ("body_walk.glb", bpy.ops.import_scene.gltf)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.context.scene.render.fps = 30
        load(filepath=str(DATA / "interop" / rig))
        character = next(o for o in bpy.data.objects if o.type == "MESH" and o.modifiers)
        bpy.ops.wm.alembic_import(filepath=str(DATA / "interop/tshirt_walk.abc"), as_background_job=False)
        settings = bpy.context.scene.unic
        settings.character, settings.garment = character, bpy.data.objects["Garment"]
        settings.frame_start, settings.frame_end, settings.clip = 1, 100, "walk"
        settings.capture = str(scene.folder / rig)
        bpy.ops.unic.export_capture()
        made = scene.folder / rig
        truth = np.load(DATA / "captures/tshirt_blender/clips/walk_02_01.npz")["garment"][:100]
        worst = max(worst, distance(np.load(made / "clips/walk.garment.npy"), truth))
        bpy.context.scene.frame_set(50)
        worst = max(worst, distance(posed_body(made / "character.npz", made / "clips/walk.npz", 49),
                                    shown(character.name)))
    assert worst < IMPORTED_M, worst
    return f"{1e3 * worst:.5f} mm"
