#!/usr/bin/env python3
"""What [loop] interpolation costs in accuracy: spike times of a press that is sampled at several rates.

usage: tests/devices/interpolation.py PROGRAM [--write]

A press of taps and a slide of 20 kHz gives the spikes as they should be. The same press, sampled at lower
rates, is run with interpolation = "linear" and "hold"; their spikes are matched, neuron by neuron, within
10 ms. Prints a table in Markdown; --write puts it into drivers/clock/README.md between its marks and draws
tools/gallery/interpolation.png.
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import tempfile

import rates

RATES = [47, 97, 243, 487, 970, 1940]  # their samples fall anywhere between two ticks
TRUE_RATE = 20_000
PRESS = "sim:taps?depth_mm=1.8&tap_s=0.2&interval_s=0.4&count=10"
WITHIN_S = 0.01
ROOT = pathlib.Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- interpolation begin -->", "<!-- interpolation end -->"


def spikes(program, folder, rate, how):
    scene, out = folder / "scene.toml", folder / f"{how}-{rate}.csv"
    scene.write_text(f'[loop]\ninterpolation = "{how}"\n')
    subprocess.run([program, "run", scene, "--fast", "--probe", f"{PRESS}&rate_hz={rate}", "--sink", f"csv:{out}"],
                   check=True, capture_output=True)
    return rates.spikes_of(out)


def errors_between(true, found):
    """Time errors in s of the spikes that have a partner, and the share of all that have none."""
    errors, count = [], 0
    for neuron in true.keys() | found.keys():
        left, right = true.get(neuron, []), found.get(neuron, [])
        count += len(left) + len(right)
        i = j = 0
        while i < len(left) and j < len(right):
            error = right[j] - left[i]
            if abs(error) <= WITHIN_S:
                errors.append(error)
                i, j = i + 1, j + 1
            elif error < 0:
                j += 1
            else:
                i += 1
    return errors, 1.0 - 2.0 * len(errors) / count


def measure(program, folder):
    true = spikes(program, folder, TRUE_RATE, "linear")
    rows = []
    for rate in RATES:
        for how in ("linear", "hold"):
            errors, alone = errors_between(true, spikes(program, folder, rate, how))
            size = sorted(abs(error) for error in errors)
            rows.append((how, rate, statistics.mean(errors), statistics.median(size), size[int(0.95 * len(size))],
                         alone))
    return rows


def draw(rows, path):
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.5))
    for how, colour in (("linear", "tab:blue"), ("hold", "tab:orange")):
        mine = [row for row in rows if row[0] == how]
        at = [row[1] for row in mine]
        axes.plot(at, [1e3 * max(row[3], 1e-7) for row in mine], "o-", color=colour, label=f"{how}, median")
        axes.plot(at, [1e3 * max(row[4], 1e-7) for row in mine], "o:", color=colour, label=f"{how}, 95 %")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("samples per second")
    axes.set_ylabel("spike-time error (ms)")
    axes.set_title("The press between two samples: interpolated, or the newest sample held")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=110, bbox_inches="tight")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(os.path.abspath(options.program), pathlib.Path(folder))
    head = ["interpolation", "rate (Hz)", "mean error (ms)", "median absolute error (ms)", "95th percentile (ms)",
            "spikes without partner (%)"]
    cells = [[how, str(rate), f"{1e3 * mean:+.3f}", f"{1e3 * median:.3f}", f"{1e3 * most:.3f}", f"{100 * alone:.1f}"]
             for how, rate, mean, median, most, alone in rows]
    table = "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *cells])
    print(table)
    if options.write:
        rates.write_between(BEGIN, END, table)
        draw(rows, ROOT / "tools" / "gallery" / "interpolation.png")


if __name__ == "__main__":
    main()
