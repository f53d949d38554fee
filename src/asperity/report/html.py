"""The page of a result, whichever it is, as one HTML file that needs no network."""

from __future__ import annotations

from typing import Any

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.compare import Comparison
from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.several import Comparisons
from asperity.files import digest, json_text
from asperity.report.analysis import analysis_page
from asperity.report.comparison import comparison_page
from asperity.report.limits import limits_page
from asperity.report.page import Origin, own_look, page_html
from asperity.report.several import comparisons_page
from asperity.report.show import shown_page
from asperity.textures.shown import Shown

_PAGES: dict[type, Any] = {
    Analysis: analysis_page,
    Comparison: comparison_page,
    Comparisons: comparisons_page,
    Limits: limits_page,
    Shown: shown_page,
}


def html_text(result: Comparison | Comparisons | Analysis | Limits | Shown) -> str:
    """Return the report: answer, tables, pictures, pedigree and assumptions, in one HTML text.

    Pictures are inlined; nothing is loaded from elsewhere; light, dark and print are cared for.

    Raises:
        TypeError: for a result without a report.
    """
    if type(result) not in _PAGES:
        raise TypeError(f"no report is known for a {type(result).__name__}")
    with own_look():
        page = _PAGES[type(result)](result)
    return page_html(page, Origin(content=digest(json_text(result))))
