"""What an analysis says, in words: its numbers, criteria, worst loop, jumps and scan."""

from __future__ import annotations

import math

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.report.words.number_words import (
    in_one_unit,
    merit_text,
    place_text,
    span_text,
)
from asperity.units import engineering


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
    facts = [("energy", f"{span_text(leak.energy, leak.upper, 'J')} per turn ({leak.method})")]
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
