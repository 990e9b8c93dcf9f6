#!/usr/bin/env python3
"""Records the live page of a hand that grasps, as an animated picture: live_page.py FILE.webp

MERKEL_PROGRAM is the built program; PYTHONPATH has tests/readers, whose browser shows the page.
"""
import pathlib
import sys
import tempfile

import PIL.Image
from browser import Browser
from merkel_program import free_port, start, wait_for

EXAMPLE = pathlib.Path(__file__).resolve().parent.parent / "examples/hand_electrodes.toml"
SIZE, SHOWN = (1280, 800), (960, 600)
GRASP_S, PICTURES = 1.2, 18     # one grasp of sim:grasp, so that the recording repeats


def record(file):
    port, pictures = free_port(), []
    program = start("run", str(EXAMPLE), "--sink", f"view:{port}")
    try:
        next(line for line in program.stderr if line.startswith("live page: "))     # it is served
        with Browser(*SIZE) as page, tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            page.set_size(*SIZE)
            page.open(f"http://127.0.0.1:{port}/")
            assert wait_for(lambda: page.ask("globalThis.merkel?.frame?.t > 5.5")), "the live page shows no frames"
            began = page.ask("merkel.frame.t")
            for number in range(PICTURES):
                assert wait_for(lambda: page.ask(f"merkel.frame.t >= {began + number * 2 * GRASP_S / PICTURES}"))
                page.screenshot(f"{folder}/{number}.png")
                pictures.append(PIL.Image.open(f"{folder}/{number}.png").convert("RGB").resize(SHOWN, PIL.Image.LANCZOS))
    finally:
        program.kill()
        program.communicate()
    pictures[0].save(file, save_all=True, append_images=pictures[1:], duration=round(2000 * GRASP_S / PICTURES), loop=0,
                     quality=60, method=4)


record(sys.argv[1])
