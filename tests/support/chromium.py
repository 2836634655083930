"""Headless Chromium, controlled by the DevTools protocol over a local socket."""

import base64
import ctypes
import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

from tests.support.waiting import SECONDS, until

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    # With this option, Chromium accepts clicks before the first frame is drawn, because drawing
    # takes long.
    "--allow-pre-commit-input",
    "--window-size=760,520",
    "--force-device-scale-factor=0.25",  # few pixels, because software rendering is slow
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)
LOUD = ("error", "warning", "assert")


class Chromium:
    """A browser with one page.

    Attributes:
        said: (level, text) of each console message since the web page was opened.
    """

    def __init__(self, program: str, folder: Path) -> None:
        command = [program, *FLAGS, f"--user-data-dir={folder}", "about:blank"]
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(
            # ``_end_with_parent`` acquires no lock, so other threads of this process cannot block
            # it.
            command,
            stdout=quiet,
            stderr=quiet,
            preexec_fn=_end_with_parent,  # noqa: PLW1509
        )
        port_file = folder / "DevToolsActivePort"
        until(lambda: port_file.is_file() and len(port_file.read_text().split()) > 1)
        port, path = port_file.read_text().split()
        self._socket = connect(
            f"ws://127.0.0.1:{port}{path}", max_size=None, compression=None, ping_interval=None
        )
        self._count, self._session = 0, None
        self.said: list[tuple[str, str]] = []
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._ask(f"{domain}.enable")

    def close(self) -> None:
        self._session = None
        self._ask("Browser.close")
        self._socket.close()
        self._process.wait(SECONDS)

    def open(self, address: str) -> None:
        self.run("window.isOld = true")
        self._ask("Page.navigate", url=address)
        until(lambda: self.run("document.readyState === 'complete' && !window.isOld"))

    def run(self, script: str):
        """Evaluate a JavaScript expression on the web page, and return its value."""
        answer = self._ask(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise AssertionError(json.dumps(answer["exceptionDetails"])[:2000])
        return answer["result"].get("value")

    def processor_time(self, script: str) -> float:
        """Return the processor time (seconds) of a JavaScript expression on the web page."""
        self._ask("Performance.enable", timeDomain="threadTicks")
        times = []
        for expression in ("0", script, "0"):
            self.run(expression)
            metrics = self._ask("Performance.getMetrics")["metrics"]
            times.append({own["name"]: own["value"] for own in metrics}["ThreadTime"])
        return times[1] - times[0]

    def drag(self, start, end) -> None:
        """Drag the mouse in steps between two points of the web page.

        The web page must draw frames between the mouse events, because the page finds the object
        below the mouse only while drawing.
        """
        self._mouse("mouseMoved", start)
        self.draw()
        self._mouse("mousePressed", start)
        for part in np.linspace(0, 1, 4)[1:]:
            self.draw()
            self._mouse("mouseMoved", np.add(start, part * np.subtract(end, start)))
        self.draw()
        self._mouse("mouseReleased", end)

    def draw(self, frames: int = 3) -> None:
        for _ in range(frames):
            self.run("new Promise(drawn => requestAnimationFrame(() => drawn(true)))")

    def click(self, point) -> None:
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self._mouse(kind, point)

    def write(self, text: str) -> None:
        self._ask("Input.insertText", text=text)
        key = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13, "text": "\r"}
        self._ask("Input.dispatchKeyEvent", type="keyDown", **key)
        self._ask("Input.dispatchKeyEvent", type="keyUp", **key)

    def middle(self, element: str) -> tuple[float, float]:
        """Scroll to an element (JavaScript expression) and return its center."""
        self.run(f"{element}.scrollIntoView({{ block: 'nearest' }})")
        box = self.run(f"{element}.getBoundingClientRect().toJSON()")
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def picture(self, file: Path) -> None:
        data = self._ask("Page.captureScreenshot", format="png")["data"]
        file.write_bytes(base64.b64decode(data))

    def complaints(self) -> list[str]:
        """Return the errors and warnings of the page console."""
        self.run("0")
        return [text for level, text in self.said if level in LOUD]

    def _mouse(self, kind: str, point) -> None:
        x, y = (float(own) for own in point)
        pressed = {"button": "none" if kind == "mouseMoved" else "left", "clickCount": 1}
        self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=1, **pressed)

    def _ask(self, method: str, **values) -> dict:
        self._count += 1
        message = {"id": self._count, "method": method, "params": values}
        if self._session:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(SECONDS))
            if answer.get("id") == self._count:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._hear(answer)

    def _hear(self, event: dict) -> None:
        values = event.get("params", {})
        if event.get("method") == "Runtime.consoleAPICalled":
            text = " ".join(str(part.get("value", "")) for part in values["args"])
            self.said.append((values["type"], text))
        elif event.get("method") == "Runtime.exceptionThrown":
            self.said.append(("error", json.dumps(values["exceptionDetails"])[:500]))
        elif event.get("method") == "Log.entryAdded":
            self.said.append((values["entry"]["level"], values["entry"]["text"]))
        elif event.get("method") == "Page.frameNavigated":
            self.said.clear()


def _end_with_parent() -> None:
    """Make Linux kill this process when its parent process ends."""
    if sys.platform == "linux":
        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)
