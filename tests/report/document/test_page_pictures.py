"""Pictures and tables of report pages in a browser, at 400 and 1280 pixels, dark and on paper.

Checks compare shares and places of pixels, not pixels: fonts differ between machines. Each check
has a control: a page that is broken on purpose, in which it finds the fault.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.lab.browser import Browser, needs_browser
from tests.report.browsed import (
    Image,
    Shot,
    content,
    edges,
    grow,
    lonely_headings,
    open_page,
    pictures,
    printed_places,
    torn_tables,
)

import asperity as asp
from asperity.report import html_text

pytestmark = needs_browser
DATA = Path(__file__).parents[4] / "shared" / "data"
WIDTHS = (1280, 400)


@pytest.fixture(scope="module")
def land_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of a cut-out of a measured surface."""
    if not DATA.is_dir():
        pytest.skip("not run: the real surfaces of ../shared/data are not there")
    folder = tmp_path_factory.mktemp("land")
    whole = asp.load_texture(DATA / "sample-land.x3p", pitch=60e-6)
    np.save(folder / "sample-land.npy", whole.heights[80:176, 300:480])
    cut = asp.load_texture(folder / "sample-land.npy", pitch=60e-6, unit="m")
    path = folder / "land.html"
    path.write_text(html_text(asp.compare(cut, device="touch", laws="WAC")), "utf-8")
    return path


@pytest.fixture
def cloth_page(report_pages: dict[str, Path]) -> Path:
    return report_pages["comparison"]


ShootPage = Callable[..., list[Shot]]


@pytest.fixture(scope="module")
def shoot_page(browser: Browser) -> ShootPage:
    """Return a function that returns the pictures of a page, taken once for each look."""

    @cache
    def shoot(path: Path, width: int = 1280, dark: bool = False, end: bool = False) -> list[Shot]:
        open_page(browser, path, width, dark=dark)
        return pictures(browser, end=end)

    return shoot


@pytest.fixture(params=["cloth_page", "land_page"])
def page(request: pytest.FixtureRequest) -> Path:
    path: Path = request.getfixturevalue(request.param)
    return path


# --- content of pictures --------------------------------------------------------------------------


def blank_pictures(shots: list[Shot]) -> list[str]:
    """Return the pictures that are blank, or of which a half is."""
    blank = []
    for shot in shots:
        ink = content(shot.image, shot.ground)
        rows, columns = (size // 2 for size in ink.shape)
        halves = [ink[:rows], ink[rows:], ink[:, :columns], ink[:, columns:]]
        if ink.mean() < 0.01 or min(half.mean() for half in halves) < 0.004:
            blank.append(shot.title)
    return blank


def empty_panels(shots: list[Shot]) -> list[str]:
    """Return the panels without visible data in the middle of their frame."""
    empty = []
    for shot in shots:
        height, width = shot.image.shape[:2]
        for (left, top, right, bottom), panel in shot.panels:
            if left < 0 or top < 0 or right > width or bottom > height:
                continue  # scrolled away
            inner = shot.image[top + 3 : bottom - 3, left + 3 : right - 3]
            ink = content(inner, shot.ground)
            if ink.mean() < 0.002 or np.ptp(np.flatnonzero(ink.any(axis=0))) < 0.3 * (right - left):
                empty.append(f"{shot.title}: {panel['name']}")
    return empty


def outside_frame(shots: list[Shot]) -> list[str]:
    """Return the panels of which less than 9 in 10 finite points lie within the axes."""
    outside = []
    for shot in shots:
        for _box, panel in shot.panels:
            for series in panel["series"]:
                y = np.array([value for value in series["y"] if value is not None])
                inside = (y >= panel["y"]["low"]) & (y <= panel["y"]["high"])
                if y.size and inside.mean() < 0.9:
                    outside.append(f"{shot.title}: {panel['name']} {series['name']}")
    return outside


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True])
def test_every_picture_shows_its_content(
    shoot_page: ShootPage, page: Path, width: int, dark: bool
) -> None:
    shots = shoot_page(page, width, dark)
    assert len(shots) == 8
    assert blank_pictures(shots) == []
    for some in (shots, shoot_page(page, width, dark, end=True)):
        assert empty_panels(some) == []
        assert outside_frame(some) == []


