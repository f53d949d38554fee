"""The result of a sweep: its folder, and its table as rows, CSV, DataFrame or Dataset.

The folder has one line per case, appended when the case is done. A process that is killed at any
moment leaves whole lines, and at most one torn line at the end, which is removed when the folder is
opened again. The rows of a table need not be in memory at once.
"""

from __future__ import annotations

import json
import re
import weakref
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from asperity.core.display import Reportable, TableFiles
from asperity.core.errors import ParameterError
from asperity.core.files import append_bytes, json_text, open_input, to_plain_data, write_bytes
from asperity.core.processes import defer_interrupt
from asperity.sweeps.case_runs import Outcome, RunKind, find_run
from asperity.sweeps.sweep_plan import SweepPlan

SCHEMA = 1
CASE = "case"
ERROR = "error"


UNIT = re.compile(r"(.*) \[(.+)\]")
"""Name and unit of a column."""


@dataclass(frozen=True, eq=False)
class SweepResult(Reportable, TableFiles):
    """The table of a sweep: the varied values of each case and what was computed for them.

    The rows stay on disk and are read when they are needed.

    Attributes:
        plan: the cases.
        store: their outcomes.
    """

    plan: SweepPlan
    store: ResultStore = field(repr=False)

    @property
    def run(self) -> RunKind:
        """What was computed for each case."""
        return find_run(self.plan.template.run)

    def __repr__(self) -> str:
        return f"<SweepResult of {len(self.plan)} cases, {len(self.errors)} failed>"

    @cached_property
    def errors(self) -> dict[int, str]:
        """Why cases failed, by their number."""
        outcomes = self.store.outcomes()
        return {outcome.index: outcome.error for outcome in outcomes if outcome.error}

    @cached_property
    def columns(self) -> dict[str, type]:
        """Columns of the table with the type of their values; errors are the last."""
        types = self._column_types()
        types[ERROR] = types.pop(ERROR, str)
        return types

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows in the order of the cases, without the columns that a row lacks.

        A row has the number and the values of its case, and results or an error.
        """
        for outcome in self.store.outcomes():
            case = {CASE: outcome.index, **self.plan.numbers(outcome.index)}
            for row in outcome.rows or ({ERROR: outcome.error},):
                yield {**case, **row}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        rows = to_plain_data(self.table_rows())
        return {"schema": SCHEMA, "sweep": self.plan.describe(), "rows": rows}

    def to_xarray(self) -> Any:
        """Return the table as an xarray ``Dataset``; pandas and xarray must be installed.

        Dimensions are the varied keys, or the number of the case in a design, and the columns that
        distinguish the rows of a case, such as ``law``. Failed cases are missing values. Variables
        have the attribute ``units``.

        Raises:
            ParameterError: if xarray or pandas is not installed.
        """
        frame = self.to_dataframe()
        plan = self.plan
        keys = [plan.column(key) for key in plan.arguments]
        if plan.design:
            keys = [CASE]
        index = [name for name in self.run.index if name in frame]
        complete = frame[frame[ERROR].isna()].drop(columns=[ERROR])
        try:
            dataset = complete.set_index(keys + index).to_xarray()
        except ImportError:
            requirement = "needs xarray: pip install xarray; or use table_rows()"
            raise ParameterError("to_xarray", requirement) from None
        for name in dataset.variables:
            if match := UNIT.fullmatch(str(name)):
                dataset[name].attrs["units"] = match[2]
        return dataset


PLAN_FILE = "sweep.json"
CASES_FILE = "cases.jsonl"
LOCK_FILE = ".lock"
"""File in a folder that a process locks."""
_MISSING = -1
_LINE = re.compile(rb'\{"case": (\d+), .*\}\n')


class ResultStore:
    """Outcomes of cases on disk; no other process can use the folder until it is released.

    Args:
        folder: a new or empty folder, or that of the same sweep.
        plan: plain data that identifies the sweep.
        n_cases: number of cases.

    Attributes:
        path: the folder.
        n_done: number of cases that are recorded.

    Raises:
        ParameterError: for a folder that cannot be used.
    """

    def __init__(self, folder: Path, plan: Mapping[str, Any], n_cases: int) -> None:
        self.path = folder
        self._offsets = array("q", [_MISSING]) * n_cases
        with ExitStack() as stack:
            stack.enter_context(lock_folder(folder))
            check_plan(folder / PLAN_FILE, plan, "sweep")
            self._stream = (folder / CASES_FILE).open("ab", buffering=0)
            self._reader = (folder / CASES_FILE).open("rb")
            weakref.finalize(self, self._stream.close)
            weakref.finalize(self, self._reader.close)
            self._end = self._find_cases()
            # Lets other processes write; outcomes can still be read.
            self.release = stack.pop_all().close
        self.n_done = n_cases - self._offsets.count(_MISSING)

    def _find_cases(self) -> int:
        """Note where each case begins; return the end of the last whole line."""
        end = 0
        for line in self._reader:
            match = _LINE.fullmatch(line)
            if match is not None and int(match[1]) < len(self._offsets):
                self._offsets[int(match[1])] = end
            if line.endswith(b"\n"):
                end += len(line)
        self._stream.truncate(end)
        return end

    def __contains__(self, index: int) -> bool:
        return self._offsets[index] != _MISSING

    def record(self, outcomes: Sequence[Outcome]) -> None:
        """Append outcomes.

        Raises:
            ParameterError: if they cannot be written; what was recorded before stays.
        """
        lines = [_case_line(outcome) for outcome in outcomes]
        with defer_interrupt():
            append_bytes("output", self._stream, b"".join(lines))
            for outcome, line in zip(outcomes, lines, strict=True):
                self._offsets[outcome.index] = self._end
                self._end += len(line)
            self.n_done += len(lines)

    def outcomes(self) -> Iterator[Outcome]:
        """Yield the recorded outcomes in the order of their numbers."""
        for index in filter(self.__contains__, range(len(self._offsets))):
            self._reader.seek(self._offsets[index])
            data = json.loads(self._reader.readline())
            rows = [{name: _decode(v) for name, v in row.items()} for row in data["rows"]]
            yield Outcome(index, rows, data["error"])


def _case_line(outcome: Outcome) -> bytes:
    data = {"case": outcome.index, "error": outcome.error, "rows": list(outcome.rows)}
    return json.dumps(data, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def _decode(value: Any) -> Any:
    """Return a number for which JSON has no token."""
    if value in ("inf", "-inf"):
        return float(value)
    return value


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Make a folder, and lock it until the block ends.

    Raises:
        ParameterError: for a folder that another process has locked, and in place of an error of
            the system or of damaged content in the block.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / LOCK_FILE, timeout=0):
            yield
    except Timeout:
        raise ParameterError("output", "is in use by another process", str(folder)) from None
    except ParameterError:
        raise
    except (OSError, ValueError) as error:
        requirement = f"must be a folder that can be written: {getattr(error, 'strerror', error)}"
        raise ParameterError("output", requirement, str(folder)) from None


def check_plan(path: Path, plan: Mapping[str, Any], kind: str) -> None:
    """Check that a folder is empty or holds a plan, and write the plan into an empty one.

    Args:
        path: of the plan in its folder.
        plan: plain data.
        kind: of what is planned, for messages.

    Raises:
        ParameterError: for a folder that holds something else; others see :func:`lock_folder`.
    """
    folder = path.parent
    text = json_text(plan)
    if not path.exists():
        if any(file.name != LOCK_FILE for file in folder.iterdir()):
            requirement = f"is neither empty nor the folder of a {kind}"
            raise ParameterError("output", requirement, str(folder))
        write_bytes("output", path, text.encode())
        return
    with open_input(path) as stream:
        recorded = json.loads(stream.read())
    expected = json.loads(text)
    differing = [name for name, value in expected.items() if recorded.get(name) != value]
    if differing:
        names = ", ".join(differing).replace("version_digest", "version of asperity")
        requirement = f"holds another {kind} (other {names}): choose another folder"
        raise ParameterError("output", requirement, str(folder))
