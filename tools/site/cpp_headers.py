"""A page for each public C++ header, from doxygen's XML."""
import pathlib
import xml.etree.ElementTree as xml

DIRECTIVES = {"function": "doxygenfunction", "enum": "doxygenenum", "typedef": "doxygentypedef",
              "variable": "doxygenvariable", "class": "doxygenclass", "struct": "doxygenstruct"}


def compounds(folder):
    for file in sorted(folder.glob("*.xml")):
        if file.stem != "index":
            yield from xml.parse(file).getroot().iter("compounddef")


def place(element):
    location = element.find("location")
    return location.get("file"), int(location.get("line", "0"))


def entries(folder):
    """header → [(line, kind, name)] of what it declares in a namespace."""
    found, namespaces = {}, {"merkel"}
    every = list(compounds(folder))
    namespaces |= {each.findtext("compoundname") for each in every if each.get("kind") == "namespace"}
    for each in every:
        name = each.findtext("compoundname")
        if each.get("kind") in ("class", "struct") and name.rpartition("::")[0] in namespaces:
            header, line = place(each)
            found.setdefault(header, []).append((line, each.get("kind"), name))
        if each.get("kind") != "namespace":
            continue
        members = list(each.iter("memberdef"))
        names = [member.findtext("name") for member in members]
        for member in members:
            header, line = place(member)
            own = member.findtext("name")
            arguments = member.findtext("argsstring") if member.get("kind") == "function" and names.count(own) > 1 else ""
            found.setdefault(header, []).append((line, member.get("kind"), f"{name}::{own}{arguments}"))
    return found


def stage(folder, xml_folder, headers):
    """Writes the pages. A header without entries is an error: its page would be empty."""
    declared = entries(xml_folder)
    for header in headers:
        if not declared.get(header):
            raise SystemExit(f"tools/site: doxygen found nothing in {header}: does it have comments with ///?")
        title = f"<merkel/{pathlib.PurePosixPath(header).name}>"
        page = f"{title}\n{'=' * len(title)}\n\n"
        for _, kind, name in sorted(declared[header]):
            page += f".. {DIRECTIVES[kind]}:: {name}\n\n"
        (folder / f"{pathlib.PurePosixPath(header).stem}.rst").write_text(page)
    listed = "\n   ".join(pathlib.PurePosixPath(header).stem for header in headers)
    (folder / "index.rst").write_text(f"C++\n===\n\n.. toctree::\n\n   {listed}\n")
