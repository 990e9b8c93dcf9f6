"""merkel.batch() and `merkel batch`: the same spikes on any number of processes, resumed after any end."""
import concurrent.futures
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import merkel
import numpy as np

PROGRAM = os.environ["MERKEL_PROGRAM"]
TRACE = "tests/traces/taps.csv"
TIME_S = np.arange(0, 0.5, 0.001)
PRESS = {"depth_mm": 1.5 * np.clip(TIME_S / 0.1, 0, 1), "rate_hz": 1000}
JOBS = [{"scene": scene, "probe": "replay:" + TRACE, "seed": seed, "skin.radius_mm": radius}
        for scene in ("goodwin", "finger") for seed, radius in ((1, 7.5), (2, 9))]


def half_rate(run):
    return run.psth(0.05) / 2


def end_the_worker(run):
    if len(run.spikes) > 0 and run.start_s == 0:
        os.kill(os.getpid(), signal.SIGKILL)


def slow(run):
    time.sleep(0.2)
    return len(run.spikes)


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expected(self, job):
        scene = merkel.Scene(job["scene"], overrides={"skin.radius_mm": job["skin.radius_mm"]})
        return scene.run(probe=job["probe"], seed=job["seed"]).spike_hash


class Python(Case):
    def test_hashes_are_those_of_single_runs_on_any_executor(self):
        expected = [self.expected(job) for job in JOBS]
        self.assertEqual(len(set(expected)), len(JOBS))
        for cores in (1, 2, 3):
            self.assertEqual([row["spike_hash"] for row in merkel.batch(JOBS, cores=cores).rows], expected)
        with concurrent.futures.ThreadPoolExecutor(2) as threads:
            self.assertEqual([row["spike_hash"] for row in merkel.batch(JOBS, threads).rows], expected)

    def test_results_are_in_order_with_their_rows(self):
        done = merkel.batch([{"scene": "finger", "press": PRESS, "seed": seed} for seed in (5, 3, 5)], cores=2)
        run = merkel.Scene("finger").run(**PRESS, seed=5)
        for result in (done[0], done[2]):
            np.testing.assert_array_equal(result.spikes, run.spikes)
            self.assertEqual(result.row["spikes"], len(run.spikes))
            self.assertEqual(result.row["firing"], len(set(run.spikes["neuron"])))
            self.assertEqual(result.row["verdict"], "ok")
        self.assertNotEqual(done[1].row["spike_hash"], run.spike_hash)

    def test_a_failure_is_a_row_with_the_sentence(self):
        done = merkel.batch([{"press": PRESS}, {"press": PRESS, "skin.radus_mm": 8}, {"pres": 1}, {"scene": "gudwin"},
                             {"press": PRESS, "skin.poisson_ratio": 0.8}, {"press": PRESS, "seed": 1.5},
                             {"probe": "none.csv"}, {"press": {"dept_mm": [0, 1]}}, {"press": PRESS}], cores=2)
        sentences = [None, "no key skin.radus_mm: did you mean skin.radius_mm", "a job has no key pres", "did you mean",
                     "skin.poisson_ratio must be", "seed must be a whole number", "there is no recording", "no dept_mm", None]
        for row, sentence in zip(done.rows, sentences):
            self.assertEqual(row["status"], "failed" if sentence else "done", row)
            self.assertIn(sentence or "", row["error"])
        with self.assertRaisesRegex(merkel.Error, "did you mean skin.radius_mm"):
            done[1].spikes

    def test_a_wrong_value_of_any_type_fails_its_own_job_only(self):
        wrong = [{"duration_s": "long"}, {"seed": float("inf")}, {"overrides": "abc"}, {"press": 5}, {"press": {}},
                 {"press": {"depth_mm": "deep", "rate_hz": 100}}, {"press": {"depth_mm": [[1], [1, 2]], "rate_hz": 100}},
                 {"press": {"rate_hz": 100}}]
        rows = merkel.batch([{"press": PRESS}, *wrong, {"press": PRESS}], cores=1).rows
        self.assertEqual([row["status"] for row in rows], ["done", *["failed"] * len(wrong), "done"])
        self.assertTrue(all(row["error"] for row in rows[1:-1]), rows)

    def test_a_killed_worker_fails_its_own_job_only(self):
        jobs = [{"press": PRESS, "seed": seed, "keep": "table"} for seed in range(4)]
        jobs[1]["keep"] = end_the_worker
        done = merkel.batch(jobs, cores=2)
        self.assertEqual([row["status"] for row in done.rows], ["done", "failed", "done", "done"])
        self.assertIn("the process that ran the job was killed", done.rows[1]["error"])

    def test_finished_jobs_are_not_run_again(self):
        out = self.folder / "out"
        jobs = [{"press": PRESS, "seed": seed} for seed in range(4)]
        first = merkel.batch(jobs[:2], out=out)
        stamps = [result.file.stat().st_mtime_ns for result in first]
        both = merkel.batch(jobs, out=out)
        self.assertEqual([result.file.stat().st_mtime_ns for result in both[:2]], stamps)
        np.testing.assert_array_equal(both[3].spikes, merkel.Scene("paper").run(**PRESS, seed=3).spikes)
        with open(out / "results.csv", newline="") as file:
            table = list(csv.DictReader(file))
        self.assertEqual([row["spike_hash"] for row in table], [row["spike_hash"] for row in both.rows])
        both[1].file.unlink()
        self.assertTrue(merkel.batch(jobs, out=out)[1].file.exists())
        changed = merkel.batch([dict(jobs[0], duration_s=0.3)], out=out)
        self.assertAlmostEqual(changed.rows[0]["simulated_s"], 0.3)

    def test_a_killed_batch_loses_only_its_running_jobs(self):
        out = self.folder / "out"
        sys.path.insert(0, "tests/python")
        from batch_test import slow  # by the name that it has in the other process
        script = ("import sys; sys.path.insert(0, 'tests/python'); import batch_test, merkel; "
                  "merkel.batch([{'press': batch_test.PRESS, 'seed': seed} for seed in range(12)], "
                  f"out={str(out)!r}, keep=batch_test.slow, cores=2)")
        batch = subprocess.Popen([sys.executable, "-c", script])
        rows = out / "rows.jsonl"
        while not rows.exists() or rows.read_text().count("\n") < 3:
            time.sleep(0.01)
        batch.send_signal(signal.SIGKILL)
        batch.wait()
        with open(rows, "a") as file:
            file.write('{"id": "unfinished')
        kept = rows.read_text().count("\n")
        self.assertLess(kept, 12)
        deadline = time.monotonic() + 30
        while True:  # until its workers are gone
            try:
                done = merkel.batch([{"press": PRESS, "seed": seed} for seed in range(12)], out=out, keep=slow)
                break
            except merkel.Error as error:
                self.assertIn("another batch is writing", str(error))
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.1)
        self.assertEqual([row["status"] for row in done.rows], ["done"] * 12)
        lines = [line for line in rows.read_text().splitlines() if line.endswith("}")]
        self.assertEqual(len(lines), 12)

    def test_keep_a_function_or_a_file_of_any_format(self):
        run = merkel.Scene("paper").run(**PRESS)
        jobs = [{"press": PRESS}]
        np.testing.assert_array_equal(merkel.batch(jobs, keep=half_rate)[0].value, half_rate(run))
        np.testing.assert_array_equal(merkel.batch(jobs, keep=half_rate, out=self.folder)[0].value, half_rate(run))
        nwb = merkel.batch(jobs, keep="nwb", out=self.folder)[0].file
        self.assertEqual(nwb.read_bytes()[:4], b"\x89HDF")
        self.assertIsNone(merkel.batch(jobs, keep="table")[0].run)
        self.assertIn("pass out=FOLDER", merkel.batch(jobs, keep="nwb").rows[0]["error"])

    def test_a_pandas_table_of_jobs(self):
        try:
            import pandas
        except ImportError:
            self.skipTest("pandas is not installed")
        jobs = pandas.DataFrame({"scene": ["goodwin", "finger"], "probe": "replay:" + TRACE, "seed": [1, None],
                                 "skin.radius_mm": [7.5, 9.0], "loop.threads": [1, None]})
        table = merkel.batch(jobs).table
        self.assertEqual(table["spike_hash"][0], self.expected(JOBS[0]))
        self.assertEqual(list(table["status"]), ["done", "done"])
        jobs["seed"], jobs["name"] = jobs["seed"].astype("Int64"), pandas.array(["a", None], dtype="string")
        self.assertEqual(list(merkel.batch(jobs).table["spike_hash"]), list(table["spike_hash"]))


