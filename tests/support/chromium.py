"""Headless Chromium with one page, driven through the DevTools protocol over a pipe: no library, no port."""

import json
import os
import shutil
import subprocess
import tempfile
import time
from contextlib import contextmanager

import pytest

NAMES = "chromium", "chromium-browser", "google-chrome"
SECONDS = 60.0


def chromium():
    """Path of the browser; skips the test where there is none."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("needs Chromium (Debian's package: apt-get install chromium)")
    return found


class Browser:
    """One tab. `events` are those that came, in order."""

    def __init__(self, to_browser, from_browser):
        self._to, self._from = to_browser, from_browser
        self._number, self._pending, self._session, self.events = 0, b"", None, []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        self._number += 1
        number = self._number
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def _next(self):
        while b"\0" not in self._pending:
            received = os.read(self._from, 2**20)
            assert received, "the browser has gone"
            self._pending += received
        message, self._pending = self._pending.split(b"\0", 1)
        return json.loads(message)

    def open(self, path, width=1200, height=1000):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=path.as_uri())
        self.wait_for("document.readyState === 'complete'")

    def evaluate(self, expression):
        """Value of a JavaScript expression, of a promise what it comes to."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait_for(self, expression):
        until = time.monotonic() + SECONDS
        while not self.evaluate(expression):
            assert time.monotonic() < until, f"never true: {expression}"
            time.sleep(0.02)

    def press(self, key, code):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def nameless(self, *roles):
        """Nodes of some roles that say to nobody what they are, of more than twenty."""
        tree = self.call("Accessibility.getFullAXTree")["nodes"]
        nodes = [n for n in tree if not n.get("ignored") and n.get("role", {}).get("value") in roles]
        assert len(nodes) > 20
        return [n for n in nodes if not n["name"]["value"]]

    def fit_a_phone(self):
        """Show the page on a phone, and wait until it is no wider: pictures are drawn again after the layout."""
        self.call("Emulation.setDeviceMetricsOverride", width=390, height=800, deviceScaleFactor=2, mobile=True)
        self.wait_for("document.documentElement.scrollWidth <= 390")

    def named(self, *methods):
        """Events of some methods so far."""
        return [event for event in self.events if event.get("method") in methods]


@contextmanager
def browser():
    """A browser of its own, with a profile of its own, gone afterwards."""
    program = chromium()
    commands, to_browser = os.pipe()
    from_browser, answers = os.pipe()
    with tempfile.TemporaryDirectory(prefix="pmor-chromium-", ignore_cleanup_errors=True) as profile:
        # Descriptors 3 and 4 are where it listens and answers.
        run = f'exec "$0" "$@" 3<&{commands} 4>&{answers}'
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--no-first-run",
                 f"--user-data-dir={profile}", "about:blank"]  # fmt: skip
        process = subprocess.Popen(
            ["bash", "-c", run, program, *flags], pass_fds=(commands, answers), stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(commands)
        os.close(answers)
        try:
            yield Browser(to_browser, from_browser)
        finally:
            process.terminate()
            process.wait(timeout=SECONDS)
            os.close(to_browser)
            os.close(from_browser)
