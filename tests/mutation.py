#!/usr/bin/env python3
"""Checks the tests: changes one line of the source at a time and runs the test suites of its folder.

usage: tests/mutation.py [--build build/release] [--only TEXT] [--sample N] [--part K/N] [--quick] [--list]

The changes stand in tests/mutations.txt: a file after "@", then one change a line, "before => after", where "before"
occurs once in the file. A change is killed if the suite fails, stops or exceeds its time; one that does not compile is
not counted. The tests named after the changed file run first, then those that are fast, then the rest. The source is
restored after every change, also after an interruption; a changed file must not have uncommitted edits. Each change builds what
depends on its file, so that a hundred changes take an hour or more: use --sample for a random part, --part 1/2 and 2/2 in
two copies of the repository, and a build with CMAKE_UNITY_BUILD=OFF. The exit code is 1 if fewer than 90 % are killed.

Survivors with a known reason are marked in the list with a following line "# survives: reason".
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SUITES = {
    "core": ["merkel_core_tests"],
    "drivers": ["merkel_drivers_tests", "merkel_files_tests", "merkel_lsl_tests", "merkel_devices_tests"],
    "realtime": ["merkel_realtime_tests", "merkel_realtime_safety_tests"],
}
LEAST_KILLED = 0.9
SLOW_S = 0.3


class Mutation:
    def __init__(self, path, before, after):
        self.path, self.before, self.after, self.reason = path, before, after, ""
        self.folder = path.split("/")[0]

    def __str__(self):
        return f"{self.path}: {self.before}  =>  {self.after}"

    def apply(self, text):
        return text.replace(self.before, self.after)


def mutations():
    found, path = [], None
    for line in (ROOT / "tests/mutations.txt").read_text().splitlines():
        if line.startswith("@ "):
            path = line.removeprefix("@ ")
        elif line.startswith("# survives: "):
            found[-1].reason = line.removeprefix("# survives: ")
        elif " => " in line:
            found.append(Mutation(path, *line.split(" => ", 1)))
    return found


def misplaced(mutation):
    """Why a mutation cannot be applied; none if it can."""
    source = ROOT / mutation.path
    if not source.exists():
        return "there is no such file"
    count = source.read_text().count(mutation.before)
    return None if count == 1 else f"the text occurs {count} times"


def run(command, seconds):
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=seconds).returncode
    except subprocess.TimeoutExpired:
        return None


def builds(build, folder):
    return run(["cmake", "--build", build, "--target", *SUITES[folder]], 3600) == 0


def passes(build, folder, suite, seconds, tests="*", *options):
    program = f"{build}/tests/{folder}/{suite}"
    return run([program, f"--gtest_filter={tests}", "--gtest_fail_fast", "--gtest_brief=1", *options], seconds) == 0


def own_tests(mutation):
    """A filter for the tests of the files that are named after the mutated one; empty if there are none."""
    name = pathlib.Path(mutation.path).stem
    suites = set()
    for file in (ROOT / "tests" / mutation.folder).rglob(f"{name}*_test.cpp"):
        suites.update(re.findall(r"^TEST(?:_[FP])?\((\w+),", file.read_text(), re.MULTILINE))
    return ":".join(f"{suite}.*:*/{suite}.*" for suite in sorted(suites))


def outcome(mutation, build, limits, quick):
    source = ROOT / mutation.path
    text = source.read_text()
    try:
        source.write_text(mutation.apply(text))
        if not builds(build, mutation.folder):
            return "not compiled"
        own = own_tests(mutation)
        stages = [(suite, own) for suite in limits if own]
        stages += [(suite, f"*-{limit.slow}") for suite, limit in limits.items()]
        stages += [(suite, limit.slow) for suite, limit in limits.items() if limit.slow and not quick]
        passed = all(passes(build, mutation.folder, suite, limits[suite].seconds, tests) for suite, tests in stages)
        return "survived" if passed else "killed"
    finally:
        source.write_text(text)


class Limit:
    """What a suite may take, ten times what it takes now and at least a minute, and which of its tests are slow."""

    def __init__(self, build, folder, suite):
        with tempfile.TemporaryDirectory() as work:
            report = f"{work}/report.json"
            if not passes(build, folder, suite, 3600, "*", f"--gtest_output=json:{report}"):
                sys.exit(f"{suite} fails without a mutation")
            suites = json.loads(pathlib.Path(report).read_text())["testsuites"]
        times = {f"{suite['name']}.{test['name']}": float(test["time"].rstrip("s"))
                 for suite in suites for test in suite["testsuite"]}  # fmt: skip
        self.seconds = max(60.0, 10.0 * sum(times.values()))
        self.slow = ":".join(name for name, seconds in times.items() if seconds > SLOW_S)


def limits_of(build, folder):
    if not builds(build, folder):
        sys.exit(f"the suites of {folder} do not build")
    return {suite: Limit(build, folder, suite) for suite in SUITES[folder]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build/release", help="a configured build folder")
    parser.add_argument("--only", default="", help="only mutations that contain this text")
    parser.add_argument("--sample", type=int, help="only this many, chosen at random")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--part", default="1/1", metavar="K/N", help="only every Nth mutation, from the Kth on")
    parser.add_argument("--quick", action="store_true", help="leave out slow tests of other files, which may kill more")
    parser.add_argument("--list", action="store_true", help="check and count the list, and build nothing")
    arguments = parser.parse_args()

    chosen = [each for each in mutations() if arguments.only in str(each)]
    stale = [f"{each}: {why}" for each in chosen if (why := misplaced(each))]
    if stale:
        sys.exit("in tests/mutations.txt, change or remove:\n" + "\n".join(stale))
    if arguments.list:
        for folder in SUITES:
            print(f"{folder}: {sum(each.folder == folder for each in chosen)} mutations")
        return 0
    if arguments.sample is not None and arguments.sample < len(chosen):
        chosen = random.Random(arguments.seed).sample(chosen, arguments.sample)
    part, parts = map(int, arguments.part.split("/"))
    chosen = chosen[part - 1 :: parts]
    changed = run(["git", "diff", "--quiet", "--", *sorted({each.path for each in chosen})], 60)
    if changed != 0:
        sys.exit("commit the edits of these files first: a mutation would be mixed with them")

    limits = {folder: limits_of(arguments.build, folder) for folder in sorted({each.folder for each in chosen})}
    counts = {"killed": 0, "survived": 0, "not compiled": 0}
    try:
        for mutation in chosen:
            result = outcome(mutation, arguments.build, limits[mutation.folder], arguments.quick)
            counts[result] += 1
            reason = f" ({mutation.reason})" if result == "survived" and mutation.reason else ""
            print(f"{result:13}{mutation}{reason}", flush=True)
    finally:
        judged = counts["killed"] + counts["survived"]
        print(f"{counts['killed']} of {judged} killed, {counts['not compiled']} not compiled")
    return 0 if judged > 0 and counts["killed"] >= LEAST_KILLED * judged else 1


if __name__ == "__main__":
    sys.exit(main())
