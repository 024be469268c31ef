"""Dresses a walking character and plots the garment. Each `# %%` begins a cell of a notebook.

    pip install unic matplotlib
    python quickstart.py [MODEL.unic MOTION] [--out quickstart.png]
"""

# %% A trained garment and a motion: those of the package, or files.
import argparse
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import unic
from matplotlib.colors import LightSource

parser = argparse.ArgumentParser()
parser.add_argument("files", nargs="*", metavar="MODEL.unic MOTION")
parser.add_argument("--out", default="quickstart.png")
arguments = parser.parse_args()
match arguments.files:
    case [model_file, motion_file]:
        model = unic.Model.load(model_file)
        motion = unic.Motion.load(motion_file, model)
    case _:
        model = unic.Model.shipped("tshirt")
        motion = unic.Motion.built_in("walk_starts_stops", model)[:240]
print(model)
print(motion)

# %% One call animates all frames. The result is an array of shape (frames, vertices, 3), in metres.
began = time.perf_counter()
positions = unic.Animator(model).animate(motion)
seconds = time.perf_counter() - began
print(f"{len(positions)} frames in {seconds:.1f} s, {1e3 * seconds / len(positions):.1f} ms each")

# %% How fast the cloth moves relative to the hips: swings outlast the steps.
relative = positions - motion.translations[:, None]
speed = np.linalg.norm(np.diff(relative, axis=0), axis=2) * model.fps
walk = np.linalg.norm(np.diff(motion.translations, axis=0), axis=1) * model.fps

# %% The garment in four frames, from the front left, and its speed over time.
figure = plt.figure(figsize=(11, 6.5), layout="constrained")
rows = figure.add_gridspec(2, 4, height_ratios=[2, 1])
light = LightSource(azdeg=110, altdeg=30)
frames = np.linspace(len(positions) // 8, len(positions) - 1, 4).astype(int)
for column, frame in enumerate(frames):
    axes = figure.add_subplot(rows[0, column], projection="3d")
    # Matplotlib's z axis points up, the library's y axis.
    x, y, z = (positions[frame] - motion.translations[frame]).T
    axes.plot_trisurf(z, x, y, triangles=model.mesh.faces, color="#e8927c", linewidth=0,
                      antialiased=False, lightsource=light)
    axes.set_box_aspect(np.ptp([z, x, y], axis=1), zoom=1.25)
    axes.view_init(elev=10, azim=35)
    axes.set_axis_off()
    axes.set_title(f"{frame / model.fps:.1f} s")
axes = figure.add_subplot(rows[1, :])
t = np.arange(1, len(positions)) / model.fps
low, middle, high = np.percentile(speed, [10, 50, 90], axis=1)
axes.fill_between(t, low, high, alpha=0.3, label="cloth, 10 to 90 % of the vertices")
axes.plot(t, middle, label="cloth, median")
axes.plot(t, walk, "k--", linewidth=1, label="hips")
for frame in frames:
    axes.axvline(frame / model.fps, color="0.8", zorder=0)
axes.set(xlabel="time, s", ylabel="speed, m/s", xlim=(t[0], t[-1]), ylim=(0, None))
axes.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
figure.savefig(arguments.out, dpi=110)
print(arguments.out)
