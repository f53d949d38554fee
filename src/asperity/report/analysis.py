"""The analysis of one law: in a terminal, and as a page."""

from __future__ import annotations

import math
from dataclasses import replace

from rich.console import Console

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.judgement import Passivity
from asperity.analysis.words.passivity import allowed_text
from asperity.report import page, terminal
from asperity.report.devices import numbers_table
from asperity.report.terminal import head, say
from asperity.report.words import glossary
from asperity.report.words.number_words import (
    NONE,
    down_text,
    in_one_unit,
    interval_text,
    law_title,
    limit_text,
    merit_text,
    place_text,
    span_text,
    up_text,
    witness_text,
)
from asperity.report.words.reproduction_words import reproduction
from asperity.report.words.seen import of_analysis
from asperity.units import engineering

_NUMBERS = ("number", "lower", "upper", "method")
_CRITERIA = (
    "criterion", "condition", "holds", "limit", "margin", "what it says, and rests on",
)  # fmt: skip
_JUMPS = ("at depth", "jumps by")
# What the criteria of passivity use of the device.
_USED = (
    "max_stiffness", "update_rate", "damping", "virtual_damping", "delay_samples",
    "position_resolution", "force_resolution", "least_friction",
)  # fmt: skip


def numbers(analysis: Analysis) -> list[tuple[str, Bound]]:
    """Return the numbers of an analysis with their symbols."""
    density = analysis.curl_density
    found = _searched(analysis)
    if density is not None and density.upper > 0.0:
        found.append(("|curl f| [N/m]", density))
    return found


def _searched(analysis: Analysis) -> list[tuple[str, Bound]]:
    """Return the numbers that were each looked for; the others follow from them."""
    curl = [] if analysis.curl is None else [("|curl f|/k", analysis.curl)]
    return [("q", analysis.q), ("q⁺", analysis.one_sided), *curl]


def open_criteria(analysis: Analysis) -> list[tuple[str, str]]:
    """Return what is said of the criteria that decide nothing, those of one answer together."""
    said: dict[str, list[str]] = {}
    for criterion in analysis.passivity.criteria:
        if criterion.holds is None:
            said.setdefault(criterion.says, []).append(criterion.name)
    return [("; ".join(names), says) for says, names in said.items()]


def stiffness_text(analysis: Analysis) -> str:
    """Return up to which stiffness the law may be rendered, as a comparison says it."""
    return allowed_text(analysis.passivity.allowed, analysis.passivity.critical_speed)


def notes(analysis: Analysis) -> list[str]:
    """Return how each number came about, and whether and why the law is conservative."""
    said = [f"{name}: {bound.note}" for name, bound in _searched(analysis) if bound.note]
    word = "yes" if analysis.conservative else "no"
    return [*said, f"conservative: {word}, {analysis.conservative_reason}"]


def speed_text(analysis: Analysis) -> str:
    """Return v* for reading, with what it means or what is missing."""
    speed = analysis.v_star
    if speed is None:
        if analysis.device.value("damping") is None:
            return "not decidable: needs damping"
        return "not known: no loop found that gains"
    if speed == 0.0:
        return "0 m/s: there is nothing to absorb"
    if math.isinf(speed):
        return "∞: a device without damping never absorbs it"
    datum = analysis.device.data["damping"]
    mark = "" if datum.verified else " (not verified)"
    return f"{engineering(speed, 'm/s')}: slower, damping {datum.text}{mark} does not absorb it"


def thrust_text(analysis: Analysis) -> str:
    """Return the mean thrust on a straight scan for reading."""
    thrust, surface = analysis.leak.thrust, analysis.surface
    if surface.law.stateful:
        return "not defined: friction resists anyway"
    if thrust is None:
        return "not stated: the line does not repeat"
    # What is left of the rounding of forces up to k times depth is no thrust.
    small = abs(thrust) <= 1e-12 * surface.stiffness * surface.max_depth
    return f"{'0 N' if small else engineering(thrust, 'N')} on a straight scan"


def jump_rows(analysis: Analysis) -> list[tuple[str, str, str]]:
    """Return depth, size and place of every jump that was located, in common units."""
    jumps = analysis.continuity.jumps
    depths = in_one_unit([jump.depth for jump in jumps], "m")
    sizes = in_one_unit([jump.size for jump in jumps], "N")
    places = [place_text(jump.before) for jump in jumps]
    return list(zip(depths, sizes, places, strict=True))


