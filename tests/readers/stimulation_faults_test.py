#!/usr/bin/env python3
"""An independent auditor of stimulation: it reads the commands as receivers do (stimulation_receivers.py), while the program and its
two devices are stopped, starved, slowed, replugged, rebooted and restarted at random. It shares no code with merkel.

MERKEL_FAULTS sets the number of faults (14). A run of 500 takes seven minutes and prints the table of core/encoding/README.md:

    MERKEL_PROGRAM=build/release/merkel MERKEL_SOAK= MERKEL_FAULTS=500 /usr/bin/python3 tests/readers/stimulation_faults_test.py
"""
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import time

import merkel_program

try:
    import redis
    import stimulation_receivers as receivers
    import stimulator_emulator
except ImportError:
    print("skipped: python3-redis is missing")
    sys.exit(77)

WATCHDOG_S, UPDATE_S, TICK_S, DELAY_S, SLOPE = 0.060, 0.010, 0.001, 0.005, 400.0
SINK_S = 0.005  # how long a sink may take
PROMISED_AGE_S = DELAY_S + 2 * TICK_S + SINK_S
TRANSPORT_S = 0.005  # from the sink to the receiver
DEVICE_S = 0.005  # from a device to the program, on a machine whose terminals wait for a core
# Without real-time rights, the program's threads wait for their turn among the others.
SCHEDULER_S = 0.15
PROBES = 2
SCENE = f"""preset = "paper"
[[electrode]]
name = "E1"
field_mm = [15, 10, 8]
encoder = "linear"
full_force_N = 0.05
amplitude_uA = [40, 80]
frequency_Hz = [100, 200]
[stimulation]
profile = "cerestim"
interphase_us = 53
max_charge_nC = 16
max_total_uA = 100
max_slope_uA_per_s = {SLOPE:g}
watchdog_ms = {WATCHDOG_S * 1e3:g}
"""


