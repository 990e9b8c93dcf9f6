"""Collects the pages of the site: stage.py PROGRAM FOLDER

No sentence is written here: pages are the READMEs of the repository, the --help of the commands, the stubs of
the Python module, the public C++ headers and the executed notebooks.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap

import cpp_headers
import notebooks
import python_stubs

SITE = pathlib.Path(__file__).resolve().parent
ROOT = SITE.parent.parent
MOVED = {"README.md": "index.md", ".github/CONTRIBUTING.md": "CONTRIBUTING.md",
         "tools/site/notebooks": "notebooks/1_press_a_finger.md"}
LINK = re.compile(r"(\]\()([^)#\s]+)")


def tracked_files():
    names = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True).split("\0")
    return [name for name in names if name and (ROOT / name).is_file()]


def with_moved_links(text, page):
    """The links of a page, where the page or its target has another place in the site."""
    here = pathlib.PurePosixPath(MOVED.get(page, page)).parent

    def moved(match):
        target = match.group(2)
        if "://" in target or target.startswith("mailto:"):
            return match.group(0)
        absolute = (ROOT / page).parent.joinpath(target).resolve()
        try:
            name = absolute.relative_to(ROOT).as_posix()
        except ValueError:
            sys.exit(f"{page}: the link {target} leaves the repository")
        if not absolute.exists():
            sys.exit(f"{page}: the link {target} has no target")
        up = "../" * len(here.parts)
        return match.group(1) + up + MOVED.get(name, name)

    return LINK.sub(moved, text)


def stage_repository(folder):
    for name in tracked_files():
        target = folder / MOVED.get(name, name)
        target.parent.mkdir(parents=True, exist_ok=True)
        if name.endswith(".md"):
            target.write_text(with_moved_links((ROOT / name).read_text(), name))
        else:
            shutil.copyfile(ROOT / name, target)
    shutil.copyfile(SITE / "conf.py", folder / "conf.py")
    home, install, rest = (folder / "index.md").read_text().partition("## Install\n")
    recording = (SITE / "recording.txt").read_text()
    (folder / "index.md").write_text(f"{home}{recording}\n{install}{rest}\n{(SITE / 'contents.txt').read_text()}")


def wrapped(line, width=88):
    """A line of a help text; what is beyond the width continues below the column of its last part."""
    column = re.match(r"( *(?:\S+ )*\S+ {2,})?", line).end() or len(line) - len(line.lstrip())
    return "\n".join(textwrap.wrap(line, width, subsequent_indent=" " * column, break_long_words=False,
                                   break_on_hyphens=False)) if len(line) > width else line


def help_of(program, *command):
    text = subprocess.check_output([program, *command, "--help"], text=True)
    return "\n".join(map(wrapped, text.split("\n")))


def subcommands(text):
    part = text.partition("\nSubcommands:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  ([a-z][a-z-]*) ", part, re.M)


def stage_commands(program, folder):
    """A page for each subcommand."""
    folder.mkdir(parents=True)
    names = subcommands(help_of(program))
    if not names:
        sys.exit("merkel --help lists no subcommands")
    for name in names:
        page = f"# merkel {name}\n\n"
        for command in [[name]] + [[name, sub] for sub in subcommands(help_of(program, name))]:
            if len(command) > 1:
                page += f"## merkel {' '.join(command)}\n\n"
            page += f"```text\n{help_of(program, *command).rstrip()}\n```\n\n"
        (folder / f"{name}.md").write_text(page)
    index = f"# Command line\n\n```text\n{help_of(program).rstrip()}\n```\n\n```{{toctree}}\n:hidden:\n\n"
    (folder / "index.md").write_text(index + "\n".join(names) + "\n```\n")


def public_headers():
    text = (ROOT / "tools/cmake/public_headers.cmake").read_text()
    return re.findall(r"^  ([a-z_]+/\S+\.hpp)\)?$", text, re.M)


def stage_headers(folder):
    folder.mkdir(parents=True)
    headers = public_headers()
    if not headers:
        sys.exit("tools/cmake/public_headers.cmake lists no headers")
    settings = (SITE / "Doxyfile").read_text()
    top = folder.parent.parent
    inputs = " ".join(str(top / header) for header in headers)
    (top / "Doxyfile").write_text(
        f"{settings}INPUT = {inputs}\nOUTPUT_DIRECTORY = {top}\nSTRIP_FROM_PATH = {top}\nINCLUDE_PATH = {top}\n")
    subprocess.check_call(["doxygen", top / "Doxyfile"])
    cpp_headers.stage(folder, top / "xml", headers)


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    stage_repository(folder)
    reference = folder / "reference"
    stage_commands(program, reference / "commands")
    stage_headers(reference / "cpp")
    (reference / "python.rst").write_text(python_stubs.page(ROOT / "tools/python/merkel/__init__.pyi"))
    notebooks.stage(SITE / "notebooks", folder / "notebooks", folder)


if __name__ == "__main__":
    main()
