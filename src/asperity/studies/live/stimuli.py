"""Stimuli of a study: built and analysed before the participant feels them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from asperity.clamps import BACKED
from asperity.core.errors import AsperityError, ParameterError
from asperity.scene.device_run import without_hand
from asperity.scene.scene_file import build_scene
from asperity.scene.scene_keys import with_values
from asperity.scene.sections import to_scene_values
from asperity.scene.setup import Setup, make_setup
from asperity.servo.safety import excess_stiffness_reason
from asperity.studies.study_file import Study
from asperity.surface import Surface

LEVEL_COUNT = 9
"""Number of levels in the range of a level that are analysed before the first trial."""
_REST_LAW = "W"  # the smooth wall
_REST_DEPTH = 0.1  # [m]: its gain is the same at every depth, so that no press is too deep
_STROKE_DURATION = 600.0  # [s], after which a simulated hand rests
# A simulated device is harmless: late samples and deep presses do not end its loop.
_RELAXED = {"lateness": "60 s", "silence": "10 s", "beyond_depth": "warn"}


class Stimuli:
    """The stimuli of a study on a device.

    The limit of a stimulus is the stiffness that ``asperity compare`` recommends for its law,
    surface and device: the stability limit with its margin.

    Args:
        study: the study.
        is_real: whether a real device renders them, which has its own delay and resolution.
    """

    def __init__(self, study: Study, *, is_real: bool = False) -> None:
        self._study, self._is_real = study, is_real
        self._checked: dict[str, Setup] = {}

    def check_all(self, progress: Callable[[float], None] = lambda _share: None) -> Setup:
        """Check all stimuli, over the whole range of the level, and return the first one's loop.

        Args:
            progress: called with the fraction done.

        Raises:
            ParameterError: for the first stimulus that cannot be rendered or is above its limit.
        """
        design = self._study.design
        levels: list[dict[str, float]] = [{}]
        if key := design.options.get("level"):
            low, high = design.options["range"]
            named = {low, high, design.options.get("reference", low)}
            inner = np.geomspace(min(named), max(named), LEVEL_COUNT).tolist()
            levels = [{key: one} for one in sorted({*inner, *named})]
        stimuli = [{**condition, **one} for condition in design.conditions for one in levels]
        for count, values in enumerate(stimuli, start=1):
            self.setup(values)
            progress(count / len(stimuli))
        return self.setup(stimuli[0])

    def setup(self, values: Mapping[str, Any]) -> Setup:
        """Return the loop of a stimulus that is within its limit.

        Args:
            values: of the varied keys [SI].

        Raises:
            ParameterError: if it cannot be rendered, or is above its limit.
        """
        key, known = str(sorted(values.items())), self._study.arguments
        if key not in self._checked:
            texts = (f"{name} = {known[name].format_value(one)}" for name, one in values.items())
            stimulus = ", ".join(texts) or "the stimulus"
            try:
                setup = self._make_setup(values)
                reason = _excess_reason(setup.rendered, setup)
            except AsperityError as error:
                raise ParameterError("vary", f"{stimulus} cannot be rendered: {error}") from None
            if reason:
                raise ParameterError("vary", f"{stimulus} is refused: {reason}")
            self._checked[key] = setup
        return self._checked[key]

    def _make_setup(self, values: Mapping[str, Any]) -> Setup:
        study = self._study
        texts = to_scene_values(values, study.arguments.values())
        scene = build_scene(with_values(study.sections, texts), study.folder)
        if "law" not in scene.surface:
            raise ParameterError("law", "is missing: in [surface] or in [vary]")
        scene = replace(scene, surface={"clamp": BACKED.name, **scene.surface})
        if self._is_real:
            return make_setup(without_hand(scene)).on_real_device()
        servo = {"servo": {**_RELAXED, **scene.loop.get("servo", {})}}
        loop = replace(scene, loop={**scene.loop, **servo})
        return make_setup(loop, duration=_STROKE_DURATION, use_defaults=True)


def smooth_wall(setup: Setup) -> Surface:
    """Return the smooth wall that is rendered between stimuli, as stiff as one of them.

    Raises:
        ParameterError: if it is above its limit.
    """
    wall = setup.surface.to_law(_REST_LAW).to_depth(_REST_DEPTH)
    if reason := _excess_reason(wall, setup):
        raise ParameterError("vary", f"the smooth wall between stimuli is refused: {reason}")
    return wall


def _excess_reason(surface: Surface, setup: Setup) -> str:
    return excess_stiffness_reason(surface, setup.device, keeps_margin=True)
