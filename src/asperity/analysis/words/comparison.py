"""From numbers to words: one line per law, a recommendation, and what was assumed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from asperity.analysis.passivity.criteria import evenly
from asperity.analysis.recommendation import Recommendation, felt_force
from asperity.analysis.row import LawRow
from asperity.analysis.words.passivity import allowed_text, buzz_text, newtons
from asperity.analysis.words.surface import default_depth, law_parameters, most_gained
from asperity.devices import Device
from asperity.surface import Surface
from asperity.units import engineering


def verdict(row: LawRow) -> str:
    """Return what will go wrong with a law, in one line."""
    k, parts = f"{row.surface.stiffness:g} N/m", []
    if row.passivity.verdict == "not passive" and not row.leaks:
        parts.append(f"not passive at {k}; {_up_to(row)}")
    elif row.buzzes:
        parts.append(f"may buzz at {k}; {_up_to(row)}")
    elif not row.leaks:
        parts.append(_of_passivity(row, k))
    if row.leaks:
        quiet = "" if row.buzzes else f"; {_up_to(row)}"
        parts.append(f"feels alive: gains up to {most_gained(row.leak)}{quiet}")
    if row.jumps:
        parts.append("clicks: " + row.continuous_reason)
    if row.textureless:
        parts.append("no texture")
    if row.loses_contact:
        parts.append(f"no contact on {100.0 * row.contact_lost:.0f} % of the scan")
    return "; ".join(parts)


def _up_to(row: LawRow) -> str:
    return allowed_text(row.allowed, row.passivity.critical_speed)


def _of_passivity(row: LawRow, stiffness: str) -> str:
    """Return what is known of a law without curl at the stiffness asked for."""
    judged = row.passivity
    if judged.verdict == "bounded" and judged.buzz is not None:
        return f"passive at {stiffness} but for steps: {buzz_text(judged.buzz)}"
    if judged.verdict == "plausible":
        return _up_to(row)
    return f"{judged.verdict} at {stiffness}"


def recommendation(found: Recommendation, device: Device) -> str:
    """Return which law to use, and why."""
    best = found.row
    if best is None:
        return _none(found, device)
    name = best.law.name.replace("-", " ")
    limit = newtons(best.safe_stiffness)
    head = f"Use law {best.law.letter} ({name}) at up to {limit} on the {device.name}"
    why = _sound_reason(best) if found.sound else _least_leak_reason(best, found)
    tail = _price(best, found.felt) + _saturation(best, device)
    return f"{head}, {_worth(best, device)}: {why}.{tail}"


def _none(found: Recommendation, device: Device) -> str:
    """Return why no law is recommended."""
    if all(row.textureless for row in found.rows):
        return "None of the laws compared renders a texture on this surface."
    return (
        f"Of none of the laws compared a stiffness is known that does on the {device.name}: they "
        "need a known delay, or have no bound at this depth."
    )


def _worth(row: LawRow, device: Device) -> str:
    """Return what the stiffness that is allowed is worth, in a clause."""
    if row.allowed.basis == "proved":
        return "proved passive"
    if row.allowed.basis == "bounded":
        return "passive there but for the steps of positions and forces, whose buzz has a bound"
    if row.allowed.basis == "quiet against buzz":
        return "quiet against buzz there, though it feeds the hand below v*"
    test = device.wall_test
    held = test is not None and test.pedigree == "measured"
    why = "a smooth wall of that gain held" if held else "no stiffer wall is known to work"
    proof = (
        f"proved up to {newtons(row.allowed.proved)} only" if row.allowed.proved else "not proved"
    )
    return f"plausible, {proof} ({why})"


def _sound_reason(best: LawRow) -> str:
    force = engineering(best.texture_force, "N")
    return (
        "no closed path of its field gives net energy and its force does not jump; "
        f"it still gives {force} RMS of texture"
    )


def _least_leak_reason(best: LawRow, found: Recommendation) -> str:
    force = engineering(best.texture_force, "N")
    gain = engineering(best.safe_leak, "J")
    faint = [row for row in found.textured if not (row.leaks or row.jumps)]
    if faint:
        weak = max(faint, key=lambda row: row.texture_force)
        why_not = (
            f"law {weak.law.letter}, conservative and continuous, gives only "
            f"{engineering(weak.texture_force, 'N')} RMS at its {newtons(weak.safe_stiffness)}, "
            f"below the {engineering(found.threshold, 'N')} that can be felt"
        )
    else:
        why_not = "none of the laws compared is conservative and continuous"
    return (
        f"{why_not}; of the continuous laws this one leaks least for its texture force "
        f"({force} RMS, up to {gain} per loop, so it can feel alive)"
    )


def _price(best: LawRow, textured: Sequence[LawRow]) -> str:
    """Return what the recommended law gives up against the others."""
    stiffer = [row for row in textured if row.safe_stiffness > 1.5 * best.safe_stiffness]
    if not stiffer:
        return ""
    rival = max(stiffer, key=lambda row: row.safe_stiffness)
    trouble = []
    if rival.leaks:
        trouble.append(f"gains up to {engineering(rival.safe_leak, 'J')} per loop there")
    if rival.jumps:
        trouble.append("its force jumps")
    return (
        f" The price is stiffness: law {rival.law.letter} can be rendered at "
        f"{newtons(rival.safe_stiffness)}, but {' and '.join(trouble) or 'has less texture'}."
    )


def _saturation(best: LawRow, device: Device) -> str:
    """Return a warning if pressing to the full depth asks for more force than there is."""
    limit = device.value("max_force")
    pressed = best.safe_stiffness * best.surface.max_depth
    if limit is None or pressed <= limit:
        return ""
    return (
        f" Pressed to {engineering(best.surface.max_depth, 'm')} it asks for "
        f"{engineering(pressed, 'N')}; the device gives {engineering(limit, 'N')}."
    )


def assumptions(
    rows: Sequence[LawRow], device: Device, defaults: Mapping[str, bool]
) -> tuple[str, ...]:
    """Return what was assumed, in sentences.

    Args:
        rows: the laws compared.
        device: the device.
        defaults: whether stiffness and max_depth are defaults.
    """
    first = rows[0].surface
    result = [*first.texture.preparation]
    result += _defaulted(rows, defaults)
    result += _of_the_wall(rows, device)
    unverified = [
        field.replace("_", " ") for field, d in device.data.items()
        if not d.verified and field != "max_stiffness"
    ]  # fmt: skip
    if unverified:
        result.append(f"Not verified for the {device.name}: {', '.join(unverified)}")
    source = f"the force resolution of the {device.name}"
    if device.value("force_resolution") is None:
        source = "a default, the device's force resolution being unknown"
    force = engineering(felt_force(device), "N")
    result.append(f"Texture below {force} RMS counts as not felt: {source}")
    if any(row.q.method == "sampled" or row.one_sided.method == "sampled" for row in rows):
        region = first.texture.domain.description
        result.append(
            f"Numbers marked sampled are the greatest found over {region} and depths to "
            f"{engineering(first.max_depth, 'm')}, not bounds"
        )
    result.append(
        "The leak is a field's work on one slow turn of its worst loop; delay, quantisation and "
        "friction of the device are not in it"
    )
    result.append("What is said is of energy and forces; no person was asked what they feel")
    return tuple(result)


def _of_the_wall(rows: Sequence[LawRow], device: Device) -> list[str]:
    """Return where K₀ comes from, and what taking it for a limit assumes."""
    test = device.wall_test
    if test is None:
        return []
    said = [f"K₀ = {test.value:g} N/m for the {device.name} ({test.pedigree}): {test.source}"]
    if any(row.allowed.basis == "plausible" for row in rows):
        said.append(
            "Plausible, not proved: a wall of K₀ was about to cycle, as with a heavy handle in a "
            f"loose grip, and {evenly(test)}"
        )
    return said


def _defaulted(rows: Sequence[LawRow], defaults: Mapping[str, bool]) -> list[str]:
    first: Surface = rows[0].surface
    result = []
    if defaults["stiffness"]:
        result.append(f"Default stiffness {first.stiffness:g} N/m")
    if defaults["max_depth"]:
        result.append(default_depth(first))
    for row in rows:
        said = law_parameters(row.surface)
        result += [f"{parameter} for law {row.law.letter}" for parameter in said]
    return result
