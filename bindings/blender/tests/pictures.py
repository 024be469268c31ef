# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Works with the panels in Blender's window and takes the pictures of docs/tutorial.md.

    Xvfb :77 -screen 0 1280x800x24 &
    DISPLAY=:77 blender --factory-startup --window-geometry 0 0 1280 800 --python bindings/blender/tests/pictures.py \\
        -- target/release/unic takes.blend docs/blender

`takes.blend` is the scene of the tutorial, made by the same Blender. The script needs ImageMagick. It exits
with code 1 where a step fails: training from the window, with its timer, is tested nowhere else.
"""

from __future__ import annotations

import os
import subprocess
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from installed import module, set_paths  # isort: skip
import bpy

UNIC, SCENE, OUT = (Path(word).resolve() for word in sys.argv[sys.argv.index("--") + 1:])
# Seconds between two steps, in which Blender draws.
INTERVAL_S = 1.0
TAKES = {"walk": (1, 300, "TRAIN"), "arms": (301, 600, "TRAIN"), "mixed": (601, 900, "TRAIN"),
         "dance": (901, 1200, "TEST")}
# Frames of `dance` that are shown.
SHOWN = (975, 1060, 1150)
# Width and height of the picture of a person, in pixels.
PERSON = (270, 400)


def view() -> tuple[bpy.types.Window, bpy.types.Area]:
    """The 3D view and its window."""
    return next((window, area) for window in bpy.context.window_manager.windows for area in window.screen.areas
                if area.type == "VIEW_3D")


def region(kind: str) -> bpy.types.Region:
    """A region of the 3D view."""
    return next(region for region in view()[1].regions if region.type == kind)


def photograph(name: str, kinds: tuple[str, ...], size: tuple[int, int] | None = None) -> None:
    """Takes a picture of regions of the 3D view that lie beside each other, or of a part in their middle."""
    window, _ = view()
    regions = [region(kind) for kind in kinds]
    left, right = min(r.x for r in regions), max(r.x + r.width for r in regions)
    bottom, top = min(r.y for r in regions), max(r.y + r.height for r in regions)
    width, height = size or (right - left, top - bottom)
    x, y = (left + right - width) // 2, window.height - (bottom + top + height) // 2
    command = ["import", "-window", "root", "-crop", f"{width}x{height}+{x}+{y}", "+repage"]
    subprocess.run([*command, "+dither", "-colors", "200", f"PNG8:{OUT / name}.png"], check=True)


def prepare() -> None:
    """Opens the scene and chooses what the tutorial chooses."""
    settings = bpy.context.scene.unic
    settings.character, settings.garment = bpy.data.objects["body"], bpy.data.objects["coat"]
    settings.model, settings.budget = "//coat.unic", 2.0
    settings.clip, settings.frame_end = "walk", 300
    _, area = view()
    space = area.spaces[0]
    space.show_region_ui = True
    space.shading.color_type, space.shading.show_cavity = "MATERIAL", True
    space.overlay.show_bones = False


def look() -> None:
    """Turns the view to the character."""
    region("UI").active_panel_category = "unic"
    window, area = view()
    with bpy.context.temp_override(window=window, area=area, region=region("WINDOW")):
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["coat"].select_set(True)
        bpy.ops.view3d.view_selected()
        bpy.ops.object.select_all(action="DESELECT")
    area.spaces[0].region_3d.view_distance *= 1.3


def steps() -> Iterator[None]:
    """Works through the tutorial; Blender draws at each `yield`."""
    prepare()
    yield
    bpy.context.scene.frame_set(40)
    look()
    yield
    yield
    photograph("panel", ("WINDOW", "UI"))
    for name, (first, last, purpose) in TAKES.items():
        settings = bpy.context.scene.unic
        settings.clip, settings.purpose = name, purpose
        settings.frame_start, settings.frame_end = first, last
        bpy.ops.unic.export_capture()
    bpy.ops.unic.train(start="new")
    while module("train").running():
        if module("train").running().status().startswith("training") and not (OUT / "training.png").exists():
            photograph("training", ("UI",))
        yield
    assert module("train").last_message().startswith("Trained"), module("train").last_message()
    yield from compare()


def compare() -> Iterator[None]:
    """Shows frames of the simulation and of the live garment."""
    view()[1].spaces[0].show_region_ui = False
    view()[1].spaces[0].show_gizmo = False
    view()[1].spaces[0].overlay.show_overlays = False
    view()[1].spaces[0].show_region_toolbar = False
    for way in ("simulated", "live"):
        bpy.context.scene.frame_set(TAKES["dance"][0])
        if way == "live":
            bpy.ops.unic.play_live()
        for frame in range(TAKES["dance"][0], SHOWN[-1] + 1):
            bpy.context.scene.frame_set(frame)
            if frame in SHOWN:
                look_at_root()
                yield
                yield
                photograph(f"{way}_{frame}", ("WINDOW",), PERSON)
    bpy.ops.unic.stop_live()
    bpy.ops.unic.bake()
    join()


def join() -> None:
    """Puts the simulation beside the live garment."""
    rows = [OUT / f"{way}_{frame}.png" for way in ("simulated", "live") for frame in SHOWN]
    subprocess.run(["convert", *map(str, rows), "+append", "+dither", "-colors", "200", f"PNG8:{OUT / 'live.png'}"],
                   check=True)
    for row in rows:
        row.unlink()


def look_at_root() -> None:
    """Moves the view to where the character is."""
    root = bpy.data.objects["rig"].pose.bones[0].head
    view()[1].spaces[0].region_3d.view_location = (root.x, root.y, root.z + 0.15)
    view()[1].spaces[0].region_3d.view_distance = 3.2


def run(work: Iterator[None]) -> float | None:
    """Does one step: a timer of Blender."""
    try:
        next(work)
        return INTERVAL_S
    except StopIteration:
        print("pictures are taken", flush=True)
        os._exit(0)
    except Exception:
        traceback.print_exc()
        os._exit(1)


OUT.mkdir(parents=True, exist_ok=True)
bpy.context.preferences.view.show_splash = False
set_paths(UNIC)
bpy.ops.wm.open_mainfile(filepath=str(SCENE))
work = steps()
bpy.app.timers.register(lambda: run(work), first_interval=2 * INTERVAL_S, persistent=True)
