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
    # A job in the background of a shell is started with the signal ignored, and Python leaves it so.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            animator.animate(motion)
    finally:
        signal.signal(signal.SIGINT, before)
    # The whole motion takes ten times as long.
    assert time.monotonic() - began < 2
    animator.step(motion[0])


def in_a_fork(work):
    """Answer of a function that a forked process calls."""

    def report(answers):
        try:
            answers.put(work())
        except unic.Error as error:
            answers.put(str(error))

    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    process = context.Process(target=report, args=(answers,))
    process.start()
    answer = answers.get(timeout=20)
    process.join()
    return answer


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_has_no_threads(model, motion, animated):
    expected = "animator: expected the process that has started its threads, found a fork of it"
    animator = unic.Animator(model)
    animator.step(motion[0])
    assert in_a_fork(lambda: animator.step(motion[1])).startswith(expected)
    assert in_a_fork(lambda: unic.Animator(model)).startswith(expected)
    alone = unic.Animator(model, threads=1)
    for work in (alone.animate, lambda motion: unic.Animator(model, threads=1).animate(motion)):
        assert in_a_fork(lambda work=work: work(motion).tobytes()) == animated.tobytes()
    # Work that has no threads of its own.
    assert in_a_fork(lambda: model.with_mesh(model.mesh).vertex_count) == model.vertex_count
