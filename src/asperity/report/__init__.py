"""Reports of results: text for a terminal, figures, notebook output and HTML files.

The registry of the pages of results, and the representations that results get from it.
"""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING, Any

from rich.console import RenderableType

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.verdict import Passivity
from asperity.analysis.results.analyze import Analysis
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons
from asperity.core.files import json_text, text_digest
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.envelopes.envelope import Envelope
from asperity.envelopes.find_design import Design
from asperity.measured.reading.measured_file import MeasurementSummary
from asperity.report.document.html import render_notebook, render_page
from asperity.report.document.latex import render_latex
from asperity.report.document.page import Page, Picture, notebook_page, plot_later
from asperity.report.document.terminal import page_renderables
from asperity.report.pages.analysis_report import analysis_page, criteria_table
from asperity.report.pages.catalogue_report import device_page
from asperity.report.pages.comparison_columns import comparison_table as comparison_table
from asperity.report.pages.comparison_report import comparison_page, comparisons_page, design_page
from asperity.report.pages.limits_report import envelope_page, limits_page
from asperity.report.pages.measured_report import surface_summary_page
from asperity.report.sentences.result_texts import describe as describe
from asperity.report.sentences.surface_text import describe_texture
from asperity.report.sentences.texts import interval_text, readable_name, witness_text
from asperity.surface import Surface
from asperity.textures.texture import Texture

if TYPE_CHECKING:
    from asperity.report.pictures.plotting import plot as plot

__all__ = [
    "comparison_table",
    "describe",
    "html_text",
    "latex_text",
    "notebook_html",
    "plot",
    "rich_renderables",
]


def __getattr__(name: str) -> Any:
    if name != "plot":  # the only function that needs Matplotlib
        raise AttributeError(f"module 'asperity.report' has no attribute {name!r}")
    from asperity.report.pictures.plotting import plot

    return plot


def __dir__() -> list[str]:
    return __all__


@singledispatch
def find_page(result: Any) -> Page | None:
    """Return the page of a result; ``None`` for a result without one."""
    from asperity.report.pages.sweep_report import (
        find_loop_page,  # needs the simulation and the paper
    )

    return find_loop_page(result)


find_page.register(Analysis, analysis_page)
find_page.register(Comparison, comparison_page)
find_page.register(Design, design_page)
find_page.register(Device, device_page)
find_page.register(DeviceComparisons, comparisons_page)
find_page.register(Envelope, envelope_page)
find_page.register(Limits, limits_page)
find_page.register(MeasurementSummary, surface_summary_page)


@find_page.register
def _passivity_page(result: Passivity) -> Page:
    answer = f"{result.verdict}, decided by {result.decided_by}: {result.reason}"
    return notebook_page(answer, criteria_table(result))


@find_page.register
def _bound_page(result: Bound) -> Page:
    note = f": {result.note}" if result.note else ""
    where = "" if result.at is None else f"; lower end at {witness_text(result)}"
    return notebook_page(f"{interval_text(result)}, {result.method}{note}{where}")


@find_page.register
def _texture_page(result: Texture) -> Page:
    height = format_quantity(result.peak_to_valley, "m")
    text = f"{describe_texture(result.describe())}; {height} high"
    return notebook_page(text, Picture(plot_later(result), f"The surface: {text}"))


@find_page.register
def _surface_page(result: Surface) -> Page:
    law = result.law
    texture = describe_texture(result.texture.describe())
    stiffness = format_quantity(result.stiffness, "N/m")
    depth = format_quantity(result.max_depth, "m")
    name = f"law {law.letter}, {readable_name(law.name)}"
    answer = f"{name}, at {stiffness}, pressed to {depth}: {texture}"
    return notebook_page(answer, Picture(plot_later(result.texture), f"The surface: {texture}"))


def html_text(result: Any) -> str:
    """Return the report of a result: answer, tables, figures, pedigree and assumptions, as HTML.

    Figures are inlined; nothing is loaded from elsewhere; there are styles for light and dark
    screens and for print.

    Args:
        result: a comparison, on one or several devices, an analysis, limits, the summary of a
            measured surface, or a recording.

    Raises:
        TypeError: for a result without a report.
    """
    return render_page(_find_report(result), text_digest(json_text(result)))


def _find_report(result: Any) -> Page:
    page = find_page(result)
    if page is None or not page.title:
        raise TypeError(f"a {type(result).__name__} has no report")
    return page


def latex_text(result: Any) -> str:
    r"""Return a result as LaTeX: a paragraph for a methods section, and its tables.

    A document reads it with ``\input``; no package is needed.

    Raises:
        TypeError: for a result without a report.
    """
    return render_latex(_find_report(result))


def notebook_html(result: Any) -> str | None:
    """Return the output of a notebook cell for a result as HTML; ``None`` if its ``repr`` suffices.

    Example:
        >>> print(notebook_html(Bound(2.0, 2.5, "certified", note="branch & bound")))
        <div>
        <p><strong>2 to 2.5, certified: branch &amp; bound</strong></p>
        </div>
    """
    page = find_page(result)
    return None if page is None else render_notebook(page)


def rich_renderables(result: Any, width: int) -> list[RenderableType]:
    """Return the output of the command line for a result, on a console of a width [characters]."""
    page = find_page(result)
    return [] if page is None else list(page_renderables(page, width))
