"""Version, licence, authors and paper are the same in all files that name them. usage: metadata_test.py SOURCE_FOLDER"""
import json
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(ROOT / "tools/python"))
import build_backend

CITATION = (ROOT / "CITATION.cff").read_text()
CHANGES = (ROOT / "CHANGELOG.md").read_text()
CODEMETA = json.loads((ROOT / "tools/site/codemeta.json").read_text())


def cited(key):
    return re.search(rf"^\s*(?:- )?{key}: *(.*)$", CITATION, re.M).group(1)


class Metadata(unittest.TestCase):
    def test_the_version_is_that_of_cmake(self):
        version = re.search(r"project\(merkel VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
        self.assertEqual(cited("version"), version)
        self.assertEqual(CODEMETA["version"], version)
        self.assertEqual(build_backend._project()["version"].split("+")[0], version)
        self.assertEqual(re.search(r"^## (\S+) ", CHANGES, re.M).group(1), version)

    def test_the_date_is_that_of_the_last_release_in_the_changelog(self):
        date = re.search(r"^## \S+ \((\d{4}-\d\d-\d\d)\)$", CHANGES, re.M).group(1)
        self.assertEqual(cited("date-released"), date)
        self.assertEqual(CODEMETA["datePublished"], date)

    def test_citation_and_codemeta_agree(self):
        self.assertEqual(CODEMETA["license"].rpartition("/")[2], cited("license"))
        self.assertEqual([author["name"] for author in CODEMETA["author"]], [cited("name")])
        self.assertEqual(CODEMETA["keywords"], cited("keywords").strip("[]").split(", "))
        self.assertEqual(CODEMETA["referencePublication"], "https://doi.org/" + cited("doi"))
        self.assertTrue(cited("title").strip('"').startswith(CODEMETA["name"] + ":"))

    def test_the_figures_of_the_paper_are_those_of_the_readmes(self):
        readme = (ROOT / "README.md").read_text()
        score = (ROOT / "tools/studies/score/README.md").read_text()
        rows = re.findall(r"^\| (.*?) \| ([\d.].*?) \| (.*?) ?\|$", (ROOT / "tools/site/paper.md").read_text(), re.M)
        self.assertGreater(len(rows), 4)
        for quantity, ours, other in rows:
            self.assertTrue(ours in readme, quantity)
            if "score" in quantity or "same error" in quantity:
                self.assertTrue(f"RMSE {ours}" in score, quantity)
                self.assertTrue(other.removeprefix("TouchSim ") in readme, quantity)


if __name__ == "__main__":
    unittest.main()
