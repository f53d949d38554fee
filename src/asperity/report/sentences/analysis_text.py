"""Data of devices, results of the analysis of one law, limits and envelopes as text."""

from __future__ import annotations

import math

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits.limit_rules import LIMIT_RULES
from asperity.analysis.results import check_limits
from asperity.analysis.results.analyze import Analysis
from asperity.core.units import count_text, format_quantity
from asperity.devices import FIELD_TABLE, FIELD_UNITS, Datum, Device, WallTest
from asperity.envelopes.envelope import DeviceEnvelope, LawEnvelope
from asperity.envelopes.wave_borders import WaveBorders
from asperity.report.sentences.limit_sentences import speed_text, stiffness_text
from asperity.report.sentences.texts import (
    FRICTION_PROOF,
    INFINITY_SIGN,
    NOT_AVAILABLE,
    interval_text,
    sentence,
    yes_no_text,
)

# Data of a device by their symbols in the limits.
_SYMBOLS = {
    "T": "update_rate",
    "δ": "position_resolution",
    "b": "force_resolution",
    "K₀": "max_stiffness",
    "F₀": "bandwidth",
}


def computed_bounds(analysis: Analysis) -> list[tuple[str, Bound]]:
    """Return the numbers that were searched for, from which the others follow."""
    bounds = [("q", analysis.q), ("q⁺", analysis.one_sided)]
    if analysis.curl is not None:
        bounds.append(("|curl f|/k", analysis.curl))
    return bounds


def bound_notes(analysis: Analysis) -> list[str]:
    """Return how each number was obtained, and whether and why the law is conservative."""
    notes = [f"{name}: {bound.note}" for name, bound in computed_bounds(analysis) if bound.note]
    answer = f"conservative: {yes_no_text(analysis.conservative)}, {analysis.conservative_reason}"
    if analysis.energy_balance == "dissipative":
        answer = f"dissipative: {FRICTION_PROOF}; {analysis.conservative_reason}"
    return [*notes, answer]


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
    damping = _marked_text(datum, datum.text)
    return f"{format_quantity(speed, 'm/s')}: below it, damping {damping} absorbs too little"


def _marked_text(datum: Datum, text: str) -> str:
    return text if datum.verified else f"{text} (not verified)"


def thrust_text(analysis: Analysis) -> str:
    """Return the mean thrust on a straight scan as text."""
    thrust = analysis.leak.thrust
    surface = analysis.surface
    if surface.law.stateful:
        return "not defined: friction resists in any case"
    if thrust is None:
        return "not stated: the line is not periodic"
    # Smaller values are rounding errors of forces up to stiffness times depth.
    if abs(thrust) <= 1e-12 * surface.stiffness * surface.max_depth:
        thrust = 0.0
    return f"{format_quantity(thrust, 'N')} on a straight scan"


def symbol_lines(result: check_limits.Limits) -> list[str]:
    """Return the symbols of the limits with their values."""
    device = result.device
    surface = result.surface
    values = []
    for symbol, field in _SYMBOLS.items():
        if field in device.data:
            datum = device.data[field]
            # The symbol of the update rate is the period.
            text = f"1/({datum.text})" if field == "update_rate" else datum.text
            values.append(f"{symbol} = {_marked_text(datum, text)}")
    q = INFINITY_SIGN
    if math.isfinite(result.gain.value):
        q = f"{result.gain.value:.4g}"
    numbers = ", ".join(values) or "no data"
    speed = speed_text(result.speed)
    stiffness = stiffness_text(result)
    return [
        sentence("symbols", speed=speed, limits=result, device=device.name, numbers=numbers),
        sentence("gain_symbol", law=surface.law.letter, stiffness=stiffness, limits=result, q=q),
    ]


def envelope_answer(envelope: DeviceEnvelope) -> str:
    """Return the law that renders most on a device, and whether it feels alive."""
    name = envelope.device.name
    law = envelope.widest
    if not law.decades:
        return f"{name} renders no sinusoid with these laws."
    lengths = [border.wavelength for border in law.borders if border.decades]
    span = f"{format_quantity(lengths[0], 'm')} to {format_quantity(lengths[-1], 'm')}"
    parts = [f"{name} renders most with law {law.letter}, wavelengths from {span}"]
    parts[0] += f", {law.decades:.2f} decades² of wavelength and amplitude"
    parts += [_near_law_text(law, other) for other in envelope.near_widest]
    largest = max(envelope.laws, key=lambda other: other.decades)
    if largest is not law:
        parts.append(f"law {largest.letter} renders {largest.decades:.2f}, but feels alive")
    elif not law.conservative:
        parts.append("it feels alive")
    return f"{'; '.join(parts)}."


