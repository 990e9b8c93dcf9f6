"""Tests the live page in a browser and with misbehaving clients."""
import itertools
import json
import os
import re
import socket
import struct
import subprocess
import time
import unittest

import browser
import merkel_program
from merkel_program import free_port, start
from web_socket import WebSocket, request
from xdf_reader import Xdf

SLIDE = "sim:slide?depth_mm=1.8&x_mm=3&y_mm=10&to_x_mm=27&to_y_mm=10&speed_mm_per_s=3"
PRESS = "sim:taps?interval_s=0.25&tap_s=0.2&count=12"


ELECTRODES = """[[electrode]]
name = "train"
encoder = "linear"
field_mm = [15, 10, 5]
full_force_N = 0.1
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[[electrode]]
name = "pulses"
encoder = "pulse_per_spike"
field_mm = [15, 10, 8]
amplitude_uA = [60, 60]
frequency_Hz = [0, 300]
[stimulation]
max_charge_nC = 16
max_total_uA = 200
"""


class Page(merkel_program.TestCase):
    def serve(self, *more, probe=PRESS):
        self.port = free_port()
        return self.serve_again(*more, probe=probe)

    def serve_again(self, *more, probe=PRESS):
        probes = [word for uri in ([probe] if isinstance(probe, str) else probe) for word in ("--probe", uri)]
        program = start("run", *more, *probes, "--json", "--sink", f"view:{self.port}")
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
        return program

    def listening(self):
        try:
            return request(self.port)[0] == 200
        except ConnectionError:
            return False

    def summary(self, program):
        out, err = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 0, err)
        return json.loads(out)