def leak_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Return what is known of the worst loop, each with a short name."""
    leak, density = analysis.leak, analysis.curl_density
    line = leak.line
    x, y = (float(part) + 0.0 for part in line.direction)
    start = ", ".join(f"{1e3 * float(part) + 0.0:.6g}" for part in line.start)
    facts = [
        ("energy", f"{span_text(leak.energy, leak.upper_per_period, 'J')} per turn ({leak.method})")
    ]
    facts.append(("which", leak.description))
    plane = f"vertical, along ({x:.6g}, {y:.6g}) through ({start}) mm"
    facts.append(("plane", f"{plane}, {engineering(line.length, 'm')} of it"))
    if len(leak.vertices):
        path = f"{len(leak.vertices)} vertices, {engineering(leak.length, 'm')} long"
        facts.append(("polygon", path))
        mean = engineering(leak.per_length, "N")
        facts.append(("per length", f"{mean}: energy over the length of the line"))
    facts.append(("v*", speed_text(analysis)))
    facts.append(("thrust", thrust_text(analysis)))
    if density is not None and density.upper > 0.0:
        area = span_text(density.lower, density.upper, "J/m²")
        facts.append(("small loops", f"gain {area} at most: the greatest |curl f|"))
    return facts


def merit_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Return strength, support and force on the scan at which laws are compared."""
    scan, surface = analysis.merit, analysis.surface
    unit = "" if surface.texture.scan_line().periodic else " m"
    facts = [
        ("strength T", f"{merit_text(scan.strength)}{unit}"),
        ("support S", merit_text(scan.support)),
        ("texture force", f"{engineering(scan.ripple * surface.stiffness, 'N')} RMS at this k"),
        ("height", f"z = {engineering(scan.height, 'm')}"),
    ]
    if scan.contact_lost > 0.0:
        facts.append(("no contact", f"on {100.0 * scan.contact_lost:.0f} % of the scan"))
    return facts


# --- tables ---------------------------------------------------------------------------------------


def suprema_table(analysis: Analysis, last: str = "attained at") -> page.Table:
    """Return one row per number: lower, upper, method and the point that attains lower."""
    rows = []
    for name, bound in numbers(analysis):
        ends = [down_text(bound.lower), up_text(bound.upper)]
        rows.append(page.Row([page.Cell(name, "l"), *ends, bound.method, witness_text(bound)]))
    return page.Table((*_NUMBERS, last), rows, numbers=(1, 2))


def criteria_table(judged: Passivity) -> page.Table:
    """Return one row per criterion of passivity, the one that decides marked."""
    rows = []
    for criterion in judged.criteria:
        decides = criterion.name == judged.decided_by
        cells: page.Cells = [
            page.Cell(criterion.name, "l"),
            page.Cell(criterion.formula, "line"),
            page.holds_cell(criterion.holds),
            limit_text(criterion.limit),
            NONE if criterion.margin is None else down_text(criterion.margin, 3),
            page.Cell(criterion.says, below=criterion.assumptions),
        ]
        style = "dim" if criterion.holds is None and not decides else ""
        rows.append(page.Row(cells, "best" if decides else "", style=style))
    return page.Table(_CRITERIA, rows, numbers=(3, 4))


def _jumps_table(analysis: Analysis, last: str) -> page.Table:
    """Return one row per depth at which a jump was located."""
    rows = [page.Row(cells) for cells in jump_rows(analysis)]
    return page.Table((*_JUMPS, last), rows, numbers=(0, 1))


# --- in a terminal --------------------------------------------------------------------------------


def _with_arrow(table: page.Table) -> page.Table:
    """Return a table with an arrow before the row that decides."""
    rows = [replace(row, cells=["→" if row.kind else "", *row.cells]) for row in table.rows]
    return page.Table(("", *table.headings), rows, [1 + i for i in table.numbers])


def print_analysis(analysis: Analysis, console: Console, texture: str = "") -> None:
    """Print the verdict, the numbers, the criteria, the worst loop, the jumps, and three lines.

    Args:
        analysis: the result.
        console: where to.
        texture: an expression of Python that makes the texture; see
            :func:`asperity.report.words.reproduction_words.reproduction`.
    """
    law = analysis.surface.law
    say(console, analysis.answer, "bold")
    head(console, f"Law {law.letter}, {law_title(law.name)}: suprema over the working region")
    console.print(terminal.table(suprema_table(analysis), wraps=(4,)))
    for line in notes(analysis):
        say(console, line, "dim")
    head(console, f"Passive on the {analysis.device.name}? {analysis.passivity.verdict}")
    criteria = _with_arrow(criteria_table(analysis.passivity))
    console.print(terminal.table(criteria, wraps=(1,), most={1: 18}, without=(6,)))
    console.print(terminal.pairs(open_criteria(analysis), "dim", most=26))
    say(console, f"Stiffness: {stiffness_text(analysis)}")
    head(console, "Worst loop")
    console.print(terminal.pairs(leak_facts(analysis), most=26))
    head(console, "Continuity")
    say(console, analysis.continuity.reason)
    if analysis.continuity.jumps:
        jumps = _jumps_table(analysis, "near (both witnesses are in the JSON)")
        console.print(terminal.table(jumps, wraps=(2,)))
    head(console, "On a straight scan")
    console.print(terminal.pairs(merit_facts(analysis), most=26))
    head(console, "Reproduce q")
    for line in reproduction(analysis, texture):
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    terminal.print_assumptions(console, analysis.assumptions)


# --- as a page ------------------------------------------------------------------------------------


