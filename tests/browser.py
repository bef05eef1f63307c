"""Headless Chromium that tests control over its debugging pipe, without a driver or network."""

import json
import os
import select
import shutil
import subprocess
import time
from base64 import b64decode
from contextlib import contextmanager

import pytest

CHROMIUM = next(
    (
        program
        for name in ("chromium", "chromium-browser", "google-chrome")
        if (program := shutil.which(name))
    ),
    None,
)

needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on PATH: install Debian's `chromium` to drive pages"
)

PATIENCE = 120  # seconds, also on a busy machine

KEYS = {
    "ArrowLeft": 37, "ArrowRight": 39, "Home": 36, "End": 35, "Escape": 27, "Enter": 13,
    "ArrowUp": 38, "ArrowDown": 40, "Tab": 9,
}  # fmt: skip


class Browser:
    """One page of the browser; `console` holds its console messages and network requests."""

    def __init__(self, profile):
        read, self._in = os.pipe()
        self._out, write = os.pipe()
        command = [
            CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            "--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage",
            f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank",
        ]  # fmt: skip
        # The browser reads from 3 and writes to 4.
        shell = f'exec "$@" 3<&{read} 4>&{write}'
        self._process = subprocess.Popen(
            ["bash", "-c", shell, "browser", *command], pass_fds=(read, write),
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(read)
        os.close(write)
        self._left, self._number, self.console, self._session = b"", 0, [], None
        self.dialogs = []  # types of dialogs; all are accepted
        (page,) = [
            target for target in self.call("Target.getTargets")["targetInfos"]
            if target["type"] == "page"
        ]  # fmt: skip
        self._attach(page["targetId"])
        self._first = self._session

    def _attach(self, target):
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    @contextmanager
    def other_tab(self):
        """Within the context, control another page; it stays open until the context ends."""
        self._session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._attach(target)
        try:
            yield
        finally:
            self._session = None
            self.call("Target.closeTarget", targetId=target)
            self._session = self._first

    @contextmanager
    def first_tab(self):
        """Within the context of `other_tab`, control the first page."""
        other, self._session = self._session, self._first
        try:
            yield
        finally:
            self._session = other

    def close(self):
        self._session = None
        try:
            self.call("Browser.close")
            self._process.wait(PATIENCE)
        finally:
            self._process.kill()
            self._process.wait()
            os.close(self._in)
            os.close(self._out)

    def call(self, method, **parameters):
        """Call a method of the debugging protocol and return its result."""
        self._number += 1
        request = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            request["sessionId"] = self._session
        os.write(self._in, json.dumps(request).encode() + b"\0")
        while True:
            message = self._read(PATIENCE)
            assert message is not None, f"the browser does not answer {method}"
            if message.get("id") == self._number:
                assert "error" not in message, message["error"]
                return message["result"]

    def _read(self, patience):
        """Return the next message, or None after `patience` seconds; note events in `console`."""
        while b"\0" not in self._left:
            if not select.select([self._out], [], [], patience)[0]:
                return None
            piece = os.read(self._out, 1 << 20)
            assert piece, "the browser went away"
            self._left += piece
        encoded, _, self._left = self._left.partition(b"\0")
        message = json.loads(encoded)
        if (method := message.get("method")) is not None:
            if method in ("Runtime.exceptionThrown", "Log.entryAdded") or (
                method == "Runtime.consoleAPICalled" and message["params"]["type"] != "debug"
            ):
                self.console.append(json.dumps(message["params"]))
            if method == "Page.javascriptDialogOpening":
                self.dialogs.append(message["params"]["type"])
                accept = {
                    "id": 0,
                    "method": "Page.handleJavaScriptDialog",
                    "params": {"accept": True},
                }
                session = {"sessionId": message["sessionId"]}
                os.write(self._in, json.dumps(accept | session).encode() + b"\0")
            if method == "Network.requestWillBeSent":
                url = message["params"]["request"]["url"]
                if not url.startswith(("data:", "blob:", "file:", "about:")):
                    self.console.append(f"asked the network for {url}")
        return message

    def open(self, url):
        """Open a page and wait until it is loaded, also if only the hash of the address differs."""
        self.call("Page.navigate", url="about:blank")
        self.wait("location.href === 'about:blank'")
        self.call("Page.navigate", url=url)
        self.wait("location.href !== 'about:blank' && document.readyState === 'complete'")

    def size(self, width, height, *, dark=False, mobile=False, still=False):
        """Set the size of the view and the preferences of the reader."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=mobile,
        )  # fmt: skip
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        features += [{"name": "prefers-reduced-motion", "value": "reduce"}] if still else []
        self.call("Emulation.setEmulatedMedia", features=features)

    def run(self, script):
        """Return the value of an expression on the page; promises are awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True,
            userGesture=True,
        )  # fmt: skip
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, script):
        """Wait until an expression is true and return its value."""
        until = time.monotonic() + PATIENCE
        while not (value := self.run(script)):
            assert time.monotonic() < until, f"never true: {script}"
            time.sleep(0.05)
        return value

    def point(self, selector):
        """Move the mouse to the middle of an element and return the position."""
        element = f"document.querySelector({json.dumps(selector)})"
        self.run(f"{element}.scrollIntoView({{block: 'center', behavior: 'instant'}})")
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        place = self.run(
            f"(({{x, y, width, height}}) => ({{x: x + width / 2, y: y + height / 2}}))"
            f"({element}.getBoundingClientRect())"
        )
        self.call("Input.dispatchMouseEvent", type="mouseMoved", **place)
        return place

    def click(self, selector):
        """Click the middle of an element with the mouse."""
        place = self.point(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)

    def drag(self, start, end):
        """Drag the mouse between two positions `(x, y)` in the view [pixels]."""
        events = (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end))
        for kind, (x, y) in events:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def key(self, key, *, shift=False, held=False):
        """Press a key, and release it unless `held`."""
        text = {"text": "\r" if key == "Enter" else key} if len(key) == 1 or key == "Enter" else {}
        code = {"windowsVirtualKeyCode": KEYS.get(key, ord(key[0].upper()))}
        event = {"key": key, "modifiers": 8 if shift else 0, **code}
        self.call("Input.dispatchKeyEvent", type="keyDown", **event, **text)
        if not held:
            self.release(key)

    def release(self, key):
        """Release a key."""
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def shoot(self, path):
        """Write a picture of the view."""
        path.write_bytes(b64decode(self.call("Page.captureScreenshot")["data"]))
