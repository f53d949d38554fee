"""Sentences about a renderer that was searched, and about a recording of a loop.

Everything is "at least" and "found": a search proves nothing.
"""

from __future__ import annotations

import math

from asperity.certification.certify import Certification
from asperity.certification.recorded_loop import RecordedCertification
from asperity.certification.witnesses import BaselineDifference
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.report.sentences.loop_text import limit_texts, measured_energy_text

DIFFERENCE_UNITS = {"force": "N", "gain": "N/m", "leak": "J", "jump": "N"}


def point_text(point: tuple[float, ...] | None) -> str:
    """Return a position as text; "–" for none."""
    if point is None:
        return "–"
    return ", ".join(format_quantity(value, "m", digits=4) for value in point)


def certification_answer(result: Certification) -> str:
    """Return what was found in two or three sentences, a force that is not finite first."""
    gain = format_quantity(result.gain, "N/m", digits=4)
    calls = f"{result.calls:.3g} forces in {format_quantity(result.seconds, 's', digits=3)}"
    answer = (
        f"The gain is at least {gain}; {_leak_clause(result)}; {_jump_clause(result)}; "
        f"{_history_clause(result)}. No larger ones were found in {calls}, which proves nothing: "
        "on the laws of asperity such a search finds about 95 % of the true gain."
    )
    if result.invalid_at is not None:
        answer = f"The force is not finite at {point_text(result.invalid_at)}. {answer}"
    return answer


def _leak_clause(result: Certification) -> str:
    if result.worst_loop is None:
        return "no closed path was found that gains energy"
    energy = format_quantity(result.worst_loop.energy, "J", digits=3)
    return f"a closed path gains {energy} in a turn, so the surface feels alive"


def _jump_clause(result: Certification) -> str:
    if not result.jumps:
        return "no jump of the force was found"
    size = format_quantity(result.jumps[0].size, "N", digits=3)
    return f"the force jumps by up to {size}, which clicks"


def _history_clause(result: Certification) -> str:
    if not result.history.is_reset:
        change = format_quantity(result.history.reset_spread, "N", digits=3)
        return f"a reset does not make it forget: the force differs by {change}"
    if not result.history.has_memory:
        return "the force depends on the position alone"
    largest = max(result.history.spread, result.history.step_spread)
    return (
        f"the force at one point differs by {format_quantity(largest, 'N', digits=3)} by approach"
    )


def device_sentences(result: Certification, device: Device) -> list[str]:
    """Return what the gain and the leak mean for a device."""
    sentences = []
    limit = device.value("max_stiffness")
    if limit is None:
        sentences.append(f"{device.name} has no stiffness to compare the gain with.")
    else:
        limit_text = format_quantity(limit, "N/m", digits=3)
        share = limit / result.gain if result.gain else math.inf
        if share >= 1.0:
            sentences.append(f"{device.name} held a wall of {limit_text}: the gain found is below.")
        else:
            sentences.append(
                f"{device.name} held a wall of {limit_text}: multiply the forces by {share:.2g} "
                "or less."
            )
    largest = device.value("max_force")
    if largest is not None and result.largest_force > largest:
        force = format_quantity(result.largest_force, "N", digits=3)
        largest_text = format_quantity(largest, "N", digits=3)
        sentences.append(f"The force reaches {force}; the device gives {largest_text}.")
    damping = device.value("damping")
    if result.densest_loop is not None and damping:
        speed = format_quantity(result.densest_loop.critical_speed(damping), "m/s", digits=3)
        sentences.append(f"Below {speed} its damping absorbs less than a loop gives.")
    return sentences


def resolution_text(result: Certification) -> str:
    """Return the noise and the steps of a renderer."""
    resolution = result.resolution
    parts = []
    if resolution.noise:
        parts.append(f"noise {format_quantity(0.5 * resolution.noise, 'N', digits=2)}")
    if resolution.force_step:
        parts.append(f"steps of force {format_quantity(resolution.force_step, 'N', digits=2)}")
    largest = max(resolution.position_step)
    if largest:
        parts.append(f"steps of position {format_quantity(largest, 'm', digits=2)}")
    secant = format_quantity(resolution.secant, "m", digits=2)
    return f"{', '.join(parts) or 'no noise, no steps'}; secants of {secant} and more count"


def difference_sentence(difference: BaselineDifference) -> str:
    """Return the first difference from a baseline as a sentence."""
    unit = DIFFERENCE_UNITS[difference.quantity]
    if difference.at is not None:
        before = ", ".join(format_quantity(value, unit, digits=6) for value in difference.before)
        now = ", ".join(format_quantity(value, unit, digits=6) for value in difference.now)
        return f"At ({point_text(difference.at)}) the force was ({before}) and is ({now})."
    before = format_quantity(difference.before, unit, digits=4)
    now = format_quantity(difference.now, unit, digits=4)
    return f"The {difference.quantity} was {before} and is {now}."


def recording_answer(result: RecordedCertification) -> str:
    """Return what a recording shows in a few sentences."""
    energy = format_quantity(abs(result.energy), "J", digits=3)
    direction = "gave the hand" if result.energy > 0.0 else "took from the hand"
    duration = format_quantity(result.duration, "s", digits=3)
    sentences = [f"{result.name}: the surface {direction} {energy} in {duration}."]
    measured = result.measured_energy
    if measured is not None and not math.isclose(measured, result.energy, rel_tol=1e-6):
        text = measured_energy_text(measured, max(result.position_step))
        sentences.append(f"This is along the exact positions of the simulation. {text}.")
    if result.violated_since is not None:
        most = format_quantity(result.violation, "J", digits=3)
        since = format_quantity(result.violated_since, "s", digits=3)
        sentences.append(
            f"From {since} on it had given more than it had taken, {most} at most: not passive."
        )
    cycle = result.limit_cycle
    if cycle is not None:
        frequency = format_quantity(cycle.frequency, "Hz", digits=3)
        amplitude = format_quantity(cycle.amplitude, "m", digits=3)
        since = format_quantity(cycle.since, "s", digits=3)
        kind = "An oscillation of a moved hand" if cycle.is_moved else "A limit cycle"
        sentences.append(f"{kind} along {cycle.axis}: {frequency}, {amplitude}, from {since}.")
    if result.late_samples:
        count = result.late_samples
        sentences.append(f"Late samples: {count}, which lack {result.missing_samples} more.")
    if result.limits is not None:
        sentences += [f"{text}." for text in limit_texts(result.limits, result.limits.max_depth)]
    return " ".join(sentences)
