"""Predicted and simulated onsets of limit cycles for further devices and surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.devices import device_names, load_device
from asperity.paper.experiments.experiment_setups import GUESSED_DEVICES, device_setup
from asperity.scene.setup import Setup
from asperity.scene.sweeps import map_threads
from asperity.simulation import SpringHand, find_onset
from asperity.simulation.limit_cycles.onset import Onset, Prediction, predict
from asperity.surface import Surface
from asperity.textures import named_surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.texture import Texture

DEVICE_LAWS = "WACFH"
STARTS = 4
LOWEST_STIFFNESS = 400.0  # N/m: balances the hand's 1 N at 2.5 mm
TOLERANCE = 0.1
PRESSING_HAND = SpringHand((300.0, 300.0, 0.0), 3.0, 0.0, (0.0, 0.0, -1.0))


@dataclass(frozen=True)
class DeviceOnset(Serializable):
    """One law on one device and surface.

    Attributes:
        device: id of the device.
        surface: name of the surface.
        catalogue_stiffness: K₀ of the catalogue [N/m].
        prediction: simulated onset, and the limits by the criteria with the hand's damping.
    """

    serialized_attributes = (
        "device surface catalogue_stiffness catalogue_rule catalogue_rule_missed"
    )

    device: str
    surface: str
    catalogue_stiffness: float
    prediction: Prediction

    @property
    def catalogue_rule(self) -> float:
        """K₀/q with the K₀ of the catalogue and the q of the depth reached [N/m]."""
        q = self.prediction.q
        return self.catalogue_stiffness / q if q > 0.0 else math.inf

    @property
    def catalogue_rule_missed(self) -> bool:
        """Whether a limit cycle occurs at a stiffness that K₀/q of the catalogue allows."""
        cycling = self.prediction.onset.cycling
        return math.isfinite(cycling) and cycling <= self.catalogue_rule

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return super().to_dict() | self.prediction.to_dict()


@dataclass(frozen=True)
class DeviceExperiment(Serializable):
    """Further devices and surfaces.

    Attributes:
        onsets: onsets by device, surface and law.
        skipped: devices whose apparent mass or K₀ is not known.
        guessed: assumptions.
    """

    onsets: tuple[DeviceOnset, ...]
    skipped: tuple[str, ...]
    guessed: tuple[str, ...] = GUESSED_DEVICES

    @property
    def wall_ratios(self) -> tuple[float, ...]:
        """Onset of limit cycles of the simulated smooth wall over the catalogue's K₀."""
        return tuple(
            one.prediction.onset.cycling / one.catalogue_stiffness
            for one in self.onsets
            if one.prediction.onset.is_smooth_wall
        )

    @property
    def wall_summary(self) -> str:
        """The range of ``wall_ratios`` in words; empty if no wall was simulated.

        It qualifies the number of cases that cycle below the catalogue's K₀/q.
        """
        if not self.wall_ratios:
            return ""
        span = f"{min(self.wall_ratios):.0f} to {max(self.wall_ratios):.0f}"
        return f"the simulated wall itself cycles only at {span} times the catalogue's K0"


def reference_textures(measured_texture: Texture | None = None) -> dict[str, Texture]:
    """Return a gentle sinusoid and a measured surface, or a synthetic one in its place."""
    name = "yours"
    texture = measured_texture
    if texture is None:
        name = "knurl"
        texture = named_surface("knurl")
    return {"sinusoid A/l = 0.1": Sinusoid(0.1e-3, 1e-3), name: texture}


def usable_devices() -> tuple[list[str], list[str]]:
    """Return the devices with sufficient data, and those without a mass or K₀."""
    usable: list[str] = []
    skipped: list[str] = []
    for name in device_names():
        try:
            _wall_setup(name)
        except ParameterError:
            skipped.append(name)
            continue
        (skipped if catalogue_stiffness(name) is None else usable).append(name)
    return usable, skipped


def _wall_setup(name: str) -> Setup:
    return device_setup(name, Surface(Sinusoid(1e-4, 1e-3), "W"), PRESSING_HAND)


def catalogue_stiffness(name: str) -> float | None:
    """Return K₀ of the catalogue [N/m]; ``None`` if it is not known."""
    return load_device(name).value("max_stiffness")


def device_onset(name: str, surface_name: str, surface: Surface) -> DeviceOnset:
    """Return the onset and the predictions for one law, device and surface."""
    setup = device_setup(name, surface, PRESSING_HAND)
    onset: Onset = find_onset(
        *(setup.surface, setup.plant, setup.hand, setup.servo, setup.motion),
        start=setup.start,
        duration=setup.duration,
        starts=STARTS,
        tolerance=TOLERANCE,
        lowest=LOWEST_STIFFNESS,
    )
    prediction = predict(surface, setup.plant, setup.hand, setup.servo, onset)
    return DeviceOnset(name, surface_name, catalogue_stiffness(name) or math.inf, prediction)


def device_experiment(
    measured_texture: Texture | None = None, laws: str = DEVICE_LAWS
) -> DeviceExperiment:
    """Predict and simulate the onsets for every device with sufficient data.

    Args:
        measured_texture: a measured surface; by default a synthetic knurl. Surfaces that are not
            profiles are simulated only for devices that move in space.
        laws: letters of the laws.
    """
    usable, skipped = usable_devices()
    jobs = []
    for name in usable:
        is_planar = _wall_setup(name).plant.is_planar
        for title, texture in reference_textures(measured_texture).items():
            if is_planar and not texture.is_profile:
                continue  # its handle stays in the x-z plane
            jobs += [(name, title, Surface(texture, law, max_depth=1e-3)) for law in laws]
    return DeviceExperiment(map_threads(device_onset, jobs), tuple(skipped))
