"""Stimuli of a study: built and analysed before the participant feels them."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.analysis.compare import DEFAULT_DEVICE
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.verdict import recommend_stiffness
from asperity.clamps import BACKED
from asperity.core.arguments import STIFFNESS
from asperity.core.errors import AsperityError, ParameterError
from asperity.core.files import to_plain_data
from asperity.core.units import format_quantity
from asperity.devices import Device, load_device
from asperity.scene.scene_defaults import default_hand_sections, with_assumed_mass
from asperity.scene.scene_file import Scene, build_scene
from asperity.scene.sections import to_scene_values
from asperity.scene.setup import Setup, make_setup
from asperity.servo.safety import Safety
from asperity.studies.study_file import Study
from asperity.surface import Surface

LEVEL_COUNT = 9
"""Number of levels in the range of a level that are analysed before the first trial."""
_STIFFNESS_KEY = f"surface.{STIFFNESS.name}"
_LEVEL_OPTIONS = ("range", "reference", "standard", "start")
_NO_MOTION = {"kind": "still", "point": [0, 0, 0]}
_HAND = {"kind": "spring", "stiffness": "500 N/m", "damping": "5 N*s/m", "mass": "50 g"}
_REST_LAW = "W"  # the smooth wall
_REST_DEPTH = 0.1  # [m]: its gain is the same at every depth, so that no press is too deep
# A simulated device is harmless: late samples do not end its loop.
_RELAXED = {"lateness": 60.0, "silence": 10.0}


def excess_reason(surface: Surface, device: Device) -> str:
    """Return why a participant may not feel a surface; empty within the recommended stiffness.

    The limit is the stiffness that ``asperity compare`` recommends for law, surface and device: the
    stability limit with its margin.
    """
    q, one_sided = characteristic_number(surface), one_sided_number(surface)
    limit = recommend_stiffness(surface, device, q, one_sided).stiffness
    if surface.stiffness <= limit:
        return ""
    context = f"for law {surface.law.letter} on {device.id}"
    if not limit:
        return f"no stable stiffness is known {context}: asperity analyze says what is missing"
    texts = (format_quantity(one, "N/m") for one in (surface.stiffness, limit))
    return "{} is above the {} that asperity compare recommends ".format(*texts) + context


@dataclass(frozen=True)
class StrokeMotion:
    """Motion of a simulated hand to and fro: the points centre + half cos(angle).

    Attributes:
        centre: of the stroke [m].
        half: from the centre to an end [m].
        angular_velocity: of the angle [rad/s].
    """

    centre: tuple[float, ...]
    half: tuple[float, ...]
    angular_velocity: float


class Stimuli:
    """The stimuli of a study on a device.

    Args:
        study: the study.
        is_real: whether a real device renders them, which has its own delay and resolution.
        device: overrides the scene's.

    Attributes:
        device: on which they are analysed.
    """

    def __init__(
        self, study: Study, *, is_real: bool = False, device: Device | None = None
    ) -> None:
        self._study, self._is_real, self._given_device = study, is_real, device
        self._checked: dict[str, Setup] = {}
        scene = self._build({key: values[0] for key, values in study.design.factors.items()})
        self.device = device or scene.device or load_device(DEFAULT_DEVICE)

    def _build(self, values: Mapping[str, Any]) -> Scene:
        """Return the scene with values of its varied keys [SI]."""
        study = self._study
        sections = {name: dict(section) for name, section in study.sections.items()}
        for key, value in to_scene_values(values, study.arguments.values()).items():
            section, _, name = key.partition(".")
            sections.setdefault(section, {})[name] = value
        return build_scene(sections, study.folder)

    def check_all(self, progress: Callable[[float], None] = lambda _share: None) -> dict[str, Any]:
        """Check all stimuli, over the whole range of the level, and return the first one's values.

        Raises:
            ParameterError: for the first stimulus that cannot be rendered or is above its limit.
        """
        combinations = list(self._combinations())
        for count, values in enumerate(combinations, start=1):
            self.setup(values)
            progress(count / len(combinations))
        return combinations[0]

    def _combinations(self) -> Iterator[dict[str, Any]]:
        design = self._study.design
        factors = dict(design.factors)
        level = design.options.get("level")
        if isinstance(level, str):
            factors[level] = tuple(self._level_values())
        for values in itertools.product(*factors.values()):
            yield dict(zip(factors, values, strict=True))

    def _level_values(self) -> Iterator[float]:
        """Yield levels of the range with its ends, and those that the method names."""
        options = self._study.design.options
        named = [np.atleast_1d(options[name]) for name in _LEVEL_OPTIONS if name in options]
        given = np.concatenate([*named, []])
        low, high = float(given.min()), float(given.max())
        space = np.geomspace if low > 0.0 else np.linspace
        yield from sorted({*space(low, high, LEVEL_COUNT).tolist(), *given.tolist()})

    def setup(self, values: Mapping[str, Any]) -> Setup:
        """Return the loop of a stimulus that is within its limit.

        Args:
            values: of the varied keys [SI].

        Raises:
            ParameterError: if it cannot be rendered, or is above its limit.
        """
        key, name = json.dumps(to_plain_data(values), sort_keys=True), self.describe(values)
        if key not in self._checked:
            try:
                setup = self._make_setup(values)
                reason = excess_reason(setup.rendered, self.device)
            except AsperityError as error:
                raise ParameterError("vary", f"{name} cannot be rendered: {error}") from None
            if reason:
                raise ParameterError("vary", f"{name} is refused: {reason}")
            self._checked[key] = setup
        return self._checked[key]

    def describe(self, values: Mapping[str, Any]) -> str:
        """Return a stimulus in words, for messages before the first trial."""
        known = self._study.arguments
        texts = (f"{key} = {known[key].format_value(value)}" for key, value in values.items())
        return ", ".join(texts) or "the stimulus"

    def _make_setup(self, values: Mapping[str, Any]) -> Setup:
        scene = self._build(values)
        for name in ("law", STIFFNESS.name):
            if name not in scene.surface:
                raise ParameterError(name, "is missing: in [surface] or in [vary]")
        surface = {"clamp": BACKED.name, **scene.surface}
        device = self.device if self._is_real else with_assumed_mass(self.device)[0]
        hand = {"kind": "moved"} if self._is_real else scene.loop.get("hand", _HAND)
        limits = {name: part for name, part in scene.loop.items() if name == "servo"}
        loop = {**limits, "hand": hand, "motion": _NO_MOTION, "run": {"duration": "1 s"}}
        setup = make_setup(replace(scene, loop=loop), surface=surface, device=device)
        if self._is_real:  # it has its own quantisation and delay
            servo = replace(setup.servo, delay=0, position_resolution=0.0, force_resolution=0.0)
            return replace(setup, servo=servo)
        return replace(setup, safety=Safety(**{**vars(setup.safety), **_RELAXED}))

    def rest(self, setup: Setup) -> Surface:
        """Return the smooth wall that is rendered between stimuli, as stiff as one of them.

        Raises:
            ParameterError: if it is above its limit.
        """
        wall = setup.surface.to_law(_REST_LAW).to_depth(_REST_DEPTH)
        if reason := excess_reason(wall, self.device):
            raise ParameterError("vary", f"the smooth wall between stimuli is refused: {reason}")
        return wall

    def stroke(self, setup: Setup) -> StrokeMotion:
        """Return the motion of a simulated hand on a stimulus."""
        sections, _ = default_hand_sections(setup.surface, setup.device, 1.0)
        motion = sections["motion"]
        start, end = (
            np.array([float(str(part).split()[0]) for part in motion[name]])
            for name in ("start", "end")
        )
        half = 0.5 * (end - start)
        speed = float(str(motion["speed"]).split()[0])
        rate = speed / max(float(np.hypot(*half[:2])), 1e-6)
        return StrokeMotion(tuple(0.5 * (start + end)), tuple(half), rate)
