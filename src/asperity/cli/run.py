"""``asperity run``: a surface in a loop that keeps time, on a simulated device or a real one."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.driver import (
    CLAMPED,
    SIMULATED,
    driven_setup,
    driver_options,
    named_driver,
    refuse_risk,
    spare_process,
)
from asperity.cli.loop import loop_options, read_setup
from asperity.cli.options import options
from asperity.cli.output import Outputs, check_outputs, output_options
from asperity.cli.progress import progress_bar
from asperity.errors import tell

if TYPE_CHECKING:
    from asperity.scene.setup import Setup
    from asperity.servo.fault import Cause
    from asperity.servo.process import ServoProcess, Spare

LOOK = 0.05
"""[s] between two looks at the loop."""

_RUN = (
    Argument("duration", "of the run", "s", default_words="the scene's", example="10s",
             positive=True),
)  # fmt: skip


@click.command("run")
@loop_options
@options(_RUN)
@driver_options
@click.option(
    "--record",
    metavar="PATH",
    help="Record every sample as it comes, 'run.mcap': asperity recording reads it.",
)
@output_options(None)
def command(
    scene: str,
    outputs: Outputs,
    duration: float | None,
    driver: str,
    record: str | None,
    accept_risk: bool,
    **values: Any,
) -> None:
    """Render SURFACE as time goes, on its device simulated, or by a driver on a real one.

    SURFACE is a scene (TOML), a texture with its arguments or a measured file; without a scene law
    and stiffness are those that compare recommends, and a simulated hand strokes it for 10 s.

    The loop is a process of its own that reads, computes and writes at the device's rate, with
    limits on force, slew, depth, lateness and energy: section [servo] of the scene. Ctrl-C lets the
    force go and ends it; a fault makes the force zero and ends with exit code 3.
    """
    check_outputs(json=outputs.json, record=record)
    spare = click.get_current_context().with_resource(spare_process())
    if driver == SIMULATED:
        setup = read_setup(scene, values, duration, defaults=CLAMPED, alone=True)
    else:
        setup, _own = driven_setup(scene, values, driver, duration)
    read = setup.contents()
    if not accept_risk:
        refuse_risk(setup)
    from asperity.report.device_run import print_device_run

    if driver == SIMULATED:
        loop = simulated_loop(setup, spare)
    else:
        loop = driven_loop(setup, driver, duration, spare)
    with interrupts() as asked, recorder(record, loop, setup) as take:
        with progress_bar("compiling the loop"):
            loop.start()
        try:
            cause = watched(loop, asked, take)
        finally:
            loop.stop()
    for path, now in setup.contents().items():
        if read.get(path, now) != now:
            tell(f"{path} was changed meanwhile; what was read at the start was rendered")
    data = {
        "schema": 1, "scene": setup, "driver": driver, "ended": cause.name.lower(),
        "notes": loop.notes, "statistics": loop.statistics,
    }  # fmt: skip
    outputs.write(data, lambda console: print_device_run(setup, loop, cause, record, console))


def simulated_loop(setup: Setup, spare: Spare) -> ServoProcess:
    """Return a loop on the simulated device and hand of a scene."""
    from asperity.servo.drivers.simulated import simulated_driver
    from asperity.servo.process import ServoProcess

    driver = simulated_driver(
        setup.plant, setup.hand, setup.servo, setup.motion, setup.duration, setup.start,
        setup.velocity,
    )  # fmt: skip
    reach = setup.safety.reach_on(setup.device)
    return ServoProcess(
        setup.surface, driver, setup.servo, setup.safety, reach, setup.duration, spare=spare
    )


def driven_loop(setup: Setup, name: str, duration: float | None, spare: Spare) -> ServoProcess:
    """Return a loop on the device of a driver; without a duration a replay ends with its rows.

    Raises:
        ParameterError: for a driver that is unknown, or a device without a greatest force.
    """
    from asperity.servo.process import ServoProcess

    driver = named_driver(name, setup)
    if duration is None and driver.readings is not None:
        duration = setup.servo.period * driver.readings
    return ServoProcess(
        setup.surface, driver, setup.servo, setup.safety, setup.safety.reach_on(setup.device),
        duration, spare=spare,
    )  # fmt: skip


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect the signals that ask for an end, instead of being ended by them."""
    asked: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        asked.append(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def recorder(path: str | None, loop: ServoProcess, setup: Setup) -> Iterator[Callable[[], None]]:
    """Record a loop, if that is asked for; yield what takes the rows that have come."""
    if path is None:
        yield lambda: None
        return
    from asperity.servo.recorder import Recorder

    about = setup.about(loop.driver)
    with Recorder(path, loop, setup.surface, setup.servo, about) as kept:
        yield kept.take
    if kept.lost:
        tell(f"{kept.lost} rows are missing in the recording: this program was too slow")


def watched(loop: ServoProcess, asked: list[int], take: Callable[[], None]) -> Cause:
    """Watch a loop until it ends, or is asked to.

    Args:
        loop: that runs.
        asked: signals that ask for an end.
        take: what is called at each look.

    Returns:
        What ended it.

    Raises:
        DeviceFault: if it was a fault.
    """
    from asperity.servo.fault import Cause

    for note in loop.notes:
        tell(note)
    with live_view() as show:
        while (cause := loop.poll()) is Cause.GOING:
            if asked:
                loop.stop()
                continue
            take()
            show(loop)
            time.sleep(LOOK)
    return cause


@contextmanager
def live_view() -> Iterator[Any]:
    """Show position, force, energy and lateness on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _loop: None
        return
    from rich.console import Console
    from rich.live import Live

    from asperity.report.device_run import state_line

    with Live(console=Console(stderr=True), transient=True, refresh_per_second=20) as live:
        yield lambda loop: live.update(state_line(loop))
