"""The Python module merkel under misuse: an error that names the mistake, never a crash or a hang."""
import gc
import inspect
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import merkel
import numpy as np

LIVE = "sim:taps?count=1000&live=1"
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a shell's background job
CLASSES = (merkel.Bridge, merkel.Run, merkel.Scene, merkel.Session, merkel.Stream, merkel.Table)


def run_python(code, **keywords):
    return subprocess.run([sys.executable, "-c", "import merkel, os, pickle, sys, time\n" + code], capture_output=True,
                          text=True, timeout=60, **keywords)


class Arguments(unittest.TestCase):
    def assert_error(self, sentence, function, *arguments, **keywords):
        with self.assertRaisesRegex(merkel.Error, sentence) as caught:
            function(*arguments, **keywords)
        self.assertNotIn("incompatible", str(caught.exception))
        self.assertLess(len(str(caught.exception)), 1000)

    def test_a_wrong_type_is_named_with_its_argument(self):
        scene = merkel.Scene("paper")
        stream = scene.stream()
        run = scene.run(depth_mm=np.ones(50), rate_hz=1000)
        for sentence, function, arguments, keywords in (
                (r"run\(\): rate_hz must be a number or None, but is 'fast' \(str\)", scene.run, (), {"depth_mm": [1], "rate_hz": "fast"}),
                (r"run\(\): seed must be a whole number from 0 on or None, but is -1", scene.run, (), {"seed": -1}),
                (r"run\(\): sinks must be a list of texts, but is 'csv:x.csv'", scene.run, (), {"sinks": "csv:x.csv"}),
                (r"run\(\) takes 0 arguments without a name, but got 1: name the others: depth_mm=", scene.run, ([1, 2],), {}),
                (r"push\(\) needs time_s: a number", stream.push, (), {"depth_mm": 1.0}),
                (r"push\(\): time_s must be a number, but is None", stream.push, (None,), {"depth_mm": 1}),
                (r"push\(\): depth_mm must be a number or None, but is \[1\]", stream.push, (0.0,), {"depth_mm": [1]}),
                (r"push\(\): probe must be a whole number from 0 on, but is 0.5", stream.push, (0.0,), {"depth_mm": 1, "probe": 0.5}),
                (r"times\(\): neuron must be a whole number", run.times, ("first",), {}),
                (r"times\(\): an argument is out of range", run.times, (10**30,), {}),
                (r"rate\(\) needs bin_s", run.rate, (), {}),
                (r"psth\(\) has no keyword bins; the known ones are bin_s", run.psth, (), {"bins": 3}),
                (r"from_text\(\): text must be a text, but is 5", merkel.Scene.from_text, (5,), {}),
                (r"Scene\(\): name_or_file must be a path, but is 5", merkel.Scene, (5,), {}),
                (r"scene\[key\]: key must be a text, but is 5", scene.__getitem__, (5,), {}),
                (r"stream\(\): max_gap_s must be a number, but is '1 day'", scene.stream, (), {"max_gap_s": "1 day"}),
                (r"finish\(\) takes 0 arguments without a name, but got 1", stream.finish, (1,), {}),
                (r"load\(\): file must be a path, but is 5", merkel.load, (5,), {}),
                (r"connect\(\) has .*keyword argument 'duration'; its arguments are probe, scene, sinks, duration_s", merkel.connect, (LIVE,), {"duration": 3}),
                (r"connect\(\): probe must be a URI", merkel.connect, (5,), {}),
                (r"batch\(\) has .*keyword argument 'core'", merkel.batch, ([],), {"core": 2}),
                (r"cores must be a whole number of at least 1, not -1", merkel.batch, ([],), {"cores": -1}),
                (r"out must not be empty", merkel.batch, ([],), {"out": ""}),
                (r"jobs must be a list of dicts, .*, but is {'scene': 'paper'}", merkel.batch, ({"scene": "paper"},), {}),
                (r"jobs must be a list of dicts, .*, but is None", merkel.batch, (None,), {}),
                (r"job 0 must be a dict of its keys, but is None", merkel.batch, ([None],), {}),
                (r"probe must be a URI or a list of URIs, but is \[1, 2\]", scene.run, (), {"probe": [1, 2]}),
                (r"probe must be a URI or a list of URIs, but is .*udcff", scene.run, (), {"probe": "replay:\udcff.csv"}),
                (r"depth_mm must be an array of numbers: .*, but has 3 dimensions", scene.run, (), {"depth_mm": np.ones((2, 2, 2)), "rate_hz": 1}),
                (r"depth_mm must be .*, but has the dtype \[\('a', '<f8'\)\]", scene.run, (), {"depth_mm": np.ones(2, [("a", "f8")]), "rate_hz": 1}),
                (r"at rate_hz = 1e-12, the 3 samples take more than 4e9 s", scene.run, (), {"depth_mm": np.ones(3), "rate_hz": 1e-12}),
                (r"cannot read the session .*\ufffd.xdf: No such file", merkel.load, (b"\xff.xdf",), {}),
                (r"cannot read .*\ufffd.toml: No such file", merkel.Scene, (b"\xff.toml",), {}),
                (r"cannot write .*rows.jsonl: Not a directory", merkel.batch, ([],), {"out": __file__ + "/out"}),
                (r"fit\(\) has .*keyword argument 'trial'", merkel.fit, (), {"trial": 2}),
                (r"trials\(\) has .*keyword argument 'forces'", merkel.trials, ([],), {"forces": "ch1"}),
                (r"connect\(\): duration_s must be a number or None, but is 'long'", merkel.connect, (LIVE,), {"duration_s": "long"}),
                (r"connect\(\): most_unread must be a whole number from 0 on, but is -5", merkel.connect, (LIVE,), {"most_unread": -5})):
            with self.subTest(sentence=sentence):
                self.assert_error(sentence, function, *arguments, **keywords)

    def test_times_and_sizes_that_can_do_nothing_are_refused(self):
        for duration_s in (0, -1, float("nan"), float("inf"), 1e300):
            self.assert_error("duration_s must be a number of seconds from 1e-6 to 4e9, but is", merkel.connect, LIVE, duration_s=duration_s)
            self.assert_error("duration_s must be a number of seconds", merkel.Scene("paper").run, duration_s=duration_s)
        with merkel.connect(LIVE) as bridge:
            self.assert_error("timeout_s must be a number of seconds, but is nan", bridge.read, float("nan"))
        self.assert_error("most_unread must be at least 1, but is 0", merkel.connect, LIVE, most_unread=0)

    def test_a_long_value_is_cut_where_it_is_echoed(self):
        long = "x" * 1_000_000
        for function, arguments, keywords in (
                (merkel.Scene, (long,), {}), (merkel.Scene("paper").run, (), {"probe": long}),
                (merkel.Scene("paper").run, (), {"probe": "replay:" + long}), (merkel.connect, (long,), {}),
                (merkel.Scene.from_text, (f'preset = "{long}"',), {}), (merkel.Scene.from_text, (f'{long} = 1',), {}),
                (merkel.Scene("paper").__setitem__, ("skin." + long, 1), {}), (merkel.load, (long,), {})):
            started = time.monotonic()
            self.assert_error(".", function, *arguments, **keywords)
            self.assertLess(time.monotonic() - started, 10)


