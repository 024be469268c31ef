#!/usr/bin/env python3
"""Times the networks of a model in f32 in `unic`, ONNX Runtime and PyTorch, in one run.

    pip install numpy safetensors onnx onnxruntime torch
    cargo build --release -p unic-cli
    python tests/side_by_side.py MODEL.unic MOTION.npz --unic target/release/unic

The ONNX graph is built from the model's tensors: the motion encoder at batch size one, then the field
at every vertex. All three fold the products of the latent vector into biases, so that they do the
same number of multiplications.

Rounds alternate between the three. The time of a round is the first decile of its runs, which other
work on the machine disturbs least. The time of `unic` is that of the encoder and field stages within
frames, so it includes gathering inputs and updating states.
"""

import argparse
import json
import subprocess
import time

import numpy as np
import onnx
import onnxruntime
import torch
from onnx import TensorProto, helper, numpy_helper
from safetensors import safe_open

# Runs of ONNX Runtime and PyTorch in a round.
RUNS = 40


class Networks:
    """Layers of a model with the sizes from its configuration."""

    def __init__(self, path):
        with safe_open(path, "np") as file:
            self.config = json.loads(file.metadata()["unic"])["config"]
            read = lambda name, n: [
                (file.get_tensor(f"{name}.{i}.weight"), file.get_tensor(f"{name}.{i}.bias")) for i in range(n)
            ]
            self.encoder = read("encoder", len(self.config["encoder"]["hidden"]) + 1)
            self.field = read("field", self.config["field"]["hidden_layers"] + 1)
            self.vertices = len(file.get_tensor("garment.vertices"))
        self.latent = self.config["encoder"]["channels"]
        self.categories = self.config["encoder"]["categories"]
        self.points = self.field[0][0].shape[1] - self.latent
        self.skip = self.config["field"]["skip"]

    def inputs(self):
        random = np.random.default_rng(0)
        pair = random.standard_normal((1, self.encoder[0][0].shape[1])).astype(np.float32)
        points = 0.3 * random.standard_normal((self.vertices, self.points)).astype(np.float32)
        return pair, points

    def parts(self, layer):
        """Weights of a field layer for hidden units, points and latent vector, and the bias."""
        weight, bias = self.field[layer]
        hidden = 0 if layer == 0 else self.config["field"]["width"]
        ends = [hidden, hidden + self.points] if layer in (0, self.skip) else [hidden, hidden]
        return [np.ascontiguousarray(w.T) for w in np.split(weight, ends, axis=1)], bias


def graph(networks):
    """Bytes of the ONNX model."""
    nodes, constants = [], []

    def constant(array):
        name = f"c{len(constants)}"
        constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def node(op, *inputs, **attributes):
        name = f"n{len(nodes)}"
        nodes.append(helper.make_node(op, list(inputs), [name], **attributes))
        return name

    x = "pair"
    for i, (weight, bias) in enumerate(networks.encoder):
        x = node("Gemm", x, constant(weight), constant(bias), transB=1)
        if i + 1 < len(networks.encoder):
            x = node("Elu", x)
    x = node("Reshape", x, constant(np.array([1, networks.latent, networks.categories])))
    latent = node("ReduceMax", x, constant(np.array([2])), keepdims=0)
    x = None
    for i in range(len(networks.field)):
        (hidden, points, z), bias = networks.parts(i)
        bias = constant(bias[None])
        if z.size:
            bias = node("Gemm", latent, constant(z), bias)
            bias = node("Gemm", "points", constant(points), bias)
        x = bias if x is None else node("Gemm", x, constant(hidden), bias)
        if i + 1 < len(networks.field):
            x = node("Relu", x)
    nodes.append(helper.make_node("Identity", [x], ["out"]))
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    pair, points = networks.inputs()
    made = helper.make_graph(
        nodes, "unic", [value("pair", pair.shape), value("points", points.shape)], [value("out", [None, 3])], constants
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 18)])
    model.ir_version = 10
    onnx.checker.check_model(model)
    return model.SerializeToString()


def onnx_runner(networks, threads):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(graph(networks), options, providers=["CPUExecutionProvider"])
    pair, points = networks.inputs()
    return lambda: session.run(None, {"pair": pair, "points": points})[0]


def torch_runner(networks, threads):
    torch.set_num_threads(threads)
    tensor = torch.from_numpy
    encoder = [(tensor(w), tensor(b)) for w, b in networks.encoder]
    field = [([tensor(p) for p in parts], tensor(b)) for parts, b in map(networks.parts, range(len(networks.field)))]
    pair, points = map(tensor, networks.inputs())

    @torch.inference_mode()
    def run():
        x = pair
        for i, (weight, bias) in enumerate(encoder):
            x = torch.nn.functional.linear(x, weight, bias)
            if i + 1 < len(encoder):
                x = torch.nn.functional.elu_(x)
        latent = x.view(1, networks.latent, networks.categories).amax(2)
        x = None
        for i, ((hidden, point, z), bias) in enumerate(field):
            if z.numel():
                bias = torch.addmm(torch.addmm(bias, latent, z), points, point)
            x = bias if x is None else torch.addmm(bias, x, hidden)
            if i + 1 < len(field):
                x = torch.relu_(x)
        return x.numpy()

    return run


def unic_runner(arguments, threads):
    command = [arguments.unic, "bench", "--model", arguments.model, "--motion", arguments.motion, "--precision", "f32"]
    command += ["--on-threads", str(threads), "--frames", "30", "--intersection", "off", "--json"]

    def run():
        result = subprocess.run(command, check=True, capture_output=True, text=True)
        stages = json.loads(result.stdout)["cases"][0]["stages_tenth_ms"]
        return stages["encoder"] + stages["field"]

    return run


def first_decile(run):
    """First decile of the times of a function, in milliseconds."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append((time.perf_counter() - start) * 1e3)
    return float(np.quantile(times, 0.1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("motion")
    parser.add_argument("--unic", default="target/release/unic")
    arguments = parser.parse_args()
    networks = Networks(arguments.model)
    print(f"{networks.vertices} vertices, f32, milliseconds: onnxruntime {onnxruntime.__version__}, torch {torch.__version__}")
    for threads in (1, 2):
        runners = onnx_runner(networks, threads), torch_runner(networks, threads)
        ours = unic_runner(arguments, threads)
        difference = np.abs(runners[0]() - runners[1]()).max()
        assert difference < 1e-3 * np.abs(runners[1]()).max(), f"the two graphs differ by {difference}"
        rounds = np.array([[first_decile(runners[0]), first_decile(runners[1]), ours()] for _ in range(3)])
        by_onnx, by_torch, by_unic = np.median(rounds, axis=0)
        print(f"threads {threads}: onnxruntime {by_onnx:.2f}, torch {by_torch:.2f}, unic {by_unic:.2f}")
        print(f"  times as fast: {by_onnx / by_unic:.2f} x onnxruntime, {by_torch / by_unic:.2f} x torch")


if __name__ == "__main__":
    main()
