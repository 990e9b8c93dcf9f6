"""Devices that send something else than touch, to the built program, in real time: each is a server or a terminal in this
process. A press of 1 N, a reading every 4 ms, is changed as the attack's name says; the program must report it, release the
press where nothing can be believed, and keep the touch where only the times or numbers are wrong."""
import contextlib
import json
import os
import random
import signal
import socket
import struct
import subprocess
import threading
import time

CLEAN_S, HOSTILE_S = 2.0, 3.0
PATIENCE_S = 90  # on a busy machine
SYNC_RESPONSE = 4  # type of a frame of HBF1
CHARACTERS = b"0123456789.,;- \t\r\nNmxyzE+/:|<>@!"


class Device:
    """Serves each client with send(connection, elapsed seconds) until it hangs up."""

    def __init__(self, serve, kind=socket.SOCK_STREAM):
        self.serve, self.serving = serve, []
        self.socket = socket.socket(socket.AF_INET, kind)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        if kind == socket.SOCK_STREAM:
            self.socket.listen(8)
        threading.Thread(target=self._accept if kind == socket.SOCK_STREAM else self._datagrams, daemon=True).start()

    def _accept(self):
        while True:
            try:
                client, _ = self.socket.accept()
            except OSError:
                return
            self.serving.append(threading.Thread(target=self._quietly, args=(client,), daemon=True))
            self.serving[-1].start()

    def _quietly(self, client):
        try:
            self.serve(client)
        except OSError:
            pass
        client.close()

    def _datagrams(self):
        try:
            _, peer = self.socket.recvfrom(64)
            self.socket.connect(peer)
            self.serve(self.socket)
        except OSError:
            pass

    def close(self):
        """Waits until the clients are served, because a server may have a process of its own."""
        self.socket.close()
        for thread in self.serving:
            thread.join(timeout=1)


def every_4_ms(send):
    """Calls send(k, seconds) every 4 ms, until the peer has gone."""
    begin = time.monotonic()
    for k in range(10**9):
        send(k, time.monotonic() - begin)
        time.sleep(max(0.0, begin + 0.004 * (k + 1) - time.monotonic()))


def lines(text):
    """A device that prints a line every 4 ms. \\param text: of k and seconds; None: no line"""
    def serve(client):
        def send(k, seconds):
            line = text(k, seconds)
            if line is not None:
                client.sendall(line if isinstance(line, bytes) else (line + "\r\n").encode())
        every_4_ms(send)
    return serve


def noise(make):
    """Clean lines until the touch was felt, then noise as fast as it is read, then clean lines again."""
    def clean(client, over):
        while not over():
            client.sendall(b"1.0\r\n")
            time.sleep(0.004)

    def serve(client):
        clean(client, serve.felt.is_set)
        begin = time.monotonic()
        while time.monotonic() - begin < HOSTILE_S:
            client.sendall(make())
        client.sendall(b"\r\n")
        clean(client, lambda: False)
    serve.felt = threading.Event()
    return serve


def digits():
    return bytes(CHARACTERS[each % len(CHARACTERS)] for each in os.urandom(1 << 14))


def rdt(number):
    """Records of a Net F/T of 1 N along z. \\param number: the sequence number of record k, a list for several records"""
    def serve(client):
        def send(k, seconds):
            numbers = number(k)
            for each in numbers if isinstance(numbers, list) else [numbers]:
                force = 1_000_000 if each == k + 1 or not isinstance(numbers, list) else 0
                client.send(struct.pack(">IIIiiiiii", each & 0xFFFFFFFF, k, 0, 0, 0, force, 0, 0, 0))
        every_4_ms(send)
    return serve


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1
            crc &= 0xFFFF
    return crc


def cobs(data):
    out, block = bytearray(), bytearray()
    for byte in data + b"\0":
        if byte:
            block.append(byte)
            continue
        out += bytes([len(block) + 1]) + block
        block.clear()
    return bytes(out) + b"\0"


def uncobs(frame):
    data, i = bytearray(), 0
    while i < len(frame):
        count = frame[i]
        data += frame[i + 1:i + count]
        i += count
        if i < len(frame) and count < 255:
            data.append(0)
    return bytes(data)


