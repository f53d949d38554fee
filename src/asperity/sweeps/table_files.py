"""Tables of results as CSV and Parquet, whose rows need not be in memory at once."""

from __future__ import annotations

import csv
import io
import os
import re
from abc import abstractmethod
from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import islice
from typing import IO, Any

from asperity.core.display import Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_atomic
from asperity.recording.table_export import import_pyarrow

_BLOCK = 4096  # rows of Parquet that are in memory at a time
UNIT = re.compile(r"(.*) \[(.+)\]")
"""Name and unit of a column."""


class TableFiles(Tabular):
    """A result whose table is written as CSV or Parquet."""

    @property
    @abstractmethod
    def metadata(self) -> dict[str, Any]:
        """What Parquet files say about the table: plain data."""

    @abstractmethod
    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of :meth:`table_rows`, without the columns that a row lacks."""

    @cached_property
    def columns(self) -> dict[str, type]:
        """Columns of the table with the type of their values: bool, int, float or str."""
        return self._column_types()

    def _column_types(self) -> dict[str, type]:
        types: dict[str, set[type]] = {}
        for row in self.iterate_rows():
            for name, value in row.items():
                types.setdefault(name, set()).update({type(value)} - {type(None)})
        return {name: _common_type(found or {str}) for name, found in types.items()}

    def table_rows(self) -> list[dict[str, Any]]:
        """Return the rows in their order; SI units. An unknown value is ``None``."""
        return [{name: row.get(name) for name in self.columns} for row in self.iterate_rows()]

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
            metadata = None
            if match := UNIT.fullmatch(name):
                metadata = {"unit": match[2]}
            fields.append(arrow.field(name, types.get(kind, arrow.string()), metadata=metadata))
        metadata = {"asperity": json_text(self.metadata)}
        schema = arrow.schema(fields, metadata=metadata)
        rows = self.iterate_rows()
        with parquet.ParquetWriter(stream, schema) as writer:
            while block := list(islice(rows, _BLOCK)):
                arrays = []
                for name, kind in self.columns.items():
                    values = [_cast(row.get(name), kind) for row in block]
                    arrays.append(arrow.array(values, schema.field(name).type))
                writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))


def _common_type(types: set[type]) -> type:
    """Return the type of a column from those of its values."""
    if types == {int, float}:
        return float
    if len(types) == 1:
        return types.pop()
    return str


def _cast(value: Any, kind: type) -> Any:
    """Return a value as a type; an unknown one stays ``None``."""
    if value is None:
        return None
    return kind(value)


def _csv_value(value: Any) -> Any:
    """Return a value of CSV: true and false as in JSON."""
    if isinstance(value, bool):
        return str(value).lower()
    return value


def _write_file(path: str | os.PathLike[str], write: Callable[[IO[bytes]], None]) -> None:
    try:
        with open_atomic(path) as stream:
            write(stream)
    except OSError as error:
        words = f"cannot be written: {error.strerror}"
        raise ParameterError("output", words, os.fspath(path)) from None
