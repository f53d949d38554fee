"""From the six limits to words: the answer, and what was assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.words.felt import amount, cures_text, hidden_by, speed_text
from asperity.analysis.words.passivity import allowed_text
from asperity.analysis.words.surface import default_depth, law_parameters, unverified
from asperity.units import engineering, rounded_down


def answer(result: Limits) -> str:
    """Return whether the texture is felt as it is, in a few sentences."""
    if not result.waves:
        return "The surface is flat: there is no texture to feel."
    speed = speed_text(result.speed)
    failing = [limit for limit in result.limits if limit.holds is False]
    open_ones = [limit for limit in result.limits if limit.holds is None]
    if failing:
        text = f"{_part(result, failing)} at {speed}: "
        text += f"{'; '.join(_failure(limit) for limit in failing)}.{_slower(result, failing)}"
    elif len(open_ones) == len(result.limits):
        text = "Nothing can be decided."
    elif open_ones:
        holding = [limit for limit in result.limits if limit.holds]
        verb = "hold" if len(holding) > 1 else "holds"
        text = f"As far as can be decided: {_numbers(holding)} {verb} at {speed}."
    else:
        text = f"Yes: all six limits hold at {speed}."
    if open_ones:
        missing = dict.fromkeys(need for limit in open_ones for need in limit.needs)
        text += f" Not decidable: {_numbers(open_ones)}, for want of {_joined(list(missing))}."
    return f"{text} {force_words(result)}"


def speeds_text(speeds: tuple[float, float] | None) -> str:
    """Return an interval of speeds for reading, its end rounded down.

    Example:
        >>> speeds_text((0.0, 0.4)), speeds_text((0.0, math.inf)), speeds_text((0.0, 0.0))
        ('below 0.4 m/s', 'all', 'none')
    """
    if speeds is None:
        return "–"
    if math.isinf(speeds[1]):
        return "all"
    if speeds[1] == 0.0:
        return "none"
    return f"below {speed_text(rounded_down(speeds[1]))}"


def _part(result: Limits, failing: Sequence[Limit]) -> str:
    """Return how much of the texture meets the limits that can be decided."""
    if any(limit.share is None for limit in failing) or result.share == 0.0:
        return "Not as it is"
    return f"Not all of it, only waves with {percent(result.share)} of the height variance,"


def _failure(limit: Limit) -> str:
    """Return what a limit that fails says, with the wave that breaks it most."""
    left, right = (
        engineering(side, limit.unit) if side is not None else "–"
        for side in (limit.left, limit.right)
    )
    return f"limit {limit.number} ({limit.name}) fails, {left} against {right}"


def _slower(result: Limits, failing: Sequence[Limit]) -> str:
    """Return at which speed all would hold, if a slower scan mends it."""
    top = result.speeds[1]
    if top == 0.0:
        at_none = [limit for limit in failing if limit.speeds and limit.speeds[1] == 0.0]
        return f" No speed mends {_numbers(at_none)}."
    return f" {speeds_text(result.speeds).capitalize()} they hold."


def force_words(result: Limits) -> str:
    """Return whether the texture's force is felt, and what would help."""
    felt, k = result.felt, stiffness_text(result)
    text = f"At {k} law {result.surface.law.letter} gives {amount(felt)}: {felt.tier}"
    if felt.tier == "felt":
        return f"{text}."
    return f"{text}; {hidden_by(felt, result.device)}. {cures_text(felt)}".rstrip()


def stiffness_text(result: Limits) -> str:
    """Return the stiffness of the force for reading, rounded down: a limit stays one."""
    return engineering(rounded_down(result.surface.stiffness), "N/m")


def percent(share: float) -> str:
    """Return a share for reading; what is nearly none or nearly all is not rounded to that.

    Example:
        >>> percent(0.5), percent(1e-5), percent(0.9999), percent(1.0)
        ('50 %', '< 0.1 %', '> 99.9 %', '100 %')
    """
    if 0.0 < share < 1e-3:
        return "< 0.1 %"
    if 0.999 < share < 1.0 - 1e-12:
        return "> 99.9 %"
    return f"{100.0 * share:.3g} %"


def _newton(force: float) -> str:
    return engineering(force, "N", digits=2)


def _numbers(some: Sequence[Limit]) -> str:
    word = "limit" if len(some) == 1 else "limits"
    return f"{word} {_joined([str(limit.number) for limit in some])}"


def _joined(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]])) if words else "none"


def assumptions(
    result: Limits, defaults: Mapping[str, bool], contact_lost: float
) -> tuple[str, ...]:
    """Return what was assumed, in sentences.

    Args:
        result: the limits.
        defaults: whether speed, stiffness, max_depth and samples are defaults.
        contact_lost: fraction of the scan without contact.
    """
    surface = result.surface
    said = [*surface.texture.preparation, *_defaulted(result, defaults)]
    said.append(f"Waves: {result.spectrum.description}")
    left_out = len(result.spectrum.waves) - len(result.waves)
    if left_out:
        said.append(
            f"{left_out} bands with less than 0.1 % of the variance of height and of force are "
            "left out of the limits"
        )
    depth = engineering(surface.max_depth, "m")
    said.append(f"Forces are those of a scan at constant height, pressed to {depth}")
    if contact_lost > 0.0:
        said.append(f"No contact on {percent(contact_lost)} of that scan")
    if result.gain.method == "sampled":
        said.append(f"{result.gain_symbol} = {result.gain.value:.4g} is sampled, not proved")
    used = [*dict.fromkeys(limit.uses for limit in result.limits), "friction"]
    said += unverified(result.device, used)
    said.append(
        "The limits are necessary, not sufficient; they say nothing of perception: no test with "
        "people stands behind them"
    )
    return tuple(said)


def _defaulted(result: Limits, defaults: Mapping[str, bool]) -> list[str]:
    said = []
    if defaults["speed"]:
        said.append(f"Default speed {speed_text(result.speed)}")
    if defaults["samples"]:
        counts = (result.time_samples, result.position_samples, result.force_steps)
        shown = ", ".join(f"{name} = {n:g}" for name, n in zip("αβγ", counts, strict=True))
        said.append(f"Samples in a wave: {shown}; the paper says 5 to 10")
    if defaults["stiffness"]:
        share, why = result.margin.factor, allowed_text(result.allowed)
        default = "" if result.safe_stiffness else ", a default"
        part = f"{share:g} of what is " if result.safe_stiffness and share < 1.0 else ""
        said.append(f"Stiffness {stiffness_text(result)}{default}: {part}{why}")
    if defaults["max_depth"]:
        said.append(default_depth(result.surface))
    return said + law_parameters(result.surface)
