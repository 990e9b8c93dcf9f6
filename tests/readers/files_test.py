#!/usr/bin/env python3
"""Opens spike files with the software that users have: Neo, h5py, NumPy."""
import glob
import os
import resource
import shutil
import signal
import subprocess
import time

import h5py
import neo
import numpy as np
import pandas
import quantities as pq

import merkel_program
from merkel_program import SOAK, SOAK_S, spikes_of_csv

TRACE = "replay:tests/traces/slide.csv"


def rows_of(segment):
    """(time in ns, neuron) of all spike trains, in order."""
    rows = []
    for train in segment.spiketrains:
        neuron = train.annotations.get("id", train.annotations.get("cluster_id"))
        rows += [(round(float(t) * 1e9), int(neuron)) for t in train.rescale("s").magnitude]
    return sorted(rows)


class Files(merkel_program.TestCase):
    def record(self, *uris):
        self.merkel("run", "--fast", "--probe", TRACE, "--sink", "csv:" + self.path("s.csv"),
                    *(word for uri in uris for word in ("--sink", uri)))
        spikes = spikes_of_csv(self.path("s.csv"))
        self.assertGreater(len(spikes), 100)
        return spikes

    def test_hdf5_files_whose_spikes_are_no_list_say_so(self):
        spikes = self.record("nwb:" + self.path("s.nwb"))
        for dataset, value, sentence in (
                ("/units/spike_times", np.ones((2, 3)), "has 2 dimensions instead of one: store a list"),
                ("/units/spike_times", np.array([b"x"]), "does not hold numbers"),
                ("/units/spike_times_index", 7, "is a single value instead of a list"),
                ("/units/spike_times_index", np.array([1]), "does not fit spike_times"),
                ("/units/spike_times_index", np.array([-1, len(spikes)]), "does not fit spike_times")):
            copy = self.path("damaged.nwb")
            shutil.copy(self.path("s.nwb"), copy)
            with h5py.File(copy, "a") as file:
                del file[dataset]
                file[dataset] = value
            done = merkel_program.run("compare", copy, self.path("s.csv"))
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(sentence, done.stderr)

    def test_neo_reads_gdf(self):
        spikes = self.record("gdf:" + self.path("s.gdf"))
        segment = neo.io.NestIO(filenames=self.path("s.gdf")).read_segment(
            gid_list=[], t_start=0 * pq.ms, t_stop=1e5 * pq.ms, id_column_gdf=0, time_column_gdf=1)
        self.assertEqual(rows_of(segment), spikes)

    def test_every_run_writes_the_same_form(self):
        """pandas and NumPy read CSV and GDF as they are, Neo the times of a live GDF exactly.

        (Neo's NestIO takes the times for whole milliseconds if line 1 has no ".".)"""
        for name, probe in (("fast", ["--fast", "--probe", TRACE]),
                            ("live", ["--probe", "sim:ramp?wait_s=0&hold_s=0.3&live=1"])):
            csv, gdf = self.path(name + ".csv"), self.path(name + ".gdf")
            self.merkel("run", *probe, "--sink", "csv:" + csv, "--sink", "gdf:" + gdf)
            spikes = spikes_of_csv(csv)
            self.assertGreater(len(spikes), 10)
            self.assertEqual(os.path.exists(csv + ".time"), name == "live")
            frame = pandas.read_csv(csv)
            self.assertEqual(list(frame.columns), ["time_s", "neuron"])
            self.assertEqual(frame["neuron"].dtype, np.int64)
            array = np.genfromtxt(csv, delimiter=",", names=True)
            self.assertEqual(array.dtype.names, ("time_s", "neuron"))
            rows = pandas.read_csv(gdf, sep="\t", header=None)
            for times, neurons, unit in ((frame["time_s"], frame["neuron"], 1e9),
                                         (array["time_s"], array["neuron"], 1e9),
                                         (rows[1], rows[0], 1e6)):
                self.assertEqual([(round(t * unit), int(n)) for t, n in zip(times, neurons)],
                                 spikes)
            segment = neo.io.NestIO(filenames=gdf).read_segment(
                gid_list=[], t_start=0 * pq.ms, t_stop=1e5 * pq.ms, id_column_gdf=0,
                time_column_gdf=1)
            self.assertEqual(rows_of(segment), sorted(spikes))

    def test_a_recovered_file_keeps_the_zero_of_its_times(self):
        uri = "csv:" + self.path("z.csv")
        program = merkel_program.start("run", "--probe", "sim:taps?interval_s=0.1&tap_s=0.08&"
                                       "count=1000&live=1", "--sink", uri)
        part = self.path("z.csv.part")
        self.assertTrue(merkel_program.wait_for(
            lambda: os.path.exists(part) and os.path.getsize(part) > 200))
        program.send_signal(signal.SIGKILL)
        program.communicate()
        self.assertTrue(os.path.exists(self.path("z.csv.time")))
        self.merkel("run", "--fast", "--probe", TRACE, "--sink", uri)
        recovered, = glob.glob(self.path("z.recovered-*.csv"))
        self.assertTrue(os.path.exists(recovered + ".time"))
        self.assertFalse(os.path.exists(self.path("z.csv.time")))

    def test_neo_reads_phy(self):
        spikes = self.record("phy:" + self.path("s"))
        segment = neo.io.PhyIO(self.path("s")).read_segment()
        channels = np.load(self.path("s/channel_map.npy"))
        positions = np.load(self.path("s/channel_positions.npy"))
        self.assertEqual(list(channels), list(range(20)))
        self.assertEqual(positions.shape, (20, 2))
        afferents = np.genfromtxt(self.path("s/afferents.csv"), delimiter=",", names=True)
        self.assertTrue(np.allclose(1e3 * afferents["x_mm"], positions[:, 0]))
        # Phy counts samples, here of one microsecond.
        self.assertEqual([(round(t / 1000), n) for t, n in rows_of(segment)],
                         sorted(((t + 500) // 1000, n) for t, n in spikes))

    def test_sonata_has_the_published_layout(self):
        spikes = self.record("sonata:" + self.path("s.h5") + "?population=finger")
        with h5py.File(self.path("s.h5"), "r") as file:
            self.assertEqual(file.attrs["magic"], 0x0A7A)
            self.assertEqual(list(file.attrs["version"]), [0, 1])
            self.assertEqual(list(file["spikes"]), ["finger"])
            group = file["spikes/finger"]
            sorting = h5py.check_enum_dtype(group.attrs.get_id("sorting").dtype)
            self.assertEqual(sorting, {"none": 0, "by_id": 1, "by_time": 2})
            self.assertEqual(group.attrs["sorting"], sorting["by_time"])
            units = group["timestamps"].attrs["units"]
            self.assertEqual(units, "ms")
            self.assertTrue(h5py.check_string_dtype(group["timestamps"].attrs.get_id("units").dtype)
                            .length is None)  # of variable length, as libsonata expects
            self.assertEqual(group.attrs["time_zero"], "run")
            nodes = file["nodes/finger"]
            self.assertEqual(list(nodes["node_id"]), list(range(20)))
            self.assertEqual(list(nodes["node_group_index"]), list(range(20)))
            self.assertTrue(np.all(nodes["0/x"][:] > 0) and np.all(nodes["0/x"][:] < 30_000))
            self.assertTrue(np.all(nodes["0/field_radius_mm"][:] > 0))
            # bmtk and libsonata read the table of node types with pandas, separated by spaces.
            types = pandas.read_csv(self.path("s_node_types.csv"), sep=" ")
            self.assertEqual(list(types["node_type_id"]), [0])
            self.assertTrue(np.all(np.isin(nodes["node_type_id"], types["node_type_id"])))
            self.assertEqual(list(types["population"]), ["finger"])
            self.assertEqual(list(types["model_type"]), ["virtual"])
            self.assertEqual(group["timestamps"].dtype, np.float64)
            self.assertEqual(group["node_ids"].dtype, np.uint64)
            # Node numbers start at 0.
            rows = [(round(t * 1e6), int(n) + 1)
                    for t, n in zip(group["timestamps"], group["node_ids"])]
        self.assertEqual(rows, spikes)

    def test_a_killed_run_leaves_what_it_had_flushed(self):
        uris = ["csv:" + self.path("k.csv"), "gdf:" + self.path("k.gdf"),
                "phy:" + self.path("k"), "sonata:" + self.path("k.h5")]
        program = merkel_program.start(
            "run", "--probe", "sim:taps?interval_s=0.1&tap_s=0.08&count=1000",
            *(word for uri in uris for word in ("--sink", uri)))
        part = self.path("k.csv.part")
        self.assertTrue(merkel_program.wait_for(
            lambda: os.path.exists(part) and os.path.getsize(part) > 14 * 30))
        time.sleep(0.5)
        program.send_signal(signal.SIGKILL)
        program.communicate()
        spikes = spikes_of_csv(self.path("k.csv.part"))
        self.assertGreater(len(spikes), 20)
        with open(self.path("k.gdf.part")) as lines:
            rows = [(round(float(t) * 1e6), int(n)) for n, t in map(str.split, lines)]
        both = min(len(rows), len(spikes))
        self.assertEqual(rows[:both], spikes[:both])
        # Of the formats that need the whole run, a session is left, from which they are made.
        for uri, journal in ((uris[2], "k.journal.xdf.part"), (uris[3], "k.h5.journal.xdf.part")):
            self.merkel("export", self.path(journal), "--sink", uri)
        clusters = np.load(self.path("k/spike_clusters.npy"))
        self.assertGreater(len(clusters), 20)
        both = min(len(clusters), len(spikes))
        self.assertEqual(list(clusters[:both]), [n for _, n in spikes[:both]])
        kept = self.path("k.h5")
        with h5py.File(kept, "r") as file:
            sonata = [(round(t * 1e6), int(n) + 1) for t, n in zip(
                file["spikes/merkel/timestamps"], file["spikes/merkel/node_ids"])]
        both = min(len(sonata), len(spikes))
        self.assertGreater(both, 20)
        self.assertEqual(sonata[:both], spikes[:both])
        # The next run with these names keeps everything.
        self.merkel("run", "--fast", "--overwrite", "--probe", TRACE,
                    *(word for uri in uris for word in ("--sink", uri)))
        for pattern in ("k.recovered-*[0-9].csv", "k.recovered-*.gdf", "k.journal.recovered-*.xdf",
                        "k.h5.journal.recovered-*.xdf"):
            self.assertEqual(len(glob.glob(self.path(pattern))), 1, pattern)

    def test_times_count_from_the_run_from_1970_or_from_the_device(self):
        session = self.path("t.xdf")
        before = time.time()
        self.merkel("run", "--probe", "sim:ramp?wait_s=0&hold_s=0.3&live=1", "--sink",
                    "xdf:" + session, "--sink", "csv:" + self.path("live.csv"))
        times = {}
        for zero in ("session", "unix", "device"):
            path = self.path(zero + ".csv")
            self.merkel("export", session, "--time-zero", zero, "--sink", "csv:" + path)
            times[zero] = spikes_of_csv(path)
            self.assertEqual(os.path.exists(path + ".time"), zero != "device")
            if os.path.exists(path + ".time"):
                with open(path + ".time") as lines:
                    notes = dict(line.strip().split(" = ") for line in lines)
                self.assertEqual(notes["time_zero"], "run" if zero == "session" else zero)
            if zero != "device":
                offset = int(notes["time_offset_ns"])
                shifted = [(t + offset, n) for t, n in times[zero]]
                device = shifted if zero == "session" else device
                self.assertEqual([n for _, n in shifted], [n for _, n in device])
                # A double holds a Unix time to a quarter of a microsecond.
                for (a, _), (b, _) in zip(shifted, device):
                    self.assertLess(abs(a - b), 500)
        self.assertEqual(times["device"], device)
        self.assertEqual(times["session"], spikes_of_csv(self.path("live.csv")))
        self.assertGreater(len(times["session"]), 10)
        self.assertTrue(0 <= times["session"][0][0] < 2e9)
        self.assertTrue(before - 5 < times["unix"][0][0] * 1e-9 < time.time() + 5)

    def test_a_full_disk_ends_its_sink_and_no_other(self):
        done = self.merkel("run", "--fast", "--probe", TRACE, "--sink", "csv:/dev/full", "--sink",
                           "csv:" + self.path("s.csv"), exit_code=1)
        self.assertIn("No space left", done.stderr)
        self.assertIn("/dev/full", done.stderr)
        self.assertGreater(len(spikes_of_csv(self.path("s.csv"))), 100)

    def test_a_limit_of_file_size_ends_its_sinks_and_not_the_run(self):
        done = subprocess.run(
            [merkel_program.PROGRAM, "run", "--fast", "--probe", "sim:taps?count=40", "--sink",
             "xdf:" + self.path("s.xdf"), "--sink", "csv:" + self.path("s.csv")],
            capture_output=True, text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000)))
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("ulimit -f", done.stderr)
        self.assertGreater(len(spikes_of_csv(self.path("s.csv"))), 100)
        # The content of the session is complete.
        replay = self.merkel("replay", self.path("s.xdf.part"))
        self.assertIn("bit-identical", replay.stdout)

    def test_millions_of_spikes_lose_none(self):
        uris = ["csv:" + self.path("l.csv"), "gdf:" + self.path("l.gdf"), "phy:" + self.path("l"),
                "sonata:" + self.path("l.h5"), "xdf:" + self.path("l.xdf"),
                f"view:{merkel_program.free_port()}"]
        subprocess.run([SOAK, str(SOAK_S), *uris], check=True, stdout=subprocess.DEVNULL)
        made = int(SOAK_S * 5000)
        with h5py.File(self.path("l.h5"), "r") as file:
            times_ns = np.rint(file["spikes/merkel/timestamps"][:] * 1e6).astype(np.int64)
            neurons = file["spikes/merkel/node_ids"][:] + 1
        # Five per tick, 190 µs apart, starting at 7 ns.
        expected = np.arange(made) // 5 * 1_000_000 + np.arange(made) % 5 * 190_000 + 7
        self.assertTrue(np.array_equal(times_ns, expected))
        self.assertTrue(np.array_equal(np.load(self.path("l/spike_clusters.npy")), neurons))
        self.assertTrue(np.array_equal(np.load(self.path("l/spike_times.npy")),
                                       np.rint(expected / 1000).astype(np.int64)))
        for name, header in (("l.csv", 1), ("l.gdf", 0)):
            with open(self.path(name), "rb") as file:
                lines = sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 22), b""))
            self.assertEqual(lines, made + header)


if __name__ == "__main__":
    merkel_program.main()
