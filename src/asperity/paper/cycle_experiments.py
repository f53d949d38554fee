"""Setups of the experiments of section V, and those on limit cycles: V.A, and further devices.

The paper states T, the resolution, stiffness, texture, friction and joint damping. All other
parameters are from other sources, fitted or guessed, and are listed in every result.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable, written
from asperity.devices import device_names, load_device
from asperity.paper.cases import BUMP, PASSIVITY, SAMPLING_PERIOD, SCANNING
from asperity.scene.scene_defaults import make_plant
from asperity.scene.setup import Setup
from asperity.scene.sweeps import map_threads, sweep_onsets
from asperity.simulation import (
    BandHand,
    Motion,
    Pantograph,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    find_onset,
)
from asperity.simulation.hands import Hand
from asperity.simulation.lanes import BatchSimulation, StopRule, Trajectory
from asperity.simulation.onset import Onset, Prediction, predict, run_starts, start_offsets
from asperity.surface import Surface
from asperity.textures import named_surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.texture import Texture

RESOLUTION = 15e-6  # m, stated: "better than"
ALL_LAWS = "WABCDEFGH"
FITTED_DELAY = 6  # samples, fitted: of 0 and 4 to 7 the one at which W settles while A and F cycle
TRACE_STRIDE = 10  # samples

# What sections V.A, V.B, V.C and further devices require and the paper does not state.
FITTED_ASSUMPTIONS = (
    "Link masses (about 20 g at the handle): guessed, the paper gives none",
    "Link lengths 63, 75, 25 mm: the published device, not read in a source",
    "Working point (37.5, 100) mm from the right motor: fitted; only there x and z couple",
    "Loop lag of 6 samples: fitted; the paper states none",
    "Elastic band 200 N/m, 3 N and 80 mm long at the surface, 0.02 N·s/m: guessed",
    "Release from rest 4 mm above the surface, at 24 phases of the texture: guessed",
)
GUESSED_HANDS = (
    "The hand of section V.B, 300 N/m and 3 N·s/m, 50 g, pressing with 1 N: guessed",
    "Two more hands, softer and stiffer, and three speeds, to show their influence",
)
GUESSED_BUMP = (
    "Hands, entry height and speeds of section V.C: guessed; the paper's subject moved freely",
)
GUESSED_DEVICES = (
    "The hand: 300 N/m sideways, 3 N·s/m, pressing with 1 N. Most of these devices have no other "
    "damping: none of their physical damping is published",
    "Where the update rate is not known, 1 kHz; where the delay is not known, none",
)


def band_setup(
    law: str = "A", stiffness: float = PASSIVITY.stiffness, delay: int = FITTED_DELAY
) -> Setup:
    """Return the loop of section V.A: an elastic band pulls the handle into the wall."""
    plant = Pantograph(joint_damping=PASSIVITY.joint_damping, centre=(0.0375, 0.1))
    surface = PASSIVITY.surface(law, stiffness=stiffness)
    motion = Stationary((0.0, 0.0, 0.0))
    start = (0.0, 0.0, 4e-3)
    return _setup(surface, plant, BandHand(), motion, 0.5, delay=delay, start=start)


HANDS = {
    "300 N/m": SpringHand((300.0, 300.0, 0.0), 3.0, 0.05, (0.0, 0.0, -1.0)),
    "100 N/m": SpringHand((100.0, 100.0, 0.0), 2.0, 0.03, (0.0, 0.0, -1.0)),
    "800 N/m": SpringHand((800.0, 800.0, 0.0), 6.0, 0.10, (0.0, 0.0, -1.0)),
}
SPEEDS = (0.05, 0.1, 0.15)  # m/s


def stroke_setup(law: str = "A", hand: str = "300 N/m", speed: float = 0.1) -> Setup:
    """Return the loop of section V.B: strokes of 80 mm along the wall, forth and back."""
    motion = Strokes((-0.04, 0.0, -1e-3), (0.04, 0.0, -1e-3), speed, count=5)
    plant = Pantograph(joint_damping=SCANNING.joint_damping)
    return _setup(SCANNING.surface(law), plant, HANDS[hand], motion, motion.duration)


ENTRIES = {
    "mid-height": (SpringHand((300.0, 300.0, 100.0), 3.0, 0.05), 5e-3, 0.05, 2e-3),
    "fast": (SpringHand((500.0, 500.0, 50.0), 3.0, 0.05), -0.04, 0.15, 0.0),
}
"""Hand, height of its anchor [m], speed [m/s] and initial height of the handle [m]."""


def bump_setup(law: str = "A", entry: str = "mid-height") -> Setup:
    """Return the loop of section V.C: one stroke over a bump of 20 mm and back."""
    hand, height, speed, start = ENTRIES[entry]
    motion = Strokes((-0.01, 0.0, height), (0.01, 0.0, height), speed, count=2)
    plant = Pantograph(joint_damping=BUMP.joint_damping)
    surface = BUMP.surface(law, max_depth=0.02)
    return _setup(surface, plant, hand, motion, motion.duration, start=(-0.01, 0.0, start))


def device_setup(name: str, surface: Surface, hand: SpringHand) -> Setup:
    """Return the loop of a catalogue device that a hand presses onto a surface.

    Raises:
        ParameterError: if the device has no data that a simulation requires.
    """
    from asperity.scene.scene_defaults import make_servo

    device = load_device(name)
    plant, assumed = make_plant(device, centre=None)
    servo, servo_assumptions = make_servo(device)
    loop = surface, device, plant, hand, servo, Stationary((0.0, 0.0, 0.0)), 0.25
    return Setup(*loop, start=(0.0, 0.0, 1e-3), assumptions=(*assumed, *servo_assumptions))


def _setup(
    surface: Surface,
    plant: Pantograph,
    hand: Hand,
    motion: Motion,
    duration: float,
    *,
    delay: int = 0,
    start: tuple[float, float, float] | None = None,
) -> Setup:
    servo = Servo(SAMPLING_PERIOD, delay, RESOLUTION)
    loop = surface, load_device("pantograph"), plant, hand, servo, motion, duration
    return Setup(*loop, start=start, assumptions=plant.notes)


CYCLE_COUNT_STARTS = 24
STARTS = 8
DELAYS = (0, 1, 2, 3, 4, 5, 6)
FIGURE_5_PANELS = (("W", 1.0), ("A", 1.0), ("F", 1.0), ("A", 5.1), ("F", 8.3))
"""Law, and the divisor of its stiffness of 2000 N/m."""
ADDED_PANELS = (("H", 1.0),)
_STIFFNESS = 2000.0


@dataclass(frozen=True)
class CycleCount(Serializable):
    """Number of starts that end in a limit cycle.

    Attributes:
        law: letter.
        divisor: divisor of the stiffness of 2000 N/m.
        delay: loop delay [samples].
        starts: number of starts.
        cycles: number of starts that end in a steady cycle, see
            :mod:`asperity.simulation.onset`.
        slow: number of starts that still moved after 0.5 s and came to rest by 2 or 8 s.
        time: time of the first start's trace [s], shape (n,).
        x: position of the handle [m], shape (n,).
        z: position of the handle [m], shape (n,).
    """

    law: str
    divisor: float = field(metadata=OMITTED)
    delay: int
    starts: int
    cycles: int
    slow: int
    time: FloatArray = field(metadata=OMITTED)
    x: FloatArray = field(metadata=OMITTED)
    z: FloatArray = field(metadata=OMITTED)

    @property
    def wall(self) -> str:
        """The law, with the divisor of its stiffness if it is not 1."""
        return self.law if self.divisor == 1.0 else f"{self.law}/{self.divisor:g}"

    @property
    @written
    def stiffness(self) -> float:
        """Stiffness [N/m]."""
        return _STIFFNESS / self.divisor


@dataclass(frozen=True)
class PassivityExperiment(Serializable):
    """Section V.A.

    Attributes:
        counts: counts at the fitted delay in the order of figure 5, then law H.
        onsets: onsets of limit cycles by law and delay, and the criteria.
        fitted: assumptions that the paper does not state.
    """

    counts: tuple[CycleCount, ...]
    onsets: tuple[Prediction, ...]
    fitted: tuple[str, ...] = FITTED_ASSUMPTIONS


@lru_cache(maxsize=64)
def count_cycles(
    law: str, divisor: float, delay: int = FITTED_DELAY, starts: int = CYCLE_COUNT_STARTS
) -> CycleCount:
    """Count the starts that end in a limit cycle at 2000 N/m over a divisor."""
    setup = band_setup(law, _STIFFNESS / divisor, delay)
    servo = setup.servo.without_steps()
    duration = setup.duration
    loop = BatchSimulation(setup.surface, setup.plant, setup.hand, servo, setup.motion, setup.start)
    stiffness = setup.surface.stiffness
    shifts = start_offsets(setup.surface, starts)
    runs = run_starts(loop, stiffness, servo, shifts, duration)
    cycling = sum([bool(run.verdict) for run in runs])
    slow = sum([run.samples * servo.period > duration and not run.verdict for run in runs])
    samples = range(0, round(duration / servo.period), TRACE_STRIDE)
    first = loop.new_trajectory(stiffness, delay, shifts[0], _observe_at(samples[1:]))
    x, z = _observe_path(loop, first)
    time = np.array(samples) * servo.period
    return CycleCount(law, divisor, delay, starts, cycling, slow, time, x, z)


def _observe_path(loop: BatchSimulation, trajectory: Trajectory) -> FloatArray:
    """Run a trajectory to its end and return x and z [m] where it pauses, shape (2, n)."""
    path = [trajectory.state[[0, 2]].copy()]
    while trajectory.verdict is None:
        loop.run([trajectory])
        path.append(trajectory.state[[0, 2]].copy())
    return np.array(path).T


def _observe_at(sample_counts: Sequence[int]) -> StopRule:
    """Pause a run at the given sample counts until it stops, without a verdict."""
    for count in sample_counts:
        if (yield count).stop:
            break
    return False


@lru_cache(maxsize=64)
def passivity_onsets(laws: str, delays: tuple[int, ...], starts: int) -> tuple[Prediction, ...]:
    """Return the onsets of laws at delays, including W, and the limits by the criteria."""
    return sweep_onsets(
        band_setup("W"), laws, delays, n_phases=starts, tolerance=0.05, min_stiffness=50.0
    ).onsets


def passivity_experiment(
    laws: str = ALL_LAWS, delays: tuple[int, ...] = DELAYS, starts: int = STARTS
) -> PassivityExperiment:
    """Simulate section V.A: counts at the fitted delay, and onsets against delay.

    Args:
        laws: laws of the onsets.
        delays: delays of the onsets [samples].
        starts: starts of the onsets; the counts have 24.
    """
    counts = map_threads(count_cycles, (*FIGURE_5_PANELS, *ADDED_PANELS))
    return PassivityExperiment(counts, passivity_onsets(laws, delays, starts))


DEVICE_LAWS = "WACFH"
_STARTS = 4
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

    device: str
    surface: str
    catalogue_stiffness: float
    prediction: Prediction = field(metadata=OMITTED)

    @property
    @written
    def catalogue_rule(self) -> float:
        """K₀/q with the K₀ of the catalogue and the q of the depth reached [N/m]."""
        q = self.prediction.q
        return self.catalogue_stiffness / q if q > 0.0 else math.inf

    @property
    @written
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
            [
                wall.prediction.onset.cycling / wall.catalogue_stiffness
                for wall in self.onsets
                if wall.prediction.onset.is_smooth_wall
            ]
        )


def reference_textures(measured_texture: Texture | None = None) -> dict[str, Texture]:
    """Return a gentle sinusoid and a measured surface, or a synthetic one in its place."""
    sinusoid = Sinusoid(0.1e-3, 1e-3)
    if measured_texture is None:
        return {"sinusoid A/l = 0.1": sinusoid, "knurl": named_surface("knurl")}
    return {"sinusoid A/l = 0.1": sinusoid, "yours": measured_texture}


def usable_devices() -> tuple[list[str], list[str]]:
    """Return the devices with sufficient data, and those without a mass or K₀."""
    usable: list[str] = []
    skipped: list[str] = []
    for name in device_names():
        try:
            _wall_setup(name)
            is_usable = catalogue_stiffness(name) is not None
        except ParameterError:
            is_usable = False
        if is_usable:
            usable.append(name)
        else:
            skipped.append(name)
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
        starts=_STARTS,
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
