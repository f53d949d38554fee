"""From numbers to words: one line per law, a recommendation, and what was assumed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from asperity.analysis.recommendation import Recommendation, felt_force
from asperity.analysis.row import LawRow
from asperity.analysis.words.passivity import newtons
from asperity.analysis.words.surface import default_depth, law_parameters, most_gained
from asperity.devices import Device
from asperity.surface import Surface
from asperity.units import engineering


def verdict(row: LawRow) -> str:
    """Return what will go wrong with a law, in one line."""
    k, parts = row.surface.stiffness, []
    if row.buzzes:
        parts.append(f"may buzz: {k:g} N/m is above its {newtons(row.safe_stiffness)}")
    if row.leaks:
        parts.append(f"feels alive: gains up to {most_gained(row.leak)}")
    if row.jumps:
        parts.append("clicks: " + row.continuous_reason)
    if row.textureless:
        parts.append("no texture")
    if not parts:
        parts.append(f"sound at {k:g} N/m: below its limit, conservative, continuous")
    if row.loses_contact:
        parts.append(f"no contact on {100.0 * row.contact_lost:.0f} % of the scan")
    return "; ".join(parts)


def recommendation(found: Recommendation, device: Device) -> str:
    """Return which law to use, and why."""
    best = found.row
    if best is None:
        return "None of the laws compared renders a texture on this surface."
    name = best.law.name.replace("-", " ")
    limit = newtons(best.safe_stiffness)
    head = f"Use law {best.law.letter} ({name}) at up to {limit} on the {device.name}"
    why = _sound_reason(best) if found.sound else _least_leak_reason(best, found)
    tail = _price(best, found.felt) + _saturation(best, device)
    return f"{head}: {why}.{tail}"


def _sound_reason(best: LawRow) -> str:
    force = engineering(best.texture_force, "N")
    return (
        "its field is conservative and continuous, so it can neither feel alive nor click, "
        f"and at that stiffness it still gives {force} RMS of texture"
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
    datum = device.data["max_stiffness"]
    mark = "" if datum.verified else " (not verified)"
    result.append(f"K₀ = {datum.value:g} N/m for the {device.name}{mark}: {datum.source}")
    if any(row.conservative for row in rows):
        result.append(
            "K₀/q⁺ is proved for a loop without delay beyond the hold; K₀/q for every delay, if "
            "the law is conservative"
        )
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
    return tuple(result)


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
