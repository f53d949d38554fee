"""What the paper could not do: predicted and simulated onsets for other devices and surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from asperity.devices import device_names, load_device
from asperity.errors import ParameterError
from asperity.files import Record, plain
from asperity.paper.experiments.settings import device_setup
from asperity.scene.sweeps import side_by_side
from asperity.simulation import Pantograph, SpringHand, find_onset
from asperity.simulation.onset import Onset
from asperity.simulation.prediction import Prediction, predict
from asperity.surface import Surface
from asperity.textures import named_surface
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture

LAWS = "WACFH"
STARTS = 4
LOWEST = 400.0  # N/m: what holds the hand's 1 N at 2.5 mm
TOLERANCE = 0.1
HAND = SpringHand((300.0, 300.0, 0.0), 3.0, 0.0, (0.0, 0.0, -1.0))
GUESSED = (
    "The hand: 300 N/m sideways, 3 N·s/m, pressing with 1 N. Its damping is all that most of these "
    "devices have: none of their physical damping is published",
    "Where the update rate is not known 1 kHz was simulated, where the delay is not known none",
)


@dataclass(frozen=True)
class DeviceOnset:
    """One law on one device and surface.

    Attributes:
        device: its id.
        surface: its name.
        stiffest: K₀ of the catalogue [N/m].
        prediction: what was simulated, and what the criteria with the hand's damping allow.
    """

    device: str
    surface: str
    stiffest: float
    prediction: Prediction

    @property
    def allowed(self) -> float:
        """K₀/q with the K₀ of the catalogue [N/m], at the depth that was reached."""
        q = self.prediction.q
        return self.stiffest / q if q > 0.0 else math.inf

    @property
    def missed(self) -> bool:
        """Whether a limit cycle was found at a stiffness that K₀/q of the catalogue allows."""
        cycling = self.prediction.onset.cycling
        return math.isfinite(cycling) and cycling <= self.allowed

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        own = {
            "device": self.device,
            "surface": self.surface,
            "catalogue_stiffness": self.stiffest,
            "catalogue_rule": self.allowed,
            "catalogue_rule_missed": self.missed,
        }
        return plain(own) | self.prediction.to_dict()


@dataclass(frozen=True)
class BeyondExperiment(Record):
    """Other devices and surfaces.

    Attributes:
        onsets: by device, surface and law.
        skipped: devices whose apparent mass (or K₀) is not known.
        guessed: what was assumed.
    """

    onsets: tuple[DeviceOnset, ...]
    skipped: tuple[str, ...]
    guessed: tuple[str, ...] = GUESSED

    @property
    def walls(self) -> tuple[float, ...]:
        """At how many times the catalogue's K₀ the simulated smooth wall itself cycles."""
        return tuple(
            one.prediction.onset.cycling / one.stiffest
            for one in self.onsets
            if one.prediction.onset.wall
        )

    @property
    def how_far(self) -> str:
        """Where the walls cycle, in words; empty if none was simulated.

        Without it the number of cases that cycle below the catalogue's K₀/q would say too much.
        """
        if not self.walls:
            return ""
        span = f"{min(self.walls):.0f} to {max(self.walls):.0f}"
        return f"the simulated wall itself cycles only at {span} times the catalogue's K0"


def surfaces(measured: Texture | None = None) -> dict[str, Texture]:
    """Return a gentle sinusoid, and a measured surface or a drawn one in its place."""
    gentle = {"sinusoid A/l = 0.1": Sinusoid(0.1e-3, 1e-3)}
    return gentle | ({"knurl": named_surface("knurl")} if measured is None else {"yours": measured})


def usable_devices() -> tuple[list[str], list[str]]:
    """Return the devices whose data suffice, and the others: they lack a mass or K₀."""
    usable: list[str] = []
    skipped: list[str] = []
    for name in device_names():
        try:
            device_setup(name, Surface(Sinusoid(1e-4, 1e-3), "W"), HAND)
        except ParameterError:
            skipped.append(name)
            continue
        (skipped if catalogue_stiffness(name) is None else usable).append(name)
    return usable, skipped


def catalogue_stiffness(name: str) -> float | None:
    """Return K₀ of the catalogue [N/m]; ``None`` where it is not known."""
    return load_device(name).value("max_stiffness")


def device_onset(name: str, title: str, surface: Surface) -> DeviceOnset:
    """Return onset and predictions of one law on one device and surface."""
    setup = device_setup(name, surface, HAND)
    found: Onset = find_onset(
        setup.surface, setup.plant, setup.hand, setup.servo, setup.motion, start=setup.start,
        duration=setup.duration, starts=STARTS, tolerance=TOLERANCE, lowest=LOWEST,
    )  # fmt: skip
    said = predict(surface, setup.plant, setup.hand, setup.servo, found)
    stiffest = catalogue_stiffness(name)
    return DeviceOnset(name, title, math.inf if stiffest is None else stiffest, said)


def beyond_experiment(measured: Texture | None = None, laws: str = LAWS) -> BeyondExperiment:
    """Return predicted and simulated onsets for every device whose data suffice.

    Args:
        measured: a surface; without one a drawn knurl takes its place. Only devices that move in
            space feel a surface that is no profile.
        laws: letters.
    """
    usable, skipped = usable_devices()
    jobs = []
    for name in usable:
        planar = isinstance(
            device_setup(name, Surface(Sinusoid(1e-4, 1e-3), "W"), HAND).plant, Pantograph
        )
        for title, texture in surfaces(measured).items():
            if planar and not texture.is_profile:
                continue  # its handle stays in the x-z plane
            jobs += [(name, title, Surface(texture, law, max_depth=1e-3)) for law in laws]
    return BeyondExperiment(side_by_side(device_onset, jobs), tuple(skipped))
