"""The parts of tools/release: wheels and lists of software. usage: packaging_test.py SOURCE_FOLDER"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path[:0] = [str(ROOT / "tools/packaging"), str(ROOT / "tools/python")]
import bill_of_materials
import build_backend
import bundle_libraries


class Wheels(unittest.TestCase):
    def test_the_same_files_give_the_same_bytes_and_a_whole_record(self):
        files = {"merkel/a.py": b"a", "x.dist-info/WHEEL": b"w"}
        with tempfile.TemporaryDirectory() as folder:
            first, second = pathlib.Path(folder, "1.whl"), pathlib.Path(folder, "2.whl")
            build_backend.write_wheel(first, "x.dist-info", files)
            build_backend.write_wheel(second, "x.dist-info", files)
            self.assertEqual(first.read_bytes(), second.read_bytes())
            with zipfile.ZipFile(first) as wheel:
                rows = wheel.read("x.dist-info/RECORD").decode().splitlines()
        self.assertEqual([row.split(",")[0] for row in rows], [*files, "x.dist-info/RECORD"])

    def test_a_module_of_an_old_pybind11_does_not_take_numpy_2(self):
        self.assertEqual([build_backend.numpy_for(version) for version in ["2.10", "2.11", "2.12", "2.13", "3.0"]],
                         ["numpy<2", "numpy<2", "numpy", "numpy", "numpy"])
        self.assertRegex(build_backend._metadata(), r"\nRequires-Dist: numpy(<2)?\n")

    def test_the_libraries_of_every_linux_stay_outside(self):
        inside = [name for name in ["libc.so.6", "libstdc++.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2", "libm.so.6",
                                    "libcurl.so.4", "libmd.so.0", "libusb-1.0.so.0"] if not bundle_libraries.PLATFORM.match(name)]
        self.assertEqual(inside, ["libcurl.so.4", "libmd.so.0", "libusb-1.0.so.0"])

    @unittest.skipUnless(shutil.which("patchelf"), "patchelf is not installed (tools/install_packages wheel)")
    def test_a_module_loads_only_bundled_libraries(self):
        program = subprocess.run(["ldd", shutil.which("redis-server") or "/usr/bin/cmake"], capture_output=True, text=True).stdout
        library = next(line.split()[2] for line in program.splitlines() if "libssl" in line or "libcurl" in line)
        with tempfile.TemporaryDirectory() as folder:
            module = pathlib.Path(folder, "merkel/module.so")
            module.parent.mkdir()
            shutil.copy(library, module)
            bundled = bundle_libraries.bundle(module, pathlib.Path(folder, "merkel.libs"))
            self.assertTrue(bundled)
            for line in subprocess.run(["ldd", module], check=True, capture_output=True, text=True).stdout.splitlines():
                if "=> /" in line and not bundle_libraries.PLATFORM.match(line.split()[0]):
                    self.assertIn(f"=> {folder}/merkel/../merkel.libs/", line)


class BillOfMaterials(unittest.TestCase):
    def test_it_names_packages_with_version_and_licence_and_what_is_compiled_in(self):
        package = bill_of_materials.packages_of([pathlib.Path("/usr/bin/dpkg")])
        bill = json.loads(bill_of_materials.document("x", "1", package, bill_of_materials.compiled_in()))
        entries = {entry["name"]: entry for entry in bill["components"]}
        self.assertTrue(entries["dpkg"]["version"])
        self.assertIn({"license": {"name": "GPL-2+"}}, entries["dpkg"]["licenses"])
        self.assertIn("libeigen3-dev", entries)

    def test_a_package_without_short_names_has_the_text_of_its_copyright(self):
        for text in ["Free for all.\n", "Format: x\nno licence here\n"]:
            with tempfile.TemporaryDirectory() as root:
                file = pathlib.Path(root, "usr/share/doc/p/copyright")
                file.parent.mkdir(parents=True)
                file.write_text(text)
                licence, = bill_of_materials.component("p", "1", pathlib.Path(root))["licenses"]
                self.assertEqual(licence["license"]["text"]["content"], text)


if __name__ == "__main__":
    unittest.main()
