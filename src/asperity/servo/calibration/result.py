"""What was measured, as a device: every number with how it was found and how sure it is."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.devices.device import FIELDS, Datum, Device, WallTest
from asperity.servo.calibration import calibrate
from asperity.servo.calibration.calibrate import Calibration
from asperity.servo.calibration.identify import Estimate
from asperity.units import engineering

SURE = 2.0
"""Standard uncertainties that are taken off a damping that proofs rest on."""
_NOISE = math.sqrt(12.0)  # a step's scatter is its length over this


def resolution(found: Calibration) -> Estimate:
    """Return the effective resolution: the step whose scatter is that of steps and noise [m]."""
    step = found.step or Estimate(0.0, 0.0)
    noise = _NOISE * found.noise.value
    value = math.hypot(step.value, noise)
    parts = step.value * step.uncertainty, noise * _NOISE * found.noise.uncertainty
    return Estimate(value, math.hypot(*parts) / value if value else 0.0)


def measured_device(
    base: Device, found: Calibration, identity: str, when: str, *, simulated: bool
) -> Device:  # fmt: skip
    """Return a device with what was measured of it, besides what was known.

    Args:
        base: what was known.
        found: what was measured.
        identity: id of the device.
        when: the date.
        simulated: whether the device was a simulated one.
    """
    source = f"measured by asperity calibrate, {when}"
    source += f", on a simulated {base.id}" if simulated else ""
    data = {field: datum for field, datum in base.data.items() if field not in _MEASURED}

    def say(field: str, value: float, words: str) -> None:
        data[field] = Datum(_short(value), FIELDS[field], f"{source}: {words}", True, measured=True)

    wall = _wall(found, source)
    if wall is not None:
        data["max_stiffness"] = wall
    fine = resolution(found)
    if fine.value:
        noise = engineering(found.noise.value, "m", digits=2)
        say("position_resolution", fine.value, f"{_pm(fine, 'm')}, noise at rest {noise}")
    say("update_rate", found.rate.value, f"fresh readings, {_pm(found.rate, 'Hz')}")
    if not found.delay.others:
        say("delay_samples", found.delay.samples, "the delay that fits best whatever is left out")
    sure = [axis.motion.damping for axis in found.axes]
    least = min(one.value - SURE * one.uncertainty for one in sure)
    if least > 0.0:
        words = f"{_each(found, 'damping', 'N*s/m')}; the least, less two uncertainties"
        say("damping", least, words)
    rub = max(max(axis.motion.friction.value, 0.0) for axis in found.axes)
    say("friction", rub, f"{_each(found, 'friction', 'N')}; the greatest")
    mass = min(axis.motion.mass.value for axis in found.axes)
    if mass > 0.0:
        say("apparent_mass", mass, f"{_each(found, 'mass', 'kg')}; the least")
    suffix = ", simulated and measured" if simulated else ", measured"
    return replace(base, id=identity, name=base.name.removesuffix(suffix) + suffix, data=data)


_MEASURED = (
    "max_stiffness", "position_resolution", "update_rate", "delay_samples", "damping", "friction",
    "apparent_mass",
)  # fmt: skip


def _wall(found: Calibration, source: str) -> WallTest | None:
    """Return the test of the smooth wall, of the axis that held least; the others beside it."""
    held = [axis for axis in found.axes if axis.wall.held > 0.0]
    if len(held) < len(found.axes):
        return None
    said = {axis.name: f"{source}: along {axis.name}, {wall_words(axis)}" for axis in found.axes}
    weakest = found.weakest
    also = tuple(
        Datum(_short(axis.wall.held), "N/m", said[axis.name], True, measured=True)
        for axis in found.axes if axis is not weakest
    )  # fmt: skip
    return WallTest(
        _short(weakest.wall.held), "N/m", said[weakest.name], True, also, True,
        directions=tuple(axis.name for axis in found.axes),
        cycled=None if weakest.wall.cycled is None else _short(weakest.wall.cycled),
        update_rate=_short(found.rate.value),
        positions="stepped" if found.step else "exact",
    )  # fmt: skip


def _short(value: float) -> float:
    """Return a number with four digits: no measurement has more."""
    return float(f"{value:.4g}")


def wall_words(axis: calibrate.Axis) -> str:
    """Return which walls held, in words."""
    wall = axis.wall
    if wall.cycled is None:
        return f"held {engineering(wall.held, 'N/m', digits=3)}, and nothing stiffer could be tried"
    if not wall.held:
        return f"cycled at {engineering(wall.cycled, 'N/m', digits=3)} already"
    held, cycled = (engineering(one, "N/m", digits=3) for one in (wall.held, wall.cycled))
    return f"held {held}, cycled at {cycled}"


def _each(found: Calibration, name: str, unit: str) -> str:
    return ", ".join(f"{_pm(getattr(axis.motion, name), unit)} along {axis.name}"
                     for axis in found.axes)  # fmt: skip


def _pm(one: Estimate, unit: str) -> str:
    """Return a number with its uncertainty, "0.512 ± 0.004 N·s/m".

    Example:
        >>> _pm(Estimate(0.05123, 0.0004), "kg")
        '0.0512 ± 0.0004 kg'
    """
    return f"{plus_minus(one)} {unit.replace('*', '·')}"


def plus_minus(one: Estimate, scale: float = 1.0) -> str:
    """Return a number with the digits that its uncertainty leaves, and that in one digit.

    Example:
        >>> plus_minus(Estimate(0.2107, 0.0712), 1e3), plus_minus(Estimate(5.5e-5, 0.0), 1e6)
        ('210 ± 70', '55')
    """
    value, unsure = scale * one.value, scale * one.uncertainty
    if unsure <= 1e-4 * abs(value):
        return f"{value:.4g}"
    digits = -math.floor(math.log10(unsure))
    shown = max(0, digits)
    return f"{round(value, digits):.{shown}f} ± {round(unsure, digits):.{shown}f}"
