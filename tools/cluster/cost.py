"""Processor time of each preset: cost.py [MERKEL] prints core-seconds per simulated second and per start.

The press is taps of 1 mm, two a second. Two runs of different length separate the start from the time that grows."""
import resource
import subprocess
import sys

program = sys.argv[1] if len(sys.argv) > 1 else "merkel"
SHORT_S, LONG_S, REPEATS = 2, 12, 3


def core_seconds(preset, duration_s):
    probe = f"sim:taps?depth_mm=1&count={2 * duration_s + 2}"
    probes = [word for _ in range(6 if preset == "hand" else 1) for word in ("--probe", probe)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "run", preset, "--fast", *probes, "--duration-s", str(duration_s)], check=True,
                   stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


print("| preset | core-seconds per simulated second | core-seconds of a start |\n|---|---|---|")
for preset in ("paper", "goodwin", "finger", "hand"):
    short, long = (min(core_seconds(preset, duration_s) for _ in range(REPEATS)) for duration_s in (SHORT_S, LONG_S))
    slope = (long - short) / (LONG_S - SHORT_S)
    print(f"| `{preset}` | {slope:.3f} | {short - slope * SHORT_S:.2f} |", flush=True)
