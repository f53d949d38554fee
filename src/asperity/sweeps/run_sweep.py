"""Sweep a scene: compute all cases of a plan that are not in its results folder."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from asperity.core.arguments import check_integer
from asperity.core.errors import ParameterError
from asperity.core.processes import available_cores
from asperity.sweeps.case_runs import Case, Outcome, compute_cases
from asperity.sweeps.engine import Place, cluster_place, local_place, run_cases
from asperity.sweeps.sweep_plan import SweepPlan, make_plan
from asperity.sweeps.sweep_result import ResultStore, SweepResult

Progress = Callable[[float], object]


def sweep(
    scene: str | os.PathLike[str],
    vary: Mapping[str, str],
    run: str = "compare",
    *,
    laws: str | Sequence[str] | None = None,
    design: str = "",
    folder: str | os.PathLike[str] | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> SweepResult:
    """Compute a scene for many values of its keys.

    Every case is computed from its own text alone, which also seeds random numbers: its rows do not
    depend on the order of the cases or on where they are computed.

    Args:
        scene: path of a scene file, or a surface as for :func:`asperity.compare`.
        vary: values by key, as on the command line: ``{"texture.period": "0.5mm:4mm:40log",
            "device": "touch,omega.3"}``. The last key changes fastest.
        run: ``"compare"``, ``"limits"``, ``"onset"``, ``"scan"`` or ``"bake"``, which makes the
            fields of law H and keeps them in the cache.
        laws: letters or names, for runs with several laws; all by default.
        design: ``"sobol:64"`` for that many points of a Sobol sequence over the ranges, which are
            then ``"0.5mm:4mm"`` or ``"0.5mm:4mm:log"``; by default all combinations.
        folder: results folder. The same call goes on where an earlier one was stopped. Default: a
            temporary one, which lives as long as the result.
        processes: number of worker processes; 1 for none; default: one per core. A script that
            starts some needs the usual ``if __name__ == "__main__":``.
        scheduler: address of a scheduler of Dask, whose workers compute instead; see
            :func:`~asperity.sweeps.engine.cluster_place`.
        progress: called with the completed fraction of the cases that were left.
        **options: further arguments of :func:`asperity.compare`, :func:`asperity.limits`,
            :func:`asperity.onset` or :func:`asperity.scan`.

    Raises:
        ParameterError: for an unknown key or a value that cannot be used, a folder of another
            sweep, or if every case fails.

    Example:
        >>> result = sweep("sinusoid:amplitude=0.1mm", {"texture.period": "1mm:2mm:2"}, "compare",
        ...                laws="WA", processes=1)
        >>> [(row["texture.period [m]"], row["law"]) for row in result.table_rows()]
        [(0.001, 'W'), (0.001, 'A'), (0.002, 'W'), (0.002, 'A')]
    """
    if processes is None:
        processes = available_cores()
    check_integer("processes", processes, 1)
    plan = make_plan(os.fspath(scene), vary, run, design=design, laws=laws, options=options)
    if scheduler is not None:
        return run_plan(plan, cluster_place(scheduler), folder, progress)
    return run_plan(plan, local_place(processes), folder, progress)


def run_plan(
    plan: SweepPlan,
    place: Place,
    folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Compute the cases of a plan that are not in a folder; see :func:`sweep`."""
    store = open_store(plan, folder)
    left = len(plan) - store.n_done

    def record(outcomes: Sequence[Outcome]) -> None:
        store.record(outcomes)
        if progress is not None:
            progress(1.0 - (len(plan) - store.n_done) / left)

    try:
        if left:
            run_cases(place, plan.template, missing_cases(plan, store), record)
    finally:
        store.release()
    result = SweepResult(plan, store)
    if len(result.errors) == len(plan):
        first = result.errors[0]
        raise ParameterError("sweep", f"failed in each of {len(plan)} cases, the first: {first}")
    return result


def open_store(plan: SweepPlan, folder: str | os.PathLike[str] | None) -> ResultStore:
    """Return the results folder of a plan; a temporary one lives as long as the store."""
    if folder is not None:
        return ResultStore(Path(folder), plan.describe(), len(plan))
    temporary = tempfile.TemporaryDirectory(prefix="asperity-sweep-", ignore_cleanup_errors=True)
    store = ResultStore(Path(temporary.name), plan.describe(), len(plan))
    weakref.finalize(store, temporary.cleanup)
    return store


def missing_cases(plan: SweepPlan, store: ResultStore) -> Iterator[Case]:
    """Yield the cases that are not recorded."""
    return ((i, plan.values(i)) for i in range(len(plan)) if i not in store)


def estimate_case_time(plan: SweepPlan) -> float:
    """Return the time of a case [s]: of the last one, after the first has compiled what they need.

    Neither is recorded.
    """
    compute_cases(plan.template, [(0, plan.values(0))])
    return compute_cases(plan.template, [(len(plan) - 1, plan.values(len(plan) - 1))])[0]
