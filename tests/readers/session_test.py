#!/usr/bin/env python3
"""Reads sessions with an independent implementation of the format."""
import os
import signal
import struct
import time
import tomllib

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
        for name in ("version", "git_hash", "scene", "scene_text", "receptor_seed", "network_seed",
                     "afferent_seed", "integrate_and_fire_seed", "kernel",
                     "kernel_realtime", "processors", "simd_target", "method", "precision",
                     "step_ns", "tick_ns", "probe", "probe_name", "clock_monotonic_ns",
                     "clock_utc_ns"):
            self.assertTrue(facts.findtext(name), name)
        self.assertEqual(facts.findtext("probe"), f"replay:{trace}")
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
        ticks, states = xdf.streams["merkel.ticks"], xdf.streams["merkel.tick_states"]
        self.assertEqual(states.column("number")[0], 1)
        # A state is written where it changes: a touch, a release and its end, held ticks, late samples.
        self.assertLess(len(states.samples), len(ticks.samples) / 5)
        self.assertTrue(all(stamp in ticks.stamps for stamp in states.stamps))
        shown = self.merkel("inspect", "session", session, "--stream", "ticks").stdout.splitlines()
        self.assertEqual([int(row.split(",")[0]) for row in shown[1:]], list(range(1, len(ticks.samples) + 1)))
        kinds = xdf.streams["merkel.events"].column("kind")
        self.assertEqual(kinds.count(0), 6)  # releases
        for stream in xdf.streams.values():
            self.assertEqual(int(stream.footer.findtext("sample_count")), len(stream.samples))

    def test_readers_find_its_span_rates_and_clocks(self):
        for probe, *fast in (("replay:tests/traces/taps.csv", "--fast"), ("sim:taps?count=2&live=1",)):
            session = self.path(f"s{len(fast)}.xdf")
            done = merkel_program.run("run", "--json", "--probe", probe, "--sink", f"xdf:{session}", *fast)
            self.live_summary(done.stdout, done.stderr, done.returncode)
            xdf = Xdf(session)
            ticks = xdf.streams["merkel.ticks"]
            # Readers take the smallest and the largest time of all footers as the file's span.
            first = min(float(each.footer.findtext("first_timestamp")) for each in xdf.streams.values())
            last = max(float(each.footer.findtext("last_timestamp")) for each in xdf.streams.values())
            self.assertLess(ticks.stamps[0] - first, 1)
            self.assertLess(last - ticks.stamps[-1], 1)
            self.assertGreaterEqual(last, ticks.stamps[-1] - 1e-6)
            for stamp in xdf.streams["merkel.status"].stamps:
                self.assertTrue(first <= stamp <= last)
            for stream in xdf.streams.values():
                # Readers bend the stamps of a regular stream around gaps, refuse a stream without a
                # description (FieldTrip), and crash on one without samples (libxdf 0.99.8).
                self.assertEqual(stream.rate, 0)
                self.assertIsNotNone(stream.description.find("channels/channel/label"))
                self.assertGreater(len(stream.samples), 0)
                # EEGLAB treats a stream of this type as markers of one channel: there must be only one.
                self.assertEqual(stream.type in ("Events", "Markers"), stream.name == "merkel.marks")
                self.assertGreaterEqual(len(stream.clock_offsets), 1)
                self.assertTrue(all(offset == 0 for _, offset in stream.clock_offsets))
                # pyxdf draws a line through them.
                times = [time for time, _ in stream.clock_offsets]
                self.assertEqual(len(set(times)), len(times))
            self.check_positions(xdf)
            afferents = xdf.header.find("merkel").findtext("afferents").splitlines()
            self.assertEqual(afferents[0], "neuron,patch,x_mm,y_mm,field_radius_mm,receptors")
            self.assertEqual(len(afferents), 21)

    def check_positions(self, xdf):
        """In the description of the spikes, where pyxdf shows them."""
        described = xdf.streams["merkel.spikes"].description.findall("afferents/afferent")
        rows = xdf.header.find("merkel").findtext("afferents").splitlines()
        self.assertEqual([",".join(field.text for field in each) for each in described], rows[1:])
        self.assertEqual(",".join(field.tag for field in described[0]), rows[0])

    def test_each_probe_has_its_own_ticks_and_samples(self):
        session = self.path("two.xdf")
        self.merkel("run", "finger", "--probe", "sim:taps?force_N=0.5&count=4", "--probe",
                    "sim:ramp?force_N=0.3&hold_s=1", "--sink", "xdf:" + session, "--fast")
        xdf = Xdf(session)
        for name in ("merkel.ticks", "merkel.ticks.1"):
            ticks = xdf.streams[name]
            self.assertGreater(len(ticks.samples), 1000)
            self.assertLess(max(abs(b - a - 0.001) for a, b in zip(ticks.stamps, ticks.stamps[1:])), 1e-6)
        self.assertEqual(len(xdf.streams["merkel.ticks"].samples), len(ticks.samples))
        self.assertEqual(xdf.streams["merkel.ticks.1"].labels, ["latency_ns", "force_mN", "delay_ns"])
        self.assertIn("bit-identical", self.merkel("replay", session).stdout)

    def test_a_killed_run_of_two_probes_replays(self):
        session = self.path("k.xdf")
        program = merkel_program.start("run", "--probe", "sim:taps?count=500&live=1", "--probe",
                                       "sim:taps?count=500&live=1", "--sink", "xdf:" + session)
        part = session + ".part"
        self.assertTrue(merkel_program.wait_for(
            lambda: os.path.exists(part) and os.path.getsize(part) > 10_000 and
            "merkel.ticks.1" in Xdf(part).streams and len(Xdf(part).streams["merkel.ticks.1"].samples) > 300))
        program.send_signal(signal.SIGKILL)
        program.communicate()
        self.assertIn("bit-identical", self.merkel("replay", part).stdout)

    def test_an_hour_of_a_kilohertz_probe_takes_less_than_half_a_gigabyte(self):
        device = merkel_program.start("simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv",
                                      "--link", self.path("tty"), "--repeat")
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(self.path("tty"))))
        for frames in (0, 1):
            session = self.path(f"s{frames}.xdf")
            run = merkel_program.run("run", "--probe", f"serial:{self.path('tty')}?protocol=hbf1", "--duration-s", "4",
                                     "--sink", f"xdf:{session}?frames={frames}")
            self.assertTrue(os.path.exists(session), run.stderr)
            xdf = Xdf(session)
            ticks, samples = xdf.streams["merkel.ticks"], xdf.streams["merkel.samples"]
            kB_per_s = sum(xdf.sizes[tag] for tag in (3, 4)) / (ticks.stamps[-1] - ticks.stamps[0]) / 1000
            print(f"\na 1 kHz probe, frames={frames}: {kB_per_s:.0f} kB/s")
            if frames:
                self.assertGreaterEqual(sum(xdf.streams["merkel.frames"].column("parsed")), len(samples.samples))
            else:
                self.assertNotIn("merkel.frames", xdf.streams)
                self.assertLess(kB_per_s, 120)

    def test_record_writes_a_session_of_samples_alone(self):
        session = self.path("r.xdf")
        self.merkel("record", "sim:taps?force_N=0.5&count=2", session)
        xdf = Xdf(session)
        self.assertIn("merkel record", xdf.header.find("merkel").findtext("command"))
        samples = xdf.streams["merkel.samples"]
        self.assertGreater(len(samples.samples), 500)
        self.assertAlmostEqual(max(samples.column("force_mN")), 500, places=0)
        self.assertNotIn("merkel.ticks", xdf.streams)
        done = self.merkel("replay", session, exit_code=2)
        self.assertIn("without a simulation", done.stderr)

    def test_a_devices_bytes_its_calibration_and_the_rights_of_the_loop_are_in_it(self):
        calibration = self.path("gauge.toml")
        with open(calibration, "w") as file:
            file.write('serial_number = "SIM1"\ndate = "2026-01-02T03:04:05Z"\n'
                       '[depth]\nsource = "depth"\ngain = 1.25\nzero = 0.5\n')
        device = merkel_program.start("simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv",
                                      "--link", self.path("tty"))
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(self.path("tty"))))
        session = self.path("s.xdf")
        done = merkel_program.run(
            "run", "--probe", f"serial:{self.path('tty')}?protocol=hbf1&calibration={calibration}",
            "--duration-s", "0.5", "--sink", f"xdf:{session}?frames=1", "--json")
        summary = self.live_summary(done.stdout, done.stderr, done.returncode)
        loop = summary["loop"]
        xdf = Xdf(session)
        facts = xdf.header.find("merkel")
        self.assertEqual(facts.findtext("probe_serial_number"), "SIM1")
        self.assertEqual(facts.findtext("probe_calibration_file"), calibration)
        applied = tomllib.loads(facts.findtext("probe_calibration"))
        self.assertEqual(applied["date"], "2026-01-02T03:04:05Z")
        self.assertEqual(applied["serial_number"], "SIM1")
        self.assertEqual((applied["depth"]["gain"], applied["depth"]["zero"]), (1.25, 0.5))

        status = xdf.streams["merkel.status"]
        last = dict(zip(status.labels, status.samples[-1]))
        self.assertEqual(last["scheduling_class"], 1 if loop["scheduler"] == "fifo" else 0)
        self.assertEqual(last["priority"], loop["priority"] if loop["scheduler"] == "fifo" else 0)
        self.assertEqual(last["locked_memory_kB"] > 0, loop["memory_locked"])
        self.assertEqual(last["cpu_awake"] == 1, loop["cpu_awake"])
        self.assertIn("cpu", last)
        self.assertGreaterEqual(last["timer_slack_ns"], 0)
        self.assertEqual(last["lost_frames"], 0)

        # Frames of this protocol end with a zero byte.
        frames = xdf.streams["merkel.frames"]
        words = frames.labels.index("bytes_0")
        self.assertEqual(frames.column("kind")[0], 2)  # opened
        self.assertIn(3, frames.column("kind"))        # started
        received, parsed, damaged = b"", 0, 0
        for row in frames.samples:
            values = dict(zip(frames.labels, row))
            if values["kind"] == 0:
                received += struct.pack("<8q", *row[words:])[:values["length"]]
                parsed += values["parsed"]
                damaged += values["damaged"]
        whole = [frame for frame in received.split(b"\0")[:-1] if frame]
        # The first may be the rest of a frame, which is neither.
        self.assertIn(len(whole) - parsed - damaged, (0, 1))
        # A terminal that nobody reads for a while loses bytes: what is damaged is a part of what is lost.
        self.assertEqual(damaged, summary["device_damaged"])
        self.assertLessEqual(damaged, summary["device_lost"])
        self.assertGreater(parsed, len(xdf.streams["merkel.samples"].samples))
        for stamp, time_ns in zip(frames.stamps, frames.column("time_ns")):
            self.assertAlmostEqual(stamp, time_ns * 1e-9, places=6)

    def test_a_killed_run_is_readable_and_replays(self):
        session = self.path("s.xdf")
        program = merkel_program.start("run", "--probe", "sim:taps?interval_s=0.2&tap_s=0.1&count=500",
                                       "--sink", f"xdf:{session}")
        part = session + ".part"
        # The file can also be read during the run.
        self.assertTrue(merkel_program.wait_for(
            lambda: os.path.exists(part) and os.path.getsize(part) > 10_000 and "merkel.ticks" in Xdf(part).streams and
            len(Xdf(part).streams["merkel.ticks"].samples) > 300))
        program.send_signal(signal.SIGKILL)
        program.communicate()
        done = self.merkel("replay", part)
        self.assertIn("bit-identical", done.stdout)
        self.assertIn("is incomplete", done.stdout)


if __name__ == "__main__":
    merkel_program.main()