def _near_law_text(law: LawEnvelope, other: LawEnvelope) -> str:
    """Return how much another law renders, and where its greatest amplitudes differ most."""
    pairs = zip(law.borders, other.borders, strict=True)
    shared = [(first, second) for first, second in pairs if first.decades and second.decades]
    first, second = max(shared, key=lambda pair: abs(math.log(pair[1].top / pair[0].top)))
    tops = [format_quantity(border.top, "m", digits=2) for border in (second, first)]
    at = format_quantity(first.wavelength, "m")
    near = f"law {other.letter} renders nearly as much, {other.decades:.2f}"
    return f"{near}, and at {at} amplitudes up to {tops[0]} where {law.letter} reaches {tops[1]}"


def unseen_text(envelope: DeviceEnvelope) -> str:
    """Return which of the limits of the paper have no line in the diagram, and why."""
    unseen: dict[str, list[str]] = {"unknown": [], "outside": []}
    for rule in LIMIT_RULES:
        if envelope.device.value(rule.device_field) is None:
            unseen["unknown"].append(str(rule.number))
        elif not envelope.has_line(rule.number):
            unseen["outside"].append(str(rule.number))
    parts = [f"{', '.join(numbers)} {why}" for why, numbers in unseen.items() if numbers]
    return f"; limits {', '.join(parts)}" if parts else ""


def amplitude_range_text(border: WaveBorders) -> str:
    """Return the rendered amplitudes at a wavelength for reading."""
    if math.isnan(border.felt_from):
        return NOT_AVAILABLE
    low = format_quantity(border.felt_from, "m", digits=2)
    if math.isinf(border.felt_up_to):
        return f"from {low}"
    return f"{low} – {format_quantity(border.felt_up_to, 'm', digits=2)}"


UNVERIFIED_MARK = "?"
# The data without which some results are undecided.
_USED_FIELDS = (
    "max_stiffness",
    "position_resolution",
    "force_resolution",
    "update_rate",
    "bandwidth",
    "damping",
    "friction",
)


def datum_text(datum: Datum | None) -> str:
    """Return a datum as text, with a ? if it is not verified; "–" for none.

    Example:
        >>> datum_text(Datum(5.5e-5, "m", "remembered", False)), datum_text(None)
        ('55 µm ?', '–')
    """
    if datum is None:
        return NOT_AVAILABLE
    return datum.text if datum.verified else f"{datum.text} {UNVERIFIED_MARK}"


def verified_text(datum: Datum) -> str:
    """Return the pedigree of a verified datum, "measured" or "read" in a public source, or "no"."""
    return datum.pedigree if datum.verified else "no"


def wall_test_text(test: WallTest) -> str:
    """Return the conditions of a wall test as text; "" without any.

    Example:
        >>> wall_test_text(WallTest(1e3, "N/m", "", True, cycled=2e3, directions=("x", "z")))
        'tried along x, z; cycled at 2000 N/m'
    """
    parts = []
    if test.directions:
        parts.append(f"tried along {', '.join(test.directions)}")
    if test.cycled:
        parts.append(f"cycled at {format_quantity(test.cycled, 'N/m')}")
    if test.update_rate:
        source = f" ({test.rate_source})" if test.rate_source else ""
        parts.append(f"at {format_quantity(test.update_rate, 'Hz')}{source}")
    if test.delay_samples is not None:
        parts.append(f"{count_text(test.delay_samples, 'sample')} of delay")
    if test.positions:
        parts.append(f"{test.positions} positions")
    if test.lightest:
        parts.append(f"lightest direction {test.lightest:g} of the one tried")
    return "; ".join(parts)


def missing_fields(device: Device) -> list[str]:
    """Return the data that asperity uses and that the device lacks, with units.

    Example:
        >>> from asperity.devices import load_device
        >>> missing_fields(load_device("touch"))[0]
        'force_resolution [N]: smallest step of the force'
    """
    return [
        f"{field} [{FIELD_UNITS[field]}]: {FIELD_TABLE[field].description}"
        for field in _USED_FIELDS
        if field not in device.data
    ]


def gain_remark(analysis: Analysis) -> str:
    """Return q with its method, and what the cross in the figure of the gain attains."""
    if math.isinf(analysis.q.lower):
        return "q = ∞; the cross is the onset"
    remark = f"q = {interval_text(analysis.q)} ({analysis.q.method})"
    if analysis.q.at is None:
        return remark
    return f"{remark}; the cross attains the lower end"
