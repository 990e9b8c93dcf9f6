#!/usr/bin/env python3
"""Files of merkel, opened by programs that Debian does not have: each test runs where its client can be imported.

Neo, which Debian has, reads NWB only with pynwb. `PYTHONPATH=FOLDER… tests/readers/clients_test.py` runs it with
unpacked sources."""
import importlib
import importlib.metadata
import logging
import os
import pathlib
import re
import shutil
import signal
import subprocess

import numpy as np

import merkel_program
from merkel_program import free_port, spikes_of_csv, start
from web_socket import WebSocket
from xdf_reader import Xdf

OCTAVE, LOAD_XDF = shutil.which("octave-cli"), os.environ.get("MERKEL_LOAD_XDF")
LIBXDF = os.environ.get("MERKEL_LIBXDF_READER")
MARKS = ["trial 1, left", "<b> & \"größer\""]
FACTS = ("experiment_description=A press of five fingertips&experimenter=Doe, Jane&institution=A University&lab=Touch&subject_id=model-1&species=Homo sapiens&sex=U"
         "&age=P30Y")


class Clients(merkel_program.TestCase):
    def client(self, name):
        try:
            module = importlib.import_module(name)
            package = name.split(".")[0]
            version = getattr(module, "__version__", None) or importlib.metadata.version(package)
            print(f"{package} {version}", flush=True)
            return module
        except ImportError as error:
            self.skipTest(str(error))

    def record(self, scheme, facts=FACTS):
        """A file of a run with several probes, patches and electrodes; its spikes."""
        file = self.path("s." + scheme)
        self.merkel("run", "tools/examples/hand_electrodes.toml", "--fast", "--duration-s", "1.5", "--sink",
                    f"{scheme}:{file}{facts and '?' + facts}", "--sink", "csv:" + self.path("s.csv"), "--overwrite")
        spikes = spikes_of_csv(self.path("s.csv"))
        self.assertGreater(len(spikes), 500)
        return file, spikes

    def test_pynwb_validates_and_reads_nwb(self):
        pynwb = self.client("pynwb")
        file, spikes = self.record("nwb", FACTS + "&keywords=touch;SA1")
        with pynwb.NWBHDF5IO(file, "r") as io:
            self.assertEqual(pynwb.validate(io=io), [])
            content = io.read()
            rows = [(round(time * 1e9), unit + 1) for unit, times in enumerate(content.units["spike_times"][:])
                    for time in times]
            self.assertEqual(sorted(rows), sorted(spikes))
            self.assertEqual(list(content.keywords), ["touch", "SA1"])
            self.assertIn("electrode_thumb-1_amplitude", content.stimulus)

    def test_nwbinspector_finds_nothing_to_suggest(self):
        inspector = self.client("nwbinspector")
        facts = FACTS + "&keywords=touch;SA1"
        file, _ = self.record("nwb", facts)
        session, exported, replayed = self.two_probes(), self.path("exported.nwb"), self.path("replayed.nwb")
        self.merkel("export", session, "--sink", f"nwb:{exported}?{facts}")
        self.merkel("replay", session, "--sink", f"nwb:{replayed}?{facts}")
        for each in (file, exported, replayed):
            with self.subTest(each):
                found = inspector.inspect_nwbfile(nwbfile_path=each, config=inspector.load_config("dandi"))
                # The subject is a model: there is no paper on it yet.
                self.assertEqual({(one.importance.name, one.check_function_name, one.location, one.message) for one in found
                                      if one.check_function_name != "check_doi_publications"}, set())

    def test_neo_reads_nwb(self):
        self.client("pynwb")
        neo = self.client("neo")
        # Neo 0.14.5 refuses every file with keywords, also of pynwb itself: it takes no lists of a file as annotations.
        file, spikes = self.record("nwb")
        block, = neo.io.NWBIO(file, "r").read_all_blocks()
        times = [round(float(time) * 1e9) for segment in block.segments for train in segment.spiketrains
                 for time in train.rescale("s").magnitude]
        self.assertEqual(sorted(times), sorted(time for time, _ in spikes))

    def test_spikeinterface_reads_nwb_and_phy(self):
        extractors = self.client("spikeinterface.extractors")
        for scheme in ("nwb", "phy"):
            with self.subTest(scheme):
                file, spikes = self.record(scheme, FACTS if scheme == "nwb" else "")
                sorting = (extractors.NwbSortingExtractor(file_path=file, sampling_frequency=1e6, t_start=0.0)
                           if scheme == "nwb" else extractors.PhySortingExtractor(file))
                self.assertEqual(sorting.sampling_frequency, 1e6)
                frames = [(frame, unit + 1 if scheme == "nwb" else int(unit)) for unit in sorting.unit_ids
                          for frame in sorting.get_unit_spike_train(unit, segment_index=0)]
                self.assertEqual(len(frames), len(spikes))
                expected = sorted(spikes, key=lambda spike: (spike[1], spike[0]))
                for (frame, unit), (time, neuron) in zip(sorted(frames, key=lambda f: (f[1], f[0])), expected):
                    self.assertEqual(unit, neuron)
                    self.assertLessEqual(abs(int(frame) * 1000 - time), 501)

    def test_phylib_loads_phy(self):
        model = self.client("phylib.io.model")
        folder, spikes = self.record("phy", "")
        loaded = model.load_model(folder + "/params.py")
        self.assertEqual(loaded.n_spikes, len(spikes))
        np.testing.assert_allclose(loaded.spike_times, [time * 1e-9 for time, _ in spikes], rtol=0, atol=501e-9)
        np.testing.assert_array_equal(loaded.spike_clusters, [neuron for _, neuron in spikes])

    def test_pyxdf_reads_every_stream_without_a_warning(self):
        pyxdf = self.client("pyxdf")
        file, spikes = self.record("xdf", "")
        for options in ({}, {"dejitter_timestamps": False}):
            with self.assertNoLogs("pyxdf", logging.WARNING):
                streams, _ = pyxdf.load_xdf(file, **options)
            own = Xdf(file).streams
            self.assertEqual(sorted(each["info"]["name"][0] for each in streams), sorted(own))
            for each in streams:
                stream = own[each["info"]["name"][0]]
                np.testing.assert_allclose(each["time_stamps"], stream.stamps, rtol=0, atol=1e-6)
                self.assertTrue(np.array_equal(np.asarray(each["time_series"]).tolist(), [list(row) for row in stream.samples]))
            read = next(each for each in streams if each["info"]["name"][0] == "merkel.spikes")
            self.assertEqual([(round(stamp * 1e9), int(row[1])) for stamp, row in
                              zip(read["time_stamps"], read["time_series"])], spikes)

    def check_streams(self, printed, file, to_the_bit):
        """What a reader printed of a session, and wrote as numbers, against merkel's own."""
        read = [line.split()[1:] for line in printed.splitlines() if line.startswith("stream ")]
        own = Xdf(file).streams
        self.assertEqual(sorted(name for _, name, *_ in read), sorted(own))
        for number, name, rate, channels, samples in read:
            stream = own[name]
            self.assertEqual(float(rate), stream.rate)
            if name == "merkel.marks" and int(samples) == 0:
                continue  # libxdf keeps strings as events
            self.assertEqual(int(samples), len(stream.stamps), name)
            times, values = (self.path(f"{number}.{part}") for part in ("times", "values"))
            np.testing.assert_allclose(np.fromfile(times), stream.stamps, rtol=0, atol=1e-6)
            if name == "merkel.marks":
                self.assertEqual(pathlib.Path(values).read_text().splitlines(), MARKS)
                continue
            expected = np.array(stream.samples, dtype=float)
            np.testing.assert_array_equal(np.fromfile(values).reshape(-1, int(channels)),
                                          expected if to_the_bit else expected.astype(np.float32))
        self.assertEqual({own[name].rate for name in ("merkel.ticks", "merkel.ticks.1")}, {0})

    def two_probes(self):
        """The session of a live run with two probes, and marks that were set on its page."""
        file, port = self.path("s.xdf"), free_port()
        program = start("run", "finger", "--probe", "sim:taps?count=1000&live=1", "--probe", "sim:sine?x_mm=20&hold_s=600&live=1",
                        "--sink", "xdf:" + file, "--sink", f"view:{port}?control=1")
        token = next(filter(None, (re.search(r"\?token=([0-9a-f]{32})$", line) for line in program.stderr))).group(1)
        with WebSocket(port, token=token) as page:
            page.receive()
            frames = page.frames()
            begin = next(frames).time_s
            for label in MARKS:
                page.send("mark " + label)
            while next(frames).time_s < begin + 1.5:
                pass
            program.send_signal(signal.SIGINT)
            for _ in frames:
                pass
        program.communicate()
        self.assertEqual([label for label, in Xdf(file).streams["merkel.marks"].samples], MARKS)
        return file

    def test_loaders_of_xdf_in_matlab_read_every_stream(self):
        if not OCTAVE or not LOAD_XDF:
            self.skipTest("no octave-cli (Debian: octave), or MERKEL_LOAD_XDF does not name folders with a load_xdf.m: .ci/xdf_readers")
        file = self.two_probes()
        for folder in LOAD_XDF.split(":"):
            with self.subTest(folder):
                done = subprocess.run([OCTAVE, "-q", "tests/readers/matlab_reader.m", folder, file, self.path("")],
                                      capture_output=True, text=True, timeout=120)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.check_streams(done.stdout, file, to_the_bit=True)

    def test_libxdf_reads_every_stream(self):
        if not LIBXDF or not os.path.exists(LIBXDF):
            self.skipTest("merkel was built without libxdf (Debian: libxdf-dev)")
        file = self.two_probes()
        done = subprocess.run([LIBXDF, file, self.path("")], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.check_streams(done.stdout, file, to_the_bit=False)


if __name__ == "__main__":
    merkel_program.main()
