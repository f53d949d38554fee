"""``asperity calibrate``: what no data sheet gives, measured on the device itself."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.driver import SIMULATED
from asperity.cli.options import device_option, options
from asperity.cli.output import Outputs, check_outputs, output_options, write_output
from asperity.cli.progress import progress_bar
from asperity.cli.run import interrupts
from asperity.cli.settings import Settings, set_option
from asperity.errors import ParameterError, tell

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.servo.calibration.bench import Bench
    from asperity.simulation.servo import Servo

MOST_FORCE = 3.0
"""[N] that a calibration uses at most, unless told."""
_SHARE = 1.0 / 3.0  # of the greatest force
_RATE = 1000.0  # [Hz] where none is known

_CALIBRATE = (
    Argument("force", "greatest force of the calibration", "N", positive=True, example="1N",
             default_words="a third of the device's, at most 3 N, nor more than it holds"),
)  # fmt: skip


@click.command("calibrate")
@device_option("The device as far as it is known: ID of the catalogue, or a TOML file.")
@click.option(
    "--driver", metavar="NAME", default=SIMULATED,
    help="simulated, real (the one of the device's entry), or as asperity run has it."
    "  [default: simulated]",
)  # fmt: skip
@options(_CALIBRATE)
@set_option
@click.option("-o", "--output", metavar="FILE", required=True, help="Device file (TOML) to write.")
@click.option("--yes", is_flag=True, help="Begin without asking: the handle will move.")
@output_options(None)
def command(
    outputs: Outputs, device: Device | None, driver: str, force: float | None,
    settings: Settings, output: str, *, yes: bool,
) -> None:  # fmt: skip
    """Measure a device: noise, steps, rate, delay, mass, damping, friction, and the wall it holds.

    The handle is pushed to and fro along each axis, then held by a smooth wall that gets stiffer
    until it begins to cycle; the force goes at once when it does. Let go of the handle, a hand near
    the switch. Ctrl-C ends it without force, and nothing is written.
    """
    from asperity.devices import load_device
    from asperity.devices.writing import device_text
    from asperity.servo.calibration.calibrate import Calibrator
    from asperity.servo.calibration.result import measured_device

    check_outputs(json=outputs.json, output=output)
    if Path(output).suffix.lower() != ".toml":
        raise ParameterError("output", "must be a device file that ends in .toml", output)
    if device is None:
        raise ParameterError("device", "is missing: --device ID, or a TOML file of what is known")
    base = settings.changed(load_device(device))
    most = force or usual_force(base, real=driver != SIMULATED)
    with (
        interrupts() as asked,
        calibration_bench(base, driver, most, asked, yes=yes) as bench,
        telling() as told,
    ):
        found = Calibrator(bench, RAMP, told).run()
    when, stem = time.strftime("%Y-%m-%d"), Path(output).stem
    made = measured_device(base, found, stem, when, simulated=driver == SIMULATED)
    write_output("output", output, device_text(made))
    from asperity.report.calibration import print_calibration

    data = {"schema": 1, "device": made, "measured": found}
    outputs.write(data, lambda console: print_calibration(made, found, output, console))


RAMP = 0.02
"""[s] in which each force comes and goes."""


def usual_force(device: Device, *, real: bool) -> float:
    """Return the greatest force of a calibration [N].

    Raises:
        ParameterError: for a real device of which none is known.
    """
    most, lasting = device.value("max_force"), device.value("continuous_force")
    if most is None and real:
        raise ParameterError("max_force", "is not known: a device that moves needs it, "
                             "--set max_force=3N")  # fmt: skip
    third = MOST_FORCE if most is None else _SHARE * most
    return min(third, MOST_FORCE, third if lasting is None else lasting)


@contextmanager
def calibration_bench(
    device: Device, driver: str, force: float, asked: list[int], *, yes: bool
) -> Iterator[Bench]:  # fmt: skip
    """Yield a device that can be tried.

    Args:
        device: as far as it is known.
        driver: its driver.
        force: greatest force [N].
        asked: signals that ask for an end.
        yes: whether the user is asked no more.
    """
    from asperity.servo.calibration.bench import ClockedBench, InstantBench
    from asperity.servo.drivers.choice import hardware_driver
    from asperity.servo.safety import Safety
    from asperity.simulation.servo import Servo

    most = device.value("max_force")
    if most is not None and force > most:
        raise ParameterError("force", f"must be at most the device's {most:g} N", force)
    servo = Servo(1.0 / (device.value("update_rate") or _RATE), max_force=force)
    safety = Safety(ramp=RAMP, max_slew=1e3 * force)

    def look() -> None:
        if asked:
            tell("stopped, without force; nothing is written")
            raise KeyboardInterrupt

    if driver == SIMULATED:
        yield Watched(InstantBench(simulated(device, servo), servo, safety), look)
        return
    made = hardware_driver(driver, "lying", (0.0, 0.0, 0.0), device)
    confirm(device, made.when_lost, force, yes=yes)
    with ClockedBench(made, servo, safety, safety.reach_on(device), look) as bench:
        for note in bench.loop.notes:
            tell(note)
        yield bench


class Watched:
    """A bench that is asked for an end between two things it does."""

    def __init__(self, bench: Bench, look: Callable[[], None]) -> None:
        self.servo, self.axes, self._bench, self._look = bench.servo, bench.axes, bench, look

    def do(self, excitation: Any) -> Any:
        """See :class:`~asperity.servo.calibration.bench.Bench`."""
        self._look()
        return self._bench.do(excitation)


def simulated(device: Device, servo: Servo) -> Any:
    """Return the driver of a simulated device, with steps and delay of its own."""
    from dataclasses import replace

    from asperity.scene.alone import with_mass
    from asperity.scene.plant import default_servo, plant_of
    from asperity.servo.drivers.simulated import simulated_driver
    from asperity.simulation import SpringHand, Still

    whole, assumed = with_mass(device)
    plant, said = plant_of(whole)
    own, more = default_servo(device)
    for words in (*assumed, *said, *more):
        tell(words)
    own = replace(own, period=servo.period)
    return simulated_driver(
        plant, SpringHand(), own, Still((0.0, 0.0, 0.0)), servo.period, steps=True
    )  # fmt: skip


def confirm(device: Device, when_lost: str, force: float, *, yes: bool) -> None:
    """Ask whether the handle may move.

    Raises:
        ParameterError: without an answer that it may.
    """
    tell(f"a real device, {device.name}: let go of the handle, a hand near the switch. It will"
         f" move by itself, with up to {force:g} N. If the loop dies: {when_lost}")  # fmt: skip
    if yes:
        return
    if not sys.stdin.isatty() or not click.confirm("Begin?", err=True):
        raise ParameterError("yes", "is missing: the handle moves by itself; --yes begins")


@contextmanager
def telling() -> Iterator[Callable[[str], None]]:
    """Show on standard error what is done, if that is a terminal."""
    with progress_bar("compiling the loop") as told:
        yield lambda words: told(0.0, words)
