"""The result of a sweep: its table, as rows, CSV, Parquet, a DataFrame or an xarray Dataset."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import IO, Any

from asperity.core.display import Reportable, Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_atomic, to_plain_data
from asperity.recording.table_export import import_pyarrow
from asperity.sweeps.case_runs import RunKind, find_run
from asperity.sweeps.result_store import ResultStore
from asperity.sweeps.sweep_plan import SweepPlan

SCHEMA = 1
CASE, ERROR = "case", "error"
_BLOCK = 4096  # rows of Parquet that are in memory at a time
UNIT = re.compile(r"(.*) \[(.+)\]")
"""Name and unit of a column."""


@dataclass(frozen=True, eq=False)
class SweepResult(Reportable, Tabular):
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
        """Columns of the table with the type of their values: bool, int, float or str."""
        types: dict[str, set[type]] = {}
        for row in self.iterate_rows():
            for name, value in row.items():
                types.setdefault(name, set()).update({type(value)} - {type(None)})
        types[ERROR] = types.pop(ERROR, {str})
        return {name: _common_type(found) for name, found in types.items()}

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of :meth:`table_rows`, without the columns that a row lacks."""
        for one in self.store.outcomes():
            case = {CASE: one.index, **self.plan.numbers(one.index)}
            for row in one.rows or ({ERROR: one.error},):
                yield {**case, **row}

    def table_rows(self) -> list[dict[str, Any]]:
        """Return the rows in the order of the cases; SI units.

        A row has the number and the values of its case, and results or an error; an unknown value
        is ``None``.
        """
        return [{name: row.get(name) for name in self.columns} for row in self.iterate_rows()]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        rows = to_plain_data(self.table_rows())
        return {"schema": SCHEMA, "sweep": self.plan.describe(), "rows": rows}

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table as CSV, whose first line names the columns with their units.

        Raises:
            ParameterError: if the file cannot be written.
        """
        _write_file(path, self._write_csv)

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write the table as Parquet, whose fields have the metadata ``unit``.

        Raises:
            ParameterError: if the file cannot be written, or pyarrow is not installed.
        """
        import_pyarrow()
        _write_file(path, self._write_parquet)

    def to_xarray(self) -> Any:
        """Return the table as an xarray ``Dataset``; pandas and xarray must be installed.

        Dimensions are the varied keys, or the number of the case in a design, and the columns that
        distinguish the rows of a case, such as ``law``. Failed cases are missing values. Variables
        have the attribute ``units``.

        Raises:
            ParameterError: if xarray or pandas is not installed.
        """
        frame, plan = self.to_dataframe(), self.plan
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

    def _write_csv(self, stream: IO[bytes]) -> None:
        text = io.TextIOWrapper(stream, "utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.iterate_rows():
            writer.writerow([_csv_value(row.get(name)) for name in self.columns])
        text.detach()

    def _write_parquet(self, stream: IO[bytes]) -> None:
        arrow = import_pyarrow()
        from pyarrow import parquet

        types = {bool: arrow.bool_(), int: arrow.int64(), float: arrow.float64()}
        fields = []
        for name, kind in self.columns.items():
            match = UNIT.fullmatch(name)
            unit = {"unit": match[2]} if match else None
            fields.append(arrow.field(name, types.get(kind, arrow.string()), metadata=unit))
        metadata = {"asperity": json_text(self.plan.describe())}
        schema, rows = arrow.schema(fields, metadata=metadata), self.iterate_rows()
        with parquet.ParquetWriter(stream, schema) as writer:
            while block := list(islice(rows, _BLOCK)):
                columns = [
                    [_convert(row.get(name), kind) for row in block]
                    for name, kind in self.columns.items()
                ]
                arrays = [arrow.array(*one) for one in zip(columns, schema.types, strict=True)]
                writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))


def _common_type(types: set[type]) -> type:
    """Return the type of a column from those of its values."""
    if types == {int, float}:
        return float
    return next(iter(types)) if len(types) == 1 else str


def _convert(value: Any, kind: type) -> Any:
    return None if value is None else kind(value)


def _csv_value(value: Any) -> Any:
    """Return a value of CSV: true and false as in JSON."""
    return str(value).lower() if isinstance(value, bool) else value


def _write_file(path: str | os.PathLike[str], write: Callable[[IO[bytes]], None]) -> None:
    try:
        with open_atomic(path) as stream:
            write(stream)
    except OSError as error:
        words = f"cannot be written: {error.strerror}"
        raise ParameterError("output", words, os.fspath(path)) from None
