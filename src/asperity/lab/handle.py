"""Handle of a real device in the lab, and advice on recovery after a fault."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.scene.setup import Setup
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import DeviceFault, EndReason

_RECOVERY_ADVICE = {
    EndReason.DEVICE: "Check the device, its power and its cable",
    EndReason.NOT_FINITE: "Check the device, its power and its cable",
    EndReason.WORKSPACE: "Move the handle to its centre, and calibrate the device if it asks",
    EndReason.DEPTH: "Lift the handle out of the surface, or set a greater depth",
    EndReason.MISSED_SAMPLES: "Close other programs on this machine",
    EndReason.LATE_SAMPLE: "Close other programs on this machine, and check the cable",
    EndReason.NO_HEARTBEAT: "Close other programs on this machine",
    EndReason.UNRESPONSIVE: "Switch off the force at the device before you touch it",
    EndReason.DIED: "Switch off the force at the device before you touch it",
}


@dataclass(frozen=True)
class Handle:
    """A handle that is moved by a user or a recording, not by the page.

    Attributes:
        driver: of the device.
        motion_source: what moves the handle, for the page.
        start_prompt: shown before the first start.
    """

    driver: Driver
    motion_source: str
    start_prompt: str

    def to_dict(self) -> dict[str, Any]:
        """Return driver, motion source and behaviour on loss for the page."""
        return {
            "driver": self.driver.name,
            "where": self.motion_source,
            "lost": self.driver.loss_notice,
        }


def make_handle(driver: Driver, setup: Setup) -> Handle:
    """Return the handle of a driver on the device of a setup."""
    if not driver.has_moving_handle:
        source = "A recording moves the handle; the pointer has no effect"
        return Handle(driver, source, "stopped: Start replays the recording")
    name = setup.device.name
    return Handle(
        driver,
        f"You hold the handle of {name}; the pointer has no effect. Delay and steps are its own",
        f"stopped. Keep a hand near the switch of {name}, the handle in the air: Start ramps the"
        f" force up. If the loop dies: {driver.loss_notice}",
    )


def recovery_advice(fault: DeviceFault | None) -> str:
    """Return advice after a fault, to be appended to its message; empty without a fault.

    Example:
        >>> recovery_advice(DeviceFault(EndReason.DEPTH, "too deep"))[:42]
        '. Lift the handle out of the surface, or s'
    """
    if fault is None:
        return ""
    advice = _RECOVERY_ADVICE[fault.cause]
    return f". {advice}. Start, with the handle in the air, ramps the force up again"
