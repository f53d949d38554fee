"""The predicted limits beside an onset, on constructed onsets without simulation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.analysis.bounds.bound import Bound
from asperity.rendering import bake
from asperity.simulation import BandHand, Cartesian, Pantograph, Resonance, Servo, SpringHand
from asperity.simulation import onset as onset_module
from asperity.simulation.onset import Onset, predict, smooth_wall_onset
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid

PERIOD = 1e-3
HAND = SpringHand(stiffness=(100.0, 100.0, 0.0), damping=(1.0, 2.0, 3.0), force=(0.0, 0.0, -1.0))
PLANT = Cartesian(0.05, 4.0)  # the least total damping is 4 + 1, along x
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
def test_predicted_limits_of_a_sharp_texture(delay: int) -> None:
    """The delay rule weighs q⁺ by 1/2 and q by the delay; the paper's (1) uses q alone."""
    servo, measured = Servo(PERIOD, delay=delay), onset("C", delay)
    wall = replace(onset("W", delay), quiet=5000.0, cycling=7000.0)
    prediction = predict(
        Surface(SHARP, "C", 700.0, max_depth=0.1), PLANT, HAND, servo, measured, wall
    )
    assert prediction.depth == pytest.approx(0.5)
    assert (prediction.q, prediction.one_sided) == (
        pytest.approx(Q, rel=0.01),
        pytest.approx(PLUS, rel=0.01),
    )
    assert prediction.damping == pytest.approx(5.0)
    assert prediction.delay_rule == pytest.approx(5.0 / PERIOD / (0.5 * PLUS + delay * Q), rel=0.01)
    assert prediction.paper_limit == pytest.approx(5.0 / (2.0 * PERIOD * Q), rel=0.01)
    assert prediction.wall_rule == pytest.approx(
        5000.0 / Q, rel=0.01
    )  # the quiet stiffness, not the cycling one


def test_depth_is_measured_from_the_start_of_contact() -> None:
    """From the highest crest; from z = 0 for laws on the nominal contact."""
    servo = Servo(PERIOD, delay=1)
    for law, depth in (("C", 0.5), ("D", 0.5), ("G", 0.34), ("W", 0.34)):
        prediction = predict(Surface(SHARP, law), PLANT, HAND, servo, onset(law))
        assert prediction.depth == pytest.approx(depth)


def test_handle_without_contact_has_no_limit() -> None:
    prediction = predict(
        Surface(SHARP, "C"), PLANT, HAND, Servo(PERIOD), onset("C", low=TOP), onset("W")
    )
    assert (prediction.depth, prediction.q, prediction.one_sided) == (0.0, 0.0, 0.0)
    assert (prediction.paper_limit, prediction.delay_rule, prediction.wall_rule) == (
        math.inf,
        math.inf,
        None,
    )


def test_infinite_q_limits_only_delayed_loops() -> None:
    """D below its ridges: q is infinite, q⁺ is 1."""
    surface = Surface(SHARP, "D")
    undelayed, delayed = (
        predict(surface, PLANT, HAND, Servo(PERIOD, delay=d), onset("D", d), onset("W", d))
        for d in (0, 1)
    )
    assert undelayed.q == math.inf
    assert undelayed.delay_rule == pytest.approx(2.0 * 5.0 / PERIOD)
    assert delayed.delay_rule == delayed.paper_limit == delayed.wall_rule == 0.0


@pytest.mark.parametrize(("law", "proved"), [("C", True), ("A", False)])
def test_violation_is_a_cycle_at_or_below_a_proved_limit(law: str, proved: bool) -> None:
    servo, surface = Servo(PERIOD, delay=2), Surface(SHARP, law)
    limit = predict(surface, PLANT, HAND, servo, onset(law)).delay_rule
    for cycling, violated in (
        (limit, proved),
        (math.nextafter(limit, 0.0), proved),
        (math.nextafter(limit, math.inf), False),
        (math.inf, False),
    ):
        prediction = predict(surface, PLANT, HAND, servo, onset(law, cycling=cycling))
        assert prediction.delay_rule == limit
        assert (prediction.conservative, prediction.violates_delay_rule) == (proved, violated)


def test_loop_without_cycle_or_limit_violates_nothing() -> None:
    never_cycling = onset("C", cycling=math.inf, low=TOP)
    assert not predict(
        Surface(SHARP, "C"), PLANT, HAND, Servo(PERIOD), never_cycling
    ).violates_delay_rule


def test_wall_rule_is_violated_only_strictly_below_it() -> None:
    servo, surface, wall = Servo(PERIOD, delay=2), Surface(SHARP, "A"), onset("W")
    limit = predict(surface, PLANT, HAND, servo, onset("A"), wall).wall_rule
    assert limit is not None
    for cycling, violated in ((limit, False), (math.nextafter(limit, 0.0), True)):
        prediction = predict(surface, PLANT, HAND, servo, onset("A", cycling=cycling), wall)
        assert prediction.violates_wall_rule is violated
    without_wall = predict(surface, PLANT, HAND, servo, onset("A", cycling=1e-9))
    assert (without_wall.wall_rule, without_wall.violates_wall_rule) == (None, False)


def test_smooth_wall_onset_is_selected_by_delay() -> None:
    onsets = [onset("A", 1), onset("W", 0), onset("W", 1), onset("C", 0)]
    assert smooth_wall_onset(onsets, 1) is onsets[2]
    assert smooth_wall_onset(onsets, 0) is onsets[1]
    assert smooth_wall_onset(onsets, 2) is None
    assert smooth_wall_onset(onsets[::3], 1) is None


# --- the least damping ----------------------------------------------------------------------------