class Protocol(Page):
    def test_a_client_gets_the_scene_and_then_frames_up_to_the_last_spike(self):
        program = self.serve()
        with WebSocket(self.port) as client:
            self.assertEqual(client.status, 101)
            opcode, hello = client.receive()
            self.assertEqual(opcode, 1)
            scene = json.loads(hello)
            self.assertEqual(scene["scene"], "paper")
            self.assertEqual(scene["neurons"], 20)
            self.assertEqual(len(scene["patches"][0]["receptors"]), 450)
            self.assertEqual(len(scene["patches"][0]["centres"]), 20)
            self.assertEqual(scene["probes"][0]["radius_mm"], 2)
            frames = list(client.frames())
        summary = self.summary(program)
        self.assertTrue(frames[-1].over)
        counters = dict(zip((each["name"] for each in scene["counters"]), frames[-1].counters))
        self.assertEqual(counters["spikes"], summary["spikes"])
        self.assertEqual(counters["ticks"], summary["ticks"])
        self.assertEqual(sum(frames[-1].latency), summary["ticks"])
        self.assertGreater(summary["spikes"], 20)
        if frames[-1].missed == 0:
            self.assertEqual(sum(len(frame.spikes) for frame in frames), summary["spikes"])
        # The contact is drawn to scale: a² = R·d for a sphere.
        pressed = max((frame.probes[0] for frame in frames), key=lambda probe: probe[0])
        self.assertAlmostEqual(pressed[4] ** 2, 2.0 * pressed[0], places=4)

    def test_pages_of_other_sites_are_kept_out(self):
        program = self.serve()
        for origin, status in (("http://evil.example", 403), (f"http://127.0.0.1:{self.port}", 101)):
            with WebSocket(self.port, origin) as client:
                self.assertEqual(client.status, status)
        # A name that resolves to this host, as in DNS rebinding.
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)
        self.assertEqual(request(self.port, Host=f"localhost:{self.port}")[0], 200)
        self.assertEqual(request(self.port, "/../../etc/passwd")[0], 404)
        self.assertEqual(request(self.port, "/main.js", method="POST")[0], 405)
        self.assertIn(b"MIT", request(self.port, "/uPlot.LICENSE")[1])
        program.terminate()

    def test_junk_and_clients_that_never_read_do_not_block_others(self):
        program = self.serve("--sink", "csv:" + self.path("s.csv"))
        stuck = [self.enterContext(WebSocket(self.port, receive_buffer=2048)) for _ in range(10)]
        dead = WebSocket(self.port)
        dead.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        dead.socket.close()  # by reset
        for junk in (b"\xff" * 5000, os.urandom(4000),
                     b"\x82\xff" + b"\x7f" + b"\xff" * 7 + b"mask" + b"x" * 100,  # 2⁶³ bytes
                     b"\x01\x05abcde",                                          # no mask
                     b"\x88\x80mask"):                                          # goodbye
            client = self.enterContext(WebSocket(self.port))
            try:
                client.socket.sendall(junk)
            except ConnectionError:
                pass
        for junk in (b"\x00" * 100, b"GET / HTTP/9.9\r\n\r\n", b"GET " + b"a" * 20000,
                     b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n"):
            with socket.create_connection(("127.0.0.1", self.port)) as raw:
                try:
                    raw.sendall(junk)
                    raw.shutdown(socket.SHUT_WR)
                    raw.recv(100)
                except OSError:  # the server has closed the connection
                    pass
        with WebSocket(self.port) as good:
            frames = list(good.frames())
        self.assertTrue(frames[-1].over)
        summary = self.summary(program)
        self.assertEqual(summary["gaps"], 0)
        for sink in summary["sinks"]:
            self.assertEqual(sink["delivered"], summary["spikes"], sink)
            self.assertEqual(sink["dropped"], 0)
        self.assertEqual(len(stuck), 10)



class Peers(Page):
    """Clients on the network or on this machine that request too much."""

    def test_slow_connections_do_not_deny_the_page(self):
        program = self.serve(probe="sim:taps?interval_s=0.25&tap_s=0.2&count=40")
        slow = [socket.create_connection(("127.0.0.1", self.port)) for _ in range(64)]
        for each in slow:
            self.addCleanup(each.close)
            each.sendall(b"GET / HTTP/1.1\r\n")  # an incomplete request
        for _ in range(5):
            self.assertEqual(request(self.port)[0], 200)
        with WebSocket(self.port) as client:
            self.assertEqual(client.status, 101)
        program.terminate()

    def test_connections_leave_descriptors_to_the_devices(self):
        limit = "ulimit -n 300; exec \"$@\""
        self.port = free_port()
        program = subprocess.Popen(
            ["sh", "-c", limit, "sh", merkel_program.PROGRAM, "run", "--probe",
             "sim:taps?interval_s=0.25&tap_s=0.2&count=40", "--sink", f"view:{self.port}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
        idle = []
        for _ in range(290):
            idle.append(socket.create_connection(("127.0.0.1", self.port)))
            self.addCleanup(idle[-1].close)
        folder = f"/proc/{program.pid}/fd"
        self.assertTrue(merkel_program.wait_for(lambda: len(os.listdir(folder)) < 150))
        self.assertEqual(request(self.port)[0], 200)

    def test_a_loopback_page_checks_the_host_even_where_remote_sinks_are_allowed(self):
        program = self.serve("--allow-remote")
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)
        self.assertEqual(request(self.port, Host="192.0.2.1:80")[0], 403)
        self.assertEqual(request(self.port, Host=f"localhost:{self.port}")[0], 200)
        program.terminate()

    def test_a_page_for_others_answers_to_addresses_and_not_to_foreign_names(self):
        self.port = free_port()
        program = start("run", "--probe", PRESS, "--sink", f"view:0.0.0.0:{self.port}", "--allow-remote")
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
        self.assertEqual(request(self.port, Host="192.0.2.1:80")[0], 200)
        self.assertEqual(request(self.port, Host=socket.gethostname())[0], 200)
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)

    def test_requests_that_make_no_sense_are_ignored(self):
        program = self.serve()
        with WebSocket(self.port) as client:
            for text in ("", " ", "watch 1 2 3 4 5 6", "watch -1", "watch 99999999999", "watch 4000000000",
                         "tare", "tare 0", "tare 99", "mark " + "x" * 900, "seek nan", "seek -1", "record",
                         "hold", "play", "record start"):
                client.send(text)
            frames = list(client.frames())
        self.assertTrue(frames[-1].over)
        summary = self.summary(program)
        self.assertGreater(summary["spikes"], 20)



class Control(Page):
    """The requests of a page, and their permissions."""
    LIVE = "sim:taps?interval_s=0.25&tap_s=0.2&count=20&live=1"

    def steer(self, *more, probe=LIVE):
        """Starts a run that pages may control. Returns its token."""
        self.port = free_port()
        program = start("run", *more, "--probe", probe, "--json", "--sink",
                        f"view:{self.port}?control=1", cwd=self._folder.name)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        line = program.stderr.readline()
        while "live page" not in line:
            line = program.stderr.readline()
        token = re.search(r"\?token=([0-9a-f]{32})$", line.strip()).group(1)
        self.assertTrue(merkel_program.wait_for(self.listening))
        return program, token

    def test_marks_and_recordings_need_the_token_and_reach_the_session(self):
        session = self.path("whole.xdf")
        program, token = self.steer("--sink", f"xdf:{session}")
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
        link = self.path("probe")
        device = start("simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv", "--repeat", "--link", link,
                       "--unplug-s", "3", "--unplug-for-s", "1.5")
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(link)))
        program, token = self.steer("--duration-s", "8", probe=f"serial:{link}?protocol=hbf1")
        links, notices = set(), []
        with WebSocket(self.port, token=token) as owner:
            owner.receive()
            frames = owner.frames()
            next(frame for frame in frames if frame.points)  # the run has started
            owner.send("tare 0")
            for frame in frames:
                links.add(frame.probes[0][5] >> 8)
                notices += [news["label"] for news in frame.news if news["kind"] == "mark"]
        self.summary(program)
        self.assertEqual(links, {1, 2})  # connected and unplugged
        self.assertEqual(notices, ["tare probe 1"])

    def test_a_session_is_played_with_seeks(self):
        session = self.path("s.xdf")
        self.merkel("run", "--fast", "--probe", "sim:taps?interval_s=0.25&tap_s=0.2&count=20",
                    "--sink", f"xdf:{session}")
        self.port = free_port()
        program = start("replay", session, "--realtime", "--from-s", "1", "--sink", f"view:{self.port}")
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
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
            client.send("hold")
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


