#!/usr/bin/env python3
"""What merkel makes of what a device sends: readings.py PROGRAM [--write README.md | --check README.md] [--part K/N] [--thin] [WORD]

Runs the program on each case of cases.toml whose title contains WORD, or on every Nth of them from the Kth on, checks what it
reads and says, and prints the cases as a Markdown table. --thin: of a case that is sent in two ways, one, and no long case. A case has

  title   what a device does
  sent    what it sends, as the table shows it
  send    lines and how often each is sent, [["time_ms,force_N"], ["{ms},0.3", 500]]; the last one again without end. In a
          line, {ms} and {s} are the time, {ramp A B} rises from A to B over the step, {= EXPRESSION} is a Python expression
          of the time t in s, {12x0.5} is twelve times 0.5 between commas (in {12xp#_kPa}, # is the number from 1), 0.5~ is
          0.5 with noise of ±0.02 that is the same in every run, 0.5~0.002 has normal noise, and 0.5? is nan once in ten;
          ["<close>"] closes the connection
  step_ms from one line to the next, 1 if not set
  repeat  all lines again and again instead of the last one
  via     "tcp": a line every millisecond over loopback (the default); "stream": over loopback as fast as the program reads
          them, on the times of the lines (live=0); "file": a trace; ["file", "stream"]: both
  options of the protocol csv: "columns=force_N"; without them, merkel connect is given the bare address
  files   files beside the scene, {"gauge.toml" = "…"}
  probes  a part of its URI for each probe, ["#thumb_N", "#palm_N"]
  scene   a scene instead, in which URI stands for the device; ELECTRODE for one on the fingertip
  press_N the force without drift and noise, as an expression of t: PressMeasures are values of reads ("press.spikes")
  zeros   true: "zeros.3" in reads is the last zero of the fourth taxel in the session, in kPa
  run     arguments instead of "run --duration-s S --json", with URI, SCENE and OUT (a file)
  seconds S, 1.5 if not set
  long    true: ten minutes, like another case
  reads   a name and where its value is in the output of --json: {"thumb, N" = "probes.0.deepest_press.force_N"}
  values  these values, within 3 %; "≤ 15": at most that; 0: exactly
  says    sentences that it prints, as the table shows them; "…" stands for anything
  not     texts that it must not print
"""
import csv
import itertools
import json
import math
import pathlib
import random
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
BATCH = 5  # lines that are sent at once

ELECTRODE = """
[[electrode]]
name = "linear"
field_mm = [15, 10, 4]
encoder = "linear"
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[stimulation]
update_ms = 10
phase_us = 200
max_charge_nC = 16
max_total_uA = 250
watchdog_ms = 100
max_slope_uA_per_s = 20000
"""


def noise(k, i):
    return 0.01 * ((k * 7919 + i * 104729) % 5 - 2)


class Lines:
    """The lines of patterns, one after the other."""

    def __init__(self, step_ms):
        self.step_ms = step_ms
        self.random = random.Random(0)
        self.expressions = {}

    def value(self, expression, time_s):
        code = self.expressions.get(expression)
        if code is None:
            code = self.expressions[expression] = compile(expression.strip(), expression, "eval")
        return eval(code, {"t": time_s, "min": min, "max": max})

    def line(self, pattern, k, step, steps):
        """The k-th line. step: of so many steps of its pattern."""
        ms = k * self.step_ms

        def ramp(match):
            first, last = float(match[1]), float(match[2])
            return f"{first + (last - first) * step / max(steps - 1, 1):.6f}"

        line = pattern.replace("{ms}", str(ms)).replace("{s}", f"{ms / 1000:.3f}")
        if "{" in line:
            line = re.sub(r"\{ramp (\S+) (\S+)\}", ramp, line)
            line = re.sub(r"\{(\d+)x((?:[^{}]|\{[^{}]*\})*)\}",
                          lambda match: ",".join(match[2].replace("#", str(i + 1)) for i in range(int(match[1]))), line)
            line = re.sub(r"\{=([^}]*)\}", lambda match: f"{self.value(match[1], ms / 1000):.6f}", line)
        if "?" in line:
            place = iter(range(10**6))
            line = re.sub(r"(-?[\d.]+)\?(~[\d.]*)?",
                          lambda match: "nan" if (k + 3 * next(place)) % 10 == 0 else match[1] + (match[2] or ""), line)
        if "~" in line:
            place = iter(range(10**6))

            def noisy(match):
                added = self.random.gauss(0.0, float(match[2])) if match[2] else noise(k, next(place))
                return f"{float(match[1]) + added:.6f}"

            line = re.sub(r"(-?[\d.]+)~([\d.]*)", noisy, line)
        return line


def finite_lines(case):
    count = sum(step[1] if len(step) > 1 else 1 for step in case["send"])
    return list(itertools.islice(lines_of(case), count))


