"""A client for HTTP and RFC 6455, as far as the tests of the live page need it."""
import base64
import json
import os
import socket
import struct


def request(port, path="/", method="GET", **headers):
    """The status and the body of a request."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as s:
        fields = {"Host": f"127.0.0.1:{port}", **headers}
        lines = [f"{method} {path} HTTP/1.1", *(f"{k}: {v}" for k, v in fields.items()), "", ""]
        s.sendall("\r\n".join(lines).encode())
        answer = b"".join(iter(lambda: s.recv(65536), b""))
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(head.split()[1]), body


class WebSocket:
    def __init__(self, port, origin=None, receive_buffer=None, token=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(20)
        self.socket.connect(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        origin = f"http://127.0.0.1:{port}" if origin is None else origin
        target = "/socket" + (f"?token={token}" if token else "")
        self.socket.sendall((f"GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                             f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nOrigin: {origin}\r\n"
                             "Sec-WebSocket-Version: 13\r\n\r\n").encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self._bytes(1)
        self.status = int(head.split()[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def _bytes(self, count):
        got = b""
        while len(got) < count:
            more = self.socket.recv(count - len(got))
            if not more:
                raise EOFError
            got += more
        return got

    def send(self, text):
        """Sends a message, masked as RFC 6455 requires of clients."""
        payload = text if isinstance(text, bytes) else text.encode()
        length = bytes([128 | len(payload)]) if len(payload) < 126 else b"\xfe" + struct.pack(">H", len(payload))
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))
        self.socket.sendall(b"\x81" + length + mask + masked)

    def receive(self):
        """(opcode, payload); raises EOFError at the end."""
        first, length = self._bytes(2)
        if length == 126:
            (length,) = struct.unpack(">H", self._bytes(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._bytes(8))
        return first & 15, self._bytes(length)

    def frames(self):
        """Binary messages until the connection is closed."""
        while True:
            try:
                opcode, payload = self.receive()
            except EOFError:
                return
            if opcode == 8:
                return
            if opcode == 2:
                yield Frame(payload)


class Frame:
    """A frame in the format of view_frames.hpp."""

    def __init__(self, payload):
        (self.missed, self.number, self.flags, self.origin_s, self.from_s, self.time_s,
         count) = struct.unpack_from("<IIIdddI", payload)
        self.over = bool(self.flags & 1)
        place = 40
        self.counters = struct.unpack_from(f"<{count}d", payload, place)
        place += 8 * count
        (probes,) = struct.unpack_from("<I", payload, place)
        self.probes, self.taxels = [], []
        place += 4
        for _ in range(probes):
            self.probes.append(struct.unpack_from("<8fI", payload, place))
            (taxels,) = struct.unpack_from("<I", payload, place + 36)
            self.taxels.append(struct.unpack_from(f"<{taxels}f", payload, place + 40))
            place += 40 + 4 * taxels
        (points,) = struct.unpack_from("<I", payload, place)
        self.points = points
        place += 4 + points * 4 * (2 + 2 * probes)
        (spikes,) = struct.unpack_from("<I", payload, place)
        self.spikes = [struct.unpack_from("<fI", payload, place + 4 + 8 * i) for i in range(spikes)]
        place += 4 + 8 * spikes
        (bins,) = struct.unpack_from("<I", payload, place)
        self.latency = struct.unpack_from(f"<{bins}I", payload, place + 4)
        place += 4 + 4 * bins
        (watched,) = struct.unpack_from("<I", payload, place)
        place += 4
        self.watched = {}
        for _ in range(watched):
            neuron, samples = struct.unpack_from("<II", payload, place)
            self.watched[neuron] = [struct.unpack_from("<3f", payload, place + 8 + 12 * i)
                                    for i in range(samples)]
            place += 8 + 12 * samples
        (electrodes,) = struct.unpack_from("<I", payload, place)
        # amplitude in uA, frequency in Hz, why it is off, pulses since the last frame
        self.electrodes = [struct.unpack_from("<2f2I", payload, place + 4 + 16 * i) for i in range(electrodes)]
        place += 4 + 16 * electrodes
        (length,) = struct.unpack_from("<I", payload, place)
        text = payload[place + 4:].decode()
        self.news = json.loads(text) if text else []
        assert length == len(payload) - place - 4
