"""From numpy arrays to a capture, a trained model, and an animation as an array.

    python3 examples/train_from_numpy.py [UNIC [FOLDER]]

UNIC is the program (target/release/unic), FOLDER a new folder for all results. A small skirt on a
column stands for your data: replace `body`, `rest`, `motion` and `simulate`. Units are metres, +Y
is up, the character faces +Z. docs/reference/capture.md describes every file.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np

UNIC, FOLDER = (sys.argv[1:] + ["target/release/unic", "numpy_skirt"][len(sys.argv) - 1:])[:2]
CAPTURE, CLIPS, FPS, FRAMES, AROUND = Path(FOLDER) / "capture", "abcdefgh", 30, 300, 24


def tube(radii, heights):
    """Vertices (V, 3) and outward triangles (F, 3) of a tube about +Y, rings from below."""
    a, b = np.arange(AROUND), np.roll(np.arange(AROUND), -1)
    ring = np.stack([np.sin(2 * np.pi * a / AROUND), 0 * a, np.cos(2 * np.pi * a / AROUND)], 1)
    band = np.stack([[a, b, b + AROUND], [a, b + AROUND, a + AROUND]]).transpose(0, 2, 1)
    vertices = np.concatenate([r * ring + [0, y, 0] for r, y in zip(radii, heights)])
    faces = np.concatenate([band.reshape(-1, 3) + i * AROUND for i in range(len(radii) - 1)])
    return vertices, faces


def motion(seed):
    """Poses (T, 3 J) in axis-angle and root translations (T, 3): the character turns and sways."""
    random, t = np.random.default_rng(seed), np.arange(FRAMES)[:, None, None] / FPS
    wave = np.sin(random.uniform(1, 5, (3, 4)) * t + random.uniform(0, 6, (3, 4))).sum(axis=1)
    poses = np.zeros((FRAMES, 2 * 3))
    poses[:, 1] = 0.5 * wave[:, 3]  # joint 0, the root, turns about +Y
    return poses, wave[:, :3] * [0.1, 0, 0.1]


def skinned(poses, trans):
    """The skirt as a rigid body (T, V, 3): all of its vertices follow the root."""
    s, c = np.sin(poses[:, 1:2]), np.cos(poses[:, 1:2])
    x, y, z = rest[:, 0], rest[:, 1] + 0 * s, rest[:, 2]
    return np.stack([c * x + s * z, y, c * z - s * x], axis=2) + trans[:, None]


def simulate(rigid):
    """Cloth (T, V, 3): each vertex on a damped spring to the rigid skirt, fixed at the waist."""
    freedom = np.clip((0.95 - rest[:, 1:2]) / 0.45, 0, 1)
    x, v, frames = rigid[0], 0, []
    for goal in rigid:
        v = v + (60 * (goal - x) - 4 * v) / FPS
        x = x + v / FPS
        frames.append(goal + freedom * (x - goal))
    return np.array(frames, np.float32)


body, body_faces = tube(np.full(17, 0.15), np.linspace(0, 1.6, 17))
chest = np.clip((body[:, 1:2] - 0.9) / 0.4, 0, 1)  # weights of joint 1; the root has the others
rest, faces = tube(np.linspace(0.35, 0.16, 12), np.linspace(0.5, 0.95, 12))

(CAPTURE / "clips").mkdir(parents=True)
np.savez(CAPTURE / "character.npz", vertices=body, faces=body_faces, parents=[-1, 0],
         joints=[[0, 0.9, 0], [0, 1.3, 0]], weights=np.hstack([1 - chest, chest]))
lines = [f"v {x} {y} {z}" for x, y, z in rest] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
(CAPTURE / "garment.obj").write_text("\n".join(lines) + "\n")
(CAPTURE / "capture.toml").write_text(f"""name = "skirt"
fps = {FPS}.0
provenance = "computed by examples/train_from_numpy.py"
contact_joints = [0, 0, 0, 0]  # the column has no feet
splits = {{ train = {list(CLIPS[:-1])}, test = ["{CLIPS[-1]}"] }}
""")
for seed, name in enumerate(CLIPS):
    poses, trans = motion(seed)
    truth = simulate(skinned(poses, trans))
    np.savez(CAPTURE / f"clips/{name}.npz", poses=poses, trans=trans, mocap_framerate=float(FPS))
    np.save(CAPTURE / f"clips/{name}.garment.npy", truth)

model, test, out = f"{FOLDER}/skirt.unic", CAPTURE / f"clips/{CLIPS[-1]}.npz", f"{FOLDER}/out.npz"
for command in (["inspect", CAPTURE], ["train", CAPTURE, "--budget", "20s", "--out", model],
                ["animate", model, "--motion", test, "--up", "y", "--out", out]):
    subprocess.run([UNIC, *command], check=True)

for name, found in (("unic", np.load(out)["vertices"]), ("rigid skirt", skinned(poses, trans))):
    error = np.linalg.norm((found - truth)[FPS:], axis=2)  # without the first second
    print(f"{name}: RMSE {1e3 * np.sqrt((error**2).mean()):.1f} mm on a clip that is held out")
