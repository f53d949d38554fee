"""What a sweep computes for each case: a comparison, limits, onsets or strokes."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from asperity.analysis.check_limits import limits
from asperity.analysis.compare import DEFAULT_DEVICE, compare
from asperity.core.checks import check_keywords
from asperity.core.display import Tabular
from asperity.core.errors import ParameterError, suggest_names
from asperity.laws import REGISTERED_LAWS, find_laws
from asperity.scene.loops import onset, scan
from asperity.scene.scene_file import Scene
from asperity.scene.sections import surface_keywords

Laws = tuple[str, ...] | None
_SCENE_ARGUMENTS = {"scene", "texture", "device", "laws", "law", "progress", "law_parameters"}


@dataclass(frozen=True)
class RunKind:
    """A computation on a scene.

    Attributes:
        name: as on the command line.
        function: public function whose keywords are the options of the run.
        compute: returns its result from a scene, the laws and the options.
        index: columns that distinguish the rows of one case.
        shown: columns of numbers that a report draws.
        takes_laws: whether it computes several laws.
    """

    name: str
    function: Callable[..., Any]
    compute: Callable[[Scene, Laws, Mapping[str, Any]], Tabular]
    index: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    takes_laws: bool = True

    def check_options(self, options: Mapping[str, Any], laws: Laws) -> None:
        """Check the options and the laws of a sweep.

        Raises:
            ParameterError: for an unknown one, with the nearest.
        """
        parameters = inspect.signature(self.function).parameters.values()
        names = {one.name for one in parameters if one.kind is not one.VAR_KEYWORD}
        check_keywords(options, names - _SCENE_ARGUMENTS, self.check_options)
        if laws is not None and not self.takes_laws:
            words = f"do not apply to {self.name}, which takes one: --vary surface.law=A,B"
            raise ParameterError("laws", words)


def _compare(scene: Scene, laws: Laws, options: Mapping[str, Any]) -> Tabular:
    found = tuple(REGISTERED_LAWS.values()) if laws is None else find_laws(laws)
    arguments = surface_keywords(scene.surface, *found)
    arguments.pop("law", None)
    return compare(scene.texture, scene.device or DEFAULT_DEVICE, found, **{**arguments, **options})


def _limits(scene: Scene, _laws: Laws, options: Mapping[str, Any]) -> Tabular:
    laws = find_laws([scene.surface["law"]]) if "law" in scene.surface else ()
    arguments = surface_keywords(scene.surface, *(laws or REGISTERED_LAWS.values()))
    return limits(scene.texture, scene.device or DEFAULT_DEVICE, **{**arguments, **options})


def _onset(scene: Scene, laws: Laws, options: Mapping[str, Any]) -> Tabular:
    return onset(scene, laws, **options)


def _scan(scene: Scene, laws: Laws, options: Mapping[str, Any]) -> Tabular:
    return scan(scene, laws, **options)


_FORCE = "resolved force RMS [N]"
RUN_KINDS = {
    kind.name: kind
    for kind in (
        RunKind("compare", compare, _compare, ("law",), ("recommended stiffness [N/m]", _FORCE)),
        RunKind("limits", limits, _limits, (), ("top speed [m/s]", _FORCE), takes_laws=False),
        RunKind("onset", onset, _onset, ("law", "delay [samples]"), ("cycling [N/m]",)),
        RunKind("scan", scan, _scan, ("law", "speed [m/s]", "depth [m]"),
                ("energy of the field [J]",)),
    )
}  # fmt: skip
"""Runs by name; a plugin may add one."""


def find_run(name: str) -> RunKind:
    """Return the run of a name.

    Raises:
        ParameterError: for an unknown one, with the nearest.
    """
    if name not in RUN_KINDS:
        raise ParameterError("run", f"is unknown: {name!r}; {suggest_names(name, RUN_KINDS)}")
    return RUN_KINDS[name]
