"""Contract: an animator gives the bytes of the program, for any number of threads, in any array, and
after its state has been saved and restored."""

import numpy as np
import pytest
import unic


@pytest.fixture
def animator(model, motion):
    made = unic.Animator(model)
    made.reset(motion[0])
    return made


def test_positions_are_those_of_the_program(program, model_path, motion, model, animated, tmp_path):
    motion.save(tmp_path / "walk.npz", model)
    ran = program("animate", model_path, "--motion", tmp_path / "walk.npz", "--out", tmp_path / "out.npz")
    assert ran.returncode == 0, ran.stderr
    # Of the file, whose rotations are axes and angles: a conversion that rounds.
    read = unic.Motion.load(tmp_path / "walk.npz", model)
    positions = unic.Animator(model).animate(read)
    with np.load(tmp_path / "out.npz") as written:
        assert written["vertices"].tobytes() == positions.tobytes()
    assert np.median(np.abs(positions - animated)) < 1e-5


def test_a_step_at_a_time_gives_the_bytes_of_an_animation(model, motion, animated):
    animator = unic.Animator(model)
    stepped = [animator.reset(motion[0]), *(animator.step(pose) for pose in motion[1:])]
    assert np.stack(stepped).tobytes() == animated.tobytes()
    assert animator.positions.tobytes() == animated[-1].tobytes()


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_do_not_change_a_byte(model, motion, animated, threads):
    again = unic.Animator(model, threads=threads).animate(motion)
    assert again.tobytes() == animated.tobytes()


def test_an_animation_is_handed_over(animated, model, motion):
    assert animated.shape == (len(motion), model.vertex_count, 3)
    assert animated.dtype == np.float32 and animated.flags.c_contiguous and animated.flags.writeable
    # The memory belongs to an object of the library: numpy has allocated none, and copied nothing.
    owner = animated
    while isinstance(owner, np.ndarray):
        assert not owner.flags.owndata
        owner = owner.base
    assert type(owner).__name__ == "PySliceContainer"


def test_results_are_written_to_given_arrays(animator, model, motion):
    out, normals = (np.zeros((model.vertex_count, 3), np.float32) for _ in range(2))
    assert animator.step(motion[1], out=out, normals=normals) is out
    assert out.tobytes() == animator.positions.tobytes()
    assert normals.tobytes() == animator.normals.tobytes()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


def test_an_array_that_was_returned_stays_as_it_is(animator, motion):
    first = animator.step(motion[1])
    kept = first.copy()
    animator.step(motion[2])
    assert first.tobytes() == kept.tobytes()


def test_a_restored_state_continues_with_the_same_bytes(model, motion, animator):
    for pose in motion[1:6]:
        animator.step(pose)
    saved = animator.state()
    ahead = [animator.step(pose).tobytes() for pose in motion[6:9]]
    assert saved[:8] == b"unicstat"
    for other in (animator, unic.Animator(model, threads=1)):
        other.restore(saved)
        assert [other.step(pose).tobytes() for pose in motion[6:9]] == ahead


def test_a_state_of_another_model_or_a_damaged_one_is_refused(animator):
    saved = animator.state()
    skirt = unic.Animator(unic.Model.shipped("skirt"))
    for state, other in [(saved, skirt), (saved[:-1] + b"x", animator), (b"", animator), (saved[:50], animator)]:
        with pytest.raises(unic.Error, match="^saved state: expected .*, found "):
            other.restore(state)
    assert animator.state() == saved


def test_the_display_is_between_the_last_two_ticks(animator, motion):
    before = animator.step(motion[1])
    now = animator.step(motion[2])
    np.testing.assert_allclose(animator.display(motion[1], 0.0), before, atol=1e-5)
    np.testing.assert_allclose(animator.display(motion[2], 1.0), now, atol=1e-5)
    between = animator.display(motion[2], 0.5)
    assert np.abs(between - now).max() < 0.05
    assert animator.positions.tobytes() == now.tobytes()


def test_a_start_is_taken_over(model, motion, animated):
    animator = unic.Animator(model, intersections="off")
    np.testing.assert_allclose(animator.reset(motion[4], start=animated[4]), animated[4], atol=1e-5)


def test_the_body_follows_the_pose(animator, model, motion):
    body = animator.body()
    assert body.shape == model.character.body.vertices.shape
    assert np.abs(body - model.character.body.vertices - motion[0].translation).max() < 1.5
    assert animator.step(motion[5]) is not None and np.abs(animator.body() - body).max() > 1e-3


def test_precision_and_sampling_are_options(model, motion, animated):
    animator = unic.Animator(model, precision="int8", sampling=0.25)
    assert animator.model.precision == "int8" and model.precision == unic.Model.shipped("tshirt").precision
    difference = np.abs(animator.animate(motion) - animated).max()
    # The field of this model is zero, so that neither changes anything.
    assert difference == 0
    # States fit every precision and sampling of a model.
    unic.Animator(model).restore(animator.state())


def test_colliders_push_and_layers_are_set(model, motion):
    animator = unic.Animator(model, intersections="robust")
    still = animator.reset(motion[0])
    centre = still.mean(axis=0) + [0, 0, 0.15]
    animator.set_colliders([unic.Collider.ground(), unic.Collider.sphere(0.1, centre)])
    pushed = animator.reset(motion[0])
    inside = np.linalg.norm(still - centre, axis=1) < 0.1
    assert inside.any() and not (np.linalg.norm(pushed - centre, axis=1) < 0.1)[inside].all()
    animator.set_layers()
    animator.set_layers(np.zeros(model.vertex_count, np.uint32))


def test_other_meshes_and_masks(model, motion, animated):
    again = unic.Animator(model.with_mesh(model.mesh)).animate(motion[:2])
    # Interpolation rounds, and the handling of intersections has steps.
    assert np.median(np.abs(again - animated[:2])) < 1e-3
    skinned = unic.Animator(model.with_mask(np.zeros(model.vertex_count)), intersections="off")
    assert np.abs(skinned.animate(motion[:2]) - animated[:2]).max() > 1e-3
