"""From numbers to words: one line per law, a recommendation, and what was assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from asperity.analysis.limits.felt import (
    CLEARLY,
    DEFAULT_SAMPLES,
    DEFAULT_SPEED,
    NOTICED,
    Felt,
)
from asperity.analysis.passivity.criteria import evenly
from asperity.analysis.recommendation import Recommendation
from asperity.analysis.row import LawRow
from asperity.analysis.words.felt import (
    amount,
    cures_text,
    form_removed,
    hidden_by,
    millinewtons,
    speed_text,
)
from asperity.analysis.words.passivity import allowed_text, buzz_text, newtons
from asperity.analysis.words.surface import default_depth, law_parameters, most_gained
from asperity.devices import Device
from asperity.surface import Surface
from asperity.textures.texture import TexturePart
from asperity.units import engineering


def verdict(row: LawRow) -> str:
    """Return what will go wrong with a law, in one line."""
    k, parts = newtons(row.surface.stiffness), []
    if row.passivity.verdict == "not passive" and not row.leaks:
        parts.append(f"not passive at {k}; {_up_to(row)}")
    elif not row.start:
        parts.append(_up_to(row))
    elif row.buzzes:
        parts.append(f"may buzz at {k}; {_up_to(row)}")
    elif not row.leaks:
        parts.append(_of_passivity(row, k))
    if row.leaks:
        quiet = f"; {_up_to(row)}" if row.start and not row.buzzes else ""
        parts.append(f"feels alive: gains up to {most_gained(row.leak)}{quiet}")
    if row.jumps:
        parts.append("clicks: " + row.continuous_reason)
    if row.textureless:
        parts.append("no texture")
    elif row.felt is not None and row.tier != "felt":
        parts.append(f"{row.tier}: {amount(row.felt)}")
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
    """Return which law to use and where to begin, whether it is felt, and why."""
    best = found.row
    if best is None or best.felt is None:
        return _none(found, device)
    said = [
        f"Use law {_titled(best)} on the {device.name} and start at {newtons(best.start)}: "
        f"{_felt(best, device)}.",
        "" if best.tier == "felt" else cures_text(best.felt),
        _of_the_form(best.felt),
        _contact(best),
        _sound_reason() if found.sound else _least_leak_reason(best, found),
        _worth(best, device),
        _price(best, found.textured),
        _saturation(best, device),
    ]
    return " ".join(part for part in said if part)


def _titled(row: LawRow) -> str:
    return f"{row.law.letter} ({row.law.name.replace('-', ' ')})"


def _felt(row: LawRow, device: Device) -> str:
    """Return whether the texture is felt, in a clause."""
    assert row.felt is not None
    if row.tier == "felt":
        return f"felt, {amount(row.felt)}"
    return f"{row.tier}, {amount(row.felt)}; {hidden_by(row.felt, device)}"


def _of_the_form(felt: Felt) -> str:
    """Return what to do about form and waviness, where they make most of the force."""
    if not felt.mostly_form:
        return ""
    return "Most of it is form and waviness, felt as a shape: --form 2 and --l-cutoff remove it."


def _contact(row: LawRow) -> str:
    if not row.loses_contact:
        return ""
    depth = engineering(row.surface.max_depth, "m")
    return f"Pressed to {depth} it loses contact on {100.0 * row.contact_lost:.0f} % of the scan."


def _none(found: Recommendation, device: Device) -> str:
    """Return why no law is recommended."""
    if all(row.textureless for row in found.rows):
        return "None of the laws compared renders a texture on this surface."
    row = found.nearest
    if row is None or row.felt is None:
        return (
            f"Of none of the laws compared a stiffness is known that does on the {device.name}: "
            "they need a known delay, or have no bound at this depth."
        )
    return (
        f"Nothing of this texture will be felt on the {device.name}: law {_titled(row)}, which "
        f"comes nearest, gives at {newtons(row.start)} {amount(row.felt)}; "
        f"{hidden_by(row.felt, device)}. {cures_text(row.felt)} {_of_the_form(row.felt)}".rstrip()
    )


def _worth(row: LawRow, device: Device) -> str:
    """Return what the stiffness to begin with is worth, in a sentence."""
    allowed, limit = row.allowed, newtons(row.safe_stiffness)
    if allowed.basis == "proved":
        delay = device.value("delay_samples") or 0.0
        most = row.passivity.greatest_delay
        reach = f"{delay:.0f}" if most is None or most < delay else f"up to {most}"
        return f"It is proved passive up to {limit}, at the start with {reach} samples of delay."
    if allowed.basis == "bounded":
        buzz = row.passivity.buzz
        most_text = "" if buzz is None else f": {buzz_text(buzz)}"
        return f"It is passive there but for the steps of positions and forces{most_text}."
    if allowed.basis == "quiet against buzz":
        v = row.passivity.critical_speed
        speed = "v*" if v is None else f"v* = {engineering(v, 'm/s')}"
        return f"Quiet against buzz up to {limit}, it feeds the hand below {speed}; {_share(row)}."
    proof = f", of which {newtons(allowed.proved)} is proved" if allowed.proved else ""
    plausible = f"so {limit} is plausible{_delays(row)}{proof}"
    return f"Not proved: {_wall(device)}, {plausible}; {_share(row)}."


def _wall(device: Device) -> str:
    test = device.wall_test
    if test is not None and test.pedigree == "measured":
        return f"a smooth wall of {newtons(test.value)} held"
    most = "" if test is None else f" than {newtons(test.value)}"
    return f"no wall stiffer{most} is known to work"


def _delays(row: LawRow) -> str:
    delay = row.allowed.delay
    if delay is None:
        return ""
    if math.isinf(delay):
        return " with any delay"
    return f" with a delay up to {delay:.3g} samples"


def _share(row: LawRow) -> str:
    """Return how far below the limit to begin, and why."""
    share = row.margin
    if not share.cases:
        return "begin there"
    if share.factor == 1.0:
        return f"it held up to there in all {share.cases} simulated loops"
    return (
        f"begin at {share.factor:g} of it, where law {share.law} still held in all {share.cases} "
        "simulated loops"
    )


def _sound_reason() -> str:
    return "No closed path of its field gives net energy, and its force does not jump."


def _least_leak_reason(best: LawRow, found: Recommendation) -> str:
    gain = engineering(best.start_leak, "J")
    faint = [row for row in found.textured if not (row.leaks or row.jumps)]
    if faint:
        weak = max(faint, key=lambda row: row.shown_force)
        why_not = (
            f"Law {weak.law.letter}, conservative and continuous, gives only "
            f"{millinewtons(weak.shown_force)} RMS at its {newtons(weak.start)}, which is not felt"
        )
    else:
        why_not = "None of the laws compared is conservative, continuous and known to work here"
    return (
        f"{why_not}; of the continuous laws this one leaks least for its texture force, "
        f"up to {gain} per loop, so it can feel alive."
    )


def _price(best: LawRow, textured: Sequence[LawRow]) -> str:
    """Return what the recommended law gives up against the others."""
    stiffer = [row for row in textured if row.start > 1.5 * best.start]
    if not stiffer:
        return ""
    rival = max(stiffer, key=lambda row: row.start)
    trouble = []
    if rival.leaks:
        trouble.append(f"gains up to {engineering(rival.start_leak, 'J')} per loop there")
    if rival.jumps:
        trouble.append("its force jumps")
    return (
        f"The price is stiffness: law {rival.law.letter} can start at "
        f"{newtons(rival.start)}, but {' and '.join(trouble) or 'has less texture'}."
    )


def _saturation(best: LawRow, device: Device) -> str:
    """Return a warning if pressing to the full depth asks for more force than there is."""
    limit = device.value("max_force")
    pressed = best.start * best.surface.max_depth
    if limit is None or pressed <= limit:
        return ""
    return (
        f"Pressed to {engineering(best.surface.max_depth, 'm')} it asks for "
        f"{engineering(pressed, 'N')}; the device gives {engineering(limit, 'N')}."
    )


def assumptions(
    rows: Sequence[LawRow], part: TexturePart, device: Device, defaults: Mapping[str, bool]
) -> tuple[str, ...]:
    """Return what was assumed, in sentences.

    Args:
        rows: the laws compared.
        part: what of the surface is texture.
        device: the device.
        defaults: whether max_depth and speed are defaults.
    """
    first = rows[0].surface
    felt = next((row.felt for row in rows if row.felt is not None), None)
    result = [*first.texture.preparation]
    result += _defaulted(rows, defaults)
    result += form_removed(felt, part.form, part.waviness)
    result += _of_the_wall(rows, device)
    result += _of_the_margin(rows)
    unverified = [
        field.replace("_", " ") for field, d in device.data.items()
        if not d.verified and field != "max_stiffness"
    ]  # fmt: skip
    if unverified:
        result.append(f"Not verified for the {device.name}: {', '.join(unverified)}")
    if felt is not None:
        result.append(_of_feeling(felt))
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


def _of_feeling(felt: Felt) -> str:
    unknown = ", ".join(field.replace("_", " ") for field in felt.unknown)
    return (
        f"Felt: an amplitude of {CLEARLY:g} times the {millinewtons(NOTICED)} that a hand is taken "
        f"to notice and {CLEARLY:g} times the dry friction, of {DEFAULT_SAMPLES:g} steps of force, "
        f"in waves that the device resolves at {speed_text(felt.speed)}"
        + (f"; taken as if it hid nothing, being unknown: {unknown}" if unknown else "")
    )


def _of_the_margin(rows: Sequence[LawRow]) -> list[str]:
    """Return what the share of the limit rests on at which to begin."""
    shares = [row.margin for row in rows if row.margin.cases]
    if not shares:
        return []
    told = ", ".join(f"{one.law} {one.factor:g}" for one in shares if one.factor < 1.0)
    return [
        f"Starts are below the limit by what simulation found ({told or 'no law below it'}): "
        "pantograph and a mass in space, brakes of the paper, two hands, delays of 0 to 6 samples, "
        "three sinusoids; a device of another build may need less"
    ]


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
    if defaults["speed"]:
        result.append(f"Default scanning speed {speed_text(DEFAULT_SPEED)}")
    if defaults["max_depth"]:
        result.append(default_depth(first))
    for row in rows:
        said = law_parameters(row.surface)
        result += [f"{parameter} for law {row.law.letter}" for parameter in said]
    return result
