"""An independent auditor of stimulation: it reads the commands as receivers do (a pipe, ZeroMQ, Redis), while the program and its
device are stopped, starved and replugged at random. It shares no code with merkel.

MERKEL_FAULTS sets the number of faults (12). A run of 500 takes five minutes and prints the table of core/encoding/README.md:

    MERKEL_PROGRAM=build/release/merkel MERKEL_SOAK= MERKEL_FAULTS=500 /usr/bin/python3 tests/readers/stimulation_faults_test.py
"""
import csv
import json
import os
import random
import signal
import statistics
import struct
import subprocess
import sys
import threading
import time

import merkel_program

try:
    import redis
    import zmq
except ImportError:
    print("skipped: python3-redis or python3-zmq is missing")
    sys.exit(77)

WATCHDOG_S, UPDATE_S, TICK_S, DELAY_S, SLOPE = 0.060, 0.010, 0.001, 0.005, 400.0
SINK_S = 0.005  # how long a sink may take
STARVED_S = 0.05  # and how long its threads may wait for a core on a starved machine
HELD_UP_S = 0.15  # and on a machine with other work, or in a stall of its hypervisor
SCENE = f"""preset = "paper"
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
max_slope_uA_per_s = {SLOPE:g}
watchdog_ms = {WATCHDOG_S * 1e3:g}
[probe]
delay_ms = {DELAY_S * 1e3:g}
max_force_N = 1000
"""


PROMISED_AGE_S = DELAY_S + 2 * TICK_S + SINK_S


class Update:
    """An update of the electrode, when it arrived, and when it left if it says so: a queue of the transport may hold several."""

    def __init__(self, time_s, uA, heartbeat, stop, sent=None):
        self.now = time.monotonic()
        self.sent = sent or self.now
        self.time_s, self.uA, self.heartbeat, self.stop = float(time_s), float(uA), int(heartbeat), stop


class Receiver(threading.Thread):
    def __init__(self, name):
        super().__init__(daemon=True)
        self.receiver, self.updates, self.ended = name, [], False

    def run(self):
        for update in self.read():
            self.updates.append(update)
            if update.stop == "end":
                break
        self.close()
        self.ended = True

    def close(self):
        pass


class Pipe(Receiver):
    def __init__(self, path):
        super().__init__("stim-csv")
        self.path = path

    def read(self):
        with open(self.path, encoding="utf-8") as pipe:
            for line in pipe:
                if line.startswith("#") or line.startswith("time_s"):
                    continue
                time_s, _, kind, uA, _, heartbeat, stop = next(csv.reader([line]))
                if kind == "update":
                    yield Update(time_s, uA, heartbeat, stop)


class Zmq(Receiver):
    def __init__(self, port):
        super().__init__("stim-zmq")
        self.socket = zmq.Context.instance().socket(zmq.SUB)
        self.socket.setsockopt(zmq.SUBSCRIBE, b"\x64\x00")
        self.socket.connect(f"tcp://127.0.0.1:{port}")

    def close(self):
        self.socket.close(0)

    def read(self):
        while True:
            command = json.loads(self.socket.recv_multipart()[1])
            if command["kind"] == "update":
                yield Update(command["time_ns"] * 1e-9, command["amplitude_uA"], command["heartbeat"], command["stop"],
                             command["sent_monotonic_ns"] * 1e-9)


class Redis(Receiver):
    def __init__(self, port):
        super().__init__("redis")
        self.client = redis.Redis(port=port)

    def read(self):
        last = "0"
        while True:
            for _, entries in self.client.xread({"merkel": last}, block=1000):
                for last, entry in entries:
                    yield Update(int(entry[b"time_ns"]) * 1e-9, json.loads(entry[b"amplitude_uA"])[0], entry[b"heartbeat"],
                                 json.loads(entry[b"stop"])[0], struct.unpack("<Q", entry[b"ts"])[0] * 1e-9)


def as_others():
    """For the started programs: the auditor's priority is not theirs."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def raise_auditor():
    """Lets receivers read before all others. \returns whether this machine permits it"""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
    except PermissionError:
        return False
    return True


class HostWatch(threading.Thread):
    """Notes when this machine did not run the auditor: what arrives then is late by the auditor's fault."""

    def __init__(self):
        super().__init__(daemon=True)
        self.gaps = []

    def run(self):
        last = time.monotonic()
        while True:
            time.sleep(0.001)
            now = time.monotonic()
            if now - last > 0.004:
                self.gaps.append((last, now))
            last = now

    def lost(self, begin, end):
        return sum(max(0.0, min(end, b) - max(begin, a)) for a, b in self.gaps)


