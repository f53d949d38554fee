"""A real browser without a window, driven by its own protocol; not run where there is none."""

from __future__ import annotations

import base64
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pytest
from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next((found for found in map(shutil.which, NAMES) if found), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="not run: no browser (chromium) here")
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-port=0",
)
PATIENCE = 180.0


class Browser:
    """A page in a browser; use it in a ``with``.

    Args:
        address: of the page.
        home: folder for the browser's own files.
        size: of the window [px].
    """

    def __init__(self, address: str, home: Path, size: tuple[int, int] = (1280, 900)) -> None:
        self.said: list[str] = []
        self._numbers = itertools.count(1)
        window = f"--window-size={size[0]},{size[1]}"
        command = [str(BROWSER), *_FLAGS, f"--user-data-dir={home}", window, "about:blank"]
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._open = ExitStack()
        try:
            line = connect(self._place(home), max_size=None, compression=None, proxy=None)
            self._line = self._open.enter_context(line)
            for domain in ("Runtime", "Log", "Page"):
                self.call(f"{domain}.enable")
            self.resize(*size)
            self.call("Page.navigate", url=address)
        except BaseException:  # also for an interrupt
            self._process.kill()
            raise

    def _place(self, home: Path) -> str:
        """Return the address by which the one page is driven."""
        found = home / "DevToolsActivePort"
        until(lambda: found.exists() and len(found.read_text().split()) > 1)
        port = found.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
            pages = json.load(answer)
        return str(next(page for page in pages if page["type"] == "page")["webSocketDebuggerUrl"])

    def call(self, method: str, **parameters: Any) -> Any:
        """Say something, and return the answer."""
        number = next(self._numbers)
        self._line.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self._line.recv(timeout=PATIENCE))
            if told.get("id") == number:
                assert "error" not in told, told
                return told["result"]
            self._note(told)

    def _note(self, told: dict[str, Any]) -> None:
        """Keep what goes wrong in the page."""
        if "method" not in told:
            return  # an answer that nobody waits for
        if told["method"] == "Runtime.exceptionThrown":
            self.said.append(str(told["params"]["exceptionDetails"]))
        elif told["method"] == "Log.entryAdded" and told["params"]["entry"]["level"] == "error":
            self.said.append(told["params"]["entry"]["text"])

    def ask(self, script: str) -> Any:
        """Return what an expression is, or what it promises."""
        told = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in told, told["exceptionDetails"]
        return told["result"].get("value")

    def until(self, script: str, patience: float = PATIENCE) -> None:
        """Wait until an expression is true."""
        until(lambda: bool(self.ask(script)), patience, script)

    def let_loop_run(self, duration: float) -> None:
        """Wait for a time of the loop [s], which may be faster than that of the system."""
        end = self.ask("lab.frame.newest[0]") + duration
        self.until(f"lab.frame.newest[0] > {end}")

    def let_drawings_settle(self) -> None:
        """Wait until relief and section are painted in the size of their places, which stay."""
        self.until(
            "[lab.relief, lab.section].every(({ scaledCanvas: s }) => "
            "!s.needsRepaint && Math.abs(s.width * s.unit - s.element.clientWidth) < 1"
            " && Math.abs(s.height * s.unit - s.element.clientHeight) < 1)"
        )
        places = (
            "JSON.stringify(['relief', 'section'].map("
            "name => document.getElementById(name).getBoundingClientRect()))"
        )
        self.until(
            f"(async () => {{ const before = {places};"
            "for (let k = 0; k < 10; k++) await new Promise(requestAnimationFrame);"
            f"return before === {places}; }})()"
        )

    def expect_text(self, name: str, text: str, *, exact: bool = True) -> None:
        """Wait until the element of an id has a text, or begins with it."""
        content = f"document.getElementById('{name}').textContent"
        reached = f"=== {text!r}" if exact else f".startsWith({text!r})"
        end = time.monotonic() + PATIENCE
        while not self.ask(f"{content}{reached}"):
            assert time.monotonic() < end, f"{name}: {self.ask(content)!r}, not {text!r}"
            time.sleep(0.02)

    def resize(self, width: int, height: int, *, dark: bool = False) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def press(self, key: str) -> None:
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def mouse(self, kind: str, x: float, y: float, buttons: int = 0, **more: Any) -> None:
        button = "left" if kind != "mouseMoved" or buttons else "none"
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button=button,
            buttons=buttons,
            clickCount=1,
            **more,
        )

    def picture(self) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot")["data"])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._open.close()
        self._process.terminate()
        self._process.wait()


def until(reached: Callable[[], bool], patience: float = PATIENCE, what: str = "it") -> None:
    """Wait for something."""
    end = time.monotonic() + patience
    while not reached():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.02)
