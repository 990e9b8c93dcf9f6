"""Recordings of LabRecorder with several rigs: one rig is a session without ticks, on the recorder's clock.

The file is made here, as LabRecorder writes what the sink lsl: sends (.ci/liblsl tests the sink)."""
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

import merkel
import numpy as np

from streams_test import Rig, chunk

PROGRAM = os.environ["MERKEL_PROGRAM"]
FORMATS = {"int32": "i", "double64": "d"}


def escaped(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def header(number, name, kind, format, channels, description):
    text = (f"<info><name>{name}</name><type>{kind}</type><channel_count>{channels}</channel_count>"
            f"<nominal_srate>0</nominal_srate><channel_format>{format}</channel_format>"
            f"<source_id>merkel-{name}</source_id><hostname>h</hostname><desc>{description}</desc></info>")
    return chunk(2, struct.pack("<I", number) + text.encode())


class Rigs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.lab = str(self.folder / "lab.xdf")

    def path(self, name):
        return str(self.folder / name)

    def merkel(self, *arguments, exit_code=0):
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        return done.stdout + done.stderr

    def rig(self, number, name, scene, trace, clock, stale):
        """The chunks of a rig: its headers, offsets and data; the data in parts, so that rigs interleave. liblsl ends each
        stream with a stale sample while its outlet closes."""
        session = self.path(name + ".xdf")
        self.merkel("run", scene, "--fast", "--probe", f"replay:tests/traces/{trace}.csv", "--sink", "xdf:" + session)
        run = merkel.load(session)
        facts = "".join(f"<{key}>{escaped(value)}</{key}>" for key, value in run.facts.items()
                        if isinstance(value, str) and key not in ("afferents", "start_device_ns", "start_utc_ns"))
        afferents = "".join(f"<afferent><neuron>{i + 1}</neuron><patch>{row['patch']}</patch></afferent>"
                            for i, row in enumerate(run.afferents))
        labels = "".join(f"<channel><label>{label}</label><unit>{unit}</unit></channel>"
                         for label, unit in (("depth", "mm"), ("force", "N")))
        heads = (header(number, name, "Spikes", "int32", 1, f"<merkel>{facts}</merkel><afferents>{afferents}</afferents>")
                 + header(number + 1, name + ".samples", "ProbeSamples", "double64", 2, f"<channels>{labels}</channels>")
                 + header(number + 2, name + ".marks", "Markers", "string", 1, ""))
        times = np.arange(0, 10, 0.5) + 5000
        offsets = [piece for n in range(3) for piece in Rig(number + n, clock.ahead, clock.drift, clock.rng).offsets(times)]

        def rows(stream, stamps, values):
            content = b"".join(b"\x08" + struct.pack("<d", clock.clock(t + 5000)) + value for t, value in zip(stamps, values))
            return chunk(3, struct.pack("<I", stream) + b"\x04" + struct.pack("<I", len(stamps)) + content)
        data = []
        for part in range(4):
            inside = lambda table: table[(table["time_s"] >= part) & (table["time_s"] < part + 1)]
            spikes, samples = inside(run.spikes), inside(run.samples)
            data.append(rows(number, spikes["time_s"], [struct.pack("<i", n) for n in spikes["neuron"]])
                        + rows(number + 1, samples["time_s"], [struct.pack("<dd", d, f) for d, f in
                                                               zip(samples["depth_mm"], samples["force_N"])]))
        spike, sample, mark = stale
        end = b"merkel: end of run"
        data.append(rows(number + 2, [0.5, 4.5] if mark else [0.5], [b"\x01\x04sync", bytes((1, len(end))) + end]))
        data.append(rows(number, [5.1], [struct.pack("<i", spike)]) + rows(number + 1, [5.1], [struct.pack("<dd", *sample)])
                    + rows(number + 2, [5.1] if mark else [], [mark]))
        return run, heads, offsets, data

    def record(self):
        rng = np.random.default_rng(5)
        left, *parts_a = self.rig(1, "left", "paper", "taps", Rig(0, 4000.0, 30e-6, rng), (3, (1.0, 0.5), b"\x01\x04sync"))
        right, *parts_b = self.rig(11, "right", "finger", "slide", Rig(0, -123.4, -12e-6, rng), (0, (1e300, 0.5), b""))
        pieces = [piece for pair in zip(parts_a[1], parts_b[1]) for piece in pair]
        pieces += [piece for pair in zip(parts_b[2], parts_a[2]) for piece in pair]
        other = b"<info><name>eeg</name><type>EEG</type><channel_count>1</channel_count><nominal_srate>100</nominal_srate>" \
                b"<channel_format>float32</channel_format></info>"
        pathlib.Path(self.lab).write_bytes(b"XDF:" + chunk(1, b"<info><version>1.0</version></info>")
                                           + chunk(2, struct.pack("<I", 99) + other) + parts_a[0] + parts_b[0] + b"".join(pieces))
        return left, right

    def test_one_rig_is_chosen(self):
        left, right = self.record()
        self.assertIn(f"is a recording of the rigs left, right: choose one, {self.lab}@left",
                      self.merkel("inspect", "session", self.lab, exit_code=2))
        self.assertIn("has no rig middle, but left, right: choose one",
                      self.merkel("export", self.lab + "@middle", "--sink", "csv:" + self.path("m.csv"), exit_code=2))
        shown = self.merkel("inspect", "session", self.lab + "@left")
        self.assertIn(f"stream spikes,{len(left.spikes)}\n", shown)
        self.assertIn(f"stream samples,{len(left.samples)}\n", shown)
        self.assertIn("stream marks,1\n", shown)
        self.assertIn("leave out @left", self.merkel("inspect", "session", self.path("left.xdf") + "@left", exit_code=2))

    def test_times_are_on_the_recorders_clock(self):
        recorded = dict(zip(("left", "right"), self.record()))
        streams = merkel.load_streams(self.lab)  # as pyxdf reads them
        for name, run in recorded.items():
            session = merkel.load(f"{self.lab}@{name}")
            start = int(session.facts["start_device_ns"]) * 1e-9
            np.testing.assert_allclose(session.spikes["time_s"] + start, streams[name].time_s[:-1], rtol=0, atol=1e-6)
            np.testing.assert_array_equal(session.spikes["neuron"], run.spikes["neuron"])
            np.testing.assert_array_equal(session.samples["depth_mm"], run.samples["depth_mm"])
            self.assertEqual(len(session.afferents), len(run.afferents))
            self.assertEqual([label for _, label in session.marks], ["sync"])
            self.assertLess(np.abs(session.spikes["time_s"] - run.spikes["time_s"]).max(), 1e-4)  # one zero for all rigs

    def test_export_merge_and_replay_take_a_rig(self):
        left, right = self.record()
        self.merkel("export", self.lab + "@right", "--sink", "csv:" + self.path("r.csv"), "--sink", "nwb:" + self.path("r.nwb"))
        times = np.genfromtxt(self.path("r.csv"), delimiter=",", names=True)
        np.testing.assert_array_equal(times["neuron"], right.spikes["neuron"])
        said = self.merkel("merge", self.lab + "@left", self.lab + "@right", "--sink", "csv:" + self.path("all.csv"))
        self.assertIn("by the same recorder", said)
        self.assertIn(f"{len(left.spikes) + len(right.spikes)} spikes", said)
        self.assertIn("would destroy its input", self.merkel("export", self.lab + "@left", "--sink", "csv:" + self.lab, "--overwrite", exit_code=2))
        again = self.merkel("replay", self.lab + "@left", "--sink", "csv:" + self.path("again.csv"))
        self.assertIn(f"press runs through its scene again; the rig itself sent {len(left.spikes)} spikes", again)
        spikes = np.genfromtxt(self.path("again.csv"), delimiter=",", names=True)
        self.assertLess(abs(len(spikes) - len(left.spikes)), 0.2 * len(left.spikes))
        advice = self.merkel("replay", self.lab + "@left", "--realtime", "--sink", "csv:" + self.path("played.csv"), exit_code=2)
        self.assertIn(f"merkel replay '{self.lab}@left' --sink 'xdf:left.xdf', and play that", advice)
        self.merkel("replay", self.lab + "@left", "--sink", "xdf:" + self.path("made.xdf"))
        self.merkel("replay", self.path("made.xdf"), "--realtime", "--sink", "csv:" + self.path("played.csv"))
        np.testing.assert_array_equal(np.genfromtxt(self.path("played.csv"), delimiter=",", names=True), spikes)
        self.assertIn("bit-identical", self.merkel("replay", self.path("made.xdf")))

    def test_a_batch_takes_a_rig_and_runs_it_again_when_its_file_has_changed(self):
        left, _ = self.record()
        out, job = self.path("out"), {"probe": f"replay:{self.lab}@left"}
        [row] = merkel.batch([job], out=out, keep="table", cores=1).rows
        self.assertEqual((row["status"], row["error"]), ("done", ""))
        self.assertLess(abs(row["spikes"] - len(left.spikes)), 0.2 * len(left.spikes))
        with open(self.lab, "ab") as file:
            file.write(chunk(5, bytes(16)))
        self.assertNotEqual(merkel.batch([job], out=out, keep="table", cores=1).rows[0]["id"], row["id"])

    def test_damaged_recordings_are_errors(self):
        self.record()
        data, rng = pathlib.Path(self.lab).read_bytes(), np.random.default_rng(2)
        for _ in range(60):
            damaged = bytearray(data[:int(rng.integers(len(data) // 2, len(data)))])
            for place in rng.integers(4, len(damaged), 4):
                damaged[place] = rng.integers(256)
            pathlib.Path(self.path("d.xdf")).write_bytes(damaged)
            done = subprocess.run([PROGRAM, "inspect", "session", self.path("d.xdf@left")], capture_output=True, text=True)
            self.assertIn(done.returncode, (0, 2), done.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
