#!/usr/bin/env python3
"""Checks the tests: draws small changes of the source at random, makes one at a time, and runs the tests of its folder.

usage: tests/mutation.py PATH… [--sample N] [--seed S] [--build build/release] [--part K/N] [--list]

PATH is a source file, or a folder for its .cpp files. Each place where an operator, a bound, a constant or a condition can be exchanged, or a statement
left out, is a candidate; --sample draws N of them from a seed, without it all are made. A change is killed if a test fails, stops or
lasts 20 times as long as without it; a change that does not compile is not counted. The tests named after the changed file run first. The source is
restored after every change, also after an interruption; a changed file must not have uncommitted edits. The exit code is 1 if fewer
than 90 % are killed.

Each change builds what depends on its file: use a build folder of its own, built completely, with -DCMAKE_UNITY_BUILD=OFF, and
--part 1/2 and 2/2 in two copies of the repository. Changes without an effect that a test could see are listed with their reasons
in tests/equivalent_mutations.txt, as this program prints them, and are not made.
"""
import argparse
import collections
import pathlib
import random
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
EQUIVALENT = ROOT / "tests/equivalent_mutations.txt"
LEAST_KILLED = 0.9
SLOWER = 20
LEAST_S = 10
# The longest matching folder decides: what is built, and which tests run.
SUITES = {
    "core/encoding": (["merkel_encoding_tests"], "^encoding/"),
    "core": (["merkel_core_tests", "merkel_encoding_tests"], "^(core|encoding)/"),
    "drivers": (["merkel_drivers_tests", "merkel_files_tests", "merkel_devices_tests", "merkel_lsl_tests", "merkel_comedi_tests"],
                "^(drivers|files|devices|lsl|comedi)/"),
    "drivers/sinks/view": (["merkel", "merkel_drivers_tests"], "^(drivers/|readers/view)"),
    "realtime": (["merkel_realtime_tests", "merkel_realtime_safety_tests"], "^realtime(_safety)?/"),
    "tools/studies/reference": (["merkel_core_tests", "merkel_tools_tests"], "^(core|tools)/"),
    "tools": (["merkel", "merkel_python", "merkel_tools_tests", "merkel_attack_tests"], "^(tools|python|readers|attack)/"),
}
OPERATORS = [(r" <= ", " < "), (r" < ", " <= "), (r" >= ", " > "), (r" > ", " >= "), (r" == ", " != "), (r" != ", " == "),
             (r" && ", " || "), (r" \|\| ", " && "), (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "),
             (r" \+= ", " -= "), (r" -= ", " += "), (r" \*= ", " /= "), (r" \? ", " ? !"), (r"\+\+(?=\w)", "--"), (r"--(?=\w)", "++"),
             (r"\bstd::min\b", "std::max"), (r"\bstd::max\b", "std::min"), (r"\btrue\b", "false"), (r"\bfalse\b", "true"),
             (r"\bif \(", "if (!"), (r"(?<=[(& |])!(?=[\w(])", ""), (r"\bany_of\b", "all_of"), (r"\ball_of\b", "any_of"),
             (r"\bceil\b", "floor"), (r"\bfloor\b", "ceil"), (r"\.front\(\)", ".back()"), (r"\.back\(\)", ".front()")]  # fmt: skip
NUMBER = re.compile(r"(?<![\w.'\"])(\d+(?:\.\d+)?(?:e-?\d+)?)(?![\w.'\"])")
STATEMENT = re.compile(r"^\s+(?!return\b|using\b|const\b|constexpr\b|static\b|case\b|default\b|auto\b|double\b|std::\w+ \w+|bool\b|#)"
                       r"[\w\[\]().*:>&+-]+.*;$")  # fmt: skip

Mutation = collections.namedtuple("Mutation", "path line before after")


def described(mutation):
    return f"{mutation.path}: {mutation.before.strip()} => {mutation.after.strip() or '(left out)'}"


def code_of(line):
    """The line with comments and the content of texts blanked, so that places in it are places in the line."""
    line = re.sub(r'"(?:\\.|[^"\\])*"', lambda text: '"' + " " * (len(text.group()) - 2) + '"', line)
    return re.sub(r"//.*", lambda comment: " " * len(comment.group()), line)


def closed(text):
    return text.count("(") == text.count(")") and text.count("{") == text.count("}")


def candidates(path):
    for number, line in enumerate((ROOT / path).read_text().splitlines()):
        code = code_of(line)
        # Rows of parameters are compared with tools/scene/README.md by a test of their own.
        if not code.strip() or code.startswith(("#", "namespace", "using", "static_assert", "template", '      {"')):
            continue
        changed = set()
        for pattern, replacement in OPERATORS:
            for found in re.finditer(pattern, code):
                changed.add(line[: found.start()] + replacement + line[found.end() :])
        if "if (" in code and closed(code[code.index("if (") :]):  # the negation needs its own parentheses
            begin, depth = code.index("if (") + 3, 0
            for end in range(begin, len(code)):
                depth += {"(": 1, ")": -1}.get(code[end], 0)
                if depth == 0:
                    changed.add(f"{line[:begin]}(!{line[begin:end + 1]}){line[end + 1:]}")
                    break
        changed = {each for each in changed if not re.search(r"if \(!\w+ (==|!=|<|>|&&|\|\|)", each) or "if (!(" in each}
        for found in NUMBER.finditer(code):
            value = found.group()
            other = str(int(value) + 1) if value.isdigit() else ("1.0" if float(value) == 0 else repr(float(value) * 1.25))
            changed.add(line[: found.start()] + other + line[found.end() :])
        if STATEMENT.match(code) and closed(code):
            changed.add("")
        elif (only := re.match(r"(\s+if \(.*\)) (?:continue|break);$", code)) and closed(only.group(1)):
            changed.add("")
        yield from (Mutation(path, number, line, each) for each in sorted(changed) if each != line)


def sources(paths):
    for path in paths:
        whole = ROOT / path
        files = [whole] if whole.is_file() else sorted(whole.rglob("*.cpp"))
        yield from (str(file.relative_to(ROOT)) for file in files)


def suites_of(path):
    return SUITES[max((folder for folder in SUITES if path.startswith(folder + "/")), key=len)]


def run(command, seconds):
    try:
        return subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=seconds).returncode
    except subprocess.TimeoutExpired:
        return None


