#!/usr/bin/env python3
"""What merkel makes of what a device sends: readings.py PROGRAM [--write README.md | --check README.md] [WORD]

Runs the program on each case of cases.toml whose title contains WORD, checks what it reads and says, and prints the cases as
a Markdown table. A case has

  title   what a device does
  sent    what it sends, as the table shows it
  send    lines and how often each is sent, [["time_ms,force_N"], ["{ms},0.3", 500]]; the last one again without end. In a
          line, {ms} and {s} are the time, {ramp A B} rises from A to B over the step, {12x0.5} is twelve times 0.5 between
          commas ({12xp#_kPa}: numbered), 0.5~ is 0.5 with noise of ±0.02 that is the same in every run, and 0.5? is nan once
          in ten; ["<close>"] closes the connection
  repeat  all lines again and again instead of the last one
  via     "tcp": a line every millisecond over loopback (the default); "file": a trace
  options of the protocol csv: "columns=force_N"; without them, merkel connect is given the bare address
  probes  a part of its URI for each probe, ["#thumb_N", "#palm_N"]
  scene   a scene instead, in which URI stands for the device
  run     arguments instead of "run --duration-s S --json", with URI, SCENE and OUT (a file)
  seconds S, 1.5 if not set
  reads   a name and where its value is in the output of --json: {"thumb, N" = "probes.0.deepest_press.force_N"}
  values  these values, within 3 %
  says    sentences that it prints, as the table shows them; "…" stands for anything
  not     texts that it must not print
"""
import itertools
import json
import math
import pathlib
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


def noise(k, i):
    return 0.01 * ((k * 7919 + i * 104729) % 5 - 2)


def line_of(pattern, k, step, steps):
    """The line of a pattern at a time in ms. step: of so many steps of this pattern."""
    def ramp(match):
        first, last = float(match[1]), float(match[2])
        return f"{first + (last - first) * step / max(steps - 1, 1):.6f}"

    line = pattern.replace("{ms}", str(k)).replace("{s}", f"{k / 1000:.3f}")
    line = re.sub(r"\{ramp (\S+) (\S+)\}", ramp, line)
    line = re.sub(r"\{(\d+)x([^}]*)\}",
                  lambda match: ",".join(match[2].replace("#", str(i + 1)) for i in range(int(match[1]))), line)
    place = iter(range(10**6))
    line = re.sub(r"(-?[\d.]+)\?", lambda match: "nan" if (k + 3 * next(place)) % 10 == 0 else match[1], line)
    return re.sub(r"(-?[\d.]+)~", lambda match: f"{float(match[1]) + noise(k, next(place)):.3f}", line)


def lines_of(case):
    """All lines, without end; None closes the connection."""
    k = 0
    steps = case["send"]
    rest = itertools.cycle(steps) if case.get("repeat") else [[steps[-1][0], 10**9]]
    for pattern, *count in itertools.chain(steps, rest):
        count = count[0] if count else 1
        for step in range(count):
            if pattern == "<close>":
                yield None
                continue
            yield line_of(pattern, k, step, count)
            k += "{ms}" in pattern or "{s}" in pattern or "~" in pattern or count > 1


class Device:
    """A program that sends the lines of a case over loopback, one a millisecond."""

    def __init__(self, case):
        self.case = case
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


def run_case(program, case, folder):
    """What it reads (name → value), and all that it prints."""
    device = None
    if case.get("via") == "file":
        wanted = sum(step[1] if len(step) > 1 else 1 for step in case["send"])
        lines = [line for line, _ in zip(lines_of(case), range(wanted))]
        (folder / "trace.csv").write_text("\n".join(lines) + "\n")
        uri = f"replay:{folder / 'trace.csv'}"
    else:
        device = Device(case)
        options = case.get("options", "")
        uri = f"{device.address()}?protocol=csv" + ("&" + options if options else "")
    if case.get("via") == "file" and "options" in case:
        uri += "?" + case["options"]
    if case.get("run", "").startswith("connect") and "options" not in case:
        uri = device.address()
    scene = folder / "scene.toml"
    scene.write_text(case.get("scene", "").replace("URI", uri))
    if "run" in case:
        words = [word.replace("URI", uri).replace("SCENE", str(scene)).replace("OUT", str(folder / "out"))
                 for word in case["run"].split()]
    else:
        words = ["run", str(scene) if "scene" in case else "goodwin", "--json"]
        words += ["--fast"] if case.get("via") == "file" else ["--duration-s", str(case.get("seconds", 1.5))]
        if "scene" not in case:
            for probe in case.get("probes", [""]):
                words += ["--probe", uri + probe]
    try:
        done = subprocess.run([program, *words], capture_output=True, text=True, timeout=120, cwd=folder)
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
        read = {name: value_at(result, path) for name, path in case["reads"].items()}
    return read, printed


def says(sentence, printed):
    pattern = ".*?".join(re.escape(part) for part in sentence.split("…"))
    return re.search(pattern, printed, re.S) is not None


def check(case, read, printed):
    faults = []
    for (name, value), wanted in zip(read.items(), case.get("values", [])):
        if not math.isclose(value, wanted, rel_tol=0.03, abs_tol=1e-9):
            faults.append(f"{name} is {value}, not {wanted}")
    if len(case.get("values", [])) != len(read):
        faults.append("give a value for each of reads")
    faults += [f'it does not say "{text}"' for text in case.get("says", []) if not says(text, printed)]
    faults += [f'it says "{text}"' for text in case.get("not", []) if says(text, printed)]
    return faults


def row_of(case):
    # The values are checked, so that the table is the same in every run.
    read = [f"{name.replace('|', '')} {wanted:g}" if "," not in name else f"{name.split(',')[0]} {wanted:g}{name.split(',')[1]}"
            for name, wanted in zip(case.get("reads", {}), case.get("values", []))]
    says_ = [f"“{text}”" for text in case.get("says", [])]
    cells = [case["title"], case["sent"], "; ".join(read), "<br>".join(says_)]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def main():
    arguments = sys.argv[1:]
    program = pathlib.Path(arguments.pop(0)).resolve()
    mode = arguments.pop(0) if arguments and arguments[0].startswith("--") else ""
    page = pathlib.Path(arguments.pop(0)) if mode else None
    word = arguments[0] if arguments else ""
    cases = tomllib.loads((HERE / "cases.toml").read_text())["case"]
    table = ["| what a device does | what it sends | what merkel reads | what it says |", "|---|---|---|---|"]
    failed = False
    for case in cases:
        table.append(row_of(case))
        if word.lower() not in case["title"].lower():
            continue
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            read, printed = run_case(program, case, pathlib.Path(folder))
        faults = check(case, read, printed)
        if faults:
            failed = True
            print(f"{case['title']}: " + "; ".join(faults) + f"\n{read}\n{printed}", file=sys.stderr)
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
