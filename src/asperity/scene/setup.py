"""From the sections [hand], [motion] and [run] of a scene to a closed loop that can be run."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.checks import FloatArray, positive
from asperity.devices import Device, load_device
from asperity.errors import ParameterError, nearest_names
from asperity.files import plain, record
from asperity.laws import Law
from asperity.scene import readers
from asperity.scene.loading import Scene
from asperity.scene.plant import default_servo, plant_of
from asperity.scene.readers import Reader, read_arguments
from asperity.simulation import (
    BandHand,
    Hand,
    Motion,
    MovedHand,
    Plant,
    Run,
    Servo,
    SpringHand,
    Still,
    Strokes,
    simulate,
)
from asperity.simulation import (
    Path as PathMotion,
)
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering

DEFAULT_DEVICE = "omega.3"
DEFAULT_DURATION = 1.0

Kinds = dict[str, tuple[Callable[..., Any], dict[str, Reader]]]

HANDS: Kinds = {
    "spring": (
        SpringHand,
        {
            "stiffness": readers.axes("N/m"),
            "damping": readers.axes("N*s/m"),
            "mass": readers.in_unit("kg"),
            "force": readers.space("N"),
        },
    ),
    "band": (
        BandHand,
        {
            "stiffness": readers.in_unit("N/m"),
            "tension": readers.in_unit("N"),
            "length": readers.in_unit("m"),
            "damping": readers.in_unit("N*s/m"),
        },
    ),
    "moved": (MovedHand, {}),
}

MOTIONS: Kinds = {
    "still": (Still, {"point": readers.space("m")}),
    "strokes": (
        Strokes,
        {
            "start": readers.space("m"),
            "end": readers.space("m"),
            "speed": readers.in_unit("m/s"),
            "count": readers.whole,
        },
    ),
    "path": (PathMotion, {"file": readers.text}),
}

PATH_COLUMNS = ("time [s]", "x [m]", "y [m]", "z [m]")

RUN: dict[str, Reader] = {
    "duration": readers.in_unit("s"),
    "start": readers.space("m"),
    "velocity": readers.space("m/s"),
    "every": readers.whole,
    "velocity_share": readers.in_unit(""),
    "centre": readers.plane("m"),
    "resonance": readers.switch,
    "brakes": readers.text,
}


@dataclass(frozen=True)
class Setup:
    """A closed loop that is ready to run.

    Attributes:
        surface: texture, law and stiffness.
        device: whose numbers plant and servo are made of.
        plant: what moves.
        hand: what holds it.
        servo: what the electronics do.
        motion: of the hand's anchor.
        duration: of the run [s].
        start: of the handle [m], ``None`` for where the motion begins.
        velocity: of the handle at the start [m/s], ``None`` for rest.
        every: samples from one row of the trace to the next.
        assumptions: what was assumed, in sentences.
    """

    surface: Surface
    device: Device
    plant: Plant
    hand: Hand
    servo: Servo
    motion: Motion
    duration: float
    start: tuple[float, ...] | None = None
    velocity: tuple[float, ...] | None = None
    every: int = 1
    assumptions: tuple[str, ...] = ()

    def simulate(
        self, trace: bool | str | Path = True, progress: Callable[[float], None] | None = None
    ) -> Run:
        """Run the loop; see :func:`~asperity.simulation.simulate`."""
        return simulate(
            self.surface, self.plant, self.hand, self.servo, self.motion, self.duration,
            start=self.start, velocity=self.velocity, trace=trace, every=self.every,
            progress=progress,
        )  # fmt: skip

    def with_law(self, law: str | Law, stiffness: float | None = None) -> Setup:
        """Return the same loop with another law, and another stiffness [N/m] if one is given."""
        surface = self.surface.to_law(law)
        return replace(
            self, surface=surface if stiffness is None else surface.to_stiffness(stiffness)
        )

    def with_delay(self, delay: int) -> Setup:
        """Return the same loop with another delay [samples]."""
        return replace(self, servo=replace(self.servo, delay=delay))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        surface = self.surface
        return {
            "surface": {
                "texture": surface.texture.describe(),
                "law": surface.law.letter,
                **record(surface, "stiffness", "max_depth"),
                "parameters": plain(surface.law_parameters),
            },
            "device": self.device.id,
            **record(self, without=("surface", "device")),
        }


def make_setup(
    scene: Scene,
    *,
    surface: Mapping[str, Any] | None = None,
    device: Device | None = None,
    duration: float | None = None,
) -> Setup:
    """Return the closed loop of a scene.

    Args:
        scene: with the sections [hand] and [motion], and [run] if there is something to say.
        surface: arguments of :class:`~asperity.surface.Surface` that come before the scene's.
        device: comes before the scene's; omega.3 if there is none.
        duration: of the run [s]; comes before the scene's.

    Raises:
        ParameterError: for a section or a number that is missing, an unknown key (the nearest is
            offered), or a wrong value.
    """
    for name in ("hand", "motion"):
        if name not in scene.loop:
            raise ParameterError("scene", f"needs a section [{name}] with a kind to be simulated")
    merged = {**scene.surface, **(surface or {})}
    if "law" not in merged:
        raise ParameterError("law", "is missing: --law B, or a scene whose [surface] names one")
    hand = _made("hand", scene.loop["hand"], HANDS)
    motion = _made("motion", scene.loop["motion"], MOTIONS, scene.folder)
    run = read_arguments("run", scene.loop.get("run", {}), RUN)
    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    needs_plant = not isinstance(hand, MovedHand)
    brakes, share = run.pop("brakes", None), run.pop("velocity_share", None)
    plant, assumed = plant_of(
        chosen, centre=run.pop("centre", None), resonance=run.pop("resonance", False),
        brakes=brakes, dynamics=needs_plant,
    )  # fmt: skip
    servo, said = default_servo(chosen)
    if share is not None:
        servo = replace(servo, velocity_share=share)
    span, of_span = _duration(duration, run.pop("duration", None), motion)
    return Setup(
        Surface(scene.texture, **merged), chosen, plant, hand, servo, motion, span,
        assumptions=(*assumed, *said, *of_span, *_leaving(scene.texture, motion, span)), **run,
    )  # fmt: skip


def _duration(given: float | None, own: float | None, motion: Motion) -> tuple[float, list[str]]:
    span = own if given is None else given
    if span is not None:
        return positive("duration", span, "s"), []
    ends = getattr(motion, "duration", 0.0)
    if ends > 0.0:
        return float(ends), []
    return DEFAULT_DURATION, [f"Default duration {DEFAULT_DURATION:g} s"]


def _leaving(texture: Texture, motion: Motion, span: float) -> list[str]:
    """Return a warning if the hand's way leaves a surface that ends."""
    domain = texture.domain
    if not texture.ends:
        return []
    way = motion.at(np.linspace(0.0, span, 257))[:, :2] - domain.origin
    sides = np.hypot(*domain.spans.T)
    along = way @ (domain.spans / sides[:, None] ** 2).T
    if (along >= 0.0).all() and (along <= 1.0).all():
        return []
    size = " x ".join(engineering(float(side), "m") for side in sides)
    return [f"The hand's way leaves the surface, {size}: beyond it its mirror images are felt"]


