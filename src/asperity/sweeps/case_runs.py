"""What a sweep computes for a case: a comparison, limits, onsets, strokes or a field.

It is computed in any process; fields stay in the cache of its machine.
"""

from __future__ import annotations

import inspect
import json
import pickle
import random
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from asperity.analysis.passivity.recommended_stiffness import render_on_device
from asperity.analysis.results.check_limits import limits
from asperity.analysis.results.compare import DEFAULT_DEVICE, compare
from asperity.core.arguments import FIELD
from asperity.core.checks import check_keywords
from asperity.core.display import Tabular
from asperity.core.errors import AsperityError, ParameterError, find_named
from asperity.core.files import content_digest, package_digest, to_plain_data
from asperity.devices import load_device
from asperity.laws import REGISTERED_LAWS, find_law, find_laws
from asperity.rendering import is_searched
from asperity.scene.loops import onset, scan
from asperity.scene.scene_file import Scene, build_scene, surface_keywords
from asperity.scene.scene_keys import with_values
from asperity.surface import Surface

LAW_KEY = "surface.law"
Case = tuple[int, Mapping[str, Any]]
"""Number of a case, and the values of its keys as written in a scene."""
Laws = tuple[str, ...] | None
_SCENE_ARGUMENTS = {
    *("scene", "texture", "surface", "device", "laws", "law", "law_parameters", "rendering"),
    "progress",
}


@dataclass(frozen=True)
class RunKind:
    """A computation on a scene.

    Attributes:
        name: as on the command line.
        function: public function whose keywords are the options of the run.
        compute: returns its result from a scene, the laws, the options and the seed of the case.
        index: columns that distinguish the rows of one case.
        shown: columns of numbers that a report draws.
        takes_laws: whether it computes several laws.
    """

    name: str
    function: Callable[..., Any]
    compute: Callable[[Scene, Laws, Mapping[str, Any], int], Tabular]
    index: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    takes_laws: bool = True

    def check_options(self, options: Mapping[str, Any], laws: Laws) -> None:
        """Check the options and the laws of a sweep.

        Raises:
            ParameterError: for an unknown option, with the nearest, or laws that do not apply.
        """
        names = inspect.signature(self.function).parameters.keys()
        check_keywords(options, names - _SCENE_ARGUMENTS, lambda: None)
        if laws is not None and not self.takes_laws:
            raise ParameterError(
                "laws",
                f"do not apply to {self.name}, which takes one: {{vary}} gives several",
                vary=f"{LAW_KEY}=A,B",
            )


def _compare(scene: Scene, laws: Laws, options: Mapping[str, Any], _seed: int) -> Tabular:
    compared = find_laws(laws or tuple(REGISTERED_LAWS))
    arguments = {**surface_keywords(scene.surface, *compared), **options}
    arguments.pop("law", None)
    return compare(scene.texture, scene.device or DEFAULT_DEVICE, compared, **arguments)


def _limits(scene: Scene, _laws: Laws, options: Mapping[str, Any], _seed: int) -> Tabular:
    laws = [scene.surface["law"]] if "law" in scene.surface else tuple(REGISTERED_LAWS)
    arguments = surface_keywords(scene.surface, *find_laws(laws))
    return limits(scene.texture, scene.device or DEFAULT_DEVICE, **{**arguments, **options})


def _bake(scene: Scene, _laws: Laws, options: Mapping[str, Any], _seed: int) -> Tabular:
    values = {**scene.surface, "law": "H"}
    values.pop("rendering", None)
    surface = Surface(scene.texture, **surface_keywords(values, find_law("H")))
    if not is_searched(surface):
        raise ParameterError("texture", "needs no field: its contact has a closed form")
    device = load_device(scene.device or DEFAULT_DEVICE)
    rendered = render_on_device(surface, device, FIELD, **options)
    if is_searched(rendered):
        raise ParameterError("extent", "is missing: this texture never repeats")
    return cast("Tabular", rendered.texture)  # a potential field


def _onset(scene: Scene, laws: Laws, options: Mapping[str, Any], _seed: int) -> Tabular:
    return onset(scene, laws, **options)


