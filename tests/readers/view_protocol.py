"""Frames of the live page, and clients that misbehave."""
import json
import os
import socket
import struct
import subprocess

import merkel_program
from merkel_program import free_port
from view_page import PRESS, Page
from web_socket import WebSocket, request
from xdf_reader import Xdf


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

    def test_the_pressures_of_an_array_are_shown(self):
        self.port = free_port()
        program = self.launch("run", "tools/examples/taxel_array.toml", "--duration-s", "1.3", "--sink", f"view:{self.port}",
                              "--json")
        with WebSocket(self.port) as client:
            scene = json.loads(client.receive()[1])
            frames = list(client.frames())
        self.summary(program)
        array = scene["probes"][0]["taxels"]
        self.assertEqual(len(array["centres"]), 256)
        self.assertEqual((array["x_mm"], array["y_mm"], array["width_mm"]), (15, 10, 1))
        for frame in frames:
            self.assertEqual(len(frame.taxels[0]), 256)
            self.assertAlmostEqual(sum(frame.taxels[0]), frame.probes[0][1], delta=20)
        self.assertGreater(max(max(frame.taxels[0]) for frame in frames), 20)

    def test_each_pulse_of_a_sync_line_lights_the_page(self):
        session = self.path("s.xdf")
        program = self.serve("--duration-s", "3", "--sink", "xdf:" + session, probe=self.plug_in("--pulses", "1"))
        with WebSocket(self.port) as client:
            client.receive()
            frames = list(client.frames())
        self.summary(program)
        edges = Xdf(session).streams["merkel.sync"]
        pulses = [stamp for stamp, level in zip(edges.stamps, edges.column("level")) if level == 1]
        shown = [news["t"] for frame in frames for news in frame.news if news["kind"] == "sync"]
        self.assertGreater(len(shown), 2)  # those from the first tick on
        if frames[-1].missed == 0:
            pulses = pulses[-len(shown):]
            for time_s, stamp in zip(shown, pulses):
                self.assertAlmostEqual(time_s - shown[0], stamp - pulses[0], places=3)

    def test_spikes_that_arrive_before_the_first_tick_keep_their_times(self):
        program = self.serve("--duration-s", "2", probe="sim:ramp?wait_s=0&hold_s=600&live=1")
        with WebSocket(self.port) as client:
            client.receive()
            frames = list(client.frames())
        summary = self.summary(program)
        times = [frame.time_s - before for frame in frames for before, _ in frame.spikes]
        self.assertTrue(all(a - 1e-6 <= b for a, b in zip(times, times[1:])))
        self.assertGreater(times[0], 0)
        self.assertLess(times[0], 0.1)
        self.assertLessEqual(times[-1], 2.01)
        if frames[-1].missed == 0:
            self.assertEqual(len(times), summary["spikes"])

    def test_pages_of_other_sites_are_kept_out(self):
        program = self.serve()
        for origin, status in (("http://evil.example", 403), ("", 403), (f"http://127.0.0.1:{self.port}", 101)):
            with WebSocket(self.port, origin) as client:
                self.assertEqual(client.status, status)
        # A name that resolves to this host, as in DNS rebinding.
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)
        self.assertEqual(request(self.port, Host=f"localhost:{self.port}")[0], 200)
        self.assertEqual(request(self.port, "/../../etc/passwd")[0], 404)
        self.assertEqual(request(self.port, "/main.js", method="POST")[0], 405)
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
        self.launch("run", "--probe", PRESS, "--sink", f"view:0.0.0.0:{self.port}", "--allow-remote")
        self.assertEqual(request(self.port, Host="192.0.2.1:80")[0], 200)
        self.assertEqual(request(self.port, Host=socket.gethostname())[0], 200)
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)

    def test_requests_that_make_no_sense_are_ignored(self):
        program = self.serve()
        with WebSocket(self.port) as client:
            for text in ("", " ", "watch 1 2 3 4 5 6", "watch -1", "watch 99999999999", "watch 4000000000",
                         "tare", "tare 0", "tare 99", "mark " + "x" * 900, "seek nan", "seek -1", "record",
                         "pause", "play", "record start"):
                client.send(text)
            frames = list(client.frames())
        self.assertTrue(frames[-1].over)
        summary = self.summary(program)
        self.assertGreater(summary["spikes"], 20)
