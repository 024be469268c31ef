"""Contract of examples/onnx/Step.cs: with onnxruntime's own C# interface and library it gives the
positions of examples/onnx/step.py.

    onnx_csharp.py UNIC MODEL MOTION

Mono compiles it. The interface is the source in the npm package com.github.asus4.onnxruntime, which
holds a library for Linux too. Mono's compiler knows C# 7, so a copy of that source is rewritten
where it is newer. The test says why where it is skipped.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).resolve().parent.parent / "examples" / "onnx"
PACKAGE = "com.github.asus4.onnxruntime@0.4.9"
ASSEMBLIES = ["System.Xml", "System.Xml.Linq", "System.Runtime.Serialization"]

# Newer C# and the same in C# 7.
REWRITES = [
    (r"\busing var\b", "var"),
    (r"\bis not null\b", "!= null"),
    (r"\bis null\b", "== null"),
    (r"node\.Value is not TensorBase", "!(node.Value is TensorBase)"),
    (r"if \((\w+) is not (\w+) (\w+)\)", r"var \3 = \1 as \2; if (\3 == null)"),
    (r"static ptr =>", "ptr =>"),
    (r"(?m)^(\s{12,})static (\w)", r"\1\2"),
    (r"(\w+<\w+>) (\w+) = new\(", r"\1 \2 = new \1("),
    (r"where (\w+) : unmanaged", r"where \1 : struct"),
    (r"dimensions\[0\] = dimensions\[1\] = (\w+);", r"dimensions[0] = \1; dimensions[1] = \1;"),
    (r"Buffer\.Span\[index\] = value;", "var span = Buffer.Span; span[index] = value;"),
    (r"disposableHandles\.Span\[i\] = IntPtr\.Zero;", "var handles = disposableHandles.Span; handles[i] = IntPtr.Zero;"),
]


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}: {done.stdout[-2000:]}{done.stderr[-2000:]}"


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(0)


def compiled(folder):
    """Compiles the interface and the example in a folder, beside the library."""
    for program in ["npm", "mcs", "mono"]:
        if shutil.which(program) is None:
            skip(f"{program} is not installed")
    packed = subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=folder, capture_output=True, text=True)
    if packed.returncode != 0:
        skip(f"the package {PACKAGE} cannot be downloaded")
    run("tar", "xzf", packed.stdout.split()[-1], cwd=folder)
    package = folder / "package"
    shutil.copy(package / "Plugins/Linux/x64/libonnxruntime.so", folder)
    source = folder / "source"
    source.mkdir()
    for file in [*package.glob("Runtime/*.cs"), *package.glob("Runtime/Tensors/*.cs")]:
        text = file.read_text(encoding="utf-8-sig")
        for newer, older in REWRITES:
            text = re.sub(newer, older, text)
        (source / file.name).write_text(text)
    library = "Microsoft.ML.OnnxRuntime.dll"
    compiler = ["mcs", "-langversion:latest"]
    # With this symbol the interface needs no references as return values, which C# 7 cannot copy.
    options = ["-unsafe", "-d:NETSTANDARD2_0", "-target:library", f"-out:{library}"]
    run(*compiler, *options, *source.glob("*.cs"), cwd=folder)
    references = [f"-r:{name}.dll" for name in ASSEMBLIES]
    run(*compiler, f"-r:{library}", *references, "-out:Step.exe", EXAMPLES / "Step.cs", cwd=folder)


def write_poses(motion, path):
    """The motion as Step.cs reads it: for each frame the root and unit quaternions x, y, z, w."""
    motion = np.load(motion)
    frames = len(motion["trans"])
    axis_angles = motion["poses"].reshape(frames, -1, 3).astype(np.float64)
    angle = np.linalg.norm(axis_angles, axis=-1, keepdims=True)
    rotations = np.concatenate([axis_angles * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2)], axis=-1)
    np.concatenate([motion["trans"], rotations.reshape(frames, -1)], axis=1).astype("<f4").tofile(path)


def main(unic, model, motion):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        compiled(folder)
        run(unic, "export", model, "--onnx", folder / "onnx")
        run(sys.executable, EXAMPLES / "step.py", folder / "onnx", motion, folder / "python.npy")
        write_poses(motion, folder / "poses.bin")
        run("mono", "Step.exe", "onnx", "poses.bin", "csharp.bin", cwd=folder, env={"LD_LIBRARY_PATH": ".", "PATH": "/usr/bin:/bin"})
        expected = np.load(folder / "python.npy")
        found = np.fromfile(folder / "csharp.bin", "<f4").reshape(expected.shape)
        error = np.abs(found - expected).max()
        # The libraries may be of two versions of onnxruntime.
        assert error < 1e-4, f"Step.cs: {error} m from step.py"
        print(f"Step.cs: {error:.1e} m from step.py in {len(expected)} frames")


main(*(Path(argument).resolve() for argument in sys.argv[1:4]))
