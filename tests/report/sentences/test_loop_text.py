"""Sentences of loops: the measured update rate against the one for which a stiffness holds."""

from __future__ import annotations

import pytest

from asperity.devices import override_device, parse_device
from asperity.report.sentences.loop_text import rate_lines
from asperity.servo.loop_memory import LoopStatistics


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
