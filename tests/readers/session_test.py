"""Sessions, as a reader sees them that merkel's authors have not written the code of."""
import os
import signal
import time

import merkel_program
from merkel_program import spikes_of_csv
from xdf_reader import Xdf


class Session(merkel_program.TestCase):
    def test_an_independent_reader_finds_all_that_happened(self):
        trace, session, csv = "tests/traces/faulty.csv", self.path("s.xdf"), self.path("s.csv")
        self.merkel("run", "--fast", "--probe", f"replay:{trace}", "--sink", f"xdf:{session}",
                    "--sink", f"csv:{csv}")
        xdf = Xdf(session)
        self.assertTrue(xdf.whole)
        facts = xdf.header.find("merkel")
        for name in ("version", "git_hash", "scene_text", "receptor_seed", "network_seed", "kernel",
                     "kernel_realtime", "simd_target", "clock_monotonic_ns", "clock_utc_ns"):
            self.assertTrue(facts.findtext(name), name)
        self.assertLess(abs(int(facts.findtext("clock_utc_ns")) * 1e-9 - time.time()), 3600)

        spikes = xdf.streams["merkel.spikes"]
        self.assertEqual(list(zip(spikes.column("time_ns"), spikes.column("neuron"))),
                         spikes_of_csv(csv))
        self.assertGreater(len(spikes.samples), 20)
        for stamp, time_ns in zip(spikes.stamps, spikes.column("time_ns")):
            self.assertAlmostEqual(stamp, time_ns * 1e-9, places=9)

        with open(trace) as lines:
            rows = [line.split(",") for line in lines if line[0] != "#"][1:]
        samples = xdf.streams["merkel.samples"]
        self.assertEqual(samples.column("depth_mm"), [float(row[1]) for row in rows])
        ticks = xdf.streams["merkel.ticks"]
        self.assertEqual(ticks.column("number"), list(range(1, len(ticks.samples) + 1)))
        kinds = xdf.streams["merkel.events"].column("kind")
        self.assertEqual(kinds.count(0), 6)  # releases
        for stream in xdf.streams.values():
            self.assertEqual(int(stream.footer.findtext("sample_count")), len(stream.samples))

    def test_record_writes_a_session_of_samples_alone(self):
        session = self.path("r.xdf")
        self.merkel("record", "sim:taps?force_N=0.5&count=2", session)
        xdf = Xdf(session)
        self.assertIn("merkel record", xdf.header.find("merkel").findtext("command"))
        samples = xdf.streams["merkel.samples"]
        self.assertGreater(len(samples.samples), 500)
        self.assertAlmostEqual(max(samples.column("force_mN")), 500, places=0)
        self.assertEqual(xdf.streams["merkel.ticks"].samples, [])
        done = self.merkel("replay", session, exit_code=2)
        self.assertIn("without a simulation", done.stderr)

    def test_a_killed_run_is_readable_and_replays(self):
        session = self.path("s.xdf")
        program = merkel_program.start("run", "--probe", "sim:taps?interval_s=0.2&tap_s=0.1&count=500",
                                       "--sink", f"xdf:{session}")
        part = session + ".part"
        # While it runs, the file reads well too.
        self.assertTrue(merkel_program.wait_for(
            lambda: os.path.exists(part) and os.path.getsize(part) > 10_000 and
            len(Xdf(part).streams["merkel.ticks"].samples) > 300))
        program.send_signal(signal.SIGKILL)
        program.communicate()
        done = self.merkel("replay", part)
        self.assertIn("bit-identical", done.stdout)
        self.assertIn("broke off", done.stdout)


if __name__ == "__main__":
    merkel_program.main()
