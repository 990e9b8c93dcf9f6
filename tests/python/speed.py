"""Speed of the module against the program: speed.py PROGRAM [PAIRS]. Medians of interleaved pairs, in processor time."""
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import merkel
import numpy as np

PROGRAM = sys.argv[1]
PAIRS = int(sys.argv[2]) if len(sys.argv) > 2 else 7


def processor_s(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def timed(work, who):
    before, wall = processor_s(who), time.monotonic()
    work()
    return processor_s(who) - before, time.monotonic() - wall


def batch(folder, preset):
    time_s = np.arange(60_000) / 1000
    depth_mm = 0.75 - 0.75 * np.cos(2 * np.pi * time_s)
    trace = os.path.join(folder, "minute.csv")
    with open(trace, "w") as file:
        file.write("time_s,depth_mm\n" + "".join(f"{t:.3f},{d!r}\n" for t, d in zip(time_s, depth_mm.tolist())))
    command = [PROGRAM, "run", preset, "--fast", "--probe", "replay:" + trace]
    pairs = []
    for _ in range(PAIRS):
        ours = timed(lambda: merkel.Scene(preset).run(depth_mm=depth_mm, rate_hz=1000), resource.RUSAGE_SELF)
        theirs = timed(lambda: subprocess.run(command, check=True, capture_output=True), resource.RUSAGE_CHILDREN)
        pairs.append((ours[0] / theirs[0], ours[1] / theirs[1], ours[1]))
    processor, wall, seconds = (statistics.median(column) for column in zip(*pairs))
    print(f"scene.run of 60 s at 1 kHz, {preset}: {processor:.2f} x the processor time of merkel run --fast, "
          f"{wall:.2f} x its time ({seconds:.2f} s)")


def push(preset):
    """A push with a tick against the same ticks in one push: what the call itself costs."""
    depth_mm, count = 0.0, 20_000
    costs = []
    for _ in range(PAIRS):
        each = merkel.Scene(preset).stream()
        each.push(0.0, depth_mm=depth_mm)
        started = time.process_time()
        for i in range(1, count):
            each.push(i / 1000, depth_mm=depth_mm)
        pushed = time.process_time() - started
        once = merkel.Scene(preset).stream()
        once.push(0.0, depth_mm=depth_mm)
        started = time.process_time()
        once.push((count - 1) / 1000, depth_mm=depth_mm)
        costs.append((pushed - (time.process_time() - started)) / count * 1e6)
    print(f"stream.push, {preset}: {statistics.median(costs):.2f} us above the tick")


with tempfile.TemporaryDirectory() as folder:
    for preset in ("paper", "goodwin"):
        batch(folder, preset)
        push(preset)