def as_others():
    """For the started programs: the auditor's priority is not theirs."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def raise_auditor():
    """Lets receivers read before all others. \\returns whether this machine permits it"""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(85))
    except PermissionError:
        return False
    return True


class Host:
    """When cores of this machine ran nothing."""

    def __init__(self):
        self.watches = [receivers.HostWatch(cpu) for cpu in os.sched_getaffinity(0)]
        for watch in self.watches:
            watch.start()
        self.gaps = []

    def stop(self):
        self.gaps = sorted(gap for watch in self.watches for gap in watch.notes())

    def lost(self, begin, end):
        """The part of an interval in which a core ran nothing."""
        total = 0.0
        for a, b in self.gaps:
            total += max(0.0, min(end, b) - max(begin, a))
            begin = max(begin, b)
        return total


class Run:
    """One run of the program, from its start to its last command."""

    def __init__(self, receivers_, program):
        self.receivers, self.program = receivers_, program

    def all_on(self):
        return merkel_program.wait_for(lambda: all(each.uA.value > 30 for each in self.receivers))

    def all_ended(self):
        return merkel_program.wait_for(lambda: all(each.ended.is_set() for each in self.receivers))


class Auditor(merkel_program.TestCase):
    def setUp(self):
        super().setUp()
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        self.raised = raise_auditor()
        if self.raised:
            self.addCleanup(as_others)
        self.waits = 0.0 if self.raised else SCHEDULER_S
        self.host, self.continued = Host(), []

    def start_program(self, *arguments):
        program = merkel_program.start(*arguments, preexec_fn=as_others)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        return program

    def stop(self, program, length):
        program.send_signal(signal.SIGSTOP)
        time.sleep(length)
        program.send_signal(signal.SIGCONT)
        self.continued.append((time.monotonic(), length))

    def stopped_on_its_way(self, update):
        """How long an update waited that had passed all checks when the program was stopped."""
        return sum(length for at, length in self.continued
                   if -0.001 <= update.arrived - at < 0.02 and update.arrived - update.time_s > length + DELAY_S - 0.002)

    def audit(self, updates, live=True):
        """The promises, as sentences where they were broken.

        live: the commands' times are those of this machine's clock"""
        violations, before, envelope = [], None, 0.0
        for update in updates:
            def broken(what):
                way = (update.arrived - update.sent) * 1e3
                violations.append(f"{what}; heartbeat {update.heartbeat} after {update.arrived - updates[0].arrived:.3f} s, "
                                  f"{way:.1f} ms on its way")
            age = update.arrived - update.time_s
            if live and update.uA > 0 and not self.stopped_on_its_way(update):
                if age - self.host.lost(update.time_s, update.arrived) > PROMISED_AGE_S + TRANSPORT_S + self.waits:
                    broken(f"{update.uA:.1f} uA of {age * 1e3:.1f} ms ago")
            if update.stop and update.uA != 0:
                broken(f"{update.uA:.1f} uA although {update.stop}")
            if update.refused:
                broken(update.refused)
            if before is not None:
                gap = update.arrived - before.arrived
                if update.time_s < before.time_s:
                    broken("time goes back")
                late = self.host.lost(before.arrived, update.arrived)
                limit = WATCHDOG_S + UPDATE_S + TRANSPORT_S + self.waits + late
                if before.uA > 0 and update.uA > 0 and gap - self.stopped_on_its_way(update) > limit:
                    broken(f"on after {gap * 1e3:.1f} ms without an off")
                # A rise of one update, its ticks and the jitter of the transport may come at once. An update that a stall of the
                # machine delayed is closer to the next one.
                sent = before.time_s + DELAY_S if live else before.arrived - UPDATE_S
                envelope += SLOPE * (gap + self.host.lost(sent, before.arrived))
                burst = SLOPE * (UPDATE_S + 2 * TICK_S + TRANSPORT_S + self.waits)
                excess = update.uA - envelope - burst
                if excess > 0:
                    broken(f"{update.uA:.1f} uA, {envelope:.1f} allowed by the slope, {gap * 1e3:.1f} ms after {before.uA:.1f} uA")
                envelope += max(0.0, excess)
            envelope = min(envelope, update.uA)
            before = update
        return violations


class Faults(Auditor):
    def start_device(self, number, *faults):
        device = self.start_program("simulate-probe", "hbf1", "--trace", self.path("press.csv"), "--repeat", "--link",
                                    self.path(f"probe{number}"), *faults)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(self.path(f"probe{number}"))))
        return device

    def start_redis(self):
        """The server is part of the auditor: it has its priority."""
        port = merkel_program.free_port()
        server = subprocess.Popen(["redis-server", "--port", str(port), "--bind", "127.0.0.1", "--save", "", "--appendonly", "no",
                                   "--dir", self.path("")], stdout=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        client = redis.Redis(port=port)

        def answers():
            try:
                return client.ping()
            except redis.exceptions.ConnectionError:
                return False
        self.assertTrue(merkel_program.wait_for(answers))
        return port

    def start(self):
        with open(self.path("scene.toml"), "a", encoding="utf-8") as file:
            for number in range(PROBES):
                file.write(f'[[probe]]\nuri = "serial:{self.path(f"probe{number}")}?protocol=hbf1"\n'
                           f"delay_ms = {DELAY_S * 1e3:g}\nmax_force_N = 1000\n")
        with open(self.path("press.csv"), "w", encoding="utf-8") as file:
            file.write("time_s,depth_mm,force_N\n" + "".join(f"{k / 1000:.3f},1.2,0.2\n" for k in range(1000)))
        self.devices = [self.start_device(number) for number in range(PROBES)]
        os.mkfifo(self.path("pipe"))
        os.mkfifo(self.path("stimulator"))
        self.redis_port, self.runs, self.reports = self.start_redis(), [], []
        self.start_run()

    def start_run(self):
        zmq_port, node = merkel_program.free_port(), f"run{len(self.runs)}"
        listening = [receivers.Pipe(self.path("pipe")), receivers.Zmq(zmq_port),
                     receivers.Redis(redis.Redis(port=self.redis_port), node),
                     *(stimulator_emulator.Stimulator(source, 1, 200, 53)
                       for source in (receivers.Pipe(self.path("stimulator")), receivers.Zmq(zmq_port)))]
        for thread in listening:
            thread.start()
        program = self.start_program(
            "run", self.path("scene.toml"), "--sink", f"stim-csv:{self.path('pipe')}?time=device", "--sink",
            f"stim-csv:{self.path('stimulator')}?time=device", "--sink",
            f"stim-zmq:tcp://127.0.0.1:{zmq_port}", "--sink", f"redis:127.0.0.1:{self.redis_port}?node={node}", "--json")
        self.runs.append(Run(listening, program))
        if not self.runs[-1].all_on():
            program.kill()
            self.fail(program.communicate()[1])

    def end_run(self):
        self.runs[-1].program.send_signal(signal.SIGINT)
        self.reports.append(json.loads(self.runs[-1].program.communicate(timeout=60)[0]))
        self.assertTrue(self.runs[-1].all_ended())

    # Each fault returns when a device sent its last sample while the program ran on, and for how long; None if none fell silent.

    def stop_program(self, length):
        self.stop(self.runs[-1].program, length)

    def stop_device(self, length):
        device, began = self.choose.choice(self.devices), time.monotonic()
        device.send_signal(signal.SIGSTOP)
        time.sleep(length)
        device.send_signal(signal.SIGCONT)
        return (began, length)

    def slow_device(self, length):
        device, end = self.choose.choice(self.devices), time.monotonic() + length
        while time.monotonic() < end:
            device.send_signal(signal.SIGSTOP)
            time.sleep(0.03)
            device.send_signal(signal.SIGCONT)
            time.sleep(0.01)

    def replug(self, length, *faults):
        number, began = self.choose.randrange(PROBES), time.monotonic()
        self.devices[number].kill()
        self.devices[number].communicate()
        time.sleep(length)
        self.devices[number] = self.start_device(number, *faults)
        return (began, length)

    def jump_clock(self, length):
        """The device restarts soon after it is plugged in, and its clock with it."""
        silent = self.replug(length, "--reboot-s", "0.2")
        time.sleep(0.3)
        return silent

    def starve(self, length):
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"], preexec_fn=as_others) for _ in range(2 * (os.cpu_count() or 1))]
        time.sleep(length)
        for process in busy:
            process.kill()
            process.wait()

    def restart(self, length):
        self.end_run()
        time.sleep(length)
        self.start_run()

    def state(self):
        """What the program and its receivers say when the electrode stays off."""
        run = self.runs[-1]
        devices = [device.poll() for device in self.devices]
        run.program.send_signal(signal.SIGINT)
        report, errors = run.program.communicate(timeout=60)
        run.all_ended()
        last = [(each.receiver, each.uA.value, each.ended.is_set()) for each in run.receivers]
        return f"devices {devices}, receivers {last}\n{errors}\n{report}"

    def off_after(self, updates, dead):
        """How long an electrode stayed on after its device had fallen silent, without the machine's stalls, and how it had."""
        delays = []
        for began, length, kind in dead:
            if length < WATCHDOG_S + 0.05:
                continue
            off = next((u.arrived for u in updates if u.arrived > began and u.uA == 0), None)
            delays.append((off - began - self.host.lost(began, off) if off else float("inf"), kind))
        return delays

    def assert_same(self, noted):
        """All receivers got the same commands, sent at the same time, where none of them was late."""
        shared = 0
        for first, *others in noted:
            sent = {update.heartbeat: update for update in first}
            for other in others:
                for update in other:
                    twin = sent.get(update.heartbeat)
                    if twin is None or {"sink_failure", stimulator_emulator.EXPIRED} & {twin.stop, update.stop}:
                        continue
                    self.assertEqual(update.sent, twin.sent)
                    self.assertAlmostEqual(update.time_s, twin.time_s, places=9)
                    shared += update.uA == twin.uA
        self.assertGreater(shared, 0.99 * sum(len(updates) for of_run in noted for updates in of_run[1:]))

    def missing(self, updates):
        """How many updates never came, by their heartbeats."""
        return sum(update.heartbeat - before.heartbeat - 1 for before, update in zip(updates, updates[1:])
                   if update.heartbeat != before.heartbeat)

    def test_faults(self):
        self.start()
        self.choose, dead, kind = random.Random(7), [], "none"
        kinds = [self.stop_program, self.stop_device, self.slow_device, self.replug, self.jump_clock]
        if self.raised:  # else the receivers would starve too
            kinds.append(self.starve)
        count = int(os.environ.get("MERKEL_FAULTS", "14"))
        for number in range(count):
            if not self.runs[-1].all_on():
                self.fail(f"the electrode does not come on again after fault {number}, {kind}: {self.state()}")
            fault = kinds[number % len(kinds)] if number % 25 != 13 else self.restart
            kind = fault.__name__
            longest = 3.0 if self.choose.random() < 0.05 else 0.4
            if silent := fault(self.choose.uniform(0.05, longest)):
                dead.append((*silent, kind))
            time.sleep(self.choose.uniform(0.02, 0.1))
        self.end_run()
        self.host.stop()
        self.assertGreater(sum(report["stale_stops"] for report in self.reports), 0)
        self.assertGreater(sum(report["commands_withheld"] for report in self.reports), 0, "the backlog of the stops")
        print(f"\n{count} faults in {len(self.runs)} runs; delay {DELAY_S * 1e3:g} ms, watchdog {WATCHDOG_S * 1e3:g} ms\n\n"
              f"| receiver | updates | violations | withheld by its sink | age on arrival, median / 99 % (ms) | within {PROMISED_AGE_S * 1e3:g} ms (%) | "
              "held in a stopped program | devices that fell silent | off after, median / longest (ms) | "
              f"off within {(WATCHDOG_S + 0.005) * 1e3:g} ms |\n|---|---|---|---|---|---|---|---|---|---|", file=sys.stderr)
        noted = [[receiver.notes() for receiver in run.receivers] for run in self.runs]
        for index, each in enumerate(zip(*(run.receivers for run in self.runs))):
            of_runs = [of_run[index] for of_run in noted]
            updates = [update for of_run in of_runs for update in of_run]
            violations = [sentence for of_run in of_runs for sentence in self.audit(of_run)]
            ages = sorted(update.arrived - update.time_s for update in updates if update.uA > 0)
            held = sum(self.stopped_on_its_way(update) > 0 for update in updates)
            young = sum(age <= PROMISED_AGE_S for age in ages)
            delays = sorted(self.off_after(updates, dead))
            within = sum(delay <= WATCHDOG_S + 0.005 for delay, _ in delays)
            off = f"{statistics.median_low(delays)[0] * 1e3:.1f} / {delays[-1][0] * 1e3:.1f}" if delays else "–"
            print(f"| `{each[0].receiver}` | {len(updates)} | {len(violations)} | {sum(map(self.missing, of_runs))} | {statistics.median(ages) * 1e3:.1f} / "
                  f"{ages[int(0.99 * len(ages))] * 1e3:.1f} | {100 * young / len(ages):.2f} | {held} | {len(delays)} | {off} | {within} |",
                  file=sys.stderr)
            with self.subTest(each[0].receiver):
                self.assertEqual(violations, [])
                self.assertEqual([late for late in delays if late[0] > WATCHDOG_S + 0.005 + DEVICE_S + self.waits], [])
        self.assert_same(noted)
        for of_run, report in zip(noted, self.reports):
            pipe, zmq, stream, stimulator, by_zmq = map(self.missing, of_run)
            self.assertLessEqual(pipe + zmq + stream + stimulator, report["commands_refused"], "no update is lost without a count")
            self.assertEqual(zmq, by_zmq, "both read one sink")


class Played(Auditor):
    def test_a_played_session_keeps_the_slope_in_wall_time(self):
        self.merkel("run", self.path("scene.toml"), "--fast", "--probe", "sim:taps?count=6&tap_s=1&interval_s=1.1&depth_mm=1.2", "--sink",
                    "xdf:" + self.path("s.xdf"))
        os.mkfifo(self.path("pipe"))
        receiver = receivers.Pipe(self.path("pipe"))
        receiver.start()
        program = self.start_program("replay", self.path("s.xdf"), "--realtime", "--sink", f"stim-csv:{self.path('pipe')}")
        choose = random.Random(3)
        for _ in range(5):
            self.assertTrue(merkel_program.wait_for(lambda: receiver.uA.value > 30))
            self.stop(program, choose.uniform(0.03, 0.3))
        self.assertEqual(program.wait(timeout=60), 0, program.communicate())
        self.assertTrue(merkel_program.wait_for(receiver.ended.is_set))
        self.host.stop()
        updates = receiver.notes()
        self.assertEqual(self.audit(updates, live=False), [])
        self.assertGreater(max(update.uA for update in updates), 40)


if __name__ == "__main__":
    merkel_program.main()
