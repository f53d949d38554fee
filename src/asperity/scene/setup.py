"""From the sections [hand], [motion] and [run] of a scene to a closed loop that can be run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.analysis.words.surface import law_parameters
from asperity.arguments import read_arguments
from asperity.devices import Device, load_device
from asperity.devices.writing import device_text
from asperity.errors import ParameterError
from asperity.files import plain, record
from asperity.laws import Law, find_law, shared_out
from asperity.recording.replay import file_content
from asperity.scene.alone import ALONE_DURATION, hand_alone, with_mass
from asperity.scene.loading import Scene
from asperity.scene.plant import default_servo, plant_of
from asperity.scene.sections import DURATION, HANDS, MOTIONS, RUN, built, surface_keywords
from asperity.servo import safety
from asperity.servo.safety import Safety
from asperity.simulation import Hand, Motion, MovedHand, Plant, Run, Servo, simulate
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering

DEFAULT_DEVICE = "omega.3"
DEFAULT_DURATION = 1.0
SIMULATED = "simulated"
"""Name of the driver that moves plant and hand of a simulation."""


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
        files: that the scene was read from.
        safety: limits of the loop, where it runs on a device.
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
    files: tuple[Path, ...] = ()
    safety: Safety = safety.USUAL

    def simulate(
        self,
        trace: bool | str | Path = True,
        progress: Callable[[float], None] | None = None,
        most_rows: int | None = None,
    ) -> Run:
        """Run the loop; see :func:`~asperity.simulation.simulate`."""
        return simulate(
            self.surface, self.plant, self.hand, self.servo, self.motion, self.duration,
            start=self.start, velocity=self.velocity, trace=trace, every=self.every,
            most_rows=most_rows, progress=progress, about=self.about(),
        )  # fmt: skip

    def about(self, driver: str = "") -> dict[str, Any]:
        """Return what a recording says of the scene, besides its parts.

        Args:
            driver: by whose name a loop runs that keeps time; what a simulated one moves is said.
        """
        device = self.device
        simulated = {"plant": plain(self.plant), "hand": plain(self.hand)}
        return {
            "device": {"id": device.id, "name": device.name, "file": device_text(device)},
            **record(self, "duration", "start", "velocity", "assumptions"),
            "files": self.contents(),
            **({"driver": driver} if driver else {}),
            **(simulated if driver == SIMULATED else {}),
        }

    def contents(self) -> dict[str, str]:
        """Return a hash of each file as it is now, of those that can be read."""
        contents = {str(path): file_content(path) for path in self.files}
        return {name: content for name, content in contents.items() if content is not None}

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
            **record(self, without=("surface", "device", "files", "safety")),
        }


def make_setup(
    scene: Scene,
    *,
    surface: Mapping[str, Any] | None = None,
    device: Device | None = None,
    duration: float | None = None,
    laws: Sequence[Law] = (),
    keeps_delay: bool = True,
    alone: bool = False,
) -> Setup:
    """Return the closed loop of a scene.

    Args:
        scene: with the sections [hand] and [motion], and [run] if there is something to say.
        surface: arguments of :class:`~asperity.surface.Surface`, and parameters of laws, that come
            before the scene's.
        device: comes before the scene's; omega.3 if there is none.
        duration: of the run [s]; comes before the scene's.
        laws: those that the loop will be changed to, which have parameters too.
        keeps_delay: whether the device's delay counts; not where the loop gets another one.
        alone: whether a scene without hand and motion gets some, see :mod:`asperity.scene.alone`.

    Raises:
        ParameterError: for a section or a number that is missing, an unknown key (the nearest is
            offered), or a wrong value.
    """
    merged = {**scene.surface, **(surface or {})}
    run = read_arguments("run", scene.loop.get("run", {}), RUN)
    if alone and not {"hand", "motion"} & scene.loop.keys():
        return _alone(scene, merged, device, duration or run.get("duration"))
    for name in ("hand", "motion"):
        if name not in scene.loop:
            raise ParameterError("scene", f"needs a section [{name}] with a kind to be simulated")
    if "law" not in merged:
        raise ParameterError("law", "is missing: --law B, or a scene whose [surface] names one")
    hand = built("hand", scene.loop["hand"], HANDS, scene.folder)
    motion = built("motion", scene.loop["motion"], MOTIONS, scene.folder)
    guards = read_arguments("servo", scene.loop.get("servo", {}), safety.ARGUMENTS)
    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    needs_plant = not isinstance(hand, MovedHand)
    brakes, share = run.pop("brakes", None), run.pop("velocity_share", None)
    plant, assumed = plant_of(
        chosen, centre=run.pop("centre", None), resonance=run.pop("resonance", False),
        brakes=brakes, dynamics=needs_plant,
    )  # fmt: skip
    servo, said = default_servo(chosen, keeps_delay=keeps_delay)
    if share is not None:
        servo = replace(servo, velocity_share=share)
    span, of_span = _duration(duration, run.pop("duration", None), motion)
    whole = _surface(scene.texture, merged, laws)
    said += [] if laws else law_parameters(whole)
    for law in laws:
        parameters = law_parameters(whole.to_law(law))
        said += [f"{parameter} for law {law.letter}" for parameter in parameters]
    return Setup(
        whole, chosen, plant, hand, servo, motion, span,
        assumptions=(*assumed, *said, *of_span, *_leaving(scene.texture, motion, span)),
        files=scene.files, safety=Safety(**guards), **run,
    )  # fmt: skip


def _alone(
    scene: Scene, surface: Mapping[str, Any], device: Device | None, duration: float | None
) -> Setup:
    """Return the closed loop of a scene without hand and motion, which get usual ones."""
    chosen, assumed = with_mass(device or scene.device or load_device(DEFAULT_DEVICE))
    span = ALONE_DURATION if duration is None else duration
    hand, words = hand_alone(_surface(scene.texture, surface, ()), chosen, span)
    whole = replace(scene, loop={**scene.loop, **hand})
    setup = make_setup(whole, surface=surface, device=chosen, duration=span)
    return replace(setup, assumptions=(words, *assumed, *setup.assumptions))


def _surface(texture: Texture, values: Mapping[str, Any], laws: Sequence[Law]) -> Surface:
    """Return the surface of a loop, which hands the parameters of other laws on to them."""
    law = find_law(values["law"])
    together = [*laws, law]
    keywords = surface_keywords(values, *together)
    parameters = keywords.pop("law_parameters", {})
    surface = Surface(texture, **keywords)
    for one, own in zip(together, shared_out(parameters, together), strict=True):
        surface = surface.to_law(one, own)
    return surface


def _duration(given: float | None, own: float | None, motion: Motion) -> tuple[float, list[str]]:
    span = own if given is None else given
    if span is not None:
        return DURATION.checked(span), []
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
