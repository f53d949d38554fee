"""The result of a sweep: its table, as rows, CSV, Parquet, a DataFrame or an xarray Dataset."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import IO, Any

from asperity.core.display import Reportable, Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_atomic, to_plain_data
from asperity.sweeps.result_store import ResultStore
from asperity.sweeps.run_kinds import RunKind, find_run
from asperity.sweeps.sweep_plan import SweepPlan

SCHEMA = 1
CASE, ERROR = "case", "error"
_BLOCK = 4096
_UNIT = re.compile(r".* \[(.+)\]")


@dataclass(frozen=True, eq=False)
class SweepResult(Reportable, Tabular):
    """The table of a sweep: the varied values of each case and what was computed for them.

    The rows stay on disk and are read when they are needed.

    Attributes:
        plan: the cases.
        store: their outcomes.
        folder: results folder, as given; ``None`` for a temporary one.
    """

    plan: SweepPlan
    store: ResultStore = field(repr=False)
    folder: Path | None = None

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
        """Yield the rows in the order of the cases, as in :meth:`table_rows`."""
        for one in self.store.outcomes():
            case = {CASE: one.index, **self.plan.numbers(one.index)}
            for row in one.rows or ({},):
                yield {**case, **row, **({ERROR: one.error} if one.error else {})}

    def table_rows(self) -> list[dict[str, Any]]:
        """Return the rows: number and values of the case, its results or its error; SI units.

        All rows have all columns; an unknown value is ``None``.
        """
        columns = self.columns
        return [{name: row.get(name) for name in columns} for row in self.iterate_rows()]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        rows = to_plain_data(self.table_rows())
        return {"schema": SCHEMA, "sweep": self.plan.describe(), "rows": rows}

    def to_csv(self, path: str | Path) -> None:
        """Write the table as CSV, whose first line names the columns with their units.

        Raises:
            ParameterError: if the file cannot be written.
        """
        _write_file(path, self._write_csv)

    def to_parquet(self, path: str | Path) -> None:
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
        frame = self.to_dataframe()
        try:
            import xarray  # noqa: F401 - pandas needs it
        except ImportError:
            words = "needs xarray: pip install xarray; or use table_rows()"
            raise ParameterError("to_xarray", words) from None
        keys = [one.column for one in self.plan.variations]
        index = [one for one in self.run.index if one in frame and one not in keys]
        dimensions = [*([CASE] if self.plan.design else keys), *index]
        found = frame[frame[ERROR].isna()].drop(columns=[ERROR])
        dataset = found.set_index(dimensions).to_xarray()
        for name in dataset.variables:
            dataset[name].attrs.update({"units": unit} if (unit := _unit(str(name))) else {})
        return dataset

    def _write_csv(self, stream: IO[bytes]) -> None:
        columns = self.columns
        text = io.TextIOWrapper(stream, "utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        for row in self.iterate_rows():
            writer.writerow([_csv_value(row.get(name)) for name in columns])
        text.detach()

    def _write_parquet(self, stream: IO[bytes]) -> None:
        arrow = import_pyarrow()
        from pyarrow import parquet

        types = {bool: arrow.bool_(), int: arrow.int64(), float: arrow.float64()}
        fields = [
            arrow.field(name, types.get(kind, arrow.string()), metadata=_unit_metadata(name))
            for name, kind in self.columns.items()
        ]
        metadata = {"asperity": json_text(self.plan.describe())}
        schema, rows = arrow.schema(fields, metadata=metadata), self.iterate_rows()
        with parquet.ParquetWriter(stream, schema) as writer:
            while block := list(islice(rows, _BLOCK)):
                columns = [
                    arrow.array([_convert(row.get(name), kind) for row in block], field.type)
                    for (name, kind), field in zip(self.columns.items(), fields, strict=True)
                ]
                writer.write_table(arrow.Table.from_arrays(columns, schema=schema))


def _common_type(types: set[type]) -> type:
    """Return the type of a column from those of its values."""
    if types <= {int, float}:
        return int if types == {int} else float
    return types.pop() if len(types) == 1 else str


def _convert(value: Any, kind: type) -> Any:
    return None if value is None else kind(value)


def _csv_value(value: Any) -> Any:
    """Return a value of CSV: as in JSON, but text without quotes, and nothing for ``None``."""
    return str(value).lower() if isinstance(value, bool) else value


def _unit(column: str) -> str:
    match = _UNIT.fullmatch(column)
    return match[1] if match else ""


def _unit_metadata(column: str) -> Mapping[str, str] | None:
    unit = _unit(column)
    return {"unit": unit} if unit else None


def _write_file(path: str | Path, write: Any) -> None:
    try:
        with open_atomic(path) as stream:
            write(stream)
    except OSError as error:
        words = f"cannot be written: {error.strerror}"
        raise ParameterError("output", words, str(path)) from None


def import_pyarrow() -> Any:
    """Return pyarrow.

    Raises:
        ParameterError: if it is not installed.
    """
    try:
        import pyarrow
    except ImportError:
        words = "needs pyarrow for Parquet: pip install 'asperity[parquet]'"
        raise ParameterError("output", words) from None
    return pyarrow
