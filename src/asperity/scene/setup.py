"""Build the closed loop of a scene from its sections [hand], [motion] and [run]."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from asperity.analysis.passivity.recommended_stiffness import render_on_device
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.arguments import FIELD, parse_arguments
from asperity.core.display import describe
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, attributes_to_dict, to_plain_data
from asperity.core.processes import report_fraction
from asperity.core.units import format_quantity
from asperity.devices import Device, load_device
from asperity.devices.device_file import to_device_toml
from asperity.laws import Law, distribute_parameters, find_law
from asperity.recording.replay import file_digest
from asperity.rendering import assess_rendering, rendering_sentences
from asperity.scene import scene_defaults
from asperity.scene.loop_sections import DURATION, HANDS, MOTIONS, RUN_ARGUMENTS, build_section
from asperity.scene.scene_file import Scene, surface_keywords
from asperity.servo import safety
from asperity.servo.safety import Safety
from asperity.simulation import Hand, Motion, Plant, Run, Servo, simulate
from asperity.surface import Surface
from asperity.textures.texture import Texture

DEFAULT_DURATION = 1.0
SIMULATED_DRIVER = "simulated"
"""Name of the driver that simulates plant and hand."""


@dataclass(frozen=True)
class Setup:
    """A closed loop that is ready to run.

    Attributes:
        surface: texture, law and stiffness.
        device: source of the numbers of plant and servo.
        plant: mechanics of the device.
        hand: model of the hand.
        servo: sampling, delay, resolution and limits of the controller.
        motion: motion of the hand's anchor.
        duration: length of the run [s].
        start: position of the handle [m], ``None`` for the start of the motion.
        velocity: velocity of the handle at the start [m/s], ``None`` for rest.
        every: samples from one row of the trace to the next.
        assumptions: the assumptions, in sentences.
        files: the files of the scene.
        safety: limits of the loop on a device.
        rendering: how law H is rendered.
        scene_text: text of the scene, which a recording stores.
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
    safety: Safety = safety.DEFAULT_SAFETY
    rendering: str = FIELD
    scene_text: str = field(default="", metadata=OMITTED)

    @cached_property
    def rendered(self) -> Surface:
        """The surface as the loop renders it; see :mod:`asperity.rendering`."""
        return render_on_device(self.surface, self.device, self.rendering)

    def simulate(
        self,
        trace: bool | str | Path = True,
        progress: Callable[[float], None] | None = None,
        max_rows: int | None = None,
    ) -> Run:
        """Run the loop; see :func:`~asperity.simulation.simulate`."""
        return simulate(
            self.rendered,
            self.plant,
            self.hand,
            self.servo,
            self.motion,
            self.duration,
            start=self.start,
            velocity=self.velocity,
            trace=trace,
            every=self.every,
            max_rows=max_rows,
            progress=progress,
            metadata=self.recording_metadata(),
        )

    def recording_metadata(self, driver: str = "") -> dict[str, Any]:
        """Return the metadata of a recording of this loop.

        Args:
            driver: name of the driver in real time; the simulated one adds plant, hand and motion.
        """
        device = self.device
        metadata = attributes_to_dict(self, "duration", "start", "velocity", "assumptions")
        metadata["device"] = attributes_to_dict(device, "id", "name")
        metadata["device"]["file"] = to_device_toml(device)
        metadata["files"] = self.file_hashes()
        metadata["scene"] = self.scene_text
        if driver:
            metadata["driver"] = driver
        if driver == SIMULATED_DRIVER:
            metadata |= attributes_to_dict(self, "plant", "hand", "motion")
        return metadata

    def file_hashes(self) -> dict[str, str]:
        """Return the current hash of each readable file."""
        contents = {str(path): file_digest(path) for path in self.files}
        return {name: content for name, content in contents.items() if content is not None}

    def with_rendering(
        self, notes: Iterable[str] = (), progress: Callable[[float], None] = report_fraction
    ) -> Setup:
        """Return the same loop with its field baked, and notes about it among its assumptions."""
        rendered = render_on_device(self.surface, self.device, self.rendering, progress=progress)
        searched = assess_rendering(rendered, update_rate=1.0 / self.servo.period)
        notes = (*notes, *rendering_sentences(rendered), searched.sentence(rendered.law))
        result = replace(self, assumptions=(*filter(None, notes), *self.assumptions))
        vars(result)["rendered"] = rendered  # also where nothing is kept in the cache
        return result

    def with_law(self, law: str | Law) -> Setup:
        """Return the same loop with another law."""
        return replace(self, surface=self.surface.to_law(law))

    def with_delay(self, delay: int) -> Setup:
        """Return the same loop with another delay [samples]."""
        return replace(self, servo=replace(self.servo, delay=delay))

    def on_real_device(self) -> Setup:
        """Return the same loop without steps, which a real device has of its own.

        The delay stays: the loop adds none, and counts the work of forces when they act.
        """
        return replace(self, servo=self.servo.without_steps())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        surface = attributes_to_dict(self.surface, "stiffness", "max_depth")
        surface |= {"texture": self.surface.texture.describe(), "law": self.surface.law.letter}
        surface["parameters"] = to_plain_data(self.surface.law_parameters)
        surface["friction"] = to_plain_data(self.surface.contact_friction)
        rest = attributes_to_dict(self, exclude=("surface", "device", "files", "safety"))
        return {"surface": surface, "device": self.device.id, **rest}


