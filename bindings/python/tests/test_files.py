"""Contract: files are read as the program reads them; arrays of assets are views that cannot be
written to and outlive their objects; clips of captures are mapped."""

import gc

import numpy as np
import pytest
import unic


CAPTURE = """
name = "small"
fps = 30.0
provenance = "made by a test"

[splits]
train = ["walk"]
test = []
"""


@pytest.fixture(scope="session")
def capture_folder(model, motion, animated, tmp_path_factory):
    """A capture as numpy writes it, of what the shipped garment does."""
    folder = tmp_path_factory.mktemp("capture")
    (folder / "clips").mkdir()
    (folder / "capture.toml").write_text(CAPTURE)
    body, joints = model.character.body, model.character.joints
    nearest = np.linalg.norm(body.vertices[:, None] - joints, axis=2).argmin(axis=1)
    np.savez(folder / "character.npz", vertices=body.vertices, faces=body.faces, joints=joints,
             parents=model.character.parents, weights=np.eye(len(joints))[nearest],
             joint_names=model.joint_names)
    lines = ["v %.9g %.9g %.9g" % tuple(vertex) for vertex in model.mesh.vertices]
    lines += ["f %d %d %d" % tuple(face + 1) for face in model.mesh.faces]
    (folder / "garment.obj").write_text("\n".join(lines) + "\n")
    motion.save(folder / "clips" / "walk.npz", model)
    np.save(folder / "clips" / "walk.garment.npy", animated)
    return folder


def test_arrays_of_assets_are_views(model):
    mesh = model.mesh
    assert mesh.vertices.shape == (model.vertex_count, 3) and mesh.vertices.dtype == np.float32
    assert mesh.faces.shape[1] == 3 and mesh.faces.dtype == np.uint32
    assert mesh.uvs.shape[1] == 2 and mesh.uv_faces.shape == mesh.faces.shape
    for array in (mesh.vertices, mesh.faces, mesh.uvs, mesh.uv_faces, model.character.joints):
        assert not array.flags.owndata and not array.flags.writeable
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True
    address = mesh.vertices.__array_interface__["data"][0]
    assert model.mesh.vertices.__array_interface__["data"][0] == address


def test_views_outlive_their_objects(model_path):
    vertices = unic.Model.load(model_path).mesh.vertices
    kept = vertices.copy()
    gc.collect()
    np.testing.assert_array_equal(vertices, kept)


def test_models_are_read_from_bytes(model, model_path):
    read = unic.Model.from_bytes(model_path.read_bytes())
    assert (read.name, read.fps, read.vertex_count) == (model.name, model.fps, model.vertex_count)
    assert read.parameter_count > 1000 and read.training and read.provenance
    assert read.joint_names == read.character.joint_names
    assert read.character.parents[read.character.root] == -1


def test_motions_are_sequences(model, motion):
    assert motion.rotations.shape == (len(motion), len(model.joint_names), 4)
    np.testing.assert_array_equal(motion[-1].rotations, motion.rotations[-1])
    assert len(list(motion)) == len(motion) == len(motion.translations) == len(motion.wind)
    with pytest.raises(IndexError):
        motion[len(motion)]
    again = unic.Motion(motion.rotations, motion.translations, motion.fps)
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    assert len(motion.resampled(60)) == 2 * len(motion) - 1


def test_poses_of_world_rotations(model, motion):
    character = model.character
    rest = unic.Pose.rest(model)
    pose = unic.Pose.from_world(character, rest_rotations(character), character.joints[character.root],
                                rotations_are="from_rest")
    np.testing.assert_allclose(pose.joints(model), rest.joints(model), atol=1e-6)
    np.testing.assert_allclose(rest.joints(model), character.joints, atol=1e-6)
    moved = motion[3].joints(model)
    np.testing.assert_allclose(moved[character.root] - character.joints[character.root],
                               motion[3].translation, atol=1e-6)


def rest_rotations(character):
    return np.tile(np.float32([0, 0, 0, 1]), (len(character.joints), 1))


def test_captures_are_read_lazily(capture_folder, animated):
    capture = unic.Capture.open(capture_folder)
    assert (capture.name, capture.fps, capture.clips) == ("small", 30, ["walk"])
    assert capture.splits == {"train": ["walk"], "validation": [], "test": []}
    clip = capture.clip("walk")
    assert clip.garment.shape == (len(clip.motion), len(capture.mesh.vertices), 3)
    np.testing.assert_array_equal(clip.garment, animated)
    assert not clip.garment.flags.owndata and not clip.garment.flags.writeable
    assert clip.body is None and clip.notes == [] and clip.motion.fps == capture.fps
    read = unic.Motion.load(capture_folder / "clips" / "walk.npz", capture)
    np.testing.assert_array_equal(read.rotations, clip.motion.rotations)
    character = unic.read_character(capture_folder / "character.npz")
    np.testing.assert_array_equal(character.joints, capture.character.joints)
    with pytest.raises(unic.FileError, match="run"):
        capture.clip("run")


def test_a_clip_outlives_its_capture(capture_folder, animated):
    garment = unic.Capture.open(capture_folder).clip("walk").garment
    gc.collect()
    np.testing.assert_array_equal(garment, animated)


def test_vertex_animations_and_meshes(program, model, model_path, motion, tmp_path):
    motion.save(tmp_path / "walk.npz", model)
    words = ["animate", model_path, "--motion", tmp_path / "walk.npz", "--frames", "0..3"]
    for name in ("a.pc2", "a.abc", "b.npz"):
        ran = program(*words, "--overwrite", "--out", tmp_path / name)
        assert ran.returncode == 0, ran.stderr
    expected = unic.read_vertex_animation(tmp_path / "b.npz")
    assert expected.frames.shape == (3, model.vertex_count, 3)
    np.testing.assert_array_equal(unic.read_vertex_animation(tmp_path / "a.pc2").frames, expected.frames)
    alembic = unic.read_vertex_animation(tmp_path / "a.abc", object="garment")
    np.testing.assert_array_equal(alembic.frames, expected.frames)
    assert alembic.fps == pytest.approx(30) and len(alembic.mesh.faces) == len(model.mesh.faces)
    mesh = unic.read_mesh(tmp_path / "a.obj")
    np.testing.assert_allclose(mesh.vertices, model.mesh.vertices, atol=1e-5)


@pytest.mark.parametrize("name", ["body_walk.fbx", "body_walk.glb"])
def test_rigs_of_other_programs(data, model, name):
    motion = unic.Motion.load(data(f"interop/{name}"), model)
    assert motion.fps == model.fps and len(motion) > 10 and motion.notes
    assert unic.Animator(model).animate(motion[:2]).shape[0] == 2


def test_usd(data):
    frames = unic.read_vertex_animation(data("interop/tshirt_walk_30frames.usdc")).frames
    assert frames.shape[0] == 30 and np.isfinite(frames).all()
