"""Borders of an envelope against comparisons just inside and just outside of them."""

from __future__ import annotations

import math
import random
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.limits.limit_rules import DEFAULT_SPEED
from asperity.core.cache import bypass_results
from asperity.core.errors import ParameterError
from asperity.devices import override_device, parse_device
from asperity.envelopes.envelope import Envelope, envelope
from asperity.envelopes.wave_borders import (
    AMPLITUDE_RANGE,
    RenderConditions,
    WaveBorders,
    WaveCase,
    find_borders,
)
from asperity.perception.grip import load_grip

DEVICES = ("touch", "omega.3", "pantograph", "falcon")
LAWS = "ABCDEFGH"
COUNT = 24  # python -m bench.stress.envelopes checks 200
Border = tuple[WaveCase, WaveBorders, float, bool]
"""Case, borders at a wavelength, an amplitude on the border, whether it is rendered above."""


def compare_renders(case: WaveCase, wavelength: float, amplitude: float) -> bool:
    """Return whether a comparison says that the sinusoid is rendered."""
    conditions = case.conditions
    with bypass_results():
        row = asp.compare(
            asp.Sinusoid(amplitude, wavelength),
            case.device,
            [case.law],
            max_depth=conditions.max_depth,
            speed=conditions.speed,
        ).rows[0]
    return row.tier == "felt" and row.recommended_stiffness >= conditions.min_stiffness


def is_border(border: Border, shift: float = 1.0) -> bool:
    """Return whether a bisection with comparisons ends within 1 % of an amplitude."""
    case, found, amplitude, rises = border
    return all(
        compare_renders(case, found.wavelength, shift * amplitude * side) == is_rendered
        for side, is_rendered in ((0.99, not rises), (1.01, rises))
    )


@cache
def random_borders(count: int) -> list[Border]:
    """Return borders of each law: of random devices, wavelengths, speeds and depths."""
    draw, found = random.Random(7), list[Border]()
    while len(found) < count:
        depth = draw.choice([None, None, 10.0 ** draw.uniform(-4.3, -3.2)])
        conditions = RenderConditions(
            speed=10.0 ** draw.uniform(-1.7, -0.5),
            min_stiffness=draw.choice([5.0, 50.0, 300.0]),
            max_depth=depth,
        )
        device = asp.load_device(draw.choice(DEVICES))
        law = LAWS[len(found) % len(LAWS)]
        case = WaveCase(law, {}, device, conditions)
        wavelength = 10.0 ** draw.uniform(math.log10(0.05e-3), math.log10(20e-3))
        (borders,) = find_borders(case, [wavelength])
        ends = [(borders.felt_from, True), (borders.felt_up_to, False)]
        inner = [
            (case, borders, amplitude, rises)
            for amplitude, rises in ends
            if AMPLITUDE_RANGE[0] * 1.1 < amplitude < AMPLITUDE_RANGE[1]
        ]
        if inner:
            found.append(draw.choice(inner))
    return found


def test_random_borders_are_those_of_comparisons() -> None:
    borders = random_borders(COUNT)
    wrong = [border for border in borders if not is_border(border)]
    assert [(b[0].law, b[0].device.id, b[0].conditions.max_depth, b[1]) for b in wrong] == []
    assert {border[0].law for border in borders} == set(LAWS)
    assert {border[3] for border in borders} == {True, False}


def test_borders_off_by_three_percent_are_detected() -> None:
    borders = random_borders(COUNT)[:6]
    assert not any(is_border(border, 1.03) or is_border(border, 0.97) for border in borders)


LENGTHS = [float(one) for one in np.geomspace(0.05e-3, 20e-3, 12)]


@pytest.mark.parametrize("law", LAWS)
def test_borders_do_not_depend_on_the_wavelengths_before(law: str) -> None:
    case = WaveCase(law, {}, asp.load_device("omega.3"), RenderConditions())
    dense = [float(one) for one in np.geomspace(LENGTHS[0], LENGTHS[-1], 34)[6:24]]
    for along, (alone,) in zip(
        find_borders(case, dense)[::3], (find_borders(case, [x]) for x in dense[::3]), strict=True
    ):
        for name in ("felt_from", "felt_up_to", "firm_up_to", "gain_limit"):
            one, other = getattr(along, name), getattr(alone, name)
            assert one == pytest.approx(other, rel=3e-3, nan_ok=True), (name, alone)


