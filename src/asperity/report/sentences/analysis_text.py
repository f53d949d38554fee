"""Results of the analysis of one law, limits and envelopes as sentences."""

from __future__ import annotations

import math

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.results import check_limits
from asperity.analysis.results.analyze import Analysis
from asperity.core.units import format_quantity
from asperity.envelopes.envelope import DeviceEnvelope
from asperity.envelopes.wave_borders import WaveBorders
from asperity.report.sentences import limit_sentences
from asperity.report.sentences.limit_sentences import speed_text
from asperity.report.sentences.number_text import INFINITY_SIGN, NOT_AVAILABLE
from asperity.report.sentences.texts import sentence, table_data


def computed_bounds(analysis: Analysis) -> list[tuple[str, Bound]]:
    """Return the numbers that were searched for, from which the others follow."""
    curl = [] if analysis.curl is None else [("|curl f|/k", analysis.curl)]
    return [("q", analysis.q), ("q⁺", analysis.one_sided), *curl]


def bound_notes(analysis: Analysis) -> list[str]:
    """Return how each number was obtained, and whether and why the law is conservative."""
    notes = [f"{name}: {bound.note}" for name, bound in computed_bounds(analysis) if bound.note]
    word = "yes" if analysis.conservative else "no"
    return [*notes, f"conservative: {word}, {analysis.conservative_reason}"]


def critical_speed_text(analysis: Analysis) -> str:
    """Return v* as text, with its meaning or the missing data."""
    speed = analysis.v_star
    if speed is None:
        if analysis.device.value("damping") is None:
            return "not decidable: needs damping"
        return "not known: no loop found that gains energy"
    if speed == 0.0:
        return "0 m/s: no energy to absorb"
    if math.isinf(speed):
        return "∞: a device without damping never absorbs the energy"
    datum = analysis.device.data["damping"]
    mark = "" if datum.verified else " (not verified)"
    return (
        f"{format_quantity(speed, 'm/s')}: below it, damping {datum.text}{mark} absorbs too little"
    )


def thrust_text(analysis: Analysis) -> str:
    """Return the mean thrust on a straight scan as text."""
    thrust = analysis.leak.thrust
    surface = analysis.surface
    if surface.law.stateful:
        return "not defined: friction resists in any case"
    if thrust is None:
        return "not stated: the line is not periodic"
    # Smaller values are rounding errors of forces up to stiffness times depth.
    is_zero = abs(thrust) <= 1e-12 * surface.stiffness * surface.max_depth
    return f"{'0 N' if is_zero else format_quantity(thrust, 'N')} on a straight scan"


def symbol_lines(result: check_limits.Limits) -> list[str]:
    """Return the symbols of the limits with their values."""
    device = result.device
    surface = result.surface
    values = []
    for symbol, field in table_data("symbols").items():
        if field in device.data:
            datum = device.data[field]
            text = f"1/({datum.text})" if field == "update_rate" else datum.text
            values.append(f"{symbol} = {text}{'' if datum.verified else ' (not verified)'}")
    q = INFINITY_SIGN if result.gain.value == float("inf") else f"{result.gain.value:.4g}"
    numbers = ", ".join(values) or "no data"
    speed = speed_text(result.speed)
    stiffness = limit_sentences.stiffness_text(result)
    return [
        sentence("symbols", speed=speed, limits=result, device=device.name, numbers=numbers),
        sentence("gain_symbol", law=surface.law.letter, stiffness=stiffness, limits=result, q=q),
    ]


def envelope_answer(one: DeviceEnvelope) -> str:
    """Return the law that renders most on a device, and whether it feels alive."""
    law = one.widest
    largest = max(one.laws, key=lambda other: other.decades)
    if not law.decades:
        return f"{one.device.name} renders no sinusoid with these laws."
    lengths = [border.wavelength for border in law.borders if border.decades]
    span = " to ".join([format_quantity(lengths[i], "m") for i in (0, -1)])
    text = f"{one.device.name} renders most with law {law.letter}, wavelengths from {span}"
    if largest is law:
        return f"{text}{'' if law.conservative else '; it feels alive'}."
    return f"{text}; law {largest.letter} renders more, but feels alive."


def amplitude_range_text(border: WaveBorders) -> str:
    """Return the rendered amplitudes at a wavelength for reading."""
    if math.isnan(border.felt_from):
        return NOT_AVAILABLE
    low = format_quantity(border.felt_from, "m", digits=2)
    if math.isinf(border.felt_up_to):
        return f"from {low}"
    return f"{low} – {format_quantity(border.felt_up_to, 'm', digits=2)}"
