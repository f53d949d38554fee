"""A few random faults of ``python -m bench.stress.servo_faults`` for every driver."""

from __future__ import annotations

import pytest
from bench.stand_ins.servo_rigs import RIGS
from bench.stress import servo_faults

from asperity.servo.drivers.driver_registry import DRIVER_KINDS


def test_every_driver_has_a_fault_rig() -> None:
    assert set(RIGS) == {"simulated", "replay", *DRIVER_KINDS}


@pytest.mark.parametrize("name", RIGS)
def test_fault_leaves_zero_force_complete_recording_and_allows_restart(name: str) -> None:
    with RIGS[name]() as rig:
        result = servo_faults.inject_faults(rig, 3, seed=2)
    assert result.wrong == []
    assert sum(result.causes.values()) == 3
    assert result.under_force > 0


def test_fault_injection_reports_violations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: a loop that ends without fault and a held force are reported."""
    monkeypatch.setattr(servo_faults, "SAMPLES", 3)
    monkeypatch.setattr(servo_faults, "ANY", ())
    with RIGS["own"]() as rig:
        monkeypatch.setattr(rig, "held_force", lambda _record: (0.0, 0.0, 1.0))
        result = servo_faults.inject_faults(rig, 1)
    assert [message.split(": ")[1] for message in result.wrong] == [
        "no fault",
        "the device holds (0.0, 0.0, 1.0)",
        "the device holds (0.0, 0.0, 1.0) when it is closed",
    ]