def test_surface_has_no_blank_half(browser: Browser, shoot_page: ShootPage, page: Path) -> None:
    """Map and section together fill nine tenths of the frame's width and height."""
    shot = next(one for one in shoot_page(page) if one.title == "The surface")
    assert filled_sides(shot) > (0.9, 0.85)
    open_page(browser, page, 1280)
    browser.ask("document.querySelector('figure svg').style.clipPath = 'inset(0 50% 0 0)'")
    (shot,) = pictures(browser, title="The surface")
    assert filled_sides(shot)[0] < 0.65


def filled_sides(shot: Shot) -> tuple[float, float]:
    """Return the shares of columns and rows, in tenths of the picture, that show anything."""
    ink = content(shot.image, shot.ground)
    parts = [np.array_split(ink, 20, axis=axis) for axis in (1, 0)]
    across, down = (np.mean([part.mean() > 0.002 for part in each]) for each in parts)
    return float(across), float(down)


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("svg > g { visibility: hidden }", blank_pictures),
        ("svg { clip-path: inset(0 50% 0 0) }", blank_pictures),
        ("svg { clip-path: inset(50% 0 0 0) }", blank_pictures),
        ("svg path[clip-path], svg g[clip-path], svg image { visibility: hidden }", empty_panels),
    ],
)
def test_blank_picture_is_detected(
    browser: Browser, cloth_page: Path, fault: str, check: Callable[[list[Shot]], list[str]]
) -> None:
    open_page(browser, cloth_page, 1280)
    add_style(browser, fault)
    assert len(check(pictures(browser))) >= 4


def test_data_outside_the_frame_are_detected(shoot_page: ShootPage, cloth_page: Path) -> None:
    shots = [replace(shot, panels=deepcopy(shot.panels)) for shot in shoot_page(cloth_page)]
    for shot in shots:
        for _box, panel in shot.panels:
            panel["y"]["high"] = panel["y"]["low"]
    assert len(outside_frame(shots)) >= 4


def add_style(browser: Browser, text: str) -> None:
    """Add a style to the open page."""
    browser.ask(
        "document.head.append(Object.assign(document.createElement('style'),"
        f"{{ textContent: {text!r} }})) || document.body.offsetHeight"
    )


# --- light and dark -------------------------------------------------------------------------------


def structure_differences(light: list[Shot], dark: list[Shot]) -> list[str]:
    """Return the pictures whose edges are not at the same places in light and in dark."""
    different = []
    for one, other in zip(light, dark, strict=True):
        if one.image.shape != other.image.shape:
            different.append(one.title)
            continue
        first, second = edges(one.image), edges(other.image)
        shared = [(a & grow(b, 2)).sum() / a.sum() for a, b in ((first, second), (second, first))]
        if min(shared) < 0.78:
            different.append(f"{one.title}: {min(shared):.2f}")
    return different


def test_light_and_dark_differ_in_colour_alone(shoot_page: ShootPage, page: Path) -> None:
    light = shoot_page(page)
    dark = shoot_page(page, dark=True)
    assert structure_differences(light, dark) == []
    for one, other in zip(light, dark, strict=True):
        assert brightness(one.image) > brightness(other.image) + 0.1
        assert one.ground.mean() > 0.9
        assert other.ground.mean() < 0.2


def brightness(image: Image) -> float:
    return float(image.mean())


@pytest.mark.parametrize(
    "fault",
    [
        "svg path[clip-path] { visibility: hidden }",
        "svg > g { transform: translateX(12px) }",
        "svg text, svg use { visibility: hidden }",
    ],
)
def test_other_structure_in_dark_is_detected(
    browser: Browser, shoot_page: ShootPage, cloth_page: Path, fault: str
) -> None:
    light = shoot_page(cloth_page)
    open_page(browser, cloth_page, 1280, dark=True)
    add_style(browser, fault)
    assert structure_differences(light, pictures(browser))


# --- width ----------------------------------------------------------------------------------------

