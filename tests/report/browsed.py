"""Report pages in a real browser: screenshots of elements, and where their parts are printed."""

from __future__ import annotations

import base64
import io
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread
from numpy.typing import NDArray
from tests.lab.browser import Browser

Image = NDArray[np.float64]
"""Rows, columns and red, green, blue in [0, 1]."""
PAPER = {"paperWidth": 8.27, "paperHeight": 11.69}  # A4 [inch]


def open_page(browser: Browser, path: Path, width: int, *, dark: bool = False) -> None:
    """Open a page in a window of a width [px]."""
    browser.resize(width, 900, dark=dark)
    # A screenshot beyond the window has none, and would be wider than the page that was measured.
    browser.call("Emulation.setScrollbarsHidden", hidden=True)
    browser.call("Page.navigate", url=path.as_uri())
    browser.until(f"document.readyState === 'complete' && location.href === {path.as_uri()!r}")
    browser.ask("document.fonts.ready.then(() => true)")


def shoot(browser: Browser, x: float, y: float, width: float, height: float) -> Image:
    """Return a rectangle of the page [px], also outside the window."""
    clip = {"x": x, "y": y, "width": width, "height": height, "scale": 1}
    shot = browser.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
    pixels: Image = imread(io.BytesIO(base64.b64decode(shot["data"])), format="png")
    return pixels[..., :3].astype(float)


@dataclass(frozen=True)
class Shot:
    """A picture of a page.

    Attributes:
        title: heading of its section.
        image: pixels of the visible part of its frame.
        ground: colour of the frame.
        panels: left, top, right and bottom border of its panels [px], with their numbers.
    """

    title: str
    image: Image
    ground: Image
    panels: list[tuple[tuple[int, int, int, int], dict[str, Any]]]


_PICTURES = """[...document.querySelectorAll("figure")].map((figure) => {
  const title = figure.closest("section").querySelector("h2, h3").textContent;
  const view = figure.querySelector(".view"), svg = view.querySelector("svg");
  if (%(title)s && title !== %(title)s) return null;
  if (%(end)s && view.scrollWidth <= view.clientWidth + 1) return null;
  if (%(end)s) view.scrollLeft = view.scrollWidth;
  const frame = view.getBoundingClientRect(), to = svg.getScreenCTM();
  return { title,
    frame: [frame.left + scrollX, frame.top + scrollY, frame.width, frame.height],
    ground: getComputedStyle(figure).backgroundColor,
    panels: JSON.parse(figure.querySelector("script").textContent).map((panel) => {
      const [x, y, width, height] = panel.box;
      const corners = [new DOMPoint(x, y), new DOMPoint(x + width, y + height)];
      const [a, b] = corners.map((corner) => corner.matrixTransform(to));
      return [[a.x - frame.left, a.y - frame.top, b.x - frame.left, b.y - frame.top], panel];
    }) };
}).filter((one) => one)"""


def pictures(browser: Browser, *, title: str = "", end: bool = False) -> list[Shot]:
    """Return the pictures of the open page.

    Args:
        browser: shows the page.
        title: heading of the section of the one that is returned.
        end: whether only those that scroll are returned, scrolled to their right end.
    """
    shots = []
    for one in browser.ask(_PICTURES % {"title": json.dumps(title), "end": json.dumps(end)}):
        image = shoot(browser, *one["frame"])
        ground = np.array([int(part) for part in re.findall(r"\d+", one["ground"])[:3]]) / 255.0
        panels = [(tuple(round(side) for side in box), panel) for box, panel in one["panels"]]
        shots.append(Shot(one["title"], image, ground, panels))
    return shots


def content(image: Image, ground: Image) -> NDArray[np.bool_]:
    """Return where an image differs from the colour of its ground."""
    return np.abs(image - ground).max(axis=-1) > 0.06


def edges(image: Image) -> NDArray[np.bool_]:
    """Return where the brightness of an image changes from pixel to pixel."""
    down, right = np.gradient(image.mean(axis=-1))
    return np.hypot(down, right) > 0.04


def grow(mask: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """Return a mask grown by a number of pixels on all sides."""
    for _ in range(steps):
        padded = np.pad(mask, 1)
        mask = padded[1:-1, 1:-1] | padded[:-2, 1:-1] | padded[2:, 1:-1]
        mask |= padded[1:-1, :-2] | padded[1:-1, 2:]
    return mask


_MARK = """(() => {
  const blocks = "p:not(.note), li, dt, tbody td, .view, pre";
  let count = 0;
  const mark = (element, name) => {
    const link = document.createElement("a");
    link.href = "mark:" + name;
    if (element.matches(".view")) link.style.display = "block";
    link.append(...element.childNodes);
    element.append(link);
  };
  for (const heading of document.querySelectorAll("h2, h3")) {
    const first = [...document.querySelectorAll(blocks)].find((one) =>
      (one.matches(".view") || one.textContent.trim())
      && heading.compareDocumentPosition(one) & Node.DOCUMENT_POSITION_FOLLOWING);
    if (!first || first.querySelector("a")) continue;
    const last = first.closest("table")?.querySelector("tbody tr:last-child > :first-child");
    mark(first, "content" + count);
    if (last && !last.querySelector("a")) mark(last, "end" + count);
    mark(heading, "heading" + count++);
  }
  return count;
})()"""


def printed_places(browser: Browser) -> dict[str, list[tuple[int, float, float]]]:
    """Return page, upper and lower border [pt] of headings and of what follows them, on paper.

    "heading0", "content0", and for a table "end0", its last row.

    Links mark headings and the first line or picture of their content; a printed page lists the
    rectangles of its links.
    """
    count = browser.ask(_MARK)
    pdf = base64.b64decode(browser.call("Page.printToPDF", **PAPER)["data"])
    objects = dict(re.findall(rb"(?:^|\n)(\d+) 0 obj\n(.*?)\nendobj", pdf, re.DOTALL))
    pages = [text for text in objects.values() if re.match(rb"<</Type /Page\b", text)]
    places: dict[str, list[tuple[int, float, float]]] = {}
    for number, page in enumerate(pages):
        listed = re.search(rb"/Annots \[(.*?)\]", page, re.DOTALL)
        for link in re.findall(rb"(\d+) 0 R", listed[1]) if listed else ():
            found = re.search(
                rb"/Rect \[\S+ (\S+) \S+ (\S+)\].*?\(mark:(\w+)\)", objects[link], re.DOTALL
            )
            if found is not None:
                place = (number, float(found[2]), float(found[1]))
                places.setdefault(found[3].decode(), []).append(place)
    assert len({name for name in places if name.startswith("heading")}) == count > 0
    return places


def lonely_headings(places: dict[str, list[tuple[int, float, float]]]) -> list[str]:
    """Return the headings whose content begins on a later page."""
    return [
        name
        for name in places
        if name.startswith("heading")
        and places[name][-1][0] != places[name.replace("heading", "content")][0][0]
    ]


def torn_tables(places: dict[str, list[tuple[int, float, float]]]) -> list[str]:
    """Return the tables whose last row is on a later page than the first."""
    return [
        name
        for name in places
        if name.startswith("end")
        and places[name][0][0] != places[name.replace("end", "content")][0][0]
    ]
