"""Notebook, terminal, figure and page representations of results.

Results know nothing of their representations: the package registers the module that renders them
with :func:`set_renderer`, and it is loaded at the first use.
"""

from __future__ import annotations

import csv
import io
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import IO, TYPE_CHECKING, Any, Generic, TypeVar, overload

from asperity.core.errors import ParameterError
from asperity.core.files import open_output, write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_load_renderer: Callable[[], Any]


def set_renderer(load: Callable[[], Any]) -> None:
    """Set the function that loads the renderer of results; see :mod:`asperity.report`."""
    global _load_renderer  # noqa: PLW0603  # set once, when the package is imported
    _load_renderer = load


def describe(value: object, name: str) -> Any:
    """Return a text about a result, which the report makes (:mod:`asperity.report.sentences`).

    Args:
        value: the result.
        name: name of the text.
    """
    return _load_renderer().describe(value, name)


T = TypeVar("T")


class Text(Generic[T]):
    """An attribute of a result that is text: the report makes it of the result at the first use.

    Args:
        doc: what the text says.
        is_written: whether it is part of the plain data.
    """

    def __init__(self, doc: str, *, is_written: bool = True) -> None:
        self.__doc__ = doc
        if is_written:
            self.is_written = True

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Text[T]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: object | None, owner: type) -> Text[T] | T:
        if instance is None:
            return self
        text: T = describe(instance, self._name)
        # Not a field: it is found before this descriptor from now on.
        instance.__dict__[self._name] = text
        return text


class Displayable:
    """A result with an HTML representation in a notebook."""

    def _repr_html_(self) -> str | None:
        """Return HTML without scripts; ``None`` where the ``repr`` suffices."""
        try:
            text: str | None = _load_renderer().notebook_html(self)
        except Exception:  # a failure to display a result must not hide the result
            return None
        return text


class Plottable(Displayable):
    """A result with a figure."""

    def plot(self, picture: str | None = None) -> Figure:
        """Return a figure; see :func:`asperity.report.plot`.

        Args:
            picture: name of one figure of the report; by default the main figures together. The
                error for an unknown name lists the names.

        Returns:
            A Matplotlib figure, which a notebook shows; ``figure.savefig(path)`` writes it.

        Raises:
            ParameterError: for an unknown name.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="WC")
            >>> [axes.get_ylabel() for axes in result.plot("merit").axes]
            ['support S']
        """
        figure: Figure = _load_renderer().plot(self, picture)
        return figure


class Reportable(Displayable):
    """A result with a report: an HTML page, and the output of the command line."""

    @overload
    def to_html(self) -> str: ...
    @overload
    def to_html(self, path: str | os.PathLike[str]) -> None: ...
    def to_html(self, path: str | os.PathLike[str] | None = None) -> str | None:
        """Return the report as one HTML text that needs no network, or write it to a file.

        Args:
            path: of the file, which is written completely or not at all; by default the text is
                returned.

        Raises:
            ParameterError: if the file cannot be written.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="W")
            >>> result.to_html()[:15]
            '<!DOCTYPE html>'
        """
        text: str = _load_renderer().html_text(self)
        if path is None:
            return text
        write_bytes("path", path, text.encode())
        return None

    def to_latex(self) -> str:
        r"""Return a paragraph for a methods section, and the tables, as LaTeX for ``\input``.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="W")
            >>> result.to_latex().count("tabular")
            2
        """
        text: str = _load_renderer().latex_text(self)
        return text

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        """Yield the output of the command line, for a console of this width."""
        del console  # the options contain its width
        yield from _load_renderer().rich_renderables(self, options.max_width)


class Tabular(ABC):
    """A result with rows of plain values."""

    @abstractmethod
    def table_rows(self) -> list[dict[str, Any]]:
        """Return the rows: SI units, which are named in the columns, "stiffness [N/m]"."""

    def to_dataframe(self) -> Any:
        """Return the rows as a pandas ``DataFrame``; pandas must be installed.

        Columns have SI units, which their names contain; an unknown number is ``None``.

        Raises:
            ParameterError: if pandas is not installed.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.8mm,period=1mm", laws="WA")
            >>> [f"{row['stability limit [N/m]']:.0f}" for row in result.table_rows()]
            ['5000', '976']
        """
        try:
            import pandas
        except ImportError:
            requirement = "needs pandas: pip install pandas; or use table_rows()"
            raise ParameterError("to_dataframe", requirement) from None
        return pandas.DataFrame(self.table_rows())


class TableFiles(Tabular):
    """A result whose table is written as CSV."""

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
        return {name: _common_type(kinds or {str}) for name, kinds in types.items()}

    def table_rows(self) -> list[dict[str, Any]]:
        """Return the rows in their order; SI units. An unknown value is ``None``."""
        return [{name: row.get(name) for name in self.columns} for row in self.iterate_rows()]

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table as CSV, whose first line names the columns with their units.

        Raises:
            ParameterError: if the file cannot be written.
        """
        with open_output("output", path) as stream:
            self._write_csv(stream)

    def _write_csv(self, stream: IO[bytes]) -> None:
        text = io.TextIOWrapper(stream, "utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.iterate_rows():
            writer.writerow([_csv_value(row.get(name)) for name in self.columns])
        text.detach()


def _common_type(types: set[type]) -> type:
    """Return the type of a column from those of its values."""
    if types == {int, float}:
        return float
    if len(types) == 1:
        return types.pop()
    return str


def _csv_value(value: Any) -> Any:
    """Return a value of CSV: true and false as in JSON."""
    if isinstance(value, bool):
        return str(value).lower()
    return value
