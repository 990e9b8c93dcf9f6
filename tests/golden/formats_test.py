#!/usr/bin/env python3
"""Files that earlier versions wrote stay readable: formats_test.py PROGRAM

Each folder VERSION beside this script holds one press: the scene, the trace, spikes (CSV and GDF), commands and
the session, written once by that version (`merkel run scene.toml --fast --sink csv:spikes.csv --sink gdf:spikes.gdf
--sink stim-csv:commands.csv --sink trace:trace.csv --sink xdf:session.xdf`). They are never written again.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = sys.argv.pop(1)
VERSIONS = sorted(folder for folder in HERE.iterdir() if re.fullmatch(r"\d+\.\d+\.\d+", folder.name))


def merkel(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def rows(text):
    return [line for line in text.splitlines() if line and not line.startswith("#")]


class Formats(unittest.TestCase):
    def each(self):
        self.assertTrue(VERSIONS)
        for folder in VERSIONS:
            with self.subTest(version=folder.name):
                yield folder

    def test_a_session_gives_the_spikes_that_were_written_beside_it(self):
        for folder in self.each():
            with tempfile.TemporaryDirectory() as out:
                code, said = merkel("export", folder / "session.xdf", "--sink", f"csv:{out}/spikes.csv")
                self.assertEqual(code, 0, said)
                self.assertEqual(rows(pathlib.Path(out, "spikes.csv").read_text()), rows((folder / "spikes.csv").read_text()))

    def test_spike_files_and_commands_equal_those_of_the_session(self):
        for folder in self.each():
            for file in ["spikes.csv", "spikes.gdf", "commands.csv"]:
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


if __name__ == "__main__":
    unittest.main()
