"""merkel.trials(): recordings that Neo itself writes, and arrays, as presses for `merkel score`."""
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import merkel
import numpy as np

try:
    import neo
    import quantities as pq
except ImportError:
    neo = None

NEWTONS_PER_VOLT, RATE_HZ, REST_V = 0.17553, 4000, 0.31


def force_N(peak_N, trial=0):
    """Two seconds of a ramp and hold, with the noise of a trial, from 0.4 s on."""
    time_s = np.arange(2 * RATE_HZ) / RATE_HZ
    noise = 0.002 * peak_N * np.random.default_rng(trial).standard_normal(len(time_s))
    return peak_N * np.clip(np.minimum(time_s - 0.4, 1.6 - time_s) / 0.1, 0, 1) + noise


def spikes_s(peak_N, trial):
    """Spikes of the hold, each trial 3 ms after the one before."""
    return 0.45 + 0.003 * trial + np.arange(0, 1.0, 0.05 / peak_N)


def block(begin_s=7.0):
    """Six segments: three trials of 0.5 N and of 1 N in turn."""
    made = neo.Block(name="rig")
    for number in range(6):
        peak_N, trial = (0.5, 1.0)[number % 2], number // 2
        segment = neo.Segment(name=f"trial {number}")
        volts = REST_V + force_N(peak_N, number) / NEWTONS_PER_VOLT
        for name, signal in (("temperature", np.full_like(volts, 2.5)), ("ch3", volts)):
            segment.analogsignals.append(neo.AnalogSignal(1e3 * signal[:, None], units="mV", name=name, t_start=begin_s * pq.s,
                                                          sampling_rate=RATE_HZ * pq.Hz))
        segment.spiketrains.append(neo.SpikeTrain((begin_s + spikes_s(peak_N, trial)) * pq.s, t_start=begin_s * pq.s,
                                                  t_stop=(begin_s + 2) * pq.s, name="unit 1"))
        made.segments.append(segment)
    return made


