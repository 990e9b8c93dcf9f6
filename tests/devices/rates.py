#!/usr/bin/env python3
"""Runs every protocol at every rate, with default settings, on a simulated device.

usage: tests/devices/rates.py PROGRAM [--seconds 10] [--only PROTOCOL] [--write]

Prints a table in Markdown; --write puts it into drivers/README.md between its marks. Exit 1 where less than
99 % of the samples were used, more than 1 % of the ticks held the last sample, or the replay of what was
read gives other spikes.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

RATES = [10, 25, 100, 250, 1000]
README = pathlib.Path(__file__).resolve().parents[2] / "drivers" / "README.md"
BEGIN, END = "<!-- rates begin -->", "<!-- rates end -->"
# Rates of devices with fixed rates; other devices take all.
OFFERED = {"mark10": [10, 25, 250], "esm": [10, 25], "grbl": [10, 25, 100], "zaber": [10, 25, 100]}
NETWORK = {"ati_rdt": "udp:127.0.0.1:49731", "csv over UDP": "udp:127.0.0.1:49732",
           "csv over TCP": "tcp:127.0.0.1:49733", "hbf1 over TCP": "tcp:127.0.0.1:49734"}
PROTOCOLS = ["hbf1", "csv", "mark10", "esm", "grbl", "optoforce", "zaber", *NETWORK]


def spikes(path):
    return [row for row in path.read_text().splitlines() if not row.startswith("#")]


def measure(program, protocol, rate, seconds, folder):
    """The cells of one row."""
    folder = pathlib.Path(folder)
    trace = folder / "trace.csv"
    if not trace.exists():
        press = f"sim:taps?depth_mm=1.5&force_N=0.4534&interval_s=0.5&tap_s=0.12&count={int(2 * seconds) + 20}"
        subprocess.run([program, "record", press, trace], check=True, capture_output=True)
    word = protocol.split()[0]
    command = [program, "simulate-probe", word, "--trace", trace, "--rate-hz", str(rate)]
    command += ["--network", NETWORK[protocol]] if protocol in NETWORK else ["--link", folder / "tty"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as device:
        try:
            uri = device.stdout.readline().strip()
            live, record = folder / "live.csv", folder / "read.csv"
            done = subprocess.run([program, "run", "--probe", uri, "--record", record, "--sink", f"csv:{live}",
                                   "--duration-s", str(seconds), "--json", "--overwrite"],
                                  capture_output=True, text=True)
        finally:
            device.terminate()
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{protocol} at {rate} Hz: {done.stderr}")
    report = json.loads(done.stdout)
    probe = report["probes"][0]
    again = folder / "again.csv"
    subprocess.run([program, "run", "--fast", "--probe", f"replay:{record}", "--sink", f"csv:{again}",
                    "--duration-s", str(seconds), "--overwrite"], check=True, capture_output=True)
    came = probe["samples_in"] - probe["unused"]
    used = 100 * probe["used"] / max(came, 1)
    held = 100 * probe["held_ticks"] / max(report["ticks"], 1)
    same = spikes(live) == spikes(again)
    latency = (report.get("loop") or {}).get("sample_to_spike") or {}
    cells = [protocol, str(rate), str(came), f"{used:.1f}", f"{held:.2f}", f"{report['delay_ms']:.2f}",
             f"{latency.get('p50_us', 0) / 1000:.2f}", str(report["spikes"]), "yes" if same else "no"]
    return cells, used >= 99 and held <= 1 and (same or probe["late"] > 0 or probe["held_ticks"] > 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--only")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    program = os.path.abspath(options.program)
    rows, all_good = [], True
    for protocol in PROTOCOLS:
        if options.only and options.only != protocol:
            continue
        for rate in OFFERED.get(protocol, RATES):
            with tempfile.TemporaryDirectory() as folder:
                cells, good = measure(program, protocol, rate, options.seconds, folder)
            all_good = all_good and good
            rows.append(cells)
            print(*cells, "" if good else "<- missed", sep="  ", file=sys.stderr)
    head = ["protocol", "rate (Hz)", "samples", "used (%)", "ticks held (%)", "delay (ms)",
            "sample to spike, p50 (ms)", "spikes", "replay equal"]
    table = "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])
    print(table)
    if options.write:
        text = README.read_text()
        before, after = text.split(BEGIN)[0], text.split(END)[1]
        README.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}")
    sys.exit(0 if all_good else 1)


if __name__ == "__main__":
    main()
