"""What a calibration has measured, in a terminal."""

from __future__ import annotations

from rich.console import Console

from asperity.devices import Device
from asperity.errors import printable
from asperity.report import page, terminal
from asperity.report.page import Cell, Row
from asperity.report.terminal import say
from asperity.servo.calibration.calibrate import Axis, Calibration
from asperity.servo.calibration.result import plus_minus, resolution
from asperity.units import engineering

_HEADINGS = ("axis", "wall held", "cycled at", "damping N·s/m", "friction mN", "mass g")


def print_calibration(device: Device, found: Calibration, path: str, console: Console) -> None:
    """Print what was measured, each number with its uncertainty."""
    say(console, f"{device.name}: {len(found.axes)} axes, with up to"
                 f" {engineering(found.force, 'N')}")  # fmt: skip
    rows = [Row([Cell(cell) for cell in _cells(axis)]) for axis in found.axes]
    console.print(terminal.table(page.Table(_HEADINGS, rows, range(1, len(_HEADINGS)))))
    fine = resolution(found)
    step = "read exactly" if found.step is None else f"step {plus_minus(found.step, 1e6)} µm"
    noise = plus_minus(found.noise, 1e6)
    say(console, f"Positions: {step}; noise at rest {noise} µm; together as a step of"
                 f" {engineering(fine.value, 'm')}")  # fmt: skip
    delay = found.delay
    others = ", ".join(map(str, delay.others))
    unsure = f", or {others}: not written" if others else ""
    say(console, f"Rate: {plus_minus(found.rate)} Hz of fresh readings; delay:"
                 f" {delay.samples} samples{unsure}")  # fmt: skip
    weakest = found.weakest
    say(console, f"K₀: {engineering(weakest.wall.held, 'N/m')}, along {weakest.name}, where the"
                 " wall held least")  # fmt: skip
    for name in found.unmoved:
        say(console, f"- The handle does not move along {name}: nothing was measured there")
    console.print(f"Written: {printable(path)}", soft_wrap=True, markup=False)


def _cells(axis: Axis) -> tuple[str, ...]:
    wall, motion = axis.wall, axis.motion
    cycled = "none" if wall.cycled is None else engineering(wall.cycled, "N/m")
    return (
        axis.name, engineering(wall.held, "N/m"), cycled, plus_minus(motion.damping),
        plus_minus(motion.friction, 1e3), plus_minus(motion.mass, 1e3),
    )  # fmt: skip
