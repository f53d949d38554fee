"""``asperity run``: a surface in a loop that keeps time, on a simulated device or a real one."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.loop import loop_options, read_setup
from asperity.cli.options import options
from asperity.cli.output import Outputs, check_outputs, output_options
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError, tell

if TYPE_CHECKING:
    from asperity.scene.setup import Setup
    from asperity.servo.fault import Cause
    from asperity.servo.process import ServoProcess, Spare

SIMULATED = "simulated"
REPLAY = "replay:"
LOOK = 0.05
"""[s] between two looks at the loop."""

_RUN = (
    Argument("duration", "of the run", "s", default_words="the scene's", example="10s",
             positive=True),
)  # fmt: skip


@click.command("run")
@loop_options
@options(_RUN)
@click.option(
    "--driver",
    metavar="NAME",
    default=SIMULATED,
    help="simulated, real (the one of the device's entry), haply, forcedimension, openhaptics,"
    " ./device.so, or replay:run.mcap.  [default: simulated]",
)
@click.option(
    "--record",
    metavar="PATH",
    help="Record every sample as it comes, 'run.mcap': asperity recording reads it.",
)
@click.option("--accept-risk", is_flag=True, help="Render a stiffness above the analysed limit.")
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
    # Its force is bounded, and what is said of it holds at every depth, if the law can be clamped.
    real = driver != SIMULATED
    setup = read_setup(
        scene, values, duration, defaults={"clamp": "backed"}, simulated=not real, alone=True
    )
    read = setup.contents()
    if real and not driver.startswith(REPLAY):
        setup = with_its_own_electronics(setup)
    if not accept_risk:
        refuse_risk(setup)
    from asperity.report.device_run import print_device_run

    if driver.startswith(REPLAY):
        loop = replaying_loop(setup, driver.removeprefix(REPLAY), duration, spare)
    else:
        loop = real_loop(setup, driver, duration, spare) if real else simulated_loop(setup, spare)
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


def with_its_own_electronics(setup: Setup) -> Setup:
    """Return the same on a real device: there steps and delay are its own."""
    servo = replace(setup.servo, delay=0, position_resolution=0.0, force_resolution=0.0)
    return replace(setup, servo=servo)


def replaying_loop(setup: Setup, path: str, duration: float | None, spare: Spare) -> ServoProcess:
    """Return a loop whose handle goes where it went in a recording."""
    from asperity.servo.drivers.replay import replay_driver
    from asperity.servo.process import ServoProcess

    driver = replay_driver(path, setup.servo.period)
    span = setup.servo.period * len(driver.points) if duration is None else duration
    reach = setup.safety.reach_on(setup.device)
    return ServoProcess(setup.surface, driver, setup.servo, setup.safety, reach, span, spare=spare)


def real_loop(setup: Setup, name: str, duration: float | None, spare: Spare) -> ServoProcess:
    """Return a loop on a real device.

    Raises:
        ParameterError: for a driver that is unknown, or a device without a greatest force.
    """
    from asperity.servo.drivers.choice import hardware_driver
    from asperity.servo.process import ServoProcess

    safety = setup.safety
    driver = hardware_driver(name, safety.wall, safety.origin, setup.device)
    tell(f"a real device, {setup.device.name}: a hand near its switch. If the loop dies:"
         f" {driver.when_lost}")  # fmt: skip
    return ServoProcess(
        setup.surface,
        driver,
        setup.servo,
        safety,
        safety.reach_on(setup.device),
        duration,
        spare=spare,
    )


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
