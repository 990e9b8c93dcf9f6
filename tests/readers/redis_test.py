"""Stimulation commands as nodes of a BRAND graph read them, from a real Redis server by redis-cli."""
import json
import os
import shutil
import signal
import subprocess
import sys

import merkel_program
from merkel_program import free_port, wait_for

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
"""


class Redis(merkel_program.TestCase):
    def setUp(self):
        super().setUp()
        self.port = free_port()
        server = subprocess.Popen(
            ["redis-server", "--port", str(self.port), "--bind", "127.0.0.1", "--save", "", "--appendonly",
             "no", "--dir", self.path(""), "--unixsocket", self.path("socket")], stdout=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        self.assertTrue(wait_for(lambda: self.redis("PING") == "PONG"))
        with open(self.path("scene.toml"), "w") as scene:
            scene.write(SCENE)

    def redis(self, *command):
        done = subprocess.run(["redis-cli", "-p", str(self.port), "--json", *command], capture_output=True,
                              text=True)
        return json.loads(done.stdout) if done.returncode == 0 and done.stdout.strip() else None

    def entries(self, stream):
        return [dict(zip(fields[::2], fields[1::2])) for _, fields in self.redis("XRANGE", stream, "-", "+")]

    def publish_graph(self, parameters):
        graph = {"nodes": {"other": {"nickname": "other", "parameters": {}},
                           "touch": {"nickname": "touch", "parameters": parameters}}}
        self.redis("XADD", "supergraph_stream", "*", "data", json.dumps(graph))

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
        states = self.entries("touch_state")
        self.assertEqual([state["status"] for state in states], ["initialized", "done"])
        self.assertEqual(json.loads(states[0]["parameters"])["electrodes"][0]["name"], "E1")

    def test_a_graph_starts_the_node_and_sigint_ends_it(self):
        self.publish_graph({"scene": self.path("scene.toml"), "probe": "sim:ramp?wait_s=0&hold_s=600&live=1"})
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.addCleanup(node.communicate)
        self.addCleanup(node.kill)
        self.assertTrue(wait_for(lambda: (self.redis("XLEN", "touch") or 0) > 5))
        node.send_signal(signal.SIGINT)
        node.wait(timeout=30)
        self.assertEqual([state["status"] for state in self.entries("touch_state")], ["initialized", "done"])
        last = self.entries("touch")[-1]
        self.assertEqual(json.loads(last["amplitude_uA"]), [0])
        self.assertEqual(json.loads(last["stop"]), ["end"])

    def test_a_socket_does_as_well(self):
        self.publish_graph({"scene": self.path("scene.toml"), "arguments": ["--fast"]})
        node = self.node("-s", self.path("socket"))
        self.assertEqual(node.wait(timeout=60), 0, node.communicate()[1])
        self.assertGreater(self.redis("XLEN", "touch"), 5)

    def test_a_graph_without_the_node_is_refused(self):
        self.redis("XADD", "supergraph_stream", "*", "data", '{"nodes": {}}')
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.assertIn("no node with the nickname touch", node.communicate(timeout=30)[1])
        self.assertEqual(node.returncode, 1)


if __name__ == "__main__":
    if not (shutil.which("redis-server") and shutil.which("redis-cli")):
        print("redis-server is not installed: tools/install_packages test")
        sys.exit(77)
    if "built without" in merkel_program.run("run", "--sink", "redis:127.0.0.1:1").stderr:
        sys.exit(77)
    merkel_program.main()
