"""What a study says, from its folder; and what it could say, from its file."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from asperity.studies import result_page  # noqa: F401  # registers the report of results
from asperity.studies.plan import StudyPlan, plan
from asperity.studies.study_file import load_study
from asperity.studies.study_result import StudyResult, analyse
from asperity.studies.study_store import find_derived_files, read_study, read_trials, write_key


def study_report(folder: str | Path) -> StudyResult:
    """Return what the answers in the folder of a study say.

    Args:
        folder: written by ``asperity study run``.

    Raises:
        ParameterError: for a folder of something else, or of another version; without answers.
    """
    return analyse(read_study(folder).design, read_trials(folder))


def plan_study(path: str | Path, effect: float, **options: Any) -> StudyPlan:
    """Return how often a study would find an effect.

    Args:
        path: study file.
        effect: factor of the strength at the hand in the first condition.
        **options: as for :func:`asperity.studies.plan.plan`.

    Raises:
        ParameterError: for a study or an option that cannot be used.
    """
    return plan(load_study(path).design, effect, **options)


def write_report(folder: str | Path, result: StudyResult) -> list[str]:
    """Write key, tables and page of a result into the folder; return the names of the files.

    The key unblinds the study. Tables are Parquet, too, where pyarrow is installed.

    Args:
        folder: of the study.
        result: see :func:`study_report`.

    Raises:
        ParameterError: for a folder that cannot be written.
    """
    write_key(folder)
    result.to_html(Path(folder) / "report.html")
    for name, table in {"trials": result.trial_table, "table": result}.items():
        table.to_csv(Path(folder) / f"{name}.csv")
        if importlib.util.find_spec("pyarrow") is not None:
            table.to_parquet(Path(folder) / f"{name}.parquet")
    return find_derived_files(folder)
