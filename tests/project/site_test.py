"""The parts of tools/site: links, stubs, notebooks. usage: site_test.py SOURCE_FOLDER"""
import pathlib
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(ROOT / "tools/site"))
try:
    import notebooks
except ImportError as error:
    print(f"skipped: {error} (tools/install_packages site)")
    sys.exit(77)
import check_links
import cpp_headers
import python_stubs
import stage


class Links(unittest.TestCase):
    def test_a_link_to_a_moved_page_follows_it(self):
        moved = stage.with_moved_links("[a](../../README.md) [b](../README.md#c) [d](https://x.org/y.md)", "tools/gallery/README.md")
        self.assertEqual(moved, "[a](../../index.md) [b](../../tools/README.md#c) [d](https://x.org/y.md)")

    def test_the_links_of_a_moved_page_keep_their_targets(self):
        self.assertEqual(stage.with_moved_links("[a](../drivers/README.md)", ".github/CONTRIBUTING.md"), "[a](drivers/README.md)")

    def test_a_link_without_target_is_refused(self):
        with self.assertRaisesRegex(SystemExit, "README.md: the link core/nothing.md has no target"):
            stage.with_moved_links("[a](core/nothing.md)", "README.md")

    def test_no_page_of_the_repository_has_a_broken_link(self):
        for name in stage.tracked_files():
            if name.endswith(".md"):
                stage.with_moved_links((ROOT / name).read_text(), name)

    def test_every_page_is_in_the_contents(self):
        listed = (ROOT / "tools/site/contents.txt").read_text().split()
        for name in stage.tracked_files():
            if name.endswith(".md") and name != "README.md":
                self.assertIn(stage.MOVED.get(name, name).removesuffix(".md"), listed)


class Commands(unittest.TestCase):
    def test_long_lines_of_a_help_continue_in_their_column(self):
        self.assertEqual(stage.wrapped("  --force-N FLOAT    Force in N, above zero", 35),
                         "  --force-N FLOAT    Force in N,\n                     above zero")
        self.assertEqual(stage.wrapped("Runs a scene: reads its probes", 20), "Runs a scene: reads\nits probes")
        self.assertEqual(stage.wrapped("  --json    As JSON", 35), "  --json    As JSON")


class Stubs(unittest.TestCase):
    def test_classes_methods_and_properties_appear_with_their_types(self):
        with tempfile.TemporaryDirectory() as folder:
            stubs = pathlib.Path(folder) / "x.pyi"
            stubs.write_text('"""Module."""\nclass A:\n    """A class."""\n    def f(self, n: int = ...) -> str: ...\n'
                             "    @property\n    def p(self) -> float:\n        \"\"\"In s.\"\"\"\n"
                             "    @p.setter\n    def p(self, s: float) -> None: ...\ndef g() -> None: ...\n")
            page = python_stubs.page(stubs)
        self.assertEqual(page.count(":: p"), 1)
        for line in [".. py:class:: A", "   .. py:method:: f(n: int=...) -> str", "   .. py:property:: p", "      :type: float",
                     "      In s.", ".. py:function:: g() -> None"]:
            self.assertIn(line + "\n", page)


class Headers(unittest.TestCase):
    XML = """<doxygen><compounddef kind="namespace"><compoundname>merkel</compoundname>
      <memberdef kind="function"><name>f</name><argsstring>(int n)</argsstring><location file="a.hpp" line="9"/></memberdef>
      <memberdef kind="function"><name>f</name><argsstring>()</argsstring><location file="a.hpp" line="8"/></memberdef>
      <memberdef kind="enum"><name>E</name><location file="b.hpp" line="1"/></memberdef></compounddef>
      <compounddef kind="class"><compoundname>merkel::C</compoundname><location file="a.hpp" line="3"/></compounddef>
      <compounddef kind="struct"><compoundname>merkel::C::Inside</compoundname><location file="a.hpp" line="4"/></compounddef></doxygen>"""

    @unittest.skipUnless(shutil.which("doxygen"), "doxygen is not installed (tools/install_packages site)")
    def test_every_public_header_has_a_page_and_no_warning(self):
        with tempfile.TemporaryDirectory() as scratch:
            top = pathlib.Path(scratch)
            for header in stage.public_headers():
                (top / header).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / header, top / header)
            stage.stage_headers(top / "reference/cpp")
            self.assertEqual(len(list((top / "reference/cpp").glob("*.rst"))), len(stage.public_headers()) + 1)

    def test_a_header_shows_what_it_declares_in_its_order(self):
        with tempfile.TemporaryDirectory() as folder:
            top = pathlib.Path(folder)
            (top / "xml").mkdir()
            (top / "xml/all.xml").write_text(self.XML)
            cpp_headers.stage(top, top / "xml", ["a.hpp"])
            lines = (top / "a.rst").read_text().split("\n")
            self.assertEqual([line for line in lines if line.startswith("..")],
                             [".. doxygenclass:: merkel::C", ".. doxygenfunction:: merkel::f()", ".. doxygenfunction:: merkel::f(int n)"])
            with self.assertRaisesRegex(SystemExit, "nothing in c.hpp"):
                cpp_headers.stage(top, top / "xml", ["c.hpp"])


class BuiltLinks(unittest.TestCase):
    def test_links_without_a_target_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            top = pathlib.Path(folder)
            (top / "a.html").write_text('<p id="here"><a href="#here"><a href="b.html#there"><a href="https://x.org/">'
                                        '<a href="#gone"><a href="c.html"><img src="d.png">')
            (top / "b.html").write_text('<a name="there"><a href="a.html#gone">')
            self.assertEqual(list(check_links.broken(top)),
                             ["a.html: #gone", "a.html: c.html", "a.html: d.png", "b.html: a.html#gone"])


class Notebooks(unittest.TestCase):
    def test_the_percent_format_gives_text_and_code(self):
        cells = notebooks.read("# %% [markdown]\n# # Title\n#\n# Text\n# %%\nx = 1\n").cells
        self.assertEqual([(cell.cell_type, cell.source) for cell in cells], [("markdown", "# Title\n\nText"), ("code", "x = 1")])


if __name__ == "__main__":
    unittest.main()