def between(program, protocol, change, trace):
    """A server between the program and its own simulated device. \\param change: of each chunk of bytes to the program"""
    def serve(client):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        simulated = subprocess.Popen([program, "simulate-probe", protocol, "--trace", trace, "--repeat", "--network", f"tcp:127.0.0.1:{port}"],
                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        try:
            simulated.stdout.readline()
            with socket.create_connection(("127.0.0.1", port)) as device:
                def forward():
                    with contextlib.suppress(OSError):  # the attack is over
                        while chunk := client.recv(4096):
                            device.sendall(chunk)
                    with contextlib.suppress(OSError):  # ends the loop below, also if the device is silent
                        device.shutdown(socket.SHUT_RDWR)
                threading.Thread(target=forward, daemon=True).start()
                while chunk := device.recv(4096):
                    client.sendall(change(chunk))
        except OSError:
            pass
        finally:
            simulated.kill()
            simulated.wait()
    return serve


def whole_frames(rest, chunk):
    """The frames of HBF1 that a chunk completes. \\param rest: of the chunks before; keeps what is incomplete"""
    rest.extend(chunk)
    while (end := rest.find(0)) >= 0:
        frame = bytearray(uncobs(bytes(rest[:end])))
        del rest[:end + 1]
        yield frame


def renumbered():
    """Gives every frame of HBF1 a random sequence number."""
    numbers, rest = random.Random(1), bytearray()

    def change(chunk):
        out = b""
        for frame in whole_frames(rest, chunk):
            if len(frame) >= 10:
                frame[2:4] = struct.pack("<H", numbers.randrange(1 << 16))
                frame[-2:] = struct.pack("<H", crc16(frame[:-2]))
                out += cobs(bytes(frame))
        return out
    return change


def missynchronised():
    """Moves the clock in every answer to a SYNC of HBF1 by 3 s."""
    rest = bytearray()

    def change(chunk):
        out = b""
        for frame in whole_frames(rest, chunk):
            if len(frame) >= 18 and frame[0] & 15 == SYNC_RESPONSE:
                for at in (4, 12):
                    frame[at:at + 4] = struct.pack("<I", (struct.unpack_from("<I", frame, at)[0] + 3_000_000) & 0xFFFFFFFF)
                frame[-2:] = struct.pack("<H", crc16(frame[:-2]))
            out += cobs(bytes(frame)) if frame else b"\0"
        return out
    return change


def clock(fault):
    """Lines of time and force. \\param fault: of seconds, the text of the time"""
    return lines(lambda k, s: f"{fault(0.004 * k)},1.0")


def burst(client):
    """Half a second of lines at a time, as a sender with Nagle's algorithm or a serial server may pack them."""
    for k in range(10**9):
        client.sendall(b"".join(b"%.3f,1.0\r\n" % (0.5 * k + 0.004 * each) for each in range(125)))
        time.sleep(0.5)


def answer_http(client):
    client.sendall(b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html\r\n\r\n<html>no</html>\n")
    time.sleep(0.1)


def endless(make):
    def serve(client):
        while True:
            client.sendall(make())
            time.sleep(0.01)
    return serve


def opening_attacks():
    """(name, protocol, device, words of the one sentence): what cannot be opened, and what the program says of it."""
    csv = "protocol=csv&columns=force_N"
    return [
        ("a force in mN declared as N", csv, lines(lambda k, s: "30000"), ["10 kN", "is the unit mN"]),
        ("noise at 1 MB/s as hbf1", "protocol=hbf1", endless(lambda: os.urandom(10_000)), ["bytes", "not hbf1"]),
        ("a frame without end as hbf1", "protocol=hbf1", endless(lambda: b"\x55" * 10_000), ["bytes", "not hbf1"]),
        ("zeros as hbf1", "protocol=hbf1", endless(lambda: b"\0" * 10_000), ["bytes", "not hbf1"]),
        ("noise as csv", csv, endless(lambda: os.urandom(10_000)), ["bytes", "not csv"]),
        ("digits at random as csv", csv, endless(digits), ["bytes", "not csv"]),
        ("an HTTP server as csv", csv, answer_http, ["HTTP/1.1 400", "web server"]),
        ("an HTTP server as hbf1", "protocol=hbf1", answer_http, ["HTTP/1.1 400", "web server"]),
        ("csv as hbf1", "protocol=hbf1", lines(lambda k, s: "1.0"), ["protocol=csv"]),
        ("silence", csv, lines(lambda k, s: None), ["has sent nothing"]),
    ]


def touch_attacks(program, trace):
    """(name, URI's options, device, kind of socket, expectations): "silent": no spike while it is hostile, and some again
    afterwards; "kept": as many spikes as without the attack; words: what the program must say."""
    force, timed, tcp = "protocol=csv&columns=force_N", "protocol=csv&columns=time_s,force_N", socket.SOCK_STREAM
    late = random.Random(3)
    return [
        ("noise at full speed", force, noise(lambda: os.urandom(1 << 14)), tcp, "silent", ["damaged"]),
        ("digits at random at full speed", force, noise(digits), tcp, "silent", ["damaged"]),
        ("one old record in ten", "protocol=ati_rdt", rdt(lambda k: [k + 1, k - 4] if k % 10 == 9 else k + 1), socket.SOCK_DGRAM, "kept", []),
        ("random sequence numbers", "protocol=ati_rdt", rdt(lambda k: late.randrange(1 << 32)), socket.SOCK_DGRAM, "kept", ["make no sense"]),
        ("random sequence numbers of hbf1", "protocol=hbf1", between(program, "hbf1", renumbered(), trace), tcp, "kept", ["make no sense"]),
        ("answers to SYNC that are 3 s off", "protocol=hbf1", between(program, "hbf1", missynchronised(), trace), tcp, "kept", ["contradict"]),
        ("times 100 years ahead", timed, clock(lambda s: s + (3.2e9 if s > CLEAN_S else 0)), tcp, "kept", []),
        ("times of 40 digits", timed, clock(lambda s: ("1" * 40 if s > CLEAN_S else "") + f"{s:.3f}"), tcp, "kept", []),
        ("negative times", timed, clock(lambda s: -s), tcp, "kept", []),
        ("a frozen clock", timed, clock(lambda s: min(s, CLEAN_S)), tcp, "kept", []),
        ("a unit that changes midway", timed, clock(lambda s: s if s < CLEAN_S else 1000 * s), tcp, "kept", []),
        ("one time of +0.5 s beside two busy processes", timed, clock(lambda s: s + (0.5 if abs(s - CLEAN_S) < 0.002 else 0)), tcp, "kept", []),
        ("bursts of 0.5 s", timed, burst, tcp, "any", ["TCP_NODELAY"]),
    ]


def run_with(program, device, kind, options, folder, seconds, busy=0):
    """Runs the program with a device. \\returns exit code, summary, what it said, unix times of the spikes, start"""
    served = Device(device, kind)
    file = os.path.join(folder, f"{served.port}.csv")
    scheme = "tcp" if kind == socket.SOCK_STREAM else "udp"
    begin = time.time()
    rivals = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(busy)]
    run = subprocess.Popen([program, "run", "goodwin", "--probe", f"{scheme}:127.0.0.1:{served.port}?{options}", "--json",
                            *([] if hasattr(device, "felt") else ["--duration-s", str(seconds)]), "--sink", f"csv:{file}?time=unix"],
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if hasattr(device, "felt"):
        end_after_pause(run, device.felt, file)
    out, said = run.communicate(timeout=120)
    for rival in rivals:
        rival.kill()
        rival.wait()
    served.close()
    summary = json.loads(out) if out.startswith("{") else None
    return run.returncode, summary, said + out, spikes_in(file), begin


def spikes_in(file):
    """Unix times in s of the spikes, also while the run writes them."""
    file = next((each for each in (file, file + ".part") if os.path.exists(each)), os.devnull)
    return [float(row.split(",")[0]) for row in open(file) if row[0].isdigit() and row.endswith("\n")]


def longest_pause(times):
    return max((later - earlier for earlier, later in zip(times, times[1:])), default=0.0)


def end_after_pause(run, felt, file):
    """Notes the first spikes, and ends the run once there are some after the noise."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline and run.poll() is None:
        spikes = spikes_in(file)
        if spikes:
            felt.set()
        if longest_pause(spikes) >= 0.6 * HOSTILE_S:
            break
        time.sleep(0.1)
    run.send_signal(signal.SIGINT)


def fault_of(expected, words, code, summary, said, spikes):
    """What is wrong with the outcome of a touch attack, or nothing."""
    if summary is None:
        return f"exit code {code}: {said[:300]}"
    if missing := [word for word in words if word not in said]:
        return f"the program did not say {missing}: {said[:3000]}"
    if not spikes:
        return "no spikes"
    if expected == "silent":
        longest = longest_pause(spikes)
        if longest < 0.6 * HOSTILE_S:
            return f"spikes in the noise, or none after it: the longest pause is {longest:.2f} s of {spikes[-1] - spikes[0]:.2f} s"
    elif expected == "kept":
        ticks, lost = summary["ticks"], summary["released_ticks"] + summary["held_ticks"]
        if lost > 0.2 * ticks:  # on a busy machine
            return f"{lost} of {ticks} ticks held or released"
    return None
