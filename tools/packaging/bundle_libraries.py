#!/usr/bin/python3
"""Puts the libraries that a wheel needs into it: bundle_libraries.py WHEEL FOLDER

Writes the wheel into FOLDER, with the platform tag of this machine's glibc. The libraries keep their licences, and a
list of them (CycloneDX) says from which Debian packages they are. Libraries that every Linux has stay outside (those of
the manylinux policies). Needs patchelf and binutils.
"""
import hashlib
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "python")]
import bill_of_materials
import build_backend

PLATFORM = re.compile(r"^(ld-linux.*|lib(c|m|dl|rt|util|pthread|resolv|gcc_s|stdc\+\+)\.so)")


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def needed(file):
    """The direct dependencies of an ELF file, by their names."""
    return [name for name in run("patchelf", "--print-needed", file).split() if not PLATFORM.match(name)]


def libraries_of(module):
    """Every library that the module loads and that is not of the platform: name → file."""
    found = dict(re.findall(r"^\s*(\S+) => (\S+) \(", run("ldd", module), re.M))
    missing = re.findall(r"^\s*(\S+) => not found", run("ldd", module), re.M)
    if missing:
        sys.exit(f"bundle_libraries: {', '.join(missing)} are not installed here, but {module.name} needs them")
    wanted, closure = needed(module), {}
    while wanted:
        name = wanted.pop()
        if name not in closure:
            closure[name] = pathlib.Path(found[name]).resolve()
            wanted += needed(closure[name])
    return dict(sorted(closure.items()))


def bundle(module, folder):
    """Copies the libraries of a module into a folder, under names that no other package has, and links them."""
    folder.mkdir()
    closure = libraries_of(module)
    names = {}
    for name, file in closure.items():
        stem, _, version = name.partition(".so")
        digest = hashlib.sha256(file.read_bytes()).hexdigest()[:8]
        names[name] = f"{stem}-{digest}.so{version}"
    for name, file in closure.items():
        copy = folder / names[name]
        copy.write_bytes(file.read_bytes())
        copy.chmod(0o755)
        rename(copy, names, "$ORIGIN")
        run("patchelf", "--set-soname", names[name], copy)
    run("strip", "--strip-unneeded", module)
    rename(module, names, f"$ORIGIN/../{folder.name}")
    return closure


def rename(file, names, path):
    for name in needed(file):
        run("patchelf", "--replace-needed", name, names[name], file)
    run("patchelf", "--force-rpath", "--set-rpath", path, file)


def licences(packages):
    """Path in the wheel → text, of each Debian package."""
    return {f"licenses/{package}": pathlib.Path(f"/usr/share/doc/{package}/copyright").read_bytes()
            for package in sorted(packages)}


def platform_tag():
    _, version = platform.libc_ver()
    return f"manylinux_{version.replace('.', '_')}_{platform.machine()}"


def main():
    wheel, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    name, version, python, abi, _ = wheel.stem.split("-")
    tag = f"{python}-{abi}-{platform_tag()}"
    info = f"{name}-{version}.dist-info"
    with tempfile.TemporaryDirectory() as scratch:
        tree = pathlib.Path(scratch)
        with zipfile.ZipFile(wheel) as packed:
            packed.extractall(tree)
        module, = (tree / name).glob("*.so")
        closure = bundle(module, tree / f"{name}.libs")
        packages = bill_of_materials.packages_of(closure.values())
        for place, text in licences(packages).items():
            (tree / info / place).parent.mkdir(parents=True, exist_ok=True)
            (tree / info / place).write_bytes(text)
        (tree / info / "sboms").mkdir()
        (tree / info / "sboms" / f"{name}.cdx.json").write_text(
            bill_of_materials.document(name, version, packages, bill_of_materials.compiled_in()))
        about = tree / info / "WHEEL"
        about.write_text(re.sub(r"^Tag: .*$", f"Tag: {tag}", about.read_text(), flags=re.M))
        (tree / info / "RECORD").unlink()
        out = folder / f"{name}-{version}-{tag}.whl"
        build_backend.write_wheel(out, info, {file.relative_to(tree).as_posix(): file.read_bytes()
                                              for file in sorted(tree.rglob("*")) if file.is_file()})
    print(f"{out.name}: {os.path.getsize(out) / 1e6:.1f} MB with {len(closure)} libraries of {len(packages)} packages")


if __name__ == "__main__":
    main()
