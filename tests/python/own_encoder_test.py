"""An encoder written in Python: drives from outside, within the limits of the scene."""
import os
import pathlib
import tempfile
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
        with self.assertRaisesRegex(merkel.Error, "Stream.set_drive"):
            merkel.Scene(self.path).run()


if __name__ == "__main__":
    unittest.main()
