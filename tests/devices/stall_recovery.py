#!/usr/bin/env python3
"""How long the delay of the loop stays larger after a stop of 0.5 s.

usage: tests/devices/stall_recovery.py PROGRAM

A simulated hbf1 device sends 1000 samples a second for 25 s. After 9 s merkel is stopped, or the device, or the link holds its bytes
back, for 0.5 s each. The delay before is the median of the second before the stop; it is back where it is
first at most 10 % larger than that. Prints a table in Markdown.
"""
import argparse
import bisect
import csv
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import time

TRACE = pathlib.Path(__file__).resolve().parents[1] / "traces" / "taps.csv"
STOP_S, FOR_S, RUN_S, STEP_S = 9, 0.5, 25, 0.01


def delays_of(program, session):
    """The delay every 10 ms of the run, in ms."""
    text = subprocess.run([program, "inspect", "session", session, "--stream", "delay"], check=True, capture_output=True, text=True).stdout
    rows = [(float(row["time_s"]), 1e3 * float(row["delay_s"])) for row in csv.DictReader(text.splitlines())]
    times = [time for time, _ in rows]
    return [rows[max(bisect.bisect_right(times, times[0] + k * STEP_S) - 1, 0)][1] for k in range(int((RUN_S - 1) / STEP_S))]


def stop(process):
    time.sleep(STOP_S)
    process.send_signal(signal.SIGSTOP)
    time.sleep(FOR_S)
    process.send_signal(signal.SIGCONT)


def measure(program, what, folder):
    link, session = f"{folder}/tty", f"{folder}/{what.split()[0]}.xdf"
    stall = ["--stall-s", str(STOP_S), "--stall-for-s", str(FOR_S)] if what == "link holds back" else []
    device = subprocess.Popen([program, "simulate-probe", "hbf1", "--trace", TRACE, "--repeat", "--link", link, *stall],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        uri = device.stdout.readline().strip()
        run = subprocess.Popen([program, "run", "paper", "--probe", uri, "--duration-s", str(RUN_S), "--sink", f"xdf:{session}"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if not stall:
            stop(run if what == "merkel stopped" else device)
        run.wait()
    finally:
        device.send_signal(signal.SIGCONT)
        device.terminate()
        device.wait()
    delays = delays_of(program, session)
    begin = int((STOP_S - 1.5) / STEP_S)
    before = statistics.median(delays[begin:begin + 100])
    after = delays[int((STOP_S - 0.5) / STEP_S):]
    larger = next((k for k, delay in enumerate(after) if delay > 1.1 * before), 0)
    largest = max(range(len(after)), key=after.__getitem__)
    again = next((k for k in range(largest, len(after)) if after[k] <= 1.1 * before), None)
    back = "not in this run" if again is None else f"{(again - larger) * STEP_S:.1f}" if after[largest] > 1.1 * before else "0.0"
    return f"| {what} | {before:.2f} | {after[largest]:.2f} | {back} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    program = os.path.abspath(parser.parse_args().program)
    print("| stop of 0.5 s | delay before, ms | largest after, ms | back within 10 % after, s |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for what in ("merkel stopped", "device stopped", "link holds back"):
            print(measure(program, what, folder), flush=True)


if __name__ == "__main__":
    sys.exit(main())
