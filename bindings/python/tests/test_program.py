"""Contract: the package brings the program; its exit codes, streams and signals are those of the
program, and it reads FBX and USD in processes of its own."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import unic


def test_the_entry_point(program):
    script = Path(sys.executable).parent / "unic"
    assert script.exists(), f"expected {script}, found none"
    for command in ([script], [sys.executable, "-m", "unic"]):
        ran = subprocess.run([*command, "--version"], capture_output=True, text=True)
        assert (ran.returncode, ran.stdout) == (0, f"unic {unic.__version__}\n"), ran.stderr
    assert "Needs no files" in program("demo", "--help").stdout


def test_exit_codes_and_streams(program, tmp_path):
    ran = program("inspect", tmp_path / "none.npz", "--json")
    assert ran.returncode == 1 and ran.stderr.startswith("unic: ") and ran.stderr.count("\n") == 1
    assert json.loads(ran.stdout)["error"]["exit_code"] == 1
    assert program("no-such-command").returncode == 2


def test_output_into_a_pipe_is_complete(program, model_path):
    assert json.loads(program("inspect", model_path, "--json").stdout)


def test_fbx_and_usd_are_read_in_a_process(program, data):
    for name in ("body_walk.fbx", "tshirt_walk_30frames.usdc"):
        ran = program("inspect", data(f"interop/{name}"), "--json")
        assert ran.returncode == 0 and json.loads(ran.stdout), ran.stderr


def test_a_damaged_file_does_not_bring_python_down(tmp_path, model):
    path = tmp_path / "damaged.fbx"
    path.write_bytes(b"Kaydara FBX Binary  \x00\x1a\x00" + bytes(range(256)) * 4)
    with pytest.raises(unic.FileError, match="damaged.fbx: expected"):
        unic.Motion.load(path, model)


def test_ctrl_c_stops_the_program(tmp_path):
    words = [sys.executable, "-m", "unic", "simulate", "--motion", "idle", "--out", "capture"]
    process = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    # The handler of signals has a thread, and starts before all others.
    threads, ends = Path(f"/proc/{process.pid}/task"), time.monotonic() + 20
    while len(list(threads.iterdir())) < 2 and time.monotonic() < ends:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=20)
    assert process.returncode == 130, stderr
    assert "unic: stopping; once more to stop at once" in stderr and "Traceback" not in stderr


def test_a_second_run_in_a_process_is_an_error():
    code = "from unic._unic import run; print(run(['unic', '--version'])); run(['unic', '--version'])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ran.stdout.endswith("\n0\n") and "run: expected one run in a process, found a second one" in ran.stderr
