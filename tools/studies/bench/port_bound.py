#!/usr/bin/env python3
"""Counts the operations of a neuron step that occupy the multiplier ports of a core.

usage: tools/studies/bench/port_bound.py OBJECT           prints the instructions by class, stage by stage
       tools/studies/bench/port_bound.py OBJECT --write   writes port_bound.inc, which `merkel bench` reads
OBJECT is the compiled default kernel of a release build for x86-64:
build/release/core/CMakeFiles/merkel_core.dir/neurons/hodgkin_huxley/kernel/one_step.cpp.o

The stages of the kernel are loops over a few vectors. The instructions of each loop are counted in the
disassembly (objdump of binutils). Multiplications and fused multiply-adds can only go to the two
multiplier ports: a step takes at least the time of these. Additions, comparisons, loads and divisions
go to other ports or units of AMD's cores.
"""
import pathlib
import re
import subprocess
import sys

# Stage, and number of vectors per iteration of its loop.
STAGES = {"find_exponentials": 4, "find_gate_steps": 2, "take_gate_steps": 2, "step_gates": 2, "step_potentials": 2}
CLASSES = {
    "multiply": r"v(fn?m(add|sub)|mul)\w*[ps]",
    "divide": r"vdiv",
    "add": r"v(add|sub)[ps]",
    "compare": r"v(min|max|cmp|blend|and|or|xor|pcmp|ptest|test)\w*|k\w+",
    "move": r"v?mov\w*|vbroadcast\w*",
}


def functions(obj):
    text = subprocess.run(["objdump", "-d", "-C", "--no-show-raw-insn", obj], check=True, capture_output=True, text=True)
    for block in text.stdout.split("\n\n"):
        lines = block.strip().splitlines()
        head = re.match(r"[0-9a-f]+ <(.*)>:", lines[0]) if lines else None
        if head is None:
            continue
        code = []
        for line in lines[1:]:
            found = re.match(r"\s*([0-9a-f]+):\s+(?:notrack )?(\S+)\s*(.*)", line)
            if found:
                code.append((int(found[1], 16), found[2], re.sub(r"\s*[#<].*", "", found[3])))
        yield head[1], code


def main_loop(code):
    """The innermost loop with the most multiplications."""
    place = {address: i for i, (address, _, _) in enumerate(code)}
    loops = set()
    for i, (address, name, operand) in enumerate(code):
        if name.startswith("j") and re.fullmatch("[0-9a-f]+", operand) and int(operand, 16) <= address:
            if int(operand, 16) in place:
                loops.add((place[int(operand, 16)], i))
    kept = []
    for a, b in sorted(loops, key=lambda loop: loop[1] - loop[0]):
        # A loop around a kept one, or the jump back from separate code for rare cases.
        if not any(a <= d and c <= b for c, d in kept):
            kept.append((a, b))
    return max((code[a : b + 1] for a, b in kept), key=lambda body: count(body)["multiply"], default=None)


def count(body):
    return {kind: sum(1 for _, name, _ in body if re.match(pattern, name)) for kind, pattern in CLASSES.items()}


def stages(obj):
    """(target, precision, stage) → instructions of each class per vector."""
    found = {}
    for name, code in functions(obj):
        head = re.match(r".*?N_(AVX2|AVX3)::StagedStep<.*?OneStep<true, false, .*?Simd<(double|float)", name)
        stage = re.search(r">::(\w+)\(", name)
        if not head or not stage or stage[1] not in STAGES:
            continue
        body = main_loop(code)
        if body is None:
            continue
        vectors = STAGES[stage[1]]
        counts = {kind: n / vectors for kind, n in count(body).items()}
        found[head[1], head[2], stage[1]] = counts | {"all": len(body) / vectors}
    return found


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--write"]):
        sys.exit(__doc__)
    found = stages(sys.argv[1])
    if not found:
        sys.exit(f"{sys.argv[1]} does not contain the stages of the kernel: is it one_step.cpp.o of a release build for x86-64?")
    print(f"{'target':6} {'':6} {'stage':18}" + "".join(f"{kind:>9}" for kind in [*CLASSES, "all"]) + "  instructions per vector")
    totals = {}
    for (target, precision, stage), counts in sorted(found.items()):
        print(f"{target:6} {precision:6} {stage:18}" + "".join(f"{n:9.1f}" for n in counts.values()))
        total = totals.setdefault((target, precision), dict.fromkeys(counts, 0.0))
        for kind, n in counts.items():
            total[kind] += n
    for (target, precision), total in sorted(totals.items()):
        print(f"{target:6} {precision:6} {'a step':18}" + "".join(f"{n:9.1f}" for n in total.values()))
    if sys.argv[2:]:
        rows = {p: totals["AVX2", p]["multiply"] for p in ["double", "float"]}
        out = pathlib.Path(__file__).with_name("port_bound.inc")
        out.write_text(
            "// Written by tools/studies/bench/port_bound.py from the compiled kernel: multiplications and fused\n"
            "// multiply-adds per step of a vector of neurons, without a network.\n"
            + "".join(f"{{Precision::k{p.capitalize()}, {n:g}}},\n" for p, n in rows.items())
        )


if __name__ == "__main__":
    main()