class Faults(merkel_program.TestCase):
    def start_device(self):
        device = merkel_program.start("simulate-probe", "hbf1", "--trace", self.path("press.csv"), "--repeat", "--link", self.path("probe"),
                                      preexec_fn=as_others)
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(self.path("probe"))))
        return device

    def start_redis(self):
        port = merkel_program.free_port()
        server = subprocess.Popen(["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--save", "", "--appendonly", "no",
                                   "--dir", self.path("")], stdout=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)

        def answers():
            try:
                return redis.Redis(port=port).ping()
            except redis.exceptions.ConnectionError:
                return False
        self.assertTrue(merkel_program.wait_for(answers))
        return port

    def start(self):
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        with open(self.path("press.csv"), "w", encoding="utf-8") as file:
            file.write("time_s,depth_mm,force_N\n" + "".join(f"{k / 1000:.3f},1.2,0.2\n" for k in range(1000)))
        self.raised = raise_auditor()
        self.addCleanup(as_others)
        self.device = self.start_device()
        os.mkfifo(self.path("pipe"))
        redis_port, zmq_port = self.start_redis(), merkel_program.free_port()
        self.host = HostWatch()
        self.receivers = [Pipe(self.path("pipe")), Zmq(zmq_port), Redis(redis_port)]
        for thread in (self.host, *self.receivers):
            thread.start()
        self.program = merkel_program.start(
            "run", self.path("scene.toml"), "--probe", f"serial:{self.path('probe')}?protocol=hbf1", "--sink",
            f"stim-csv:{self.path('pipe')}?time=device", "--sink", f"stim-zmq:tcp://127.0.0.1:{zmq_port}", "--sink",
            f"redis:127.0.0.1:{redis_port}", "--json", preexec_fn=as_others)
        self.addCleanup(self.program.kill)
        if not self.all_on():
            self.program.kill()
            self.fail(self.program.communicate()[1])

    def all_on(self):
        return merkel_program.wait_for(lambda: all(each.updates and each.updates[-1].uA > 30 for each in self.receivers))

    # Each fault returns when the device sent its last sample while the program ran on; None if it did not stop.

    def stop_program(self, length):
        self.program.send_signal(signal.SIGSTOP)
        time.sleep(length)
        self.program.send_signal(signal.SIGCONT)
        self.continued.append((time.monotonic(), length))

    def stop_device(self, length):
        began = time.monotonic()
        self.device.send_signal(signal.SIGSTOP)
        time.sleep(length)
        self.device.send_signal(signal.SIGCONT)
        return (began, length)

    def slow_device(self, length):
        end = time.monotonic() + length
        while time.monotonic() < end:
            self.device.send_signal(signal.SIGSTOP)
            time.sleep(0.03)
            self.device.send_signal(signal.SIGCONT)
            time.sleep(0.01)

    def replug(self, length):
        began = time.monotonic()
        self.device.kill()
        self.device.communicate()
        time.sleep(length)
        self.device = self.start_device()
        return (began, length)

    def starve(self, length):
        began = time.monotonic()
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"], preexec_fn=as_others) for _ in range(2 * (os.cpu_count() or 1))]
        time.sleep(length)
        for process in busy:
            process.kill()
            process.wait()
        self.starved.append((began, time.monotonic()))

    def kept_waiting(self, update):
        """How long a thread that passes commands on may have waited for a core while the machine was starved."""
        return max((STARVED_S for begin, end in self.starved if begin <= update.now <= end + STARVED_S), default=0.0)

    def on_its_way(self, update):
        """How long a command waited that was on its way when the program was stopped."""
        return sum(length for at, length in self.continued
                   if 0 <= update.now - at < 0.02 and update.now - update.time_s > length - 0.002)

    def audit(self, receiver, live=True):
        """The promises, as sentences where they were broken. The auditor's own stalls are deducted.

        live: the commands' times are those of this machine's clock"""
        violations, ages = [], []
        before, envelope = None, 0.0
        for update in receiver.updates:
            age = update.now - update.time_s
            if live and update.uA > 0:
                late = self.host.lost(update.time_s, update.now + 0.002)
                ages.append(age)
                if age - late - self.on_its_way(update) > PROMISED_AGE_S + HELD_UP_S:
                    violations.append(f"{update.uA} uA of {age * 1e3:.1f} ms ago")
            if update.stop and update.uA != 0:
                violations.append(f"{update.uA} uA although {update.stop}")
            if before is not None:
                gap = update.sent - before.sent
                if update.heartbeat != before.heartbeat + 1:
                    violations.append(f"heartbeat {update.heartbeat} after {before.heartbeat}")
                if update.time_s < before.time_s:
                    violations.append("time goes back")
                late = self.host.lost(before.now - 0.05, update.now + 0.002)
                if live:
                    late += self.kept_waiting(update)
                    envelope += SLOPE * self.on_its_way(before)
                waited = self.on_its_way(update) if live else 0
                if before.uA > 0 and update.uA > 0 and gap - late - waited > WATCHDOG_S + UPDATE_S + 0.015:
                    violations.append(f"on after {gap:.3f} s without an off")
                envelope += SLOPE * gap
                # After a stop, an amplitude rises at once as after one update.
                rise = update.uA - envelope - SLOPE * (UPDATE_S + 2 * TICK_S + 0.005)
                if rise > SLOPE * late:
                    violations.append(f"{update.uA:.1f} uA, {envelope:.1f} allowed by the slope, {gap * 1e3:.1f} ms after the update before")
                envelope += max(0.0, rise)
            envelope = min(envelope, update.uA)
            before = update
        return violations, ages

    def off_after(self, receiver, dead):
        """How long an electrode stayed on after its device had fallen silent, without the auditor's own stalls."""
        delays = []
        for began, length in dead:
            if length < WATCHDOG_S + 0.05:
                continue
            off = next((u.now for u in receiver.updates if u.now > began and u.uA == 0), None)
            delays.append(off - began - self.host.lost(began, off) if off else float("inf"))
        return delays

    def test_faults(self):
        self.start()
        choose, dead, self.continued, self.starved = random.Random(7), [], [], []
        kinds = [self.stop_program, self.stop_device, self.slow_device, self.replug]
        if self.raised:  # else the receivers would starve too
            kinds.append(self.starve)
        count = int(os.environ.get("MERKEL_FAULTS", "12"))
        for number in range(count):
            self.assertTrue(self.all_on(), "the electrode does not come on again")
            fault = kinds[number % len(kinds)]
            longest = 3.0 if choose.random() < 0.05 else 0.4
            if silent := fault(choose.uniform(0.05, longest)):
                dead.append(silent)
            time.sleep(choose.uniform(0.02, 0.1))
        self.program.send_signal(signal.SIGINT)
        report = json.loads(self.program.communicate(timeout=60)[0])
        self.assertTrue(merkel_program.wait_for(lambda: all(each.ended for each in self.receivers)))
        self.assertGreater(report["stale_stops"], 0)
        self.assertGreater(report["commands_withheld"], 0, "the backlog of the stops")
        print(f"\n{count} faults; delay {DELAY_S * 1e3:g} ms, watchdog {WATCHDOG_S * 1e3:g} ms\n\n"
              f"| receiver | updates | violations | age on arrival, median / 99 % (ms) | within {PROMISED_AGE_S * 1e3:g} ms (%) | devices that fell silent | off after, median / "
              "longest (ms) | off within the watchdog + 5 ms |\n|---|---|---|---|---|---|---|---|", file=sys.stderr)
        for receiver in self.receivers:
            violations, ages = self.audit(receiver)
            ages.sort()
            delays = self.off_after(receiver, dead)
            within = sum(delay <= WATCHDOG_S + 0.005 for delay in delays)
            off = f"{statistics.median(delays) * 1e3:.1f} / {max(delays) * 1e3:.1f}" if delays else "–"
            young = sum(age <= PROMISED_AGE_S for age in ages)
            print(f"| `{receiver.receiver}` | {len(receiver.updates)} | {len(violations)} | {statistics.median(ages) * 1e3:.1f} / "
                  f"{ages[int(0.99 * len(ages))] * 1e3:.1f} | {100 * young / len(ages):.2f} | {len(delays)} | {off} | {within} |",
                  file=sys.stderr)
            with self.subTest(receiver.receiver):
                self.assertEqual(violations, [])
                self.assertTrue(all(delay < WATCHDOG_S + 0.1 for delay in delays), delays)

    def test_a_played_session_keeps_the_slope_in_wall_time(self):
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        self.merkel("run", self.path("scene.toml"), "--fast", "--probe", "sim:taps?count=6&tap_s=1&interval_s=1.1&depth_mm=1.2", "--sink",
                    "xdf:" + self.path("s.xdf"))
        os.mkfifo(self.path("pipe"))
        raise_auditor()
        self.addCleanup(as_others)
        self.host, receiver, self.continued = HostWatch(), Pipe(self.path("pipe")), []
        self.host.start()
        receiver.start()
        self.program = merkel_program.start("replay", self.path("s.xdf"), "--realtime", "--sink", f"stim-csv:{self.path('pipe')}",
                                            preexec_fn=as_others)
        self.addCleanup(self.program.kill)
        choose = random.Random(3)
        for _ in range(5):
            self.assertTrue(merkel_program.wait_for(lambda: receiver.updates and receiver.updates[-1].uA > 30))
            self.stop_program(choose.uniform(0.03, 0.3))
        self.assertEqual(self.program.wait(timeout=60), 0, self.program.communicate())
        self.assertTrue(merkel_program.wait_for(lambda: receiver.ended))
        self.assertEqual(self.audit(receiver, live=False)[0], [])
        self.assertGreater(max(update.uA for update in receiver.updates), 40)


if __name__ == "__main__":
    merkel_program.main()
