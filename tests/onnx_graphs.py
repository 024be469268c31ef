"""Contract of `unic export MODEL --onnx FOLDER`: onnxruntime gives the animator's positions.

    onnx_graphs.py UNIC MODEL MOTION

The animator runs with the stages after the networks off: `--intersection off`, and a model file
without strain projection and replay. The motion, an npz file in the model's joints, is extended to
300 frames. Every case is a model with another configuration; the first one is MODEL as it is.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import onnx
import onnx.reference
import onnxruntime
from safetensors import safe_open
from safetensors.numpy import save_file

FRAMES = 301
# The graphs and the animator round in different orders.
TOLERANCE_M = 1e-4
# Two ways through the same graphs.
ROUNDING_M = 2e-5
EXAMPLE = Path(__file__).parent.parent / "examples" / "onnx" / "step.py"

UNIC = Path(sys.argv[1]).resolve()
rng = np.random.default_rng(1)


def main(model, motion):
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        parts = read_model(model)
        motion = extended_motion(motion, parts, scratch / "motion.npz")
        for name, change in cases(parts).items():
            check_case(name, change, parts, motion, scratch / name)
        check_refusals(parts, scratch)
        check_example(parts, motion, scratch)


# Models -----------------------------------------------------------------------------------------


def read_model(path):
    """The description and the tensors of a model, without strain projection and replay."""
    with safe_open(path, "np") as file:
        about = json.loads(file.metadata()["unic"])
        tensors = {name: file.get_tensor(name) for name in file.keys()}
    about.pop("checksum", None)
    about["config"].pop("projection", None)
    left_out = ("replay.", "garment.strain_limits")
    return about, {name: tensor for name, tensor in tensors.items() if not name.startswith(left_out)}


def write_model(path, about, tensors):
    save_file({name: np.ascontiguousarray(t) for name, t in tensors.items()}, path, {"unic": json.dumps(about)})


def cases(parts):
    """Configurations by name: functions that change the parts of a model in place."""
    if parts[0]["config"]["state"] == "root_relative":
        return {"as_it_is": lambda about, tensors: None}
    return {
        "as_it_is": lambda about, tensors: None,
        "all_inputs": all_inputs,
        "no_components": no_components,
        "paper_without_training": paper_without_training,
        "root_relative_positions": root_relative_positions,
    }


def random_layer(tensors, name, inputs, outputs, gain=1.0):
    tensors[f"{name}.weight"] = rng.normal(0, gain / np.sqrt(inputs), (outputs, inputs)).astype(np.float32)
    tensors[f"{name}.bias"] = rng.normal(0, 0.1 * gain, outputs).astype(np.float32)


def random_field(about, tensors, inputs, gain=1.0):
    """A field of three hidden layers, the second of which reads the inputs again."""
    encoder = about["config"]["encoder"]
    latent = encoder["channels"] * (encoder["categories"] if encoder["code"] == "one_hot" else 1)
    for name in [name for name in tensors if name.startswith("field.")]:
        del tensors[name]
    about["config"]["field"] = {"width": 24, "hidden_layers": 3, "skip": 1}
    both = inputs + latent
    for i, width in enumerate([both, 24 + both, 24]):
        random_layer(tensors, f"field.{i}", width, 24)
    random_layer(tensors, "field.3", 24, 3, gain)


def all_inputs(about, tensors):
    """A field that moves vertices, one-hot codes, every input in another order, and a mask."""
    about["config"]["encoder"]["code"] = "one_hot"
    displacement = about["config"]["state"]["displacement"]
    displacement["inputs"] = ["velocity", "displacement", "skin_velocity", "up", "rest"]
    # Some outputs are shortened to the limit and some are not.
    displacement["scale_m"], displacement["output_limit"] = 0.01, 2.0
    random_field(about, tensors, 15, gain=2.0)
    mask = rng.uniform(0, 1, len(tensors["garment.vertices"])).astype(np.float32)
    tensors["garment.mask"] = mask
    tensors["prior.mean"] = tensors["prior.mean"] * mask[:, None]
    if "prior.shapes" in tensors:
        masked = tensors["prior.shapes"] * mask[:, None, None]
        tensors["prior.shapes"] = np.rint(masked).astype(np.int16)


def no_components(about, tensors):
    """A prior of the mean alone, and a field that reads few inputs and forgets at once."""
    for name in [n for n in tensors if n.startswith(("prior.shapes", "prior.steps", "prior.0", "recurrence."))]:
        del tensors[name]
    displacement = about["config"]["state"]["displacement"]
    displacement["inputs"], displacement["memory_s"] = ["rest"], 0.0
    random_field(about, tensors, 3)


def paper_without_training(about, tensors):
    """The published state and motion vector, with a small field."""
    about["config"]["motion"].update(layout="paper", velocity="forward")
    about["config"]["state"] = "root_relative"
    random_field(about, tensors, 3, gain=0.01)


def root_relative_positions(about, tensors):
    """The published state, and the motion vector with positions relative to the root joint."""
    about["config"]["motion"].update(layout="paper_root_relative", velocity="backward")
    about["config"]["state"] = "root_relative"
    random_field(about, tensors, 3, gain=0.01)


# Motion -----------------------------------------------------------------------------------------


def extended_motion(path, parts, out):
    """The motion forwards and backwards up to FRAMES, with wind, over ground that is not at 0."""
    about = parts[0]
    clip = np.load(path)
    names = [str(name) for name in clip["joint_names"]] if "joint_names" in clip else about["joint_names"]
    order = [names.index(name) for name in about["joint_names"]]
    frames = len(clip["trans"])
    there_and_back = np.concatenate([np.arange(frames), np.arange(frames - 2, 0, -1)])
    indices = np.resize(there_and_back, FRAMES)
    time = np.arange(FRAMES)[:, None] / about["config"]["fps"]
    motion = {
        "poses": clip["poses"].reshape(frames, -1, 3)[indices][:, order].reshape(FRAMES, -1).astype(np.float32),
        "trans": (clip["trans"][indices] + [3.0, 0.4, -2.0]).astype(np.float32),
        "ground_height": np.float32(clip.get("ground_height", 0.0) + 0.4),
        "wind": (np.sin(time * [1.0, 2.0, 3.0]) * [2.0, 0.2, 1.0]).astype(np.float32),
        "joint_names": np.array(about["joint_names"]),
        "mocap_framerate": about["config"]["fps"],
    }
    np.savez(out, **motion)
    return out


def quaternions(axis_angles):
    """Unit quaternions x, y, z, w of axes times angles."""
    angle = np.linalg.norm(axis_angles, axis=-1, keepdims=True)
    return np.concatenate([axis_angles * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2)], axis=-1)


class Motion:
    """Inputs of the graphs, frame by frame."""

    def __init__(self, path):
        motion = np.load(path)
        self.roots = motion["trans"]
        axis_angles = motion["poses"].reshape(len(self.roots), -1, 3).astype(np.float64)
        self.rotations = quaternions(axis_angles).astype(np.float32)
        self.ground = motion["ground_height"].reshape(1)
        self.wind = motion["wind"]

    def inputs(self, frame, last):
        """Inputs of a frame. Behind the last one the next pose is unknown, and far away."""
        known = frame < last
        after = frame + 1 if known else 0
        return {
            "root": self.roots[frame],
            "rotations": self.rotations[frame],
            "next_root": self.roots[after] + (0 if known else np.float32(100)),
            "next_rotations": self.rotations[after],
            "next_known": np.float32([known]),
            "ground_height": self.ground,
            "wind": self.wind[frame],
        }

    def start_inputs(self, wind_at_start):
        """Inputs of frame 0, with the wind that belongs to its velocities."""
        inputs = self.inputs(0, 1)
        inputs["wind"] = self.wind[{"of the first frame": 0, "of the second frame": 1}[wind_at_start]]
        return inputs


# Graphs -----------------------------------------------------------------------------------------


class Export:
    """The folder of an export."""

    def __init__(self, folder):
        self.description = json.loads((folder / "model.json").read_text())
        data = (folder / "mesh.bin").read_bytes()
        self.vertices = {a["name"]: array(data, a) for a in self.description["mesh"]["arrays"]}
        self.sessions = {}
        for graph in self.description["graphs"]:
            path = folder / graph["file"]
            check_file(path, graph)
            session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
            self.sessions[path.stem] = session

    def run(self, graph, values):
        session = self.sessions[graph]
        feeds = {i.name: values[i.name] for i in session.get_inputs()}
        return dict(zip([o.name for o in session.get_outputs()], session.run(None, feeds)))

    def start(self, motion, vertices):
        return self.run("start", vertices | motion.start_inputs(self.description["wind_at_start"]))

    def tick(self, inputs, state, vertices):
        return self.run("tick", vertices | inputs | state_of(state))

    def stages(self, inputs, state, vertices):
        """One tick by the graphs of its stages."""
        values = vertices | inputs | state_of(state)
        motion = self.run("motion", values)
        skinning = self.run("skinning", vertices | state_of(motion))
        values |= motion | skinning | self.run("encoder", motion)
        prior = self.run("prior", values) if "prior" in self.sessions else {}
        return motion | prior | self.run("field", values | prior)


def array(data, about):
    count = int(np.prod(about["shape"]))
    return np.frombuffer(data, about["type"], count, about["offset"]).reshape(about["shape"])


def state_of(outputs):
    """The outputs of a tick that the next one reads."""
    return {name.removesuffix("_out"): value for name, value in outputs.items() if name.endswith("_out")}


def check_file(path, about):
    """A graph is valid, of an opset up to 17, and has the inputs and outputs of the description."""
    graph = onnx.load(path)
    onnx.checker.check_model(graph, full_check=True)
    assert max(opset.version for opset in graph.opset_import) <= 17, path
    for ports, described in [(graph.graph.input, about["inputs"]), (graph.graph.output, about["outputs"])]:
        found = [(port.name, [d.dim_param or d.dim_value for d in port.type.tensor_type.shape.dim]) for port in ports]
        assert found == [(port["name"], port["shape"]) for port in described], (path, found, described)
    outputs = {port["name"] for port in about["outputs"]}
    states = [port for port in about["inputs"] if "from" in port]
    if path.stem == "tick":
        assert states and all(port["from"] in outputs for port in states), states


# Checks -----------------------------------------------------------------------------------------


def unic(*arguments):
    done = subprocess.run([UNIC, *map(str, arguments)], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def animated(model, motion, out, frames=None):
    """Positions of the animator with the stages after the networks off."""
    arguments = ["animate", model, "--motion", motion, "--intersection", "off", "--precision", "f32", "--out", out]
    arguments += ["--frames", f"0..{frames}"] if frames else []
    code, text = unic(*arguments, "--overwrite", "--force")
    assert code == 0, text
    return np.load(out)["vertices"]


def check_case(name, change, parts, motion_file, folder):
    about, tensors = json.loads(json.dumps(parts[0])), dict(parts[1])
    change(about, tensors)
    folder.mkdir()
    model = folder / "model.unic"
    write_model(model, about, tensors)
    code, text = unic("export", model, "--onnx", folder / "onnx")
    assert code == 0, text
    export, motion = Export(folder / "onnx"), Motion(motion_file)
    expected = animated(model, motion_file, folder / "expected.npz")
    moved = np.abs(expected - expected[0]).max()
    assert moved > 0.01, f"{name}: the garment moves by {moved} m, which tests nothing"

    positions, states = free_running(export, motion, export.vertices)
    error = np.abs(positions - expected).max()
    assert error < TOLERANCE_M, f"{name}: {error} m"
    print(f"{name}: {error:.1e} m in {FRAMES - 1} ticks of {positions.shape[1]} vertices", end="")

    # Another runtime, for a few ticks.
    tick = onnx.reference.ReferenceEvaluator(onnx.load(folder / "onnx" / "tick.onnx"))
    for frame in [1, FRAMES - 1]:
        values = export.vertices | motion.inputs(frame, FRAMES - 1) | state_of(states[frame - 1])
        # A division by zero would be a warning, which is an error here.
        with np.errstate(divide="raise", invalid="raise"):
            outputs = dict(zip(tick.output_names, tick.run(None, {i: values[i] for i in tick.input_names})))
        error = np.abs(outputs["positions"] - positions[frame]).max()
        assert error < ROUNDING_M, f"{name}: {error} m in tick {frame} of ONNX's reference"

    # Any vertices in any order.
    chosen = rng.permutation(positions.shape[1])[: positions.shape[1] // 3]
    per_vertex = {port["name"] for graph in export.description["graphs"] for port in graph["inputs"] if port["role"] == "vertices"}
    some = {key: value[chosen] if key in per_vertex else value for key, value in export.vertices.items()}
    few, _ = free_running(export, motion, some, ticks=60)
    assert few.shape[1] == len(chosen)
    error = np.abs(few - positions[: len(few), chosen]).max()
    assert error < ROUNDING_M, f"{name}: {error} m for some of the vertices"

    # The stages one by one.
    for tick in [1, 40, FRAMES - 1]:
        outputs = export.stages(motion.inputs(tick, FRAMES - 1), states[tick - 1], export.vertices)
        error = np.abs(outputs["positions"] - positions[tick]).max()
        assert error < ROUNDING_M, f"{name}: {error} m by stages in tick {tick}"

    # A next pose that is not known, which the animator has at the last frame.
    if about["config"]["motion"]["velocity"] == "forward":
        jumps = []
        for tick in [17, 90, 150]:
            expected = animated(model, motion_file, folder / "cut.npz", tick + 1)[-1]
            outputs = export.tick(motion.inputs(tick, tick), states[tick - 1], export.vertices)
            error = np.abs(outputs["positions"] - expected).max()
            assert error < TOLERANCE_M, f"{name}: {error} m without a next pose in tick {tick}"
            jumps.append(np.abs(outputs["positions"] - positions[tick]).max())
        assert max(jumps) > 1e-6, f"{name}: the next pose changes nothing"
        print(", next pose unknown", end="")
    print()


def free_running(export, motion, vertices, ticks=FRAMES - 1):
    """Positions of all frames, and the outputs of each tick."""
    outputs = [export.start(motion, vertices)]
    for tick in range(1, ticks + 1):
        outputs.append(export.tick(motion.inputs(tick, FRAMES - 1), outputs[-1], vertices))
    return np.stack([o["positions"] for o in outputs]), outputs


def check_refusals(parts, scratch):
    """A model that is evaluated at samples is refused in one sentence, and nothing is written."""
    about, tensors = parts[0], dict(parts[1])
    tensors["garment.samples"] = np.arange(0, len(tensors["garment.vertices"]), 4, dtype=np.uint32)
    write_model(scratch / "sampled.unic", about, tensors)
    code, text = unic("export", scratch / "sampled.unic", "--onnx", scratch / "none")
    assert code == 1 and "samples" in text and len(text.strip().splitlines()) == 1, (code, text)
    assert not (scratch / "none").exists()
    code, text = unic("export", scratch / "sampled.unic", "--onnx", scratch / "as_it_is" / "onnx")
    assert code == 2 and "--overwrite" in text, (code, text)


def check_example(parts, motion_file, scratch):
    """The example in the documentation gives the animator's positions, without wind."""
    motion = dict(np.load(motion_file))
    motion["trans"] = motion["trans"] - np.float32([0, motion["ground_height"], 0])
    motion |= {"wind": np.zeros_like(motion["wind"]), "ground_height": np.float32(0)}
    np.savez(scratch / "still_air.npz", **motion)
    folder = scratch / "as_it_is"
    out = scratch / "stepped.npy"
    subprocess.run([sys.executable, EXAMPLE, folder / "onnx", scratch / "still_air.npz", out], check=True)
    expected = animated(folder / "model.unic", scratch / "still_air.npz", folder / "still_air.npz")
    error = np.abs(np.load(out) - expected).max()
    assert error < TOLERANCE_M, f"step.py: {error} m"
    print(f"step.py: {error:.1e} m")


main(Path(sys.argv[2]), Path(sys.argv[3]))
