"""The example subscribers of stim-zmq (tools/examples) obey valid_until_ns: commands that are out of date, and a program that is killed."""
import json
import os
import signal
import subprocess
import sys
import time

import merkel_program

try:
    import zmq
except ImportError:
    print("skipped: python3-zmq is missing")
    sys.exit(77)

SCENE = """preset = "paper"
[probe]
uri = "sim:ramp?wait_s=0&hold_s=600&live=1"
[[electrode]]
name = "E1"
field_mm = [15, 10, 8]
encoder = "linear"
full_force_N = 0.05
amplitude_uA = [40, 80]
frequency_Hz = [100, 200]
[stimulation]
max_charge_nC = 16
max_total_uA = 100
watchdog_ms = 200
"""


class Subscriber(merkel_program.TestCase):
    def subscribe(self, words, port):
        out = open(self.path(os.path.basename(words[-1]) + ".out"), "w+", encoding="utf-8")
        self.addCleanup(out.close)
        process = subprocess.Popen([*words, f"tcp://127.0.0.1:{port}"], stdout=out)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

        def applied():
            with open(out.name, encoding="utf-8") as file:
                whole = file.read().rpartition("\n")[0]  # a line may be half written
            rows = [line.split() for line in whole.splitlines()]
            return [(name, float(uA)) for name, uA, _ in rows]
        return applied

    def subscribers(self, port):
        programs = [[sys.executable, "tools/examples/stimulation_subscriber.py"]]
        if "MERKEL_SUBSCRIBER" in os.environ:
            programs.append([os.environ["MERKEL_SUBSCRIBER"]])
        return [self.subscribe(words, port) for words in programs]

    def publisher(self, port):
        context = zmq.Context()
        self.addCleanup(context.term)
        socket = context.socket(zmq.XPUB)
        socket.setsockopt(zmq.XPUB_VERBOSE, 1)
        socket.setsockopt(zmq.LINGER, 0)
        self.addCleanup(socket.close)
        socket.bind(f"tcp://127.0.0.1:{port}")

        def send(electrode, uA, valid_for_s):
            command = {"kind": "update", "electrode": electrode, "amplitude_uA": uA, "frequency_Hz": 100,
                       "valid_until_ns": time.monotonic_ns() + round(valid_for_s * 1e9)}
            socket.send_multipart([b"\x64\x00", json.dumps(command).encode()])
        return socket, send

    def test_an_electrode_goes_off_when_its_command_is_out_of_date(self):
        port = merkel_program.free_port()
        socket, send = self.publisher(port)
        applied = self.subscribers(port)
        for _ in applied:
            self.assertTrue(socket.poll(20000))
            socket.recv()  # a subscription
        send("E1", 50, 600)
        send("E2", 60, 3.0)
        send("E3", 70, -0.001)  # too late
        send("E1", 0, -1)  # an off always counts
        wanted = [("E1", 50.0), ("E2", 60.0), ("E1", 0.0), ("E2", 0.0)]
        for rows in applied:
            self.assertTrue(merkel_program.wait_for(lambda: len(rows()) >= 4), rows())
            self.assertEqual(rows(), wanted)

    def test_all_is_off_after_the_program_was_killed(self):
        port = merkel_program.free_port()
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        program = merkel_program.start("run", self.path("scene.toml"), "--sink", f"stim-zmq:tcp://127.0.0.1:{port}")
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        applied = self.subscribers(port)
        for rows in applied:
            self.assertTrue(merkel_program.wait_for(lambda: ("E1", 80.0) in rows()))
        program.send_signal(signal.SIGKILL)
        for rows in applied:
            self.assertTrue(merkel_program.wait_for(lambda: rows()[-1] == ("E1", 0.0)), rows()[-3:])


if __name__ == "__main__":
    merkel_program.main()