def test_min_damping_over_directions_includes_the_hand() -> None:
    place = (0.0, 0.0, 0.0)
    uneven = Cartesian(0.05, (6.0, 2.5, 9.0))
    assert uneven.min_damping(place, place) == 2.5
    assert uneven.min_damping(place, place, HAND) == 4.5  # 2.5 + 2 along y
    assert uneven.min_damping(place, place, BandHand()) == 2.5
    # Behind a resonance the hand does not damp the handle.
    assert replace(uneven, resonance=Resonance(400.0)).min_damping(place, place, HAND) == 2.5


def test_pantograph_brakes_count_up_to_the_highest_contact() -> None:
    """From the least height up to the top of the texture, or to the greatest height reached."""
    plant, place = Pantograph(centre=(0.0375, 0.1)), (0.0, 0.0)

    def damping_in_box(low: float, high: float, top: float) -> float:
        return plant.min_damping((*place, low), (*place, high), None, top)

    def least_sampled(low: float, high: float) -> float:
        return min(
            plant.min_damping((*place, z), (*place, z), None, z) for z in np.linspace(low, high, 9)
        )

    assert damping_in_box(-0.03, 0.02, 0.01) == pytest.approx(least_sampled(-0.03, 0.01), rel=1e-12)
    assert damping_in_box(-0.03, 0.005, 0.01) == pytest.approx(
        least_sampled(-0.03, 0.005), rel=1e-12
    )
    assert damping_in_box(0.02, 0.03, 0.01) == pytest.approx(least_sampled(0.02, 0.02), rel=1e-12)
    assert len({least_sampled(-0.03, high) for high in (0.01, 0.005, 0.02, -0.03)}) > 1


def test_pantograph_damping_is_the_least_in_the_box() -> None:
    plant = Pantograph(centre=(0.0375, 0.1))
    in_box = plant.min_damping((-0.03, 0.0, -0.03), (0.03, 0.0, 0.0))
    corners = [
        plant.min_damping((x, 0.0, -0.03), (x, 0.0, -0.03), None, -0.03) for x in (-0.03, 0.03)
    ]
    assert in_box <= min(corners) < max(corners)
    assert plant.min_damping((-0.03, 0.0, -0.03), (0.03, 0.0, 0.0), HAND) == in_box
    # Corners outside the workspace are ignored.
    assert plant.min_damping((-1.0, 0.0, -1.0), (1.0, 0.0, 0.0)) > 0.0


def test_brakes_act_up_to_the_top_of_the_texture() -> None:
    """A handle that hovers between the crest and z = 0 is braked as well."""
    plant, high = Pantograph(centre=(0.0375, 0.1)), 0.02
    surface = Surface(Sinusoid(high, 0.1), "A")
    measured = Onset("A", 0, 1.0, 2.0, 1, 1, (0.0, 0.0, -0.01), (0.0, 0.0, 0.5))
    prediction = predict(surface, plant, BandHand(), Servo(1e-4), measured)
    box = (0.0, 0.0, -0.01), (0.0, 0.0, 0.5)
    assert prediction.damping == plant.min_damping(*box, None, high)
    assert prediction.damping != plant.min_damping(*box, None, 0.0)


@pytest.mark.parametrize(
    ("q", "plus", "delay", "damping", "rule"),
    [
        (3.0, 2.0, 0, 5.0, 5.0 / PERIOD),
        (3.0, 2.0, 2, 5.0, 5.0 / PERIOD / 7.0),
        (math.inf, 2.0, 2, 5.0, 5.0 / PERIOD / 5.0),  # below a medial axis q⁺ replaces q
        (math.inf, 2.0, 0, 5.0, 5.0 / PERIOD),
        (3.0, 2.0, 2, 0.0, None),
        (0.0, 0.0, 2, 5.0, None),
        (1e-4, 0.0, 1, 5.0, 5e7),
    ],
)
def test_expected_onset_is_the_limit_of_the_delay_rule(
    q: float,
    plus: float,
    delay: int,
    damping: float,
    rule: float | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """For a wave below z = 0.16 m, with the damping at the handle's start."""
    calls: list[object] = []

    def min_damping(*arguments: object) -> float:
        calls.append(arguments)
        return damping

    monkeypatch.setattr(Cartesian, "min_damping", min_damping)
    for name, value in (("characteristic_number", q), ("one_sided_number", plus)):
        bound = Bound(value, value, "theorem")
        monkeypatch.setattr(onset_module.characteristic, name, lambda *_given, bound=bound: bound)
    servo, start, surface = Servo(PERIOD, delay=delay), (1.0, 2.0, 3.0), Surface(SHARP, "C")
    expected = onset_module.expected_onset(surface, PLANT, HAND, servo, start)
    assert expected == (rule if rule is None else pytest.approx(rule, rel=1e-12))
    assert calls == [(PLANT, start, start, HAND, pytest.approx(TOP))]


def test_nothing_is_predicted_below_the_floor_of_a_baked_field() -> None:
    """A run may press deeper than the field was baked; down to there its numbers hold."""
    heights = 2e-5 * np.random.default_rng(0).normal(size=(6, 6))
    surface = bake(Surface(HeightMap(heights, 1e-4, periodic=True), "H", max_depth=1e-4), 2e-5)
    servo, floor = Servo(PERIOD, delay=1), surface.texture.grid.floor
    inside = predict(surface, PLANT, HAND, servo, onset("H", 1, low=floor + 1e-6))
    assert inside.depth > surface.max_depth
    assert inside.q == pytest.approx(surface.texture.baked_numbers["norm"].upper)
    assert inside.delay_rule > 0.0
    below = predict(surface, PLANT, HAND, servo, onset("H", 1, low=floor - 1e-6))
    assert (below.q, below.one_sided, below.delay_rule) == (math.inf, math.inf, 0.0)
