"""Compute cases of a sweep, in any process: the same case gives the same rows everywhere."""

from __future__ import annotations

import pickle
import random
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.core.digests import content_digest, package_digest
from asperity.core.errors import AsperityError, ParameterError
from asperity.core.files import to_plain_data
from asperity.scene.scene_file import DEVICE_ID, build_scene
from asperity.sweeps.run_kinds import find_run
from asperity.sweeps.sweep_plan import LAW_KEY, CaseTemplate

Case = tuple[int, Mapping[str, Any]]
"""Number of a case, and the values of its keys as written in a scene."""

_ONE_CASE = threading.Lock()  # random numbers of libraries belong to the process


class WorkerVersionError(AsperityError):
    """A worker process has another version of the package."""


@dataclass(frozen=True)
class Outcome:
    """What a case came to.

    Attributes:
        index: number of the case.
        rows: rows of its table, plain values.
        error: why it failed, in one line; empty if it did not.
    """

    index: int
    rows: tuple[Mapping[str, Any], ...] = ()
    error: str = ""


def compute_cases(
    template: CaseTemplate, cases: Sequence[Case]
) -> tuple[float, tuple[Outcome, ...]]:
    """Return the time that cases took [s], and what they came to.

    Args:
        template: what the cases share.
        cases: number and values of each.

    Raises:
        WorkerVersionError: if this process has another version of the package.
    """
    start = time.perf_counter()
    if template.package != package_digest():
        raise WorkerVersionError("a worker has another version of asperity, Python or NumPy")
    _prepare(template.prepare)
    with _ONE_CASE:
        outcomes = tuple(_compute_case(template, *case) for case in cases)
    return time.perf_counter() - start, outcomes


@lru_cache(maxsize=1)
def _prepare(function: bytes) -> None:
    """Call a pickled function once in this process."""
    if function:
        pickle.loads(function)()


def _compute_case(template: CaseTemplate, index: int, values: Mapping[str, Any]) -> Outcome:
    seed = case_seed(template, values)
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002 - the generator of code that has none of its own
    try:
        return Outcome(index, _case_rows(template, values))
    except Exception as error:  # one case must not end the others
        kind = "" if isinstance(error, AsperityError) else f"{type(error).__name__}: "
        return Outcome(index, error=" ".join(f"{kind}{error}".split()))


def case_seed(template: CaseTemplate, values: Mapping[str, Any]) -> int:
    """Return the seed of a case, which depends on its content alone."""
    return int(content_digest(template.case_text(values))[:16], 16)


def _case_rows(template: CaseTemplate, values: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    run, laws = find_run(template.run), template.laws
    if LAW_KEY in values and run.takes_laws:
        laws = (values[LAW_KEY],)
    sections = template.case_sections(values)
    section, _, name = DEVICE_ID.name.partition(".")
    device = str(sections.get(section, {}).get(name, ""))
    if device.lower().endswith(".toml"):
        sections[section][name] = str(template.device_folder / device)
    result = run.compute(build_scene(sections, template.folder), laws, template.options)
    return tuple(to_plain_data(row) for row in result.table_rows())


def check_first_case(template: CaseTemplate, cases: Sequence[Case]) -> None:
    """Check that the scene of one of these cases can be built.

    Raises:
        ParameterError: if none can, for the reason of the first.
    """
    errors = []
    for _, values in cases:
        try:
            build_scene(template.case_sections(values), template.folder)
        except ParameterError as error:
            errors.append(error)
    if len(errors) == len(cases):
        raise errors[0]
