"""Contract: a call releases the interpreter's lock; an animator is for one thread at a time; Ctrl-C
stops an animation; a fork of a process with threads gets an error instead of waiting for ever."""

import multiprocessing
import os
import signal
import threading
import time

import pytest
import unic


def test_another_thread_works_during_an_animation(model, motion):
    # One thread: the other one needs a core of its own.
    animator, counted, ended = unic.Animator(model, threads=1), 0, threading.Event()

    def animate():
        animator.animate(motion)
        ended.set()

    thread = threading.Thread(target=animate)
    thread.start()
    while not ended.is_set():
        counted += 1
        time.sleep(0.001)
    thread.join()
    # An animation that kept the lock would let this thread count once or twice.
    assert counted > 20


def test_a_second_thread_gets_an_error(model, motion):
    animator = unic.Animator(model)
    thread = threading.Thread(target=animator.animate, args=(motion,))
    thread.start()
    errors = []
    while thread.is_alive():
        try:
            animator.step(motion[0])
        except unic.Error as error:
            errors.append(str(error))
        time.sleep(0.001)
    expected = "animator: expected calls from one thread at a time, found another call that has not returned"
    assert errors and set(errors) == {expected}
    animator.step(motion[0])


def test_animators_share_a_model_on_many_threads(model, motion, animated):
    results = {}

    def animate(name):
        results[name] = unic.Animator(model, threads=1).animate(motion).tobytes()

    threads = [threading.Thread(target=animate, args=(name,)) for name in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [results[name] for name in range(3)] == [animated.tobytes()] * 3


def test_ctrl_c_stops_an_animation(model):
    motion = unic.Motion.built_in("walk_circles", model)
    animator = unic.Animator(model)
    began = time.monotonic()
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        animator.animate(motion)
    # The whole motion takes ten times as long.
    assert time.monotonic() - began < 2
    animator.step(motion[0])


def step_in_a_fork(animator, pose, answer):
    try:
        animator.step(pose)
        answer.put("stepped")
    except unic.Error as error:
        answer.put(str(error))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:This process")
@pytest.mark.parametrize(("threads", "expected"), [
    (None, "animator: expected the process that has started its threads, found a fork of it"),
    (1, "stepped"),
])
def test_a_fork_has_no_threads(model, motion, threads, expected):
    animator = unic.Animator(model, threads=threads)
    animator.step(motion[0])
    context = multiprocessing.get_context("fork")
    answer = context.Queue()
    process = context.Process(target=step_in_a_fork, args=(animator, motion[1], answer))
    process.start()
    assert answer.get(timeout=20).startswith(expected)
    process.join()
