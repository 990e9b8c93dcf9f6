"""merkel.load_streams: LabRecorder files of several rigs on one clock, as pyxdf reads them."""
import os
import pathlib
import struct
import sys
import tempfile
import unittest

import merkel
import numpy as np


def chunk(tag, content):
    content = struct.pack("<H", tag) + content
    return b"\x04" + struct.pack("<I", len(content)) + content


def header(number, name, host, kind, channels, rate=0):
    text = (f"<info><name>{name}</name><type>x</type><channel_count>{channels}</channel_count><nominal_srate>{rate}</nominal_srate>"
            f"<channel_format>{kind}</channel_format><hostname>{host}</hostname></info>")
    return chunk(2, struct.pack("<I", number) + text.encode())


class Rig:
    """A rig whose clock is `ahead` of the recorder's and runs faster by `drift`."""

    def __init__(self, number, ahead, drift, rng):
        self.number, self.ahead, self.drift, self.rng = number, ahead, drift, rng

    def clock(self, recorder_s):
        return recorder_s * (1 + self.drift) + self.ahead

    def offsets(self, times, wild=()):
        """LSL measures the recorder's clock minus the rig's, a little wrong, and sometimes very wrong."""
        for i, recorder_s in enumerate(times):
            error = 2e-5 * self.rng.standard_normal() + (0.02 if i in wild else 0)
            own = self.clock(recorder_s)
            yield chunk(4, struct.pack("<Idd", self.number, own, recorder_s - own + error))

    def samples(self, times, values, kind):
        rows = b"".join(b"\x08" + struct.pack("<d", self.clock(t)) + struct.pack("<" + kind, v) for t, v in zip(times, values))
        return chunk(3, struct.pack("<I", self.number) + b"\x04" + struct.pack("<I", len(times)) + rows)


class Streams(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "lab.xdf")

    def record(self, wild=()):
        """Two rigs and a stream of marks, which see the same events; returns the events' times."""
        rng = np.random.default_rng(3)
        times = np.sort(rng.uniform(1000, 1600, 500))
        left, right = Rig(1, 4000.0, 30e-6, rng), Rig(2, -123.4, -12e-6, rng)
        marks = chunk(3, struct.pack("<I", 3) + b"\x01\x02" + b"".join(
            b"\x08" + struct.pack("<d", t) + b"\x01\x04" + text for t, text in ((times[0], b"sync"), (times[9], b"stop"))))
        regular = chunk(3, struct.pack("<I", 4) + b"\x01\x03" + b"\x08" + struct.pack("<df", 5.0, 0.5)
                        + b"\x00" + struct.pack("<f", 1.5) + b"\x00" + struct.pack("<f", 2.5))
        pathlib.Path(self.file).write_bytes(
            b"XDF:" + chunk(1, b"<info><version>1.0</version></info>")
            + header(1, "left", "rig-1", "int32", 1) + header(2, "right", "rig-2", "int32", 1)
            + header(3, "marks", "desk", "string", 1) + header(4, "force", "desk", "float32", 1, 100)
            + b"".join(left.offsets(np.arange(1000, 1600, 5.0), wild)) + b"".join(right.offsets(np.arange(1000, 1600, 5.0), wild))
            + left.samples(times, range(1, 501), "i") + right.samples(times, range(501, 1001), "i") + marks + regular)
        return times

    def test_rigs_are_on_one_clock(self):
        times = self.record(wild=(3, 50))
        streams = merkel.load_streams(self.file)
        self.assertEqual(sorted(streams), ["force", "left", "marks", "right"])
        for name, first in (("left", 1), ("right", 501)):
            self.assertLess(np.abs(streams[name].time_s - times).max(), 2e-5)
            self.assertEqual(streams[name].values[0, 0], first)
            self.assertLess(streams[name].clock_error_s, 1e-4)
        self.assertEqual(streams["left"].host, "rig-1")
        self.assertEqual(streams["marks"].values, [["sync"], ["stop"]])
        np.testing.assert_allclose(streams["force"].time_s, [5, 5.01, 5.02])
        np.testing.assert_array_equal(streams["force"].values[:, 0], [0.5, 1.5, 2.5])

    def test_times_are_those_of_pyxdf_within_a_microsecond(self):
        try:
            import pyxdf
        except ImportError as error:
            self.skipTest(str(error))
        self.record(wild=(3, 50))
        own = merkel.load_streams(self.file)
        theirs, _ = pyxdf.load_xdf(self.file, dejitter_timestamps=False)
        for stream in theirs:
            if stream["info"]["name"][0] in ("left", "right"):
                np.testing.assert_allclose(own[stream["info"]["name"][0]].time_s, stream["time_stamps"], rtol=0, atol=1e-6)

    def test_a_session_of_merkel_is_read_too(self):
        session = self.file + ".merkel.xdf"
        run = merkel.Scene("paper").run(probe="replay:tests/traces/taps.csv", sinks=["xdf:" + session])
        stream = merkel.load_streams(session)["merkel.spikes"]
        np.testing.assert_allclose(stream.time_s, run.spikes["time_s"], atol=1e-9)

    def test_a_clock_that_was_reset_is_an_error(self):
        rig = Rig(1, 4000.0, 0.0, np.random.default_rng(1))
        before = list(rig.offsets(np.arange(1000, 1100, 5.0)))
        rig.ahead = 20.0
        pathlib.Path(self.file).write_bytes(b"XDF:" + header(1, "left", "rig-1", "int32", 1)
                                            + b"".join(before) + b"".join(rig.offsets(np.arange(1100, 1200, 5.0))))
        with self.assertRaisesRegex(merkel.Error, "the clock of left was reset during the recording"):
            merkel.load_streams(self.file)

    def test_chunks_longer_than_those_of_a_session_are_read(self):
        values = np.arange(2_000_000, dtype="<i4")
        rows = np.zeros(values.size, np.dtype([("flag", "u1"), ("stamp", "<f8"), ("value", "<i4")]))
        rows["flag"], rows["stamp"], rows["value"] = 8, values, values
        pathlib.Path(self.file).write_bytes(b"XDF:" + header(1, "long", "desk", "int32", 1) + chunk(
            3, struct.pack("<I", 1) + b"\x04" + struct.pack("<I", values.size) + rows.tobytes()))
        stream = merkel.load_streams(self.file)["long"]
        np.testing.assert_array_equal(stream.time_s, values)
        np.testing.assert_array_equal(stream.values[:, 0], values)

    def test_damaged_files_are_errors(self):
        self.record()
        data = pathlib.Path(self.file).read_bytes()
        broken = pathlib.Path(self.file + ".broken")
        rng = np.random.default_rng(1)
        for _ in range(300):
            cut = bytearray(data[:int(rng.integers(len(data)))])
            for place in rng.integers(4, max(5, len(cut)), 3):
                if place < len(cut):
                    cut[place] = rng.integers(256)
            broken.write_bytes(cut)
            try:
                merkel.load_streams(broken)
            except merkel.Error as error:
                self.assertRegex(str(error), "is damaged|does not start with|was reset")
        with self.assertRaisesRegex(merkel.Error, "cannot read"):
            merkel.load_streams("none.xdf")


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
