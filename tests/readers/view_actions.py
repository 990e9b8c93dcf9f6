"""Actions of the user: sound, control of a run, replay, saving; and the electrodes' commands."""
from merkel_program import free_port, long
from view_page import PRESS, SLIDE, BrowserPage

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
watchdog_ms = 500
"""


class Actions(BrowserPage):
    def test_electrodes_show_their_commands(self):
        with open(self.path("electrodes.toml"), "w") as scene:
            scene.write(ELECTRODES)
        program = self.open(self.path("electrodes.toml"), probe="sim:ramp?wait_s=0&hold_s=600&live=1")
        self.wait("document.querySelectorAll('.electrode.on').length === 2")
        self.assertEqual(self.page.ask("document.querySelector('#latency-to').textContent"), "Touch to commands, ms")
        train, pulses = self.page.ask("[...document.querySelectorAll('.electrode')].map((e) => e.textContent)")
        self.assertRegex(train, r"^train[0-9.]+ µA, [0-9]+ Hz$")
        self.assertRegex(pulses, r"^pulses60 µA, [1-9][0-9]* pulses/s$")
        program.terminate()
        program.communicate()
        self.wait("document.querySelectorAll('.electrode.stopped').length === 2")
        self.assertEqual(self.page.ask("document.querySelector('.electrode span').textContent"), "off: end")
        self.assert_no_errors()

    @long
    def test_sixteen_electrodes_are_all_visible_and_have_a_course(self):
        places = ("(() => { const all = [...document.querySelectorAll('.electrode span')].map((e) => e.getBoundingClientRect());"
                  " const box = document.getElementById('side').getBoundingClientRect();"
                  " return [all.length, all.every((r) => r.height > 8 && r.left >= box.left && r.right <= box.right + 1 &&"
                  " r.bottom <= box.bottom && r.bottom <= innerHeight && r.right <= innerWidth)]; })()")
        painted = ("(() => { const c = document.getElementById('lanes'), d = c.getContext('2d')"
                   ".getImageData(0, 0, c.width, c.height).data; let n = 0; "
                   "for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n; })()")
        # Names of patches: apart from each other, from the legend, and within the picture.
        apart = ("(() => { const skin = document.getElementById('skin').getBoundingClientRect(), all = merkel.finger.labels.map("
                 "(l) => ({left: l.left + skin.left, right: l.right + skin.left, top: l.top + skin.top, bottom: l.bottom + skin.top}));"
                 " if (all.some((l) => l.left < skin.left || l.right > skin.right)) return false;"
                 " for (const e of document.querySelectorAll('.legend span, #legend, .legend button')) all.push(e.getBoundingClientRect());"
                 " return all.length === 11 && all.every((a, i) => all.every((b, j) => i === j || a.right <= b.left || b.right <= a.left ||"
                 " a.bottom <= b.top || b.bottom <= a.top)); })()")
        # Each probe has a lane, with its zero line in it.
        zeros = ("(() => { const {lanes, canvas} = merkel.trace, ratio = canvas.width / canvas.clientWidth, c = canvas.getContext('2d');"
                 " return lanes.length === 6 && lanes.every(({zero, bottom}, i) => zero <= bottom + 0.01 && bottom < canvas.clientHeight &&"
                 " (i === 0 || zero > lanes[i - 1].bottom + 8) && c.getImageData(Math.round(100 * ratio),"
                 " Math.round((zero - 1) * ratio), 1, Math.ceil(3 * ratio)).data.some((v) => v > 0)); })()")
        # The palm's sphere presses harder: all lanes share its scale.
        one_scale = ("['force', 'reading'].every((name) => new Set(merkel.trace.lanes.map(({most}) => most[name])).size === 1)")
        self.port = free_port()
        program = self.launch("run", "tools/examples/hand_electrodes.toml", "--sink", f"view:{self.port}")
        self.page.open(f"http://127.0.0.1:{self.port}/")
        for size in ((1280, 800), (1366, 768), (1440, 900), (768, 1024), (390, 844)):
            self.page.set_size(*size)
            self.wait("globalThis.merkel?.frame?.t > 1.5 && merkel.dirty === false")
            self.wait("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
            self.wait(apart)
            self.wait(zeros)
            self.wait(one_scale)
            # The numbers and their labels stay in their columns.
            self.assertEqual(self.page.ask("[...document.querySelectorAll('#numbers div > *')].filter((e) => "
                                           "e.scrollWidth > e.parentElement.clientWidth).map((e) => e.id).join()"), "", size)
            self.assertEqual(self.page.ask(places), [16, True], size)
            # Without scrolling.
            self.assertLessEqual(self.page.ask("(({scrollHeight, clientHeight}) => scrollHeight - clientHeight)"
                                               "(document.getElementById('electrodes'))"), 0, size)
            self.wait(f"{painted} > 2000")
            # Only afferents that have fired have a row.
            self.assertLess(self.page.ask("merkel.order.rows.length"), 1000)
            if size[0] == 1280:
                self.screenshot("live_page_electrodes.png")
        program.kill()
        program.communicate()
        self.page.set_size(1280, 800)
        self.assert_no_errors()

    def test_an_array_shows_its_pressures_in_place_of_a_depth(self):
        program = self.open("tools/examples/taxel_array.toml", probe="sim:pad?count=100")
        self.wait("parseFloat(document.getElementById('depth').textContent) > 20")
        self.assertEqual(self.page.text("depth-to"), "Pressure, kPa")
        self.assertEqual(self.page.text("depth-of"), "highest of 256 taxels")
        self.assertEqual(self.page.text("trace-depth"), "pressure, kPa")
        # The curve of the highest pressure is that of the frames.
        self.wait("Math.max(...merkel.history.points.reading0.subarray(0, merkel.history.points.end)) > 20")
        saved = self.page.ask("import('/save.js').then((m) => m.pressTable(merkel.history, merkel.time(), 0))")
        self.assertTrue(saved.startswith("time_s,pressure_kPa,force_N\n"))
        program.terminate()
        self.assert_no_errors()

    def test_the_depth_of_a_gauge_stands_beside_that_of_the_model(self):
        program = self.open("goodwin", probe="sim:ramp?wait_s=0&hold_s=600&depth_mm=1.5&force_N=0.5&live=1")
        self.wait("document.getElementById('depth-of').textContent === 'by the model; gauge 1.50'")
        self.assertNotEqual(self.page.text("depth"), "1.50")
        self.wait("document.getElementById('trace').getAttribute('aria-label').includes('Now: probe 0.50 N')")
        program.terminate()

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

    def test_any_page_stops_stimulation_and_one_with_the_token_starts_it_again(self):
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write('preset = "paper"\n' + ELECTRODES)
        held = "sim:ramp?wait_s=0&hold_s=600&depth_mm=1.5&live=1"
        program, address = self.steer(self.path("scene.toml"), "--sink", "stim-csv:" + self.path("c.csv"), probe=held)
        self.page.open(f"http://127.0.0.1:{self.port}/")
        self.wait("globalThis.merkel?.frame?.electrodes[0].amplitude > 20")
        self.assertFalse(self.page.ask("document.getElementById('controls').checkVisibility()"))
        self.assertFalse(self.page.ask("document.getElementById('start').checkVisibility()"))
        self.page.ask("document.getElementById('stop').click()")
        self.wait("merkel.frame.stopped && merkel.frame.electrodes.every((e) => e.amplitude === 0 && "
                  "merkel.scene.stops[e.stop] === 'stopped')")
        self.wait("document.getElementById('state').textContent === 'Stimulation stopped'")
        self.assertTrue(self.page.ask("document.getElementById('stop').disabled"))
        # Without the token nothing starts it, whatever the page sends.
        self.assertFalse(self.page.ask("document.getElementById('start').checkVisibility()"))
        before = self.page.ask("(() => { merkel.connection.send('start'); return merkel.frame.number; })()")
        self.wait(f"merkel.frame.number > {before} + 15")
        self.assertTrue(self.page.ask("merkel.frame.stopped"))
        self.page.open(address)
        self.wait("globalThis.merkel?.frame?.stopped && document.getElementById('start').checkVisibility()")
        self.page.ask("document.getElementById('start').click()")
        self.wait("!merkel.frame.stopped && merkel.frame.electrodes[0].amplitude > 20")
        program.terminate()
        out, errors = program.communicate(timeout=60)
        self.assertIn("stimulation was stopped by the live page", out)
        with open(self.path("c.csv"), encoding="utf-8") as file:
            self.assertIn(",stopped,", file.read())
        self.assert_no_errors()

    def test_controls_show_with_the_token_only_and_a_label_marks_a_trial(self):
        program = self.open(probe=PRESS)
        self.assertFalse(self.page.ask("document.getElementById('mark').checkVisibility()"))
        program.terminate()
        program.communicate()
        program, address = self.steer()
        self.page.open(address)
        self.wait("Boolean(globalThis.merkel?.frame) && document.getElementById('mark').checkVisibility()")
        self.assertNotIn("token", self.page.ask("location.href"))
        self.wait("document.getElementById('raster').getBoundingClientRect().bottom <= innerHeight")  # first screen
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
        program = self.play(session)
        self.page.open(f"http://127.0.0.1:{self.port}/")
        self.wait("Boolean(globalThis.merkel?.frame) && document.getElementById('session').checkVisibility()")
        self.wait("document.getElementById('raster').getBoundingClientRect().bottom <= innerHeight")  # first screen
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