class InBrowser(Page):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if not browser.available():
            raise unittest.SkipTest("no chromium and chromedriver: tools/install_packages test")
        cls.page = browser.Browser(1280, 800)
        cls.addClassCleanup(cls.page.__exit__)

    def open(self, *more, probe=PRESS, size=(1280, 800)):
        program = self.serve(*more, probe=probe)
        self.page.set_size(*size)
        self.page.open(f"http://127.0.0.1:{self.port}/")
        self.assertTrue(merkel_program.wait_for(lambda: self.page.ask("Boolean(globalThis.merkel?.frame)")))
        return program

    def wait(self, expression):
        self.assertTrue(merkel_program.wait_for(lambda: self.page.ask(expression)), expression)

    def assert_no_errors(self):
        # The browser logs every failed connection to an absent server, and must log nothing else.
        self.assertEqual([e for e in self.page.errors() if "ERR_CONNECTION_REFUSED" not in e], [])

    def screenshot(self, name):
        """Saves a screenshot for the documents if MERKEL_SCREENSHOTS names a folder."""
        folder = os.environ.get("MERKEL_SCREENSHOTS")
        if folder:
            self.wait("merkel.frame.t > 4.5")  # a window full of spikes
            self.page.screenshot(os.path.join(folder, name))

    def test_the_page_draws_a_known_replay_and_finds_the_next_run(self):
        painted = ("(() => { const c = document.getElementById('%s'); const d = c.getContext('2d')"
                   ".getImageData(0, 0, c.width, c.height).data; let n = 0; "
                   "for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n; })()")
        program = self.open(probe="replay:tests/traces/taps.csv")
        summary = self.summary(program)
        self.wait(f"document.getElementById('spikes').textContent === '{summary['spikes']}'")
        self.assertEqual(self.page.text("state"), "Run ended")
        self.assertEqual(self.page.text("scene"), "paper")
        for canvas in ("raster", "skin", "latency", "legend"):
            self.assertGreater(self.page.ask(painted % canvas), 500, canvas)
        counters = self.page.text("counters")
        self.assertIn(f"ticks{summary['ticks'] // 1000}\u2009{summary['ticks'] % 1000:03}", counters)
        program = self.serve_again(probe=SLIDE)
        self.wait("document.getElementById('state').textContent === 'Connected, pressing'")
        self.wait("Number(document.getElementById('force').textContent) > 0.4")
        program.terminate()
        program.communicate()
        self.wait("document.getElementById('banner').dataset.level !== 'good'")
        self.assert_no_errors()

    def test_the_first_screen_holds_everything_on_a_desk_and_on_a_phone(self):
        shown = ["state", "force", "depth", "rate", "latency-now", "skin", "trace", "raster"]
        for size in ((1280, 800), (768, 1024), (390, 844)):
            program = self.open("goodwin", probe=SLIDE, size=size)
            self.wait("Number(document.getElementById('clock').textContent) > 0.8")
            for element in shown:
                box = self.page.ask("(({left, right, top, bottom}) => ({left, right, top, bottom}))"
                                    f"(document.getElementById('{element}').getBoundingClientRect())")
                self.assertGreaterEqual(box["left"], 0, (size, element))
                self.assertLessEqual(box["right"], size[0], (size, element))
                self.assertGreater(box["bottom"] - box["top"], 14, (size, element))
                self.assertLessEqual(box["bottom"], size[1], (size, element))
            self.assertLessEqual(self.page.ask("document.documentElement.scrollWidth"), size[0])
            # The raster is aligned with the trace above it.
            margins = self.page.ask("merkel.trace.margins()")
            frame = self.page.ask("merkel.raster.frame(merkel.trace.margins())")
            self.assertAlmostEqual(margins["left"], frame["left"], delta=0.5)
            self.assertAlmostEqual(margins["width"], frame["w"], delta=0.5)
            for theme in ("light", "dark"):
                self.page.set_media("prefers-color-scheme", theme)
                self.wait(f"document.documentElement.dataset.theme === '{theme}'")
                self.screenshot({1280: "live_page", 768: "live_page_tablet", 390: "live_page_phone"}[size[0]]
                                + ("_dark" if theme == "dark" else "") + ".png")
            program.terminate()
        self.page.set_media("prefers-color-scheme", "light")
        self.assert_no_errors()

    def test_electrodes_show_their_commands(self):
        with open(self.path("electrodes.toml"), "w") as scene:
            scene.write(ELECTRODES)
        program = self.open(self.path("electrodes.toml"), probe="sim:ramp?wait_s=0&hold_s=600&live=1")
        self.wait("document.querySelectorAll('.electrode.on').length === 2")
        train, pulses = self.page.ask("[...document.querySelectorAll('.electrode')].map((e) => e.textContent)")
        self.assertRegex(train, r"^train[0-9.]+ µA, [0-9]+ Hz$")
        self.assertRegex(pulses, r"^pulses60\.0 µA, [1-9][0-9]* pulses/s$")
        program.terminate()
        program.communicate()
        self.wait("document.querySelectorAll('.electrode.stopped').length === 2")
        self.assertEqual(self.page.ask("document.querySelector('.electrode span').textContent"), "off: end")
        self.assert_no_errors()

    def test_the_raster_is_sorted_by_distance_and_hides_the_silent(self):
        program = self.open("goodwin", probe=SLIDE)
        self.wait("merkel.history.spikes.length > 200")
        self.assertEqual(self.page.ask("document.body.dataset.raster"), "density")
        sorted_rows = ("(() => { const {rows, distance} = merkel.order; "
                       "return rows.every((n, i) => i === 0 || distance[rows[i - 1]] <= distance[n]); })()")
        self.assertTrue(self.page.ask(sorted_rows))
        self.assertEqual(self.page.ask("merkel.order.rows.length"), 450)
        self.page.press("h")
        self.wait("merkel.order.rows.length < 450")
        self.page.press(" ")  # Pause: the view stands still.
        self.wait("merkel.paused !== null")
        self.page.ask("(() => { merkel.order.key = ''; merkel.dirty = true; })()")
        self.wait("(() => { const time = merkel.time(), counts = merkel.history.counts(time.from, time.to); "
                  "return merkel.order.rows.every((n) => counts[n - 1] > 0) && "
                  "merkel.order.rows.length === counts.reduce((sum, n) => sum + (n > 0), 0); })()")
        self.page.ask("(() => { const s = document.getElementById('order'); s.value = 'number'; "
                      "s.dispatchEvent(new Event('change')); })()")
        self.wait("merkel.order.rows.every((n, i) => i === 0 || merkel.order.rows[i - 1] < n)")
        self.page.press("h")
        program.terminate()

    def test_a_density_that_is_kept_equals_one_that_is_counted_anew(self):
        program = self.open(probe=PRESS)
        wrong = self.page.ask("""Promise.all([import('/density.js'), import('/history.js')]).then(([{Density}, {Columns}]) => {
          const spikes = new Columns({t: Float64Array, n: Uint32Array}), kept = new Density(), wrong = [];
          let orders = 0, seed = 1, t = 0;
          const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
          const reorder = () => { const rows = Uint32Array.from({length: 300}, (x, i) => i + 1).sort(() => random() - 0.5);
            const rowOf = new Int32Array(301).fill(-1); rows.forEach((n, row) => { rowOf[n] = row; });
            return {rows, rowOf, edges: Float32Array.from({length: 301}, (x, i) => Math.sqrt(i / 300))}; };
          let order = reorder();
          for (let step = 0; step < 400; ++step) {
            const now = t + 0.04;
            while ((t += random() * 0.002) < now) spikes.push({t, n: 1 + Math.floor(300 * random())});
            t = now;
            if (step % 90 === 89) order = reorder();
            if (step === 200) spikes.clear();
            if (step % 7 === 3) continue;    // a skipped picture
            const seconds = step < 300 ? 2 : 5, to = Math.max(seconds, now);
            const window = {spikes, time: {from: to - seconds, to, now, seconds}, order, edges: order.edges, columns: 231, lines: 87};
            kept.update(window);
            const anew = new Density();
            anew.update(window);
            // The first cell may start before the window.
            if (kept.start !== anew.start || kept.counts.some((n, i) => n !== anew.counts[i] && i % kept.width > 0)) wrong.push(step);
          }
          return wrong.join(); })""")
        self.assertEqual(wrong, "")
        program.terminate()

    def test_a_hand_is_drawn_as_a_hand_with_its_probes_named(self):
        program = self.open("hand", probe=6 * ["sim:ramp?hold_s=20"])
        self.wait("merkel.order?.rows.length === 4250")
        self.assertEqual(self.page.ask("merkel.finger.layout.kind"), "hand")
        self.assertEqual(self.page.ask("merkel.scene.probes.map((p) => p.name).join()"),
                         "thumb,index,middle,ring,little,palm")
        # No patch overlaps another.
        self.assertTrue(self.page.ask(
            "merkel.finger.layout.placed.every((a) => [[0, 0], [a.patch.length_mm, 0], "
            "[0, a.patch.width_mm], [a.patch.length_mm, a.patch.width_mm]].every(([x, y]) => { "
            "const {u, v} = a.to(x, y); return merkel.finger.layout.placed.every((b) => { "
            "if (a === b) return true; const p = b.from(u, v); return p.x <= 0 || p.y <= 0 || "
            "p.x >= b.patch.length_mm || p.y >= b.patch.width_mm; }); }))"))
        self.wait("merkel.frame.probes.every((p) => p.depth > 1)")
        self.assertIn("palm 0.45 N", self.page.text("probes"))
        self.assertEqual(self.page.ask("document.body.dataset.raster"), "density")
        self.screenshot("live_page_hand.png")
        self.page.ask("document.querySelectorAll('#probes button')[4].click()")
        self.wait("document.getElementById('force-of').textContent === 'little'")
        program.terminate()
        self.assert_no_errors()

    def test_afferents_are_chosen_by_click_and_by_key_and_pinned(self):
        program = self.open(probe="sim:ramp?depth_mm=1.8&hold_s=30")
        self.wait("merkel.history.spikes.length > 20")
        place = self.page.ask("(() => { const f = merkel.finger, p = f.layout.placed[0], "
                              "[x, y] = p.centre(12), {u, v} = p.to(x, y), at = f.px(u, v), "
                              "box = f.canvas.getBoundingClientRect(); "
                              "return [Math.round(box.x + at.x), Math.round(box.y + at.y)]; })()")
        self.page.click(*place)
        self.wait("document.querySelector('.card h3')?.textContent === 'Afferent 13'")
        self.page.ask("document.querySelector('.card button').click()")  # Pin
        # By keyboard: arrows move from the pointer's position; Enter chooses.
        self.page.ask("document.getElementById('skin').focus()")
        for key in 12 * ["\ue012"] + ["\ue007"]:  # left; Enter
            self.page.press(key)
        self.wait("document.querySelectorAll('.card').length === 2")
        self.assertIn("afferent ", self.page.text("skin-value"))
        self.assertEqual(self.page.ask("merkel.details.chosen[0].pinned"), True)
        self.assertIn("receptors", self.page.ask("document.querySelector('.card p').textContent"))
        self.wait("document.querySelectorAll('.card header span')[1].textContent !== ''")
        # The page receives its drive and potential.
        self.wait("merkel.history.watched.get(13)?.length > 100")
        self.screenshot("live_page_afferents.png")
        for canvas, word in (("raster", "afferent "), ("latency", " ticks")):
            self.page.ask(f"document.getElementById('{canvas}').focus()")
            self.page.press("\ue012")
            self.wait(f"document.getElementById('{canvas}-value').textContent.includes('{word}')")
        self.page.ask("document.activeElement.blur()")
        program.terminate()
        self.assert_no_errors()

    def test_sound_is_off_until_switched_on(self):
        program = self.open(probe=SLIDE)
        self.wait("merkel.history.spikes.length > 20")
        self.assertEqual(self.page.ask("[merkel.sound.on, Boolean(merkel.sound.audio)].join()"), "false,false")
        self.page.press("s")
        self.wait("merkel.sound.clicks > 10")
        self.page.ask("(() => { const v = document.getElementById('volume'); v.value = 0.5; "
                      "v.dispatchEvent(new Event('input')); })()")
        self.assertAlmostEqual(self.page.ask("merkel.sound.gain.gain.value"), 0.25, places=3)
        # Only of chosen afferents: none is chosen.
        self.page.ask("(() => { merkel.sound.all = false; merkel.sound.clicks = 0; })()")
        before = self.page.ask("merkel.frame.number")
        self.wait(f"merkel.frame.number > {before} + 10")
        self.assertEqual(self.page.ask("merkel.sound.clicks"), 0)
        self.page.press("s")
        self.wait("!merkel.sound.on")
        program.terminate()

    def test_the_banner_names_an_unplugged_device_and_the_outage_is_shaded(self):
        link = self.path("probe")
        device = start("simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv", "--repeat", "--link", link,
                       "--unplug-s", "4", "--unplug-for-s", "3")
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(link)))
        program = self.open(probe=f"serial:{link}?protocol=hbf1")
        self.wait("document.getElementById('state').textContent === 'Unplugged: probe'")
        self.assertEqual(self.page.ask("document.getElementById('banner').dataset.level"), "bad")
        self.assertIn("Plug the cable in", self.page.text("advice"))
        self.wait("merkel.history.spans.some((s) => s.kind === 'released' && merkel.frame.t - s.from > 1)")
        # A probe without data does not show 0 N.
        self.assertEqual((self.page.text("force"), self.page.text("depth"), self.page.text("depth-of")),
                         ("–", "–", "no data"))
        self.screenshot("live_page_outage.png")
        self.wait("!document.getElementById('state').textContent.startsWith('Unplugged')")
        self.wait("merkel.history.spans.some((s) => s.kind === 'released' && s.to - s.from > 2)")
        program.terminate()

    def test_the_banner_says_the_worst_that_is_true(self):
        program = self.open(probe=PRESS)
        titles = self.page.ask("""import('/health.js').then(({healthOf, Trend}) => {
          const scene = {probes: [{name: 'thumb'}, {name: 'index'}]};
          const counters = {ticks: 0, overruns: 0, skipped_ticks: 0, samples: 0, samples_late: 0, samples_dropped: 0, spikes_dropped: 0};
          const probe = {depth: 0, state: 0, link: 1};
          const frame = (more = {}, probes = [probe, probe]) => ({t: 0, counters, latency: [0], probes, ...more});
          const trendOf = (rates) => { const trend = new Trend();
            for (let t = 0; t <= 6; t += 0.04) trend.add({t, latency: [0], counters: {...counters, ticks: 1000 * t, samples: 1000 * t, ...rates(t)}});
            return trend; };
          const quiet = trendOf(() => ({}));
          const say = (more) => { const h = healthOf({socket: 'live', scene, frame: frame(), trend: quiet, heldFor_s: [0, 0], ...more}); return `${h.level} ${h.title}`; };
          return [
            say({frame: null}), say({socket: 'lost'}), say({frame: frame({over: true})}), say({}),
            say({frame: frame({}, [probe, {...probe, depth: 1}])}),
            say({frame: frame({}, [{...probe, link: 2, state: 2}, probe])}),
            say({frame: frame({}, [probe, {...probe, state: 2}])}),
            say({frame: frame({}, [{...probe, state: 1}, probe]), heldFor_s: [0.03, 0]}),
            say({frame: frame({}, [{...probe, state: 1}, probe]), heldFor_s: [0.001, 0]}),
            say({trend: trendOf((t) => ({skipped_ticks: t > 5 ? 40 : 0}))}),
            say({trend: trendOf((t) => ({overruns: t > 5 ? 300 : 0}))}),
            say({trend: trendOf((t) => ({overruns: 50 * t}))}),
            say({trend: trendOf((t) => ({samples_late: 20 * t}))}),
          ]; })""")
        self.assertEqual(titles, [
            "warn Connecting", "bad Connection lost", "over Run ended", "good Connected, not touching",
            "good Connected, pressing", "bad Unplugged: thumb", "bad Released: index", "warn Silent: thumb",
            "good Connected, not touching", "warn Too slow: 40 ticks skipped", "good Connected, not touching",
            "warn Repeated overruns", "warn Late samples: 2.0 %"])
        program.terminate()

    def test_missed_frames_and_outages_are_shaded_and_named(self):
        program = self.open(probe=PRESS)
        spans = self.page.ask("""import('/history.js').then(({History}) => {
          const history = new History({neurons: 20, probes: [{name: 'thumb'}]});
          const frame = (number, from, t, state = 0, news = []) => ({number, from, t, missed: 0, watched: [], news,
            points: [{t, state, values: [0, 0]}], spikes: {t: new Float64Array(0), n: new Uint32Array(0)}});
          history.add(frame(1, 0, 0.04)); history.add(frame(2, 0.04, 0.08));
          history.add(frame(6, 0.2, 0.24)); history.add(frame(7, 0.24, 0.28, 2)); history.add(frame(8, 0.28, 0.32, 2));
          history.add(frame(9, 0.32, 0.36, 0, [{kind: 'gap', t: 0.33, length_s: 0.01}, {kind: 'mark', t: 0.34, label: 'go'}]));
          return history.spans.map((s) => `${s.kind} ${s.from} ${s.to.toFixed(2)} ${s.label}`); })""")
        self.assertEqual(spans, ["missed 0.08 0.20 3 frames missed by this page", "released 0.28 0.32 thumb released",
                                 "gap 0.33 0.34 ticks skipped", "mark 0.34 0.34 go"])
        program.terminate()

    def test_controls_show_with_the_token_only_and_a_label_marks_a_trial(self):
        program = self.open(probe=PRESS)
        self.assertFalse(self.page.ask("document.getElementById('mark').checkVisibility()"))
        program.terminate()
        program.communicate()
        self.port = free_port()
        program = start("run", "--probe", Control.LIVE, "--sink", f"view:{self.port}?control=1",
                        cwd=self._folder.name)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        line = program.stderr.readline()
        while "live page" not in line:
            line = program.stderr.readline()
        self.page.open(line.strip().removeprefix("live page: "))
        self.wait("Boolean(globalThis.merkel?.frame) && document.getElementById('mark').checkVisibility()")
        self.assertNotIn("token", self.page.ask("location.href"))
        self.page.ask("(() => { document.getElementById('mark-label').value = 'trial 7'; "
                      "document.getElementById('mark').requestSubmit(); })()")
        self.wait("merkel.history.spans.some((s) => s.kind === 'mark' && s.label === 'trial 7')")
        self.page.ask("document.getElementById('record').click()")
        self.wait("document.getElementById('record').textContent === 'Stop recording'")
        self.wait("document.getElementById('notice').textContent.startsWith('recording session-')")
        self.page.ask("document.getElementById('record').click()")
        self.wait("document.getElementById('record').textContent === 'Record'")
        self.page.ask("document.getElementById('tare').click()")
        self.wait("document.getElementById('notice').textContent.includes('cannot be tared')")
        program.terminate()
        self.assert_no_errors()

    def test_a_session_plays_in_the_page_with_a_slider(self):
        session = self.path("s.xdf")
        self.merkel("run", "--fast", "--probe", SLIDE, "--sink", f"xdf:{session}")
        self.port = free_port()
        program = start("replay", session, "--realtime", "--sink", f"view:{self.port}")
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
        self.page.open(f"http://127.0.0.1:{self.port}/")
        self.wait("Boolean(globalThis.merkel?.frame) && document.getElementById('session').checkVisibility()")
        self.page.ask("(() => { const s = document.getElementById('seek'); s.value = 5; "
                      "s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change')); })()")
        self.wait("merkel.frame.t >= 5")
        self.page.ask("document.getElementById('play').click()")
        self.wait("document.getElementById('state').textContent === 'Replay paused'")
        self.page.ask("(() => { const s = document.getElementById('seek'); s.value = 1; "
                      "s.dispatchEvent(new Event('change')); })()")
        self.wait("merkel.frame.t < 1.5 && merkel.history.t < 1.5")
        self.page.ask("document.getElementById('play').click()")
        self.wait("document.getElementById('state').textContent.startsWith('Replay, ')")
        program.terminate()
        self.assert_no_errors()

    def test_what_is_seen_can_be_saved(self):
        csv = self.path("s.csv")
        program = self.open("--sink", f"csv:{csv}", probe=PRESS)
        self.summary(program)
        self.wait("merkel.frame.over")
        span = self.page.ask("(() => { const t = merkel.time(); return [t.from + merkel.frame.origin_s, "
                             "t.to + merkel.frame.origin_s]; })()")
        saved = self.page.ask("import('/save.js').then((m) => m.spikeTable(merkel.history, merkel.time(), "
                              "merkel.frame.origin_s))").splitlines()
        with open(csv, encoding="ascii") as file:
            wanted = [line.split(",") for line in file.read().splitlines()[1:]]
        wanted = [(float(t), n) for t, n in wanted if span[0] <= float(t) <= span[1] + 1e-9]
        self.assertEqual(saved[0], "time_s,neuron")
        self.assertEqual([line.split(",")[1] for line in saved[1:]], [n for _, n in wanted])
        for line, (t, _) in zip(saved[1:], wanted):
            self.assertAlmostEqual(float(line.split(",")[0]), t, places=6)
        press = self.page.ask("import('/save.js').then((m) => m.pressTable(merkel.history, merkel.time(), "
                              "merkel.frame.origin_s))").splitlines()
        self.assertEqual(press[0], "time_s,depth_mm,force_N")
        self.assertGreater(len(press), 500)
        # The menu offers all three as downloads.
        names = self.page.ask("""(async () => {
          const names = [], of = HTMLAnchorElement.prototype, click = of.click, menu = document.getElementById('save');
          of.click = function () { names.push(`${this.download} ${this.href.split(':')[0]}`); };
          for (const which of ['png', 'spikes', 'press']) { menu.value = which; menu.dispatchEvent(new Event('change')); }
          while (names.length < 3) await new Promise((done) => setTimeout(done, 20));
          of.click = click;
          return names.sort(); })()""")
        self.assertEqual(len(names), 3)
        for name, end in zip(names, ("-press.csv blob", "-spikes.csv blob", "s.png blob")):
            self.assertRegex(name, r"^merkel-paper-\d+\.\d-\d+\.\d")
            self.assertTrue(name.endswith(end), name)
        size = self.page.ask("import('/save.js').then((m) => { const c = m.drawPicture(merkel.scene, "
                             "merkel.time(), merkel.health); "
                             "return new Promise((done) => c.toBlob((b) => done(b.size))); })")
        self.assertGreater(size, 10000)
        self.assert_no_errors()

    def test_pause_window_theme_and_zoom_have_keys(self):
        program = self.open(probe=SLIDE)
        for key, value in (("-", "2"), ("+", "5"), ("+", "10"), ("-", "5")):
            self.page.press(key)
            self.assertEqual(self.page.ask("document.getElementById('window').value"), value)
        self.page.press(" ")
        self.assertEqual(self.page.text("pause"), "Resume")
        frozen = self.page.text("depth-of")
        self.wait("merkel.frame.t > merkel.paused.t + 0.5")
        self.assertEqual(self.page.text("depth-of"), frozen)
        self.page.press(" ")
        self.assertEqual(self.page.text("pause"), "Pause")
        # Receptors are drawn only when zoomed in.
        circles = ("(() => { let n = 0; const of = CanvasRenderingContext2D.prototype, arc = of.arc; "
                   "of.arc = function (...a) { ++n; return arc.apply(this, a); }; merkel.finger.draw({rates: merkel.rates, "
                   "most: merkel.most, probes: merkel.frame.probes, pins: []}); of.arc = arc; return n; })()")
        self.assertLess(self.page.ask(circles), 20)
        for _ in range(7):
            self.page.press("z")
        self.assertGreater(self.page.ask("merkel.finger.view.zoom"), 10)
        self.assertGreaterEqual(self.page.ask(circles), 450)
        for _ in range(7):
            self.page.press("x")
        self.assertEqual(self.page.ask("merkel.finger.view.zoom"), 1)
        self.page.press("t")
        self.page.press("t")
        self.assertEqual(self.page.ask("document.documentElement.dataset.theme"), "dark")
        self.page.press("t")
        program.terminate()

    def test_reduced_motion_draws_twice_a_second_and_answers_keys_at_once(self):
        program = self.open(probe=SLIDE)
        self.page.set_media("prefers-reduced-motion", "reduce")
        self.addCleanup(self.page.set_media, "prefers-reduced-motion", "no-preference")
        draws = "Number(document.body.dataset.draws)"
        before, frame = self.page.ask(draws), self.page.ask("merkel.frame.number")
        self.wait(f"merkel.frame.number >= {frame} + 50")  # two seconds of frames
        passed = (self.page.ask("merkel.frame.number") - frame) / 25
        self.assertLessEqual(self.page.ask(draws) - before, 2 * passed + 2)
        self.page.press("h")
        self.wait("merkel.dirty === false && document.getElementById('hide-silent').checked")
        self.page.press("h")
        program.terminate()

    def test_names_of_short_outages_stand_beside_them(self):
        program = self.open(probe=PRESS)
        named = self.page.ask("""import('/raster.js').then(({drawSpans}) => {
          const c = document.createElement('canvas').getContext('2d'), named = [];
          c.fillText = (text) => named.push(text);
          const span = (kind, from, to, label) => ({kind, from, to, label});
          drawSpans(c, [span('released', 3, 4, 'thumb released'), span('gap', 1, 1.01, 'ticks skipped'),
                        span('gap', 2.99, 3, 'hidden by the next')],
                    {from: 0, to: 5, seconds: 5}, {left: 0, w: 1000, h: 10}, true);
          return named; })""")
        self.assertEqual(named, ["ticks skipped", "thumb released"])
        program.terminate()

    def test_the_page_is_legible_and_loads_nothing_else(self):
        program = self.open(probe=SLIDE)
        contrast = """(() => {
          const lum = (text) => { const c = document.createElement('canvas').getContext('2d');
            c.fillStyle = text; c.fillRect(0, 0, 1, 1);
            return [...c.getImageData(0, 0, 1, 1).data].slice(0, 3).map((v) => v / 255)
              .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
              .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0); };
          const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
          const ratio = (a, b) => { const [x, y] = [lum(a), lum(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
          const onCard = ['--ink', '--soft', '--force', '--depth', '--press'].map((n) => ratio(css(n), css('--card')));
          const banner = ['--good', '--warn', '--bad', '--over'].map((n) => ratio('#fff', css(n)));
          return Math.min(...onCard, ...banner); })()"""
        for theme in ("light", "dark"):
            self.page.ask(f"(() => {{ document.documentElement.dataset.theme = '{theme}'; }})()")
            self.assertGreaterEqual(self.page.ask(contrast), 4.5, theme)  # WCAG AA
        self.page.ask("(() => { document.documentElement.dataset.theme = 'light'; })()")
        # The scale of rates gets steadily darker, for any colour vision.
        self.assertTrue(self.page.ask(
            "import('/colours.js').then((m) => { const light = m.scale().map(([r, g, b]) => "
            "0.2126 * r + 0.7152 * g + 0.0722 * b); return light.every((v, i) => i === 0 || v <= light[i - 1] + 0.5); })"))
        unnamed = self.page.ask("[...document.querySelectorAll('button, input, select, canvas')].filter((e) => "
                                "!e.textContent.trim() && !e.getAttribute('aria-label') && !e.closest('label') && "
                                "!e.getAttribute('aria-hidden') && !e.closest('#trace')).map((e) => e.outerHTML).join()")
        self.assertEqual(unnamed, "")
        outside = self.page.ask("performance.getEntriesByType('resource').filter((e) => "
                                "new URL(e.name).host !== location.host).length")
        self.assertEqual(outside, 0)
        with socket.create_connection(("127.0.0.1", self.port)) as s:
            s.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
            head = b"".join(iter(lambda: s.recv(65536), b"")).partition(b"\r\n\r\n")[0].decode()
        self.assertIn("Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'", head)
        self.assertNotIn("unsafe", head)
        program.terminate()
        self.assert_no_errors()


if __name__ == "__main__":
    merkel_program.main()
