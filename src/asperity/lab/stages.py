"""Stages to go back to: of takes, and the one before the guided tour."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from asperity.errors import ParameterError
from asperity.lab.stage import SURFACE, Stage, make_stage
from asperity.scene import load_scene

WISH = "stage"
"""Name of the wish for a stage as a whole; what is wished besides is changed of it."""
TOUR, BACK = "tour", "back"
"""The stage that the guided tour begins with, and the one that was there before it."""


class Stages:
    """Stages by name.

    Attributes:
        kept: those of takes.
    """

    def __init__(self) -> None:
        self.kept: dict[str, Stage] = {}
        self._before: Stage | None = None

    def changed(self, stage: Stage, wishes: Mapping[str, Any]) -> Stage:
        """Return the stage that is wished for; see :meth:`Stage.changed`.

        Args:
            stage: as it is.
            wishes: by name; ``stage`` is the name of another one.

        Raises:
            ParameterError: for a stage that there is not, and for what cannot be changed.
        """
        others = {name: value for name, value in wishes.items() if name != WISH}
        begun = self._named(stage, str(wishes[WISH])) if WISH in wishes else stage
        return begun.changed(others)

    def _named(self, stage: Stage, name: str) -> Stage:
        if name == TOUR:
            self._before = self._before or stage
            # Whatever there was: the tour knows its own stage, and no other.
            return make_stage(load_scene(SURFACE))
        if name == BACK:
            before, self._before = self._before, None
            return before or stage
        if name not in self.kept:
            raise ParameterError("stage", "is kept no more", name)
        return self.kept[name]
