#!/usr/bin/env python3
"""Golden spike files: what every preset, neuron, method and contact law makes of the bundled traces.

usage: tests/golden/golden.py PROGRAM           compares; exit 1 where a spike differs
       tests/golden/golden.py PROGRAM --write   writes the files anew
       tests/golden/golden.py PROGRAM --only paper   compares the cases whose name contains "paper"

Each file begins with the command that made it. Spikes must be the same to the last digit: results depend
neither on the machine nor on the vector width nor on the number of threads.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TRACES = HERE.parent / "traces"
NAMES = ["ramp_and_hold", "taps", "slide", "faulty"]
METHODS = ["forward_euler", "exponential_euler", "backward_euler", "rush_larsen", "crank_nicolson", "heun", "rk4",
           "staggered_multistep"]
LATTICE = '[receptors]\nplacement = "lattice"\n'
FIELDS = '[skin]\nradius_mm = 7\n[receptors]\nlayout = "fields"\ndensity_per_mm2 = 0.2\ndensity_min_per_mm2 = 0.1\n'


def cases():
    """(name, scene, trace): a preset's name, or the text of a scene."""
    for preset in ["paper", "paper-wide", "goodwin", "finger", "hand"]:
        for trace in NAMES:
            yield f"{preset}.{trace}", preset, trace
    for method in METHODS:
        for precision in ["double", "float"]:
            yield (f"{method}-{precision}.taps", f'[neuron]\nmethod = "{method}"\nprecision = "{precision}"\n', "taps")
    yield ("integrate_and_fire-spread.taps",
           f'{FIELDS}[afferent]\ngain_spread = 0.2\n[neuron]\nkind = "integrate_and_fire"\nnoise = 0.5\nseed = 3\n', "taps")
    yield "no-network.taps", LATTICE + "[network]\ngain = 0\n", "taps"
    yield "never-frozen.ramp_and_hold", "[accuracy]\nfreeze_resting = false\ncull_tolerance = 0\n", "ramp_and_hold"
    yield "threads.slide", 'preset = "goodwin"\n[loop]\nthreads = 2\n', "slide"
    yield "pin.taps", LATTICE + '[probe]\ntip = "pin"\ndiameter_mm = 1\n', "taps"
    yield "bars.taps", LATTICE + '[probe]\ntip = "bars"\n', "taps"
    yield "thin-skin.taps", "[skin]\nthickness_mm = 4\n", "taps"
    yield "sneddon-full.taps", '[skin]\ncontact_law = "sneddon"\nenergy_density = "full"\n', "taps"


def command(program, scene, trace):
    return [program, "run", scene, "--probe", f"replay:{trace}?use=depth", "--fast"]


def one_finger(program):
    """The preset hand with the first of its probes: a trace presses one patch."""
    text = subprocess.run([program, "scene", "hand"], capture_output=True, text=True, check=True).stdout
    first, *others = text.split("[[probe]]")[1:]
    rest = others[-1].partition("\n[")
    return text[:text.index("[[probe]]")] + "[[probe]]" + first + "\n" + rest[1] + rest[2]


def spikes(program, scene, trace):
    """The rows of the spike file, as text, and the command as a reader of the file would write it."""
    path = TRACES / f"{trace}.csv"
    with tempfile.TemporaryDirectory() as folder:
        named = scene
        text = one_finger(program) if scene == "hand" else scene
        if "\n" in text:
            named = f"{folder}/scene.toml"
            pathlib.Path(named).write_text(text)
        out = f"{folder}/spikes.csv"
        done = subprocess.run([*command(program, named, path), "--sink", f"csv:{out}"], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        rows = [row for row in pathlib.Path(out).read_text().splitlines() if not row.startswith("#")]
    shown = " ".join(command("merkel", "scene.toml" if "\n" in scene else scene, f"tests/traces/{trace}.csv"))
    lines = [f"# {shown} --sink csv:spikes.csv"]
    if "\n" in scene:
        lines += ["# scene.toml:"] + [f"#   {line}" for line in scene.strip().splitlines()]
    return lines, rows


def difference(wanted, got):
    """What differs first, as a sentence; none where nothing does."""
    for number, (a, b) in enumerate(zip(wanted, got)):
        if a != b:
            return f"row {number} is {b}, not {a}"
    return None if len(wanted) == len(got) else f"{len(got) - 1} spikes, not {len(wanted) - 1}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    differ = 0
    chosen = [case for case in cases() if options.only in case[0]]
    for name, scene, trace in chosen:
        comment, rows = spikes(options.program, scene, trace)
        file = HERE / f"{name}.csv"
        if options.write:
            file.write_text("\n".join(comment + rows) + "\n")
            continue
        kept = [row for row in file.read_text().splitlines() if not row.startswith("#")]
        if (found := difference(kept, rows)) is not None:
            differ += 1
            print(f"{file.name}: {found}")
    print(f"{len(chosen)} golden files, {differ} differ")
    return 1 if differ or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
