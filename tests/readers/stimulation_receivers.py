"""Receivers of stimulation commands, by a pipe, ZeroMQ and Redis, each a process of its own. An update has the time at which the
kernel (ZeroMQ) or the server (Redis) got it, so the time for which a receiver waits for a core does not count."""
import csv
import json
import multiprocessing
import os
import socket
import struct
import time

SO_TIMESTAMPNS = 35  # <asm/socket.h>


class Update:
    """An update of the electrode: when the receiver got it, when it passed the gate, and why the receiver could not apply it."""

    def __init__(self, time_s, uA, heartbeat, stop, arrived, sent, refused=""):
        self.arrived, self.sent, self.refused = arrived, sent, refused
        self.time_s, self.uA, self.heartbeat, self.stop = float(time_s), float(uA), int(heartbeat), stop


class Witness(multiprocessing.Process):
    """A process that notes something until it is asked for it."""

    def __init__(self):
        super().__init__(daemon=True)
        self.here, self.there = multiprocessing.Pipe()

    def notes(self):
        self.here.send("notes")
        return self.here.recv()


class HostWatch(Witness):
    """Notes when a core of this machine ran nothing, not even this process, which has the highest priority."""

    def __init__(self, cpu):
        super().__init__()
        self.cpu = cpu

    def run(self):
        os.sched_setaffinity(0, {self.cpu})
        gaps, last = [], time.monotonic()
        while not self.there.poll():
            time.sleep(0.001)
            now = time.monotonic()
            if now - last > 0.002:
                gaps.append((last + 0.001, now))
            last = now
        self.there.send(gaps)


class Receiver(Witness):
    def __init__(self, name):
        super().__init__()
        self.receiver, self.uA, self.ended = name, multiprocessing.Value("d", 0.0), multiprocessing.Event()

    def read(self):
        for command, arrived in self.commands():
            if command["kind"] == "update":
                yield Update(command["time_s"], command["amplitude_uA"], command["heartbeat"], command["stop"], arrived,
                             int(command["sent_monotonic_ns"]) * 1e-9)

    def run(self):
        updates = []
        for update in self.read():
            updates.append(update)
            self.uA.value = update.uA
            if update.stop == "end":
                break
        self.ended.set()
        self.there.recv()
        self.there.send(updates)


class Pipe(Receiver):
    """A pipe has no times: an update arrives when this thread reads it."""

    def __init__(self, path):
        super().__init__("stim-csv")
        self.path = path

    def commands(self):
        """Each command as a dictionary, and when it arrived."""
        with open(self.path, encoding="utf-8") as pipe:
            for row in csv.DictReader(line for line in pipe if not line.startswith("#")):
                yield row, time.monotonic()


def arrival_of_next(connection):
    """Waits for bytes and leaves them. \\returns when the kernel received them, on the monotonic clock"""
    data, messages, _, _ = connection.recvmsg(1, 64, socket.MSG_PEEK)
    if not data:
        raise ConnectionError("closed")
    now = time.monotonic_ns()
    for _, kind, content in messages:
        if kind == SO_TIMESTAMPNS:
            s, ns = struct.unpack("qq", content[:16])
            return (s * 10**9 + ns - (time.time_ns() - time.monotonic_ns())) * 1e-9
    return now * 1e-9


class Zmq(Receiver):
    """A subscriber by ZeroMQ's protocol (ZMTP 3.0, rfc.zeromq.org/spec/23), without ZeroMQ's own threads and queues."""

    def __init__(self, port):
        super().__init__("stim-zmq")
        self.port = port

    def exactly(self, size):
        data = b""
        while len(data) < size:
            if not (more := self.connection.recv(size - len(data))):
                raise ConnectionError("closed")
            data += more
        return data

    def frame(self):
        flags, size = self.exactly(2)
        if flags & 2:  # eight bytes of length
            size = struct.unpack(">Q", bytes([size]) + self.exactly(7))[0]
        return flags, self.exactly(size)

    def connect(self):
        while True:
            self.connection = socket.socket()
            self.connection.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            try:
                self.connection.connect(("127.0.0.1", self.port))
                if self.connection.getsockname() != self.connection.getpeername():  # a socket may connect to itself
                    break
            except ConnectionRefusedError:
                pass
            self.connection.close()
            time.sleep(0.01)
        self.connection.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32))
        self.exactly(64)
        ready = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 3) + b"SUB"
        self.connection.sendall(b"\x04" + bytes([len(ready)]) + ready)
        self.connection.sendall(b"\x00\x03\x01\x64\x00")  # commands only

    def commands(self):
        """Each command as a dictionary, and when it arrived."""
        self.connect()
        parts = []
        while True:
            arrived = arrival_of_next(self.connection)
            flags, body = self.frame()
            if flags & 4:  # of the protocol
                continue
            parts.append(body)
            if flags & 1:  # more parts follow
                continue
            command, parts = json.loads(parts[1]), []
            yield command | {"time_s": command["time_ns"] * 1e-9}, arrived


class Redis(Receiver):
    """A blocked reader of the stream. The identifier of an entry contains the millisecond in which the server added it."""

    def __init__(self, client, stream):
        super().__init__("redis")
        self.client, self.stream = client, stream

    def read(self):
        last = "0"
        while True:
            for _, entries in self.client.xread({self.stream: last}, block=1000):
                for last, entry in entries:
                    ends = int(last.split(b"-")[0]) * 1e-3 + 0.001 - (time.time_ns() - time.monotonic_ns()) * 1e-9
                    yield Update(int(entry[b"time_ns"]) * 1e-9, json.loads(entry[b"amplitude_uA"])[0], entry[b"heartbeat"],
                                 json.loads(entry[b"stop"])[0], ends, int(entry[b"sent_monotonic_ns"]) * 1e-9)
