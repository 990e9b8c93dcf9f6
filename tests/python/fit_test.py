"""merkel.fit(): the result of `merkel fit`, on any executor."""
import concurrent.futures
import multiprocessing
import os
import subprocess
import sys
import tempfile
import unittest

import merkel

PROGRAM = os.environ["MERKEL_PROGRAM"]
NAMES = ["gain_Hz_per_kPa", "field_radius_mm"]  # the second one renews the presses
FEW = {"trials": 2, "evaluations": 12}


class Broken(concurrent.futures.ThreadPoolExecutor):
    """Fails after some tasks."""
    left = 20

    def submit(self, *arguments, **more):
        self.left -= 1
        if self.left < 0:
            raise RuntimeError("the cluster is gone")
        return super().submit(*arguments, **more)


class Fit(unittest.TestCase):
    def test_any_executor_gives_the_result_of_the_program(self):
        with tempfile.TemporaryDirectory(prefix="merkel-") as folder:
            file = os.path.join(folder, "fitted.toml")
            words = [word for name in NAMES for word in ("--parameter", name)]
            done = subprocess.run([PROGRAM, "fit", "goodwin", "--trials", "2", "--evaluations", "12", *words, "--out", file],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            expected = merkel.Scene(file).text
        local = merkel.fit("goodwin", parameters=NAMES, **FEW)
        self.assertEqual(local.scene.text, expected)
        self.assertEqual([row["name"] for row in local.parameters], NAMES)
        self.assertLessEqual(local.cost_after, local.cost_before)
        context = multiprocessing.get_context("fork")
        with concurrent.futures.ProcessPoolExecutor(3, context) as processes, \
                concurrent.futures.ThreadPoolExecutor(2) as threads:
            for executor in (processes, threads) if "MERKEL_FULL_SWEEPS" in os.environ else (processes,):
                done = merkel.fit("goodwin", parameters=NAMES, executor=executor, **FEW)
                self.assertEqual(done.scene.text, expected)
                self.assertEqual(done.parameters, local.parameters)
                self.assertEqual(done.evaluations, local.evaluations)

    def test_errors_are_sentences(self):
        with self.assertRaisesRegex(merkel.Error, "no parameter \"gain\" can be fitted"):
            merkel.fit(parameters="gain")
        with self.assertRaisesRegex(merkel.Error, "driven by energy density"):
            merkel.fit("paper", **FEW)
        with self.assertRaisesRegex(merkel.Error, "none.json"):
            merkel.fit(data="none.json")
        with self.assertRaisesRegex(merkel.Error, "trials must be a whole number"):
            merkel.fit(trials=0)
        with self.assertRaisesRegex(merkel.Error, "parameters must be a list of names, not 3"):
            merkel.fit(parameters=3)
        with self.assertRaisesRegex(merkel.Error, "data must be a file of recordings, not 5"):
            merkel.fit(data=5)

    def test_a_failing_executor_ends_the_fit_with_its_error(self):
        with Broken(2) as executor, self.assertRaisesRegex(RuntimeError, "the cluster is gone"):
            merkel.fit(parameters="gain_Hz_per_kPa", executor=executor, **FEW)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
