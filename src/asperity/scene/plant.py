"""The plant and the servo of a device, as far as its numbers are known."""

from __future__ import annotations

from typing import Any

from asperity.devices import Device
from asperity.devices.five_bar import FiveBar
from asperity.errors import ParameterError
from asperity.simulation import Cartesian, Pantograph, Plant, Resonance, Servo
from asperity.units import engineering

LINKS = ("proximal_link", "distal_link", "base_distance")
DEFAULT_RATE = 1000.0
BRAKES = ("inside", "always")


def plant_of(
    device: Device,
    *,
    centre: tuple[float, float] | None = None,
    resonance: bool = False,
    brakes: str | None = None,
    dynamics: bool = True,
) -> tuple[Plant, list[str]]:
    """Return what moves, and what was assumed of it.

    A device with links and a joint damping is a five-bar in the plane of x and z; one with an
    apparent mass a mass in space, with its physical damping and its dry friction.

    Args:
        device: whose numbers are used.
        centre: of the five-bar's plane, where the scene's origin is [m]; default: on its axis of
            symmetry, 100 mm from the motors.
        resonance: whether the bandwidth is the first structural mode of a mass in space.
        brakes: of a five-bar, "inside" the body only (default) or "always".
        dynamics: whether the plant's motion counts; a handle that is moved needs no mass.

    Raises:
        ParameterError: for a device that lacks a number, which is named, or an argument that it
            has no use for.
    """
    if brakes is not None and brakes not in BRAKES:
        raise ParameterError("run.brakes", "must be 'inside' or 'always'", brakes)
    if dynamics and all(device.value(name) is not None for name in (*LINKS, "joint_damping")):
        return _five_bar(device, centre, resonance, brakes)
    for name, value in (("centre", centre), ("brakes", brakes)):
        if value is not None:
            reason = f"needs a five-bar, which {device.id} is not"
            if not dynamics:
                reason = "means nothing for a handle that is moved"
            raise ParameterError(f"run.{name}", reason)
    if not dynamics:
        return Cartesian(mass=1.0), []
    return _mass(device, resonance)


def _five_bar(
    device: Device, centre: tuple[float, float] | None, resonance: bool, brakes: str | None
) -> tuple[Plant, list[str]]:
    if resonance:
        raise ParameterError("run.resonance", "is not modelled for a five-bar: leave it out")
    proximal, distal, base = (float(device.value(name) or 0.0) for name in LINKS)
    plant = Pantograph(
        FiveBar(proximal, distal, base),
        joint_damping=device.value("joint_damping") or 0.0,
        centre=centre or (-0.5 * base, 0.1),
        inside_only=brakes != "always",
        friction=device.value("friction") or 0.0,
    )
    return plant, list(plant.notes)


def _mass(device: Device, resonance: bool) -> tuple[Plant, list[str]]:
    mass = device.value("apparent_mass")
    if mass is None:
        words = 'is not known: give [device] apparent_mass = "50 g"'
        raise ParameterError("device", f"{device.id}: its apparent_mass {words}")
    said = []
    values: dict[str, float] = {}
    for field, words in (("damping", "physical damping"), ("friction", "dry friction")):
        value = device.value(field)
        values[field] = value or 0.0
        if value is None:
            said.append(f"The {words} of {device.name} is not known; none is simulated")
    mode = None
    if resonance:
        bandwidth = device.value("bandwidth")
        if bandwidth is None:
            raise ParameterError("run.resonance", f"needs the bandwidth of {device.id} [Hz]")
        mode = Resonance(bandwidth)
        said.append(f"First mode at {engineering(bandwidth, 'Hz')}: half the mass, 2 % damping")
    return Cartesian(mass, values["damping"], mode, values["friction"]), said


def default_servo(device: Device, *, keeps_delay: bool = True) -> tuple[Servo, list[str]]:
    """Return the servo of a device, and what was assumed of it.

    Args:
        device: whose numbers are used.
        keeps_delay: whether the delay is the one that counts; else nothing is said of it.
    """
    rate, said = device.value("update_rate"), []
    if rate is None:
        rate = DEFAULT_RATE
        said.append(f"The update rate of {device.name} is not known; {rate:g} Hz is simulated")
    fields = ("position_resolution", "force_resolution", "max_force", "virtual_damping")
    known: dict[str, Any] = {name: device.value(name) for name in fields if name in device.data}
    delay = device.value("delay_samples")
    if delay is None and keeps_delay:
        said.append(f"The delay of {device.name} is not known; none is simulated")
    return Servo(1.0 / rate, delay=int(delay or 0), **known), said
