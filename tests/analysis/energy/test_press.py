"""The press: mean normal force, the depth of a press, and the stiffest start for it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import asperity as asp
from asperity.analysis import characteristic_number
from asperity.analysis.energy.press import (
    depth_at_press,
    holds_at_any_press,
    mean_press,
    scan_force_peak,
)
from asperity.analysis.passivity.device_loop import DeviceLoop
from asperity.analysis.passivity.recommended_stiffness import (
    StiffnessRecommendation,
    load_margins,
    recommend_on_loop,
)
from asperity.analysis.results import comparison_rows
from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.laws import find_law
from asperity.surface import Surface
from asperity.textures import Sinusoid, Texture

WAVE = Sinusoid(2e-4, 1.5e-3)


def mean_by_definition(texture: Texture, law: str, depth: float) -> float:
    """Return ⟨f_z⟩/k over a period at z = max h - D, or -D, by its own rule."""
    surface = Surface(texture, law, 1.0, depth)
    x = (np.arange(3001) + 0.5) / 3001 * texture.scan_line().length
    top = surface.law.contact.extremes(texture)[1]
    points = np.column_stack([x, 0.0 * x, np.full(len(x), top - depth)])
    return float(surface.force(points)[:, 2].mean())


def test_greatest_force_is_that_of_full_friction() -> None:
    """Law F reaches it in the second period, and modulates it by its height."""
    surface = Surface(Sinusoid(2e-4, 1e-3), "F", 800.0, 4e-4)
    full = 800.0 * 4e-4 * math.hypot(1.0, 0.8 * (1.0 + 0.8) / 2.0)
    assert scan_force_peak(surface) == pytest.approx(full, rel=1e-3)


def test_greatest_force_is_that_of_either_direction() -> None:
    """Up the gentle flank of a sawtooth, or down it."""
    x = np.arange(64)
    saw = asp.Profile(2e-4 * np.where(x < 48, x / 48, (64 - x) / 16), 2e-5, periodic=True)
    mirrored = asp.Profile(saw.heights[::-1], 2e-5, periodic=True)
    peaks = [scan_force_peak(Surface(one, "C", 1e3, 1e-4, friction=0.5)) for one in (saw, mirrored)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-3)


@pytest.mark.parametrize("law", "WABCEFGH")
def test_press_is_the_mean_force_and_its_depth_the_inverse(law: str) -> None:
    for depth in (5e-5, 3e-4, 9e-4):
        surface = Surface(WAVE, law, 700.0, depth)
        press = mean_press(surface)
        assert press == pytest.approx(700.0 * mean_by_definition(WAVE, law, depth), rel=2e-3)
        assert depth_at_press(surface, press) == pytest.approx(depth, rel=2e-3)
    assert mean_press(Surface(WAVE, "W", 700.0, 9e-4)) == pytest.approx(0.63)


def test_clamps_and_laws_of_one_gain_hold_at_any_press() -> None:
    assert holds_at_any_press(Surface(WAVE, "H"))
    assert holds_at_any_press(Surface(WAVE, "W"))
    assert not holds_at_any_press(Surface(WAVE, "C"))
    assert holds_at_any_press(Surface(WAVE, "C", clamp="backed"))
    assert not holds_at_any_press(Surface(WAVE, "C", clamp="lateral"))


def greatest_gain(surface: Surface, lowest: float) -> float:
    """Return the greatest ‖J‖/k at random points down to a height [m], below all of the texture."""
    rng = np.random.default_rng(3)
    points = np.column_stack(
        [rng.uniform(-2e-3, 2e-3, (20_000, 2)), rng.uniform(lowest, -2e-4, 20_000)]
    )
    _force, jacobian = surface.force_and_jacobian(points)
    norms = np.linalg.norm(np.asarray(jacobian), ord=2, axis=(1, 2))
    return float(norms.max()) / surface.stiffness


def test_a_baked_field_holds_at_any_press() -> None:
    """Its gain is that of its coefficients, far below the deepest of them too; that of C grows."""
    baked = asp.bake(Surface(WAVE, "H", 700.0, 5e-4), press=0.2)
    assert holds_at_any_press(baked)
    upper = characteristic_number(baked).upper
    for lowest in (-1e-3, -0.1):
        assert 0.9 < greatest_gain(baked, lowest) <= upper
    shallow = Surface(WAVE, "C", 700.0, 5e-4)
    assert greatest_gain(shallow, -0.1) > 2.0 * characteristic_number(shallow).upper


def stiffest_by_definition(texture: Texture, law: str, wall: float, press: float) -> float:
    """Return the greatest k with k q(D(F)) <= c K₀ by bisection of k; 0 if there is none.

    Seen from above, k q(D(F)) only falls with k until its floor, which for a law with curvature in
    its gain is F times the curvature.
    """
    budget = load_margins()[find_law(law)].factor * wall

    def gain(stiffness: float) -> float:
        low, high = 0.0, press / stiffness
        while mean_by_definition(texture, law, high) * stiffness < press:
            low, high = high, 2.0 * high
        for _ in range(30):
            middle = 0.5 * (low + high)
            if mean_by_definition(texture, law, middle) * stiffness < press:
                low = middle
            else:
                high = middle
        return stiffness * characteristic_number(Surface(texture, law, 1.0, high)).upper

    low, high = 1e-3 * budget, budget
    if gain(low) > budget:
        return 0.0
    for _ in range(24):
        middle = math.sqrt(low * high)
        if gain(middle) <= budget:
            low = middle
        else:
            high = middle
    return low


def check_random_press(seed: int) -> bool:
    """Compare the start at a random press with its own bisection; return whether there is one."""
    rng = np.random.default_rng([51, seed])
    period = math.exp(rng.uniform(math.log(0.5e-3), math.log(5e-3)))
    texture = Sinusoid(math.exp(rng.uniform(math.log(0.01), math.log(0.5))) * period, period)
    law = str(rng.choice(list("ABCEG")))
    press = math.exp(rng.uniform(math.log(0.02), math.log(3.0)))
    wall = load_device("falcon").max_stiffness
    row = asp.compare(texture, "falcon", law, press=press).rows[0]
    expected = stiffest_by_definition(texture, law, wall, press)
    if not expected:
        assert row.recommended_stiffness == 0.0
        assert row.greatest_press is not None
        assert row.greatest_press < 1.01 * press
        return False
    assert row.recommended_stiffness == pytest.approx(expected, rel=1.2e-2)
    assert row.recommended_stiffness <= expected * (1.0 + 2e-3)
    assert row.press >= press * (1.0 - 2e-3)
    return True


def test_start_at_a_press_is_that_of_an_own_bisection() -> None:
    found = {check_random_press(seed) for seed in range(4)}
    assert found == {False, True}


def test_rows_state_the_press_up_to_which_they_hold() -> None:
    result = asp.compare(WAVE, "touch", "WCGH")
    for row in result.rows:
        assert row.press == pytest.approx(mean_press(row.surface))
        assert row.table_row()["press [N]"] == row.press
    assert "up to a press of" in result["C"].verdict
    assert "at any press" in result["W"].verdict


def test_press_of_a_baked_law_is_reached_at_the_start_of_the_field() -> None:
    row = asp.compare(WAVE, "touch", "H", press=0.2).rows[0]
    assert mean_press(row.surface) >= 0.2 * (1.0 - 2e-3)
    assert row.surface.stiffness == row.recommended_stiffness


def test_curvature_gives_the_gain_a_floor() -> None:
    """C: F times the curvature, whatever the stiffness; the greatest press scales with K₀."""
    device = load_device("touch")
    datum = replace(device.data["max_stiffness"], value=800.0)
    stiffer = replace(device, data={**device.data, "max_stiffness": datum})
    greatest = []
    for one in (device, stiffer):
        row = asp.compare(WAVE, one, "C", press=50.0).rows[0]
        assert (row.recommended_stiffness, row.tier) == (0.0, None)
        assert "none: above" in row.verdict
        greatest.append(row.greatest_press or 0.0)
    assert greatest[1] == pytest.approx(2.0 * greatest[0], rel=2e-2)
    assert asp.compare(WAVE, device, "C", press=0.9 * greatest[0]).rows[0].recommended_stiffness
    assert not asp.compare(WAVE, device, "C", press=1.1 * greatest[0]).rows[0].recommended_stiffness


def test_a_law_that_jumps_is_pressed_as_far_as_it_does_not() -> None:
    """D: no start below the onset of its jumps, and one above it, however soft the press."""
    row = asp.compare(WAVE, "touch", "D", press=1.0).rows[0]
    assert row.greatest_press is not None
    assert row.recommended_stiffness == 0.0 < row.greatest_press
    assert asp.compare(WAVE, "touch", "D", press=0.9 * row.greatest_press).rows[0].tier
    assert not asp.compare(WAVE, "touch", "D", press=1.2 * row.greatest_press).rows[0].tier


def test_the_depth_of_a_press_needs_few_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each depth costs a certified number, which takes half a second on a map."""
    depths: list[float] = []

    def recommend(loop: DeviceLoop, risk: float) -> StiffnessRecommendation:
        depths.append(loop.surface.max_depth)
        return recommend_on_loop(loop, risk)

    monkeypatch.setattr(comparison_rows, "recommend_on_loop", recommend)
    for law in "DE":
        depths.clear()
        asp.compare(WAVE, "touch", law, press=0.3)
        assert len(set(depths)) <= 16


def test_press_and_depth_are_not_given_together_and_a_given_stiffness_has_its_depth() -> None:
    with pytest.raises(ParameterError, match="press chooses the depth"):
        asp.compare(WAVE, "touch", "C", press=1.0, max_depth=1e-4)
    with pytest.raises(ParameterError, match="press must be positive"):
        asp.compare(WAVE, "touch", "C", press=0.0)
    row = asp.compare(WAVE, "touch", "W", 200.0, press=0.1).rows[0]
    assert row.surface.max_depth == pytest.approx(5e-4, rel=1e-5)
    text = " ".join(asp.compare(WAVE, "touch", "W", press=4.0).assumptions)
    assert "The device gives 3.3 N, less than that" in text
