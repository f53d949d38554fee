"""Sentences of loops: the measured update rate against the one for which a stiffness holds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from asperity.devices import override_device, parse_device
from asperity.report.sentences.loop_text import onset_answer, rate_lines
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.loop_memory import LoopStatistics
from asperity.simulation.onset import Onset, Prediction


@pytest.mark.parametrize(
    ("rate", "tested", "skipped", "share"),
    [
        (1000.0, "1 kHz", 0, None),
        (1000.0, "1 kHz", 5, None),
        (1000.0, "1 kHz", 250, "0.8"),
        (4000.0, "1 kHz", 250, None),  # 3.2 kHz: K₀ held at 1 kHz
        (4000.0, "4 kHz", 250, "0.8"),
        (500.0, "1 kHz", 250, "0.8"),  # the answer was for 500 Hz
    ],
)
def test_a_loop_below_the_rate_of_its_answer_is_named(
    rate: float, tested: str, skipped: int, share: str | None
) -> None:
    wall = {"max_stiffness": {"value": 1000.0, "update_rate": tested}}
    device = override_device(parse_device(wall, "mine"), {"update_rate": f"{rate} Hz"})
    lines = rate_lines(
        device, 1.0 / rate, LoopStatistics(1000, skipped, skipped, 0.0, 0, 0, 0, 0.0, (), ())
    )
    if share is None:
        assert lines == []
    else:
        assert f"only {share} of the stiffness" in lines[0]


@pytest.mark.parametrize(
    ("resolution", "cycling", "reason"),
    [
        (0.0, 96.0, "what moves below it decays, but counts as a cycle"),
        (20e-6, 96.0, "not for steps of 20 µm"),
        (0.0, 101.0, None),
    ],
)
def test_a_cycle_below_a_proved_rule_is_explained(
    resolution: float, cycling: float, reason: str | None
) -> None:
    setup = make_setup(load_scene("examples/press.toml"))
    servo = replace(setup.servo, position_resolution=resolution)
    onset = Onset("C", 1, 0.9 * cycling, cycling, 1, 1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    prediction = Prediction(onset, 1e-3, 1.0, 1.0, 1.0, True, 50.0, 100.0, None)
    answer = onset_answer(replace(setup, servo=servo), [prediction])
    assert ("at this share of it: C at d = 1 (96 %)" in answer) == (reason is not None)
    assert reason is None or reason in answer
