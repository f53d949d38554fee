"""What the program calls passive, against the exact ledger of random conservative scenes."""

from __future__ import annotations

from bench.random_scenes import ROUNDING, outcomes, scenes


def test_a_passive_loop_never_gains_energy() -> None:
    """Masses, hand, start and damping along other directions are not in what the verdict used."""
    drawn = list(scenes(120, seed=20))
    assert all(scene.passive for scene in drawn)
    found = outcomes(drawn)
    counted = [each for each in found if each.is_valid]
    assert len(counted) > 100
    assert not [each for each in counted if each.excess > ROUNDING]
    assert not [each for each in counted if each.cycles]


def test_far_above_the_limit_scenes_gain_and_cycle() -> None:
    """Negative control: the same scenes at 6 to 12 times the limit."""
    found = outcomes(list(scenes(60, seed=20, factor=(6.0, 12.0))))
    assert sum(each.excess > ROUNDING for each in found) > 40
    assert sum(each.cycles for each in found) > 40


def test_the_old_wall_rule_lets_scenes_gain() -> None:
    """Negative control: K₀/q⁺ of a wall that cycles along its normal, once called passive."""
    drawn = list(scenes(60, seed=20, factor=None))
    found = outcomes(drawn)
    assert sum(each.excess > ROUNDING for each in found) >= 5
    assert not [
        each
        for scene, each in zip(drawn, found, strict=True)
        if scene.passive and (each.cycles or each.excess > ROUNDING)
    ]
