"""Builds the firmware for AVR boards; runs the Uno's and the Mega's under simavr, read by merkel."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = os.environ["MERKEL_PROGRAM"]
BOARD = os.environ.get("MERKEL_AVR_BOARD")
BUILD = pathlib.Path(__file__).with_name("build_firmware.sh")
FOLDER = tempfile.TemporaryDirectory(prefix="merkel-avr-")


class Board:
    """A board under simavr; `terminal` is its serial port."""

    def __init__(self, mcu, name):
        self.program = subprocess.Popen([BOARD, mcu, f"{FOLDER.name}/{name}.elf"], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.terminal = self.program.stdout.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.program.stdin.close()
        self.program.wait(20)
        self.program.stdout.close()


def merkel(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120,
                          cwd=FOLDER.name)


@unittest.skipUnless(BOARD, "libsimavr-dev was missing when the tests were built")
class Firmware(unittest.TestCase):
    # Two analogue readings of 0.1 ms and 23 bytes at 500000 Bd make 500/s, not 1000.
    def run_on(self, mcu, name, rate_hz=500):
        with Board(mcu, name) as board:
            uri = f"serial:{board.terminal}?protocol=hbf1&rate_hz={rate_hz}"
            done = merkel("run", "--probe", uri, "--duration-s", "2.5", "--json", "--sink",
                          f"csv:{name}.csv", "--overwrite")
        self.assertIn(done.returncode, (0, 1), done.stderr)  # 1: this machine was too busy
        summary = json.loads(done.stdout)
        device = summary["probes"][0]["device"]
        self.assertEqual((device["lost"], device["damaged"], device["refused"]), (0, 0, 0))
        self.assertGreater(device["readings"], 200)  # a busy machine simulates more slowly
        with open(f"{FOLDER.name}/{name}.csv") as file:
            self.assertGreater(len(file.readlines()), 20)  # the press makes spikes
        return summary

    def test_the_uno_is_read(self):
        self.run_on("atmega328p", "uno")

    def test_the_mega_is_read(self):
        self.run_on("atmega2560", "mega")

    def test_connect_finds_the_firmware_and_writes_a_scene(self):
        with Board("atmega328p", "uno") as board:
            done = merkel("connect", f"serial:{board.terminal}", "--out", "uno.toml")
            self.assertEqual(done.returncode, 0, done.stderr)
            scene = pathlib.Path(FOLDER.name, "uno.toml").read_text()
            self.assertIn("protocol=hbf1", scene)
            ran = merkel("run", "uno.toml", "--duration-s", "1")
            self.assertIn(ran.returncode, (0, 1), ran.stderr)

    def test_connect_takes_the_names_that_a_hand_gives_its_channels(self):
        with Board("atmega328p", "hand") as board:
            done = merkel("connect", f"serial:{board.terminal}", "--out", "hand.toml")
            self.assertEqual(done.returncode, 0, done.stderr)
            scene = pathlib.Path(FOLDER.name, "hand.toml").read_text()
            for finger in ("thumb", "index", "middle", "ring", "little", "palm"):
                self.assertIn(f'force = "{finger}_N"\npatch = "{finger}"\n', scene)
            # Six analogue readings and 39 bytes at 500000 Bd.
            pathlib.Path(FOLDER.name, "hand.toml").write_text(
                scene.replace("protocol=hbf1", "protocol=hbf1&rate_hz=200"))
            ran = merkel("run", "hand.toml", "--duration-s", "2.5", "--json")
        self.assertIn(ran.returncode, (0, 1), ran.stderr)
        probes = json.loads(ran.stdout)["probes"]
        self.assertEqual(len(probes), 6)
        self.assertGreater(probes[0]["deepest_press"]["force_N"], 1)  # A0 is pressed
        self.assertLess(probes[1]["deepest_press"]["force_N"], 0.1)


if __name__ == "__main__":
    built = subprocess.run([BUILD, FOLDER.name])
    if built.returncode:
        sys.exit(built.returncode)
    sys.exit(unittest.main(verbosity=2))
