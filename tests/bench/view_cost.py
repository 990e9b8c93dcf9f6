#!/usr/bin/env python3
"""What the live page costs, on the side of the server and in a browser.

usage: view_cost.py [MERKEL [SECONDS]]

Server: processor time of the thread that serves the page and of the thread that makes its frames, as a share of
one core, with a client that takes 25 frames a second. Browser: processor time of the page's thread for each picture,
everything included, and how long drawing took on the clock, median and 99 % of the last 200 pictures (Chromium without
a screen or a graphics card). On a busy machine only the processor time means something. Prints the table of drivers/sinks/view/README.md.
"""
import contextlib
import os
import sys
import threading
import time

PROGRAM = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else "build/release/merkel")
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
os.environ.setdefault("MERKEL_PROGRAM", PROGRAM)
os.environ.setdefault("MERKEL_SOAK", "")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "readers"))
import browser
from merkel_program import free_port, start, wait_for
from web_socket import WebSocket, request

SLIDE = "sim:slide?depth_mm=1.8&x_mm=3&y_mm=10&to_x_mm=27&to_y_mm=10&speed_mm_per_s=0.4"
SCENES = (("`goodwin`, 450 afferents", "goodwin", [SLIDE]), ("`hand`, 4250 afferents", "hand", 6 * ["sim:ramp?hold_s=100"]))


def threads(pid):
    """Processor time of each thread by name, s."""
    times = {}
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/comm") as file:
            name = file.read().strip()
        with open(f"/proc/{pid}/task/{task}/schedstat") as file:
            times[name] = times.get(name, 0.0) + 1e-9 * int(file.read().split()[0])
    return times


def listening(port):
    try:
        return request(port)[0] == 200
    except OSError:
        return False


def serve(scene, probes):
    port = free_port()
    words = [word for uri in probes for word in ("--probe", uri)]
    program = start("run", scene, *words, "--duration-s", "90", "--sink", f"view:{port}")
    assert wait_for(lambda: listening(port)), program.stderr.read()
    return program, port


def server(scene, probes):
    program, port = serve(scene, probes)
    client = WebSocket(port)
    count = [0, 0]

    def read():
        try:
            while True:
                opcode, payload = client.receive()
                if opcode == 2:
                    count[0] += 1
                    count[1] += len(payload)
        except (EOFError, OSError):
            pass

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    time.sleep(1.0)
    before, frames, bytes_, began = threads(program.pid), count[0], count[1], time.monotonic()
    time.sleep(SECONDS)
    after, took = threads(program.pid), time.monotonic() - began
    used = {name: 100.0 * (after[name] - before.get(name, 0.0)) / took for name in after}
    frames, bytes_ = (count[0] - frames) / took, (count[1] - bytes_) / took
    program.terminate()
    program.communicate()
    return used, frames, bytes_


def children(pid):
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/children") as file:
            for child in map(int, file.read().split()):
                yield child
                yield from children(child)


def page_thread(driver):
    """Processor time of the main threads of Chromium's processes that run pages, s."""
    total = 0.0
    for pid in children(driver):
        with open(f"/proc/{pid}/cmdline", encoding="utf-8", errors="replace") as file:
            if "--type=renderer" not in file.read():
                continue
        with open(f"/proc/{pid}/task/{pid}/schedstat") as file:
            total += 1e-9 * int(file.read().split()[0])
    return total


def drawing(page, scene, probes):
    program, port = serve(scene, probes)
    page.open(f"http://127.0.0.1:{port}/")
    assert wait_for(lambda: page.ask("globalThis.merkel?.draws ?? 0") > 100)  # compiled
    before, drawn = page_thread(page.driver.pid), page.ask("merkel.draws")
    time.sleep(SECONDS)
    used, drawn = page_thread(page.driver.pid) - before, page.ask("merkel.draws") - drawn
    times = page.ask("merkel.drawingTimes()")
    program.terminate()
    program.communicate()
    return [f"{1e3 * used / drawn:.1f}", *(f"{times[int(q * (len(times) - 1))]:.1f}" for q in (0.5, 0.99))]


def main():
    print("| scene | server's threads, % of a core | frames/s | sent, kB/s | a picture: processor time, ms | drawing on the clock, "
          "median / 99 %, ms |\n|---|---|---|---|---|---|")
    if not browser.available():
        print("no chromium and chromedriver: drawing is not measured", file=sys.stderr)
    with browser.Browser(1280, 800) if browser.available() else contextlib.nullcontext() as page:
        if page:
            page.set_size(1280, 800)
        for name, scene, probes in SCENES:
            used, frames, bytes_ = server(scene, probes)
            print("  " + ", ".join(f"{thread} {share:.1f} %" for thread, share in sorted(used.items())), file=sys.stderr)
            share = sum(used.get(thread, 0.0) for thread in ("merkel-page", "merkel-sink"))
            picture, median, most = drawing(page, scene, probes) if page else ("–", "–", "–")
            print(f"| {name} | {share:.1f} | {frames:.1f} | {1e-3 * bytes_:.0f} | {picture} | {median} / {most} |", flush=True)


if __name__ == "__main__":
    main()
