"""A UDP receiver of OSC bundles, written from the OSC 1.0 specification, independent of
merkel's code (liblo's server is used in tests/drivers/sinks)."""
import json
import os
import socket
import struct
import subprocess
import unittest

import numpy as np

import merkel_program
from merkel_program import SOAK, SOAK_S, spikes_of_csv

# The elements of a bundle, all of one length: size, address, types, arguments (big-endian, padded to 4).
ELEMENT = np.dtype([("size", ">i4"), ("address", "S16"), ("types", "S8"), ("neuron", ">i4"),
                    ("sequence", ">i4"), ("seconds", ">i4"), ("nanoseconds", ">i4"),
                    ("patch", ">i4"), ("flags", ">i4")])
SO_RXQ_OVFL = 40  # asm-generic/socket.h


class Receiver:
    """Receives bundles until none arrive for a while, and counts the packets that the kernel
    dropped because this receiver was too slow."""

    def __init__(self, family=socket.AF_INET, host="127.0.0.1"):
        self.socket = socket.socket(family, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        self.socket.bind((host, 0))
        self.port = self.socket.getsockname()[1]
        self.dropped = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def bundles(self, patience_s):
        self.socket.settimeout(patience_s)
        while True:
            try:
                packet, ancillary, _, _ = self.socket.recvmsg(65536, 64)
            except TimeoutError:
                return
            for _, kind, data in ancillary:
                if kind == SO_RXQ_OVFL:
                    self.dropped = struct.unpack("I", data)[0]
            assert packet[:8] == b"#bundle\0"
            elements = np.frombuffer(packet, ELEMENT, offset=16)
            assert (elements["size"] == ELEMENT.itemsize - 4).all()
            assert (elements["address"] == b"/merkel/spike").all()
            assert (elements["types"] == b",iiiiii").all()
            yield elements


class Osc(merkel_program.TestCase):
    @unittest.skipUnless(socket.has_ipv6 and os.path.exists("/proc/net/if_inet6"), "no IPv6")
    def test_an_ipv6_address_gets_every_spike(self):
        receiver = self.enterContext(Receiver(socket.AF_INET6, "::1"))
        done = self.merkel("run", "--fast", "--probe", "replay:tests/traces/taps.csv", "--json",
                           "--sink", f"osc:[::1]:{receiver.port}")
        sink = json.loads(done.stdout)["sinks"][0]
        self.assertGreater(sink["delivered"], 20)
        self.assertEqual(sink["delivered"], sink["spikes_in"])
        self.assertEqual(sum(len(each) for each in receiver.bundles(1.0)), sink["delivered"])

    def test_every_spike_of_a_run_comes_in_order(self):
        receiver = self.enterContext(Receiver())
        self.merkel("run", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
                    f"osc:127.0.0.1:{receiver.port}", "--sink", "csv:" + self.path("s.csv"))
        spikes = spikes_of_csv(self.path("s.csv"))
        got = np.concatenate(list(receiver.bundles(0.5)))
        self.assertEqual(list(got["sequence"]), list(range(1, len(spikes) + 1)))
        self.assertEqual(list(zip(got["seconds"].astype(int) * 10**9 + got["nanoseconds"],
                                  got["neuron"])), spikes)

    def test_hours_of_spikes_lose_none(self):
        # UDP has no flow control, so the speed is limited to this multiple of real time.
        seconds = min(SOAK_S, float(os.environ.get("MERKEL_SOAK_OSC_S", "15")))
        speed = os.environ.get("MERKEL_SOAK_OSC_SPEED", "5")
        receiver = self.enterContext(Receiver())
        program = subprocess.Popen([SOAK, f"{seconds}@{speed}", f"osc:127.0.0.1:{receiver.port}"],
                                   stdout=subprocess.DEVNULL)
        received, last, missing = 0, 0, 0
        for elements in receiver.bundles(3.0):
            sequence = elements["sequence"]
            self.assertTrue((np.diff(sequence) == 1).all())
            missing += int(sequence[0]) - last - 1
            last = int(sequence[-1])
            received += len(sequence)
        self.assertEqual(program.wait(), 0)
        made = int(seconds * 5000)
        print(f"{received} of {made} spikes received, {receiver.dropped} packets dropped by the "
              "kernel: this receiver was too slow for them", flush=True)
        missing += made - last
        self.assertEqual(received + missing, made)
        # Every spike that was sent arrived, except for packets (of at most 16 spikes) that this
        # machine was too busy to receive; most of them did.
        self.assertLessEqual(missing, 16 * receiver.dropped)
        self.assertGreater(received, made // 2)


if __name__ == "__main__":
    merkel_program.main()
