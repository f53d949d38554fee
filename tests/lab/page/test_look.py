"""What the page shows, pixel by pixel, against heights and formulas from here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from tests.lab.browser import Browser, needs_browser

from asperity.core.checks import FloatArray
from asperity.scene import load_scene

WAVE = "sinusoid:amplitude=0.15mm,period=3mm,direction=0.8 0.6"
"""Falls together with none of the picture's own directions."""
Heights = Callable[[FloatArray, FloatArray], FloatArray]


def shown(page: Browser, name: str) -> FloatArray:
    """Return the pixels of a view (rows, columns, 3)."""
    page.let_drawings_settle()
    box = page.ask(f"document.getElementById('{name}').getBoundingClientRect().toJSON()")
    whole = np.asarray(Image.open(BytesIO(page.picture())).convert("RGB"), float)
    top, left = round(box["y"]), round(box["x"])
    return whole[top : top + int(box["height"]), left : left + int(box["width"])]


def colour(page: Browser, name: str) -> FloatArray:
    """Return a colour of the style sheet."""
    text = page.ask(f"getComputedStyle(document.documentElement).getPropertyValue('--{name}')")
    return np.array([int(text.strip()[k : k + 2], 16) for k in (1, 3, 5)], float)


def change(page: Browser, name: str, value: str) -> None:
    """Type a value into a field, and wait until the page shows what it does."""
    version = page.ask("lab.status.surface_version")
    page.ask(
        f"{{ const field = document.getElementById('{name}'); field.value = '{value}';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until(f"lab.status.settings['{name}'] == '{value}' && lab.status.state == 'running'")
    page.until(f"lab.status.surface_version > {version} && lab.hasCurrentPictures")


def height_of(surface: str) -> Heights:
    texture = load_scene(surface).texture

    def height(x: FloatArray, y: FloatArray) -> FloatArray:
        return texture.height(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)

    return height


def relief(page: Browser, height: Heights, wide: int, high: int) -> FloatArray:
    """Return the picture of a surface as it should be; NaN where nothing is."""
    seen = page.ask("(({ x, y, size }) => ({ x, y, size }))(lab.relief)")
    skew, left = 0.16 * wide, 0.03 * wide
    across, rise = 0.94 * wide - skew, 0.1 * high
    bottom, deep = 0.97 * high - rise, 0.97 * high - 2.3 * rise
    along = np.linspace(-0.5, 0.5, 96) * seen["size"]
    most = np.abs(height(*np.meshgrid(seen["x"] + along, seen["y"] + along))).max()
    lift = min(rise / most, 40.0 * across / seen["size"])
    v = np.linspace(0.0, 1.0, 2000)[:, None]
    u = (np.arange(wide) + 0.5 - left - v * skew) / across
    x, y = (
        seen["x"] + (u - 0.5) * seen["size"],
        np.broadcast_to(seen["y"] + (v - 0.5) * seen["size"], u.shape),
    )
    step, steep = 1e-7, lift * seen["size"] / across
    sx = (height(x + step, y) - height(x - step, y)) / (2.0 * step) * steep
    sy = (height(x, y + step) - height(x, y - step)) / (2.0 * step) * steep
    bright = np.clip((0.8 - 0.55 * sx - 0.25 * sy) / np.sqrt(1.0 + sx**2 + sy**2) / 1.02, 0.0, 1.0)
    lines = bottom - v * deep - lift * height(x, y)
    lines[(u < 0.0) | (u > 1.0)] = np.inf
    low, top = colour(page, "low"), colour(page, "high")
    picture = np.full((high, wide, 3), np.nan)
    for column in range(wide):
        # Seen is what comes first from the front, of all that stand as high.
        highest = np.minimum.accumulate(lines[:, column])
        rows = np.arange(high)
        first = np.searchsorted(-highest, -(rows + 0.5))
        front = highest[np.isfinite(highest)][:1]
        there = (first < len(highest)) & (rows < (front[0] if len(front) else 0.0))
        share = bright[np.minimum(first, len(highest) - 1), column][:, None]
        picture[there, column] = (low + share * (top - low))[there]
    return picture


@pytest.fixture(scope="module", autouse=True)
def wave(page: Browser) -> Iterator[None]:
    """The wave is shown, for as long as it is looked at."""
    former = page.ask("lab.status.settings.texture")
    change(page, "texture", WAVE)
    yield
    change(page, "texture", former)


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_the_relief_is_the_surface(page: Browser, dark: bool) -> None:
    page.resize(1280, 900, dark=dark)
    # Painted in the colours of the day or of the night, and on the screen.
    low = "getComputedStyle(document.documentElement).getPropertyValue('--low').trim()"
    page.until(f"lab.relief.paintKey === {low}")
    page.until("lab.hasCurrentPictures")
    got = shown(page, "relief")
    high, wide = got.shape[:2]
    differs = {}
    for name in (WAVE, WAVE.replace("0.8 0.6", "0.8 -0.6"), WAVE.replace("3mm", "2.9mm")):
        wanted = relief(page, height_of(name), wide, high)
        there = np.isfinite(wanted[..., 0])
        assert there.mean() > 0.4
        differs[name] = float(np.abs(got - wanted)[there].mean())
    # Others are noticed: a wave that runs another way, or one that is 3 % shorter.
    own = differs.pop(WAVE)
    assert own < 2.0
    assert min(differs.values()) > 4.0 * own


@needs_browser
def test_the_cut_is_the_surface_under_the_probe(page: Browser) -> None:
    page.resize(1280, 900)
    page.until("lab.hasCurrentPictures")
    got, ink = shown(page, "section"), colour(page, "ink")
    high, wide = got.shape[:2]
    left, right, bottom, top = page.ask("lab.section.box")
    y = page.ask("lab.section.y")
    columns = np.arange(10, wide - 10)
    x = left + (columns + 0.5) / wide * (right - left)

    def drawn(shift: float) -> float:
        """Return the share of columns in which the line is where the surface is."""
        z = height_of(WAVE)(x + shift, np.full(len(x), y))
        rows = np.rint((top - z) / (top - bottom) * high - 0.5).astype(int)
        near = [np.abs(got[rows + k, columns] - ink).max(axis=-1) for k in (-1, 0, 1)]
        return float((np.min(near, axis=0) < 60.0).mean())

    assert drawn(0.0) > 0.95
    assert drawn(4e-4) < 0.5


@needs_browser
def test_the_probe_is_where_the_loop_has_it(page: Browser) -> None:
    box = page.ask("document.getElementById('section').getBoundingClientRect().toJSON()")
    for share in (0.3, 0.6):
        page.mouse("mouseMoved", box["x"] + share * box["width"], box["y"] + 0.2 * box["height"])
        page.until("lab.hand.requestCount > 0 && lab.hand.requestCount <= lab.frame.acknowledged")
        page.let_loop_run(1.2)  # until it rests
        page.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        got = shown(page, "section")
        high, wide = got.shape[:2]
        left, right, bottom, top = page.ask("lab.section.box")
        x, _y, z = page.ask("lab.probeState().probe")
        column, row = (x - left) / (right - left) * wide, (top - z) / (top - bottom) * high
        assert abs(column - share * wide) < 20.0  # friction holds it back
        turn = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
        ring = got[
            np.rint(row + 8.0 * np.sin(turn) - 0.5).astype(int),
            np.rint(column + 8.0 * np.cos(turn) - 0.5).astype(int),
        ]
        assert np.abs(ring - colour(page, "ink")).mean() < 60.0


@needs_browser
@pytest.mark.parametrize("size", [(1280, 900), (3840, 2160)])
def test_the_hand_is_where_the_pointer_is_however_large_all_is_drawn(
    page: Browser, size: tuple[int, int]
) -> None:
    page.resize(*size)
    canvas = "lab.section.scaledCanvas"
    page.until(f"{canvas}.unit {'>' if size[0] > 2000 else '=='} 1 && !{canvas}.needsRepaint")
    box = page.ask("document.getElementById('section').getBoundingClientRect().toJSON()")
    # In the page the picture has its place, pixel for pixel.
    wide, drawn = page.ask(f"[{canvas}.width * {canvas}.unit, {canvas}.element.width]")
    assert wide == pytest.approx(box["width"], abs=1e-3)
    assert drawn == round(box["width"])
    for across, down in ((0.3, 0.2), (0.7, 0.4)):
        px, py = round(box["x"] + across * box["width"]), round(box["y"] + down * box["height"])
        page.mouse("mouseMoved", px, py)
        left, right, bottom, top = page.ask("lab.sectionBox()")
        x = left + (px - box["x"]) / box["width"] * (right - left)
        z = top - (py - box["y"]) / box["height"] * (top - bottom)
        assert page.ask("[lab.hand.x, lab.hand.z]") == pytest.approx(
            (x, z), abs=(right - left) / 900
        )
        # The hand comes there, and its cross is drawn at the pointer.
        page.until(
            "Math.hypot(lab.frame.hand[0] - lab.hand.x, lab.frame.hand[2] - lab.hand.z) < 1e-5"
        )
        drawn_at = page.ask(
            "(() => { const mark = lab.section.overlay, box = mark.element.getBoundingClientRect();"
            "const [x, , z] = lab.frame.hand, [l, r, b, t] = lab.sectionBox();"
            "const s = lab.section.scaledCanvas;"
            "const u = (x - l) / (r - l) * s.width - mark.left;"
            "const v = (t - z) / (t - b) * s.height - mark.top;"
            "return [box.x + u * s.unit, box.y + v * s.unit, box.width / mark.width]; })()"
        )
        assert drawn_at[:2] == pytest.approx((px, py), abs=2.0)
        assert drawn_at[2] == pytest.approx(page.ask("lab.section.scaledCanvas.unit"), rel=1e-3)
    page.resize(1280, 900)
    page.ask("lab.hand.z = null; lab.hand.requestMotion()")