def _made(section: str, given: Mapping[str, Any], kinds: Kinds, folder: Path | None = None) -> Any:
    """Return the hand or the motion of a section."""
    arguments = dict(given)
    kind = arguments.pop("kind", None)
    if not isinstance(kind, str):
        names = " | ".join(f'"{name}"' for name in kinds)
        raise ParameterError(section, f"needs kind = {names}", kind)
    if kind not in kinds:
        raise ParameterError(
            f"{section}.kind", f"is unknown: {kind!r}; {nearest_names(kind, kinds)}"
        )
    make, known = kinds[kind]
    values = read_arguments(section, arguments, known)
    if make is PathMotion:
        if "file" not in values:
            raise ParameterError("motion.file", "is missing: a path needs a file of positions")
        return read_path((folder or Path()) / values["file"])
    if section == "motion":
        for name in known:
            if name not in values and name != "count":
                raise ParameterError(f"motion.{name}", f"is missing: {kind} needs it")
    return make(**values)


def read_path(path: Path) -> PathMotion:
    """Return the motion that a file of positions describes.

    Args:
        path: text with a line of names, ``time [s]``, ``x [m]``, ``y [m]``, ``z [m]``, and others
            that are not read; commas between. The traces of ``asperity simulate`` are such files.

    Raises:
        ParameterError: for a file that cannot be read, lacks a column, has no rows or a wrong
            number.
    """
    try:
        with path.open(encoding="utf-8") as file:
            names = [name.strip() for name in file.readline().split(",")]
            columns = [
                _column(names, name, path) for name in ("time [s]", "x [m]", "y [m]", "z [m]")
            ]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of no rows: see below
                table = np.loadtxt(file, delimiter=",", usecols=columns, ndmin=2)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("motion.file", f"{path} cannot be read: {reason}") from None
    except ValueError as error:
        raise ParameterError("motion.file", f"{path} is not a table of numbers: {error}") from None
    if not len(table):
        raise ParameterError("motion.file", f"{path} has no rows")
    return PathMotion(table[:, 0], table[:, 1:])


def _column(names: list[str], name: str, path: Path) -> int:
    if name not in names:
        raise ParameterError("motion.file", f"{path} has no column '{name}' in its first line")
    return names.index(name)


def working_point(setup: Setup) -> FloatArray:
    """Return where the handle starts [m], shape (3,)."""
    if setup.start is not None:
        return np.array(setup.start, dtype=float)
    return np.asarray(setup.motion.at(np.zeros(1))[0])