class Objects(unittest.TestCase):
    def test_an_object_that_was_never_made_raises_at_every_attribute(self):
        """In a process of its own, for a crash would end the tests."""
        done = run_python("""
def use(action):
    global raised
    try:
        action()
    except Exception:
        raised += 1
raised, used = 0, 0
for cls in (merkel.Bridge, merkel.Run, merkel.Scene, merkel.Session, merkel.Stream, merkel.Table):
    for name in [each for each in dir(cls) if each not in dir(object)] + ["skin"]:
        try:
            value = getattr(cls.__new__(cls), name)
        except Exception:
            raised, used = raised + 1, used + 1
            continue
        if callable(value):
            for arguments in ((), (1,), ("x",), ("x", 1)):
                use(lambda: value(*arguments))
            used += 4
    for action in (repr, dir, lambda each: pickle.dumps(each), lambda each: each["skin.radius_mm"],
                   lambda each: merkel.connect("sim:taps?live=1", each)):
        use(lambda: action(cls.__new__(cls)))
print(used, raised)
""")
        self.assertEqual(done.returncode, 0, done.stderr)
        used, raised = map(int, done.stdout.split())
        self.assertGreater(used, 60)
        self.assertGreaterEqual(raised, used)

    def test_what_cannot_be_pickled_says_so_and_other_bytes_are_no_run(self):
        for each in (merkel.Scene("paper").stream(), merkel.Scene("paper").skin):
            with self.assertRaises(TypeError):
                pickle.dumps(each)
        run = merkel.Run.__new__(merkel.Run)
        for state in ((), (b"1",) * 7, 5, None):
            with self.assertRaises(Exception):
                run.__setstate__(state)


