"""A measured device: every number with its method and uncertainty."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.core.units import format_quantity
from asperity.devices.device import FIELD_UNITS, Datum, Device, Origin, WallTest
from asperity.servo.calibration.calibrator import AxisCalibration, Calibration
from asperity.servo.calibration.identification import Estimate

SAFETY_SIGMAS = 2.0
"""Standard uncertainties subtracted from a damping that proofs rely on."""
_STEP_PER_SIGMA = math.sqrt(12.0)  # ratio of a step to its standard deviation


def effective_resolution(calibration: Calibration) -> Estimate:
    """Return the step with the standard deviation of steps and noise together [m]."""
    step = calibration.position_step or Estimate(0.0, 0.0)
    noise = _STEP_PER_SIGMA * calibration.noise.value
    value = math.hypot(step.value, noise)
    parts = step.value * step.uncertainty, noise * _STEP_PER_SIGMA * calibration.noise.uncertainty
    if value == 0.0:
        return Estimate(0.0, 0.0)
    return Estimate(value, math.hypot(*parts) / value)


def measured_device(
    base: Device, calibration: Calibration, identity: str, date: str, *, simulated: bool
) -> Device:
    """Return a device with its measured numbers, in place of those of its entry.

    Args:
        base: entry of the device.
        calibration: the measurement.
        identity: id of the new device.
        date: date of the measurement.
        simulated: whether the device was simulated.
    """
    source = f"measured by the calibration of asperity, {date}"
    origin: Origin = "measured"
    suffix = ", measured"
    if simulated:
        source += f", on a simulated {base.id}"
        origin = "simulated"
        suffix = ", simulated and measured"
    data = {field: datum for field, datum in base.data.items() if field not in _MEASURED_FIELDS}

    def add(field: str, value: float, method: str) -> None:
        data[field] = _datum(value, FIELD_UNITS[field], f"{source}: {method}", origin)

    wall = _wall_test(calibration, source, origin)
    if wall is not None:
        data["max_stiffness"] = wall
    resolution = effective_resolution(calibration)
    rate = calibration.update_rate
    if resolution.value:
        noise = format_quantity(calibration.noise.value, "m", digits=2)
        method = f"{_with_uncertainty(resolution, 'm')}, noise at rest {noise}"
        add("position_resolution", resolution.value, method)
    add("update_rate", rate.value, f"fresh readings, {_with_uncertainty(rate, 'Hz')}")
    if not calibration.delay.alternatives:
        method = "the delay that fits best whatever is left out"
        add("delay_samples", calibration.delay.samples, method)
    dynamics = [axis.dynamics for axis in calibration.axes]
    damping = min(d.damping.value - SAFETY_SIGMAS * d.damping.uncertainty for d in dynamics)
    if damping > 0.0:
        method = _describe_axes(calibration, "damping", "N*s/m")
        add("damping", damping, f"{method}; the least, less two uncertainties")
    friction = max(max(axis.friction.value, 0.0) for axis in dynamics)
    add("friction", friction, f"{_describe_axes(calibration, 'friction', 'N')}; the greatest")
    mass = min(axis.mass.value for axis in dynamics)
    if mass > 0.0:
        add("apparent_mass", mass, f"{_describe_axes(calibration, 'mass', 'kg')}; the least")
    return replace(base, id=identity, name=base.name.removesuffix(suffix) + suffix, data=data)


_MEASURED_FIELDS = (
    "max_stiffness",
    "position_resolution",
    "update_rate",
    "delay_samples",
    "damping",
    "friction",
    "apparent_mass",
)


def _wall_test(calibration: Calibration, source: str, origin: Origin) -> WallTest | None:
    """Return the test of the smooth wall on the weakest axis, with the others beside it."""
    if any(not axis.wall.stable_stiffness for axis in calibration.axes):
        return None
    data = {}
    for axis in calibration.axes:
        axis_source = f"{source}: along {axis.name}, {describe_wall(axis)}"
        data[axis.name] = _datum(axis.wall.stable_stiffness, "N/m", axis_source, origin)
    directions = tuple(data)
    weakest = data.pop(calibration.weakest_axis.name)
    cycled = calibration.weakest_axis.wall.cycling_stiffness
    if cycled is not None:
        cycled = _round_to_four_digits(cycled)
    return WallTest(
        weakest.value,
        "N/m",
        weakest.source,
        True,
        tuple(data.values()),
        origin,
        directions=directions,
        lightest=1.0,
        cycled=cycled,
        update_rate=_round_to_four_digits(calibration.update_rate.value),
        delay_samples=None if calibration.delay.alternatives else float(calibration.delay.samples),
        positions="stepped" if calibration.position_step else "exact",
    )


def _datum(value: float, unit: str, source: str, origin: Origin) -> Datum:
    """Return a number with four digits."""
    return Datum(_round_to_four_digits(value), unit, source, True, origin=origin)


def _round_to_four_digits(value: float) -> float:
    """Return a number with four digits: no measurement is more accurate."""
    return float(f"{value:.4g}")


def describe_wall(axis: AxisCalibration) -> str:
    """Return the walls that held, in words."""
    wall = axis.wall
    stable = format_quantity(wall.stable_stiffness, "N/m", digits=3)
    if wall.cycling_stiffness is None:
        return f"held {stable}, and nothing stiffer could be tried"
    cycling = format_quantity(wall.cycling_stiffness, "N/m", digits=3)
    if not wall.stable_stiffness:
        return f"cycled at {cycling} already"
    return f"held {stable}, cycled at {cycling}"


def _describe_axes(calibration: Calibration, name: str, unit: str) -> str:
    return ", ".join(
        f"{_with_uncertainty(getattr(axis.dynamics, name), unit)} along {axis.name}"
        for axis in calibration.axes
    )


def _with_uncertainty(estimate: Estimate, unit: str) -> str:
    """Return a number with its uncertainty, "0.512 ± 0.004 N·s/m".

    Example:
        >>> _with_uncertainty(Estimate(0.05123, 0.0004), "kg")
        '0.0512 ± 0.0004 kg'
    """
    return f"{format_uncertainty(estimate)} {unit.replace('*', '·')}"


def format_uncertainty(estimate: Estimate, scale: float = 1.0) -> str:
    """Return a number rounded to its uncertainty, which has one digit.

    Example:
        >>> format_uncertainty(Estimate(0.2107, 0.0712), 1e3)
        '210 ± 70'
        >>> format_uncertainty(Estimate(5.5e-5, 0.0), 1e6)
        '55'
    """
    value = scale * estimate.value
    uncertainty = scale * estimate.uncertainty
    if uncertainty <= 1e-4 * abs(value):
        return f"{value:.4g}"
    digits = -math.floor(math.log10(uncertainty))
    decimals = max(0, digits)
    return f"{round(value, digits):.{decimals}f} ± {round(uncertainty, digits):.{decimals}f}"
