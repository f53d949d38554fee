"""What was felt is kept and shown again in the page, and what is seen is saved as a picture."""

from __future__ import annotations

import base64
import zipfile
from io import BytesIO
from xml.etree import ElementTree

from PIL import Image
from tests.lab.browser import Browser, needs_browser

from asperity.lab.clips import HAND_FILE, RECORDING_FILE, SCENE_FILE

SVG = "{http://www.w3.org/2000/svg}"


def fetched(page: Browser, what: str) -> bytes:
    """Return the bytes of what a script promises as a blob."""
    script = (
        f"(async () => {{ const blob = await {what}; const bytes = new Uint8Array(await"
        " blob.arrayBuffer()); let text = ''; for (const one of bytes) text +="
        " String.fromCharCode(one); return btoa(text); })()"
    )
    return base64.b64decode(page.ask(script))


@needs_browser
def test_the_last_seconds_are_kept_and_shown_again(page: Browser) -> None:
    page.until("lab.status?.state === 'running' && !lab.probeState().isInside")
    page.press(" ")
    page.until("lab.probeState().force[2] > 0.02")
    page.press(" ")
    page.until("!lab.probeState().isInside && lab.probeState().probe[2] > 2e-4")
    page.press("k")
    page.until("document.querySelector('#clips a') !== null")
    href = page.ask("document.querySelector('#clips a').getAttribute('href')")
    archive = zipfile.ZipFile(BytesIO(fetched(page, f"(await fetch('{href}')).blob()")))
    assert archive.namelist() == [RECORDING_FILE, SCENE_FILE, HAND_FILE]
    page.ask("document.querySelector('#clips button').click()")
    page.until("lab.player.isOpen && lab.player.isPlaying && lab.player.time > 0.1")
    page.press("j")
    assert not page.ask("lab.player.isPlaying")
    # By the slider, to the moment of the greatest force: it is what was felt.
    page.until("lab.player.playback.ensureLoaded(0, lab.player.playback.rowCount)")
    page.ask(
        "(() => { const at = document.getElementById('playback-time');"
        "const { playback } = lab.player;"
        "const z = row => playback.row(row)[playback.columns['applied z']]; let most = 1;"
        "for (let k = 1; k < playback.rowCount; k++) if (z(k) > z(most)) most = k;"
        "at.value = most + 1;"
        "at.dispatchEvent(new Event('input')); })()"
    )
    assert page.ask("lab.probeState().force[2]") > 0.01
    assert page.ask("Number.isFinite(lab.frame.closest[2])")
    page.press("l")
    page.until("!lab.player.isOpen && !lab.probeState().isInside")
    assert page.said == []


@needs_browser
def test_the_picture_is_saved_as_lines_and_as_points(page: Browser) -> None:
    page.press(" ")
    page.until("lab.probeState().force[2] > 0.02 && lab.hasCurrentPictures")
    root = ElementTree.fromstring(page.ask("lab.toSvg()"))
    views = root.findall(f"{SVG}svg")
    counts = [
        {name: len(view.findall(f"{SVG}{name}")) for name in ("path", "image", "text")}
        for view in views
    ]
    relief, cut, traces, spectrum = counts
    assert relief["image"] == 1
    assert cut["image"] == 1  # the colours of the curl; field, outline, probe and force are paths
    assert min(relief["path"], cut["path"]) >= 5
    assert cut["text"] == 1
    assert traces["image"] == spectrum["image"] == 0
    assert min(traces["text"], spectrum["path"]) > 3
    red = page.ask("getComputedStyle(document.documentElement).getPropertyValue('--red').trim()")
    assert any(path.get("fill") == red for path in views[1].findall(f"{SVG}path"))
    # The page goes on with its own canvas.
    page.until("lab.section.scaledCanvas.context instanceof CanvasRenderingContext2D")
    width, height = Image.open(BytesIO(fetched(page, "lab.toPng()"))).size
    assert (width, height) > (300, 600)
    page.press(" ")
    assert page.ask("lab.errorCount") == 0