def analysis_page(analysis: Analysis, texture: str = "") -> page.Page:
    """Return the report: verdict, numbers, criteria, pictures and assumptions.

    Args:
        analysis: the result.
        texture: an expression of Python that makes the texture; see
            :func:`asperity.report.words.reproduction_words.reproduction`.
    """
    law, code = analysis.surface.law, "\n".join(reproduction(analysis, texture))
    return page.Page(
        title=f"Law {law.letter} on the {analysis.device.name}",
        answer=analysis.answer,
        facts=_facts(analysis),
        sections=[
            _numbers(analysis),
            page.Section("Three lines that reproduce q", [page.Words(code, "code")]),
            *_pictures(analysis, "gain", "top", "depth"),
            _criteria(analysis),
            page.Section("The worst loop", [page.pairs(leak_facts(analysis))]),
            *_pictures(analysis, "field"),
            _continuity(analysis),
            *_pictures(analysis, "jumps"),
            page.Section("On a straight scan", [page.pairs(merit_facts(analysis))]),
            *page.added_sections(Analysis, analysis),
            *page.assumed(analysis.assumptions, numbers_table(analysis.device, _USED)),
            page.Section("How to read it", [page.Definitions(glossary.ANALYSIS)]),
        ],
        footer=f"{page.PAPER}. {page.UNFELT}",
    )


def _facts(analysis: Analysis) -> list[tuple[str, str]]:
    surface = analysis.surface
    decisive = analysis.passivity.criterion(analysis.passivity.decided_by)
    return [
        ("Surface", str(surface.texture.describe()["kind"])),
        ("Peak to valley", engineering(surface.texture.peak_to_valley, "m")),
        ("Law", f"{surface.law.letter}, {law_title(surface.law.name)}"),
        ("Device", analysis.device.name),
        ("Stiffness", f"{surface.stiffness:g} N/m"),
        ("Pressed to", engineering(surface.max_depth, "m")),
        ("Characteristic number q", interval_text(analysis.q)),
        (f"Greatest stiffness by {decisive.name}", limit_text(decisive.limit)),
    ]


def _numbers(analysis: Analysis) -> page.Section:
    table = suprema_table(analysis, "lower is attained at")
    return page.Section("The numbers", [table], notes=notes(analysis))


def _criteria(analysis: Analysis) -> page.Section:
    judged = analysis.passivity
    return page.Section(
        f"Passive on the {analysis.device.name}?",
        [criteria_table(analysis.passivity)],
        caption=(
            f"Verdict: {judged.verdict}. It rests on: {judged.decided_by}. Stiffness: "
            f"{stiffness_text(analysis)}. T is the period of an "
            "update, σ₀ the least damping of the device, b_v virtual damping, d the whole samples "
            "of delay, K₀ the stiffest smooth wall that held on it, |δ| and |b| steps of position "
            "and force, f_c dry friction that surely acts."
        ),
    )


def _continuity(analysis: Analysis) -> page.Section:
    blocks: list[page.Block] = [page.Words(analysis.continuity.reason)]
    if analysis.continuity.jumps:
        blocks.append(_jumps_table(analysis, "near"))
    return page.Section("Continuity", blocks)


def _pictures(analysis: Analysis, *names: str) -> list[page.Section]:
    """Return the pictures of these names that the analysis has."""
    from asperity.report.pictures.analysis_pictures import analysis_figure, pictures_of

    return [
        page.pictured(
            title, analysis_figure(analysis, name), of_analysis(analysis, name), caption, level=3
        )
        for name, (title, caption) in ((name, _CAPTIONS[name]) for name in names)
        if name in pictures_of(analysis)
    ]


_CAPTIONS = {
    "field": (
        "The field and the worst loop",
        "Arrows: force on the probe. Colour: curl; the probe gains energy on a loop around one "
        "colour. White everywhere: conservative. Blue: the worst loop, turned as its arrows say, "
        "projected on the plane. The dashed line is the scan; what lies deeper than the working "
        "region is paled. A law with state is drawn sliding, its anchor trailing at full "
        "deflection; its worst loop may lie in a horizontal plane and is then seen from the side.",
    ),
    "gain": (
        "Where the loop gain is",
        "‖J‖/k in the vertical plane through the witness of q: by how much the law multiplies the "
        "stiffness of the smooth wall at each place. Computed on a grid, which meets thin ridges "
        "of the medial axis only here and there.",
    ),
    "top": (
        "The loop gain from above",
        "The greatest ‖J‖/k of five depths below each point, sampled on a grid: greater values "
        "may lie between. The bounds of q above are not sampled.",
    ),
    "depth": (
        "Singular values over depth",
        "Those of J/k on the way down to the witness of q; ‖J‖/k is the greatest. The lines are "
        "the bounds of q.",
    ),
    "jumps": (
        "How far the force jumps",
        "At each depth the difference of the force at two points on either side of the medial "
        "axis, closer together than 1e-9 of the texture.",
    ),
}
