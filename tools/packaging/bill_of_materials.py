#!/usr/bin/python3
"""A list of the software in a package, as CycloneDX: bill_of_materials.py NAME VERSION [ROOT]

Prints the list of what is compiled into merkel and, with ROOT, of the Debian packages installed in that system.
"""
import json
import pathlib
import re
import subprocess
import sys

# Headers and static parts that are compiled into the program, the libraries and the Python module.
BUILT_FROM = ["libcli11-dev", "libeigen3-dev", "libexpected-dev", "libfmt-dev", "libhwy-dev", "libreaderwriterqueue-dev",
              "libtomlplusplus-dev", "libpugixml-dev", "nlohmann-json3-dev", "cppzmq-dev", "pybind11-dev"]


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def packages_of(files):
    """The Debian packages of files: name → version."""
    owners = set()
    for file in files:
        for place in (file, pathlib.Path(str(file).removeprefix("/usr"))):
            done = subprocess.run(["dpkg-query", "--search", str(place)], capture_output=True, text=True)
            if done.returncode == 0:
                owners.add(done.stdout.split(":")[0])
                break
        else:
            sys.exit(f"bill_of_materials: no Debian package has {file}, so its licence is not known")
    return {owner: version_of(owner) for owner in sorted(owners)}


def version_of(package):
    return run("dpkg-query", "--show", "--showformat=${Version}\\n", package).splitlines()[0]


def licences_of(package, root=pathlib.Path("/")):
    """A package's licences: their short names if its copyright file is machine-readable, else the text of that file."""
    file = root / f"usr/share/doc/{package}/copyright"
    if not file.is_file():
        return []
    text = file.read_text(errors="replace")
    names = sorted(set(re.findall(r"^License: *(\S.*?) *$", text, re.M))) if "Format:" in text[:400] else []
    if names:
        return [{"license": {"name": name}} for name in names]
    return [{"license": {"name": f"copyright of {package}", "text": {"contentType": "text/plain", "content": text}}}]


def component(package, version, root=pathlib.Path("/")):
    entry = {"type": "library", "name": package, "version": version, "purl": f"pkg:deb/debian/{package}@{version}"}
    licences = licences_of(package, root)
    return entry | ({"licenses": licences} if licences else {})


def compiled_in():
    """The components of merkel's own files. Packages that are not installed were not used."""
    found = []
    for package in BUILT_FROM:
        done = subprocess.run(["dpkg-query", "--show", "--showformat=${db:Status-Status} ${Version}", package],
                              capture_output=True, text=True)
        if done.stdout.startswith("installed "):
            found.append(component(package, done.stdout.split()[1]))
    return found


def document(name, version, packages, built_from, root=pathlib.Path("/")):
    """The list as text; packages are Debian's (name → version), built_from is compiled_in()."""
    return json.dumps({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": {"component": {"type": "application", "name": name, "version": version,
                                   "licenses": [{"license": {"id": "MIT"}}]}},
        "components": [component(*each, root) for each in packages.items()] + built_from}, indent=1) + "\n"


def installed_in(root):
    lines = run("dpkg-query", f"--admindir={root}/var/lib/dpkg", "--show",
                "--showformat=${db:Status-Status} ${Package} ${Version}\\n").splitlines()
    return {name: version for status, name, version in map(str.split, lines) if status == "installed"}


def main():
    name, version, *root = sys.argv[1:]
    packages = installed_in(root[0]) if root else {}
    sys.stdout.write(document(name, version, packages, compiled_in(), pathlib.Path(root[0] if root else "/")))


if __name__ == "__main__":
    main()
