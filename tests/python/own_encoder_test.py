"""An encoder written in Python: drives from outside, within the limits of the scene."""
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

import merkel

SCENE = """preset = "goodwin"
[[electrode_group]]
name = "tip"
encoder = "own"
frequency_Hz = [50, 100]
[[electrode]]
name = "E1"
group = "tip"
field_mm = [14, 10, 2]
amplitude_uA = [20, 60]
[[electrode]]
name = "E2"
group = "tip"
field_mm = [16, 10, 2]
amplitude_uA = [20, 80]
[[electrode]]
name = "E3"
encoder = "own"
field_mm = [15, 10, 3]
amplitude_uA = [20, 80]
frequency_Hz = [50, 200]
[stimulation]
max_charge_nC = 16
max_total_uA = 250
max_slope_uA_per_s = 4000
watchdog_ms = 100
"""


class OwnEncoder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "scene.toml")
        pathlib.Path(self.path).write_text(SCENE)

    def stimulate(self, rule):
        """All commands of a press of 0.5 N from 0.1 s to 0.4 s, with a rule that maps the force to a drive."""
        stream, commands = merkel.Scene(self.path).stream(), []
        for k in range(600):
            force_N = 0.5 if 100 <= k < 400 else 0.0
            rule(stream, force_N)
            commands += list(stream.push(k / 1000, force_N=force_N, x_mm=15, y_mm=10).stimulation)
        return commands + list(stream.finish().stimulation)

    def test_drives_become_commands_within_the_limits(self):
        def rule(stream, force_N):
            stream.set_drive("E3", 3 * force_N, 1.0)

        commands = [each for each in self.stimulate(rule) if each["electrode"] == 2]
        on = [each for each in commands if each["amplitude_uA"] > 0]
        self.assertEqual(max(each["amplitude_uA"] for each in on), 80)  # the strongest of its range
        self.assertEqual({each["frequency_Hz"] for each in on}, {200})
        self.assertEqual([each["amplitude_uA"] for each in on[:2]], [40, 80])  # 4000 µA/s for 10 ms
        self.assertEqual(commands[-1]["amplitude_uA"], 0)
        self.assertTrue(all(0.09 < each["time_s"] < 0.42 for each in on))

    def test_a_group_has_one_drive(self):
        commands = self.stimulate(lambda stream, force_N: stream.set_drive("E1", force_N))
        pulses = [each for each in commands if each["kind"] == 1]
        self.assertEqual([each["electrode"] for each in pulses], [k % 2 for k in range(len(pulses))])
        self.assertGreater(len(pulses), 40)  # 2 × 75 Hz for 0.3 s
        self.assertEqual(max(each["amplitude_uA"] for each in pulses), 50)

    def test_others_are_refused(self):
        stream = merkel.Scene(self.path).stream()
        with self.assertRaisesRegex(merkel.Error, 'no electrode "E9" with encoder = "own"'):
            stream.set_drive("E9", 0.5)
        with self.assertRaisesRegex(merkel.Error, "the drive of E3 is not a finite number"):
            stream.set_drive("E3", float("nan"))
        with self.assertRaisesRegex(merkel.Error, "scene.stream"):
            merkel.Scene(self.path).run()

    def test_a_drive_holds_for_the_watchdog(self):
        def rule(stream, force_N):
            if stream.time_s is not None and stream.time_s < 0.2:
                stream.set_drive("E3", 1.0)

        commands = [each for each in self.stimulate(rule) if each["electrode"] == 2]
        on = [each["time_s"] for each in commands if each["amplitude_uA"] > 0]
        self.assertTrue(0.28 < max(on) < 0.31)  # 0.2 s and 100 ms

    def test_a_drive_before_the_first_sample_is_kept(self):
        given = []

        def rule(stream, force_N):
            if not given:
                given.append(stream.set_drive("E3", 1.0))

        commands = [each for each in self.stimulate(rule) if each["electrode"] == 2]
        self.assertTrue(any(each["amplitude_uA"] > 0 for each in commands))

    def test_a_live_run_takes_drives_and_its_session_repeats_them(self):
        session, csv = self.path + ".xdf", self.path + ".csv"
        sinks = ["xdf:" + session, "stim-csv:" + csv]
        with merkel.connect("sim:ramp?wait_s=0&hold_s=600&live=1", self.path, sinks=sinks) as bridge:
            with self.assertRaisesRegex(merkel.Error, 'no electrode "E9"'):
                bridge.set_drive("E9", 0.5)
            strongest, deadline = 0, time.monotonic() + 60
            while strongest < 80 and time.monotonic() < deadline:
                bridge.set_drive("E3", 1.0, 0.5)
                bridge.set_drive("E1", 0.5)
                _, commands = bridge.read(0.01)
                strongest = max([strongest, *commands["amplitude_uA"][commands["electrode"] == 2]])
            self.assertEqual(strongest, 80)
            stops = set()
            while 10 not in stops and time.monotonic() < deadline:  # no_drive
                stops |= set(bridge.read(0.01).stimulation["stop"])
            self.assertIn(10, stops)
        with self.assertRaisesRegex(merkel.Error, "the run takes no drives now"):
            for _ in range(10_000):
                bridge.set_drive("E3", 1.0)
        self.assertIn(",no_drive,", pathlib.Path(csv).read_text())
        drives = subprocess.run([os.environ["MERKEL_PROGRAM"], "inspect", "session", session, "--stream", "drives"],
                                capture_output=True, text=True, check=True).stdout.splitlines()
        self.assertGreater(len(drives), 10)
        replay = subprocess.run([os.environ["MERKEL_PROGRAM"], "replay", session], capture_output=True, text=True)
        self.assertEqual(replay.returncode, 0, replay.stdout + replay.stderr)


if __name__ == "__main__":
    unittest.main()
