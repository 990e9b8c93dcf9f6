"""The state of the devices and of the run: the banner, and outages in the plots."""
import signal

from merkel_program import long
from view_page import LIVE_PRESS, PRESS, BrowserPage


class Health(BrowserPage):
    @long
    def test_the_banner_names_an_unplugged_device_and_the_outage_is_shaded(self):
        program = self.open(probe=self.plug_in("--unplug-s", "5", "--unplug-for-s", "5"))
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

    @long
    def test_a_program_that_stands_still_is_noticed(self):
        program = self.open(probe=LIVE_PRESS)
        self.wait("document.getElementById('banner').dataset.level === 'good'")
        program.send_signal(signal.SIGSTOP)
        self.addCleanup(program.send_signal, signal.SIGCONT)
        self.wait("document.getElementById('state').textContent === 'No data from merkel'")
        self.assertEqual(self.page.ask("document.getElementById('banner').dataset.level"), "bad")
        program.send_signal(signal.SIGCONT)
        self.wait("document.getElementById('state').textContent !== 'No data from merkel'")
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
            say({frame: null}), say({socket: 'lost'}), say({socket: 'stalled'}), say({frame: frame({over: true})}), say({}),
            say({frame: frame({}, [probe, {...probe, depth: 1, touching: true}])}),
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
            "warn Connecting", "bad Connection lost", "bad No data from merkel", "over Run ended", "good Connected, not touching",
            "good Connected, pressing", "bad Unplugged: thumb", "bad No samples: index", "warn Late: thumb",
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
        self.assertEqual(spans, ["missed 0.08 0.20 3 frames missed by this page", "released 0.28 0.32 thumb: no samples, taken off the skin",
                                 "gap 0.33 0.34 ticks skipped", "mark 0.34 0.34 go"])
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
