#!/usr/bin/env python3
"""Attacks the built program from outside and counts what it withstood, as a Markdown table.

attack.py PROGRAM [--sample N] [--only NAME…] [--seed S]: N times the attacks of a quick run (1, as in the tests; 40 takes an hour).
Every attempt must end by itself, without a crash, with an exit code of the list and a short sentence where it fails; what was
flushed must be readable, and no input may change."""
import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import hostile_devices

CODES = (0, 1, 2, 3)
PATIENCE_S = 120
EXTREMES = ("0", "-1", "1e-300", "1e-9", "0.001", "1", "1e3", "1e9", "1e300", "inf", "nan", "true", '""', "[]", "[1e9, 1e9]", '"x"',
            "2147483648", "18446744073709551616", "-0.0")


class Failure(Exception):
    pass


class Attacker:
    def __init__(self, program, folder, seed, sample=1.0):
        self.program, self.folder, self.sample = os.path.abspath(program), folder, sample
        self.random = random.Random(seed)
        self.files = 0

    def some(self, attacks):
        """All attacks of a list, or, below one times a quick run, that part of them, in their order."""
        count = len(attacks) if self.sample >= 1 else round(self.sample * len(attacks))
        return [attacks[k] for k in sorted(self.random.sample(range(len(attacks)), count))]

    def path(self, ending):
        self.files += 1
        return os.path.join(self.folder, f"{self.files}{ending}")

    def start(self, *arguments, **keywords):
        keywords = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL, **keywords}
        return subprocess.Popen([self.program, *arguments], text=True, errors="replace", **keywords)

    def check(self, arguments, process, codes=CODES):
        """Waits for a process. \\returns what it printed"""
        command = "merkel " + " ".join(arguments)
        try:
            out, err = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise Failure(f"{command}: still running after {PATIENCE_S} s")
        if process.returncode not in codes:
            raise Failure(f"{command}: exit code {process.returncode}: {err[-300:]}")
        if process.returncode in (2, 3) and not re.search(r"^merkel: ", err, re.M):
            raise Failure(f"{command}: refused without a sentence: {err[-300:]}")
        if len(err) > 20_000:
            raise Failure(f"{command}: {len(err)} bytes of messages: {err[:300]}")
        return out, err

    def run(self, *arguments, codes=CODES, **keywords):
        return self.check(arguments, self.start(*arguments, **keywords), codes)

    def no_nan(self, arguments, file):
        text = pathlib.Path(file).read_text(errors="replace")
        if re.search(r"\b(nan|inf)\b", text):
            raise Failure(f"merkel {' '.join(arguments)}: a number of {file} is not finite")

    # Each attack makes one attempt. \returns how much it counts, usually 1

    def scene(self):
        """Two to four keys at extreme values."""
        if not hasattr(self, "keys"):
            section, self.keys = None, []
            for line in self.run("scene", "--keys", codes=(0,))[0].splitlines():
                if heading := re.match(r"## `(.*?)`", line):
                    section = heading.group(1)
                elif (row := re.match(r"\| `(\w+)` \|", line)) and section:
                    self.keys.append((section, row.group(1)))
        sections = {}
        for section, key in self.random.sample(self.keys, self.random.randint(2, 4)):
            sections.setdefault(section, []).append(f"{key} = {self.random.choice(EXTREMES)}")
        text = f'preset = "{self.random.choice(("paper", "finger", "goodwin"))}"\n'
        text += "".join(f"{section}\n" + "\n".join(keys) + "\n" for section, keys in sections.items())
        file, out = self.path(".toml"), self.path(".csv")
        pathlib.Path(file).write_text(text)
        arguments = ("run", file, "--fast", "--duration-s", "0.1", "--probe", "sim:taps?wait_s=0", "--sink", "csv:" + out)
        try:
            self.run(*arguments)
        except Failure as failure:
            raise Failure(f"{failure}\n{text}")
        if os.path.exists(out):
            self.no_nan(arguments, out)
        return 1

    def originals(self):
        """Files of every kind, each with the commands that read it."""
        if hasattr(self, "_originals"):
            return self._originals
        made = {kind: self.path(kind) for kind in (".csv", ".gdf", ".h5", ".nwb", ".xdf")}
        scene = self.path(".toml")
        pathlib.Path(scene).write_text(self.run("scene", "finger", codes=(0,))[0])
        sinks = [word for kind, file in zip(("csv", "gdf", "sonata", "nwb", "xdf"), made.values()) for word in ("--sink", f"{kind}:{file}")]
        self.run("run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", *sinks, codes=(0,))
        self.session = made[".xdf"]
        spikes = [lambda file: ("compare", file, made[".csv"])]
        self._originals = [("tests/traces/faulty.csv", [lambda file: ("run", "--fast", "--probe", "replay:" + file, "--duration-s", "1"),
                                                        lambda file: ("fit", "skin", "--trace", file, "--plate", "--out", self.path(".toml"))]),
                           (scene, [lambda file: ("run", file, "--fast", "--duration-s", "0.1"), lambda file: ("inspect", "afferents", file)]),
                           *((made[kind], spikes) for kind in (".csv", ".gdf", ".h5", ".nwb"))]
        return self._originals

    def damaged(self, original):
        """A copy with some bytes changed, cut, repeated, or replaced by those of the end."""
        data = bytearray(pathlib.Path(original).read_bytes())
        for _ in range(self.random.choice((1, 1, 3, 30))):
            at = self.random.randrange(len(data)) if data else 0
            kind = self.random.randrange(5)
            if kind == 0 and data:
                data[at] ^= 1 << self.random.randrange(8)
            elif kind == 1:
                del data[at:]
            elif kind == 2:
                del data[at:at + self.random.randrange(1, 200)]
            elif kind == 3:
                data[at:at] = data[at:at + self.random.randrange(1, 200)]
            else:
                data[at:at + 8] = self.random.choice((b"\xff" * 8, b"\0" * 8, b"nan,inf,", b"9" * 8, b"-1e308,,"))
        file = self.path(pathlib.Path(original).suffix)
        pathlib.Path(file).write_bytes(data)
        return file

    def file(self):
        original, commands = self.random.choice(self.originals())
        file = self.damaged(original)
        self.run(*self.random.choice(commands)(file))
        os.unlink(file)
        return 1

    def damaged_session(self):
        self.originals()
        file = self.damaged(self.session)
        self.run(*self.random.choice((("replay", file), ("inspect", "session", file), ("export", file, "--sink", "csv:" + self.path(".csv")),
                                      ("run", "--fast", "--probe", "replay:" + file))))
        os.unlink(file)
        return 1

    def own_input(self):
        """An output that is an input, by one of its names, with --overwrite: refused, and the input stays as it was."""
        self.originals()
        scene, trace, session, calibration = (self.path(ending) for ending in (".toml", ".csv", ".xdf", ".toml"))
        pathlib.Path(scene).write_text('preset = "goodwin"\n')
        shutil.copy("tests/traces/ramp_and_hold.csv", trace)
        shutil.copy(self.session, session)
        pathlib.Path(calibration).write_text("[force]\nsource = \"force\"\n")
        file, command = self.random.choice((
            (scene, lambda out: ("run", scene, "--fast", "--sink", "csv:" + out)),
            (trace, lambda out: ("run", "--fast", "--probe", "replay:" + trace, "--record", out)),
            (trace, lambda out: ("record", "replay:" + trace, out)),
            (session, lambda out: ("replay", session, "--sink", "xdf:" + out)),
            (session, lambda out: ("export", session, "--sink", "csv:" + out)),
            (trace, lambda out: ("fit", "skin", "--trace", trace, "--plate", "--out", out)),
            (scene, lambda out: ("fit", "skin", scene, "--trace", trace, "--plate", "--out", out)),
            (scene, lambda out: ("fit", scene, "--out", out)),
            (calibration, lambda out: ("connect", f"tcp:127.0.0.1:9?protocol=csv&columns=force_N&calibration={calibration}", "--yes", "--out", out)),
            (trace, lambda out: ("calibrate", "replay:" + trace, out))))
        out = self.path(pathlib.Path(file).suffix)
        kind = self.random.choice(("same", "symbolic", "hard", "dots"))
        if kind == "symbolic":
            os.symlink(file, out)
        elif kind == "hard":
            os.link(file, out)
        else:
            out = file if kind == "same" else os.path.join(self.folder, ".", "..", os.path.basename(self.folder), os.path.basename(file))
        before = pathlib.Path(file).read_bytes()
        arguments = (*command(out), "--overwrite")
        self.run(*arguments, codes=(2,))
        if pathlib.Path(file).read_bytes() != before:
            raise Failure(f"merkel {' '.join(arguments)}: its input has changed")
        return 1

    def wait_for(self, file):
        for _ in range(1000):
            if os.path.exists(file) and os.path.getsize(file) > 0:
                return
            time.sleep(0.01)
        raise Failure(f"{file} was not begun within 10 s")

    def live_run(self):
        session, spikes = self.path(".xdf"), self.path(".csv")
        arguments = ("run", "--probe", "sim:taps?count=1000&live=1&wait_s=0", "--sink", "xdf:" + session, "--sink", "csv:" + spikes)
        process = self.start(*arguments)
        self.wait_for(session + ".part")
        time.sleep(self.random.uniform(0.0, 0.6))
        return arguments, process, session, spikes

    def signal(self):
        """A signal at any time of a live run; its files are complete."""
        arguments, process, session, spikes = self.live_run()
        which = self.random.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGSTOP))
        process.send_signal(which)
        if which == signal.SIGSTOP:
            time.sleep(self.random.uniform(0.0, 0.5))
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGINT)
        self.check(arguments, process, codes=(0, 1))
        out, _ = self.run("replay", session, codes=(0, 1))
        if "bit-identical" not in out and "no spikes" not in out:
            raise Failure(f"{signal.Signals(which).name}: the session does not replay: {out[-200:]}")
        return 1

    def kill(self):
        """SIGKILL at any time; what was flushed is readable, and the next run of the name keeps it."""
        arguments, process, session, spikes = self.live_run()
        process.kill()
        process.communicate()
        self.run("inspect", "session", session + ".part", codes=(0,))
        before = os.path.getsize(session + ".part")
        self.run("run", "--fast", "--sink", "xdf:" + session, codes=(0, 1, 2))
        kept = [each for each in pathlib.Path(self.folder).glob(pathlib.Path(session).stem + ".*xdf*") if each.stat().st_size == before]
        if not kept:
            raise Failure("the next run destroyed the session of a killed one")
        return 1

    STDOUT = (("scene",), ("scene", "--keys"), ("--help",), ("run", "--help"), ("--version",), ("probes",), ("plan", "paper"),
              ("inspect", "contact", "--radius-mm", "2", "--depth-mm", "1"), ("inspect", "afferents", "finger"),
              ("inspect", "neuron", "--current", "7"), ("inspect", "receptors"), ("run", "--fast"), ("run", "--fast", "--json"),
              ("compare", "tests/golden/0.1.0/spikes.csv", "tests/golden/0.1.0/spikes.csv"), ("inspect", "session", "SESSION"), ("replay", "SESSION"))

    def full_disk(self):
        """A full disk under standard output, or at a random size of the sinks' files."""
        self.originals()
        if self.random.random() < 0.5:
            arguments = [self.session if each == "SESSION" else each for each in self.random.choice(self.STDOUT)]
            with open("/dev/full", "w") as full:
                _, err = self.run(*arguments, codes=(1, 2), stdout=full)
            if "merkel: " not in err:
                raise Failure(f"merkel {' '.join(arguments)} >/dev/full: no sentence")
            return 1
        most = self.random.randrange(1, 60_000)
        sinks = [word for kind in ("csv", "gdf", "xdf", "sonata", "nwb", "stim-csv") for word in ("--sink", f"{kind}:{self.path('.' + kind)}")]
        arguments = ("run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", *sinks)
        self.run(*arguments, codes=(0, 1, 2), preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)))
        return 1

    def socket(self):
        """A hostile client of the page, of ZeroMQ or of nothing in particular, or a server that hangs up."""
        ports = []
        for _ in range(2):
            with socket.socket() as free:
                free.bind(("127.0.0.1", 0))
                ports.append(free.getsockname()[1])
        arguments = ("run", "--probe", "sim:taps?count=1000&live=1", "--duration-s", "1.5", "--json", "--sink", f"view:{ports[0]}",
                     "--sink", f"zmq:tcp://127.0.0.1:{ports[1]}")
        process = self.start(*arguments)
        end, made, clients = time.monotonic() + 1.5, 0, []
        while time.monotonic() < end and process.poll() is None:
            client = socket.socket()
            try:
                client.connect(("127.0.0.1", self.random.choice(ports)))
                client.setblocking(False)
                client.send(self.random.choice((os.urandom(1000), b"GET / HTTP/1.1\r\n", b"GET /" + b"a" * 60_000, b"\xff" + b"\0" * 8 + b"\x01\x7f",
                                                b"GET /ws HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: x\r\n\r\n", b"")))
                made += 1
            except OSError:
                pass
            if self.random.random() < 0.5:
                client.close()
            else:
                clients.append(client)
            time.sleep(0.005)
        out, _ = self.check(arguments, process, codes=(0, 1))
        for client in clients:
            client.close()
        summary = json.loads(out)
        if summary["spikes"] == 0 or any(not math.isfinite(value) for value in summary.values() if isinstance(value, float)):
            raise Failure("the run under attack has no spikes")
        return made

    def wrong_baud(self, protocol, trace):
        """The program at half the baud rate of a device. \\returns what is wrong"""
        device = self.start("simulate-probe", protocol, "--trace", trace, "--repeat", "--baud", "19200")
        uri = device.stdout.readline().strip()
        wrong = re.sub(r"baud=\d+", "baud=9600", uri) if "baud=" in uri else uri + "&baud=9600"
        code = self.start("run", "--probe", wrong, "--duration-s", "1")
        _, err = code.communicate(timeout=PATIENCE_S)
        device.kill()
        device.communicate()
        return [] if code.returncode == 3 and "merkel: " in err else [f"{protocol} at half its baud rate: {code.returncode}: {err[:300]}"]

    def device(self):
        """The hostile devices of hostile_devices.py. \\returns minutes"""
        trace, seconds, minutes = self.path(".csv"), 8, 0.0
        pathlib.Path(trace).write_text("time_s,depth_mm,force_N\n" + "".join(f"{0.004 * k:.3f},1,1\n" for k in range(5000)))
        faults = []
        # What waits for an answer that never comes costs no processor time.
        def opening(attack):
            _, options, device, _ = attack
            begin = time.monotonic()
            run = hostile_devices.run_with(self.program, device, socket.SOCK_STREAM, options, self.folder, seconds)
            return run, (time.monotonic() - begin) / 60

        def wrong_baud(protocol):
            begin = time.monotonic()
            return self.wrong_baud(protocol, trace), (time.monotonic() - begin) / 60

        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            attacks = self.some(hostile_devices.opening_attacks())
            for (name, _, _, words), ((code, _, said, _, _), its_minutes) in zip(attacks, pool.map(opening, attacks)):
                minutes += its_minutes
                if code != 3 or not all(word in said for word in words):
                    faults.append(f"{name}: exit code {code}: {said[:300]}")
            for its_faults, its_minutes in pool.map(wrong_baud, self.some(["hbf1", "csv", "mark10", "esm", "grbl", "optoforce", "zaber"])):
                faults += its_faults
                minutes += its_minutes
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            attacks = self.some(hostile_devices.touch_attacks(self.program, trace))
            patient = "&timeout_ms=20000"  # on a busy machine, the device itself waits for a core
            runs = pool.map(lambda each: hostile_devices.run_with(self.program, each[2], each[3], each[1] + patient, self.folder, seconds,
                                                                  2 * ("busy" in each[0])), attacks)
            for (name, _, _, _, expected, words), (code, summary, said, spikes, _) in zip(attacks, runs):
                minutes += seconds / 60
                if fault := hostile_devices.fault_of(expected, words, code, summary, said, spikes):
                    faults.append(f"{name}: {fault}")
        if faults:
            raise Failure("\n".join(faults))
        return minutes


