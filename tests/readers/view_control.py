"""The requests of a page, and their permissions."""
import itertools
import json
import os
import re
import signal
import time

import merkel_program
from view_page import LIVE_PRESS, Page
from web_socket import WebSocket
from xdf_reader import Xdf


class Control(Page):
    def steer(self, *more, **probe):
        """Starts a run that pages may control. Returns the program and its token."""
        program, address = super().steer(*more, **probe)
        return program, re.search(r"\?token=([0-9a-f]{32})$", address).group(1)

    def test_marks_and_recordings_need_the_token_and_reach_the_session(self):
        session = self.path("whole.xdf")
        # Longer than the test needs on any host: it ends the run itself.
        program, token = self.steer("--sink", f"xdf:{session}", probe=LIVE_PRESS.replace("count=20", "count=400"))
        with WebSocket(self.port) as stranger, WebSocket(self.port, token="0" * 32) as liar, \
                WebSocket(self.port, token=token) as owner:
            for client, allowed in ((stranger, False), (liar, False), (owner, True)):
                self.assertEqual(json.loads(client.receive()[1])["control"], allowed)
            frames = owner.frames()
            next(frames)
            stranger.send("mark stranger")
            liar.send("mark liar")
            liar.send("record start")
            owner.send("mark trial 1, left")
            owner.send("tare 0")
            self.assertTrue(any("cannot be tared" in news.get("label", "")
                                for frame in itertools.islice(frames, 50) for news in frame.news))
            owner.send("record start")
            recording = next(frame for frame in frames if frame.flags & 4)
            for frame in frames:
                if frame.time_s > recording.time_s + 1.0:
                    break
            owner.send("mark in the recording")
            owner.send("record stop")
            next(frame for frame in frames if not frame.flags & 4)
            program.send_signal(signal.SIGINT)
            rest = list(frames)
        self.assertTrue(rest[-1].over)
        self.assertFalse(rest[-1].flags & 4)
        summary = self.summary(program)
        for sink in summary["sinks"]:
            self.assertEqual(sink["delivered"], summary["spikes"], sink)
        marks = Xdf(session).streams["merkel.marks"]
        self.assertEqual([label for label, in marks.samples], ["trial 1, left", "in the recording"])
        ticks = Xdf(session).streams["merkel.ticks"]
        self.assertGreater(marks.stamps[1], marks.stamps[0])
        self.assertLess(marks.stamps[1], ticks.stamps[-1])
        (recorded,) = [name for name in os.listdir(self._folder.name) if name.startswith("session-")]
        part = Xdf(self.path(recorded))
        self.assertTrue(part.whole)
        self.assertGreater(len(part.streams["merkel.ticks"].samples), 500)
        self.assertLess(len(part.streams["merkel.ticks"].samples), len(ticks.samples))
        # It starts in the middle of a run, so it cannot be simulated again.
        done = merkel_program.run("replay", self.path(recorded))
        self.assertEqual(done.returncode, 1)
        self.assertIn("starts at tick", done.stdout)

    @merkel_program.long
    def test_a_watched_afferent_sends_its_drive_and_potential(self):
        program = self.serve(probe="sim:ramp?depth_mm=1.8&hold_s=3")
        samples = {8: [], 13: []}
        with WebSocket(self.port) as client:
            client.receive()
            client.send("watch 8 13 999")
            for frame in client.frames():
                for neuron, some in frame.watched.items():
                    samples[neuron] += [(frame.time_s - before, drive, volts) for before, drive, volts in some]
        self.summary(program)
        for neuron, all_of_it in samples.items():
            self.assertGreater(len(all_of_it), 1000)
            self.assertTrue(all(a[0] < b[0] for a, b in zip(all_of_it, all_of_it[1:])), neuron)
            self.assertGreater(max(drive for _, drive, _ in all_of_it), 1.0)
            self.assertGreater(max(volts for *_, volts in all_of_it), 0.0)    # spikes
            self.assertLess(min(volts for *_, volts in all_of_it), -60.0)

    def test_a_device_is_tared_and_its_unplugging_is_seen(self):
        device = self.plug_in("--unplug-s", "3", "--unplug-for-s", "1.5")
        program, token = self.steer("--duration-s", "8", probe=device)
        links, notices = set(), []
        with WebSocket(self.port, token=token) as owner:
            owner.receive()
            frames = owner.frames()
            next(frame for frame in frames if frame.points)  # the run has started
            owner.send("tare 0")
            for frame in frames:
                links.add(frame.probes[0][-1] >> 8)
                notices += [news["label"] for news in frame.news if news["kind"] == "mark"]
        self.summary(program, {"unplugged"})
        self.assertEqual(links, {1, 2})  # connected and unplugged
        self.assertEqual(notices, ["tare probe 1"])

    @merkel_program.long
    def test_a_session_is_played_with_seeks(self):
        session = self.path("s.xdf")
        self.merkel("run", "--fast", "--probe", "sim:taps?interval_s=0.25&tap_s=0.2&count=20",
                    "--sink", f"xdf:{session}")
        program = self.play(session, "--from-s", "1")
        with WebSocket(self.port) as client:
            scene = json.loads(client.receive()[1])
            self.assertGreater(scene["session"]["length_s"], 5.0)
            frames = client.frames()
            first = next(frame for frame in frames if frame.points)
            self.assertGreaterEqual(first.time_s, 1.0)
            began = time.monotonic()
            last = next(frame for frame in frames if frame.time_s > first.time_s + 1.0)
            self.assertAlmostEqual(time.monotonic() - began, last.time_s - first.time_s, delta=0.7)
            client.send("seek 4")
            jump = next(frame for frame in frames if frame.flags & 2)
            self.assertAlmostEqual(jump.time_s, 4.0, delta=0.3)
            client.send("pause")
            next(frame for frame in frames if frame.flags & 8)
            client.send("seek 0.5")
            back = next(frame for frame in frames if frame.flags & 2)
            self.assertAlmostEqual(back.time_s, 0.5, delta=0.2)
            self.assertTrue(back.flags & 8)
            client.send("play")
            next(frame for frame in frames if frame.time_s > back.time_s + 0.3)
            program.terminate()
            frames = list(frames)
        self.assertTrue(frames[-1].over)
        program.wait()
        self.assertEqual(program.returncode, 0)
        # Exported to a file, it has the same spikes.
        whole, played = self.path("whole.csv"), self.path("played.csv")
        self.merkel("replay", session, "--sink", f"csv:{whole}")
        self.merkel("replay", session, "--realtime", "--sink", f"csv:{played}")
        self.assertEqual(merkel_program.spikes_of_csv(played), merkel_program.spikes_of_csv(whole))
        for wrong in (["--from-s", "1"], ["--realtime"], ["--realtime", "--json", "--sink", "csv:-"],
                      ["--realtime", "--from-s", "99", "--sink", "csv:-"]):
            self.assertEqual(merkel_program.run("replay", session, *wrong).returncode, 2, wrong)
