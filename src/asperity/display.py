"""How results show themselves: in a notebook, where Rich prints them, as a figure, as a page.

Results know nothing of pictures. What draws them, ``asperity.report``, lies above them and is found
by its name when something is to be shown, no earlier.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, overload

from asperity.errors import ParameterError
from asperity.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _report() -> Any:
    """Return the room that draws results; see :mod:`asperity.report`."""
    return importlib.import_module("asperity.report")


class Displayed:
    """What a notebook shows as more than a line: in words, as a table, as a picture."""

    def _repr_html_(self) -> str | None:
        """Return a fragment of HTML, without script; ``None`` where its ``repr`` has to do."""
        try:
            text: str | None = _report().notebook_html(self)
        except Exception:  # whatever fails in showing a result, the result itself is there
            return None
        return text


class Plotted(Displayed):
    """What has a picture."""

    def plot(self, picture: str | None = None) -> Figure:
        """Return a picture; see :func:`asperity.report.plot`.

        Args:
            picture: one picture of the report alone, by its name; an unknown name is answered with
                those that there are.

        Returns:
            A Matplotlib figure, which a notebook shows; ``figure.savefig(path)`` writes it.

        Raises:
            ParameterError: for a picture that there is not.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="WC")
            >>> [axes.get_ylabel() for axes in result.plot("merit").axes]
            ['support S']
        """
        figure: Figure = _report().plot(self, picture)
        return figure


class Reported(Displayed):
    """What has a report: a page, and what the command line prints."""

    @overload
    def to_html(self) -> str: ...
    @overload
    def to_html(self, path: str | os.PathLike[str]) -> None: ...
    def to_html(self, path: str | os.PathLike[str] | None = None) -> str | None:
        """Return the report as one HTML text that needs no network, or write it to a file.

        Args:
            path: of the file, which is whole or not there; by default the text is returned.

        Raises:
            ParameterError: if the file cannot be written.

        Example:
            >>> import asperity as asp
            >>> result = asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="W")
            >>> result.to_html()[:15]
            '<!DOCTYPE html>'
        """
        text: str = _report().html_text(self)
        if path is None:
            return text
        try:
            write_text(path, text)
        except OSError as error:
            raise ParameterError("path", f"cannot be written: {error.strerror}", path) from None
        return None

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        """Yield what the command line prints, for a console of this width."""
        del console  # its width is among the options
        yield from _report().printed(self, options.max_width)
