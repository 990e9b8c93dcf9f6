"""NWB files, opened by h5py and by the rules of the format; where pynwb is installed, by its validator and Neo."""
import csv
import datetime
import os
import uuid

import h5py
import numpy as np

import merkel_program
from merkel_program import spikes_of_csv

try:
    import pynwb
except ImportError:
    pynwb = None

# What every object of a type must have: (attributes, members).
RULES = {
    "NWBFile": (["nwb_version"], ["acquisition", "analysis", "processing", "stimulus/presentation",
                                  "stimulus/templates", "general", "identifier", "session_description",
                                  "session_start_time", "timestamps_reference_time", "file_create_date"]),
    "TimeSeries": (["description"], ["data"]),
    "Units": (["colnames", "description"], ["id", "spike_times", "spike_times_index", "obs_intervals",
                                            "obs_intervals_index"]),
    "TimeIntervals": (["colnames", "description"], ["id", "start_time", "stop_time"]),
    "VectorData": (["description"], []),
    "VectorIndex": (["description", "target"], []),
    "ElementIdentifiers": ([], []),
    "Device": (["description"], []),
    "Subject": ([], ["subject_id", "species", "sex", "age"]),
}
FACTS = ("experiment_description=A press of the fingertip&experimenter=Doe, Jane&institution=A University&lab=Touch&keywords=touch;SA1&subject_id=model-1"
         "&species=Homo sapiens&sex=U&age=P30Y")
NAMESPACES = {"VectorData": "hdmf-common", "VectorIndex": "hdmf-common", "ElementIdentifiers": "hdmf-common"}


def times_of(series):
    """Of a TimeSeries: each time, or a start and a rate."""
    if "timestamps" in series:
        return series["timestamps"][:]
    start = series["starting_time"]
    return start[()] + np.arange(len(series["data"])) / start.attrs["rate"]


def table_of(path):
    with open(path) as file:
        return np.genfromtxt([line for line in file if not line.startswith("#")], delimiter=",", names=True)


