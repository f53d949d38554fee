"""Headlines for surfaces on devices: the recommended law and its perceptibility, by a fixed rule.

The rule takes the force along a scan at constant height, computed by hand, through the apparent
mass of the device to a tool held by 200 N/m and 2 N s/m, and compares its motion with 2.5 µm
below 40 Hz, falling with the square of the frequency to 0.1 µm at 200 Hz; a tenth of that is not
felt. Waves with fewer than five updates or position steps are distorted and at best borderline;
with fewer than two they are not felt. Fewer than five force steps are borderline, less than one is
not felt. Unverified numbers hide nothing. Nothing is known below 40 Hz and above 500 Hz: what may
be noticed there by the amplitude at the nearest of these is neither felt nor borderline.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.analysis.results.check_limits import limits
from asperity.analysis.results.compare import Comparison, compare
from asperity.analysis.results.recommendation import LawRow
from asperity.core.errors import ParameterError
from asperity.devices import Device, device_names, load_device
from asperity.scene import load_scene
from asperity.textures import Sinusoid, load_texture
from asperity.textures.kinds.prepare_synthetic import prepare_texture

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"no sample surfaces in {DATA}")
DEVICES = ("touch", "touch-x", "inverse3", "omega.3", "pantograph", "falcon", "premium-1.5")
# Amplitude and period [mm]; then, for each device, the law that an expert would select, "-" if
# no law is felt, "?" if it is borderline, and "*" if it is unknown whether it is felt.
SINUSOIDS = """
    0.001 0.1    -    -    -    -    -    -    -
    0.005 0.5    C?   C?   -    C    C?   C?   C?
    0.02  1      C?   C    C?   C    C    C    C
    0.05  0.3    C?   C?   C?   C    C?   H?   C?
    0.1   2      C    C    C    C    C    C    C
    0.4   1.5    H    H    H    H    H    H    H
    0.8   1      H    H    H?   H    H    H    H
    1     8      C*   C*   C*   C*   C*   C*   C*
"""
MARKS = {"?": "borderline", "*": "unknown"}
OTHERS = {
    ("sandpaper:grit=P60", "touch"): "H",
    ("sandpaper:grit=P60", "omega.3"): "H",
    ("brushed-metal", "touch"): "-",
    ("brushed-metal", "premium-1.5"): "-",
    ("knurl", "omega.3"): "H",
    ("knurl", "touch"): "H",
}


def cases() -> list[tuple[float, float, str, str]]:
    """Return amplitude [m], period [m], device and headline."""
    rows = [line.split() for line in SINUSOIDS.strip().splitlines()]
    return [
        (1e-3 * float(row[0]), 1e-3 * float(row[1]), device, expected)
        for row in rows
        for device, expected in zip(DEVICES, row[2:], strict=True)
    ]


def headline(result: Comparison) -> str:
    row = result.recommended_row
    if row is None:
        return "-"
    return row.law.letter + next((mark for mark, tier in MARKS.items() if tier == row.tier), "")


@pytest.mark.parametrize(("amplitude", "period", "name", "expected"), cases())
def test_headline_of_a_sinusoid(amplitude: float, period: float, name: str, expected: str) -> None:
    result = compare(Sinusoid(amplitude, period), name, "ACH")
    assert headline(result) == expected
    for row in result.rows:
        assert row.tier == tier_by_hand(row, result.device, amplitude, period)


@pytest.fixture(scope="module")
def fields() -> dict[tuple[str, str | None], Any]:
    return {}


@pytest.fixture
def baked_once(fields: dict[tuple[str, str | None], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Bake the same field once for all devices, as the cache of results does."""

    def get(name: str, content: str | None, compute: Callable[[], Any]) -> Any:
        key = (name, content)
        if content is None or key not in fields:
            fields[key] = compute()
        return fields[key]

    monkeypatch.setattr("asperity.rendering.get_or_compute", get)


@pytest.mark.usefixtures("baked_once")
@pytest.mark.parametrize(("spec", "name"), OTHERS)
def test_headline_of_a_library_surface(spec: str, name: str) -> None:
    # The rough ones take long to bake, and bake to the same headline.
    rendering = "field" if spec == "knurl" else "search"
    result = compare(load_scene(spec).texture, name, "CH", rendering=rendering)
    assert headline(result) == OTHERS[spec, name]