def _scan(scene: Scene, laws: Laws, options: Mapping[str, Any], _seed: int) -> Tabular:
    return scan(scene, laws, **options)


_FORCE = "resolved force RMS [N]"
_FIELD_ENERGY = "energy of the field [J]"
_STIFFNESS = "recommended stiffness [N/m]"
RUN_KINDS = {
    kind.name: kind
    for kind in (
        RunKind("compare", compare, _compare, ("law",), (_STIFFNESS, _FORCE)),
        RunKind("limits", limits, _limits, (), ("top speed [m/s]", _FORCE), takes_laws=False),
        RunKind("onset", onset, _onset, ("law", "delay [samples]"), ("cycling [N/m]",)),
        RunKind("scan", scan, _scan, ("law", "speed [m/s]", "depth [m]"), (_FIELD_ENERGY,)),
        RunKind("bake", render_on_device, _bake, (), ("size [B]", "q"), takes_laws=False),
    )
}


def find_run(name: str) -> RunKind:
    """Return the run of a name.

    Raises:
        ParameterError: for an unknown one, with the nearest.
    """
    return find_named("run", name, RUN_KINDS)


@dataclass(frozen=True)
class CaseTemplate:
    """What all cases of a sweep share; it is sent to the workers.

    Attributes:
        sections: sections of the scene.
        folder: folder of the paths in the scene.
        run: name of the run.
        laws: letters of the laws; ``None`` for all.
        options: arguments of the run by name.
        package: digest of the package that a worker must have.
        prepare: pickled function that each worker process calls first, such as one that loads
            plugins; empty for none.
    """

    sections: Mapping[str, Mapping[str, Any]]
    folder: Path
    run: str
    laws: Laws
    options: Mapping[str, Any]
    package: str
    prepare: bytes = b""

    def case_text(self, values: Mapping[str, Any]) -> str:
        """Return the text of a case: its scene and what is computed, the same for the same case."""
        content = {"run": self.run, "laws": self.laws, "options": self.options}
        content["scene"] = with_values(self.sections, values)
        return json.dumps(content, sort_keys=True, ensure_ascii=False, default=str)


@dataclass(frozen=True)
class Outcome:
    """What a case came to.

    Attributes:
        index: number of the case.
        rows: rows of its table, plain values.
        error: why it failed, in one line; empty if it did not.
    """

    index: int
    rows: Sequence[Mapping[str, Any]] = ()
    error: str = ""


_ONE_CASE = threading.Lock()  # random numbers of libraries belong to the process


def compute_cases(template: CaseTemplate, cases: Sequence[Case]) -> tuple[float, list[Outcome]]:
    """Return the time that cases took [s], and what they came to.

    Args:
        template: what the cases share.
        cases: number and values of each.

    Raises:
        ParameterError: if this process has another version of the package.
    """
    start = time.perf_counter()
    if template.package != package_digest():
        raise ParameterError(
            "scheduler",
            "has a worker with another version of asperity, Python, NumPy, SciPy or Numba",
        )
    _prepare(template.prepare)
    with _ONE_CASE:
        outcomes = [_compute_case(template, *case) for case in cases]
    return time.perf_counter() - start, outcomes


@lru_cache(maxsize=1)
def _prepare(function: bytes) -> None:
    """Call a pickled function, once in this process."""
    if function:
        pickle.loads(function)()


def _compute_case(template: CaseTemplate, index: int, values: Mapping[str, Any]) -> Outcome:
    # The generators of the process are a convenience: threads of Dask draw from random, too.
    seed = int(content_digest(template.case_text(values))[:16], 16)
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002 - the generator of code that has none of its own
    run = find_run(template.run)
    laws = template.laws
    if LAW_KEY in values and run.takes_laws:
        laws = (values[LAW_KEY],)
    try:
        scene = build_scene(with_values(template.sections, values), template.folder)
        result = run.compute(scene, laws, template.options, seed)
        return Outcome(index, to_plain_data(result.table_rows()))
    except Exception as error:  # one case must not end the others
        text = str(error)
        if not isinstance(error, AsperityError):
            text = f"{type(error).__name__}: {error}"
        return Outcome(index, error=" ".join(text.split()))
