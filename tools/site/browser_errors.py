"""Pages of a built site must load without an error in a browser's console, and be dark where dark is preferred: browser_errors.py FOLDER

Exit code 1, with the errors. MERKEL_PROGRAM and PYTHONPATH as for live_page.py.
"""
import functools
import http.server
import pathlib
import sys
import threading

from browser import Browser

PAGES = ["index.html", "tools/guides/gauge.html", "reference/commands/index.html", "notebooks/1_press_a_finger.html"]
# Backgrounds of large parts, and the theme's page: the sum of red, green and blue.
LIGHT = """[...document.querySelectorAll("body, body *")].filter((e) => {
  const [r, g, b, alpha = 1] = getComputedStyle(e).backgroundColor.match(/[0-9.]+/g).map(Number), {width, height} = e.getBoundingClientRect();
  return alpha > 0.5 && r + g + b > 384 && width * height > 4000; }).map((e) => `${e.tagName}.${e.className}`)"""


class Server(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


def main():
    folder = pathlib.Path(sys.argv[1])
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Server, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    found = []
    with Browser(1280, 800) as browser:
        for page in PAGES:
            for scheme in ("light", "dark"):
                browser.set_media("prefers-color-scheme", scheme)
                browser.open(f"http://127.0.0.1:{server.server_port}/{page}")
                found += [error for error in browser.errors() if "favicon.ico" not in error]
                if (light := browser.ask(LIGHT)) and scheme == "dark":
                    found.append(f"{page}: light on a dark page: {light[:5]}")
    print("\n".join(f"in a browser: {each}" for each in found), end="\n" if found else "")
    return 1 if found else 0


sys.exit(main())
