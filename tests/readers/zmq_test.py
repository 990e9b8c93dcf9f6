"""A subscriber of Open Ephys' Event Broadcaster, using pyzmq."""
import json
import os
import socket
import subprocess
import threading
import time

import zmq

import merkel_program
from merkel_program import SOAK, SOAK_S, free_port, spikes_of_csv


class Subscriber:
    def __init__(self, port, prefix=b"", queue=0):
        self.socket = zmq.Context.instance().socket(zmq.SUB)
        self.socket.setsockopt(zmq.RCVHWM, queue)
        self.socket.setsockopt(zmq.RCVTIMEO, 20_000)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.SUBSCRIBE, prefix)
        self.socket.connect(f"tcp://127.0.0.1:{port}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def take(self, count):
        return [self.socket.recv_multipart() for _ in range(count)]


class Zmq(merkel_program.TestCase):
    def test_a_subscriber_gets_every_spike_in_order_with_its_time(self):
        port = free_port()
        subscriber = self.enterContext(Subscriber(port))
        self.merkel("run", "--fast", "--probe", "replay:tests/traces/slide.csv", "--sink",
                    f"zmq:tcp://127.0.0.1:{port}?subscribers=1&wait_s=30", "--sink",
                    "csv:" + self.path("s.csv"))
        spikes = spikes_of_csv(self.path("s.csv"))
        messages = subscriber.take(len(spikes))
        before = time.time_ns()
        for seq, ((kind, text), (time_ns, neuron)) in enumerate(zip(messages, spikes)):
            self.assertEqual(kind, b"\x01\x00")
            info = json.loads(text.decode("utf-8"))
            self.assertEqual(info["event_type"], "spike")
            self.assertEqual(info["stream"], "paper")
            self.assertEqual(info["seq"], seq)
            self.assertEqual(info["time_ns"], time_ns)
            self.assertEqual(round(info["timestamp"] * 1e9), time_ns)
            self.assertEqual(info["sample_number"], time_ns * info["sample_rate"] // 1_000_000_000)
            self.assertEqual(info["sorted_id"], neuron)
            self.assertEqual(info["electrode"], f"afferent {neuron}")
            for key in ("source_node", "num_channels", "amp1"):
                self.assertIn(key, info)
            self.assertLess(abs(before - info["sent_utc_ns"]), 600e9)
        self.assertGreater(len(spikes), 100)

    def test_a_subscriber_can_request_the_start_of_the_run_and_the_afferents(self):
        port = free_port()
        subscriber = self.enterContext(Subscriber(port, b"\x01M"))
        self.merkel("run", "--fast", "--sink",
                    f"zmq:tcp://127.0.0.1:{port}?subscribers=1&wait_s=30")
        kind, text = subscriber.take(1)[0]
        self.assertEqual(kind, b"\x01M")
        info = json.loads(text)
        self.assertEqual(info["start_device_ns"], 0)
        self.assertLess(abs(info["start_utc_ns"] - time.time_ns()), 600e9)
        self.assertEqual([row[0] for row in info["afferents"]], list(range(1, 21)))
        self.assertEqual(len(info["afferent_fields"]), len(info["afferents"][0]))

    def live_run(self, port, *more):
        """A running program, and a function that returns its memory in MiB."""
        program = merkel_program.start("run", "--probe", "sim:ramp?wait_s=0&hold_s=600&live=1",
                                       "--sink", f"zmq:tcp://127.0.0.1:{port}", *more)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)

        def memory_MiB():
            with open(f"/proc/{program.pid}/status") as status:
                fields = dict(line.split(":", 1) for line in status)
            return int(fields["VmRSS"].split()[0]) / 1024
        self.assertTrue(merkel_program.wait_for(lambda: self.connects(port)))
        time.sleep(2)  # memory is locked once the samples' rate is measured
        return program, memory_MiB

    def connects(self, port):
        with socket.socket() as test:
            return test.connect_ex(("127.0.0.1", port)) == 0

    def gets_spikes(self, port):
        with Subscriber(port) as subscriber:
            return json.loads(subscriber.take(1)[0][1])["event_type"] == "spike"

    def test_a_header_that_claims_8_GiB_takes_no_memory(self):
        port = free_port()
        program, memory_MiB = self.live_run(port)
        before = memory_MiB()
        with socket.create_connection(("127.0.0.1", port)) as peer:
            # ZMTP 3.0: signature, version, mechanism NULL, as a client; then READY of a SUB socket.
            peer.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(16) + b"\x00" + bytes(31))
            peer.sendall(b"\x04\x19\x05READY\x0bSocket-Type\x00\x00\x00\x03SUB")
            time.sleep(0.3)
            peer.sendall(b"\x02" + (8 << 30).to_bytes(8, "big") + b"x" * 1000)
            time.sleep(1)
            self.assertIsNone(program.poll())
            self.assertLess(memory_MiB() - before, 50)
        self.assertTrue(self.gets_spikes(port))

    def test_hundreds_of_thousands_of_subscriptions_take_no_memory(self):
        port = free_port()
        program, memory_MiB = self.live_run(port)
        before = memory_MiB()
        with Subscriber(port, b"0") as greedy:
            for i in range(200_000):
                greedy.socket.setsockopt(zmq.SUBSCRIBE, b"%020d" % i)
            time.sleep(2)
            self.assertIsNone(program.poll())
            self.assertLess(memory_MiB() - before, 150)
        self.assertTrue(self.gets_spikes(port))

    def test_idle_connections_leave_descriptors_to_others(self):
        port = free_port()
        program, _ = self.live_run(port)
        peers = []
        for _ in range(300):
            peers.append(socket.socket())
            peers[-1].settimeout(0.2)  # a full backlog does not answer
            self.addCleanup(peers[-1].close)
            peers[-1].connect_ex(("127.0.0.1", port))  # refused while all peers are dropped
        self.assertTrue(merkel_program.wait_for(
            lambda: len(os.listdir(f"/proc/{program.pid}/fd")) < 150, 10))
        self.assertIsNone(program.poll())
        for peer in peers:
            peer.close()
        self.assertTrue(self.gets_spikes(port))

    def test_topics_distinguish_fingers(self):
        port = free_port()
        subscriber = self.enterContext(Subscriber(port, b"\x01\x00index"))
        self.merkel("run", "--fast", "--sink",
                    f"zmq:tcp://127.0.0.1:{port}?topic=index&subscribers=1&wait_s=30")
        self.assertEqual(subscriber.take(1)[0][0], b"\x01\x00index")

    def test_one_that_stops_reading_loses_its_own_and_it_is_counted(self):
        port = free_port()
        stuck = self.enterContext(Subscriber(port, queue=10))
        good = self.enterContext(Subscriber(port))
        received = []
        made = 200_000
        reader = threading.Thread(target=lambda: received.extend(
            json.loads(parts[1])["seq"] for parts in good.take(made)))
        reader.start()
        done = subprocess.run([SOAK, str(made / 5000),
                               f"zmq:tcp://127.0.0.1:{port}?subscribers=2&wait_s=30&hwm=1000000"],
                              capture_output=True, text=True)
        reader.join()
        self.assertEqual(received, list(range(made)))
        # The queues of this sink hold 200 000 messages, so nothing is lost. With short
        # queues, losses would show.
        self.assertEqual(done.returncode, 0, done.stdout)
        port = free_port()
        stuck = self.enterContext(Subscriber(port, queue=10))
        done = subprocess.run([SOAK, str(made / 5000),
                               f"zmq:tcp://127.0.0.1:{port}?subscribers=1&wait_s=30&hwm=100"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 1, done.stdout)
        delivered = int(done.stdout.split()[1])
        self.assertLess(delivered, made)
        self.assertGreater(delivered, 0)

    def test_hours_of_spikes_lose_none(self):
        port = free_port()
        subscriber = self.enterContext(Subscriber(port, queue=1000))
        seconds = min(SOAK_S, float(os.environ.get("MERKEL_SOAK_ZMQ_S", "60")))
        program = subprocess.Popen(
            [SOAK, str(seconds),
             f"zmq:tcp://127.0.0.1:{port}?subscribers=1&wait_s=30&hwm=1000&when_full=wait"],
            stdout=subprocess.DEVNULL)
        for seq in range(int(seconds * 5000)):
            text = subscriber.socket.recv_multipart()[1]
            if f'"seq":{seq},'.encode() not in text:
                self.fail(f"expected {seq}, got {text}")
        self.assertEqual(program.wait(), 0)


if __name__ == "__main__":
    merkel_program.main()