_OVERFLOW = """(() => {
  const limit = document.documentElement.clientWidth;
  const wide = [...document.querySelectorAll("main *")].filter((one) =>
    one.getBoundingClientRect().right > limit + 1 && !one.closest(".scroll, .view"));
  const excess = document.documentElement.scrollWidth - limit;
  return [excess, wide.map((one) => one.outerHTML.slice(0, 80))];
})()"""
_COLUMNS = """[...document.querySelectorAll("table")].map((table) => {
  const scroll = table.closest(".scroll"), row = table.rows[0];
  const rights = () => [...row.cells].map((cell) => [cell.textContent.trim(), cell.offsetWidth
    ? cell.getBoundingClientRect().right - scroll.getBoundingClientRect().right : null]);
  const first = rights();
  scroll.scrollLeft = scroll.scrollWidth;
  return [first, rights(), scroll.scrollWidth <= scroll.clientWidth + 1 || scroll.tabIndex === 0];
})"""


def overflowing(browser: Browser) -> list[str]:
    """Return what is wider than the window outside of tables and pictures, which scroll."""
    excess, elements = browser.ask(_OVERFLOW)
    return [*elements, *(["the page"] if excess > 0 else [])]


def unreachable_columns(browser: Browser) -> list[str]:
    """Return the columns that are not seen at the end of scrolling, or at once in the summary."""
    browser.until("document.querySelectorAll('.scroll').length > 0")
    unreachable = []
    for first, last, by_keyboard in browser.ask(_COLUMNS):
        names = [name for name, right in last if right is not None and right > 1]
        if any(name == "felt?" for name, _right in first):
            names += [name for name, right in first if right is not None and right > 1]
            shown = {name for name, right in first if right is not None}
            names += sorted({"felt?", "leak", "clicks?", "start at"} - shown)
        unreachable += names if by_keyboard else [*names, "not by the keyboard"]
    return unreachable


@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_wider_than_the_window(
    browser: Browser, report_pages: dict[str, Path], land_page: Path, width: int
) -> None:
    for path in (*report_pages.values(), land_page):
        browser.said.clear()
        open_page(browser, path, width)
        assert (path.name, overflowing(browser)) == (path.name, [])
        assert (path.name, browser.said) == (path.name, [])  # no script stopped


@pytest.mark.parametrize("width", WIDTHS)
def test_every_column_can_be_read(browser: Browser, page: Path, width: int) -> None:
    open_page(browser, page, width)
    assert unreachable_columns(browser) == []


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("h2 { width: 900px }", overflowing),
        (".answer { white-space: nowrap }", overflowing),
        (
            ".scroll { overflow: hidden } table { position: relative; left: 200px }",
            unreachable_columns,
        ),
        ("th, td { min-width: 90px }", unreachable_columns),
        ("th:nth-child(5), td:nth-child(5) { display: none }", unreachable_columns),
    ],
)
def test_too_wide_page_is_detected(
    browser: Browser, cloth_page: Path, fault: str, check: Callable[[Browser], list[str]]
) -> None:
    open_page(browser, cloth_page, 400)
    add_style(browser, fault)
    assert check(browser)


# --- pictures in a narrow window ------------------------------------------------------------------

_NARROW = """[...document.querySelectorAll("figure")].map((figure) => {
  const view = figure.querySelector(".view"), svg = view.querySelector("svg");
  const boxOf = (one) => { const b = one.getBoundingClientRect();
    return [b.left, b.top, b.right, b.bottom]; };
  const glyphsIn = (one) => [...one.querySelectorAll("g[transform]")].filter((label) =>
    /scale\\(0\\.\\d+ -0\\.\\d+\\)/.test(label.getAttribute("transform"))
    && getComputedStyle(label).visibility !== "hidden" && !label.closest("defs"));
  const labelsIn = (one) => glyphsIn(one).map(boxOf);
  return { title: figure.closest("section").querySelector("h2, h3").textContent,
    scrolls: view.scrollWidth > view.clientWidth + 1, inCard: !!figure.closest(".cards"),
    text: Math.min(...glyphsIn(svg).map((label) => label.getScreenCTM())
      .map((matrix) => 100 * Math.hypot(matrix.a, matrix.b))),
    frame: boxOf(svg), labels: labelsIn(svg),
    axes: [...svg.querySelectorAll(".shared")].map(labelsIn) };
})"""


