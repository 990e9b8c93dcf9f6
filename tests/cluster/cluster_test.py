"""The engines of tools/cluster give the hashes of a local run, also when a worker is killed."""
import csv
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from local_slurm import LocalSlurm, missing

PROGRAM = os.environ["MERKEL_PROGRAM"]
SNAKEFILE = os.path.abspath("tools/cluster/Snakefile")
SCENES = ["paper", "goodwin", "finger"]
WHY_NOT = missing()


def wait_for(condition, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError("waited in vain")
        time.sleep(0.02)


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-", dir="/var/tmp")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


@unittest.skipIf(shutil.which("snakemake") is None, "snakemake is missing (tools/install_packages cluster)")
class Workflow(Case):
    def study(self, out):
        """A study of two sessions and three scenes, as a configuration."""
        for name, trace in (("taps", "taps"), ("slide", "slide")):
            session = self.folder / f"{name}.xdf"
            if not session.exists():
                subprocess.run([PROGRAM, "run", "paper", "--fast", "--probe", f"replay:tests/traces/{trace}.csv",
                                "--sink", f"xdf:{session}"], check=True, capture_output=True)
        config = self.folder / f"{out}.yaml"
        config.write_text(f"sessions: [{self.folder}/taps.xdf, {self.folder}/slide.xdf]\nscenes: [{', '.join(SCENES)}]\n"
                          f"out: {self.folder}/{out}\nmerkel: {PROGRAM}\n")
        return config

    def snakemake(self, config, *arguments, environment=None):
        return subprocess.Popen(["snakemake", "-s", SNAKEFILE, "--configfile", str(config), "--nolock", "--directory", str(self.folder),
                                 *arguments], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment)

    def hashes(self, out):
        with open(self.folder / out / "table.csv", newline="") as file:
            return {(row["scene"], row["name"]): row["spike_hash"] for row in csv.DictReader(file)}

    def locally(self):
        done = self.snakemake(self.study("local"), "--cores", "2")
        text = done.communicate()[0]
        self.assertEqual(done.returncode, 0, text)
        return self.hashes("local")

    def test_the_table_has_the_hashes_of_merkel_batch(self):
        hashes = self.locally()
        self.assertEqual(len(hashes), 2 * len(SCENES))
        jobs = self.folder / "jobs.csv"
        jobs.write_text("name,scene,probe\n" + "".join(f"{name},{scene},replay:{self.folder}/{name}.xdf\n"
                                                       for scene, name in hashes))
        subprocess.run([PROGRAM, "batch", jobs, "--out", self.folder / "batch"], check=True, capture_output=True)
        with open(self.folder / "batch" / "results.csv", newline="") as file:
            self.assertEqual({(row["scene"], row["name"]): row["spike_hash"] for row in csv.DictReader(file)}, hashes)
        self.assertEqual((self.folder / "local" / "goodwin" / "taps.nwb").read_bytes()[:4], b"\x89HDF")
        self.assertGreater((self.folder / "local" / "table.png").stat().st_size, 1000)

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_slurm_gives_the_hashes_of_the_local_run_also_when_a_job_is_killed(self):
        expected = self.locally()
        # The first replay of goodwin waits until it is killed.
        slow = self.folder / "slow_merkel"
        mark = self.folder / "started"
        slow.write_text(f'#!/bin/sh\nif [ ! -e {mark} ]; then echo $$ > {mark}; exec sleep 600; fi\nexec {PROGRAM} "$@"\n')
        slow.chmod(0o755)
        config = self.study("slurm")
        config.write_text(config.read_text().replace(f"merkel: {PROGRAM}", f"merkel: {slow}"))
        profile = self.folder / "profile"
        shutil.copytree("tools/cluster/slurm", profile)
        text = (profile / "config.yaml").read_text()
        (profile / "config.yaml").write_text(text.replace("slurm-%j.log", f"{self.folder}/slurm-%j.log")
                                             .replace("latency-wait: 60", "latency-wait: 5"))
        with LocalSlurm() as slurm:
            done = self.snakemake(config, "--profile", str(profile), "--jobs", "2", environment=slurm.environment)
            try:
                wait_for(lambda: mark.exists() and mark.read_text().strip())
                running = slurm.run("squeue", "-h", "-o", "%i").split()
                self.assertTrue(running)
                os.kill(int(mark.read_text()), signal.SIGKILL)
                output = done.communicate(timeout=240)[0]
            finally:
                done.kill()
                done.wait()
            logs = "".join(path.read_text() for path in self.folder.glob("slurm-*.log"))
            self.assertEqual(done.returncode, 0, output + logs)
            self.assertIn("Trying to restart job", output)
        self.assertEqual(self.hashes("slurm"), expected)


    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_a_cluster_that_ends_leaves_no_job_behind(self):
        mark = self.folder / "pid"
        job = self.folder / "job"
        job.write_text(f"#!/bin/sh\necho $$ > {mark}\nexec sleep 600\n")
        with LocalSlurm() as slurm:
            slurm.run("sbatch", f"--output={self.folder}/job.log", str(job))
            wait_for(lambda: mark.exists() and mark.read_text().strip())
            self.assertTrue(pathlib.Path("/proc", mark.read_text().strip()).exists())
        self.assertFalse(pathlib.Path("/proc", mark.read_text().strip()).exists())


def count_spikes(run):
    """Slow enough to be killed meanwhile."""
    time.sleep(0.2)
    return len(run.spikes)


class Dask(Case):
    def setUp(self):
        super().setUp()
        try:
            import distributed
            import merkel
        except ImportError as error:
            self.skipTest(f"{error} (tools/install_packages cluster)")
        self.distributed, self.merkel = distributed, merkel

    def process(self, *arguments):
        started = subprocess.Popen([sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.folder,
                                   env={**os.environ, "PYTHONPATH": ":".join(map(os.path.abspath, sys.path[:1]))
                                        + ":" + os.path.abspath(os.environ["PYTHONPATH"])})
        self.addCleanup(lambda: (started.kill(), started.wait()))
        return started

    def test_dask_gives_the_hashes_of_the_local_run_also_when_a_worker_is_killed(self):
        address = self.folder / "scheduler.json"
        self.process("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(address))
        wait_for(address.exists)
        workers = [self.process("dask_worker", "--scheduler-file", str(address), "--nthreads", "1", "--no-nanny",
                                "--no-dashboard", "--host", "127.0.0.1", "--name", name) for name in ("one", "two")]
        jobs = [{"scene": "goodwin", "probe": "replay:tests/traces/taps.csv", "seed": seed} for seed in range(16)]
        expected = [row["spike_hash"] for row in self.merkel.batch(jobs, keep="table").rows]
        with self.distributed.Client(scheduler_file=str(address), timeout=30) as client:
            client.wait_for_workers(2, timeout=60)
            executor = client.get_executor()
            done = self.merkel.batch(jobs, executor, keep="table")
            self.assertEqual([row["spike_hash"] for row in done.rows], expected)
            killer = threading.Timer(0.7, workers[1].kill)
            killer.start()
            done = self.merkel.batch(jobs, executor, keep=count_spikes)
            killer.join()
            self.assertIsNotNone(workers[1].wait())
            self.assertEqual(len(client.scheduler_info()["workers"]), 1)
        self.assertEqual([row["spike_hash"] for row in done.rows], expected)


if __name__ == "__main__":
    result = unittest.main(verbosity=2, exit=False).result
    skipped = len(result.skipped) == result.testsRun
    sys.exit(77 if skipped else not result.wasSuccessful())
