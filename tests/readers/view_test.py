"""The live page: in a browser, and from clients that behave badly."""
import json
import os
import socket
import struct

import browser
import merkel_program
from merkel_program import free_port, start
from web_socket import WebSocket, request

SLIDE = "sim:slide?depth_mm=1.8&x_mm=3&y_mm=10&to_x_mm=27&to_y_mm=10&speed_mm_per_s=3"
PRESS = "sim:taps?interval_s=0.25&tap_s=0.2&count=12"


class Page(merkel_program.TestCase):
    def serve(self, *more, probe=PRESS):
        self.port = free_port()
        return self.serve_again(*more, probe=probe)

    def serve_again(self, *more, probe=PRESS):
        program = start("run", "--probe", probe, "--json", "--sink", f"view:{self.port}", *more)
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
        counters = dict(zip(scene["counters"], frames[-1].counters))
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
        # A name that leads here, as in DNS rebinding.
        self.assertEqual(request(self.port, Host="evil.example")[0], 403)
        self.assertEqual(request(self.port, Host=f"localhost:{self.port}")[0], 200)
        self.assertEqual(request(self.port, "/../../etc/passwd")[0], 404)
        self.assertEqual(request(self.port, "/page.js", method="POST")[0], 405)
        self.assertIn(b"MIT", request(self.port, "/uPlot.LICENSE")[1])
        program.terminate()

    def test_junk_and_clients_that_never_read_hold_up_nobody(self):
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
                except OSError:  # it was shown the door
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


class InBrowser(Page):
    def setUp(self):
        super().setUp()
        if not browser.available():
            self.skipTest("no chromium and chromedriver: tools/install_packages test")

    def screenshot(self, page, name):
        """For the documents, where MERKEL_SCREENSHOTS names a folder."""
        folder = os.environ.get("MERKEL_SCREENSHOTS")
        if folder:
            page.screenshot(os.path.join(folder, name))

    def test_the_page_draws_a_known_replay_and_reconnects(self):
        painted = ("(() => { const c = document.getElementById('%s'); const d = c.getContext('2d')"
                   ".getImageData(0, 0, c.width, c.height).data; let n = 0; "
                   "for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n; })()")
        with browser.Browser(1280, 1560) as page:
            program = self.serve(probe="replay:tests/traces/taps.csv")
            page.open(f"http://127.0.0.1:{self.port}/")
            summary = self.summary(program)
            self.assertTrue(merkel_program.wait_for(
                lambda: page.text("spikes") == str(summary["spikes"])))
            self.assertEqual(page.text("connection"), "run over")
            self.assertEqual(page.text("scene"), "paper")
            for canvas in ("raster", "skin", "rates", "latency"):
                self.assertGreater(page.ask(painted % canvas), 1000, canvas)
            counters = page.text("counters")
            self.assertIn(f"ticks{summary['ticks'] // 1000}\u2009{summary['ticks'] % 1000:03}",
                          counters)
            # Another run on the same port: the page finds it by itself.
            program = self.serve_again(probe=SLIDE)
            self.assertTrue(merkel_program.wait_for(lambda: page.text("connection") == "live"))
            self.assertTrue(merkel_program.wait_for(lambda: float(page.text("clock")) > 2.5))
            self.assertGreater(int(page.text("spikes")), 50)
            page.press("-")
            self.assertEqual(page.ask("document.getElementById('window').value"), "5")
            self.screenshot(page, "live_page.png")

            # By keyboard: a picture with the focus says what lies where the arrows lead.
            self.assertIn(" mm, ", page.text("trace-value"))
            for canvas, word in (("raster", "afferent "), ("skin", "afferent "),
                                 ("rates", " /s"), ("latency", " ticks")):
                page.ask(f"document.getElementById('{canvas}').focus()")
                page.press("\ue012")  # left
                self.assertTrue(merkel_program.wait_for(
                    lambda: word in page.text(f"{canvas}-value")), canvas)
            page.ask("document.activeElement.blur()")

            page.press(" ")
            self.assertEqual(page.text("pause"), "Go on")
            page.press(" ")
            self.assertEqual(page.text("pause"), "Pause")
            page.press("+")
            self.assertEqual(page.ask("document.getElementById('window').value"), "10")
            page.press("t")
            page.press("t")
            self.assertEqual(page.ask("document.documentElement.dataset.theme"), "dark")
            page.resize_to_phone(390, 844)
            self.assertTrue(merkel_program.wait_for(lambda: page.ask("innerWidth") == 390))
            self.assertLessEqual(page.ask("document.documentElement.scrollWidth"),
                                 page.ask("innerWidth"))
            self.screenshot(page, "live_page_phone.png")

            program.terminate()
            program.communicate()
            self.assertTrue(merkel_program.wait_for(
                lambda: page.text("connection") != "live"))
            # The browser itself notes every attempt at a server that is away, and nothing else.
            self.assertEqual([e for e in page.errors() if "ERR_CONNECTION_REFUSED" not in e], [])


if __name__ == "__main__":
    merkel_program.main()