def lines_of(case):
    """All lines, without end; None closes the connection."""
    k = 0
    lines = Lines(case.get("step_ms", 1))
    steps = case["send"]
    rest = itertools.cycle(steps) if case.get("repeat") else [[steps[-1][0], 10**9]]
    for pattern, *count in itertools.chain(steps, rest):
        count = count[0] if count else 1
        for step in range(count):
            if pattern == "<close>":
                yield None
                continue
            yield lines.line(pattern, k, step, count)
            k += "{ms}" in pattern or "{s}" in pattern or "~" in pattern or count > 1


class Device:
    """A program that sends the lines of a case over loopback, one a millisecond, or all at once."""

    def __init__(self, case, at_once):
        self.case = case
        self.all = "".join(line + "\n" for line in finite_lines(case)).encode() if at_once else None
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def address(self):
        return f"tcp:127.0.0.1:{self.socket.getsockname()[1]}"

    def serve(self):
        lines = lines_of(self.case)
        while not self.stopped.is_set():
            try:
                client, _ = self.socket.accept()
            except OSError:
                return
            with client:
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    if self.all is not None:
                        client.sendall(self.all)
                        continue
                    self.send(client, lines)
                except OSError:
                    pass  # the program has closed it: the next one hears the lines from their beginning
                else:
                    continue
            lines = lines_of(self.case)

    def send(self, client, lines):
        due = time.monotonic()
        while not self.stopped.is_set():
            batch = []
            for line in lines:
                if line is None:
                    break
                batch.append(line)
                if len(batch) == BATCH:
                    break
            client.sendall("".join(line + "\n" for line in batch).encode())
            if line is None:
                return
            due += BATCH / 1000
            time.sleep(max(0.0, due - time.monotonic()))

    def stop(self):
        self.stopped.set()
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()


def value_at(result, path):
    for key in path.split("."):
        result = result[int(key) if key.isdigit() else key]
    return result


def rows_of(text):
    return csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))


def press_measures(case, folder, samples):
    """What a session and its spikes and commands say of the presses that press_N describes."""
    force = Lines(1)

    def press_N(t):
        return force.value(case["press_N"], t)

    def pressed(t, since_s):
        return press_N(t) > 0 or press_N(t - since_s) > 0

    spikes = [float(row["time_s"]) for row in rows_of((folder / "spikes.csv").read_text())]
    currents = [(float(row["time_s"]), float(row["amplitude_uA"])) for row in rows_of((folder / "stim.csv").read_text())]
    inside = sum(pressed(t, 0.02) for t in spikes)
    result = {"spikes": inside, "spikes_outside": len(spikes) - inside,
              "current_uA": max((uA for t, uA in currents if press_N(t) > 0), default=0),
              # Encoder and slope come to rest in half a second.
              "current_outside_uA": max((uA for t, uA in currents if not pressed(t, 0.5)), default=0)}
    begin_mN = error_mN = end_s = lost = untouched_s = 0.0
    waits = released = None
    top = []
    last = 0.0
    for t, force_mN, touches in samples:
        true_mN = 1000 * press_N(t)
        if true_mN > 0:
            if released is not None or waits is None:
                waits, released, top = True, None, []
            if waits and touches:
                waits, begin_mN = False, max(begin_mN, true_mN)
            if not waits and not touches:
                untouched_s += t - last
            if true_mN == 1000 * press_N(t + 0.1):
                top.append((t, force_mN, true_mN))
        else:
            if waits is not None and released is None:
                released = t
                ends = [each for each in top if each[0] > top[-1][0] - 5] if top else []
                if ends:
                    mean = sum(each[1] - each[2] for each in ends) / len(ends)
                    error_mN = max(error_mN, abs(mean))
                    begins = [each for each in top if each[0] < top[0][0] + 5]
                    first = sum(each[1] - each[2] for each in begins) / len(begins)
                    lost = max(lost, (first - mean) / ends[0][2])
            if touches and released is not None:
                end_s = max(end_s, t - released)
        last = t
    return result | {"begin_mN": begin_mN, "error_mN": error_mN, "end_s": end_s, "lost_percent": 100 * lost,
                     "untouched_s": untouched_s}


