"""Shared by the tests of the live page: a program that serves it, and a browser that shows it."""
import atexit
import os
import unittest

import browser
import merkel_program
from merkel_program import free_port, start
from web_socket import request

SLIDE = "sim:slide?depth_mm=1.8&x_mm=3&y_mm=10&to_x_mm=27&to_y_mm=10&speed_mm_per_s=3"
PRESS = "sim:taps?interval_s=0.25&tap_s=0.2&count=12"
LIVE_PRESS = "sim:taps?interval_s=0.25&tap_s=0.2&count=20&live=1"


class Page(merkel_program.TestCase):
    """Runs the program with a live page at self.port."""

    def launch(self, *arguments, **more):
        """Starts the program and waits for the page; the program is killed after the test."""
        program = start(*arguments, **more)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        self.assertTrue(merkel_program.wait_for(self.listening))
        return program

    def serve(self, *more, probe=PRESS):
        self.port = free_port()
        return self.serve_again(*more, probe=probe)

    def serve_again(self, *more, probe=PRESS):
        probes = [word for uri in ([probe] if isinstance(probe, str) else probe) for word in ("--probe", uri)]
        return self.launch("run", *more, *probes, "--json", "--sink", f"view:{self.port}")

    def steer(self, *more, probe=LIVE_PRESS):
        """Starts a run that pages may control. Returns the program and the page's address with the token."""
        self.port = free_port()
        program = self.launch("run", *more, "--probe", probe, "--json", "--sink",
                              f"view:{self.port}?control=1", cwd=self._folder.name)
        line = program.stderr.readline()
        while "live page" not in line:
            line = program.stderr.readline()
        return program, line.strip().removeprefix("live page: ")

    def play(self, session, *more):
        """Plays a session at its own speed."""
        self.port = free_port()
        return self.launch("replay", session, "--realtime", *more, "--sink", f"view:{self.port}")

    def plug_in(self, *more):
        """Starts a simulated device that repeats taps. Returns its URI."""
        link = self.path("probe")
        device = start("simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv", "--repeat", "--link", link, *more)
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(link)))
        return f"serial:{link}?protocol=hbf1"

    def listening(self):
        try:
            return request(self.port)[0] == 200
        except ConnectionError:
            return False

    def summary(self, program, failed_by=frozenset()):
        out, err = program.communicate(timeout=60)
        return self.live_summary(out, err, program.returncode, failed_by)


class BrowserPage(Page):
    """Opens the page in a browser, which all tests of a program share."""
    page = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if not browser.available():
            raise unittest.SkipTest("no chromium and chromedriver: tools/install_packages test")
        if BrowserPage.page is None:
            BrowserPage.page = browser.Browser(1280, 800)
            atexit.register(BrowserPage.page.__exit__)

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
