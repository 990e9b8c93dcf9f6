"""Makes Debian's furo work on any server: theme_files.py FOLDER

Debian serves normalize.css from its own web server, and its furo.js is a module that pages load as a plain script. Both are
put into the site's files.
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
        styles.write_text(at_server.sub(lambda _: NORMALIZE.read_text(), text))
    text = script.read_text()
    imported = re.match(r'import (\w+) from "\./([\w.-]+)";\n', text)
    if imported:  # the library defines a global of this name where there are no modules
        script.write_text((script.parent / imported[2]).read_text() + "\n" + text[imported.end():])


main()