class Gaps(unittest.TestCase):
    def test_a_gap_beyond_the_limit_is_an_error_that_names_it(self):
        stream = merkel.Scene("paper").stream()
        stream.push(0, depth_mm=0.5)
        with self.assertRaisesRegex(merkel.Error, r"1e\+05 s after the last one of its probe, which is more than max_gap_s = 60"
                                                  r".*scene.stream\(max_gap_s=1e\+05\)"):
            stream.push(1e5, depth_mm=0.5)
        stream.push(59, depth_mm=0.5)
        self.assertGreater(stream.time_s, 58)

    def test_the_advice_allows_it(self):
        stream = merkel.Scene("paper").stream(max_gap_s=200)
        stream.push(0, depth_mm=0)
        stream.push(200, depth_mm=0)
        with self.assertRaisesRegex(merkel.Error, "max_gap_s must be a positive number"):
            merkel.Scene("paper").stream(max_gap_s=0)

    def test_control_c_ends_a_long_push_and_no_spike_is_lost(self):
        press = dict(depth_mm=1.0)
        stream = merkel.Scene("goodwin").stream(max_gap_s=1e5)
        stream.push(0, **press)
        killer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        killer.start()
        started = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            stream.push(1e5, **press)
        self.assertLess(time.monotonic() - started, 20)
        done_s = stream.time_s
        self.assertLess(done_s, 9e4)
        threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            stream.finish()
        self.assertGreater(stream.time_s, done_s)
        del stream
        whole = merkel.Scene("goodwin").stream()
        expected = [whole.push(t, **press).spikes for t in (0, 20)]
        interrupted = merkel.Scene("goodwin").stream()
        interrupted.push(0, **press)
        signal.setitimer(signal.ITIMER_REAL, 0.06)
        handler = signal.signal(signal.SIGALRM, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGALRM, handler)
        try:
            got = [interrupted.push(20, **press).spikes]
        except KeyboardInterrupt:
            got = []
        signal.setitimer(signal.ITIMER_REAL, 0)
        got += [interrupted.push(20.5, **press).spikes]
        expected += [whole.push(20.5, **press).spikes]
        np.testing.assert_array_equal(np.concatenate(got), np.concatenate(expected))

    def test_control_c_ends_a_fit(self):
        timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            # It would take hours.
            merkel.fit("goodwin", trials=16, evaluations=100_000, parameters=["gain_Hz_per_kPa", "field_radius_mm"])


