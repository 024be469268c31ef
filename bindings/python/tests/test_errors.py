"""Contract: what cannot be used is an error of one sentence, which says what was expected and what
was found; a file's begins with its path."""

import numpy as np
import pytest
import unic

JOINTS = 24


def sentence(work, kind=unic.Error):
    with pytest.raises(kind) as caught:
        work()
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_errors_are_values_and_files():
    assert issubclass(unic.Error, ValueError)
    assert issubclass(unic.FileError, (unic.Error, OSError)) and issubclass(unic.FileError, OSError)
    assert issubclass(unic.Fault, RuntimeError)


def test_files(tmp_path, model):
    missing = tmp_path / "none.unic"
    text = sentence(lambda: unic.Model.load(missing), unic.FileError)
    assert text.startswith(f"{missing}: cannot read the model: ")
    with pytest.raises(unic.FileError) as caught:
        unic.Model.load(missing)
    assert caught.value.errno == 2
    other = tmp_path / "other.npz"
    np.savez(other, poses=np.zeros((3, 7)))
    for work in (
        lambda: unic.Model.load(other),
        lambda: unic.Model.load(tmp_path),
        lambda: unic.Motion.load(other, model),
        lambda: unic.Capture.open(tmp_path),
        lambda: unic.read_mesh(other),
        lambda: unic.read_vertex_animation(other),
        lambda: unic.read_character(other),
    ):
        text = sentence(work, unic.FileError)
        assert text.startswith(f"{tmp_path}") and "expected" in text and "found" in text, text


def test_damaged_models(model_path):
    content = bytearray(model_path.read_bytes())
    content[-1] ^= 1
    assert sentence(lambda: unic.Model.from_bytes(bytes(content))).startswith("the file is damaged: expected")


@pytest.mark.parametrize(("rotations", "found"), [
    (np.zeros((JOINTS, 5)), "an array of shape (J, 4), quaternions x, y, z, w, or (J, 3), axis and angle, found (24, 5)"),
    (np.zeros(4), "an array of shape (J, 4), quaternions x, y, z, w, or (J, 3), axis and angle, found (4,)"),
    (np.zeros((JOINTS, 4), complex), "an array of numbers, found one of complex128"),
    ("text", "an array of numbers, found one of <U4"),
])
def test_poses(rotations, found):
    assert sentence(lambda: unic.Pose(rotations)) == f"rotations: expected {found}"


def test_steps(model):
    animator = unic.Animator(model)
    before = animator.state()
    text = sentence(lambda: animator.step(unic.Pose(np.zeros((23, 3)))))
    assert text == "animator: expected a pose of 24 joints, found 23"
    assert "unit rotations" in sentence(lambda: animator.step(unic.Pose(np.zeros((JOINTS, 4)))))
    nan = unic.Pose(np.zeros((JOINTS, 3)), [np.nan, 0, 0])
    assert "finite numbers" in sentence(lambda: animator.step(nan))
    assert animator.state() == before


def test_arrays_to_write_to(model, motion):
    animator, shape = unic.Animator(model), (model.vertex_count, 3)
    frozen = np.zeros(shape, np.float32)
    frozen.flags.writeable = False
    for out, found in [
        (np.zeros(shape), f"one of float64 and shape {shape}"),
        (np.zeros((7, 3), np.float32), "one of float32 and shape (7, 3)"),
        (np.zeros(shape, np.float32, order="F"), f"one of float32 and shape {shape}"),
        ([1.0], "a <class 'list'>"),
        (frozen, ""),
    ]:
        expected = f"out: expected a writable array of float32 and shape {shape} in C order, found {found}"
        assert sentence(lambda: animator.step(motion[0], out=out)).startswith(expected)
    array = np.zeros(shape, np.float32)
    assert sentence(lambda: animator.step(motion[0], out=array, normals=array)).startswith("normals: expected")


def test_settings(model, motion):
    for work, text in [
        (lambda: unic.Animator(model, precision="f16"), "precision: expected one of 'auto', 'f32'"),
        (lambda: unic.Animator(model, intersections="on"), "intersections: expected one of 'off'"),
        (lambda: unic.Animator(model, threads=0), "threads: expected a number from 1 to 256, found 0"),
        (lambda: unic.Animator(model, threads=-1), "threads: expected a number from 1 to 256, found -1"),
        (lambda: unic.Animator(model, sampling=2.0), "sampling: expected "),
        (lambda: unic.Motion.built_in("moonwalk", model), "name: expected one of idle, "),
        (lambda: unic.Motion.load("a.npz", model, up="x"), "up: expected one of 'auto', 'y', 'z', found 'x'"),
        (lambda: unic.Animator(model).display(motion[0], 1.5), "share: expected a number from 0 to 1"),
        (lambda: unic.Animator(model).animate(motion.resampled(60)), "motion: expected 30 frames a second"),
        (lambda: unic.Animator(model).reset(motion[0], start=np.zeros((5, 3))), "animator: expected "),
        (lambda: unic.Collider.sphere(-1, [0, 0, 0]), "radius: expected metres, at least 0, found -1"),
        (lambda: unic.Motion(np.zeros((3, 4, 3)), np.zeros((2, 3)), 30), "translations: expected 3 frames"),
        (lambda: motion[::2], "motion: expected a slice of step 1, found 2"),
    ]:
        assert sentence(work).startswith(text), sentence(work)


def test_other_types_are_errors_of_python(model):
    with pytest.raises(TypeError, match="unexpected keyword argument 'colour'"):
        unic.Motion.load("a.npz", model, colour=1)
    with pytest.raises(TypeError, match="expected a Model, a Capture or a Character, found str"):
        unic.Pose.rest("human")
