"""A run as nodes of a BRAND graph read it: from a real Redis server, by redis-py, as BRAND's own nodes do.

Entries follow BRAND's documents BRAND_spec (states) and DataSyncGuidelines (ts, sync)."""
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import redis

import merkel_program
from merkel_program import free_port, spikes_of_csv, wait_for

SCENE = """[[electrode]]
name = "E1"
encoder = "linear"
field_mm = [15, 10, 5]
full_force_N = 0.1
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[stimulation]
max_charge_nC = 16
max_total_uA = 100
watchdog_ms = 200
"""
STATES = ["NODE_STARTED", "NODE_READY", "NODE_SHUTDOWN"]


class Redis(merkel_program.TestCase):
    def setUp(self):
        super().setUp()
        self.port = free_port()
        server = subprocess.Popen(
            ["redis-server", "--port", str(self.port), "--bind", "127.0.0.1", "--save", "", "--appendonly",
             "no", "--dir", self.path(""), "--unixsocket", self.path("socket")], stdout=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        self.client = redis.Redis(port=self.port)
        self.addCleanup(self.client.close)
        self.assertTrue(wait_for(self.answers))
        with open(self.path("scene.toml"), "w") as scene:
            scene.write(SCENE)

    def answers(self):
        try:
            return self.client.ping()
        except redis.exceptions.ConnectionError:
            return False

    def entries(self, stream):
        """The entries, names as text, values as bytes."""
        return [{name.decode(): value for name, value in fields.items()}
                for _, fields in self.client.xrange(stream)]

    def states(self):
        return [entry["status"].decode() for entry in self.entries("touch_state")]

    def publish_graph(self, parameters, **further):
        graph = {"nodes": {"other": {"nickname": "other", "parameters": {}},
                           "touch": {"nickname": "touch", "parameters": parameters, **further}}}
        self.client.xadd("supergraph_stream", {"data": json.dumps(graph)})

    def check_labels(self, entries):
        """Every entry has its time of sending, 8 bytes, and a label of its data, JSON."""
        now = time.monotonic_ns()
        for entry in entries:
            sent, = np.frombuffer(entry["ts"], np.uint64)
            self.assertTrue(now - 300 * 10**9 < int(sent) <= now)
            self.assertGreaterEqual(json.loads(entry["sync"])["merkel_time_ns"], 0)

    def node(self, *flags):
        environment = dict(os.environ, MERKEL_PROGRAM=merkel_program.PROGRAM)
        return subprocess.Popen([sys.executable, "tools/brand_node", "-n", "touch", *flags], env=environment,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def test_every_update_is_an_entry_with_the_next_heartbeat(self):
        self.merkel("run", "--fast", self.path("scene.toml"), "--sink",
                    f"redis:127.0.0.1:{self.port}?node=touch", "--sink", "stim-csv:" + self.path("c.csv"))
        updates = self.entries("touch")
        with open(self.path("c.csv")) as file:
            rows = [line.rstrip("\n").split(",") for line in file][1:]
        self.assertEqual(len(updates), len(rows))
        for number, (update, row) in enumerate(zip(updates, rows), 1):
            self.assertEqual(int(update["heartbeat"]), number)
            self.assertEqual(int(update["time_ns"]), round(float(row[0]) * 1e9))
            self.assertEqual(json.loads(update["amplitude_uA"]), [float(row[3])])
            self.assertEqual(json.loads(update["frequency_Hz"]), [float(row[4])])
            self.assertEqual(json.loads(update["stop"]), [row[6]])
        self.assertGreater(max(json.loads(update["amplitude_uA"])[0] for update in updates), 20)
        self.check_labels(updates)
        states = self.entries("touch_state")
        self.assertEqual(self.states(), STATES)
        self.assertEqual(json.loads(states[0]["parameters"])["electrodes"][0]["name"], "E1")

    def test_a_graph_starts_the_node_and_sigint_ends_it(self):
        self.publish_graph({"scene": self.path("scene.toml"), "probe": "sim:ramp?wait_s=0&hold_s=600&live=1"})
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.addCleanup(node.communicate)
        self.addCleanup(node.kill)
        self.assertTrue(wait_for(lambda: self.client.xlen("touch") > 5))
        node.send_signal(signal.SIGINT)
        node.wait(timeout=30)
        self.assertEqual(self.states(), STATES)
        last = self.entries("touch")[-1]
        self.assertEqual(json.loads(last["amplitude_uA"]), [0])
        self.assertEqual(json.loads(last["stop"]), ["end"])

    def test_a_socket_does_as_well(self):
        self.publish_graph({"scene": self.path("scene.toml"), "arguments": ["--fast"]})
        node = self.node("-s", self.path("socket"))
        self.assertEqual(node.wait(timeout=60), 0, node.communicate()[1])
        self.assertGreater(self.client.xlen("touch"), 5)

    def test_a_graph_without_the_node_is_refused(self):
        self.client.xadd("supergraph_stream", {"data": '{"nodes": {}}'})
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.assertIn("no node with the nickname touch", node.communicate(timeout=30)[1])
        self.assertEqual(node.returncode, 1)
        self.assertEqual(self.states(), ["NODE_FATAL_ERROR"])

    def test_a_run_that_fails_writes_its_state(self):
        self.publish_graph({"scene": "finger", "probe": "replay:none.csv", "arguments": ["--fast"]})
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.assertIn("none.csv", node.communicate(timeout=30)[1])
        last = self.entries("touch_state")[-1]
        self.assertEqual(last["status"], b"NODE_FATAL_ERROR")
        self.assertIn(b"none.csv", last["message"])

    def test_spikes_come_as_events_and_as_counts_without_electrodes(self):
        self.merkel("run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
                    f"redis:127.0.0.1:{self.port}?node=touch&bin_ms=20", "--sink", "csv:" + self.path("s.csv"))
        spikes = spikes_of_csv(self.path("s.csv"))
        events, counts = self.entries("touch_spikes"), self.entries("touch_counts")
        self.check_labels(events + counts)
        times = np.concatenate([np.frombuffer(entry["time_ns"], np.int64) for entry in events])
        neurons = np.concatenate([np.frombuffer(entry["neuron"], np.uint32) for entry in events])
        self.assertEqual(list(zip(times, neurons)), spikes)
        bins = np.array([np.frombuffer(entry["counts"], np.uint16) for entry in counts])
        ends = np.array([json.loads(entry["sync"])["merkel_time_ns"] for entry in counts])
        self.assertTrue((np.diff(ends) == 20_000_000).all())
        inside = times < ends[-1]
        expected = np.zeros_like(bins)
        np.add.at(expected, ((times[inside] - (ends[0] - 20_000_000)) // 20_000_000, neurons[inside] - 1), 1)
        self.assertTrue((bins == expected).all())
        self.assertGreater(bins.sum(), 20)

    def test_the_graphs_priority_and_cores_are_used(self):
        self.publish_graph({"scene": "finger", "probe": "sim:ramp?wait_s=0&hold_s=600&live=1",
                            "sink": "xdf:" + self.path("s.xdf")}, run_priority=41, cpu_affinity="0")
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.addCleanup(node.communicate)
        self.addCleanup(node.kill)
        self.assertTrue(wait_for(lambda: self.client.xlen("touch_counts") > 5))
        children = subprocess.run(["pgrep", "-P", str(node.pid)], capture_output=True, text=True).stdout.split()
        self.assertEqual([os.sched_getaffinity(int(child)) for child in children], [{0}])
        node.send_signal(signal.SIGINT)
        self.assertIn(node.wait(timeout=30), (0, 1))
        scene = self.merkel("inspect", "session", self.path("s.xdf"), "--fact", "scene_text").stdout
        self.assertRegex(scene, r"(?m)^priority\s*=\s*41\b")


if __name__ == "__main__":
    if not (shutil.which("redis-server") and shutil.which("redis-cli")):
        print("redis-server is not installed: tools/install_packages test")
        sys.exit(77)
    if "built without" in merkel_program.run("run", "--sink", "redis:127.0.0.1:1").stderr:
        sys.exit(77)
    merkel_program.main()
