#!/usr/bin/env python3
"""A run as nodes of a BRAND graph read it: from a real Redis server, by redis-py, as BRAND's own nodes do.

Entries follow BRAND's documents BRAND_spec (states) and DataSyncGuidelines (ts, sync)."""
import csv
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import redis

import merkel_program
import stimulation_receivers
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
        self.client = redis.Redis(port=self.port)
        self.addCleanup(self.client.close)
        self.start_server()
        with open(self.path("scene.toml"), "w") as scene:
            scene.write(SCENE)

    def start_server(self):
        self.server = subprocess.Popen(
            ["redis-server", "--port", str(self.port), "--bind", "127.0.0.1", "--save", "", "--appendonly",
             "no", "--dir", self.path(""), "--unixsocket", self.path("socket")], stdout=subprocess.DEVNULL)
        self.addCleanup(self.server.wait)
        self.addCleanup(self.server.kill)
        self.assertTrue(wait_for(self.answers))

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

    def node(self, *flags, name="touch"):
        environment = dict(os.environ, MERKEL_PROGRAM=merkel_program.PROGRAM)
        return subprocess.Popen([sys.executable, "tools/brand_node", "-n", name, *flags], env=environment,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def publish(self, stream, entry):
        """Adds entry(k) to the stream, 500 times a second."""
        def work():
            start = time.monotonic()
            for k in range(10**6):
                if stop.wait(max(0, start + k / 500 - time.monotonic())):
                    return
                self.client.xadd(stream, entry(k), maxlen=1000)
        stop, thread = threading.Event(), threading.Thread(target=work)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(stop.set)

    def read_samples(self, probe, seconds="1"):
        """The samples of a run with that probe: columns by name."""
        session = self.path("r.xdf")
        done = merkel_program.run("run", "finger", "--probe", probe, "--duration-s", seconds, "--sink", "xdf:" + session,
                                  "--overwrite")
        self.assertTrue(os.path.exists(session), done.stderr)
        rows = list(csv.DictReader(io.StringIO(
            self.merkel("inspect", "session", session, "--stream", "samples").stdout)))
        self.assertGreater(len(rows), 100, done.stderr)
        return rows

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

    def check_interruption(self, interrupt, resume):
        """While the server is away, the other sink goes on; then an off comes first, and amplitudes rise from 0 within the slope.
        \returns the amplitudes that the server had accepted before, with the times at which they were sent, and when it was interrupted"""
        with open(self.path("scene.toml"), "a") as scene:
            scene.write("max_slope_uA_per_s = 400\n")
        os.mkfifo(self.path("pipe"))
        other = stimulation_receivers.Pipe(self.path("pipe"))
        other.start()
        run = merkel_program.start("run", self.path("scene.toml"), "--probe", "sim:ramp?wait_s=0&hold_s=600&live=1", "--sink",
                                   f"redis:127.0.0.1:{self.port}?node=touch", "--sink", "stim-csv:" + self.path("pipe"))
        self.addCleanup(run.communicate)
        self.addCleanup(run.kill)

        def on_since(then_ns):
            entries = self.entries("touch")[-1:]
            return any(int(entry["sent_monotonic_ns"]) > then_ns and json.loads(entry["amplitude_uA"])[0] > 20 for entry in entries)
        self.assertTrue(wait_for(lambda: on_since(0)))
        interrupt()
        interrupted_ns = time.monotonic_ns()
        time.sleep(1)  # several watchdogs
        self.assertTrue(wait_for(lambda: other.uA.value > 20))
        resumed_ns = time.monotonic_ns()
        resume()
        self.assertTrue(wait_for(lambda: on_since(resumed_ns)))
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=60)
        self.assertIn("stimulation is over there, until it answers", errors)
        self.assertIn("it answers again", errors)
        updates = [(int(entry["sent_monotonic_ns"]), json.loads(entry["amplitude_uA"])[0], json.loads(entry["stop"])[0])
                   for entry in self.entries("touch")]
        after = [update for update in updates if update[0] > resumed_ns]
        self.assertEqual(after[0][1:], (0, "sink_failure"))
        for sent, uA, _ in after:
            self.assertLessEqual(uA, 400e-9 * (sent - after[0][0]) + 400 * 0.005)
        self.assertTrue(wait_for(other.ended.is_set))
        self.assertTrue(any(update.uA > 20 for update in other.notes() if interrupted_ns + 5e8 < update.sent * 1e9 < resumed_ns))
        return [update[:2] for update in updates if update[0] <= resumed_ns], interrupted_ns

    def test_a_server_that_stalls_gets_an_off_first_and_the_other_sinks_go_on(self):
        before, stopped_ns = self.check_interruption(lambda: self.server.send_signal(signal.SIGSTOP),
                                                     lambda: self.server.send_signal(signal.SIGCONT))
        # Whatever the server accepted before it stalled was valid until the watchdog only.
        self.assertLess(max(sent for sent, uA in before if uA > 0), stopped_ns + 400_000_000)

    def test_a_server_that_restarts_gets_an_off_first_and_the_other_sinks_go_on(self):
        def kill():
            self.server.kill()
            self.server.wait()
        before, _ = self.check_interruption(kill, self.start_server)
        self.assertEqual(before, [])  # nothing that came while it was away

    def test_a_server_out_of_memory_gets_an_off_first_and_the_other_sinks_go_on(self):
        before, full_ns = self.check_interruption(lambda: self.client.config_set("maxmemory", 1),
                                                  lambda: self.client.config_set("maxmemory", 0))
        self.assertLessEqual(max(sent for sent, _ in before), full_ns)

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

    def test_a_probe_reads_the_entries_of_a_stream_at_their_times(self):
        sent = {}

        def entry(k):
            ts, force = time.monotonic_ns(), round(0.001 * (k % 700), 6)
            sent[ts] = force
            return {"ts": np.uint64(ts).tobytes(), "sync": "{}", "force_N": str(force), "note": "x"}
        self.publish("gauge", entry)
        for row in self.read_samples(f"redis:127.0.0.1:{self.port}?stream=gauge"):
            self.assertAlmostEqual(float(row["force_mN"]), 1000 * sent[round(float(row["time_s"]) * 1e9)], places=6)

    def test_a_probe_reads_batches_of_numbers_as_bytes(self):
        def entry(k):
            counts = np.arange(10 * k, 10 * k + 10) % 2000
            return {"ts": np.uint64(time.monotonic_ns()).tobytes(), "counts": counts.astype(np.int16).tobytes()}
        self.publish("adc", entry)
        rows = self.read_samples(f"redis:{self.path('socket')}?stream=adc&fields=counts:force_mN:int16")
        counts = np.array([round(float(row["force_mN"])) for row in rows])
        self.assertTrue((np.diff(counts) % 2000 == 1).all())
        self.assertTrue((np.diff([float(row["time_s"]) for row in rows]) > 0).all())
        self.assertGreater(len(rows), 3000)

    def test_entries_that_are_trimmed_before_they_are_read_count_as_lost(self):
        sent = 0

        def send(count, pause_s, **limit):
            nonlocal sent
            for _ in range(count):
                sent += 1
                self.client.xadd("gauge", {"force_N": f"{sent * 1e-3:.3f}", "time_ns": time.monotonic_ns()}, **limit)
                time.sleep(pause_s)

        trace = self.path("r.csv")
        record = subprocess.Popen(
            [merkel_program.PROGRAM, "record", f"redis:127.0.0.1:{self.port}?stream=gauge", trace, "--json"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(record.kill)
        while not (os.path.exists(trace + ".part") and os.path.getsize(trace + ".part") > 1000):
            self.assertIsNone(record.poll())
            send(1, 0.005)
        record.send_signal(signal.SIGSTOP)
        send(300, 0, maxlen=50, approximate=False)
        record.send_signal(signal.SIGCONT)
        send(100, 0.005)
        record.send_signal(signal.SIGINT)
        out, err = record.communicate(timeout=30)
        self.assertEqual(record.returncode, 0, err)
        with open(trace) as file:
            read = [round(1e3 * float(row["force_N"])) for row in csv.DictReader(line for line in file if line[0] != "#")]
        missing = read[-1] - read[0] + 1 - len(read)
        self.assertGreater(missing, 200)
        self.assertEqual(json.loads(out)["device"]["lost"], missing)

    def test_one_run_reads_the_samples_of_another(self):
        first = merkel_program.start("run", "finger", "--probe", "sim:taps?count=500&live=1&force_N=0.5", "--sink",
                                     f"redis:127.0.0.1:{self.port}?node=a", "--sink", "xdf:" + self.path("a.xdf"))
        self.addCleanup(first.communicate)
        self.addCleanup(first.kill)
        self.assertTrue(wait_for(lambda: self.client.xlen("a_samples") > 20))
        rows = self.read_samples(f"redis:127.0.0.1:{self.port}?stream=a_samples")
        first.send_signal(signal.SIGINT)
        first.wait(timeout=30)
        own = csv.DictReader(io.StringIO(
            self.merkel("inspect", "session", self.path("a.xdf"), "--stream", "samples").stdout))
        forces = {row["time_s"]: row["force_mN"] for row in own}
        for row in rows:
            self.assertAlmostEqual(float(row["force_mN"]), float(forces[row["time_s"]]), places=9)

    def test_streams_that_cannot_be_read_say_what_to_do(self):
        address = f"redis:127.0.0.1:{self.port}"
        self.publish("odd", lambda k: {"voltage": "1.5", "ts": "7"})
        for probe, sentence in ((address, "name the stream"), (address + "?stream=none", "start its node"),
                                (address + "?stream=odd", "they are ts, voltage): name one"),
                                (address + "?stream=odd&fields=voltage:force_N:int7", "the types are float64"),
                                ("redis:127.0.0.1:1?stream=odd", "start it with redis-server --port 1")):
            done = merkel_program.run("run", "--probe", probe, "--duration-s", "1")
            self.assertIn(done.returncode, (2, 3))
            self.assertIn(sentence, done.stderr)
        self.read_samples(address + "?stream=odd&fields=voltage:force_N&clock=arrival")

    def test_several_nodes_of_a_graph_run_side_by_side(self):
        self.client.xadd("supergraph_stream", {"data": json.dumps({"nodes": {
            name: {"nickname": name, "parameters": {"scene": "finger", "probe": f"sim:ramp?wait_s=0&hold_s=600&live=1&depth_mm={depth}"}}
            for name, depth in (("touch", 1.0), ("palm", 0.5))}})})
        nodes = [self.node("-i", "127.0.0.1", "-p", str(self.port), name=name) for name in ("touch", "palm")]
        for node in nodes:
            self.addCleanup(node.communicate)
            self.addCleanup(node.kill)
        for name in ("touch", "palm"):
            self.assertTrue(wait_for(lambda: self.client.xlen(name + "_spikes") > 5))
        for node in nodes:
            node.send_signal(signal.SIGINT)
        for node, (name, depth) in zip(nodes, (("touch", 1.0), ("palm", 0.5))):
            code = node.wait(timeout=30)
            self.assertIn(code, (0, 1))  # 1: a busy host stopped its loop
            self.assertEqual([entry["status"].decode() for entry in self.entries(name + "_state")],
                             STATES + ["NODE_FATAL_ERROR"] * code)
            depths = np.concatenate([np.frombuffer(entry["depth_mm"]) for entry in self.entries(name + "_samples")])
            self.assertEqual(depths.max(), depth)

    def test_the_graphs_priority_and_cores_are_used(self):
        self.publish_graph({"scene": "finger", "probe": "sim:ramp?wait_s=0&hold_s=600&live=1",
                            "sink": "xdf:" + self.path("s.xdf")}, run_priority=41, cpu_affinity="0")
        node = self.node("-i", "127.0.0.1", "-p", str(self.port))
        self.addCleanup(node.communicate)
        self.addCleanup(node.kill)
        try:  # as BRAND's supervisor, which starts nodes by chrt
            os.sched_setscheduler(node.pid, os.SCHED_FIFO, os.sched_param(41))
        except PermissionError:
            pass
        self.assertTrue(wait_for(lambda: self.client.xlen("touch_counts") > 5))
        child, = subprocess.run(["pgrep", "-P", str(node.pid)], capture_output=True, text=True).stdout.split()
        self.assertEqual(os.sched_getaffinity(int(child)), {0})
        self.assertEqual(os.sched_getscheduler(int(child)), os.SCHED_OTHER)  # its main thread
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
