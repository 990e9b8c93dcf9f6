#!/usr/bin/env python3
"""What two scenes cost beside each other: processor time of `merkel run --fast`, in pairs that take turns.

usage: paired_cost.py [MERKEL [PAIRS [OTHER]]]

Each pair runs both scenes for a short and for a long time; the difference is the cost of the loop without the start.
With OTHER, a program built in another way or from another commit, the same scenes run in both programs. Prints the median of the ratios and their range.
"""
import os
import resource
import statistics
import subprocess
import sys
import tempfile

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "build/release/merkel"
PAIRS = int(sys.argv[2]) if len(sys.argv) > 2 else 5
PRESS = "sim:sine?depth_mm=1.5&amplitude_mm=0.3&frequency_hz=5&hold_s=200"
REST = "sim:ramp?depth_mm=1.5&wait_s=200"

# name: (scene, seconds short and long, limit) of the first and what it is compared with
COMPARISONS = {
    "exact layer / half-space": (
        f'preset = "paper"\n[probe]\nuri = "{PRESS}"\n[skin]\nthickness_mm = 4\n',
        f'preset = "paper"\n[probe]\nuri = "{PRESS}"\n', 1.5),
    "exact layer / half-space, afferents of goodwin": (
        f'preset = "goodwin"\n[probe]\nuri = "{PRESS}"\n[skin]\nthickness_mm = 4\n',
        f'preset = "goodwin"\n[probe]\nuri = "{PRESS}"\n', 1.5),
    "goodwin at rest / pressed": (
        f'preset = "goodwin"\n[probe]\nuri = "{REST}"\n', f'preset = "goodwin"\n[probe]\nuri = "{PRESS}"\n', 0.05),
}
if len(sys.argv) > 3:
    PROGRAM = (sys.argv[1], sys.argv[3])
    COMPARISONS = {f"{preset}, {tip}, this program / the other": (scene, scene, limit) for preset, tip, limit, scene in (
        (preset, tip, limit, f'preset = "{preset}"\n[probe]\nuri = "{PRESS}"\ntip = "{tip}"\n')
        for preset, tip, limit in (("paper", "sphere", 1.01), ("goodwin", "sphere", 1.01), ("goodwin", "pin", 1.05)))}
else:
    PROGRAM = (PROGRAM, PROGRAM)
SHORT_S, LONG_S = 2, 42


def processor_time(program, scene, seconds):
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    subprocess.run([program, "run", scene, "--fast", "--duration-s", str(seconds)],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return used() - before


def loop_cost(program, scene):
    """Processor time of the loop, ms for each simulated second."""
    return 1e3 * (processor_time(program, scene, LONG_S) - processor_time(program, scene, SHORT_S)) / (LONG_S - SHORT_S)


def main():
    print("| costs | ms a simulated second | ratio, median (range) | at most |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (first, second, limit) in COMPARISONS.items():
            files = []
            for text in (first, second):
                files.append(os.path.join(folder, f"{len(os.listdir(folder))}.toml"))
                with open(files[-1], "w", encoding="utf-8") as file:
                    file.write(text)
            costs = [[loop_cost(*of) for of in zip(PROGRAM, files)] for _ in range(PAIRS)]
            ratios = sorted(a / b for a, b in costs)
            middle = [statistics.median(column) for column in zip(*costs)]
            print(f"| {name} | {middle[0]:.2f} / {middle[1]:.2f} | {statistics.median(ratios):.3f} "
                  f"({ratios[0]:.3f} to {ratios[-1]:.3f}) | {limit:g} |")


if __name__ == "__main__":
    main()
