"""What the commands share that run a loop by a driver, on a real device or instead of one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.loop import read_setup
from asperity.cli.options import Command
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError, tell

if TYPE_CHECKING:
    from asperity.scene.setup import Setup
    from asperity.servo.drivers.driver import Driver
    from asperity.servo.process import Spare
    from asperity.simulation.servo import Servo

SIMULATED = "simulated"
REPLAY = "replay:"
# The force is bounded, and what is said of it holds at every depth, if the law can be clamped.
CLAMPED = {"clamp": "backed"}


def driver_options(command: Command) -> Command:
    """Add ``--driver`` and ``--accept-risk``."""
    command = click.option(
        "--accept-risk", is_flag=True, help="Render a stiffness above the analysed limit."
    )(command)
    return click.option(
        "--driver",
        metavar="NAME",
        default=SIMULATED,
        help="simulated, real (the one of the device's entry), haply, forcedimension, openhaptics,"
        " ./device.so, or replay:run.mcap.  [default: simulated]",
    )(command)


def driven_setup(
    source: str, values: dict[str, Any], name: str, duration: float | None = None
) -> tuple[Setup, Servo]:
    """Return what is rendered by a driver that is not the simulated one, and its electronics.

    On a real device steps and delay are its own: the loop adds none.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    setup = read_setup(source, values, duration, defaults=CLAMPED, simulated=False, alone=True)
    own = setup.servo
    if name.startswith(REPLAY):
        return setup, own
    servo = replace(own, delay=0, position_resolution=0.0, force_resolution=0.0)
    return replace(setup, servo=servo), own


def named_driver(name: str, setup: Setup) -> Driver:
    """Return the driver that a word names; of a real device it is said what to mind.

    Raises:
        ParameterError: for a driver that is unknown, or a recording that cannot be replayed.
    """
    if name.startswith(REPLAY):
        from asperity.servo.drivers.replay import replay_driver

        return replay_driver(name.removeprefix(REPLAY), setup.servo.period)
    from asperity.servo.drivers.choice import hardware_driver

    driver = hardware_driver(name, setup.safety.wall, setup.safety.origin, setup.device)
    tell(f"a real device, {setup.device.name}: a hand near its switch. If the loop dies:"
         f" {driver.when_lost}")  # fmt: skip
    return driver


def refuse_risk(setup: Setup) -> None:
    """Refuse a stiffness above the analysed limit.

    Raises:
        ParameterError: with the reason.
    """
    from asperity.servo.risk import risk

    with progress_bar("analysing the surface"):
        reason = risk(setup.surface, setup.device)
    if reason:
        raise ParameterError("stiffness", f"is refused: {reason}; --accept-risk renders it")


@contextmanager
def spare_process() -> Iterator[Spare]:
    """Let the loop's process start while the surface is read and analysed."""
    from asperity.servo.process import Spare

    spare = Spare()
    try:
        yield spare
    finally:
        spare.end()