def make_setup(
    scene: Scene,
    *,
    surface: Mapping[str, Any] | None = None,
    device: Device | None = None,
    duration: float | None = None,
    laws: Sequence[Law] = (),
    uses_delay: bool = True,
    use_defaults: bool = False,
) -> Setup:
    """Return the closed loop of a scene.

    Args:
        scene: the scene, with the sections [hand] and [motion].
        surface: arguments of :class:`~asperity.surface.Surface` and parameters of laws, which
            override the scene's.
        device: overrides the scene's; omega.3 if there is none.
        duration: length of the run [s]; overrides the scene's.
        laws: other laws that the loop will be used with, whose parameters are accepted.
        uses_delay: whether the device's delay is used.
        use_defaults: whether a scene without hand and motion gets the default ones, see
            :mod:`asperity.scene.scene_defaults`.

    Raises:
        ParameterError: a section or a number is missing, a key is unknown (the message suggests the
            nearest), or a value is wrong.
    """
    merged = {**scene.surface, **(surface or {})}
    run = parse_arguments("run", scene.loop.get("run", {}), RUN_ARGUMENTS)
    if "law" not in merged:
        raise ParameterError("law", "is missing: give {law}, or name one in [surface]", law="B")
    if use_defaults and not {"hand", "motion"} & scene.loop.keys():
        return _make_default_setup(scene, merged, device, duration or run.get("duration"))
    _require_sections(scene)
    hand = build_section("hand", scene.loop["hand"], HANDS, scene.folder)
    motion = build_section("motion", scene.loop["motion"], MOTIONS, scene.folder)
    limits = parse_arguments("servo", scene.loop.get("servo", {}), safety.ARGUMENTS)
    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    needs_plant = not hand.is_prescribed
    brakes = run.pop("brakes", None)
    share = run.pop("velocity_share", None)
    plant, assumed = scene_defaults.make_plant(
        chosen,
        centre=run.pop("centre", None),
        has_resonance=run.pop("resonance", False),
        brakes=brakes,
        needs_dynamics=needs_plant,
    )
    servo, notes = scene_defaults.make_servo(chosen, uses_delay=uses_delay)
    guards = Safety(**limits)
    safety.check_passivity_damping(guards, chosen, servo)
    rendering = merged.pop("rendering", FIELD)
    if share is not None:
        servo = replace(servo, velocity_share=share)
    span, default = _resolve_duration(duration, run.pop("duration", None), motion)
    whole = _make_surface(scene.texture, merged, laws)
    notes += _parameter_notes(whole, laws)
    return Setup(
        whole,
        chosen,
        plant,
        hand,
        servo,
        motion,
        span,
        assumptions=(*assumed, *notes, *default, *_leaving_warnings(scene.texture, motion, span)),
        files=scene.files,
        safety=guards,
        rendering=rendering,
        scene_text=scene.text,
        **run,
    )


def _require_sections(scene: Scene) -> None:
    """Check that a scene has a hand and a motion.

    Raises:
        ParameterError: if one is missing.
    """
    for name in ("hand", "motion"):
        if name not in scene.loop:
            raise ParameterError("scene", f"needs a section [{name}] with a kind to be simulated")


def _parameter_notes(surface: Surface, laws: Sequence[Law]) -> list[str]:
    """Return the notes of the parameters of a surface's law, or of several laws on it."""
    if not laws:
        return [*describe(surface, "law_parameters")]
    notes = []
    for law in laws:
        parameters = describe(surface.to_law(law), "law_parameters")
        notes += [f"{parameter} for law {law.letter}" for parameter in parameters]
    return notes


def _make_default_setup(
    scene: Scene, surface: Mapping[str, Any], device: Device | None, duration: float | None
) -> Setup:
    """Return the closed loop of a scene with the default hand and motion."""
    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    chosen, assumed = scene_defaults.with_assumed_mass(chosen)
    span = duration or scene_defaults.DEFAULT_STROKE_DURATION
    built = _make_surface(scene.texture, surface, ())
    hand, hand_note = scene_defaults.default_hand_sections(built, chosen, span)
    whole = replace(scene, loop={**scene.loop, **hand})
    setup = make_setup(whole, surface=surface, device=chosen, duration=span)
    return replace(setup, assumptions=(hand_note, *assumed, *setup.assumptions))


def _make_surface(texture: Texture, values: Mapping[str, Any], laws: Sequence[Law]) -> Surface:
    """Return the surface of a loop, with the parameters of all its laws."""
    all_laws = [*laws, find_law(values["law"])]
    keywords = surface_keywords(values, *all_laws)
    keywords.pop("rendering", None)
    parameters = keywords.pop("law_parameters", {})
    surface = Surface(texture, **keywords)
    distributed = distribute_parameters(parameters, all_laws)
    for law, law_parameters in zip(all_laws, distributed, strict=True):
        surface = surface.to_law(law, law_parameters)
    return surface


def _resolve_duration(
    argument: float | None, from_scene: float | None, motion: Motion
) -> tuple[float, list[str]]:
    for duration in (argument, from_scene):
        if duration is not None:
            return DURATION.validate(duration), []
    ends = getattr(motion, "duration", 0.0)
    if ends > 0.0:
        return float(ends), []
    return DEFAULT_DURATION, [f"Default duration {DEFAULT_DURATION:g} s"]


def _leaving_warnings(texture: Texture, motion: Motion, duration: float) -> list[str]:
    """Return a warning if the path of the hand leaves a finite surface."""
    domain = texture.domain
    if not texture.is_mirrored:
        return []
    path = motion.at(np.linspace(0.0, duration, 257))[:, :2] - domain.origin
    sides = np.hypot(*domain.spans.T)
    along = path @ (domain.spans / sides[:, None] ** 2).T
    if (along >= 0.0).all() and (along <= 1.0).all():
        return []
    size = " x ".join(format_quantity(float(side), "m") for side in sides)
    return [f"The hand's path leaves the surface, {size}: beyond it, its mirror images are felt"]