def test_law_without_a_finite_number_has_borders_without_a_wall_test() -> None:
    data = {"damping": "2.34 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}
    case = WaveCase("D", {}, parse_device(data, "rig"), RenderConditions())
    (borders,) = find_borders(case, [8e-3])
    assert math.isinf(borders.gain_limit)
    assert borders.firm_up_to > 0.0


def test_borders_of_the_paper_are_closed_forms() -> None:
    """Law A: K₀/q with q = √(1 + (2πA/l)²), so limit 5 is at A = l √((K₀/k)² - 1)/(2π)."""
    result = envelope("pantograph", "A", wavelengths=[1e-3, 3e-3], min_stiffness=500.0)
    wall = asp.load_device("pantograph").max_stiffness
    for border in result["pantograph"]["A"].borders:
        exact = border.wavelength * math.sqrt((wall / 500.0) ** 2 - 1.0) / (2.0 * math.pi)
        assert border.gain_limit == pytest.approx(exact, rel=2e-3)


@pytest.fixture(scope="module")
def two_laws() -> Envelope:
    return envelope(
        ["omega.3", "pantograph"], "HWC", wavelengths=LENGTHS[::2], surface=["cloth", "sandpaper"]
    )


def test_a_smooth_wall_renders_no_texture(two_laws: Envelope) -> None:
    wall = two_laws["omega.3"]["W"]
    assert wall.decades == 0.0
    assert all(math.isnan(border.felt_from) for border in wall.borders)
    assert all(math.isinf(border.firm_up_to) for border in wall.borders)
    assert two_laws["omega.3"].widest.letter == "H"
    assert two_laws["omega.3"]["H"].decades > two_laws["omega.3"]["C"].decades > 1.0


def test_region_ends_at_a_verified_limit_of_the_wavelength() -> None:
    """A given bandwidth of 80 Hz bounds the region; unverified numbers of the omega do not.

    Nor is a wave rendered whose frequency has no thresholds.
    """
    slow = override_device(asp.load_device("pantograph"), {"bandwidth": "80 Hz"})
    result = envelope([slow, "omega.3"], "H", wavelengths=LENGTHS)
    edge = max(limit.wavelength for limit in result.devices[0].limits)
    assert edge == pytest.approx(1.25e-3)
    for border in result.devices[0]["H"].borders:
        frequency = np.array([DEFAULT_SPEED / border.wavelength])
        (is_known,) = load_grip().is_known(frequency)
        assert math.isnan(border.felt_from) == (border.wavelength <= edge or not is_known)
    assert {border.wavelength for border in result.devices[0]["H"].borders} >= {edge}
    limits = result["omega.3"].limits
    assert limits
    assert not any(limit.trusted for limit in limits)
    fast = envelope("omega.3", "H", wavelengths=LENGTHS, speed=0.02)["omega.3"]
    shortest = max(limit.wavelength for limit in limits)
    assert any(x.felt_from > 0.0 and x.wavelength < shortest for x in fast["H"].borders)


def test_region_ends_where_the_thresholds_of_the_grip_end() -> None:
    """At 0.1 m/s at 2.5 mm, 40 Hz, whatever wavelengths are next to it; so it may at 0.2 mm."""
    law = envelope("omega.3", "C", wavelengths=[0.15e-3, 1e-3, 8e-3], speed=0.1)["omega.3"]["C"]
    felt = [border.wavelength for border in law.borders if border.decades]
    assert (felt[0], felt[-1]) == pytest.approx((1e-3, 2.5e-3), rel=2e-6)
    lengths = [border.wavelength for border in law.borders]
    assert lengths[1:3] == pytest.approx([0.2e-3] * 2, rel=2e-6)
    assert lengths[1] < 0.2e-3 < lengths[2]
    rise = 0.5 * law.borders[3].decades * math.log10(1e-3 / 0.2e-3)
    area = sum(
        0.5 * (a.decades + b.decades) * math.log10(b.wavelength / a.wavelength)
        for a, b in pairwise(border for border in law.borders if border.decades)
    )
    assert law.decades == pytest.approx(area + rise, rel=1e-4)


def test_peaks_are_rendered_where_their_wave_is(two_laws: Envelope) -> None:
    for surface in two_laws.surfaces:
        assert surface.waves
        for one, rendered in zip(two_laws.devices, surface.rendered_by, strict=True):
            for wave, letters in zip(surface.waves, rendered, strict=True):
                for law in one.laws:
                    expected = compare_renders(law.case, wave.wavelength, wave.amplitude)
                    assert (law.letter in letters) == expected
    assert {letters for surface in two_laws.surfaces for letters in surface.rendered_by[0]} != {""}


def test_table_and_plain_data_have_every_border(two_laws: Envelope) -> None:
    rows = two_laws.table_rows()
    counts = [len(law.borders) for one in two_laws.devices for law in one.laws]
    assert len(rows) == sum(counts)
    units = [name for name in rows[0] if name not in {"device", "law"}]
    assert all(name.endswith(("[m]", "[N/m]")) for name in units)
    data = two_laws.to_dict()
    border = data["devices"][0]["laws"][0]["borders"][0]
    assert border["wavelength"] == LENGTHS[0]
    assert border["firm_up_to"] == "inf"
    assert border["force_limit"] is None or border["force_limit"] > 0.0


def test_user_defined_law_has_borders() -> None:
    law = asp.Law("Y", "doubled-height", "vertical", lambda c: 2 * c.k * c.depth * c.e_z)
    result = envelope("omega.3", [law, "A"], wavelengths=[2e-3])
    own, known = (one.borders[0] for one in result["omega.3"].laws)
    assert own.gain_limit < known.gain_limit
    assert own.felt_from < own.felt_up_to


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"device": "2diy"}, "needs max_stiffness"),
        ({"device": ["touch", "touch"]}, "one device twice"),
        ({"laws": "CC"}, "law C twice"),
        ({"speed": -1.0}, "speed must be positive"),
        ({"min_stiffness": 0.0}, "min_stiffness must be positive"),
        ({"wavelengths": [2e-3, 1e-3]}, "ascending"),
        ({"time_samples": 1.0}, "time_samples must be at least 2"),
        ({"law_parameters": {"frction": 1.0}}, "frction"),
        ({"surface": "nothing-of-the-kind"}, "nothing-of-the-kind"),
    ],
)
def test_bad_input_names_the_argument(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        envelope(**{"device": "touch", "laws": "C", "wavelengths": [1e-3], **arguments})  # type: ignore[arg-type]  # wrong ones
