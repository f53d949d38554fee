"""Results for reading: tables for a terminal, pictures, one HTML file.

Everything is imported when it is first used: a table needs no matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asperity.report.analysis import print_analysis as print_analysis
    from asperity.report.comparison import comparison_table as comparison_table
    from asperity.report.comparison import print_comparison as print_comparison
    from asperity.report.html import html_text as html_text
    from asperity.report.notebook import notebook_html as notebook_html
    from asperity.report.notebook import printed as printed
    from asperity.report.page import add_section as add_section
    from asperity.report.pictures.plots import plot as plot

_HOMES = {
    "add_section": "asperity.report.page",
    "comparison_table": "asperity.report.comparison",
    "html_text": "asperity.report.html",
    "notebook_html": "asperity.report.notebook",
    "plot": "asperity.report.pictures.plots",
    "print_analysis": "asperity.report.analysis",
    "print_comparison": "asperity.report.comparison",
    "printed": "asperity.report.notebook",
}

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'asperity.report' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
