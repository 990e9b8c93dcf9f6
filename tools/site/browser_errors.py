"""Pages of a built site must load without an error in a browser's console: browser_errors.py FOLDER

Exit code 1, with the errors; without Chromium, a sentence and exit code 0.
"""
import functools
import http.server
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading

PAGES = ["index.html", "tools/guides/gauge.html", "reference/commands/index.html"]


class Server(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


def errors_of(browser, url):
    with tempfile.TemporaryDirectory(prefix="merkel-") as profile:
        run = subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}",
                              "--enable-logging=stderr", "--virtual-time-budget=5000", "--dump-dom", url],
                             capture_output=True, text=True, timeout=120)
    if "</html>" not in run.stdout:
        return [f"{url} was not loaded: {run.stderr[-500:]}"]
    return [line for line in run.stderr.splitlines()
            if "CONSOLE" in line and re.search(r"Error|Failed|Refused|404", line)]


def main():
    folder = pathlib.Path(sys.argv[1])
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        print("browser_errors: skipped: Chromium is not installed")
        return 0
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Server, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    found = []
    for page in PAGES:
        if not (folder / page).exists():
            found.append(f"{page} is missing")
        else:
            found += errors_of(browser, f"http://127.0.0.1:{server.server_port}/{page}")
    print("\n".join(f"in a browser: {each}" for each in found), end="\n" if found else "")
    return 1 if found else 0


sys.exit(main())
