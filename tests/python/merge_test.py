"""merkel merge: sessions of several rigs on one clock, by UTC or by marks."""
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import merkel
import numpy as np

PROGRAM = os.environ["MERKEL_PROGRAM"]


def with_facts(session, copy, **facts):
    """Copies a session with other facts in its header; None removes a fact."""
    data = pathlib.Path(session).read_bytes()
    width = data[4]
    length = int.from_bytes(data[5:5 + width], "little")
    start = 5 + width
    text = data[start + 2:start + length].decode()
    for name, value in facts.items():
        text = re.sub(f"<{name}>[^<]*</{name}>", "", text)
        if value is not None:
            text = text.replace("</merkel>", f"<{name}>{value}</{name}></merkel>")
    chunk = struct.pack("<H", 1) + text.encode()
    pathlib.Path(copy).write_bytes(data[:4] + b"\x04" + struct.pack("<I", len(chunk)) + chunk + data[start + length:])
    return str(copy)


class Alignment(unittest.TestCase):
    def test_the_recorded_alignment_converts_times(self):
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            session = f"{folder}/a.xdf"
            subprocess.run([PROGRAM, "run", "paper", "--fast", "--sink", "xdf:" + session], check=True, capture_output=True)
            self.assertEqual(merkel.load(session).alignments, {})
            start_ns = round(1e9 * merkel.load(session).start_device_s)
            alignment = {"to": "TTL", "session_ns": [start_ns, start_ns + 2_000_000_000], "to_ns": [5_000_000_000, 7_000_200_000]}
            copy = with_facts(session, f"{folder}/b.xdf", alignment=json.dumps(alignment))
            points = merkel.load(copy).alignments["TTL"]
            np.testing.assert_allclose(points[1:-1], [[0, 5], [2, 7.0002]], atol=1e-9)
            for time_s in (-10.0, 1.0, 100.0):
                self.assertAlmostEqual(np.interp(time_s, *points.T), 5 + 1.0001 * time_s, places=6)
            broken = with_facts(session, f"{folder}/c.xdf", alignment='{"to": "TTL", "session_ns": [1], "to_ns": []}')
            self.assertEqual(merkel.load(broken).alignments, {})


