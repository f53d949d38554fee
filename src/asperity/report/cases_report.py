"""Report of a sweep: the range of each number with where it is reached, figures, failed cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

from asperity.core.units import format_quantity
from asperity.report import page
from asperity.report.page import Cell, Media, Page, Row, Section, Table, TableLayout
from asperity.sweeps.sweep_result import CASE, SweepResult
from asperity.sweeps.table_files import UNIT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEADINGS = ("number", "of", "least", "at", "greatest", "at")
_MAX_ERRORS = 20
_LEFT_OUT = "Failed cases and unbounded values are left out."


def sweep_page(result: SweepResult) -> Page:
    """Return the report of a sweep."""
    plan = result.plan
    failed = len(result.errors)
    keys = ", ".join(plan.column(key) for key in plan.arguments)
    count = "1 case fails" if failed == 1 else f"{failed or 'no'} cases fail"
    table = _range_table(result)
    errors = [_error_table(result)] if failed else []
    names = [name for name in result.run.shown if name in result.columns]
    return Page(
        title=f"Sweep of {plan.source}: {plan.template.run}",
        answer=f"{len(plan)} cases of {plan.template.run} over {keys}: {count}.",
        facts=[(key, text) for key, text in plan.vary.items()],
        sections=[
            page.terminal_section(table, *errors),
            *(_figure_section(result, name, keys) for name in names),
            Section("Ranges", [table]),
            *([Section("Failed cases", errors)] if failed else ()),
            *page.user_sections(SweepResult, result),
        ],
        footer=page.PAPER_CITATION,
    )


def _figure_section(result: SweepResult, name: str, keys: str) -> Section:
    text = f"{name} over {keys}"
    caption = f"{text}: a line for each other choice, or a map on one scale of colours. {_LEFT_OUT}"
    media = Media.HTML | Media.NOTEBOOK
    return page.picture_section(name, partial(_draw, result, name), text, caption, media=media)


def _draw(result: SweepResult, name: str) -> Figure:
    from asperity.report.pictures.sweep_pictures import sweep_figure

    return sweep_figure(result, name)


def _range_table(result: SweepResult) -> Table:
    """Return least and greatest value of each shown number, by law or other columns of a case."""
    found: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in result.iterate_rows():
        group = " ".join(str(row[name]) for name in result.run.index[:1] if name in row)
        for name in result.run.shown:
            if row.get(name) is not None:
                least, greatest = found.setdefault((name, group), [row, row])
                least = row if row[name] < least[name] else least
                greatest = row if row[name] > greatest[name] else greatest
                found[name, group] = [least, greatest]
    rows = [
        Row([Cell(UNIT.sub(r"\1", name), "l"), group, *_extreme(result, name, least),
             *_extreme(result, name, greatest)])
        for (name, group), (least, greatest) in found.items()
    ]  # fmt: skip
    return Table(_HEADINGS, rows, (2, 4), TableLayout(wrap=(0, 3, 5), gap=2, has_rule=False))


def _extreme(result: SweepResult, name: str, row: dict[str, Any]) -> list[str]:
    columns = [result.plan.column(key) for key in result.plan.arguments]
    return [_value_text(name, row[name]), ", ".join(_value_text(one, row[one]) for one in columns)]


def _value_text(column: str, value: Any) -> str:
    match = UNIT.fullmatch(column)
    return (
        str(value) if isinstance(value, str) else format_quantity(value, match[2] if match else "")
    )


def _error_table(result: SweepResult) -> Table:
    """Return the errors, how often each occurred, and its first case."""
    firsts = {error: index for index, error in reversed(result.errors.items())}
    counts: Iterable[tuple[str, int]] = Counter(result.errors.values()).most_common(_MAX_ERRORS)
    rows = [Row([str(count), str(firsts[error]), error]) for error, count in counts]
    return Table(("cases", f"first {CASE}", "error"), rows, (0, 1), TableLayout(wrap=(2,)))
