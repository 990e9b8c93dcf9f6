#!/usr/bin/env python3
"""A recording that LabRecorder makes of two rigs, in processes with clocks of their own; where pyxdf is installed,
compared with it. Run where merkel was built with liblsl and LabRecorderCLI is found (in PATH, or named in
MERKEL_LABRECORDER); https://github.com/labstreaminglayer/App-LabRecorder/releases."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import merkel
import numpy as np

PROGRAM = os.environ["MERKEL_PROGRAM"]
RECORDER = os.environ.get("MERKEL_LABRECORDER") or shutil.which("LabRecorderCLI")
AHEAD_S = {"left": 100_000, "right": 4000}  # of the recorder's clock
RIG = """
import sys, time, merkel
name, scene, press, session = sys.argv[1:]
with merkel.connect(press, scene, sinks=[f"lsl:{name}?wait_s=60", "xdf:" + session], allow_remote=True) as bridge:
    for moment in range(3):
        time.sleep(4)
        bridge.mark(f"sync {moment}")
"""
# Streams of this machine only.
CONFIGURATION = "[ports]\nIPv6 = disable\n[multicast]\nResolveScope = machine\nInterfaces = {127.0.0.1}\n[lab]\nKnownPeers = {127.0.0.1}\n[log]\nlevel = -2\n"


def own_clock(ahead_s):
    """The command for a process whose monotonic clock is ahead; nothing where the system has no such thing."""
    command = ["unshare", "--time", "--monotonic", str(ahead_s), "--fork", "--kill-child"]
    try:
        return command if subprocess.run([*command, "true"], capture_output=True).returncode == 0 else []
    except OSError:
        return []


class LabRecorder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.file = str(cls.folder / "lab.xdf")
        (cls.folder / "lsl_api.cfg").write_text(CONFIGURATION)
        environment = {**os.environ, "LSLAPICFG": str(cls.folder / "lsl_api.cfg")}
        cls.names = {rig: f"{rig}-{os.getpid()}" for rig in AHEAD_S}
        cls.ahead_s, rigs = {}, []
        for rig, scene, press in (("left", "finger", "sim:taps?count=100&interval_s=0.3&live=1"),
                                  ("right", "paper", "sim:sine?frequency_hz=3&hold_s=30&live=1")):
            command = own_clock(AHEAD_S[rig])
            cls.ahead_s[rig] = AHEAD_S[rig] if command else 0
            rigs.append(subprocess.Popen([*command, sys.executable, "-c", RIG, cls.names[rig], scene, press,
                                          str(cls.folder / f"{rig}.xdf")], env=environment, stderr=subprocess.PIPE, text=True))
            cls.addClassCleanup(lambda rig=rigs[-1]: (rig.kill(), rig.communicate()))
        queries = [f"name='{name}{part}'" for name in cls.names.values() for part in ("", ".samples", ".marks")]
        recorder, deadline = None, time.monotonic() + 60
        while recorder is None:  # it looks for a second, and ends if one is missing
            for rig in rigs:
                if rig.poll() is not None:
                    raise AssertionError(rig.stderr.read())
            if time.monotonic() > deadline:
                raise AssertionError("LabRecorder did not find the six streams")
            trial = subprocess.Popen([RECORDER, cls.file, *queries], env=environment, stdin=subprocess.PIPE,
                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            if any(line.startswith("Starting") for line in trial.stdout):
                recorder = trial
            else:
                trial.communicate(timeout=60)
        cls.addClassCleanup(lambda: (recorder.kill(), recorder.communicate()))
        errors = [rig.communicate(timeout=120)[1] for rig in rigs]
        if any(rig.returncode for rig in rigs):
            raise AssertionError("".join(errors))
        recorder.communicate("\n", timeout=60)

    def merkel(self, *arguments, exit_code=0):
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        return done.stdout + done.stderr

    def test_each_rig_is_there_on_the_recorders_clock(self):
        for rig, name in self.names.items():
            own, lab = merkel.load(str(self.folder / f"{rig}.xdf")), merkel.load(f"{self.file}@{name}")
            spikes = lab.spikes
            np.testing.assert_array_equal(spikes["neuron"], own.spikes["neuron"])
            self.assertGreater(len(own.spikes), 500)
            self.assertEqual([label for _, label in lab.marks], [f"sync {n}" for n in range(3)])
            self.assertEqual(len(lab.afferents), len(own.afferents))
            start_ns = int(lab.facts["start_device_ns"]) - int(own.facts["start_device_ns"]) + self.ahead_s[rig] * 10**9
            error_s = spikes["time_s"] + start_ns * 1e-9 - own.spikes["time_s"]
            print(f"{rig}: {len(spikes)} spikes, its clock ahead by {self.ahead_s[rig]} s: "
                  f"times differ by {1e6 * np.median(error_s):+.1f} µs, at most {1e6 * np.abs(error_s).max():.1f} µs; "
                  f"residual of the offsets {int(lab.facts['clock_error_ns']) / 1000} µs", flush=True)
            self.assertLess(np.abs(error_s).max(), 2e-3)  # of LSL's offsets, on a busy machine
            # LabRecorder opens the stream of the samples a moment after that of the spikes.
            first = np.abs(own.samples["time_s"] - lab.samples["time_s"][0] - start_ns * 1e-9).argmin()
            self.assertLess(first, 0.1 * len(own.samples))
            np.testing.assert_array_equal(lab.samples["depth_mm"], own.samples["depth_mm"][first:])

    def test_times_are_those_of_pyxdf(self):
        try:
            import pyxdf
        except ImportError as error:
            self.skipTest(str(error))
        theirs = {each["info"]["name"][0]: each for each in pyxdf.load_xdf(self.file, dejitter_timestamps=False)[0]}
        streams = merkel.load_streams(self.file)
        self.assertEqual(sorted(theirs), sorted(streams))
        for name in self.names.values():
            lab = merkel.load(f"{self.file}@{name}")
            start_s = int(lab.facts["start_device_ns"]) * 1e-9
            for part, times in (("", lab.spikes["time_s"] + start_s), (".samples", lab.samples["time_s"] + start_s),
                                (".marks", [moment + start_s for moment, _ in lab.marks])):
                # Behind these are the mark of the end and what liblsl sends while its outlets close.
                np.testing.assert_allclose(times, theirs[name + part]["time_stamps"][:len(times)], rtol=0, atol=1e-6)
                np.testing.assert_allclose(streams[name + part].time_s, theirs[name + part]["time_stamps"], rtol=0, atol=1e-6)
            np.testing.assert_array_equal(theirs[name]["time_series"][:len(lab.spikes), 0], lab.spikes["neuron"])
            self.assertEqual(theirs[name + ".marks"]["time_series"][len(lab.marks)], ["merkel: end of run"])

    def test_inspect_export_merge_and_replay_take_a_rig(self):
        left, right = (f"{self.file}@{name}" for name in self.names.values())
        spikes = merkel.load(left).spikes
        self.assertIn("choose one", self.merkel("inspect", "session", self.file, exit_code=2))
        self.assertIn(f"stream spikes,{len(spikes)}\n", self.merkel("inspect", "session", left))
        csv = str(self.folder / "left.csv")
        self.merkel("export", left, "--sink", "csv:" + csv)
        np.testing.assert_array_equal(np.genfromtxt(csv, delimiter=",", names=True)["neuron"], spikes["neuron"])
        self.assertIn("by the same recorder", self.merkel("merge", left, right, "--sink", "csv:" + csv, "--overwrite"))
        self.merkel("replay", left, "--sink", "csv:" + csv, "--overwrite")
        again = np.genfromtxt(csv, delimiter=",", names=True)
        self.assertLess(abs(len(again) - len(spikes)), 0.05 * len(spikes))


if __name__ == "__main__":
    if not RECORDER:
        print("Skipped: no LabRecorderCLI: put one into PATH, or name it in MERKEL_LABRECORDER")
        sys.exit(77)
    unittest.main(verbosity=2)
