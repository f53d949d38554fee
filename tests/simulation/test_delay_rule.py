"""The delay rule k (q⁺/2 + d q) <= σ₀/T against the exact ledger of random conservative scenes."""

from __future__ import annotations

from bench.random_scenes import ROUNDING, outcomes, scenes


def test_the_rule_is_never_violated() -> None:
    found = outcomes(list(scenes(120, seed=20)))
    counted = [each for each in found if each.counted]
    assert len(counted) > 100
    assert not [each for each in counted if each.excess > ROUNDING]
    assert not [each for each in counted if each.cycles]


def test_far_above_the_limit_scenes_gain_and_cycle() -> None:
    """Negative control: the same scenes at 6 to 12 times the limit."""
    found = outcomes(list(scenes(60, seed=20, factor=(6.0, 12.0))))
    assert sum(each.excess > ROUNDING for each in found) > 40
    assert sum(each.cycles for each in found) > 40