class Nwb(merkel_program.TestCase):
    def record(self, *arguments, trace="tests/traces/slide.csv"):
        self.merkel("run", "finger", "--fast", "--probe", "replay:" + trace, "--sink", "csv:" + self.path("s.csv"),
                    "--sink", f"nwb:{self.path('s.nwb')}?{FACTS}", "--sink", "xdf:" + self.path("s.xdf"), *arguments)
        return self.path("s.nwb")

    def test_five_noisy_taps_are_five_trials(self):
        rng = np.random.default_rng(5)
        time_s = np.arange(0, 10, 2e-3)
        tap = (time_s % 2 > 1.7) + rng.normal(0, 2 / 300, time_s.size)
        for column, tap_height, key in (("force_N", 0.3, "contact_N = 0.012"), ("depth_mm", 0.6, "contact_mm = 0.024")):
            np.savetxt(self.path("taps.csv"), np.c_[time_s, tap_height * tap], delimiter=",", header="time_s," + column,
                       comments="", fmt="%.6f")
            with open(self.path("taps.toml"), "w") as scene:
                scene.write(f'preset = "goodwin"\n[probe]\n{key}\n')
            self.merkel("run", self.path("taps.toml"), "--fast", "--probe", "replay:" + self.path("taps.csv"), "--sink",
                        "nwb:" + self.path(column + ".nwb"))
            with h5py.File(self.path(column + ".nwb")) as file:
                trials = file["intervals/trials"]
                self.assertEqual(len(trials["start_time"]), 5, column)
                np.testing.assert_allclose(trials["start_time"][:], np.arange(1.7, 10, 2), atol=0.01)
                np.testing.assert_allclose(trials["stop_time"][:-1], np.arange(2.0, 10, 2), atol=0.02)

    def check_rules(self, file):
        """Every typed object has what its type needs; ids are unique, texts of variable length."""
        ids = set()

        def check(name, item):
            kind = item.attrs.get("neurodata_type")
            if kind is not None:
                attributes, members = RULES[kind]
                for attribute in attributes:
                    self.assertIn(attribute, item.attrs, f"{name} ({kind})")
                for member in members:
                    self.assertIn(member, item, f"{name} ({kind})")
                self.assertEqual(item.attrs["namespace"], NAMESPACES.get(kind, "core"), name)
                if kind == "TimeSeries":
                    self.assertNotEqual("timestamps" in item, "starting_time" in item, name)
                ids.add(str(uuid.UUID(item.attrs["object_id"])))
                self.seen[kind] = self.seen.get(kind, 0) + 1
            for attribute in item.attrs:
                text = h5py.check_string_dtype(item.attrs.get_id(attribute).dtype)
                self.assertTrue(text is None or (text.length is None and text.encoding == "utf-8"), name)
            if isinstance(item, h5py.Dataset):
                text = h5py.check_string_dtype(item.dtype)
                self.assertTrue(text is None or (text.length is None and text.encoding == "utf-8"), name)
            if kind in ("Units", "TimeIntervals"):
                rows = {len(item[column + "_index" if column + "_index" in item else column])
                        for column in item.attrs["colnames"]}
                self.assertEqual(rows, {len(item["id"])}, name)

        self.seen = {}
        check("/", file)
        file.visititems(check)
        self.assertEqual(len(ids), sum(self.seen.values()))

    def test_the_file_follows_the_rules_of_nwb(self):
        with h5py.File(self.record(), "r") as file:
            self.check_rules(file)
            self.assertEqual({kind: count > 0 for kind, count in self.seen.items()}, {kind: True for kind in RULES})
            self.assertEqual(file.attrs["nwb_version"], "2.7.0")
            units = file["units"]
            self.assertEqual(file[units["spike_times_index"].attrs["target"]], units["spike_times"])
            start = datetime.datetime.fromisoformat(file["session_start_time"][()].decode())
            self.assertLess(abs(start.timestamp() - os.path.getmtime(self.path("s.nwb"))), 600)
            self.assertIn('preset = "finger"', file["general/source_script"][()].decode())
            self.assertIn("version = ", file["general/notes"][()].decode())

    def test_spikes_positions_and_press_are_those_of_the_run(self):
        with h5py.File(self.record(), "r") as file:
            units = file["units"]
            ends = units["spike_times_index"][:]
            self.assertEqual(units["spike_times_index"].dtype, np.uint32)
            rows = [(round(t * 1e9), unit + 1)
                    for unit, (begin, end) in enumerate(zip(np.r_[0, ends[:-1]], ends))
                    for t in units["spike_times"][begin:end]]
            self.assertGreater(len(rows), 100)
            self.assertEqual(sorted(rows), sorted(spikes_of_csv(self.path("s.csv"))))
            printed = self.merkel("inspect", "afferents", "finger").stdout.splitlines()
            column = printed[0].split(",").index("x_mm")
            self.assertTrue(np.allclose(units["x_mm"][:], [float(row.split(",")[column]) for row in printed[1:]]))
            trace = table_of("tests/traces/slide.csv")
            depth = file["stimulus/presentation/depth"]
            self.assertTrue(np.array_equal(depth["data"][:], trace["depth_mm"]))
            self.assertTrue(np.array_equal(np.round(times_of(depth) * 1e9), np.round(trace["time_s"] * 1e9)))
            self.assertEqual(depth["data"].attrs["unit"], "meters")
            self.assertAlmostEqual(depth["data"].attrs["conversion"], 1e-3)
            self.assertEqual(units["obs_intervals"].shape, (len(units["id"]), 2))

    def test_commands_of_each_electrode_are_time_series_of_the_stimulus(self):
        """In the file of a run, and in one exported from its session, as in the file of commands."""
        scene = self.path("e.toml")
        with open(scene, "w") as file:
            file.write('preset = "paper"\n[stimulation]\nmax_charge_nC = 20\nmax_total_uA = 300\nwatchdog_ms = 100\n')
            for name, encoder in (("E1", "rate"), ("E2", "pulse_per_spike")):
                file.write(f'[[electrode]]\nname = "{name}"\nencoder = "{encoder}"\nfield_mm = [15, 10, 15]\n'
                           'amplitude_uA = [20, 80]\nfrequency_Hz = [0, 200]\n')
        self.merkel("run", scene, "--fast", "--probe", "replay:tests/traces/ramp_and_hold.csv",
                    "--sink", "stim-csv:" + self.path("e.csv"), "--sink", "nwb:" + self.path("s.nwb"),
                    "--sink", "xdf:" + self.path("s.xdf"))
        self.merkel("export", self.path("s.xdf"), "--sink", "nwb:" + self.path("e.nwb"))
        with open(self.path("e.csv")) as rows:
            commands = [row for row in csv.DictReader(line for line in rows if not line.startswith("#"))]
        for path in (self.path("s.nwb"), self.path("e.nwb")):
            with h5py.File(path, "r") as file:
                self.check_rules(file)
                self.assertNotIn("general/extracellular_ephys", file)  # units have the positions
                stimulus = file["stimulus/presentation"]
                for name in ("E1", "E2"):
                    for kind, quantity, column in (("update", "amplitude", "amplitude_uA"),
                                                   ("update", "frequency", "frequency_Hz"),
                                                   ("pulse", "pulses", "amplitude_uA")):
                        rows = [row for row in commands if row["electrode"] == name and row["kind"] == kind]
                        if not rows:
                            self.assertNotIn(f"electrode_{name}_{quantity}", stimulus)
                            continue
                        series = stimulus[f"electrode_{name}_{quantity}"]
                        self.assertEqual(series["data"][:].tolist(), [float(row[column]) for row in rows])
                        self.assertTrue(np.array_equal(np.round(times_of(series) * 1e9),
                                                       [round(float(row["time_s"]) * 1e9) for row in rows]))
                    series = stimulus[f"electrode_{name}_stop"]
                    codes = series.attrs["description"].split(": ")[-1].split(", ")
                    reasons = {float(code.split(" ", 1)[0]): code.split(" ", 1)[1] for code in codes}
                    stops = [row["stop"] or "no stop" for row in commands
                             if row["electrode"] == name and row["kind"] == "update"]
                    self.assertEqual([reasons[code] for code in series["data"][:]], stops)
                    self.assertEqual(stops[-1], "end")
                    # Neo hands every field of a series on as an annotation, and refuses these lists.
                    self.assertNotIn("control", stimulus[f"electrode_{name}_amplitude"])
                self.assertGreater(np.max(stimulus["electrode_E1_frequency/data"]), 10)
                self.assertGreater(len(stimulus["electrode_E2_pulses/data"]), 10)
            self.validate(path)

    def validate(self, path):
        if pynwb is not None:
            with pynwb.NWBHDF5IO(path, "r") as io:
                self.assertEqual(pynwb.validate(io=io), [])
                for series in io.read().stimulus.values():
                    self.assertTrue(series.rate or len(series.timestamps) == len(series.data))

    def test_nwbinspector_has_nothing_critical_to_say(self):
        """Stand-ins for nwbinspector's rules, by their names there; it is not in Debian."""
        with h5py.File(self.record(), "r") as file:
            general = file["general"]
            text = lambda name: general[name][()].decode()
            # check_subject_exists, _id_exists, _species_form, _sex, _age (DANDI: critical)
            self.assertEqual(text("subject/subject_id"), "model-1")
            self.assertIn("model of slowly adapting type I afferents", text("subject/description"))
            self.assertRegex(text("subject/species"), r"^[A-Z][a-z]+ [a-z]+$")
            self.assertIn(text("subject/sex"), "MFUO")
            self.assertRegex(text("subject/age"), r"^P(\d+Y)?(\d+M)?(\d+D)?$")
            # check_experimenter_exists, _form ("Last, First"), check_institution, check_keywords
            for name in general["experimenter"].asstr():
                self.assertRegex(name, r"^\w+, \w+")
            self.assertEqual(text("institution"), "A University")
            self.assertEqual(list(general["keywords"].asstr()), ["touch", "SA1"])
            # check_experiment_description, check_column_binary_capability
            self.assertEqual(text("experiment_description"), "A press of the fingertip")
            for table in (file["units"], *file["intervals"].values()):
                for name, column in table.items():
                    if column.dtype.kind in "iuf" and "_index" not in name and name not in ("id", "start_time", "stop_time"):
                        self.assertNotEqual(set(np.unique(column[:])), {0, 1}, name)
            # check_table_time_columns_are_sorted, check_table_times_for_typo (not before 0)
            for table in file["intervals"].values():
                self.assertTrue((np.diff(table["start_time"][:]) >= 0).all())
                self.assertTrue((table["start_time"][:] >= 0).all())
                self.assertTrue((table["stop_time"][:] >= table["start_time"][:]).all())
            # check_regular_timestamps: a rate instead of equally spaced times; check_timestamps_match_first_dimension,
            # check_timestamps_ascending, check_resolution, check_rate_is_not_zero
            for series in file["stimulus/presentation"].values():
                times = times_of(series)
                self.assertEqual(len(times), len(series["data"]))
                self.assertTrue((np.diff(times) > 0).all())
                self.assertGreaterEqual(times[0], 0)
                if "timestamps" in series:
                    self.assertGreater(len(np.unique(np.diff(times).round(9))), 1)
                else:
                    self.assertGreater(series["starting_time"].attrs["rate"], 0)
                    self.assertEqual(series["starting_time"].attrs["unit"], "seconds")
                self.assertNotEqual(series["data"].attrs["resolution"], 0)
            # check_description, check_name_slashes, check_empty_string_for_optional_attribute
            def check_texts(name, item):
                self.assertNotIn("/", name.rsplit("/", 1)[-1])
                if item.attrs.get("neurodata_type") in ("TimeSeries", "VectorData", "Units", "TimeIntervals", "Device"):
                    self.assertGreater(len(item.attrs["description"]), 5, name)
                self.assertFalse([key for key, value in item.attrs.items() if isinstance(value, str) and not value], name)
            file.visititems(check_texts)
            # check_session_start_time_old_date, _future_date; check_col_not_nan, check_negative_spike_times
            start = datetime.datetime.fromisoformat(file["session_start_time"][()].decode())
            self.assertTrue(start.year > 1980 and start < datetime.datetime.now(datetime.timezone.utc))
            for name in ("x_mm", "y_mm", "field_radius_mm"):
                self.assertFalse(np.isnan(file["units"][name][:]).any())
            self.assertTrue((file["units/spike_times"][:] >= 0).all())
            # SpikeInterface's NwbSortingExtractor divides by it.
            self.assertEqual(file["units/spike_times"].attrs["resolution"], 1e-9)

    def test_a_regular_press_has_a_rate_and_an_irregular_one_its_times(self):
        rows = [(0.001 * i, 0.5) for i in range(2000)]
        for name, times in (("regular", [t for t, _ in rows]), ("late", [t + (t > 1.2) * 1e-4 for t, _ in rows]),
                            ("short", [0.0, 0.001])):
            trace = self.path(name + ".csv")
            with open(trace, "w") as file:
                file.write("time_s,depth_mm,force_N\n" + "".join(f"{t:.9f},0.5,0.1\n" for t in times))
            self.merkel("run", "finger", "--fast", "--probe", "replay:" + trace, "--sink", f"nwb:{self.path(name + '.nwb')}")
            with h5py.File(self.path(name + ".nwb"), "r") as file:
                self.check_rules(file)
                for series in (file["stimulus/presentation/depth"], file["stimulus/presentation/force"]):
                    self.assertEqual("starting_time" in series, name == "regular")
                    self.assertTrue(np.array_equal(np.round(times_of(series) * 1e9), np.round(np.array(times) * 1e9)))

    def test_units_have_the_names_of_their_patches(self):
        self.merkel("run", "hand", "--fast", "--duration-s", "0.05", "--sink", "nwb:" + self.path("h.nwb"))
        rows = self.merkel("scene", "hand").stdout
        with h5py.File(self.path("h.nwb"), "r") as file:
            patches = set(file["units/patch_name"].asstr()[:])
        self.assertGreater(len(patches), 5)
        for name in patches:
            self.assertIn(f'name = "{name}"', rows)

    def test_contacts_are_trials_without_marks(self):
        with h5py.File(self.record(trace="tests/traces/taps.csv"), "r") as file:
            trace = table_of("tests/traces/taps.csv")
            touches = np.diff(np.r_[0, (trace["depth_mm"] > 0) | (trace["force_N"] > 0), 0].astype(int))
            trials = file["intervals/trials"]
            self.assertEqual(len(trials["id"]), np.count_nonzero(touches > 0))
            self.assertTrue(np.allclose(trials["start_time"][:], trace["time_s"][np.flatnonzero(touches > 0)]))
            self.assertTrue(np.all(trials["stop_time"][:] > trials["start_time"][:]))

    def test_contacts_name_the_device_of_their_probe(self):
        self.merkel("run", "finger", "--fast", "--duration-s", "1.5", "--probe", "sim:taps", "--probe", "sim:sine?x_mm=20",
                    "--sink", "nwb:" + self.path("two.nwb"))
        with h5py.File(self.path("two.nwb"), "r") as file:
            probes = set(file["intervals/contacts/probe"].asstr()[:])
            self.assertEqual(probes, {"probe_0", "probe_1"})
            self.assertLessEqual(probes, set(file["general/devices"]))

    def test_a_replay_has_spikes_and_no_series_without_samples(self):
        file = self.record()
        self.merkel("replay", self.path("s.xdf"), "--sink", "nwb:" + self.path("r.nwb"))
        with h5py.File(file, "r") as ran, h5py.File(self.path("r.nwb"), "r") as replayed:
            self.check_rules(replayed)
            self.assertEqual(len(replayed["stimulus/presentation"]), 0)
            np.testing.assert_array_equal(replayed["units/spike_times"][:], ran["units/spike_times"][:])

    def test_units_are_observed_while_they_are_simulated(self):
        """In a run that ends before its recording, its replay, and its merge with a longer one."""
        for name, duration_s in (("a", 0.5), ("b", 0.75)):
            self.merkel("run", "finger", "--fast", "--duration-s", str(duration_s), "--sink",
                        "xdf:" + self.path(name + ".xdf"), "--sink", "nwb:" + self.path(name + ".nwb"))
        self.merkel("replay", self.path("a.xdf"), "--sink", "nwb:" + self.path("r.nwb"))
        self.merkel("merge", self.path("a.xdf"), self.path("b.xdf"), "--accept-unknown", "--sink", "nwb:" + self.path("m.nwb"))
        for name in ("a", "r"):
            with h5py.File(self.path(name + ".nwb")) as file:
                observed = file["units/obs_intervals"][:]
                np.testing.assert_array_equal(observed, np.tile([0, 0.5], (len(observed), 1)))
        with h5py.File(self.path("m.nwb")) as file:
            of_a, of_b = np.split(file["units/obs_intervals"][:], 2)
            np.testing.assert_array_equal(of_a, observed)
            np.testing.assert_array_equal(of_b, np.tile(of_b[0], (len(of_b), 1)))
            self.assertGreater(of_b[0, 0], 0)  # b began later
            self.assertAlmostEqual(of_b[0, 1] - of_b[0, 0], 0.75, places=4)
            self.assertEqual(list(file["intervals/contacts/stop_time"][:]), [0.5, of_b[0, 1]])
        with h5py.File(self.path("a.nwb")) as file:
            self.assertLessEqual(times_of(file["stimulus/presentation/depth"])[-1], 0.5)
            self.assertEqual(set(file["intervals/contacts/stop_time"][:]), {0.5})

    def test_an_exported_session_is_the_same_file(self):
        self.record()
        self.merkel("export", self.path("s.xdf"), "--sink", "nwb:" + self.path("e.nwb"))
        with h5py.File(self.path("s.nwb"), "r") as ran, h5py.File(self.path("e.nwb"), "r") as exported:
            self.check_rules(exported)
            for name in ("units/spike_times", "units/spike_times_index", "units/x_mm", "session_start_time",
                         "stimulus/presentation/depth/data", "intervals/trials/start_time"):
                self.assertTrue(np.array_equal(ran[name][()], exported[name][()]), name)

    def test_a_killed_run_leaves_a_session_of_which_export_makes_the_file(self):
        file = self.path("k.nwb")
        part = file + ".journal.xdf.part"
        process = merkel_program.start("run", "finger", "--probe", "sim:taps?count=1000", "--sink", "nwb:" + file)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(part) and os.path.getsize(part) > 400_000))
        process.kill()
        process.communicate()
        self.merkel("export", part, "--sink", "nwb:" + file)
        with h5py.File(file, "r") as kept:
            self.check_rules(kept)
            self.assertGreater(len(kept["stimulus/presentation/depth/data"]), 100)

    def test_pynwb_validates_it_and_neo_reads_it(self):
        file = self.record()
        if pynwb is None:
            self.skipTest("pynwb is not installed: Debian does not have it")
        self.validate(file)
        with pynwb.NWBHDF5IO(file, "r") as io:
            self.assertEqual(len(io.read().units), 450)


if __name__ == "__main__":
    merkel_program.main()
