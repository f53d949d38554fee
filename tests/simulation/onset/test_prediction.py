"""The criteria beside an onset, in numbers: onsets are made by hand, nothing is simulated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.analysis.bounds.bound import Bound
from asperity.simulation import BandHand, Cartesian, Pantograph, Resonance, Servo, SpringHand
from asperity.simulation.limit_cycles import onset as onset_module
from asperity.simulation.limit_cycles.onset import Onset, predict, smooth_wall_onset
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid

PERIOD = 1e-3
HAND = SpringHand(stiffness=(100.0, 100.0, 0.0), damping=(1.0, 2.0, 3.0), force=(0.0, 0.0, -1.0))
PLANT = Cartesian(0.05, 4.0)  # the least damping is 4 + 1, along x
# Crests sharper than troughs: q of C is 8.685 where q⁺ is 5.533 (periods of 1 m, 0.5 m deep).
WAVES = 2.0 * math.pi * np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
SHARP = Fourier(np.array([0.1, 0.04, 0.02]), WAVES, np.full(3, math.pi / 2))
TOP, Q, PLUS = 0.16, 8.685, 5.533


def onset(law: str, delay: int = 2, cycling: float = 300.0, low: float = TOP - 0.5) -> Onset:
    return Onset(
        law,
        delay,
        290.0,
        cycling,
        4,
        4,
        (-1.0, 0.0, low),
        (1.0, 0.0, 9.0),
        is_smooth_wall=law == "W",
    )


@pytest.mark.parametrize("delay", [0, 2])
def test_the_rules_of_a_sharp_texture_in_numbers(delay: int) -> None:
    """q⁺ counts once by half, q once for each sample of delay; (1) has q alone."""
    servo, found = Servo(PERIOD, delay=delay), onset("C", delay)
    wall = replace(onset("W", delay), quiet=5000.0, cycling=7000.0)
    said = predict(Surface(SHARP, "C", 700.0, max_depth=0.1), PLANT, HAND, servo, found, wall)
    assert said.depth == pytest.approx(0.5)
    assert (said.q, said.one_sided) == (pytest.approx(Q, rel=0.01), pytest.approx(PLUS, rel=0.01))
    assert said.damping == pytest.approx(5.0)
    assert said.delay_rule == pytest.approx(5.0 / PERIOD / (0.5 * PLUS + delay * Q), rel=0.01)
    assert said.paper_limit == pytest.approx(5.0 / (2.0 * PERIOD * Q), rel=0.01)
    assert said.wall_rule == pytest.approx(5000.0 / Q, rel=0.01)  # what was quiet, not what cycled


def test_depth_counts_from_where_contact_begins() -> None:
    """From the highest crest, but from z = 0 for laws on the nominal contact."""
    servo = Servo(PERIOD, delay=1)
    for law, depth in (("C", 0.5), ("D", 0.5), ("G", 0.34), ("W", 0.34)):
        said = predict(Surface(SHARP, law), PLANT, HAND, servo, onset(law))
        assert said.depth == pytest.approx(depth)


def test_who_never_touched_has_no_limit() -> None:
    said = predict(Surface(SHARP, "C"), PLANT, HAND, Servo(PERIOD), onset("C", low=TOP), onset("W"))
    assert (said.depth, said.q, said.one_sided) == (0.0, 0.0, 0.0)
    assert (said.paper_limit, said.delay_rule, said.wall_rule) == (math.inf, math.inf, None)


def test_an_infinite_number_counts_only_with_a_delay() -> None:
    """D below its ridges: q is infinite, q⁺ is 1."""
    surface = Surface(SHARP, "D")
    at_once, late = (
        predict(surface, PLANT, HAND, Servo(PERIOD, delay=d), onset("D", d), onset("W", d))
        for d in (0, 1)
    )
    assert at_once.q == math.inf
    assert at_once.delay_rule == pytest.approx(2.0 * 5.0 / PERIOD)
    assert late.delay_rule == late.paper_limit == late.wall_rule == 0.0


@pytest.mark.parametrize(("law", "proved"), [("C", True), ("A", False)])
def test_a_miss_is_a_cycle_at_or_below_a_proved_limit(law: str, proved: bool) -> None:
    servo, surface = Servo(PERIOD, delay=2), Surface(SHARP, law)
    limit = predict(surface, PLANT, HAND, servo, onset(law)).delay_rule
    for cycling, missed in (
        (limit, proved),
        (math.nextafter(limit, 0.0), proved),
        (math.nextafter(limit, math.inf), False),
        (math.inf, False),
    ):
        said = predict(surface, PLANT, HAND, servo, onset(law, cycling=cycling))
        assert said.delay_rule == limit
        assert (said.conservative, said.violates_delay_rule) == (proved, missed)


def test_no_cycle_is_no_miss_even_without_a_limit() -> None:
    found = onset("C", cycling=math.inf, low=TOP)
    assert not predict(Surface(SHARP, "C"), PLANT, HAND, Servo(PERIOD), found).violates_delay_rule


def test_the_wall_s_rule_is_missed_below_it_only() -> None:
    servo, surface, wall = Servo(PERIOD, delay=2), Surface(SHARP, "A"), onset("W")
    limit = predict(surface, PLANT, HAND, servo, onset("A"), wall).wall_rule
    assert limit is not None
    for cycling, missed in ((limit, False), (math.nextafter(limit, 0.0), True)):
        said = predict(surface, PLANT, HAND, servo, onset("A", cycling=cycling), wall)
        assert said.violates_wall_rule is missed
    alone = predict(surface, PLANT, HAND, servo, onset("A", cycling=1e-9))
    assert (alone.wall_rule, alone.violates_wall_rule) == (None, False)


def test_the_wall_among_onsets_is_that_of_the_delay() -> None:
    found = [onset("A", 1), onset("W", 0), onset("W", 1), onset("C", 0)]
    assert smooth_wall_onset(found, 1) is found[2]
    assert smooth_wall_onset(found, 0) is found[1]
    assert smooth_wall_onset(found, 2) is None
    assert smooth_wall_onset(found[::3], 1) is None


# --- the least damping ----------------------------------------------------------------------------


def test_the_least_damping_over_directions_with_the_hand() -> None:
    place = (0.0, 0.0, 0.0)
    uneven = Cartesian(0.05, (6.0, 2.5, 9.0))
    assert uneven.min_damping(place, place) == 2.5
    assert uneven.min_damping(place, place, HAND) == 4.5  # 2.5 + 2 along y
    assert uneven.min_damping(place, place, BandHand()) == 2.5
    # Behind a resonance the hand does not damp the handle.
    assert replace(uneven, resonance=Resonance(400.0)).min_damping(place, place, HAND) == 2.5


def test_the_brakes_of_a_linkage_count_up_to_the_highest_contact() -> None:
    """Between the least height and the top of the texture, or the height that was reached."""
    plant, place = Pantograph(centre=(0.0375, 0.1)), (0.0, 0.0)

    def least(low: float, high: float, top: float) -> float:
        return plant.min_damping((*place, low), (*place, high), None, top)

    def between(low: float, high: float) -> float:
        return min(
            plant.min_damping((*place, z), (*place, z), None, z) for z in np.linspace(low, high, 9)
        )

    assert least(-0.03, 0.02, 0.01) == pytest.approx(between(-0.03, 0.01), rel=1e-12)
    assert least(-0.03, 0.005, 0.01) == pytest.approx(between(-0.03, 0.005), rel=1e-12)
    assert least(0.02, 0.03, 0.01) == pytest.approx(between(0.02, 0.02), rel=1e-12)
    assert len({between(-0.03, high) for high in (0.01, 0.005, 0.02, -0.03)}) > 1


def test_the_damping_of_a_linkage_is_the_least_in_the_box() -> None:
    plant = Pantograph(centre=(0.0375, 0.1))
    wide = plant.min_damping((-0.03, 0.0, -0.03), (0.03, 0.0, 0.0))
    corners = [plant.min_damping((x, 0.0, -0.03), (x, 0.0, -0.03), None, -0.03)
               for x in (-0.03, 0.03)]  # fmt: skip
    assert wide <= min(corners) < max(corners)
    assert plant.min_damping((-0.03, 0.0, -0.03), (0.03, 0.0, 0.0), HAND) == wide
    # Corners that the arms do not reach are no places.
    assert plant.min_damping((-1.0, 0.0, -1.0), (1.0, 0.0, 0.0)) > 0.0


def test_a_texture_s_top_is_where_the_brakes_end() -> None:
    """A handle that only hovers between crest and z = 0 is braked there, too."""
    plant, high = Pantograph(centre=(0.0375, 0.1)), 0.02
    surface = Surface(Sinusoid(high, 0.1), "A")
    found = Onset("A", 0, 1.0, 2.0, 1, 1, (0.0, 0.0, -0.01), (0.0, 0.0, 0.5))
    said = predict(surface, plant, BandHand(), Servo(1e-4), found)
    box = (0.0, 0.0, -0.01), (0.0, 0.0, 0.5)
    assert said.damping == plant.min_damping(*box, None, high)
    assert said.damping != plant.min_damping(*box, None, 0.0)


@pytest.mark.parametrize(
    ("q", "plus", "delay", "damping", "rule"),
    [
        (3.0, 2.0, 0, 5.0, 5.0 / PERIOD), (3.0, 2.0, 2, 5.0, 5.0 / PERIOD / 7.0),
        (math.inf, 2.0, 2, 5.0, 5.0 / PERIOD / 5.0),  # below a medial axis: as if q were q⁺
        (math.inf, 2.0, 0, 5.0, 5.0 / PERIOD), (3.0, 2.0, 2, 0.0, None), (0.0, 0.0, 2, 5.0, None),
        (1e-4, 0.0, 1, 5.0, 5e7),
    ],
)  # fmt: skip
def test_cycles_are_expected_where_the_delay_rule_ends(
    q: float, plus: float, delay: int, damping: float, rule: float | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Of a wave in z below 0.16 m, with the damping where the handle starts."""
    told: list[object] = []

    def least(*given: object) -> float:
        told.append(given)
        return damping

    monkeypatch.setattr(Cartesian, "min_damping", least)
    for name, value in (("characteristic_number", q), ("one_sided_number", plus)):
        bound = Bound(value, value, "theorem")
        monkeypatch.setattr(onset_module, name, lambda *_given, bound=bound: bound)
    servo, start, surface = Servo(PERIOD, delay=delay), (1.0, 2.0, 3.0), Surface(SHARP, "C")
    found = onset_module.expected_onset(surface, PLANT, HAND, servo, start)
    assert found == (rule if rule is None else pytest.approx(rule, rel=1e-12))
    assert told == [(PLANT, start, start, HAND, pytest.approx(TOP))]
