"""A few of the random faults of ``python -m bench.servo_faults``, for every driver."""

from __future__ import annotations

import pytest
from bench import servo_faults
from bench.servo_rigs import RIGS

from asperity.servo.drivers.driver_registry import DRIVER_KINDS


def test_every_driver_has_a_rig() -> None:
    assert set(RIGS) == {"simulated", "replay", *DRIVER_KINDS}


@pytest.mark.parametrize("name", RIGS)
def test_a_fault_leaves_no_force_a_whole_recording_and_a_next_start(name: str) -> None:
    with RIGS[name]() as rig:
        said = servo_faults.inject_faults(rig, 3, seed=2)
    assert said.wrong == []
    assert sum(said.causes.values()) == 3
    assert said.under_force > 0


def test_what_is_wrong_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop that ends by itself is no fault, and a device that keeps its force is seen."""
    monkeypatch.setattr(servo_faults, "SAMPLES", 3)
    monkeypatch.setattr(servo_faults, "ANY", ())
    with RIGS["own"]() as rig:
        monkeypatch.setattr(rig, "held_force", lambda _record: (0.0, 0.0, 1.0))
        said = servo_faults.inject_faults(rig, 1)
    assert [words.split(": ")[1] for words in said.wrong] == [
        "no fault",
        "the device holds (0.0, 0.0, 1.0)",
        "the device holds (0.0, 0.0, 1.0) when it is closed",
    ]
