"""The result of a sweep: its table, as rows, CSV, Parquet, a DataFrame or an xarray Dataset."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from asperity.core.display import Reportable
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.sweeps.case_runs import RunKind, find_run
from asperity.sweeps.result_store import ResultStore
from asperity.sweeps.sweep_plan import SweepPlan
from asperity.sweeps.table_files import UNIT, TableFiles

SCHEMA = 1
CASE = "case"
ERROR = "error"


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
        return {one.index: one.error for one in self.store.outcomes() if one.error}

    @cached_property
    def columns(self) -> dict[str, type]:
        """Columns of the table with the type of their values; errors are the last."""
        types = self._column_types()
        types[ERROR] = types.pop(ERROR, str)
        return types

    @property
    def metadata(self) -> dict[str, Any]:
        """The sweep, which Parquet files name."""
        return self.plan.describe()

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows in the order of the cases, without the columns that a row lacks.

        A row has the number and the values of its case, and results or an error.
        """
        for one in self.store.outcomes():
            case = {CASE: one.index, **self.plan.numbers(one.index)}
            for row in one.rows or ({ERROR: one.error},):
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
        keys = [CASE] if plan.design else [plan.column(key) for key in plan.arguments]
        index = [name for name in self.run.index if name in frame]
        found = frame[frame[ERROR].isna()].drop(columns=[ERROR])
        try:
            dataset = found.set_index(keys + index).to_xarray()
        except ImportError:
            words = "needs xarray: pip install xarray; or use table_rows()"
            raise ParameterError("to_xarray", words) from None
        for name in dataset.variables:
            if match := UNIT.fullmatch(str(name)):
                dataset[name].attrs["units"] = match[2]
        return dataset
