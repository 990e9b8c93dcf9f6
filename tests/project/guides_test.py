#!/usr/bin/env python3
"""Each guide's commands run as they are printed, in an empty folder: guides_test.py MERKEL [GUIDES]

Prints how long each takes. Checks that each `--out` and `--sink` of a guide gave a file, and that at most five commands are needed.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = pathlib.Path(sys.argv[1]).absolute()
GUIDES = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parents[2] / "tools/guides")
MOST_COMMANDS = 5
# A run may end with 1 where a busy machine stopped its loop, which the verdict names.
MERKEL = """merkel() {
  [ "$1" != simulate-probe ] || exec merkel "$@"  # in the background: the job that is ended is the program
  local code=0
  command merkel "$@" || code=$?
  [ "$code" -eq 0 ] || echo "exit code $code"
  [ "$code" -le 1 ]
}
"""
HOST = "this machine stopped the loop"


class Guides(unittest.TestCase):
    def test_the_commands_of_each_guide_work_as_printed(self):
        guides = sorted(GUIDES.glob("*.md"))
        self.assertGreaterEqual(len(guides), 4)
        for guide in guides:
            script = "\n".join(re.findall(r"^```sh\n(.*?)^```$", guide.read_text(), re.MULTILINE | re.DOTALL))
            with self.subTest(guide.name), tempfile.TemporaryDirectory() as folder:
                self.assertLessEqual(len(script.splitlines()), MOST_COMMANDS)
                began = time.monotonic()
                run = subprocess.run(["bash", "-euc", MERKEL + script + "\nkill $(jobs -p) 2>/dev/null || true"], cwd=folder,
                                     env={**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"},
                                     capture_output=True, text=True, timeout=280)
                self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
                print(f"{guide.stem}: {len(script.splitlines())} commands, {time.monotonic() - began:.0f} s", flush=True)
                if "exit code 1" in run.stdout:
                    self.assertIn(HOST, run.stdout)
                for name in re.findall(r"(?:--out |--sink \w[\w-]*:)(\S+)", script):
                    self.assertGreater(pathlib.Path(folder, name).stat().st_size, 100, name)

    def test_each_number_of_afferents_that_a_guide_sets_is_another_one(self):
        def afferents(*options):
            run = subprocess.run([PROGRAM, "run", *options, "--fast", "--duration-s", "0.001"], capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            return re.search(r"of (\d+) fired", run.stdout).group(1)
        found = 0
        for guide, scenes in (("gauge", ["goodwin", "finger"]), ("hand", ["hand_electrodes", "taxel_array"])):
            keys = re.findall(r"--set (receptors\S*=\d+)", (GUIDES / f"{guide}.md").read_text())
            for key, scene in zip(keys * (len(scenes) // max(1, len(keys))), scenes):
                self.assertNotEqual(afferents(scene, "--set", key), afferents(scene), f"{scene}: {key}")
                found += 1
        self.assertEqual(found, 4)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
