"""The skin, the raster and chosen afferents."""
from merkel_program import long
from view_page import PRESS, SLIDE, BrowserPage


class Skin(BrowserPage):
    def test_the_raster_is_sorted_by_distance_and_hides_the_silent(self):
        program = self.open("goodwin", probe=SLIDE)
        self.wait("merkel.history.spikes.length > 200")
        sorted_rows = ("(() => { const {rows, distance} = merkel.order; "
                       "return rows.every((n, i) => i === 0 || distance[rows[i - 1]] <= distance[n]); })()")
        self.assertTrue(self.page.ask(sorted_rows))
        # It opens on the afferents that fire.
        self.assertLess(self.page.ask("merkel.order.rows.length"), 450)
        self.page.press("h")
        self.wait(f"merkel.order.rows.length === 450 && {sorted_rows}")
        self.wait("merkel.mode === 'density'")
        self.page.press("h")
        self.wait("merkel.order.rows.length < 450")
        self.page.press(" ")  # Pause: the view stands still.
        self.wait("merkel.paused !== null")
        self.assertTrue(self.page.ask("(() => { merkel.order.key = ''; merkel.dirty = true; merkel.draw(); "
                                      "const {fired} = merkel.history; return merkel.order.rows.every((n) => fired[n - 1] > 0) && "
                                      "merkel.order.rows.length === fired.reduce((sum, n) => sum + (n > 0), 0); })()"))
        self.page.ask("(() => { const s = document.getElementById('order'); s.value = 'number'; "
                      "s.dispatchEvent(new Event('change')); })()")
        self.wait("merkel.order.rows.every((n, i) => i === 0 || merkel.order.rows[i - 1] < n)")
        self.page.press("h")
        # A press that ended before the first picture counts.
        self.assertTrue(self.page.ask("""import('/order.js').then(({RowOrder}) => {
          const order = new RowOrder(merkel.scene, merkel.finger.layout);
          order.follow([{depth: 1, x: 3, y: 10, touching: true}]);
          order.follow([{depth: 0, x: 0, y: 0}]);
          order.update({by: 'distance', hideSilent: false, counts: null, now: 0});
          const away = (n) => { const [x, y] = merkel.finger.layout.placed[0].centre(n - 1); return Math.hypot(x - 3, y - 10); };
          return away(order.rows[0]) < away(order.rows[10]) && order.rows.every((n) => away(n) >= away(order.rows[0])); })"""))
        program.terminate()

    def test_a_density_that_is_kept_equals_one_that_is_counted_and_coloured_anew(self):
        program = self.open(probe=PRESS)
        wrong = self.page.ask("""Promise.all([import('/density.js'), import('/history.js')]).then(([{Density, DensityImage}, {Columns}]) => {
          const spikes = new Columns({t: Float64Array, n: Uint32Array}), kept = new Density(), wrong = [];
          const image = new DensityImage(), pinned = {pins: [5, 77], colours: ['#e69f00', '#56b4e9']};
          const pixels = (shaded) => new Uint32Array(shaded.data.buffer);
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
            const fresh = pixels(new DensityImage().shade(anew, {order, ...pinned}));
            if (pixels(image.shade(kept, {order, ...pinned})).some((p, i) => p !== fresh[i] && i % kept.width > 0)) wrong.push(-step);
          }
          return wrong.join(); })""")
        self.assertEqual(wrong, "")
        program.terminate()

    def test_the_history_keeps_the_newest_spikes_within_its_limit(self):
        program = self.open(probe=PRESS)
        kept, in_order, newest, first = self.page.ask("""import('/history.js').then(({Columns}) => {
          const spikes = new Columns({t: Float64Array, n: Uint32Array}), count = 19999;
          for (let frame = 0; frame < 300; ++frame) {
            const t = Float64Array.from({length: count}, (x, i) => frame * count + i);
            spikes.append({t, n: Uint32Array.from(t)});
            if (frame % 10 === 0) spikes.push({t: t[count - 1], n: t[count - 1]});
          }
          let inOrder = true;
          for (let i = spikes.begin + 1; i < spikes.end; ++i) inOrder &&= spikes.t[i] - spikes.t[i - 1] <= 1 && spikes.n[i] === spikes.t[i];
          return [spikes.length, inOrder, spikes.t[spikes.end - 1], spikes.firstAfter(5e6) - spikes.begin]; })""")
        self.assertTrue(in_order)
        self.assertEqual(newest, 300 * 19999 - 1)
        self.assertTrue(2 << 20 < kept <= 1 << 22, kept)
        self.assertGreater(first, 0)
        program.terminate()

    def test_a_hand_is_drawn_as_a_hand_with_its_probes_named(self):
        program = self.open("hand", probe=6 * ["sim:ramp?hold_s=20"])
        self.wait("merkel.order?.rows.length > 0")
        self.page.press("h")
        self.wait("merkel.order.rows.length === 4250")
        self.page.press("h")
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
        self.wait("document.getElementById('probes').textContent.includes('palm 0.45 N')")
        self.assertEqual(self.page.ask("merkel.mode"), "density")
        self.screenshot("live_page_hand.png")
        self.page.set_size(390, 844)
        fits = ("[...document.querySelectorAll('#numbers b, #probes button')].every((e) => "
                "e.scrollWidth <= (e.tagName === 'B' ? e.parentElement : e).clientWidth)")
        self.wait(f"document.getElementById('rate').textContent.length === 5 && {fits}")
        self.wait("document.getElementById('raster').getBoundingClientRect().bottom <= 844")
        self.page.set_size(1280, 800)
        self.page.ask("document.querySelectorAll('#probes button')[4].click()")
        self.wait("document.getElementById('force-of').textContent === 'little'")
        program.terminate()
        self.assert_no_errors()

    @long
    def test_a_shape_and_a_surface_are_drawn_as_what_they_are(self):
        with open("tools/examples/letter_a.csv", encoding="ascii") as file:
            heights = [float(height) for line in file for height in line.split(",")]
        share = sum(height < 0.25 for height in heights) / len(heights)
        drawn = ("(() => { const pictures = [], of = CanvasRenderingContext2D.prototype, drawImage = of.drawImage; "
                 "of.drawImage = function (...a) { pictures.push(a); return drawImage.apply(this, a); }; merkel.dirty = true; merkel.draw(); "
                 "of.drawImage = drawImage; return pictures.filter(([p]) => p === merkel.scene.probes[0].picture)"
                 ".map(([, ...place]) => place); })()")
        program = self.open("tools/examples/letter.toml", probe="sim:ramp?force_N=0.6&hold_s=600")
        self.wait("merkel.frame.probes[0].force > 0.5")
        [[left, top, width, length]] = self.page.ask(drawn)
        self.assertAlmostEqual(left + width / 2, 15, places=3)
        self.assertAlmostEqual(top + length / 2, 10, places=3)
        raised = "(({heights}) => heights.filter((h) => h >= 0 && h < 25).length / heights.length)(merkel.scene.probes[0].shape)"
        self.assertAlmostEqual(self.page.ask(raised), share, delta=0.02)
        program.terminate()
        # A surface that repeats covers the patch, and moves under the finger.
        program = self.open("tools/examples/dots_scanned.toml", probe="sim:scan?force_N=0.3&length_mm=24&passes=600")
        self.wait(f"{drawn}.length > 40")  # not between two passes
        before = self.page.ask("merkel.frame.probes[0].tip.x")
        self.wait(f"Math.abs(merkel.frame.probes[0].tip.x - {before}) > 1 && merkel.frame.probes[0].x === 15")
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
