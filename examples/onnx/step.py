"""Step the ONNX graphs of a garment: step.py FOLDER MOTION.npz OUT.npy

FOLDER is that of `unic export MODEL --onnx FOLDER`. The motion has the model's joints in its order
and its frame rate. OUT.npy gets the world positions of all frames, in metres.
"""

import json
import sys
from pathlib import Path

import numpy as np
import onnxruntime


class Graph:
    """A graph and the names of its inputs."""

    def __init__(self, folder, name, description):
        self.session = onnxruntime.InferenceSession(folder / name, providers=["CPUExecutionProvider"])
        self.inputs = next(graph["inputs"] for graph in description["graphs"] if graph["file"] == name)
        self.outputs = [output.name for output in self.session.get_outputs()]

    def run(self, values):
        """Run the graph on values by name, of which it takes those that it has inputs for."""
        feeds = {port["name"]: values[port["name"]] for port in self.inputs}
        return dict(zip(self.outputs, self.session.run(None, feeds)))


def quaternions(axis_angles):
    """Unit quaternions x, y, z, w of axes times angles."""
    angle = np.linalg.norm(axis_angles, axis=-1, keepdims=True)
    return np.concatenate([axis_angles * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2)], axis=-1)


folder = Path(sys.argv[1])
description = json.loads((folder / "model.json").read_text())
data = (folder / "mesh.bin").read_bytes()
vertices = {
    array["name"]: np.frombuffer(data, array["type"], np.prod(array["shape"]), array["offset"]).reshape(array["shape"])
    for array in description["mesh"]["arrays"]
}
motion = np.load(sys.argv[2])
roots = motion["trans"].astype(np.float32)
rotations = quaternions(motion["poses"].reshape(len(roots), -1, 3).astype(np.float64)).astype(np.float32)


def inputs(frame):
    """The pose of a frame and of the one after it, flat ground at height 0, still air."""
    after = min(frame + 1, len(roots) - 1)
    pose = {"root": roots[frame], "rotations": rotations[frame], "next_root": roots[after], "next_rotations": rotations[after]}
    known = np.float32([after > frame])
    return vertices | pose | {"next_known": known, "ground_height": np.zeros(1, np.float32), "wind": np.zeros(3, np.float32)}


start, tick = (Graph(folder, name, description) for name in ["start.onnx", "tick.onnx"])
state = start.run(inputs(0))
frames = [state["positions"]]
for frame in range(1, len(roots)):
    before = {name.removesuffix("_out"): value for name, value in state.items()}
    state = tick.run(inputs(frame) | before)
    frames.append(state["positions"])
np.save(sys.argv[3], frames)