class Program(Case):
    def jobs(self, jobs, name="jobs.csv"):
        path = self.folder / name
        with open(path, "w", newline="") as file:
            writer = csv.DictWriter(file, dict.fromkeys(key for job in jobs for key in job))
            writer.writeheader()
            writer.writerows(jobs)
        return str(path)

    def batch(self, *arguments, exit_code=0):
        done = subprocess.run([PROGRAM, "batch", *map(str, arguments)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        return done

    def table(self, out):
        with open(out / "results.csv", newline="") as file:
            return list(csv.DictReader(file))

    def test_hashes_and_rates_are_those_of_python(self):
        expected = merkel.batch(JOBS, keep="table").rows
        for processes in (1, 3):
            out = self.folder / str(processes)
            self.batch(self.jobs(JOBS), "--out", out, "--jobs", processes)
            for row, same in zip(self.table(out), expected):
                for column in ("spike_hash", "spikes", "firing", "busiest_hz", "rate_hz", "simulated_s", "version"):
                    self.assertEqual(row[column], str(same[column]), column)

    def test_a_job_ends_after_its_duration(self):
        job = {"scene": "goodwin", "probe": "sim:taps?depth_mm=1&count=20", "duration_s": 0.75}
        self.batch(self.jobs([job]), "--out", self.folder / "out")
        [row] = self.table(self.folder / "out")
        self.assertEqual(float(row["simulated_s"]), 0.75)
        self.assertEqual(row["spike_hash"], merkel.batch([job]).rows[0]["spike_hash"])

    def test_finished_jobs_are_not_run_again_and_files_are_kept(self):
        out = self.folder / "out"
        self.batch(self.jobs(JOBS[:2]), "--out", out, "--keep", "nwb")
        rows = (out / "rows.jsonl").read_text()
        self.batch(self.jobs(JOBS[:4]), "--out", out, "--keep", "nwb")
        self.assertTrue((out / "rows.jsonl").read_text().startswith(rows))
        self.assertEqual((out / "rows.jsonl").read_text().count("\n"), 4)
        for row in self.table(out):
            self.assertEqual((out / row["file"]).read_bytes()[:4], b"\x89HDF")

    def test_python_and_the_program_go_on_with_each_other_s_folder(self):
        out, scene = self.folder / "out", self.folder / "own.toml"
        scene.write_text('preset = "goodwin"\n[skin]\nradius_mm = 8\n')
        jobs = [{**JOBS[0], "name": "first"}, {"scene": str(scene), "probe": "replay:taps", "duration_s": 0.5, "name": "second"},
                {**JOBS[2], "name": "third"}]
        self.batch(self.jobs(jobs[:2]), "--out", out, "--keep", "csv")
        done = merkel.batch(jobs, out=out, keep="csv")
        rows = (out / "rows.jsonl").read_text()
        self.assertEqual(rows.count("\n"), 3)
        self.batch(self.jobs(jobs), "--out", out, "--keep", "csv")
        self.assertEqual((out / "rows.jsonl").read_text(), rows)
        for row, same in zip(self.table(out), done.rows):
            self.assertEqual({name: row[name] for name in ("id", "spike_hash", "file", "command")},
                             {name: same[name] for name in ("id", "spike_hash", "file", "command")})
        self.assertEqual([result.file.name for result in done], ["first.csv", "second.csv", "third.csv"])
        with self.assertRaisesRegex(merkel.Error, "two different jobs have the name"):
            merkel.batch([{"seed": 1, "name": "a"}, {"seed": 2, "name": "a"}], out=out, keep="csv")
        self.assertIn("cannot be that of its kept file", merkel.batch([{"name": "a/b"}], out=out, keep="csv").rows[0]["error"])

    def test_a_changed_file_of_a_job_is_run_again(self):
        """A recording, one with chosen channels, the shape and the recording that a scene names, and a shape that a column names."""
        out, shape, trace, scene = (self.folder / name for name in ("out", "shape.csv", "press.csv", "own.toml"))
        trace.write_bytes(pathlib.Path(TRACE).read_bytes())
        scene.write_text(f'[[probe]]\nuri = "replay:{trace}"\ntip = "shape"\nshape = "shape.csv"\npixel_mm = 0.2\n')
        jobs = [{"probe": f"replay:{trace}"}, {"probe": f"replay:{trace}#depth=depth_mm"}, {"scene": str(scene), "duration_s": 0.2},
                {"duration_s": 0.2, "probe.tip": "shape", "probe.shape": str(shape), "probe.pixel_mm": 0.2}]
        heights = np.zeros((12, 12))

        def run(changed):
            before = (out / "rows.jsonl").read_text().count("\n") if out.exists() else 0
            self.batch(self.jobs(jobs), "--out", out)
            rows = (out / "rows.jsonl").read_text()
            self.assertEqual(rows.count("\n"), before + changed)
            merkel.batch(jobs, out=out, keep="table")
            self.assertEqual((out / "rows.jsonl").read_text(), rows)

        np.savetxt(shape, heights, delimiter=",")
        run(4)
        run(0)
        heights[3, 3] = 0.2
        np.savetxt(shape, heights, delimiter=",")
        run(2)
        trace.write_bytes(b"".join(trace.read_bytes().splitlines(keepends=True)[:-5]))
        run(3)

    def test_jobs_do_not_open_the_sinks_of_their_scenes(self):
        out, scene, precious = (self.folder / name for name in ("out", "own.toml", "precious.csv"))
        scene.write_text(f'[[sink]]\nuri = "csv:{precious}"\n')
        precious.write_text("mine")
        jobs = [{"scene": str(scene), "duration_s": 0.2, "seed": 1}, {"scene": str(scene), "duration_s": 0.2, "skin.radius_mm": 9}]
        done = self.batch(self.jobs(jobs), "--out", out, "--keep", "csv")
        self.assertEqual(done.stderr.count("does not open the sinks of its scenes"), 1)
        self.assertEqual(precious.read_text(), "mine")
        rows = (out / "rows.jsonl").read_text()
        self.assertEqual(rows.count("\n"), 2)
        with self.assertWarnsRegex(UserWarning, "does not open the sinks of its scenes"):
            merkel.batch(jobs, out=out, keep="csv")  # goes on with the folder
        self.assertEqual((out / "rows.jsonl").read_text(), rows)
        own = merkel.Scene(scene)
        with self.assertWarnsRegex(UserWarning, "does not open the sinks of its scenes"):
            listed = merkel.batch([{**job, "scene": own} for job in jobs], cores=1)
        self.assertEqual([row["spike_hash"] for row in listed.rows], [row["spike_hash"] for row in self.table(out)])
        self.assertEqual(precious.read_text(), "mine")
        self.assertIn(str(precious), own.text)

    def test_sessions_with_different_shapes_of_one_name_are_different_jobs(self):
        shape, scene, table = (self.folder / name for name in ("shape.csv", "own.toml", "jobs.csv"))
        scene.write_text('preset = "goodwin"\n[[probe]]\ntip = "shape"\nshape = "shape.csv"\npixel_mm = 0.2\n'
                         'uri = "sim:ramp?depth_mm=1&hold_s=0.2"\n')
        sessions = [str(self.folder / name) for name in ("round.xdf", "flat.xdf")]
        hashes = []
        for session, height in zip(sessions, (0.25, 0.05)):
            np.savetxt(shape, height * np.add.outer(np.arange(-2, 2.1, 0.2)**2, np.arange(-2, 2.1, 0.2)**2), delimiter=",")
            hashes.append(merkel.Scene(scene).run(sinks=["xdf:" + session]).spike_hash)
        self.assertNotEqual(*hashes)
        jobs = [{"scene": session, "probe": "sim:ramp?depth_mm=1&hold_s=0.2"} for session in sessions]
        self.batch(self.jobs(jobs), "--out", self.folder / "out")
        self.assertEqual([row["spike_hash"] for row in self.table(self.folder / "out")], hashes)
        journal = (self.folder / "out" / "rows.jsonl").read_text()
        merkel.batch(jobs, out=self.folder / "out", keep="table")
        self.assertEqual((self.folder / "out" / "rows.jsonl").read_text(), journal)

    def test_spikes_of_a_recording_since_1970_have_the_hash_of_the_program(self):
        trace = self.folder / "unix.csv"
        trace.write_text("time_s,depth_mm\n" + "".join(f"1700000000.{i:03d},{min(i / 100, 1.5)}\n" for i in range(400)))
        jobs = [{"scene": "goodwin", "probe": f"replay:{trace}"}]
        self.batch(self.jobs(jobs), "--out", self.folder / "out")
        [row] = self.table(self.folder / "out")
        self.assertEqual(merkel.batch(jobs, keep="table", cores=1).rows[0]["spike_hash"], row["spike_hash"])

    def test_each_row_has_the_command_that_repeats_it(self):
        job = {**JOBS[1], "duration_s": 0.75, "probe.tip": "bars", "probe.bar_gaps_mm": "[3, 5]"}
        self.batch(self.jobs([job]), "--out", self.folder / "out")
        [row] = self.table(self.folder / "out")
        command = row["command"].replace("merkel run", PROGRAM + " run --json", 1)
        repeated = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
        self.assertEqual(repeated.returncode, 0, command + repeated.stderr)
        self.assertEqual(str(json.loads(repeated.stdout)["spikes"]), row["spikes"])
        in_python = merkel.batch([job]).rows[0]["command"]  # with the whole path
        self.assertEqual(in_python.replace(os.path.abspath(TRACE), TRACE), row["command"])

    def test_sessions_run_again_under_their_names(self):
        sessions = self.folder / "sessions"
        sessions.mkdir()
        (self.folder / "own.toml").write_text('preset = "goodwin"\n[[probe]]\nuri = "sim:ramp"\ntip = "shape"\n'
                                              'shape = "shape.csv"\npixel_mm = 0.2\n')
        np.savetxt(self.folder / "shape.csv", np.add.outer(np.arange(-2, 2.1, 0.2)**2, np.arange(-2, 2.1, 0.2)**2) / 4, delimiter=",")
        runs = {"press": ["goodwin", "--probe", "replay:" + TRACE, "--seed", "5"],
                "shape": [str(self.folder / "own.toml"), "--duration-s", "0.5"],
                "six probes": ["hand", "--duration-s", "0.4"]}
        expected = {}
        for name, words in runs.items():
            done = subprocess.run([PROGRAM, "run", *words, "--fast", "--json", "--sink", f"xdf:{sessions / name}.xdf"],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            expected[name] = str(json.loads(done.stdout)["spikes"])
        out = self.folder / "out"
        self.batch(sessions, "--out", out, "--keep", "csv")
        rows = self.table(out)
        self.assertEqual({row["name"]: row["spikes"] for row in rows}, expected)
        self.assertEqual([row["file"] for row in rows], [f"{name}.csv" for name in sorted(runs)])
        command = rows[0]["command"].replace("merkel run", PROGRAM + " run --json", 1)
        repeated = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
        self.assertEqual(str(json.loads(repeated.stdout)["spikes"]), rows[0]["spikes"], repeated.stderr)
        # Python goes on with the folder, and makes the same spikes of its own.
        journal = (out / "rows.jsonl").read_text()
        merkel.batch(sessions, out=out, keep="csv")
        self.assertEqual((out / "rows.jsonl").read_text(), journal)
        listed = merkel.batch([sessions / f"{name}.xdf" for name in sorted(runs)], keep="table", cores=1)
        self.assertEqual([row["spike_hash"] for row in listed.rows], [row["spike_hash"] for row in rows])

        recorded = (sessions / "press.xdf").read_bytes()
        self.batch(sessions, "--out", sessions, "--keep", "xdf", exit_code=2)
        self.assertEqual((sessions / "press.xdf").read_bytes(), recorded)
        self.assertIn("neither a session", self.batch(sessions, TRACE, "--out", out, exit_code=2).stderr)
        self.assertIn("holds no session", self.batch("tests/traces", "--out", out, exit_code=2).stderr)

    def test_files_that_no_batch_has_written_are_kept(self):
        for name in ("results.csv", "first.csv"):
            file = self.folder / name[:-4] / name
            file.parent.mkdir()
            file.write_text("mine")
            with self.assertRaisesRegex(merkel.Error, "no batch has written it"):
                merkel.batch([{**JOBS[0], "name": "first"}], out=file.parent, keep="csv")
            self.assertEqual(file.read_text(), "mine")

    def test_failures_are_rows_and_the_exit_code_is_1(self):
        jobs = self.jobs([{"probe": "replay:" + TRACE}, {"probe": "replay:" + TRACE, "skin.radus_mm": 8},
                          {"scene": "gudwin"}, {"seed": "a,b"}, {"probe": "replay:" + TRACE, "seed": "9223372036854775807"},
                          {"seed": "9223372036854775808"}])
        done = self.batch(jobs, "--out", self.folder / "out", exit_code=1)
        self.assertIn("2 of 6 jobs done, 4 failed", done.stderr)
        self.assertIn("job 1: the scene has no key skin.radus_mm: did you mean skin.radius_mm?", done.stderr)
        rows = self.table(self.folder / "out")
        self.assertEqual([row["status"] for row in rows], ["done", "failed", "failed", "failed", "done", "failed"])
        self.assertEqual(rows[3]["error"], "seed must be a whole number from 0 to 9223372036854775807, but is a,b")

    def test_wrong_tables_are_refused_with_the_line(self):
        for text, sentence in (("", "is empty"), ("scene,prob\n", 'a column "prob": did you mean probe'),
                               ("scene,probe\n\npaper,a,b\n", "jobs.csv:3: the line has 3 cells, but the header has 2"),
                               ('scene\n"paper\n', "jobs.csv:2: a quote is not closed")):
            path = self.folder / "jobs.csv"
            path.write_text(text)
            self.assertIn(sentence, self.batch(path, "--out", self.folder / "out", exit_code=2).stderr)
        path.write_text("# a comment\r\n\"scene\", probe\r\n\r\npaper,\"replay:" + TRACE + "\"\r\n")
        self.batch(path, "--out", self.folder / "out")
        self.assertIn("is not one of table, nwb", self.batch(path, "--out", self.folder, "--keep", "nwp", exit_code=2).stderr)

    def long_batch(self):
        jobs = self.jobs([{"scene": "hand", "probe.uri": "sim:taps?count=4", "seed": seed} for seed in range(30)])
        out = self.folder / "out"
        batch = subprocess.Popen([PROGRAM, "batch", jobs, "--out", out, "--jobs", "2"], stderr=subprocess.PIPE, text=True)
        while not (out / "rows.jsonl").exists() or (out / "rows.jsonl").read_text().count("\n") < 2:
            time.sleep(0.01)
        return jobs, out, batch

    def test_ctrl_c_keeps_what_is_finished(self):
        jobs, out, batch = self.long_batch()
        batch.send_signal(signal.SIGINT)
        error = batch.communicate()[1]
        self.assertEqual(batch.returncode, 1)
        self.assertIn("the same command runs the jobs that are left", error)
        kept = self.table(out)
        self.assertGreaterEqual(len(kept), 2)
        self.assertLess(len(kept), 30)
        self.assertEqual({row["status"] for row in kept}, {"done"})

    def test_a_killed_worker_fails_its_job_only(self):
        jobs, out, batch = self.long_batch()
        workers = pathlib.Path(f"/proc/{batch.pid}/task/{batch.pid}/children").read_text().split()
        os.kill(int(workers[0]), signal.SIGKILL)
        while not any("was ended by the signal Killed" in line for line in (out / "rows.jsonl").read_text().splitlines()):
            time.sleep(0.01)
        batch.send_signal(signal.SIGKILL)
        batch.communicate()
        before = (out / "rows.jsonl").read_text()
        rows = [json.loads(line) for line in before.splitlines()]
        self.assertEqual([row["status"] for row in rows].count("failed"), 1)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
