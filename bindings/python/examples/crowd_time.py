"""Time of a tick for 1, 16 and 64 characters in the shipped T-shirt, one after the other on one thread,
and memory.

    python crowd_time.py
"""

import statistics
import time

import unic

TICKS = 30


def resident_mib():
    """Resident memory of the process, MiB; none where the system does not tell it."""
    try:
        with open("/proc/self/status", encoding="ascii") as status:
            return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS"))
    except OSError:
        return None


def main():
    model = unic.Model.shipped("tshirt")
    motion = unic.Motion.built_in("walk_circles", model)[: TICKS + 1]
    # Memory that was released stays with the process, so that crowds that grow are measured from one start.
    before = resident_mib()
    for count in [1, 16, 64]:
        animators = [unic.Animator(model, threads=1) for _ in range(count)]
        for animator in animators:
            animator.reset(motion[0])
        times = []
        for pose in motion[1:]:
            # Processor time: other programs may be at work.
            start = time.process_time()
            for animator in animators:
                animator.step(pose)
            times.append(time.process_time() - start)
        memory = "memory not known" if before is None else f"{resident_mib() - before:.0f} MiB more than before"
        print(f"{count} characters: {1e3 * statistics.median(times):.1f} ms a tick, {memory}")


if __name__ == "__main__":
    main()
