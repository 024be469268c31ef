# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""The extension in Blender without a window, compared with the program.

Contract:
- Blender's tool for extensions accepts the extension, and installs it.
- A scene that is made of a clip of a capture is exported as that clip: every vertex of body and garment is
  within 0.01 mm, whatever the axes, the scale and the place of the armature.
- The bake shows what `unic animate` writes on the clip, within 0.01 mm; live playing within 0.1 mm.
- Training can be cancelled and continued.
- Mistakes are refused in one sentence, and change nothing.

    python3 bindings/blender/tests/extension.py target/release/unic [CAPTURE CLIP]
    blender --background --python bindings/blender/tests/extension.py -- target/release/unic [CAPTURE CLIP]

The test needs `pip install bpy numpy`, and `libunic` beside the program for live playing. It is skipped
without bpy.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

if importlib.util.find_spec("bpy") is None:
    print("skipped: no Blender (pip install bpy)")
    sys.exit(0)

# `blender --python` knows neither folder.
sys.path[:0] = map(str, (Path(__file__).resolve().parent, Path(__file__).resolve().parents[1]))
# First, because it says where Blender keeps what it installs.
from installed import module, set_paths  # isort: skip
import bpy
import numpy as np
from mathutils import Euler, Matrix

from example_scene import BLENDER_FROM_UNIC, FIRST_FRAME, make_scene

WORDS = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
UNIC = Path(WORDS[0]).resolve()
EXPORT_M, BAKE_M, LIVE_M = 1e-5, 1e-5, 1e-4
# Vertices that the robust intersection rules move one of two ways out of the body, by the last digit of the
# pose. Two motion files that differ by 1e-7 have 0.2 % of them.
MOST_UNDECIDED_PERCENT = 0.5
SHORT_TRAINING_MINUTES = 5 / 60
# Long enough to be interrupted.
INTERRUPTED_TRAINING_MINUTES = 15 / 60


