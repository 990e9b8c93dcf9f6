"""The first screen at three widths: complete, legible, and usable by keyboard."""
import socket

from merkel_program import long
from view_page import SLIDE, BrowserPage


class FirstScreen(BrowserPage):
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

    @long
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

    def test_pause_window_theme_and_zoom_have_keys(self):
        program = self.open(probe=SLIDE)
        for key, value in (("-", "2"), ("+", "5"), ("+", "10"), ("-", "5")):
            self.page.press(key)
            self.assertEqual(self.page.ask("document.getElementById('window').value"), value)
        self.page.press(" ")
        self.assertEqual(self.page.text("pause"), "Resume view")
        self.wait("!merkel.dirty")
        frozen = self.page.text("depth-of")
        self.wait("merkel.frame.t > merkel.paused.t + 0.5")
        self.assertEqual(self.page.text("depth-of"), frozen)
        self.page.press(" ")
        self.assertEqual(self.page.text("pause"), "Pause view")
        # Receptors are drawn only when zoomed in.
        circles = ("(() => { let n = 0; const of = CanvasRenderingContext2D.prototype, arc = of.arc, finger = merkel.finger; "
                   "finger.skin.key = finger.names.key = null; of.arc = function (...a) { ++n; return arc.apply(this, a); }; "
                   "finger.draw({rates: merkel.rates.hz, most: merkel.rates.most, probes: merkel.frame.probes, pins: []}); "
                   "of.arc = arc; return n; })()")
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
        draws = "merkel.draws"
        before, frame = self.page.ask(draws), self.page.ask("merkel.frame.number")
        self.wait(f"merkel.frame.number >= {frame} + 50")  # two seconds of frames
        passed = (self.page.ask("merkel.frame.number") - frame) / 25
        self.assertLessEqual(self.page.ask(draws) - before, 2 * passed + 2)
        self.page.press("h")
        self.wait("merkel.dirty === false && !document.getElementById('hide-silent').checked")
        self.page.press("h")
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