class Merge(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def path(self, name):
        return str(self.folder / name)

    def merkel(self, *arguments, exit_code=0):
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        return done.stderr

    def record(self, name, scene, trace):
        self.merkel("run", scene, "--fast", "--probe", f"replay:tests/traces/{trace}.csv", "--sink", "xdf:" + self.path(name))
        return self.path(name)

    def two(self, error_a=2_000_000, error_b=1_000_000):
        """Two sessions of different hosts; the second one began 1.25 s later."""
        a, b = self.record("left.xdf", "paper", "taps"), self.record("right.xdf", "finger", "slide")
        start = 1_700_000_000_000_000_000
        return (with_facts(a, self.folder / "a.xdf", boot_id="one", start_device_ns=0, start_utc_ns=start, utc_error_ns=error_a),
                with_facts(b, self.folder / "b.xdf", boot_id="two", start_device_ns=0, start_utc_ns=start + 1_250_000_000,
                           utc_error_ns=error_b))

    def spikes(self, file):
        rows = [line.split(",") for line in pathlib.Path(file).read_text().splitlines() if line[0].isdigit()]
        return [(round(float(time_s) * 1e9), int(neuron)) for time_s, neuron in rows]

    def test_spikes_of_both_are_on_the_first_one_s_clock(self):
        a, b = self.two()
        error = self.merkel("merge", a, b, "--sink", "csv:" + self.path("all.csv"), "--sink", "nwb:" + self.path("all.nwb"))
        # 3 ms are the errors of the hosts' UTC; each clock may drift by 500 ppm of the run's duration.
        self.assertIn("b.xdf: +1.250000000 s by UTC of the hosts, residual 5.9", error)
        left, right = merkel.load(a), merkel.load(b)
        expected = [(round(t * 1e9), int(n)) for t, n in zip(left.spikes["time_s"], left.spikes["neuron"])]
        expected += [(round(t * 1e9) + 1_250_000_000, int(n) + len(left.afferents))
                     for t, n in zip(right.spikes["time_s"], right.spikes["neuron"])]
        self.assertEqual(self.spikes(self.path("all.csv")), sorted(expected))
        try:
            import h5py
        except ImportError:
            return
        with h5py.File(self.path("all.nwb")) as file:
            self.assertEqual(len(file["units/id"]), len(left.afferents) + len(right.afferents))
            self.assertEqual(len(file["units/spike_times"]), len(expected))
            self.assertAlmostEqual(np.max(file["units/spike_times"]), max(expected)[0] * 1e-9, places=9)

    def test_sessions_of_one_host_need_no_utc(self):
        a, b = self.record("a.xdf", "paper", "taps"), self.record("b.xdf", "paper", "taps")
        self.assertTrue(merkel.load(a).facts["boot_id"])
        self.assertIn("by the same host, residual 0 ms", self.merkel("merge", a, b, "--sink", "csv:" + self.path("all.csv")))

    def test_a_residual_above_the_limit_or_unknown_is_refused_with_advice_that_works(self):
        a, b = self.two(error_b=9_000_000)
        sink = ("--sink", "csv:" + self.path("all.csv"))
        error = self.merkel("merge", a, b, *sink, exit_code=2)
        self.assertIn("only to within 13.9", error)
        self.assertIn("and the limit is 10 ms: align by a mark", error)
        self.merkel("merge", a, b, *sink, "--limit-ms", "15")
        c = with_facts(b, self.folder / "c.xdf", utc_error_ns=None)
        error = self.merkel("merge", a, c, *sink, "--overwrite", exit_code=2)
        self.assertIn("a host's clock was not synchronised", error)
        self.assertIn("residual unknown", self.merkel("merge", a, c, *sink, "--overwrite", "--accept-unknown"))
        self.assertIn("has no mark \"sync\": it has no marks", self.merkel("merge", a, b, *sink, "--by-mark", "sync", exit_code=2))
        self.assertIn("at least two sessions", self.merkel("merge", a, *sink, exit_code=2))
        self.assertIn("use another sink", self.merkel("merge", a, b, "--sink", "xdf:" + self.path("all.xdf"), exit_code=2))

    def test_marks_align_sessions_whose_clocks_are_wrong(self):
        probe = "sim:ramp?depth_mm=1.5&hold_s=1.5&live=1"
        with merkel.connect(probe, sinks=["xdf:" + self.path("left.xdf")]) as left, \
                merkel.connect(probe, sinks=["xdf:" + self.path("right.xdf")]) as right:
            for _ in range(2):
                time.sleep(0.3)
                left.mark("sync")
                right.mark("sync")
        wrong = with_facts(self.path("right.xdf"), self.folder / "wrong.xdf", boot_id="two", start_utc_ns=None)
        sink = ("--sink", "csv:" + self.path("all.csv"))
        self.assertIn("align the sessions by a mark", self.merkel("merge", self.path("left.xdf"), wrong, *sink, exit_code=2))
        error = self.merkel("merge", self.path("left.xdf"), wrong, *sink, "--by-mark", "sync", "--limit-ms", "1000")
        found = re.search(r"wrong.xdf: ([-+.\d]+) s by 2 marks \"sync\", residual ([\d.e-]+) ms", error)
        def times(session):
            loaded = merkel.load(session)
            return [int(loaded.facts["start_device_ns"]) * 1e-9 + time_s for time_s, _ in loaded.marks]

        first, second = (own - other for own, other in zip(times(self.path("left.xdf")), times(wrong)))
        # Both hosts have the same clock, so the marks differ by the time from one call to the next; the line through them
        # goes on to the beginning, which is about as far from the first as the second is.
        self.assertAlmostEqual(float(found[1]), first, delta=0.001 + 10 * abs(second - first))


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
