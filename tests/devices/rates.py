#!/usr/bin/env python3
"""Runs every protocol at every rate, with default settings, on a simulated device.

usage: tests/devices/rates.py PROGRAM [--seconds 10] [--only PROTOCOL] [--from-hz 0] [--to-hz 1e9] [--write]

Devices above 1 kHz run with a tick of 250 us, all others with the scene's default of 1 ms. Rows named "hold" do not
wait for the next sample.

The devices play one trace of slow presses. Its own replay gives the spikes that a perfect device would give; those
of the run are compared with them, neuron by neuron, within one sample period. The device begins to play at a
time of its own: the shift between the two is the one at which the recorded samples fit the trace best.

Prints a table in Markdown; --write puts its rows into the table of drivers/clock/README.md, in the place of earlier ones. Exit 1 where less than
99 % of the samples were used, more than 1 % of the ticks held the last sample, more than 1 % of the spikes have
no partner in the trace's replay, or the replay of what was read gives other spikes.
"""
import argparse
import bisect
import collections
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

RATES = [10, 25, 100, 250, 1000]
FAST_RATES = [4000, 8000]
FAST_TICK_US = 250
README = pathlib.Path(__file__).resolve().parents[2] / "drivers" / "clock" / "README.md"
BEGIN, END = "<!-- rates begin -->", "<!-- rates end -->"
HEAD = ["protocol", "rate (Hz)", "samples", "used (%)", "ticks held (%)", "delay (ms)", "sample to spike, p50 (ms)", "p99 (ms)",
        "spikes", "match the trace (%)", "match a perfect device (%)", "replay equal"]
# Rates of devices with fixed rates; other devices take all.
OFFERED = {"mark10": [10, 25, 250], "esm": [10, 25], "grbl": [10, 25, 100], "optoforce": [10, 100, 1000],
           "zaber": [10, 25, 100], "hbf1 hold": [1000, 4000], "ati_rdt hold": [1000, 4000]}
OFFERED |= {protocol: RATES + FAST_RATES for protocol in ("hbf1", "csv", "ati_rdt", "csv over UDP", "hbf1 over TCP")}
NETWORK = {"ati_rdt": "udp:127.0.0.1:29731", "ati_rdt hold": "udp:127.0.0.1:29731", "csv over UDP": "udp:127.0.0.1:29732",
           "csv over TCP": "tcp:127.0.0.1:29733", "hbf1 over TCP": "tcp:127.0.0.1:29734"}
PROTOCOLS = ["hbf1", "csv", "mark10", "esm", "grbl", "optoforce", "zaber", "hbf1 hold", *NETWORK]


# Straight lines between corners, which samples of any rate hit but for the corners: s, share of the full press.
CORNERS = [(0.0, 0.0), (0.3, 0.0), (0.8, 1.0), (1.4, 1.0), (1.9, 0.0), (2.4, 0.0)]
INTERVAL_S = CORNERS[-1][0]
DEPTH_MM, FORCE_N = 2.5, 0.9755
# Of the readings: N for gauges, mm for stages.
RESOLUTION = {"optoforce": 1 / 1024, "mark10": 0.0001, "esm": 0.0001, "grbl": 0.001, "zaber": 1 / 1024}
EDGE_S = 0.3  # left out at both ends of a run


def rows_of(path):
    return [row for row in path.read_text().splitlines() if not row.startswith("#")]


def samples_of(path, press=None):
    """Times and presses: in N where there is a force, else in mm."""
    rows = list(csv.DictReader(rows_of(path)))
    press = press or ("force_N" if "force_N" in rows[0] else "depth_mm")
    return press, [float(row["time_s"]) for row in rows], [float(row[press]) for row in rows]


def spikes_of(path):
    by_neuron = collections.defaultdict(list)
    for row in rows_of(path)[1:]:
        time, neuron = row.split(",")
        by_neuron[neuron].append(float(time))
    return by_neuron


def press_at(time):
    for (before, low), (after, high) in zip(CORNERS, CORNERS[1:]):
        if time <= after:
            return low + (high - low) * (time - before) / (after - before)
    return 0.0