@pytest.mark.parametrize("name", device_names())
def test_every_device_renders_a_library_surface_that_is_felt_or_says_why_not(name: str) -> None:
    """A knurl, at the magnification that the answer asks for."""
    knurl = load_scene("knurl").texture
    if load_device(name).wall_test is None:
        with pytest.raises(ParameterError, match="needs max_stiffness to compare laws"):
            compare(knurl, name, "CH", rendering="search")
        return
    result = compare(knurl, name, "CH", rendering="search")
    row = result.recommended_row
    assert row is not None
    assert row.perceptibility is not None
    larger = [one.value for one in row.perceptibility.remedies if one.kind == "magnify"]
    if larger:
        magnified = prepare_texture(knurl, magnify=larger[0])
        result = compare(magnified, name, "CH", rendering="search")
    assert headline(result) in {"C", "H"}


def test_limits_have_the_tier_of_the_headline() -> None:
    """limits() analyzes the law that the comparison of all laws recommends."""
    for amplitude, period, name, expected in cases()[::13]:
        result = limits(Sinusoid(amplitude, period), name)
        expected_tier = "not felt" if expected == "-" else MARKS.get(expected[1:], "felt")
        assert result.perceptibility.tier == expected_tier


def tier_by_hand(row: LawRow, device: Device, amplitude: float, period: float) -> str:
    """Return the tier by the rule above, from forces on a scan."""
    surface = row.surface.to_stiffness(row.recommended_stiffness)
    x = (np.arange(4000) + 0.5) / 4000 * period
    height = amplitude - surface.max_depth
    force = surface.force(np.column_stack([x, 0.0 * x, np.full(4000, height)]))
    x_force, _, z_force = math.sqrt(2.0) * force.std(axis=0)
    omega = 2.0 * math.pi * 0.1 / period
    known = {name: datum.value for name, datum in device.data.items() if datum.verified}
    damping = known.get("damping", 0.0)
    free = 200.0 - (device.value("apparent_mass") or 0.1) * omega**2 + 1j * omega * (2.0 + damping)
    pressed = free + surface.stiffness + 1j * omega * known.get("friction", 0.0) / 0.1
    # Harmonics of the force are left out: one wave has the RMS of all.
    level = math.hypot(x_force / abs(free), z_force / abs(pressed)) / felt_amplitude(0.1 / period)
    strength, step = math.hypot(x_force, z_force), known.get("force_resolution", 0.0)
    samples = _samples(known, period)
    if samples < 2.0 or strength < step or level < 0.1:
        return "not felt"
    if not 40.0 <= 0.1 / period <= 500.0:
        return "unknown"
    return "borderline" if samples < 5.0 or strength < 5.0 * step or level < 1.0 else "felt"


def felt_amplitude(frequency: float) -> float:
    """Return the amplitude that is felt [m]."""
    f = min(max(frequency, 40.0), 500.0)
    return 2.5e-6 * (40.0 / f) ** 2 if f <= 200.0 else 0.1e-6 * (f / 200.0) ** 2


def _samples(known: dict[str, float], period: float, speed: float = 0.1) -> float:
    """Return updates or position steps in a wave, whichever are fewer; 0 above the bandwidth."""
    counts = [math.inf]
    rate, step = known.get("update_rate"), known.get("position_resolution")
    if rate is not None:
        counts.append(period * rate / speed)
    if step is not None:
        counts.append(period / step)
    bandwidth = known.get("bandwidth")
    if bandwidth is not None and speed / period >= bandwidth:
        counts.append(0.0)
    return min(counts)


def test_headlines_cover_at_least_sixty_cases() -> None:
    assert len(cases()) + len(OTHERS) >= 60
    assert {load_device(name).id for name in DEVICES}


REAL = [
    ("sample-land.x3p", 1.0, "omega.3", "H?"),  # large force, but undersampled at 0.1 m/s
    ("sample-land.x3p", 20.0, "touch", "H"),
    ("sample-land.x3p", 20.0, "inverse3", "H?"),  # force steps of 14 mN
    ("dektak-1.csv", 20.0, "touch", "-"),
]


@needs_data
@pytest.mark.parametrize(("name", "magnify", "device", "expected"), REAL)
def test_headline_of_a_measured_surface(
    name: str, magnify: float, device: str, expected: str
) -> None:
    texture = load_texture(DATA / name, magnify=magnify)
    result = compare(texture, device, "CH", rendering="search")
    assert headline(result) == expected
    row = result.recommended_row or result.nearest_row
    assert row is not None
    assert row.perceptibility is not None
    assert (
        row.perceptibility.nesting_index is not None
    )  # form and waviness were separated from texture
