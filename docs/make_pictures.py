"""Draw the pictures of README: ``python docs/make_pictures.py``.

``fields.png`` is drawn by Matplotlib; ``report.png`` and ``lab.png`` are screenshots that need
chromium.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import asperity as asp
from asperity.report import plot

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.lab.browser import Browser

HERE = Path(__file__).parent / "_static"
TEXTURE = asp.Sinusoid(amplitude=0.4e-3, period=1.5e-3)
_LAB_START, _LAB_DURATION = 30.0, 6.0  # [s] to compile the loop; of strokes before the picture


def write_fields() -> None:
    """Write fields.png: the force of four laws over its curl."""
    figure = plot(asp.compare(TEXTURE, laws="ACDH"), picture="field")
    figure.savefig(HERE / "fields.png", dpi=110)


def write_screenshot(address: str, name: str, size: tuple[int, int], keys: str = "") -> None:
    """Write a screenshot of a page, after pressing keys and waiting if there are any."""
    with tempfile.TemporaryDirectory() as folder, Browser(address, Path(folder), size) as browser:
        time.sleep(_LAB_START if keys else 2.0)
        for key in keys:
            browser.press(key)
        time.sleep(_LAB_DURATION if keys else 0.0)
        (HERE / name).write_bytes(browser.picture())


def write_report() -> None:
    """Write report.png: the first screen of a comparison's report."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "report.html")
        asp.compare(TEXTURE).to_html(path)
        write_screenshot(path.as_uri(), "report.png", (1000, 1000))


def write_lab() -> None:
    """Write lab.png: the lab while the hand strokes a texture."""
    surface = "sinusoid:amplitude=0.2mm,period=2mm"
    command = [sys.executable, "-m", "asperity", "lab", surface, "--law", "A", "--no-browser"]
    lab = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert lab.stderr is not None
        address = next(word for line in lab.stderr for word in line.split() if "http" in word)
        threading.Thread(target=lab.stderr.read, daemon=True).start()
        write_screenshot(address, "lab.png", (1280, 900), "m")
    finally:
        lab.terminate()
        lab.wait()


if __name__ == "__main__":
    write_fields()
    write_report()
    write_lab()
