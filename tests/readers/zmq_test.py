"""A subscriber as Open Ephys' Event Broadcaster has them, by pyzmq."""
import json
import os
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

    def test_topics_tell_fingers_apart(self):
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
        # 200 000 messages fit into the queues of this sink: nothing is lost here. With short
        # queues, it is seen.
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
