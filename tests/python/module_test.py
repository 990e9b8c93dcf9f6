"""The Python module merkel: what it returns equals what the program writes, to the bit."""
import ast
import copy
import doctest
import gc
import os
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import merkel
import numpy as np

PROGRAM = os.environ["MERKEL_PROGRAM"]
TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools" / "python"


def trace_of(path):
    lines = [line for line in pathlib.Path(path).read_text().splitlines() if not line.startswith("#")]
    return dict(zip(lines[0].split(","), np.loadtxt(lines[1:], delimiter=",").T))


def nanoseconds(time_s):
    return np.round(np.asarray(time_s) * 1e9).astype(np.int64)


class Case(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(self._folder.cleanup)

    def path(self, name):
        return os.path.join(self._folder.name, name)

    def merkel(self, *arguments):
        done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def program_spikes(self, *arguments):
        """(time in ns, neuron) of a fast run of the program."""
        file = self.path("program.csv")
        self.merkel("run", *arguments, "--fast", "--overwrite", "--sink", "csv:" + file)
        rows = [line.split(",") for line in pathlib.Path(file).read_text().splitlines()
                if line[0].isdigit() or line[0] == "-"]
        return [(round(float(time_s) * 1e9), int(neuron)) for time_s, neuron in rows]

    def assert_same(self, spikes, expected):
        self.assertGreater(len(expected), 10)
        self.assertEqual(list(zip(nanoseconds(spikes["time_s"]).tolist(), spikes["neuron"].tolist())), expected)


class Mistakes(Case):
    def test_a_wrong_keyword_is_an_error_with_the_known_ones(self):
        scene = merkel.Scene("paper")
        with self.assertRaisesRegex(merkel.Error, r"run\(\) has no keyword dept_mm; the known ones are depth_mm, force_N, x_mm"):
            scene.run(dept_mm=[0, 1], rate_hz=1000)
        with self.assertRaisesRegex(merkel.Error, r"push\(\) has no keyword dept_mm; the known ones are time_s"):
            scene.stream().push(time_s=0.0, dept_mm=1)
        self.assertEqual(len(scene.run(depth_mm=np.ones(100), rate_hz=1000).rate(bin_s=0.05)), 2)


class Hands(Case):
    def test_connect_takes_a_list_or_a_dict_of_probes(self):
        live = "sim:ramp?depth_mm=1.5&hold_s=0.3&live=1"
        hand = merkel.Scene("hand")
        for probes in ([live] * 6, {patch: live for patch in ("thumb", "index", "middle", "ring", "little", "palm")}):
            with merkel.connect(probes, hand) as bridge:
                patches = {int(patch) for new in bridge for patch in new.spikes["patch"]}
            self.assertEqual(patches, set(range(6)))
        device = merkel.Device("sim:grasp?count=1&live=1")
        with merkel.connect({patch: device[f"{patch}_mm"] for patch in ("thumb", "index", "middle", "ring", "little", "palm")},
                            hand) as bridge:
            self.assertEqual({int(patch) for new in bridge for patch in new.spikes["patch"]}, set(range(6)))
            self.assertEqual(bridge.counters["probe_count"], 6)
        with self.assertRaisesRegex(merkel.Error, "The device has thumb_mm, index_mm"):
            merkel.connect(merkel.Device("sim:grasp")["tumb_N"], "paper")
        with self.assertRaisesRegex(merkel.Error, "no probe of the scene presses on tumb; its probes press on thumb, index"):
            merkel.connect({"tumb": live}, hand)
        with self.assertRaisesRegex(merkel.Error, "simulates the presses on middle, ring, little, palm: give a probe for each, or a scene"):
            merkel.connect({"thumb": "serial:/dev/null?protocol=csv", "index": "serial:/dev/null?protocol=csv"}, hand)
        # Follows the advice.
        with open(self.path("two.toml"), "w") as scene:
            scene.write('preset = "hand"\n[[probe]]\npatch = "thumb"\n[[probe]]\npatch = "palm"\n')
        with merkel.connect({"thumb": live, "palm": live}, self.path("two.toml")) as bridge:
            self.assertEqual({int(patch) for new in bridge for patch in new.spikes["patch"]}, {0, 5})
        with self.assertRaisesRegex(merkel.Error, "the scene has 6 probes, but 1 URI was given"):
            merkel.connect(live, hand)


class Pickles(Case):
    def test_scenes_and_runs_survive_pickle_and_processes(self):
        scene = merkel.Scene("goodwin")
        scene.skin.radius_mm = 8.5
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual(again.text, scene.text)
        self.assertEqual(again.skin.radius_mm, 8.5)
        depth = np.concatenate([np.linspace(0, 1.5, 100), np.full(200, 1.5)])
        run = scene.run(depth_mm=depth, rate_hz=1000)
        same = pickle.loads(pickle.dumps(run))
        self.assertGreater(len(run.spikes), 10)
        np.testing.assert_array_equal(same.spikes, run.spikes)
        np.testing.assert_array_equal(same.afferents, run.afferents)
        self.assertEqual((same.start_s, same.duration_s, same.counters, same.notices),
                         (run.start_s, run.duration_s, run.counters, run.notices))
        np.testing.assert_array_equal(again.run(depth_mm=depth, rate_hz=1000).spikes, run.spikes)


class Runs(Case):
    def test_a_run_of_arrays_equals_the_program_s_run_of_the_same_trace(self):
        for preset, trace in (("paper", "taps"), ("finger", "ramp_and_hold"), ("goodwin", "slide")):
            file = f"tests/traces/{trace}.csv"
            run = merkel.Scene(preset).run(**trace_of(file))
            self.assert_same(run.spikes, self.program_spikes(preset, "--probe", "replay:" + file))

    def test_force_equals_the_program_s_to_the_bit(self):
        time_s = np.arange(300) / 1000
        force_N = 0.9 * np.sin(np.pi * time_s / 0.3) ** 2 + 1e-3 * np.random.default_rng(1).random(300)
        file = self.path("force.csv")
        with open(file, "w") as out:
            out.write("time_s,force_N\n" + "".join(f"{t:.9f},{f!r}\n" for t, f in zip(time_s, force_N.tolist())))
        run = merkel.Scene("finger").run(force_N=force_N, rate_hz=1000)
        self.assert_same(run.spikes, self.program_spikes("finger", "--probe", "replay:" + file))

    def test_a_probe_by_uri_and_a_seed(self):
        uri = "sim:taps?depth_mm=1.2"
        run = merkel.Scene("finger").run(probe=uri, seed=7, duration_s=1.0)
        self.assert_same(run.spikes,
                         self.program_spikes("finger", "--probe", uri, "--seed", "7", "--duration-s", "1"))
        self.assertAlmostEqual(run.duration_s, 1.0)
        self.assertEqual(run.counters["spikes"], len(run.spikes))

    def test_several_probes_take_a_column_each(self):
        scene = merkel.Scene("hand")
        depth_mm = np.zeros((200, scene.probes))
        depth_mm[:, 1] = np.clip(np.arange(200) / 50, 0, 1) * 1.5
        run = scene.run(depth_mm=depth_mm, rate_hz=1000)
        self.assertEqual(set(run.spikes["patch"]), {1})
        with self.assertRaisesRegex(merkel.Error, r"give an array of \(samples, probes\)"):
            scene.run(depth_mm=depth_mm[:, 0], rate_hz=1000)

    def test_rates_count_every_spike_once(self):
        run = merkel.Scene("finger").run(**trace_of("tests/traces/taps.csv"))
        rate = run.rate(bin_s=0.05)
        self.assertEqual(rate.shape[1], len(run.afferents))
        self.assertAlmostEqual(rate.sum() * 0.05, len(run.spikes))
        self.assertAlmostEqual(run.psth(0.05).sum() * 0.05 * len(run.afferents), len(run.spikes))
        busiest = int(np.bincount(run.spikes["neuron"]).argmax())
        self.assertEqual(len(run.times(busiest)), int(rate[:, busiest - 1].sum() * 0.05 + 0.5))
        with self.assertRaisesRegex(merkel.Error, "there is no neuron 0: neurons are numbered from 1"):
            run.times(0)

    def test_sinks_get_the_spikes_too(self):
        file = self.path("s.csv")
        run = merkel.Scene("paper").run(**trace_of("tests/traces/taps.csv"), sinks=["csv:" + file])
        self.assertEqual(sum(line[0].isdigit() for line in pathlib.Path(file).read_text().splitlines()), len(run.spikes))

    def test_what_is_wrong_with_a_press_is_a_sentence(self):
        scene = merkel.Scene("paper")
        press = np.ones(10)
        for arguments, sentence in (
                ({}, None),
                ({"depth_mm": press}, "the times are missing: pass rate_hz, or time_s for each sample"),
                ({"depth_mm": press, "rate_hz": 1000, "time_s": press}, "pass either time_s or rate_hz"),
                ({"depth_mm": [1, np.nan, 1], "rate_hz": 1000}, r"depth_mm\[1\] is nan, not finite"),
                ({"depth_mm": [1, 2e6, 1], "rate_hz": 1000}, r"depth_mm\[1\] is 2e\+06, beyond ±1000: check its unit"),
                ({"depth_mm": press, "time_s": press}, r"time_s\[1\] is 1, not later than the previous sample"),
                ({"depth_mm": press, "x_mm": [1, 2], "rate_hz": 10}, "x_mm has 2 samples, the others have 10"),
                ({"depth_mm": "deep", "rate_hz": 10}, "depth_mm must be an array of numbers"),
                ({"depth_mm": 16 * press, "rate_hz": 10}, "beyond the limit of 15"),
                ({"depth_mm": [], "rate_hz": 10}, "there are no samples"),
                ({"probe": "replay:none.csv"}, "none.csv"),
                ({"probe": "sim:taps", "depth_mm": press, "rate_hz": 10}, "pass either a press or a probe")):
            with self.subTest(sentence=sentence):
                if sentence is None:
                    self.assertGreater(len(scene.run().spikes), 0)  # the scene's own probe
                    continue
                with self.assertRaisesRegex(merkel.Error, sentence):
                    scene.run(**arguments)

    def test_a_press_without_a_press_is_no_press_of_the_scene(self):
        scene = merkel.Scene("paper")
        for given in ({"x_mm": [1, 2], "rate_hz": 100}, {"rate_hz": 100}, {"time_s": [0, 1]}):
            with self.assertRaisesRegex(merkel.Error, "there are no samples: pass depth_mm or force_N"):
                scene.run(**given)
            with self.assertRaisesRegex(merkel.Error, "pass either a press or a probe"):
                scene.run(**given, probe="sim:ramp")

    def test_dates_complex_numbers_and_masked_values_are_no_numbers(self):
        scene, depth_mm = merkel.Scene("paper"), np.linspace(0, 1, 20)
        stamps = np.arange(20).astype("datetime64[ms]")
        with self.assertRaisesRegex(merkel.Error, r"time_s must be an array of numbers: .* but has the dtype datetime64\[ms\]"):
            scene.run(depth_mm=depth_mm, time_s=stamps)
        with self.assertRaisesRegex(merkel.Error, "depth_mm must be an array of numbers: .* but has the dtype complex128"):
            scene.run(depth_mm=depth_mm + 1j, rate_hz=1000)
        masked = np.ma.array(depth_mm, mask=depth_mm > 0.5)
        with self.assertRaisesRegex(merkel.Error, "depth_mm has masked values: remove these samples"):
            scene.run(depth_mm=masked, rate_hz=1000)
        rows = merkel.batch([{"press": {"depth_mm": masked, "rate_hz": 1000}}, {"press": {"depth_mm": depth_mm, "time_s": stamps}},
                             {"press": {"depth_mm": np.ma.array(depth_mm), "force_N": None, "rate_hz": 1000}}], cores=1).rows
        self.assertIn("masked values", rows[0]["error"])
        self.assertIn("datetime64", rows[1]["error"])
        self.assertEqual(rows[2]["spike_hash"], scene.run(depth_mm=depth_mm, rate_hz=1000).spike_hash)

    def test_other_threads_run_meanwhile(self):
        counted = []
        thread = threading.Thread(target=lambda: merkel.Scene("goodwin").run(probe="sim:taps?count=40"))
        thread.start()
        while thread.is_alive():
            counted.append(time.monotonic())
            time.sleep(0.001)
        self.assertGreater(len(counted), 10)


class Streams(Case):
    def test_a_stream_equals_a_run(self):
        for preset, trace in (("paper", "taps"), ("finger", "slide"), ("goodwin", "ramp_and_hold")):
            press = trace_of(f"tests/traces/{trace}.csv")
            scene = merkel.Scene(preset)
            stream = scene.stream()
            time_s = press.pop("time_s")
            spikes = [stream.push(t, **{name: values[i] for name, values in press.items()})
                      for i, t in enumerate(time_s)] + [stream.finish()]
            run = scene.run(time_s=time_s, **press)
            self.assertGreater(len(run.spikes), 10)
            self.assertTrue(np.array_equal(np.concatenate([each.spikes for each in spikes]), run.spikes))

    def test_force_drives_a_stream(self):
        scene = merkel.Scene("finger")
        force_N = np.clip(np.arange(200) / 100, 0, 1)
        stream = scene.stream()
        spikes = [stream.push(i / 1000, force_N=f) for i, f in enumerate(force_N)] + [stream.finish()]
        run = scene.run(force_N=force_N, rate_hz=1000)
        self.assertTrue(np.array_equal(np.concatenate([each.spikes for each in spikes]), run.spikes))

    def test_a_sample_that_cannot_be_is_not_taken(self):
        stream = merkel.Scene("paper").stream()
        stream.push(0.0, depth_mm=0.1)
        for arguments, sentence in (
                ({"time_s": 0.0, "depth_mm": 1}, "push samples in order of time"),
                ({"time_s": 0.1, "depth_mm": float("nan")}, "not finite"),
                ({"time_s": 0.1, "depth_mm": 20}, "beyond the limit of 15"),
                ({"time_s": 0.1}, "pass depth_mm or force_N"),
                ({"time_s": 0.1, "force_N": 1}, "must have the same channels"),
                ({"time_s": float("inf"), "depth_mm": 1}, "finite number of seconds"),
                ({"time_s": 0.1, "depth_mm": 1, "probe": 3}, "there is no probe 3")):
            with self.assertRaisesRegex(merkel.Error, sentence):
                stream.push(**arguments)
        stream.push(0.1, depth_mm=0.2)
        self.assertAlmostEqual(stream.time_s, 0.099)
        stream.finish()
        with self.assertRaisesRegex(merkel.Error, "the stream is finished"):
            stream.push(0.2, depth_mm=1)

    def test_a_stream_outlives_its_scene(self):
        stream = merkel.Scene("paper").stream()
        gc.collect()
        spikes, stimulation = stream.push(0.0, depth_mm=0.0)
        self.assertEqual((len(spikes), len(stimulation)), (0, 0))


ELECTRODES = """
preset = "finger"
[[electrode]]
name = "rate"
field_mm = [15, 10, 4]
encoder = "rate"
full_rate_Hz = 50
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[stimulation]
update_ms = 10
phase_us = 200
max_charge_nC = 16
max_total_uA = 250
watchdog_ms = 100
max_slope_uA_per_s = 20000
"""


class Stimulation(Case):
    def test_runs_streams_and_sessions_have_the_same_commands(self):
        scene = merkel.Scene.from_text(ELECTRODES)
        press = trace_of("tests/traces/taps.csv")
        file = self.path("s.xdf")
        run = scene.run(**press, sinks=["xdf:" + file])
        self.assertGreater(run.stimulation["amplitude_uA"].max(), 20)
        self.assertLessEqual(run.stimulation["amplitude_uA"].max(), 80)
        self.assertEqual(set(run.stimulation["electrode"]), {0})
        self.assertTrue(np.array_equal(merkel.load(file).stimulation, run.stimulation))
        stream = scene.stream()
        pushed = [stream.push(time_s, depth_mm=press["depth_mm"][i], force_N=press["force_N"][i])
                  for i, time_s in enumerate(press["time_s"])] + [stream.finish()]
        self.assertTrue(np.array_equal(np.concatenate([each.stimulation for each in pushed]), run.stimulation))
        self.assertTrue(np.array_equal(np.concatenate([each.spikes for each in pushed]), run.spikes))
        self.assertEqual(len(merkel.Scene("finger").run(**press).stimulation), 0)


class TactileArrays(Case):
    def test_a_session_has_the_pressures_of_every_tick(self):
        scene = merkel.Scene.from_text(
            'preset = "goodwin"\n[probe]\nuri = "sim:pad?columns=8&rows=5&count=1&tail_s=0.1"\n'
            'tip = "taxels"\ntaxel_columns = 8\ntaxel_rows = 5\n')
        file = self.path("array.xdf")
        run = scene.run(sinks=["xdf:" + file])
        self.assertGreater(len(run.spikes), 50)
        session = merkel.load(file)
        self.assertEqual(list(session.taxels), [0])
        pressures = session.taxels[0]
        self.assertEqual(pressures.shape, (len(session.ticks), 40))
        np.testing.assert_allclose(pressures.sum(axis=1) * 1e-3, session.ticks["force_N"], atol=1e-5)
        self.assertGreater(pressures.max(), 25)
        again = session.scene.run(probe="replay:" + file)
        np.testing.assert_array_equal(again.spikes, run.spikes)


class Scenes(Case):
    def test_keys_are_read_and_set(self):
        scene = merkel.Scene("finger")
        self.assertEqual(scene["skin.radius_mm"], scene.skin.radius_mm)
        scene["skin.radius_mm"] = 8
        scene.probe.x_mm = 14.5
        self.assertEqual(scene.skin.radius_mm, 8.0)
        self.assertIn("radius_mm = 8 ", scene.text)
        self.assertEqual(scene["probe[0].x_mm"], 14.5)
        self.assertIsNone(scene["loop.stale_after_ms"])
        scene["loop.tick_ms" if "loop.tick_ms" in scene.keys() else "loop.tick_us"] = 1000
        self.assertIn("radius_mm", dir(scene.skin))
        other = merkel.Scene.from_text(scene.text)
        self.assertTrue(all(repr(other[key]) == repr(scene[key]) for key in scene.keys()))
        copied = copy.copy(scene)
        copied["skin.radius_mm"] = 9
        self.assertEqual(scene.skin.radius_mm, 8.0)

    def test_values_of_numpy_are_numbers_in_keys_and_overrides(self):
        values = {"skin.radius_mm": np.float32(8), "accuracy.freeze_resting": np.bool_(False), "loop.threads": np.int16(1),
                  "skin.apex_mm": np.array([15.0, 10.0]), "receptors.centres_mm": [(1, np.float64(2.5))]}
        scene = merkel.Scene("goodwin", overrides=values)
        same = merkel.Scene("goodwin", overrides={"skin.apex_mm": (15, 10)})
        for key, value in values.items():
            same[key] = value
            self.assertEqual(repr(same[key]), repr(scene[key]), key)
        self.assertEqual(scene["skin.apex_mm"], (15.0, 10.0))
        with self.assertRaisesRegex(merkel.Error, "overrides must be a dict"):
            merkel.Scene("goodwin", overrides=5)

    def test_the_scene_of_a_session_keeps_the_heights_of_its_shapes(self):
        shape, scene, session = (self.path(name) for name in ("shape.csv", "shape.toml", "s.xdf"))
        heights = np.add.outer(np.arange(-2, 2.1, 0.2)**2, np.arange(-2, 2.1, 0.2)**2) / 4
        np.savetxt(shape, heights, delimiter=",")
        pathlib.Path(scene).write_text('preset = "goodwin"\n[[probe]]\ntip = "shape"\nshape = "shape.csv"\npixel_mm = 0.2\n'
                                       'uri = "sim:ramp?depth_mm=1&hold_s=0.3"\n')
        recorded = merkel.Scene(scene).run(sinks=["xdf:" + session])
        np.savetxt(shape, heights / 5, delimiter=",")
        own = merkel.load(session).scene
        changed = copy.copy(own)
        changed["network.seed"] = 7  # of no effect on these neurons
        for each in (own, changed, pickle.loads(pickle.dumps(own)), merkel.Scene(session)):
            self.assertEqual(each.run().spike_hash, recorded.spike_hash)
        jobs = [{"scene": each} for each in (own, session, scene)]
        rows = merkel.batch(jobs, keep="table", cores=1).rows
        self.assertEqual([row["spike_hash"] == recorded.spike_hash for row in rows], [True, True, False])
        self.assertEqual(rows[0]["id"], rows[1]["id"])
        self.assertNotEqual(rows[0]["id"], rows[2]["id"])

    def test_a_changed_scene_runs_as_a_file_of_the_same_keys(self):
        scene = merkel.Scene("finger")
        scene["skin.radius_mm"] = 9.0
        file = self.path("scene.toml")
        pathlib.Path(file).write_text('preset = "finger"\n[skin]\nradius_mm = 9\n')
        run = scene.run(**trace_of("tests/traces/taps.csv"))
        self.assert_same(run.spikes, self.program_spikes(file, "--probe", "replay:tests/traces/taps.csv"))

    def test_what_is_wrong_with_a_key_is_a_sentence_and_changes_nothing(self):
        scene = merkel.Scene("finger")
        text = scene.text
        for key, value, sentence in (
                ("skin.radus_mm", 1, "the scene has no key skin.radus_mm: did you mean skin.radius_mm"),
                ("skin.radius_mm", "round", "skin.radius_mm cannot be 'round': .*, in mm"),
                ("skin.radius_mm", True, "cannot be True"),
                ("skin.poisson_ratio", 0.7, "skin.poisson_ratio must be"),
                ("probe.tip", "spere", "must be one of .*did you mean sphere"),
                ("loop.threads", 1.5, "cannot be 1.5"),
                ("network.seed", 10**30, "out of range"), ("network.seed", -1, "cannot be -1: it is out of range"),
                ("network.seed", 2**63, "network.seed must be a whole number from 0 to 9223372036854775807"),
                ("skin.radius_mm", np.array([8.0, 9.0]), "skin.radius_mm cannot be array")):
            with self.assertRaisesRegex(merkel.Error, sentence):
                scene[key] = value
        self.assertEqual(scene.text, text)
        with self.assertRaises(AttributeError):
            scene.nonsense
        with self.assertRaisesRegex(merkel.Error, "did you mean finger"):
            merkel.Scene("fingr")

    def test_advice_is_that_of_python(self):
        file = self.path("taken.csv")
        pathlib.Path(file).touch()
        with self.assertRaisesRegex(merkel.Error, "already exists: add overwrite=True"):
            merkel.connect("sim:ramp", sinks=["csv:" + file])

    def test_afferents_are_those_that_inspect_prints(self):
        printed = self.merkel("inspect", "afferents", "finger").stdout.splitlines()
        names = printed[0].split(",")
        afferents = merkel.Scene("finger").afferents
        self.assertEqual(len(afferents), len(printed) - 1)
        self.assertTrue(np.allclose([float(row.split(",")[names.index("x_mm")]) for row in printed[1:]],
                                    afferents["x_mm"]))


class Sessions(Case):
    def record(self):
        file = self.path("s.xdf")
        self.merkel("run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink", "xdf:" + file)
        return file

    def test_a_session_as_arrays(self):
        file = self.record()
        session = merkel.load(file)
        run = merkel.Scene("finger").run(**trace_of("tests/traces/taps.csv"))
        self.assertTrue(np.array_equal(session.spikes, run.spikes))
        self.assertTrue(np.array_equal(session.afferents, run.afferents))
        trace = trace_of("tests/traces/taps.csv")
        self.assertTrue(np.array_equal(session.samples["depth_mm"], trace["depth_mm"]))
        self.assertEqual(len(session.ticks), run.counters["ticks"])
        self.assertEqual(session.facts["scene"], "finger")
        self.assertTrue(session.complete)
        self.assertLess(abs(session.start_unix_s - time.time()), 600)
        again = session.scene.run(**{name: session.samples[name] for name in ("time_s", "depth_mm", "force_N")})
        self.assertTrue(np.array_equal(again.spikes, session.spikes))

    def test_further_columns_of_a_trace_are_in_the_session(self):
        trace, file = pathlib.Path(self.path("t.csv")), self.path("s.xdf")
        trace.write_text("time_s,depth_mm,skin_C,note\n" + "".join(f"0.{100 + i},0.5,{30 + i},x\n" for i in range(50)))
        merkel.Scene("paper").run(probe=f"replay:{trace}", sinks=["xdf:" + file])
        session = merkel.load(file)
        self.assertEqual(session.extra["skin_C"].tolist(), [30.0 + i for i in range(len(session.samples))])
        self.assertTrue(np.isnan(session.extra["note"]).all())
        self.assertGreater(len(session.samples), 40)

    def test_a_session_is_a_probe_for_any_scene(self):
        file = self.record()
        same = merkel.Scene("finger").run(probe="replay:" + file)
        self.assertTrue(np.array_equal(same.spikes, merkel.load(file).spikes))
        other = merkel.Scene("paper").run(probe="replay:" + file)
        self.assert_same(other.spikes, self.program_spikes("paper", "--probe", "replay:tests/traces/taps.csv"))

    def test_what_is_no_session_is_an_error(self):
        with self.assertRaisesRegex(merkel.Error, "is not a session"):
            merkel.load("tests/traces/taps.csv")
        with self.assertRaisesRegex(merkel.Error, "cannot read the session"):
            merkel.load(pathlib.Path("none.xdf"))


class Bridges(Case):
    def test_a_live_run_gives_its_spikes_and_records(self):
        file = self.path("live.xdf")
        # It goes on until it is stopped, however busy the machine is.
        with merkel.connect("sim:taps?count=1000&live=1", "finger", sinks=["xdf:" + file]) as bridge:
            bridge.mark("begin")
            first = next(bridge)
            bridge.stop()
            spikes = np.concatenate([each.spikes for each in (first, *bridge)])
        self.assertTrue(bridge.ended)
        self.assertEqual(bridge.counters["spikes"], len(spikes))
        with self.assertRaisesRegex(merkel.Error, "the run is over"):
            bridge.mark("too late")
        session = merkel.load(file)
        self.assertEqual(session.spikes["neuron"].tolist(), spikes["neuron"].tolist())
        self.assertEqual([label for _, label in session.marks], ["begin"])
        # The press that was live, through the same scene again.
        again = merkel.Scene("finger").run(probe="replay:" + file)
        if all(bridge.counters[name] == 0 for name in ("samples_late", "held_ticks", "skipped_ticks")):
            # Samples came after the last tick before the stop.
            self.assertEqual(again.spikes["neuron"][:len(spikes)].tolist(), spikes["neuron"].tolist())

    def test_a_live_run_gives_the_commands_that_it_records(self):
        file = self.path("live.xdf")
        scene = merkel.Scene.from_text(ELECTRODES)
        with merkel.connect("sim:taps?count=1000&live=1", scene, sinks=["xdf:" + file]) as bridge:
            outputs = [next(bridge)]
            while sum((each.stimulation["amplitude_uA"] > 0).sum() for each in outputs) < 3:
                outputs.append(next(bridge))
            bridge.stop()
            outputs += bridge
        commands = np.concatenate([each.stimulation for each in outputs])
        recorded = merkel.load(file)
        # A session counts from the start of the run, and has the encoder's commands. Those of the bridge passed the gate: the
        # backlog of the start stayed behind, and amplitudes rise with the slope in wall time.
        commands["time_s"] -= recorded.start_device_s
        self.assertEqual(commands["heartbeat"].tolist(), list(range(1, len(commands) + 1)))
        self.assertLess(len(commands), len(recorded.stimulation))
        # The end of a run may be the time of an update too.
        made = {(round(each["time_s"] * 1e6), each["electrode"], each["stop"]): each for each in recorded.stimulation}
        for each in commands[commands["stop"] != 6]:
            of_encoder = made[round(each["time_s"] * 1e6), each["electrode"], each["stop"]]
            self.assertLessEqual(each["amplitude_uA"], of_encoder["amplitude_uA"])
        self.assertEqual(commands["amplitude_uA"][-1], 0)
        self.assertEqual(len(np.concatenate([each.spikes for each in outputs])), bridge.counters["spikes"])

    def test_a_program_stops_stimulation_until_it_starts_it_again(self):
        scene = merkel.Scene.from_text(ELECTRODES)
        with merkel.connect("sim:taps?count=1000&live=1", scene, sinks=["xdf:" + self.path("live.xdf")]) as bridge:
            commands = [next(bridge).stimulation]

            def read_until(condition):
                deadline = time.monotonic() + 30
                while not condition(commands[-1]):
                    self.assertLess(time.monotonic(), deadline)
                    commands.append(next(bridge).stimulation)

            read_until(lambda latest: (latest["amplitude_uA"] > 0).any())
            bridge.stop_stimulation()
            read_until(lambda latest: (latest["stop"] == 7).any())
            begin = len(np.concatenate(commands))
            for _ in range(20):
                commands.append(next(bridge).stimulation)
            stopped = np.concatenate(commands)[begin:]
            self.assertEqual((set(stopped["stop"]), set(stopped["amplitude_uA"])), ({7}, {0}))
            bridge.start_stimulation()
            read_until(lambda latest: (latest["amplitude_uA"] > 0).any())
            bridge.stop()
        first = np.concatenate(commands)
        first = first[np.argmax(first["stop"] == 7)]
        self.assertEqual(first["amplitude_uA"], 0)
        self.assertTrue(any("stop" in label for _, label in merkel.load(self.path("live.xdf")).marks))

    def test_a_program_that_does_not_read_loses_its_own_copies_only(self):
        file = self.path("live.xdf")
        scene = merkel.Scene.from_text(ELECTRODES)
        with merkel.connect("sim:taps?count=1000&live=1", scene, sinks=["xdf:" + file], most_unread=5) as bridge:
            while bridge.counters["python_spikes_lost"] == 0 or bridge.counters["python_commands_lost"] < 30:
                time.sleep(0.01)
            bridge.stop()
            kept = next(bridge)
        self.assertEqual((len(kept.spikes), len(kept.stimulation)), (5, 5))
        self.assertTrue(any("read more often" in notice for notice in bridge.notices))
        counters, recorded = bridge.counters, merkel.load(file)
        self.assertEqual(5 + counters["python_spikes_lost"], len(recorded.spikes))
        passed, withheld = 5 + counters["python_commands_lost"], counters["commands_withheld"]
        self.assertLessEqual(passed, len(recorded.stimulation) + counters["stale_stops"])
        self.assertGreaterEqual(passed + withheld, len(recorded.stimulation))
        self.assertNotIn(4, recorded.stimulation["stop"])  # no failure of a sink

    def test_a_mark_is_one_line(self):
        with merkel.connect("sim:taps?count=1000&live=1", "paper") as bridge:
            with self.assertRaisesRegex(merkel.Error, "a mark is one line"):
                bridge.mark("two\nlines")

    def test_stop_ends_a_run_and_read_does_not_wait_longer_than_told(self):
        bridge = merkel.connect("sim:taps?count=1000&live=1", "paper")
        started = time.monotonic()
        bridge.read(timeout_s=0.05)
        self.assertLess(time.monotonic() - started, 5)
        self.assertFalse(bridge.ended)
        bridge.stop()
        list(bridge)
        self.assertTrue(bridge.ended)

    def test_a_probe_that_fails_is_an_error(self):
        with self.assertRaisesRegex(merkel.Error, "protocol"):
            merkel.connect("serial:/dev/ttyNONE?protocol=hbf2", "paper")
        with self.assertRaisesRegex(merkel.Error, "nonsense"):
            merkel.connect("sim:taps?live=1", "paper", sinks=["nonsense:x"])


class Package(Case):
    def test_the_stub_names_what_the_module_has(self):
        stub = ast.parse((TOOLS / "merkel" / "__init__.pyi").read_text())
        for node in stub.body:
            if isinstance(node, ast.FunctionDef):
                self.assertTrue(callable(getattr(merkel, node.name)), node.name)
            if isinstance(node, ast.ClassDef):
                names = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
                own = {name for name in vars(getattr(merkel, node.name)) if not name.startswith("_")}
                public = {name for name in names if not name.startswith("_")}
                public |= {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
                if node.name != "Error":
                    self.assertEqual(public, own, node.name)
                    for name in public:
                        self.assertTrue(getattr(merkel, node.name).__dict__[name].__doc__, name)

    def test_versions_are_one(self):
        project = (TOOLS.parents[1] / "CMakeLists.txt").read_text()
        self.assertEqual(re.search(r"project\(merkel VERSION (\S+)", project).group(1), merkel.__version__)
        self.assertIn(merkel.__version__, self.merkel("--version").stdout)

    def test_examples_in_docstrings_and_the_readme(self):
        for failed, ran in (doctest.testmod(merkel), doctest.testmod(merkel._trials),
                            doctest.testfile(str(TOOLS / "README.md"), module_relative=False)):
            self.assertEqual(failed, 0)
            self.assertGreater(ran, 0)


class ProgramOfAWheel(Case):
    def test_it_starts_itself_again(self):
        command = pathlib.Path(self.path("merkel"))
        command.write_text(f"#!{sys.executable}\nfrom merkel._program import main\nmain()\n")
        command.chmod(0o755)
        environment = {**os.environ, "PYTHONPATH": str(pathlib.Path(merkel.__file__).resolve().parents[1])}
        session = self.path("s.xdf")
        subprocess.run([PROGRAM, "run", "--fast", "--probe", "sim:ramp?depth_mm=1", "--duration-s", "0.2", "--sink", "xdf:" + session],
                       capture_output=True)
        made = subprocess.run([command, "bundle", session, "--out", self.path("deposit"), "--skip-score"], env=environment,
                              capture_output=True, text=True)
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("bit-identical in a replay", made.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
