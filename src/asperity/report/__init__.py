"""Reports of results: text for a terminal, figures, notebook output and HTML files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.report.pages.comparison_columns import comparison_table as comparison_table
from asperity.report.views import html_text as html_text
from asperity.report.views import notebook_html as notebook_html
from asperity.report.views import rich_renderables as rich_renderables

if TYPE_CHECKING:
    from asperity.report.pictures.plotting import plot as plot

__all__ = ["comparison_table", "html_text", "notebook_html", "plot", "rich_renderables"]


def __getattr__(name: str) -> Any:
    if name != "plot":  # the only function that needs Matplotlib
        raise AttributeError(f"module 'asperity.report' has no attribute {name!r}")
    from asperity.report.pictures.plotting import plot

    return plot


def __dir__() -> list[str]:
    return __all__
