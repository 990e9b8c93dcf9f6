#!/usr/bin/env python3
"""Every example of tools/python/examples runs. Those whose packages are missing are skipped, with the reason."""
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import merkel

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "tools" / "python" / "examples"
PROGRAM = os.environ["MERKEL_PROGRAM"]


class Examples(unittest.TestCase):
    def run_example(self, name, *arguments, needs=None, stand_in=None):
        if needs and subprocess.run([sys.executable, "-c", "import " + needs], capture_output=True).returncode:
            self.skipTest(f"{needs} is not installed")
        folders = ([str(pathlib.Path(__file__).parent / stand_in)] if stand_in else []) + [os.environ.get("PYTHONPATH", "")]
        done = subprocess.run([sys.executable, str(EXAMPLES / name), *arguments], capture_output=True, text=True,
                              timeout=200, env={**os.environ, "PYTHONPATH": os.pathsep.join(folders)})
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def test_press(self):
        picture = os.path.join(self.folder, "press.png")
        self.run_example("press.py", picture, needs="matplotlib")
        self.assertGreater(os.path.getsize(picture), 1000)

    def test_encode_loop(self):
        lines = self.run_example("encode_loop.py").splitlines()
        self.assertEqual(len(lines), 5)
        self.assertNotIn(": 0 Hz", lines[1])

    def test_ni_card(self):
        line = self.run_example("ni_card.py", "Dev1/ai0", "0.2", "2", stand_in="nidaqmx_stand_in")
        spikes, samples = int(line.split()[0]), int(line.split()[3])
        self.assertGreater(spikes, 0, line)
        self.assertGreater(samples, 2000, line)

    def test_brian2_live(self):
        cuneate, afferents = self.run_example("brian2_live.py", needs="brian2").splitlines()
        self.assertGreater(int(cuneate.split()[0]), 0)
        arrived, between = int(afferents.split()[0]), int(afferents.split()[3])
        stream, spikes = merkel.Scene("finger").stream(), 0
        for tick in range(200):
            spikes += len(stream.push(tick / 1000, depth_mm=1.5 * min(1.0, tick / 100))[0])
        self.assertEqual(arrived, spikes)
        # Nine of ten steps of 0.1 ms are not at a tick.
        self.assertGreater(between, 0.7 * arrived)

    def test_session_table(self):
        session = os.path.join(self.folder, "s.xdf")
        subprocess.run([PROGRAM, "run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
                        "xdf:" + session], check=True, capture_output=True)
        self.assertIn("spikes", self.run_example("session_table.py", session, needs="pandas"))

    def test_three_rigs(self):
        def free_port():
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", 0))
                return probe.getsockname()[1]

        endpoints = {rig: f"tcp://127.0.0.1:{free_port()}" for rig in ("left", "right", "foot")}
        rigs = [subprocess.Popen([PROGRAM, "run", scene, "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
                                  f"zmq:{endpoint}?topic={rig}&subscribers=1&wait_s=200"], stdout=subprocess.DEVNULL)
                for (rig, endpoint), scene in zip(endpoints.items(), ("paper", "finger", "goodwin"))]
        for endpoint in endpoints.values():  # the example ends 2 s after the last spike: all rigs are ready before it starts
            host, port = endpoint.removeprefix("tcp://").split(":")
            while True:
                try:
                    socket.create_connection((host, int(port))).close()
                    break
                except ConnectionRefusedError:
                    time.sleep(0.05)
        subscriber = subprocess.Popen([sys.executable, str(EXAMPLES / "three_rigs.py"),
                                       *(f"{rig}={endpoint}" for rig, endpoint in endpoints.items())],
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(subscriber.kill)
        self.assertEqual([rig.wait(240) for rig in rigs], [0, 0, 0])
        out, error = subscriber.communicate(timeout=60)
        if "No module named 'zmq'" in error:
            self.skipTest("zmq is not installed")
        trace = "replay:tests/traces/taps.csv"
        counts = [len(merkel.Scene(scene).run(probe=trace).spikes) for scene in ("paper", "finger", "goodwin")]
        self.assertEqual(out, "".join(f"{rig}: {count} spikes received, 0 lost on the way\n"
                                      for rig, count in zip(endpoints, counts)), error)

    def test_every_example_is_tested(self):
        tested = {name[len("test_"):] + ".py" for name in dir(self) if name.startswith("test_")}
        self.assertLessEqual({file.name for file in EXAMPLES.glob("*.py")}, tested)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