def unreadable_pictures(browser: Browser) -> list[str]:
    """Return the pictures that scroll, have text below 8 px, or labels outside or overlapping."""
    found = []
    for one in browser.ask(_NARROW):
        left, top, right, bottom = one["frame"]
        outside = [
            label
            for label in one["labels"]
            if label[0] < left - 1
            or label[2] > right + 1
            or label[1] < top - 1
            or label[3] > bottom + 1
        ]
        overlapping = [
            (a, b)
            for labels in one["axes"]
            for number, a in enumerate(labels)
            for b in labels[:number]
            if min(a[2], b[2]) - max(a[0], b[0]) > 0.5 and min(a[3], b[3]) - max(a[1], b[1]) > 2.5
        ]
        faults = {
            "scrolls": one["scrolls"],
            "small text": one["text"] < 8.0,
            "no labels": not one["labels"],
            "labels outside": outside,
            "labels overlap": overlapping,
        }
        found += [f"{one['title']}: {name} {fault}" for name, fault in faults.items() if fault]
    return found


def test_pictures_are_drawn_for_a_narrow_window(
    browser: Browser, report_pages: dict[str, Path], land_page: Path
) -> None:
    for name, path in {**report_pages, "land": land_page}.items():
        if name == "surfaces":
            continue  # small pictures in cards, which fit as they are
        browser.said.clear()
        open_page(browser, path, 400)
        assert (name, unreadable_pictures(browser)) == (name, [])
        assert browser.said == []


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (".view svg { min-width: 44rem !important }", "scrolls"),
        (".view svg { width: 15rem !important }", "small text"),
        ("svg .shared { transform: translateX(300px) }", "labels outside"),
    ],
)
def test_unreadable_picture_is_detected(
    browser: Browser, cloth_page: Path, fault: str, name: str
) -> None:
    open_page(browser, cloth_page, 400)
    add_style(browser, fault)
    assert any(name in one for one in unreadable_pictures(browser))


def test_pictures_follow_the_width_of_the_window(browser: Browser, cloth_page: Path) -> None:
    """A turned phone gets the wide picture, with tools and without the hidden law, and back."""
    boxes = (
        "[...document.querySelectorAll('.view > svg')].map((svg) => svg.getAttribute('viewBox'))"
    )
    open_page(browser, cloth_page, 400)
    narrow = browser.ask(boxes)
    browser.ask("document.querySelector('.laws [name=A]').click()")
    browser.resize(1280, 900)
    browser.until(f"{boxes}.every((box) => box.startsWith('0 0 720 '))")
    assert browser.ask("document.querySelectorAll('figure > .tools').length") == len(narrow)
    hidden = "document.querySelector('figure g[data-law=A]').getAttribute('visibility')"
    assert browser.ask(hidden) == "hidden"
    browser.resize(400, 900)
    browser.until(f"{boxes}.join() === {','.join(narrow)!r}")
    assert browser.said == []


# --- paper ----------------------------------------------------------------------------------------

OFFSETS = (0, 130, 260, 390, 520)
"""Heights of a block before the page [px], so that headings come to lie at other places."""
_BREAKS = """* { break-before: auto !important; break-after: auto !important }
section { break-inside: auto !important }"""


def print_shifted(browser: Browser, path: Path, offset: int, fault: str = "") -> Any:
    """Return the places of headings on paper, below a block of a height [px]."""
    open_page(browser, path, 1280)
    add_style(browser, f"main {{ padding-top: {offset}px !important }} {fault}")
    return printed_places(browser)


def test_no_heading_is_alone_at_the_foot_of_a_page_and_no_table_is_torn(
    browser: Browser, page: Path
) -> None:
    for offset in OFFSETS:
        places = print_shifted(browser, page, offset)
        assert (offset, lonely_headings(places), torn_tables(places)) == (offset, [], [])
        split = [name for name, parts in places.items() if len({one[0] for one in parts}) > 1]
        assert split == []


def test_lonely_heading_and_torn_table_are_detected(browser: Browser, cloth_page: Path) -> None:
    """Without the rules of the style, some offset leaves a heading alone, or tears a table."""
    found = [print_shifted(browser, cloth_page, one, _BREAKS) for one in OFFSETS]
    assert any(map(lonely_headings, found))
    assert any(map(torn_tables, found))