def run_case(program, case, via, folder):
    """What it reads (name → value), and all that it prints."""
    for name, text in case.get("files", {}).items():
        (folder / name).write_text(text)
    device = None
    if via == "file":
        (folder / "trace.csv").write_text("\n".join(finite_lines(case)) + "\n")
        uri = f"replay:{folder / 'trace.csv'}" + ("?" + case["options"] if "options" in case else "")
    else:
        device = Device(case, via == "stream")
        options = case.get("options", "")
        uri = f"{device.address()}?protocol=csv" + ("&live=0" if via == "stream" else "") + ("&" + options if options else "")
    if case.get("run", "").startswith("connect") and "options" not in case:
        uri = device.address()
    scene = folder / "scene.toml"
    scene.write_text(case.get("scene", "").replace("URI", uri).replace("ELECTRODE", ELECTRODE))
    session = folder / "session.xdf"
    if "run" in case:
        words = [word.replace("URI", uri).replace("SCENE", str(scene)).replace("OUT", str(folder / "out"))
                 for word in case["run"].split()]
    else:
        words = ["run", str(scene) if "scene" in case else "goodwin", "--json"]
        words += ["--duration-s", str(case.get("seconds", 1.5))] if via == "tcp" else ["--fast"]
        if "scene" not in case:
            for probe in case.get("probes", [""]):
                words += ["--probe", uri + probe]
    if "press_N" in case or case.get("zeros"):
        words += ["--sink", f"xdf:{session}", "--sink", f"csv:{folder / 'spikes.csv'}"]
    if "press_N" in case:
        words += ["--sink", f"stim-csv:{folder / 'stim.csv'}"]
    try:
        done = subprocess.run([program, *words], capture_output=True, text=True, timeout=300, cwd=folder)
    finally:
        if device:
            device.stop()
    printed = done.stderr + done.stdout
    out = folder / "out"
    if out.exists():
        printed += out.read_text()
    read = {}
    if case.get("reads") and done.stdout.startswith("{"):
        result = json.loads(done.stdout)

        def stream(name):
            shown = subprocess.run([program, "inspect", "session", session, "--stream", name], capture_output=True, text=True)
            return rows_of(shown.stdout)

        if "press_N" in case:
            samples = [(float(row["time_s"]), float(row["force_mN"]), row["touch"] == "touching") for row in stream("samples")]
            result["press"] = press_measures(case, folder, samples)
        if case.get("zeros"):
            zeros = {}
            for row in stream("taxel_zeros"):
                for i in range(int(row["count"])):
                    zeros[int(row["first"]) + i] = float(row[f"p{i}"])
            result["zeros"] = zeros
            again = subprocess.run([program, "replay", session], capture_output=True, text=True)
            result["replay"] = again.returncode
        read = {name: value_at(result, path) for name, path in case["reads"].items()}
    return read, printed


def says(sentence, printed):
    pattern = ".*?".join(re.escape(part) for part in sentence.split("…"))
    return re.search(pattern, printed, re.S) is not None


def is_as_wanted(value, wanted):
    if isinstance(wanted, str):
        return value <= float(wanted.removeprefix("≤"))
    return math.isclose(value, wanted, rel_tol=0.03, abs_tol=1e-9)


def check(case, read, printed):
    faults = []
    for (name, value), wanted in zip(read.items(), case.get("values", [])):
        if not is_as_wanted(value, wanted):
            faults.append(f"{name} is {value}, not {wanted}")
    if len(case.get("values", [])) != len(read):
        faults.append("give a value for each of reads")
    faults += [f'it does not say "{text}"' for text in case.get("says", []) if not says(text, printed)]
    faults += [f'it says "{text}"' for text in case.get("not", []) if says(text, printed)]
    return faults


def row_of(case):
    # The values are checked, so that the table is the same in every run.
    read = []
    for name, wanted in zip(case.get("reads", {}), case.get("values", [])):
        quantity, _, unit = name.partition(",")
        read.append(f"{quantity} {wanted if isinstance(wanted, str) else f'{wanted:g}'}{unit}")
    says_ = [f"“{text}”" for text in case.get("says", [])]
    cells = [case["title"], case["sent"], "; ".join(read), "<br>".join(says_)]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def main():
    arguments = sys.argv[1:]
    program = pathlib.Path(arguments.pop(0)).resolve()
    mode = arguments.pop(0) if arguments and arguments[0].startswith("--") else ""
    page = pathlib.Path(arguments.pop(0)) if mode else None
    part, parts = 1, 1
    if "--part" in arguments:
        at = arguments.index("--part")
        part, parts = map(int, arguments[at + 1].split("/"))
        del arguments[at : at + 2]
    thin = "--thin" in arguments
    word = next((each for each in arguments if each != "--thin"), "")
    cases = tomllib.loads((HERE / "cases.toml").read_text())["case"]
    table = ["| what a device does | what it sends | what merkel reads | what it says |", "|---|---|---|---|"]
    failed = False
    for number, case in enumerate(cases):
        table.append(row_of(case))
        if word.lower() not in case["title"].lower() or number % parts != part - 1:
            continue
        if thin and (case.get("long") or number // parts % 2):
            continue
        ways = case.get("via", "tcp")
        ways = [ways] if isinstance(ways, str) else ways
        for via in [ways[number // parts % len(ways)]] if thin else ways:
            with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
                read, printed = run_case(program, case, via, pathlib.Path(folder))
            faults = check(case, read, printed)
            if faults:
                failed = True
                print(f"{case['title']}, {via}: " + "; ".join(faults) + f"\n{read}\n{printed}", file=sys.stderr)
    text = "\n".join(table) + "\n"
    begin, end = "<!-- readings.py -->\n", "<!-- end -->\n"
    if mode:
        before, rest = page.read_text().split(begin)
        written, after = rest.split(end)
        if mode == "--write":
            page.write_text(before + begin + text + end + after)
        elif written != text:
            failed = True
            print(f"{page} is out of date: {sys.argv[0]} PROGRAM --write {page}", file=sys.stderr)
    else:
        print(text, end="")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
