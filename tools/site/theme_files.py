"""Makes Debian's furo work on any server: theme_files.py FOLDER

Debian serves normalize.css from its own web server, its furo.js is a module that pages load as a plain script, and its furo.css is
dark on request, but not for a browser that prefers dark pages. All are repaired in the site's files.
"""
import pathlib
import re
import sys

NORMALIZE = pathlib.Path("/usr/share/nodejs/normalize.css/normalize.css")


def main():
    static = pathlib.Path(sys.argv[1], "_static")
    styles, script = static / "styles/furo.css", static / "scripts/furo.js"
    text = styles.read_text()
    at_server = re.compile(r"@import url\(/javascript/normalize\.css/normalize\.css\);")
    if at_server.search(text):
        text = at_server.sub(lambda _: NORMALIZE.read_text(), text)
    if "prefers-color-scheme" not in text:
        dark = "".join(re.findall(r'(?:html )?body\[data-theme="dark"\](?: \.only-\w+)?\s*\{[^}]*\}', text))
        text += "@media screen and (prefers-color-scheme: dark) {" + dark.replace('"dark"', '"auto"') + "}"
    styles.write_text(text)
    text = script.read_text()
    imported = re.match(r'import (\w+) from "\./([\w.-]+)";\n', text)
    if imported:  # the library defines a global of this name where there are no modules
        script.write_text((script.parent / imported[2]).read_text() + "\n" + text[imported.end():])


main()
