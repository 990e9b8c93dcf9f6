"""An independent auditor of stimulation: it reads the commands as a receiver does, while the program and its device are
stopped at random. It shares no code with merkel. MERKEL_FAULTS sets the number of faults (12)."""
import csv
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import threading
import time

import merkel_program

WATCHDOG_S, UPDATE_S, TICK_S, DELAY_S, SLOPE = 0.060, 0.010, 0.001, 0.005, 2000.0
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


class Receiver(threading.Thread):
    """Reads a pipe and notes when each command arrived."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.path, self.rows, self.ended = path, [], False

    def run(self):
        with open(self.path, encoding="utf-8") as pipe:
            for line in pipe:
                now = time.monotonic()
                if line.startswith("#") or line.startswith("time_s"):
                    continue
                time_s, _, kind, amplitude, _, heartbeat, stop = next(csv.reader([line]))
                self.rows.append((now, float(time_s), kind, float(amplitude), int(heartbeat), stop))
        self.ended = True


class Faults(merkel_program.TestCase):
    def start(self):
        with open(self.path("scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        with open(self.path("press.csv"), "w", encoding="utf-8") as file:
            file.write("time_s,depth_mm,force_N\n" + "".join(f"{k / 1000:.3f},1.2,0.2\n" for k in range(1000)))
        link, pipe = self.path("probe"), self.path("pipe")
        os.mkfifo(pipe)
        device = merkel_program.start("simulate-probe", "hbf1", "--trace", self.path("press.csv"), "--repeat", "--link", link)
        self.addCleanup(device.communicate)
        self.addCleanup(device.kill)
        self.assertTrue(merkel_program.wait_for(lambda: os.path.exists(link)))
        receiver = Receiver(pipe)
        receiver.start()
        program = subprocess.Popen([merkel_program.PROGRAM, "run", self.path("scene.toml"), "--probe",
                                    f"serial:{link}?protocol=hbf1", "--sink", f"stim-csv:{pipe}?time=device", "--json"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(program.kill)
        if not merkel_program.wait_for(lambda: any(row[3] > 0 for row in receiver.rows)):
            program.kill()
            self.fail(program.communicate()[1])
        return device, program, receiver

    def audit(self, rows):
        """The promises that hold whatever the machine does. A reader that was late itself sees several rows at once: only
        the order and the amplitudes of these count."""
        violations = []
        amplitude, before, heartbeat, stopped = 0.0, None, 0, True
        for now, time_s, kind, uA, number, stop in rows:
            if kind != "update":
                continue
            if number != heartbeat + 1:
                violations.append(f"heartbeat {number} after {heartbeat}")
            heartbeat = number
            if stop and uA != 0:
                violations.append(f"{uA} uA although {stop}")
            if stopped and uA > SLOPE * (UPDATE_S + 2 * TICK_S) + 1e-6:
                violations.append(f"{uA} uA at once after a stop")
            if before is not None and time_s < before:
                violations.append("time goes back")
            # The silence before an update that is on, in probe time, which the reader cannot distort.
            if before is not None and amplitude > 0 and uA > 0 and time_s - before > 2 * WATCHDOG_S:
                violations.append(f"on after {time_s - before:.3f} s without an off")
            amplitude, before, stopped = uA, time_s, stop != ""
        return violations

    def test_stops_of_the_program_and_of_its_device(self):
        device, program, receiver = self.start()
        choose = random.Random(7)
        off_after = []
        for _ in range(int(os.environ.get("MERKEL_FAULTS", "12"))):
            merkel_program.wait_for(lambda: receiver.rows[-1][3] > 30)
            victim = choose.choice((device, program))
            length = choose.uniform(0.05, 0.6)
            first = len(receiver.rows)
            began = time.monotonic()
            victim.send_signal(signal.SIGSTOP)
            time.sleep(length)
            if victim is device:
                offs = [row for row in receiver.rows[first:] if row[3] == 0]
                if length > 3 * WATCHDOG_S:
                    self.assertTrue(offs, "a dead device did not switch the electrode off")
                if offs:
                    off_after.append(offs[0][0] - began)
            victim.send_signal(signal.SIGCONT)
            time.sleep(choose.uniform(0.05, 0.3))
            if victim is program and length > 3 * WATCHDOG_S:
                merkel_program.wait_for(lambda: len(receiver.rows) > first + 1)
                late = [row for row in receiver.rows[first:] if row[0] > began + length]
                self.assertIn("stale", [row[5] for row in late[:3]], late[:3])
        program.send_signal(signal.SIGINT)
        report = json.loads(program.communicate(timeout=60)[0])
        self.assertTrue(merkel_program.wait_for(lambda: receiver.ended))
        self.assertEqual(self.audit(receiver.rows), [])
        self.assertEqual(receiver.rows[-1][5], "end")
        self.assertGreater(report["stale_stops"], 0)
        self.assertGreater(report["commands_withheld"], 0, "the backlog of the stops")
        if off_after:
            print(f"off after a dead device: median {statistics.median(off_after) * 1e3:.1f} ms, longest "
                  f"{max(off_after) * 1e3:.1f} ms, watchdog {WATCHDOG_S * 1e3:g} ms", file=sys.stderr)
        ages = [now - time_s for now, time_s, kind, uA, _, stop in receiver.rows if uA > 0]
        print(f"age on arrival: median {statistics.median(ages) * 1e3:.1f} ms, 99 % "
              f"{sorted(ages)[int(0.99 * len(ages))] * 1e3:.1f} ms, longest {max(ages) * 1e3:.1f} ms, of {len(ages)} commands; "
              f"delay {DELAY_S * 1e3:g} ms", file=sys.stderr)


if __name__ == "__main__":
    merkel_program.main()
