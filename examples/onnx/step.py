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
    """A graph with its inputs and outputs."""

    def __init__(self, path):
        self.session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        self.inputs, self.outputs = self.session.get_inputs(), self.session.get_outputs()

    def run(self, values):
        """Run the graph on values by name, of which it takes those that it has inputs for."""
        results = self.session.run(None, {port.name: values[port.name] for port in self.inputs})
        return {port.name: result for port, result in zip(self.outputs, results)}


def quaternions(axis_angles):
    """Unit quaternions x, y, z, w of axes times angles."""
    angle = np.linalg.norm(axis_angles, axis=-1, keepdims=True)
    return np.concatenate([axis_angles * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2)], axis=-1)


folder = Path(sys.argv[1])
data = (folder / "mesh.bin").read_bytes()
vertices = {
    a["name"]: np.frombuffer(data, a["type"], np.prod(a["shape"]), a["offset"]).reshape(a["shape"])
    for a in json.loads((folder / "model.json").read_text())["mesh"]["arrays"]
}
motion = np.load(sys.argv[2])
roots = motion["trans"].astype(np.float32)
rotations = quaternions(motion["poses"].reshape(len(roots), -1, 3).astype(np.float64)).astype(np.float32)


def inputs(frame):
    """The pose of a frame and of the one after it, flat ground at height 0, still air."""
    after = min(frame + 1, len(roots) - 1)  # Only models with forward velocities read it.
    pose = {"root": roots[frame], "next_root": roots[after], "next_known": np.float32([after > frame])}
    pose |= {"rotations": rotations[frame], "next_rotations": rotations[after]}
    return vertices | pose | {"ground_height": np.zeros(1, np.float32), "wind": np.zeros(3, np.float32)}


start, tick = (Graph(folder / name) for name in ["start.onnx", "tick.onnx"])
state = start.run(inputs(0))
frames = [state["positions"]]
for frame in range(1, len(roots)):
    before = {name.removesuffix("_out"): value for name, value in state.items()}
    state = tick.run(inputs(frame) | before)
    frames.append(state["positions"])
np.save(sys.argv[3], frames)
