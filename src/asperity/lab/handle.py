"""A handle that somebody holds while the lab shows its loop, and what he must do when it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.scene.setup import Setup
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import Cause, DeviceFault

_ADVICE = {
    Cause.DEVICE: "See to the device, its power and its cable",
    Cause.NUMBER: "See to the device, its power and its cable",
    Cause.WORKSPACE: "Bring the handle to its middle, and calibrate the device if it asks for it",
    Cause.DEPTH: "Lift the handle out of the surface; a greater depth is set here",
    Cause.MISSES: "End what else keeps this machine busy",
    Cause.LATE: "End what else keeps this machine busy, and see to the cable",
    Cause.PARENT: "End what else keeps this machine busy",
    Cause.SILENT: "Cut the force at the device before you touch it",
    Cause.DIED: "Cut the force at the device before you touch it",
}


@dataclass(frozen=True)
class Handle:
    """A handle that the page does not move.

    Attributes:
        driver: of the device.
        where: what moves it, for the page.
        begins: what is said before the first start.
    """

    driver: Driver
    where: str
    begins: str

    def to_dict(self) -> dict[str, Any]:
        """Return what the page says of it."""
        return {"driver": self.driver.name, "where": self.where, "lost": self.driver.when_lost}


def make_handle(driver: Driver, setup: Setup) -> Handle:
    """Return the handle of a driver on the device of a setup."""
    if not driver.moving:
        words = "A recording moves the handle: the pointer moves nothing"
        return Handle(driver, words, "nothing moves yet: Start begins the recording")
    name = setup.device.name
    return Handle(
        driver,
        f"Your hand holds the handle of {name}: the pointer moves nothing. Delay and steps are its"
        " own",
        f"nothing moves yet. A hand near the switch of {name}, the handle in the air: Start brings"
        f" the force in. If the loop dies: {driver.when_lost}",
    )


def advice(fault: DeviceFault | None) -> str:
    """Return what to do after a fault, as what follows its words; nothing without one.

    Example:
        >>> advice(DeviceFault(Cause.DEPTH, "too deep"))[:42]
        '. Lift the handle out of the surface; a gr'
    """
    if fault is None:
        return ""
    return f". {_ADVICE[fault.cause]}. Start, with the handle in the air, brings the force in again"
