"""What a result shows of itself: in a notebook, and where Rich prints it."""

from __future__ import annotations

import io
from functools import partial, singledispatch
from typing import Any

from rich.console import Console, RenderableType
from rich.text import Text

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.compare import Comparison
from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.passivity.judgement import Passivity
from asperity.analysis.several import Comparisons
from asperity.devices import Device
from asperity.paper.table_two import TableTwo
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report import page
from asperity.report.analysis import criteria_table, print_analysis, suprema_table
from asperity.report.comparison import answers_table, print_comparison
from asperity.report.comparison_columns import described
from asperity.report.devices import numbers_table
from asperity.report.fragment import Fragment, fragment_html
from asperity.report.limits import print_limits, six_table
from asperity.report.pictures.plots import plot
from asperity.report.recording import answer, columns_table, replay_answer
from asperity.report.run import ledger_table, work_text
from asperity.report.several import cases_table, print_comparisons
from asperity.report.show import print_shown
from asperity.report.stages import parts_table, texture_text
from asperity.report.words.number_words import interval_text, law_title, witness_text
from asperity.simulation import Run
from asperity.surface import Surface
from asperity.textures.shown import Shown
from asperity.textures.texture import Texture
from asperity.units import engineering

_PRINTED: dict[type, Any] = {
    Analysis: print_analysis,
    Comparison: print_comparison,
    Comparisons: print_comparisons,
    Limits: print_limits,
    Shown: print_shown,
}


def notebook_html(result: Any) -> str | None:
    """Return what a notebook shows of a result as HTML; ``None`` for what has no more than a line.

    Example:
        >>> print(notebook_html(Bound(2.0, 2.5, "certified", note="branch & bound")))
        <div>
        <p><strong>2 to 2.5, certified: branch &amp; bound</strong></p>
        </div>
    """
    fragment = fragment_of(result)
    return None if fragment is None else fragment_html(fragment)


@singledispatch
def fragment_of(result: Any) -> Fragment | None:
    """Return what a notebook shows of a result; ``None`` for what has no more than a line."""
    del result  # the registered functions take it
    return None


@fragment_of.register
def _comparison(result: Comparison) -> Fragment:
    picture = partial(plot, result, "merit")
    words = "Strength and support of each law"
    return Fragment(result.recommendation, [answers_table(result)], picture, words)


@fragment_of.register
def _comparisons(result: Comparisons) -> Fragment:
    said = [result.recommendation, *(f"{missing.sentence}." for missing in result.lacking)]
    return Fragment(" ".join(said), [cases_table(result)])


@fragment_of.register
def _analysis(result: Analysis) -> Fragment:
    tables = [suprema_table(result), criteria_table(result.passivity)]
    return Fragment(result.answer, tables, partial(plot, result, "gain"), "Where the loop gain is")


@fragment_of.register
def _limits(result: Limits) -> Fragment:
    words = "The waves and their forces, with the limits of the device"
    return Fragment(result.answer, [six_table(result)], partial(plot, result), words)


@fragment_of.register
def _passivity(result: Passivity) -> Fragment:
    answer = f"{result.verdict}, decided by {result.decided_by}: {result.reason}"
    return Fragment(answer, [criteria_table(result)])


@fragment_of.register
def _bound(result: Bound) -> Fragment:
    said = f"{interval_text(result)}, {result.method}"
    said += f": {result.note}" if result.note else ""
    return Fragment(said if result.at is None else f"{said}; lower end at {witness_text(result)}")


@fragment_of.register
def _texture(result: Texture) -> Fragment:
    said = f"{described(result.describe())}; {engineering(result.peak_to_valley, 'm')} high"
    return Fragment(said, (), partial(plot, result), f"The surface: {said}")


@fragment_of.register
def _surface(result: Surface) -> Fragment:
    law, words = result.law, described(result.texture.describe())
    stiffness, depth = engineering(result.stiffness, "N/m"), engineering(result.max_depth, "m")
    said = f"law {law.letter}, {law_title(law.name)}, at {stiffness}, pressed to {depth}: {words}"
    return Fragment(said, (), partial(plot, result.texture), f"The surface: {words}")


@fragment_of.register
def _device(result: Device) -> Fragment:
    return Fragment(result.name, [numbers_table(result, list(result.data))])


@fragment_of.register
def _shown(result: Shown) -> Fragment:
    return Fragment(texture_text(result.parts), [parts_table(result.parts)])


@fragment_of.register
def _run(result: Run) -> Fragment:
    said = f"{work_text(result.surface, result)}."
    draw = partial(plot, result) if len(result.time) > 1 else None  # else no trace was kept
    return Fragment(said, [ledger_table(result)], draw, "Motion, force, energy and phase")


@fragment_of.register
def _recording(result: Recording) -> Fragment:
    draw = partial(plot, result) if result.rows > 1 else None
    words = "Motion, force, energy and phase"
    return Fragment(answer(result), [columns_table(result, result.ranges())], draw, words)


@fragment_of.register
def _replay(result: Replay) -> Fragment:
    return Fragment(" ".join([replay_answer(result), *result.notes]))


@fragment_of.register
def _table_two(result: TableTwo) -> Fragment:
    head, *rows = result.cells()
    return Fragment(result.parameters, [page.Table(head, [page.Row(cells) for cells in rows])])


# --- where Rich prints it -------------------------------------------------------------------------


class _Kept(Console):
    """A console that keeps what is printed on it, for another console to print."""

    def __init__(self, width: int) -> None:
        super().__init__(file=io.StringIO(), width=width, highlight=False)
        self.kept: list[RenderableType] = []

    def print(self, *objects: Any, **_: Any) -> None:
        """Keep what is given; plain words are plain, and no character of them is cut."""
        for one in objects or ("",):
            self.kept.append(Text(one, overflow="fold") if isinstance(one, str) else one)


def printed(result: Any, width: int) -> list[RenderableType]:
    """Return what the command line prints of a result on a console of a width [characters]."""
    console = _Kept(width)
    _PRINTED[type(result)](result, console)
    return console.kept
