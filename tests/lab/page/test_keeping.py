"""What is seen in the page is saved as a picture."""

from __future__ import annotations

import base64
from io import BytesIO
from xml.etree import ElementTree

from PIL import Image
from tests.lab.browser import Browser, needs_browser

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
def test_the_picture_is_saved_as_lines_and_as_points(page: Browser) -> None:
    page.press(" ")
    # Saved at once: a moment later the view may have moved on to what is still computed.
    page.until(
        "lab.probeState().force[2] > 0.02 && lab.hasCurrentPictures && !lab.section.label"
        " && lab.section.covers(lab.sectionBox()) && (globalThis.saved = lab.toSvg())"
    )
    root = ElementTree.fromstring(page.ask("saved"))
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
