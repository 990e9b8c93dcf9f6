"""Builds the wheel of merkel with CMake. It needs no package from an index: only Debian's, which
`tools/install_packages build python` installs."""
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent


def _project():
    text = (HERE / "pyproject.toml").read_text()
    version = subprocess.check_output([SOURCE / "tools/version"], text=True).strip()
    return {"version": version} | {key: re.search(rf'^{key} = "(.*)"$', text, re.M).group(1)
                                   for key in ("name", "description", "requires-python")}


def _tag():
    version = sysconfig.get_config_var("py_version_nodot")
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"cp{version}-cp{version}-{platform}"


def numpy_for(pybind11):
    """The requirement on numpy of a module built with that pybind11 ("2.10"): numpy 2 is read wrongly by those before 2.12."""
    return "numpy<2" if tuple(map(int, pybind11.split("."))) < (2, 12) else "numpy"


def _numpy():
    header = pathlib.Path("/usr/include/pybind11/detail/common.h")  # Debian's; others are newer
    if not header.exists():
        return "numpy"
    found = dict(re.findall(r"#define PYBIND11_VERSION_(MAJOR|MINOR) (\d+)", header.read_text()))
    return numpy_for(f"{found['MAJOR']}.{found['MINOR']}")


def _metadata():
    project = _project()
    return (f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
            f"Summary: {project['description']}\nRequires-Python: {project['requires-python']}\n"
            f"Requires-Dist: {_numpy()}\nLicense: MIT\n")


def _wheel():
    return f"Wheel-Version: 1.0\nGenerator: merkel\nRoot-Is-Purelib: false\nTag: {_tag()}\n"


def _build_package(build):
    """Returns the folder of the built package. The build folder is kept: the next build takes seconds."""
    for program in ("cmake", "ninja"):
        if shutil.which(program) is None:
            sys.exit(f"{program} is missing: run tools/install_packages build python")
    subprocess.check_call(["cmake", "-S", str(SOURCE), "-B", str(build), "-G", "Ninja",
                           "-DCMAKE_BUILD_TYPE=Release", "-DMERKEL_BUILD_TESTS=OFF",
                           f"-DPython3_EXECUTABLE={sys.executable}"])
    targets = subprocess.check_output(["ninja", "-C", str(build), "-t", "targets", "all"], text=True)
    if "merkel_python:" not in targets:
        sys.exit("pybind11 or the headers of Python are missing: run tools/install_packages build python")
    subprocess.check_call(["cmake", "--build", str(build), "--target", "merkel_python"])
    return build / "python" / "merkel"


def write_wheel(path, info, files):
    """Writes a wheel with its RECORD. The same files (name → bytes) always give the same bytes."""
    record = []
    with zipfile.ZipFile(path, "w") as wheel:
        def add(name, data):
            entry = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            wheel.writestr(entry, data)
        for name, data in files.items():
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(data)}")
            add(name, data)
        record.append(f"{info}/RECORD,,")
        add(f"{info}/RECORD", ("\n".join(record) + "\n").encode())


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    project = _project()
    folder = pathlib.Path(metadata_directory) / f"{project['name']}-{project['version']}.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(_metadata())
    (folder / "WHEEL").write_text(_wheel())
    return folder.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = _build_package(pathlib.Path(os.environ.get("MERKEL_BUILD_DIR", SOURCE / "build" / "python")))
    modules = sorted(package.glob("_merkel.*.so"), key=lambda module: module.stat().st_mtime)
    files = [file for file in sorted((HERE / "merkel").iterdir()) if file.suffix in (".py", ".pyi", ".typed")] + [modules[-1]]
    project = _project()
    info = f"{project['name']}-{project['version']}.dist-info"
    name = f"{project['name']}-{project['version']}-{_tag()}.whl"
    contents = {f"merkel/{file.name}": file.read_bytes() for file in files}
    for folder in ("tools/examples", "tests/traces"):  # found by name (drivers/files/example_file)
        contents |= {f"merkel/share/{folder.replace('tools', 'merkel').replace('tests', 'merkel')}/{file.name}": file.read_bytes()
                     for file in sorted((SOURCE / folder).iterdir()) if file.is_file()}
    contents |= {f"{info}/LICENSE": (SOURCE / "LICENSE").read_bytes(), f"{info}/METADATA": _metadata().encode(),
                 f"{info}/WHEEL": _wheel().encode(),
                 f"{info}/entry_points.txt": b"[console_scripts]\nmerkel = merkel._program:main\n"}
    write_wheel(pathlib.Path(wheel_directory) / name, info, contents)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("merkel is built from its repository: pip install tools/python")