def unic(*arguments: str | Path) -> None:
    """Runs the program, which must succeed."""
    done = subprocess.run([UNIC, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def distance(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest distance between positions, in metres."""
    assert found.shape == expected.shape, (found.shape, expected.shape)
    return float(np.linalg.norm(found - expected, axis=-1).max())


def shown(name: str) -> np.ndarray:
    """World positions of an object in the current frame, in unic's axes."""
    meshes = module("meshes")
    return meshes.world_positions(bpy.data.objects[name], meshes.current(bpy.context)) @ BLENDER_FROM_UNIC


def refused(operator: Callable[..., object], words: str, **options: object) -> None:
    """Checks that an operator ends with an error of these words."""
    try:
        operator(**options)
    except RuntimeError as error:
        assert words in str(error), f"expected `{words}`, found: {error}"
        return
    raise AssertionError(f"expected an error with `{words}`, found none")


class Scene:
    """The scene of a clip, and what is known about it."""

    def __init__(self, folder: Path, capture: Path, clip: str) -> None:
        self.folder, self.capture, self.clip = folder, capture, clip
        self.motion = capture / f"clips/{clip}.npz"
        self.garment = np.load(capture / f"clips/{clip}.garment.npy")
        self.blend = folder / "scene.blend"

    def open(self) -> bpy.types.PropertyGroup:
        """Opens the scene anew, with character, garment and frames chosen. Returns the settings."""
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        settings = bpy.context.scene.unic
        settings.character, settings.garment = bpy.data.objects["body"], bpy.data.objects["coat"]
        settings.frame_start, settings.frame_end = FIRST_FRAME, FIRST_FRAME + len(self.garment) - 1
        settings.capture, settings.model, settings.cache = "//capture", "//coat.unic", "//baked.pc2"
        settings.budget = SHORT_TRAINING_MINUTES
        return settings

    def animated(self, intersection: str) -> np.ndarray:
        """Garment (T, V, 3) that the program makes of the clip."""
        out = self.folder / f"{intersection}.npz"
        words = ["--intersection", "off"] if intersection == "OFF" else []
        if not out.exists():
            unic("animate", self.folder / "coat.unic", "--motion", self.motion, "--out", out, *words)
        return np.load(out)["vertices"]

    def frames(self) -> Iterator[tuple[int, int]]:
        """Sets every frame. Gives its number in the scene, and in the clip."""
        for row in range(len(self.garment)):
            bpy.context.scene.frame_set(FIRST_FRAME + row)
            yield FIRST_FRAME + row, row


def posed_body(character: Path, motion: Path, row: int) -> np.ndarray:
    """Body of a capture in a frame, by the kinematics of docs/reference/capture.md, without a rest pose."""
    c, m = np.load(character), np.load(motion)
    names = [str(name) for name in c["joint_names"]]
    order = [[str(name) for name in m["joint_names"]].index(name) for name in names]
    turns = m["poses"][row].reshape(-1, 3)[order].astype(float)
    quaternion = [Matrix.Rotation(np.linalg.norm(t), 3, t) if np.linalg.norm(t) > 0 else Matrix.Identity(3)
                  for t in turns]
    turned, places = [None] * len(names), [None] * len(names)
    joints = c["joints"].astype(float)
    waiting = list(range(len(names)))
    while waiting:
        j = waiting.pop(0)
        parent = c["parents"][j]
        if parent >= 0 and turned[parent] is None:
            waiting.append(j)
            continue
        own = np.array(quaternion[j], float)
        turned[j] = own if parent < 0 else turned[parent] @ own
        places[j] = (joints[j] + m["trans"][row] if parent < 0
                     else places[parent] + turned[parent] @ (joints[j] - joints[parent]))
    weights = c["weights"] / c["weights"].sum(axis=1, keepdims=True)
    rest = c["vertices"].astype(float)
    return sum(weights[:, j:j + 1] * ((rest - joints[j]) @ turned[j].T + places[j]) for j in range(len(names)))


# ---- checks ------------------------------------------------------------------------------------


def check_registered(_scene: Scene) -> str:
    """Checks that operators and panels are there."""
    operators = ("export_capture", "train", "cancel_training", "play_live", "stop_live", "bake")
    assert all(hasattr(bpy.types, f"UNIC_OT_{name}") or getattr(bpy.ops.unic, name).get_rna_type()
               for name in operators)
    panels = [panel for panel in dir(bpy.types) if panel.startswith("UNIC_PT_")]
    assert len(panels) == 4, panels
    return f"{len(operators)} operators, {len(panels)} panels"


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


def curves(owner: bpy.types.Object) -> Iterator[bpy.types.FCurve]:
    """Curves of an object's action. Actions of Blender 5 have them in channel bags."""
    action = owner.animation_data.action
    if hasattr(action, "fcurves"):
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


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


def check_training(scene: Scene) -> str:
    """Cancels a training, continues it, and trains anew by the operator."""
    settings = scene.open()
    training, train = module("training"), module("train")
    refused(bpy.ops.unic.train, "expected a run to continue", start="resume")
    settings.budget = INTERRUPTED_TRAINING_MINUTES
    running = train.begin(bpy.context, training.Start.NEW)
    while not list((scene.folder / "coat.run").glob("checkpoints/*")) and running.is_running():
        time.sleep(0.1)
    assert 0 <= running.share() < 1 and running.status(), running.status()
    running.cancel()
    try:
        running.wait()
        raise AssertionError("expected an interrupted training")
    except module("program").UnicError as error:
        assert running.is_saved(), error
    assert not (scene.folder / "coat.unic").exists()
    assert bpy.ops.unic.train(start="resume") == {"FINISHED"}
    assert (scene.folder / "coat.unic").exists()
    settings.budget = SHORT_TRAINING_MINUTES
    assert bpy.ops.unic.train(start="replace") == {"FINISHED"}
    answer = train.last_message()
    refused(bpy.ops.unic.train, "--overwrite")
    return answer


def check_bake(scene: Scene) -> str:
    """Compares the bake with the program, at the model's and at another frame rate."""
    expected = scene.animated("OFF")
    settings = scene.open()
    settings.intersection = "OFF"
    bpy.ops.unic.bake()
    worst = max(distance(shown("coat baked"), expected[row]) for _, row in scene.frames())
    # Bake again, with the garment hidden and a modifier that makes its mesh: the object is replaced.
    settings.garment.modifiers.new("weld", "WELD").merge_threshold = 0.0
    settings.garment.modifiers.move(1, 0)
    bpy.ops.unic.bake()
    assert [o.name for o in bpy.data.objects if o.name.startswith("coat")] == ["coat", "coat baked"]
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(scene.blend))
    bpy.context.scene.frame_set(FIRST_FRAME + 5)
    worst = max(worst, distance(shown("coat baked"), expected[5]))
    assert worst < BAKE_M, worst
    return f"{1e3 * worst:.5f} mm"


def check_other_rate(scene: Scene) -> str:
    """Bakes with the scene's frames taken as 60 a second: every second frame has a sample."""
    settings = scene.open()
    bpy.context.scene.render.fps = 2 * bpy.context.scene.render.fps
    settings.intersection, settings.cache = "OFF", "//fast.pc2"
    refused(bpy.ops.unic.play_live, "frame rate")
    bpy.ops.unic.bake()
    samples = read_pc2(scene.folder / "fast.pc2")
    worst = 0.0
    for _, row in scene.frames():
        # Between two samples Blender interpolates.
        expected = (samples[row // 2] + samples[min((row + 1) // 2, len(samples) - 1)]) / 2
        worst = max(worst, distance(shown("coat baked"), expected))
    assert worst < BAKE_M, worst
    return f"{len(samples)} samples, {1e3 * worst:.5f} mm"


def read_pc2(path: Path) -> np.ndarray:
    """Positions (T, V, 3) of a point cache."""
    data = path.read_bytes()
    points, samples = (int(np.frombuffer(data, "<i4", 1, at)[0]) for at in (16, 28))
    return np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


def check_live(scene: Scene) -> str:
    """Compares live playing with the program, with and without intersection handling."""
    scene.open()
    if not module("program").library_beside(UNIC).is_file():
        return "skipped: no libunic beside the program (cargo rustc -p unic-ffi --lib --crate-type cdylib)"
    far = {}
    for intersection in ("OFF", "MODEL"):
        settings = scene.open()
        settings.intersection = intersection
        bpy.context.scene.frame_set(FIRST_FRAME)
        bpy.ops.unic.play_live()
        assert settings.garment.hide_get()
        expected = scene.animated(intersection)
        far[intersection] = np.concatenate([np.linalg.norm(shown("coat live") - expected[row], axis=1)
                                            for _, row in scene.frames()])
        bpy.ops.unic.stop_live()
        assert "coat live" not in bpy.data.objects and not settings.garment.hide_get()
    undecided = 100 * (far["MODEL"] > LIVE_M).mean()
    assert far["OFF"].max() < LIVE_M and undecided < MOST_UNDECIDED_PERCENT, (far["OFF"].max(), undecided)
    return f"{1e3 * far['OFF'].max():.5f} mm; with intersection handling {undecided:.4f} % are farther than 0.1 mm"


def check_jumps(scene: Scene) -> str:
    """Drops frames, jumps and loads another file while the garment is live."""
    settings = scene.open()
    if not module("program").library_beside(UNIC).is_file():
        return "skipped: no libunic beside the program"
    settings.intersection = "OFF"
    current = bpy.context.scene
    current.frame_set(FIRST_FRAME)
    bpy.ops.unic.play_live()
    first = shown("coat live")
    for row in range(0, len(scene.garment), 2):
        current.frame_set(FIRST_FRAME + row)
    far = distance(shown("coat live"), scene.animated("OFF")[row])
    assert far < 0.05, f"every second frame dropped: {far} m"
    current.frame_set(FIRST_FRAME)
    assert distance(shown("coat live"), first) == 0, "a jump to the start begins anew"
    assert module("live").is_live()
    scene.open()
    assert not module("live").is_live(), "another file ends live playing"
    return f"{1e3 * far:.2f} mm after every second frame was dropped"


CHECKS = [check_registered, check_export, check_placed, check_refusals, check_cloth, check_training, check_bake,
          check_other_rate, check_live, check_jumps]


def own_capture(folder: Path) -> tuple[Path, str]:
    """Makes a short capture by the program."""
    unic("simulate", "--garment", "tshirt", "--motion", "walk_circles", "mixed", "--seconds", "2", "--out",
         folder / "source")
    return folder / "source", "walk_circles"


def main() -> int:
    """Runs all checks on one scene."""
    set_paths(UNIC)
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        capture, clip = (Path(WORDS[1]), WORDS[2]) if len(WORDS) > 2 else own_capture(folder)
        scene = Scene(folder, capture, clip)
        make_scene(capture, [clip], scene.blend)
        for check in CHECKS:
            title = check.__name__.removeprefix("check_").replace("_", " ")
            try:
                print(f"{title}: {check(scene)}", flush=True)
            except Exception as error:  # A failed check must not hide the others.
                failed += 1
                print(f"{title}: FAILED\n  {type(error).__name__}: {error}", flush=True)
    print(f"Blender {bpy.app.version_string}: {len(CHECKS) - failed} passed, {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    # `blender --python` ignores exit codes of scripts that return.
    sys.exit(main())