ATTACKS = {  # name: (attack, attempts of a quick run, what an attempt is)
    "scenes": (Attacker.scene, 15, "two to four keys of a preset at extreme values"),
    "files": (Attacker.file, 15, "damaged traces, scenes and files of spikes (CSV, GDF, SONATA, NWB)"),
    "own inputs": (Attacker.own_input, 15, "an output that is an input of the command, by links and other names, with --overwrite"),
    "sessions": (Attacker.damaged_session, 10, "damaged sessions: replay, inspect, export, as a probe"),
    "device minutes": (Attacker.device, 1, "devices that send noise, other protocols, wrong times, numbers and units, late, in bursts"),
    "sockets": (Attacker.socket, 1, "clients of the page and of ZeroMQ that send junk, nothing or too much, and stay or hang up"),
    "signals": (Attacker.signal, 4, "SIGINT, SIGTERM, SIGHUP, SIGSTOP at any time; the session must replay bit for bit"),
    "full disks": (Attacker.full_disk, 10, "/dev/full under standard output of every command; sinks' files at a size limit"),
    "kills": (Attacker.kill, 3, "SIGKILL at any time; the session must be readable, and the next run must keep it"),
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--sample", type=float, default=1)
    parser.add_argument("--only", nargs="*", choices=list(ATTACKS))
    parser.add_argument("--seed", type=int, default=int(time.time()))
    options = parser.parse_args()
    print(f"seed {options.seed}", file=sys.stderr)
    folder = tempfile.mkdtemp(prefix="merkel-attack-")
    attacker, failed = Attacker(options.program, folder, options.seed, options.sample), 0
    rows = []
    for name in options.only or ATTACKS:
        attack, attempts, what = ATTACKS[name]
        attempts, count, faults = max(1, round(attempts * options.sample)), 0, 0
        for _ in range(attempts):
            try:
                count += attack(attacker)
            except Failure as failure:
                faults += 1
                print(f"FAILED {name}: {failure}", file=sys.stderr)
        failed += faults
        rows.append(f"| {name} | {count:.3g} | {faults} | {what} |")
    print("| attacks | withstood | failed | what |\n|---|---|---|---|")
    print("\n".join(rows))
    shutil.rmtree(folder, ignore_errors=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