def write_trace(path, seconds):
    rows = ["time_s,depth_mm,force_N"]
    for k in range(int(1000 * seconds)):
        share = press_at(k % int(1000 * INTERVAL_S) / 1000)
        rows.append(f"{k / 1000:.3f},{DEPTH_MM * share:.6f},{FORCE_N * share:.6f}")
    path.write_text("\n".join(rows) + "\n")


def shift_between(record, trace):
    """Time in the record less time in the trace: the trace repeats every INTERVAL_S."""
    times, values = record
    step = max(len(times) // 150, 1)
    points = list(zip(times[::step], values[::step]))
    at, of_trace = trace

    def misfit(shift):
        total = 0.0
        for time, value in points:
            i = min(max(bisect.bisect_right(at, time - shift), 1), len(at) - 1)
            share = (time - shift - at[i - 1]) / (at[i] - at[i - 1])
            total += (of_trace[i - 1] + share * (of_trace[i] - of_trace[i - 1]) - value) ** 2
        return total

    coarse = min((-k * 0.004 for k in range(int(INTERVAL_S / 0.004))), key=misfit)
    return min((coarse + k * 0.0001 for k in range(-60, 61)), key=misfit)


def without_partner(spikes, others, period, begin, end):
    """How many spikes between two times have no partner within a period, and how many there are."""
    alone = count = 0
    for neuron, times in spikes.items():
        free = list(others.get(neuron, []))
        for time in times:
            i = bisect.bisect_left(free, time - period)
            partner = i < len(free) and free[i] <= time + period
            if partner:
                del free[i]
            if begin <= time <= end:
                count += 1
                alone += not partner
    return alone, count


def as_measured(trace, read, shift, resolution):
    """What a perfect device with this resolution reads of the trace at the times of `read`."""
    at, of_trace = trace
    times, _ = read
    values = []
    for time in times:
        i = min(max(bisect.bisect_right(at, time - shift), 1), len(at) - 1)
        share = (time - shift - at[i - 1]) / (at[i] - at[i - 1])
        value = of_trace[i - 1] + share * (of_trace[i] - of_trace[i - 1])
        values.append(round(value / resolution) * resolution if resolution else value)
    return times, values


def started_at(time):
    """The comments of a trace whose run began at this time, s."""
    return f"# time_offset_ns=0\n# start_device_ns={round(1e9 * time)}\n"


def same_spikes(live, others, period, seconds):
    """Per cent of the spikes of both that have a partner in the other."""
    window = (EDGE_S, seconds - EDGE_S)
    alone, count = map(sum, zip(without_partner(live, others, period, *window),
                                without_partner(others, live, period, *window)))
    return 100.0 * (1.0 - alone / count) if count else 0.0


def measure(program, protocol, rate, seconds, folder):
    """The cells of one row, and whether they are good."""
    folder = pathlib.Path(folder)

    def merkel(*arguments, check=True):
        return subprocess.run([program, *map(str, arguments)], check=check, capture_output=True, text=True)

    scene = folder / "scene.toml"
    tick_us = FAST_TICK_US if rate > 1000 else 1000
    scene.write_text(f'preset = "paper"\n[loop]\ntick_us = {tick_us}\n'
                     f'interpolation = "{"hold" if protocol.endswith("hold") else "linear"}"\n')
    trace = folder / "trace.csv"
    write_trace(trace, seconds + 10)
    word = protocol.split()[0]
    command = [program, "simulate-probe", word, "--trace", trace, "--rate-hz", str(rate)]
    command += ["--network", NETWORK[protocol]] if protocol in NETWORK else ["--link", folder / "tty"]
    names = ("live.csv", "read.csv", "again.csv", "ideal.csv", "perfect.csv")
    live, record, again, ideal, perfect = (folder / name for name in names)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as device:
        try:
            uri = device.stdout.readline().strip()
            done = merkel("run", scene, "--probe", uri, "--record", record, "--sink", f"csv:{live}",
                          "--duration-s", seconds, "--json", "--overwrite", check=False)
        finally:
            device.terminate()
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{protocol} at {rate} Hz: {done.stderr}")
    report = json.loads(done.stdout)
    probe = report["probes"][0]
    merkel("run", scene, "--fast", "--probe", f"replay:{record}", "--sink", f"csv:{again}", "--duration-s", seconds)
    press, *read = samples_of(record)
    _, *played = samples_of(trace, press)
    shift = shift_between(read, played)
    # On the ticks of the run.
    trace.write_text(started_at(-(shift % (1e-6 * tick_us))) + trace.read_text())
    merkel("run", scene, "--fast", "--probe", f"replay:{trace}?use={press.split('_')[0]}", "--sink", f"csv:{ideal}")
    spikes = spikes_of(live)
    moved = {neuron: [time + shift for time in times] for neuron, times in spikes_of(ideal).items()}
    as_trace = same_spikes(spikes, moved, 1.0 / rate, seconds)
    rows = [f"time_s,{press}"]
    rows += [f"{time:.9f},{value:.9f}"
             for time, value in zip(*as_measured(played, read, shift, RESOLUTION.get(protocol)))]
    perfect.write_text(started_at(0) + "\n".join(rows) + "\n")
    merkel("run", scene, "--fast", "--probe", f"replay:{perfect}", "--sink", f"csv:{ideal}", "--overwrite")
    as_perfect = same_spikes(spikes, spikes_of(ideal), 1.0 / rate, seconds)
    came = probe["samples_in"] - probe["unused"]
    used = 100 * probe["used"] / max(came, 1)
    held = 100 * probe["held_ticks"] / max(report["ticks"], 1)
    same = rows_of(live) == rows_of(again)
    latency = (report.get("loop") or {}).get("sample_to_spike") or {}
    cells = [protocol, str(rate), str(came), f"{used:.1f}", f"{held:.2f}", f"{report['delay_ms']:.2f}",
             f"{latency.get('p50_us', 0) / 1000:.2f}", f"{latency.get('p99_us', 0) / 1000:.2f}", str(report["spikes"]), f"{as_trace:.1f}",
             f"{as_perfect:.1f}", "yes" if same else "no"]
    exact = same or probe["late"] > 0 or probe["held_ticks"] > 0
    return cells, used >= 99 and held <= 1 and as_perfect >= 99 and exact


def table_of(rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in [HEAD, ["---"] * len(HEAD), *rows])


def write_row(cells):
    """Puts a row into the table of drivers/clock/README.md, in the place of an earlier one."""
    lines = README.read_text().split(BEGIN)[1].split(END)[0].strip().splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    rows = [row for row in rows if row[:2] != cells[:2]] + [cells]
    rows.sort(key=lambda row: (PROTOCOLS.index(row[0]), int(row[1])))
    write_between(BEGIN, END, table_of(rows))


def write_between(begin, end, table):
    """Puts a table into drivers/clock/README.md between two marks."""
    text = README.read_text()
    before, after = text.split(begin)[0], text.split(end)[1]
    README.write_text(f"{before}{begin}\n{table}\n{end}{after}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--only")
    parser.add_argument("--from-hz", type=float, default=0)
    parser.add_argument("--to-hz", type=float, default=1e9)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    program = os.path.abspath(options.program)
    rows, all_good = [], True
    for protocol in PROTOCOLS:
        if options.only and options.only != protocol:
            continue
        for rate in OFFERED.get(protocol, RATES):
            if not options.from_hz <= rate <= options.to_hz:
                continue
            with tempfile.TemporaryDirectory() as folder:
                cells, good = measure(program, protocol, rate, options.seconds, folder)
            all_good = all_good and good
            rows.append(cells)
            print(*cells, "" if good else "<- missed", sep="  ", file=sys.stderr)
            if options.write:
                write_row(cells)
    print(table_of(rows))
    sys.exit(0 if all_good else 1)


if __name__ == "__main__":
    main()
