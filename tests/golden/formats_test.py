#!/usr/bin/env python3
"""Files that earlier versions wrote stay readable, and a version does not change its formats: formats_test.py PROGRAM

Each folder VERSION beside this script holds one press, written by that version: the scene, the trace, spikes (CSV and
GDF), commands, the session, and the bytes of an HBF1 device (frames.xdf, which a test of merkel_tools_tests parses). They
are never written again. A folder for a new version: formats_test.py PROGRAM --write FOLDER
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
VERSIONS = sorted(folder for folder in HERE.iterdir() if folder.is_dir())
PRESS = "sim:taps?count=1&depth_mm=1.5&wait_s=0.05&tail_s=0.05&interval_s=0.05"
TEXTS = {"spikes.csv": "csv", "spikes.gdf": "gdf", "commands.csv": "stim-csv", "trace.csv": "trace"}

# A press has samples of these.
STREAMS = {b"samples", b"sample_states", b"spikes", b"status", b"stimulation", b"ticks", b"tick_states"}


def merkel(*arguments, folder=None):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout + done.stderr


def rows(text):
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def write_press(scene, folder):
    """The files of a folder, except frames.xdf."""
    shutil.copyfile(scene, folder / "scene.toml")
    sinks = [word for file, kind in TEXTS.items() for word in ["--sink", f"{kind}:{file}"]]
    return merkel("run", "scene.toml", "--fast", "--probe", PRESS, *sinks, "--sink", "xdf:session.xdf", folder=folder)


def write_frames(folder):
    device = subprocess.Popen([PROGRAM, "simulate-probe", "hbf1", "--trace", "trace.csv", "--link", "device"],
                              cwd=folder, stdout=subprocess.PIPE)
    try:
        device.stdout.readline()  # the device is there
        return merkel("record", "serial:device?protocol=hbf1", "frames.xdf", "--frames", "--duration-s", "0.15", folder=folder)
    finally:
        device.terminate()
        device.wait()


def layout(session):
    """stream → its type, format and the names and units of its channels, as they are in the file."""
    streams = {}
    for text in re.findall(rb"<\?xml.*?</info>", session.read_bytes(), re.S):
        name = re.search(rb"<info><name>merkel\.(.*?)</name>", text)
        if name:
            channels = re.findall(rb"<label>(.*?)</label>(?:<unit>(.*?)</unit>)?", text)
            streams[name[1]] = (re.findall(rb"<(?:type|channel_format)>.*?<", text), channels)
    return streams


class Formats(unittest.TestCase):
    def each(self):
        self.assertTrue(VERSIONS)
        for folder in VERSIONS:
            with self.subTest(version=folder.name):
                yield folder

    def test_a_session_gives_the_spikes_that_were_written_beside_it(self):
        for folder in self.each():
            for kind in ("csv", "gdf"):
                with tempfile.TemporaryDirectory() as out:
                    code, said = merkel("export", folder / "session.xdf", "--sink", f"{kind}:{out}/spikes.{kind}")
                    self.assertEqual(code, 0, said)
                    self.assertEqual(rows(pathlib.Path(out, f"spikes.{kind}").read_text()),
                                     rows((folder / f"spikes.{kind}").read_text()))

    def test_spike_files_and_commands_equal_those_of_the_session(self):
        for folder in self.each():
            for file in ["spikes.csv", "commands.csv"]:
                code, said = merkel("compare", folder / file, folder / "session.xdf")
                self.assertEqual(code, 0, f"{file}: {said}")

    def test_a_session_has_all_samples_of_the_trace(self):
        for folder in self.each():
            code, said = merkel("inspect", "session", folder / "session.xdf", "--stream", "samples")
            self.assertEqual(code, 0, said)
            self.assertEqual(len(rows(said)), len(rows((folder / "trace.csv").read_text())))

    def test_trace_and_scene_run(self):
        for folder in self.each():
            code, said = merkel("run", folder / "scene.toml", "--fast", "--probe", f"replay:{folder / 'trace.csv'}")
            self.assertEqual(code, 0, said)

    def test_this_version_still_writes_its_formats(self):
        version = re.match(r"merkel (\S+)", merkel("--version")[1])[1]
        golden = HERE / version
        self.assertTrue(golden.is_dir(), f"write the files of {version}: see the head of this script")
        with tempfile.TemporaryDirectory() as out:
            folder = pathlib.Path(out)
            code, said = write_press(golden / "scene.toml", folder)
            self.assertEqual(code, 0, said)
            for file in TEXTS:
                self.assertEqual((folder / file).read_text(), (golden / file).read_text(), f"{file} differs from that of {version}")
            written = layout(folder / "session.xdf")
        self.assertLessEqual(STREAMS, set(layout(golden / "session.xdf")))
        for stream, (kind, channels) in layout(golden / "session.xdf").items():
            if stream not in written:  # a stream without samples is not written
                code, said = merkel("inspect", "session", golden / "session.xdf", "--stream", stream.decode())
                self.assertEqual((code, len(rows(said))), (0, 1), f"{stream}: {said}")
                continue
            self.assertEqual(written[stream][0], kind, stream)
            kept = [channel for channel in written[stream][1] if channel in channels]  # a stream may get further channels
            self.assertEqual(kept, channels, f"the stream {stream} differs from that of {version}")


def write(folder):
    folder.mkdir()
    for code, said in [write_press(HERE / "before-0.1.0/scene.toml", folder), write_frames(folder)]:
        if code != 0:
            sys.exit(said)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--write"]:
        write(pathlib.Path(sys.argv[2]).resolve())
    else:
        unittest.main()
