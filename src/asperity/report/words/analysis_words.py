"""Numbers of an analysis as words, the same in the terminal, on the page and in pictures."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

import numpy as np

from asperity.analysis.analyze import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.criteria import Criterion
from asperity.laws import LAW_ARGUMENTS, LAWS
from asperity.report.words.number_words import INFINITE, SAMPLED, merit_text
from asperity.surface import Surface
from asperity.units import engineering, rounded_down

_PREFIXES = {"": 1.0, "m": 1e3, "µ": 1e6, "n": 1e9, "p": 1e12, "k": 1e-3, "M": 1e-6}
# How near to the onset of the medial axis q is shown to grow, as a part of the way to the surface.
_NEAR = 1e-6
CURL_DENSITY = "|curl f| [N/m]"
_UNBOUNDED = "grows without bound towards the onset"


def down_text(value: float, digits: int = 6) -> str:
    """Return a number with so many digits that is never above it: a lower bound stays one.

    Example:
        >>> down_text(31.58279), down_text(0.9999999999999997), down_text(float("inf"))
        ('31.5827', '1', '∞')
    """
    return _outward(value, digits, ROUND_FLOOR)


def up_text(value: float, digits: int = 6) -> str:
    """Return a number with so many digits that is never below it: an upper bound stays one.

    Example:
        >>> up_text(31.58271), up_text(1.0), up_text(8.0464e-4, 3)
        ('31.5828', '1', '0.000805')
    """
    return _outward(value, digits, ROUND_CEILING)


def _outward(value: float, digits: int, rounding: str) -> str:
    if math.isinf(value):
        return INFINITE if value > 0.0 else f"−{INFINITE}"
    # Thirteen digits first: the rounding of a double is no reason to move a bound by a digit.
    plain = Decimal(f"{value:.12e}")
    rounded = Context(prec=digits, rounding=rounding).create_decimal(plain)
    text = f"{rounded:f}" if 1e-5 <= abs(value) < 1e7 or value == 0.0 else f"{rounded:e}"
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text.lower() else text


def interval_text(bound: Bound) -> str:
    """Return a number with both its ends, rounded outwards.

    Example:
        >>> interval_text(Bound(5.12503, 5.12511, "certified"))
        '5.12503 to 5.12511'
        >>> interval_text(Bound(1, 1, "theorem")), interval_text(Bound(2.0, math.inf, "sampled"))
        ('1', '~2')
    """
    low, high = down_text(bound.lower), up_text(bound.upper)
    if low == high:
        return low
    if math.isinf(bound.upper):
        return f"{SAMPLED}{low}"
    return f"{low} to {high}"


def span_text(low: float, high: float, unit: str, digits: int = 5) -> str:
    """Return a quantity between two bounds, in one unit, rounded outwards.

    Example:
        >>> span_text(8.0464e-4, 8.0493e-4, "J"), span_text(0.0, 0.0, "J")
        ('0.80464 to 0.80493 mJ', '0 J')
        >>> span_text(4.9116e-3, math.inf, "J")
        'at least 4.9116 mJ'
    """
    known = high if math.isfinite(high) else low
    if known == 0.0:
        return f"0 {unit}"
    name = engineering(known, unit).split()[1]
    scale = _PREFIXES.get(name.removesuffix(unit), 1.0)
    lower, upper = down_text(low * scale, digits), up_text(high * scale, digits)
    if math.isinf(high):
        return f"at least {lower} {name}"
    return f"{lower} {name}" if lower == upper else f"{lower} to {upper} {name}"


def place_text(at: tuple[float, float, float] | None) -> str:
    """Return a position in one unit.

    Example:
        >>> place_text((-0.25e-3, -0.0, -1.8e-3)), place_text(None)
        ('(-0.25, 0, -1.8) mm', '–')
    """
    if at is None:
        return "–"
    largest = max(abs(value) for value in at)
    unit, scale = ("mm", 1e3) if largest >= 1e-4 else ("µm", 1e6)
    return f"({', '.join(f'{value * scale + 0.0:.6g}' for value in at)}) {unit}"


def witness_text(bound: Bound) -> str:
    """Return where the lower end is attained, with the state of an anchor; or the onset of ∞.

    Example:
        >>> witness_text(Bound(math.inf, math.inf, "certified", (0.0, 0.0, 1e-3)))
        'onset (0, 0, 1) mm'
    """
    onset = "onset " if math.isinf(bound.lower) and bound.at is not None else ""
    state = state_text(bound)
    return f"{onset}{place_text(bound.at)}{', ' if state else ''}{state}"


def state_text(bound: Bound) -> str:
    """Return the state of an anchor at a witness; empty for a law without state."""
    if bound.deflection is None:
        return ""
    x, y = (f"{1e3 * part + 0.0:.6g}" for part in bound.deflection)
    return f"deflection ({x}, {y}) mm, {'sliding' if bound.sliding else 'sticking'}"


def numbers(analysis: Analysis) -> list[tuple[str, Bound]]:
    """Return the numbers of an analysis with their symbols."""
    found = [("q", analysis.q), ("q⁺", analysis.one_sided)]
    density = analysis.curl_density
    if analysis.curl is not None:
        found.append(("|curl f|/k", analysis.curl))
    if density is not None and density.upper > 0.0:
        found.append((CURL_DENSITY, density))
    return found


def holds_text(criterion: Criterion) -> str:
    """Return yes, no, or ? for what cannot be decided."""
    return "?" if criterion.holds is None else "yes" if criterion.holds else "no"


def limit_text(criterion: Criterion) -> str:
    """Return the greatest stiffness that a criterion allows, rounded down."""
    if criterion.limit is None:
        return "–"
    if math.isinf(criterion.limit):
        return INFINITE
    return f"{rounded_down(criterion.limit):.10g} N/m"


def margin_text(criterion: Criterion) -> str:
    """Return the limit over the stiffness, rounded down."""
    return "–" if criterion.margin is None else down_text(criterion.margin, 3)


def open_criteria(analysis: Analysis) -> list[tuple[str, str]]:
    """Return what is said of the criteria that decide nothing, those of one answer together."""
    said: dict[str, list[str]] = {}
    for criterion in analysis.passivity.criteria:
        if criterion.holds is None:
            said.setdefault(criterion.says, []).append(criterion.name)
    return [("; ".join(names), says) for says, names in said.items()]


def notes(analysis: Analysis) -> list[str]:
    """Return how each number came about, and whether and why the law is conservative."""
    said = [
        f"{name}: {bound.note}"
        for name, bound in numbers(analysis)
        if bound.note and name != CURL_DENSITY
    ]
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
    if not jumps:
        return []
    depths = _scaled([jump.depth for jump in jumps], "m")
    sizes = _scaled([jump.size for jump in jumps], "N")
    places = [place_text(jump.before) for jump in jumps]
    return list(zip(depths, sizes, places, strict=True))


def _scaled(values: list[float], unit: str) -> list[str]:
    """Return quantities in the unit of the largest."""
    name = engineering(max(values), unit).split()[1]
    scale = _PREFIXES[name.removesuffix(unit)]
    return [f"{float(f'{value * scale:.3g}'):.10g} {name}" for value in values]


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


# --- three lines of Python ------------------------------------------------------------------------


def reproduction(analysis: Analysis, texture: str = "") -> list[str]:
    """Return three lines of Python that evaluate ‖J‖/k where it attains q.

    Where q is infinite they evaluate it just above the onset, where it is large.

    Args:
        analysis: the result.
        texture: an expression that makes the texture; by default its ``repr`` if that is one.
    """
    surface = analysis.surface
    lines = ["import asperity as asp, numpy as np"]
    if "load_scene(" in texture:
        lines[0] += "; from asperity.scene import load_scene"
    lines.append(f"s = asp.Surface({_texture_code(surface, texture)}, {_arguments(surface)})")
    found = _evaluated(analysis)
    if found is None:
        said = interval_text(analysis.q)
        return [*lines, f"print(asp.characteristic_number(s))  # {said}, {analysis.q.method}"]
    point, value, words = found
    given = f"[{[float(v) for v in point]}]"
    if analysis.q.deflection is not None:
        held = list(analysis.q.deflection)
        given += f", [{held}], np.array([{analysis.q.sliding}])"
    call = f"np.linalg.norm(s.jacobian({given})[0], 2) / s.stiffness"
    return [*lines, f"print({call})  # {value:.12g}{words}"]


def _evaluated(analysis: Analysis) -> tuple[np.ndarray, float, str] | None:
    """Return where to evaluate, what comes out, and what to say of it."""
    surface, q = analysis.surface, analysis.q
    if q.at is None:
        return None
    at, words = np.array(q.at), ""
    if math.isinf(q.lower):
        foot = surface.texture.nearest(at[None])[0]
        at, words = at + _NEAR * (foot - at), f": {_UNBOUNDED}"
    state = () if q.deflection is None else (np.array([q.deflection]), np.array([q.sliding]))
    jacobian = surface.jacobian(at[None], *state)[0]
    return at, float(np.linalg.norm(jacobian, 2)) / surface.stiffness, words


def _texture_code(surface: Surface, texture: str) -> str:
    if texture:
        return texture
    written = repr(surface.texture)
    return "texture" if written.startswith("<") else f"asp.{written}"


def _arguments(surface: Surface) -> str:
    law = surface.law
    shipped = LAWS.get(law.letter) is law
    parts = [repr(law.letter) if shipped else "law"]
    parts += [f"stiffness={surface.stiffness!r}", f"max_depth={surface.max_depth!r}"]
    own = {name: v for name, v in surface.law_parameters.items() if v != law.parameters[name]}
    parts += [f"{name}={v!r}" for name, v in own.items() if name in LAW_ARGUMENTS]
    rest = {name: v for name, v in own.items() if name not in LAW_ARGUMENTS}
    if rest:
        parts.append(f"law_parameters={rest!r}")
    if surface.clamp != "none":
        parts.append(f"clamp={surface.clamp!r}")
    return ", ".join(parts)