class Trials(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expect_the_presses(self, found):
        self.assertEqual([len(press.spike_times_s) for press in found], [3, 3])
        for press, peak_N in zip(found, (0.5, 1.0)):
            self.assertEqual(press.unit, "N")
            self.assertAlmostEqual(press.level.max(), peak_N, delta=0.01 * peak_N)
            self.assertAlmostEqual(press.level[0], 0.0, delta=0.01 * peak_N)
            self.assertLess(press.deviation, 0.02 * peak_N)
            # The first sample is what it is: the times of the spikes since the onset tell.
            onset_s = press.time_s[np.argmax(press.level > 0.5 * peak_N)]
            for trial, times in enumerate(press.spike_times_s):
                expected = spikes_s(peak_N, trial)
                self.assertEqual(len(times), len(expected))
                np.testing.assert_allclose(times - onset_s, expected - 0.45, atol=0.002)
                np.testing.assert_allclose(np.diff(times), np.diff(expected), atol=1e-9)

    @unittest.skipIf(neo is None, "python3-neo is not installed")
    def test_a_block_becomes_its_presses(self):
        found = merkel.trials(block(), force="ch3", newtons_per_volt=NEWTONS_PER_VOLT)
        self.expect_the_presses(found)
        again = merkel.trials(block().segments, force="ch3", newtons_per_volt=NEWTONS_PER_VOLT, spikes="unit 1")
        self.assertEqual([len(press.spike_times_s) for press in again], [3, 3])

    def test_arrays_of_one_long_recording_are_cut_into_their_presses(self):
        peaks = [0.5, 1.0] * 3
        level = np.concatenate([force_N(peak, number) for number, peak in enumerate(peaks)]) + 3.0
        times = np.concatenate([2.0 * number + spikes_s(peak, number // 2) for number, peak in enumerate(peaks)])
        self.expect_the_presses(merkel.trials({"force_N": level, "rate_hz": RATE_HZ, "spikes_s": times}))
        deep = merkel.trials([{"depth_mm": 2.0 * force_N(0.5), "rate_hz": RATE_HZ, "spikes_s": []}])
        self.assertEqual((deep[0].unit, len(deep[0].spike_times_s[0])), ("mm", 0))

    @unittest.skipIf(neo is None, "python3-neo is not installed")
    def test_a_folder_that_neo_wrote_is_scored_press_by_press(self):
        data, out = self.folder / "data", self.folder / "out"
        for name, writer in (("rig.mat", neo.io.NeoMatlabIO), ("rig.pkl", neo.io.PickleIO)):
            with self.subTest(name):
                data.mkdir()
                writer(str(data / name)).write_block(block())
                command = [sys.executable, "-W", "error::RuntimeWarning", "-m", "merkel.trials", str(data), "--force", "ch3",
                           "--newtons-per-volt", str(NEWTONS_PER_VOLT), "--out", str(out), "--score", "goodwin", "--trials", "5", "--overwrite"]
                if name.endswith(".pkl"):
                    refused = subprocess.run(command, capture_output=True, text=True)
                    self.assertEqual(refused.returncode, 2)
                    self.assertIn("--allow-pickle", refused.stderr)
                    command.append("--allow-pickle")
                done = subprocess.run(command, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                self.assertIn("press 2: 1", done.stdout)
                recordings = json.loads((out / "recordings.json").read_text())
                self.assertEqual([len(section["spike_times_s"]) for section in recordings["trials"]], [3, 3])
                self.assertIn("### press 2: 3 recorded trials, 5 of the model", (out / "score/score.md").read_text())
                with open(out / "score/distances.csv") as file:
                    rows = list(csv.DictReader(file))
                self.assertEqual(len(rows), 4)
                for row in rows:
                    self.assertGreater(float(row["model_to_recorded"]), float(row["recorded_to_recorded"]))
                # Victor-Purpura at 100/s: moving a spike by 3 or 6 ms costs 0.3 or 0.6.
                moved = len(spikes_s(0.5, 0)) * (2 * 0.3 + 0.6) / 3
                self.assertAlmostEqual(float(rows[0]["recorded_to_recorded"]), moved, places=6)
                for file in list(data.iterdir()):
                    file.unlink()
                data.rmdir()

    def test_one_recorded_trial_has_no_yardstick_but_a_score(self):
        made = merkel.trials({"force_N": force_N(0.5), "rate_hz": RATE_HZ, "spikes_s": spikes_s(0.5, 0)}, tip="pin",
                             probe_diameter_mm=1.0)
        path = made.write(self.folder)
        with self.assertRaisesRegex(merkel.Error, "exists"):
            made.write(self.folder)
        done = subprocess.run([os.environ["MERKEL_PROGRAM"], "score", "goodwin", "--data", path, "--trials", "3", "--out",
                               str(self.folder / "score")], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        fitted = merkel.fit("goodwin", data=path, parameters=["gain_Hz_per_kPa"], trials=2, evaluations=5)
        self.assertLessEqual(fitted.cost_after, fitted.cost_before)

    @unittest.skipIf(neo is None, "python3-neo is not installed")
    def test_what_is_missing_is_said(self):
        for words, options in (("there is no analog channel 'ch9'.*temperature, ch3", {"force": "ch9"}),
                               ("is in mV.*pass newtons_per_volt", {"force": "ch3"}),
                               ("no press", {"force": "temperature", "newtons_per_volt": 1.0}),
                               ("choose a spike train", {"force": "ch3", "newtons_per_volt": 1.0, "spikes": "unit 2"}),
                               ("there is no analog channel None", {})):
            with self.assertRaisesRegex(merkel.Error, words):
                merkel.trials(block(), **options)
        celsius = neo.Segment()
        celsius.analogsignals.append(neo.AnalogSignal(np.zeros((9, 1)), units="K", name="t", sampling_rate=9 * pq.Hz))
        with self.assertRaisesRegex(merkel.Error, "neither N nor V"):
            merkel.trials(celsius, force="t")
        with self.assertRaisesRegex(merkel.Error, "Neo's segments or dicts"):
            merkel.trials(5)
        with self.assertRaisesRegex(merkel.Error, "not force_mN"):
            merkel.trials({"force_mN": [], "rate_hz": 1, "spikes_s": []})
        with self.assertRaisesRegex(merkel.Error, "finite"):
            merkel.trials({"force_N": [0.0, np.nan], "rate_hz": 1, "spikes_s": []})
        (self.folder / "notes.txt2").write_text("nothing")
        done = subprocess.run([sys.executable, "-m", "merkel.trials", str(self.folder), "--force", "ch3"], capture_output=True,
                              text=True)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("notes.txt2 (no format of Neo)", done.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
