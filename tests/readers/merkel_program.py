"""Shared by the tests with real readers: the built program, and a folder for each test."""
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = os.environ["MERKEL_PROGRAM"]
SOAK = os.environ.get("MERKEL_SOAK")
FULL = "MERKEL_FULL_SWEEPS" in os.environ
# Simulated seconds of a soak test: an hour in .ci/run.
SOAK_S = float(os.environ.get("MERKEL_SOAK_S", "3600" if FULL else "300"))
# Of a test that takes long: .ci/run runs it.
long = unittest.skipUnless(FULL, "long: MERKEL_FULL_SWEEPS=1 runs it")

# What a host that stands still for a moment costs a live run.
FAILURES_OF_A_BUSY_HOST = {"skipped", "touch_lost"}


def start(*arguments, **more):
    return subprocess.Popen([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, **more)


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def spikes_of_csv(path):
    """Rows (time in ns, neuron)."""
    with open(path) as file:
        lines = (line for line in file if not line.startswith("#"))
        assert next(lines) == "time_s,neuron\n"
        rows = (line.split(",") for line in lines)
        return [(round(float(time_s) * 1e9), int(neuron)) for time_s, neuron in rows]


def wait_for(condition, seconds=30.0):
    """Waits for a condition; with a long timeout, because test machines are busy."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return False


class TestCase(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="merkel-")
        self.addCleanup(self._folder.cleanup)

    def path(self, name):
        return os.path.join(self._folder.name, name)

    def merkel(self, *arguments, exit_code=0):
        done = run(*arguments)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        return done

    def live_summary(self, out, err, exit_code, failed_by=frozenset()):
        """Of a live run with --json, which failed by these findings and those of a busy host only."""
        summary = json.loads(out)
        failures = {finding["kind"] for finding in summary["verdict"] if finding["severity"] == "failure"}
        self.assertEqual(failures - FAILURES_OF_A_BUSY_HOST, failed_by, err)
        self.assertEqual(exit_code, 1 if failures else 0, err)
        return summary


def main():
    sys.exit(unittest.main(verbosity=2))
