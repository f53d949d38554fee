"""Passive verdicts compared with the exact energy balance of random conservative scenes."""

from __future__ import annotations

from bench.stress.random_scenes import ROUNDING, outcomes, scenes


def test_passive_scenes_never_gain_energy() -> None:
    """The verdict does not use masses, hand, initial state or damping along other directions."""
    sampled_scenes = list(scenes(120, seed=20))
    assert all(scene.passive for scene in sampled_scenes)
    results = outcomes(sampled_scenes)
    valid = [outcome for outcome in results if outcome.is_valid]
    assert len(valid) > 100
    assert not [outcome for outcome in valid if outcome.excess > ROUNDING]
    assert not [outcome for outcome in valid if outcome.cycles]


def test_scenes_far_above_the_limit_gain_energy_and_cycle() -> None:
    """Negative control: the same scenes at 6 to 12 times the limit."""
    results = outcomes(list(scenes(60, seed=20, factor=(6.0, 12.0))))
    assert sum(outcome.excess > ROUNDING for outcome in results) > 40
    assert sum(outcome.cycles for outcome in results) > 40


def test_former_wall_rule_admits_scenes_that_gain_energy() -> None:
    """Negative control: K₀/q⁺ from a wall test is not a sufficient condition for passivity."""
    sampled_scenes = list(scenes(60, seed=20, factor=None))
    results = outcomes(sampled_scenes)
    assert sum(outcome.excess > ROUNDING for outcome in results) >= 5
    assert not [
        outcome
        for scene, outcome in zip(sampled_scenes, results, strict=True)
        if scene.passive and (outcome.cycles or outcome.excess > ROUNDING)
    ]