def builds(build, path):
    return run(["cmake", "--build", build, "--target", *suites_of(path)[0]], 3600) == 0


def passes(build, path, most_s=3600):
    """Whether all tests pass in time; those of files named after the changed one go first."""
    own = set()
    for file in (ROOT / "tests" / path.split("/")[0]).rglob(f"{pathlib.Path(path).stem}*_test.cpp"):
        own.update(re.findall(r"^TEST(?:_[FP])?\((\w+),", file.read_text(), re.MULTILINE))
    suite = suites_of(path)[1]
    chosen = [rf"{suite}(.*/)?({'|'.join(sorted(own))})\."] if own else []
    return all(run(["ctest", "--test-dir", build, "--stop-on-failure", "-j", "2", "-R", each], most_s) == 0 for each in [*chosen, suite])


def outcome(mutation, build, most_s):
    source = ROOT / mutation.path
    text = source.read_text()
    lines = text.split("\n")
    lines[mutation.line] = mutation.after
    try:
        source.write_text("\n".join(lines))
        if not builds(build, mutation.path):
            return "not compiled"
        return "survived" if passes(build, mutation.path, most_s) else "killed"
    finally:
        source.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", metavar="PATH", help="source files or folders")
    parser.add_argument("--build", default="build/release", help="a configured build folder")
    parser.add_argument("--sample", type=int, help="only this many, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="of the drawing")
    parser.add_argument("--part", default="1/1", metavar="K/N", help="only every Nth change, from the Kth on")
    parser.add_argument("--list", action="store_true", help="print the changes, and make none")
    arguments = parser.parse_args()

    known = [line.split(" # ")[0] for line in EQUIVALENT.read_text().splitlines()] if EQUIVALENT.exists() else []
    chosen = [each for path in sources(arguments.paths) for each in candidates(path)]
    gone = set(known) - {described(each) for each in chosen}
    if gone := [each for each in gone if (ROOT / each.split(": ")[0]).is_file() and each.split(": ")[0] in set(sources(arguments.paths))]:
        sys.exit("in tests/equivalent_mutations.txt, remove what no longer occurs:\n" + "\n".join(gone))
    chosen = [each for each in chosen if described(each) not in known]
    print(f"{len(chosen)} changes, and {len(known)} without an effect")
    random.Random(arguments.seed).shuffle(chosen)
    chosen = chosen[: arguments.sample]
    part, parts = map(int, arguments.part.split("/"))
    chosen = chosen[part - 1 :: parts]
    if arguments.list:
        print("\n".join(map(described, chosen)))
        return 0
    changed = sorted({each.path for each in chosen})
    if run(["git", "diff", "--quiet", "--", *changed], 60) != 0:
        sys.exit("commit the edits of these files first: a change would be mixed with them")
    most_s = {}
    for suites, path in {suites_of(path)[1]: path for path in changed}.items():
        built = builds(arguments.build, path)
        begin = time.monotonic()
        if not built or not passes(arguments.build, path):
            sys.exit(f"the tests of {path} fail without a change: build all of {arguments.build} first; then ctest names the failing one")
        most_s[suites] = max(LEAST_S, SLOWER * (time.monotonic() - begin))
    counts = collections.Counter()
    try:
        for mutation in chosen:
            result = outcome(mutation, arguments.build, most_s[suites_of(mutation.path)[1]])
            counts[result] += 1
            print(f"{result:13}{described(mutation)}", flush=True)
    finally:
        judged = counts["killed"] + counts["survived"]
        print(f"{counts['killed']} of {judged} killed, {counts['not compiled']} not compiled")
    return 0 if judged > 0 and counts["killed"] >= LEAST_KILLED * judged else 1


if __name__ == "__main__":
    sys.exit(main())
