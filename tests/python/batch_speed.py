#!/usr/bin/env python3
"""How batches scale: jobs of a second of goodwin on one and on all cores, and the overhead of a job.

batch_speed.py MERKEL, with PYTHONPATH as the tests have it. One core: the batch is pinned to it. Medians of rounds.
Dask, if it is installed: a scheduler and a worker for each core, which have run a batch before."""
import functools
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import merkel

PROGRAM = sys.argv[1]
JOBS, ROUNDS = 64, 7
SCENE, PROBE = "goodwin", "sim:taps?depth_mm=1&count=20"
CORES = sorted(os.sched_getaffinity(0))


def pinned(cores, run):
    os.sched_setaffinity(0, cores)
    begin = time.perf_counter()
    run()
    taken = time.perf_counter() - begin
    os.sched_setaffinity(0, CORES)
    return taken


def jobs_of(duration_s):
    return [{"scene": SCENE, "probe": f"{PROBE}&x_mm={10 + number / 100}", "duration_s": duration_s} for number in range(JOBS)]


def python(cores, duration_s):
    return pinned(cores, lambda: merkel.batch(jobs_of(duration_s), cores=len(cores), keep="table", progress=False))


@functools.cache
def executor_of(workers):
    cluster = distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    executor = distributed.Client(cluster).get_executor()
    merkel.batch(jobs_of(0.1), executor, keep="table", progress=False)
    return executor


def dask(cores, duration_s):
    pinned(cores, lambda: executor_of(len(cores)))
    return pinned(cores, lambda: merkel.batch(jobs_of(duration_s), executor_of(len(cores)), keep="table", progress=False))


def program(cores, duration_s):
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder, "jobs.csv")
        table.write_text("scene,probe,duration_s\n" + "".join(f"{SCENE},{PROBE}&x_mm={10 + number / 100},{duration_s}\n"
                                                              for number in range(JOBS)))
        return pinned(cores, lambda: subprocess.run([PROGRAM, "batch", table, "--out", folder + "/out"], check=True,
                                                    stderr=subprocess.DEVNULL))


if __name__ == "__main__":
    batches = [("`merkel batch`", program), ("`merkel.batch`", python)]
    try:
        import distributed
        batches.append((f"`merkel.batch`, Dask {distributed.__version__}", dask))
    except ImportError:
        pass
    print("| | jobs | one core, s | all cores, s | ratio | overhead of a job, ms |\n|---|---|---|---|---|---|")
    for name, batch in batches:
        rounds = [(batch(CORES[:1], 1.0), batch(CORES, 1.0), batch(CORES[:1], 2.0)) for _ in range(ROUNDS)]
        one, every, ratio, overhead = map(statistics.median, zip(*((one, every, one / every, 1e3 * (2 * one - longer) / JOBS)
                                                                   for one, every, longer in rounds)))
        print(f"| {name} | {JOBS} of 1 s | {one:.2f} | {every:.2f} on {len(CORES)} | {ratio:.2f} | {overhead:.1f} |", flush=True)