class Threads(unittest.TestCase):
    def test_stop_from_five_threads_while_four_read_and_three_mark(self):
        for _ in range(3):
            bridge = merkel.connect(LIVE, "paper")

            def quietly(action):
                try:
                    action()
                except merkel.Error:
                    pass

            def read():
                while not bridge.ended:
                    bridge.read(timeout_s=0.01)

            def mark():
                for k in range(50):
                    bridge.mark(f"mark {k}")

            def stop():
                time.sleep(0.3)
                bridge.stop()

            threads = [threading.Thread(target=quietly, args=(action,), daemon=True)
                       for action in [read] * 4 + [mark] * 3 + [stop] * 5]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(30)
            self.assertEqual([thread.is_alive() for thread in threads], [False] * len(threads))

    def test_one_stream_in_two_threads_is_an_error_or_in_turn(self):
        stream = merkel.Scene("paper").stream()
        faults = []

        def push():
            for k in range(200):
                try:
                    stream.push(k / 10, depth_mm=1.0)
                except merkel.Error as error:
                    faults.append(str(error))

        threads = [threading.Thread(target=push) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertTrue(all("in use" in fault or "in order of time" in fault for fault in faults), set(faults))


class Endings(unittest.TestCase):
    def test_a_fork_has_no_run_and_ends(self):
        done = run_python(f"""
bridge = merkel.connect({LIVE!r}, "paper")
bridge.read(timeout_s=1)
child = os.fork()
if child == 0:
    try:
        bridge.read(timeout_s=1)
    except merkel.Error as error:
        print(error, flush=True)
    bridge.stop()
    del bridge
    print(len(merkel.Scene("paper").run().spikes) > 0, flush=True)
    sys.exit(7)
_, status = os.waitpid(child, 0)
bridge.read(timeout_s=1)
bridge.stop()
print(os.waitstatus_to_exitcode(status), bridge.counters["ticks"] > 0)
""")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("not in this fork of it", done.stdout)
        self.assertEqual(done.stdout.splitlines()[1:], ["True", "7 True"])

    def test_threads_inside_do_not_abort_the_exit(self):
        loops = {
            "a bridge": "for output in bridge: pass",
            "reads with a timeout": "while True: bridge.read(timeout_s=0.02)",
            "reads that wait": "while True: bridge.read(timeout_s=60)",
            "marks and counters": "while True: bridge.mark('x'); bridge.counters; bridge.notices",
            "a stream": "stream = merkel.Scene('paper').stream()\n    k = 0\n    while True: k += 1; stream.push(k / 10, depth_mm=1.0)",
            "runs": "while True: merkel.Scene('hand').run(duration_s=5)",
            "one long run": "merkel.Scene('paper').run(probe='sim:taps?count=1000000')",
            "connections": "while True: merkel.connect(LIVE, 'paper').read(timeout_s=0.1)",
        }
        for number, (name, loop) in enumerate(loops.items()):
            for end_number, end in enumerate(("", "raise ValueError('on purpose')", "sys.exit(5)")):
                if (number + end_number) % 3 and "MERKEL_FULL_SWEEPS" not in os.environ:
                    continue
                with self.subTest(name=name, end=end), tempfile.TemporaryDirectory(prefix="merkel-") as folder:
                    file = os.path.join(folder, "s.xdf")
                    done = run_python(f"""
import threading
LIVE = {LIVE!r}
bridge = merkel.connect(LIVE, "paper", sinks=["xdf:{file}"])
def loop():
    {loop}
for _ in range(3):
    threading.Thread(target=loop, daemon=True).start()
bridge.read(timeout_s=5)
{end}
""")
                    self.assertEqual(done.returncode, {"": 0, "r": 1, "s": 5}[end[:1]], done.stderr)
                    self.assertNotIn("terminate", done.stderr)
                    self.assertNotIn("Fatal", done.stderr)
                    self.assertTrue(merkel.load(file).complete)

    def test_an_exception_in_a_with_block_ends_the_readers(self):
        done = run_python(f"""
import threading
with merkel.connect({LIVE!r}, "paper") as bridge:
    readers = [threading.Thread(target=lambda: [None for _ in bridge]) for _ in range(3)]
    for reader in readers:
        reader.start()
    bridge.read(timeout_s=5)
    raise ValueError("on purpose")
""")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("ValueError: on purpose", done.stderr)
        self.assertNotIn("terminate", done.stderr)

    def test_a_fork_ends_while_threads_of_its_parent_read(self):
        done = run_python(f"""
import threading
bridge = merkel.connect({LIVE!r}, "paper")
for _ in range(3):
    threading.Thread(target=lambda: [bridge.read(timeout_s=60) for _ in iter(int, 1)], daemon=True).start()
bridge.mark("one")
for _ in range(5):
    child = os.fork()
    if child == 0:
        for use in (lambda: bridge.ended, lambda: bridge.counters, lambda: bridge.notices, bridge.tare):
            try:
                use()
                sys.exit(8)
            except merkel.Error as error:
                assert "fork" in str(error)
        sys.exit(7)
    _, status = os.waitpid(child, 0)
    print(os.waitstatus_to_exitcode(status), flush=True)  # what waits would be the next child's too
""")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.split(), ["7"] * 5, done.stderr)

    def test_a_fork_solves_a_tip_that_a_thread_of_its_parent_was_solving(self):
        forks = 8 if "MERKEL_FULL_SWEEPS" in os.environ else 2
        done = run_python(f"""
import signal, threading
present = 0
def prepare(k):
    merkel.Scene("goodwin", overrides={{"probe.radius_mm": 3 + k / 64}}).stream()
def prepare_all():
    global present
    for present in range(1000):
        prepare(present)
threading.Thread(target=prepare_all, daemon=True).start()
for _ in range({forks}):
    time.sleep(0.1)
    child = os.fork()
    if child == 0:
        signal.alarm(30)
        prepare(present)
        os._exit(7)
    _, status = os.waitpid(child, 0)
    print(os.waitstatus_to_exitcode(status), flush=True)
os._exit(0)
""")
        self.assertEqual(done.stdout.split(), ["7"] * forks, done.stderr)

    def test_exit_without_stop_ends_the_run_and_its_files(self):
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            file = os.path.join(folder, "s.xdf")
            done = run_python(f'bridge = merkel.connect({LIVE!r}, "paper", sinks=["xdf:{file}"])\nbridge.mark("one")\n')
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(merkel.load(file).complete)

    def test_collected_garbage_ends_a_run(self):
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            file = os.path.join(folder, "s.xdf")
            bridge = merkel.connect(LIVE, "paper", sinks=["xdf:" + file])
            bridge.mark("one")
            circle = [bridge]
            circle.append(circle)
            del bridge, circle
            gc.collect()
            self.assertTrue(merkel.load(file).complete)

    def test_an_exception_in_with_ends_the_run_and_stays_the_error(self):
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            file = os.path.join(folder, "s.xdf")
            with self.assertRaisesRegex(ZeroDivisionError, "own"):
                with merkel.connect(LIVE, "paper", sinks=["xdf:" + file]) as bridge:
                    bridge.mark("one")
                    raise ZeroDivisionError("own")
            self.assertTrue(merkel.load(file).complete)
            with self.assertRaisesRegex(merkel.Error, "the run is over"):
                bridge.mark("late")


class Stub(unittest.TestCase):
    def test_every_public_callable_is_checked(self):
        """A new method whose wrong arguments would be reported as a list of C++ signatures."""
        for cls in CLASSES[:-1]:
            for name, value in vars(cls).items():
                if not name.startswith("_") and callable(value):
                    self.assertTrue(inspect.isfunction(inspect.unwrap(value, stop=inspect.isfunction)), f"{cls.__name__}.{name}")


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
