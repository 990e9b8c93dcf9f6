"""A headless Chromium, driven through chromedriver's protocol (W3C WebDriver)."""
import base64
import json
import os
import shutil
import subprocess
import urllib.error
import urllib.request

import merkel_program


def available():
    return shutil.which("chromedriver") and shutil.which("chromium")


class Browser:
    def __init__(self, width, height):
        self.port = merkel_program.free_port()
        self.driver = subprocess.Popen(["chromedriver", f"--port={self.port}"],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.session = None
        arguments = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage",
                     "--autoplay-policy=document-user-activation-required",
                     "--disable-quic", "--no-first-run", "--disable-background-networking",
                     "--disable-component-update", "--disable-sync",
                     f"--window-size={width},{height}"]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")  # Chromium refuses to sandbox root
        wanted = {"goog:chromeOptions": {"args": arguments},
                  "goog:loggingPrefs": {"browser": "ALL"}}
        assert merkel_program.wait_for(self._ready)
        self.session = self._call("POST", "/session",
                                  {"capabilities": {"alwaysMatch": wanted}})["sessionId"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._call("DELETE", f"/session/{self.session}")
        finally:
            self.driver.terminate()
            self.driver.wait()

    def _ready(self):
        try:
            return self._call("GET", "/status")["ready"]
        except (urllib.error.URLError, ConnectionError):
            return False

    def _call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        query = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", data, method=method,
                                       headers={"Content-Type": "application/json"})
        with urllib.request.urlopen(query, timeout=60) as answer:
            return json.load(answer)["value"]

    def _in_session(self, method, path, body=None):
        return self._call(method, f"/session/{self.session}{path}", body)

    def open(self, url):
        self._in_session("POST", "/url", {"url": url})

    def ask(self, expression):
        """The value of a JavaScript expression in the page."""
        return self._in_session("POST", "/execute/sync",
                                {"script": f"return {expression};", "args": []})

    def text(self, element):
        return self.ask(f"document.getElementById('{element}').textContent")

    def press(self, key):
        self._in_session("POST", "/actions", {"actions": [
            {"type": "key", "id": "keyboard", "actions": [{"type": "keyDown", "value": key},
                                                          {"type": "keyUp", "value": key}]}]})

    def click(self, x, y):
        self._in_session("POST", "/actions", {"actions": [
            {"type": "pointer", "id": "mouse", "actions": [
                {"type": "pointerMove", "duration": 0, "x": x, "y": y},
                {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]}]})

    def set_size(self, width, height):
        """Sets the size of the page in CSS pixels; below 500 (too narrow for a window) as a phone."""
        phone = width < 500
        self._in_session("POST", "/goog/cdp/execute", {
            "cmd": "Emulation.setDeviceMetricsOverride",
            "params": {"width": width, "height": height, "deviceScaleFactor": 2 if phone else 1,
                       "mobile": phone}})

    def set_media(self, feature, value):
        """Sets a media feature: set_media("prefers-color-scheme", "dark")."""
        self._in_session("POST", "/goog/cdp/execute", {
            "cmd": "Emulation.setEmulatedMedia",
            "params": {"features": [{"name": feature, "value": value}]}})

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self._in_session("GET", "/screenshot")))

    def errors(self):
        return [entry["message"] for entry in self._in_session("POST", "/se/log",
                                                               {"type": "browser"})
                if entry["level"] == "SEVERE"]
