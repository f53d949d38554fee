"""Sentences about a force field: its jumps, its worst loop and the energy that the loop gains."""

from __future__ import annotations

import math

from asperity.analysis.energy.continuity import Continuity, ContinuityCause
from asperity.analysis.energy.leak import Leak, LoopKind
from asperity.core.units import format_quantity, round_down, round_up

_CONTINUITY = {
    ContinuityCause.JUMP_AT_CONTACT: (
        "the force jumps where contact begins: its formula does not vanish with the depth"
    ),
    ContinuityCause.SINGLE_VALUED: "force and contact point change without jumps",
    ContinuityCause.DISTANCE: "the distance to the surface never jumps",
    ContinuityCause.CURVATURE: "the nearest point is unique down to 1/K, K >= ‖Hess h‖",
    ContinuityCause.CRESTS: "the contact point jumps below crests, at depths from {onset}",
    ContinuityCause.NOT_FOUND: "no medial axis found down to {depth}; the force jumps below it",
    ContinuityCause.BLUNT_CRESTS: "no crest is so sharp that the nearest point jumps at {depth}",
}


def continuity_reason(continuity: Continuity) -> str:
    """Return why the force is continuous, or not, with its Lipschitz constant."""
    reason = _CONTINUITY[continuity.cause].format(
        onset=format_quantity(round_down(continuity.onset), "m"),
        depth=format_quantity(continuity.surface.max_depth, "m"),
    )
    slope = continuity.lipschitz
    if slope is None or math.isinf(slope.upper):
        return reason
    return f"{reason}; Lipschitz constant at most {round_up(slope.upper):.10g} N/m"


def jumps_clause(continuity: Continuity) -> str:
    """Return whether the force jumps, and how much."""
    if continuity.continuous:
        return "its force is continuous"
    if not continuity.jumps:
        return f"its force is not continuous ({continuity_reason(continuity)})"
    largest = format_quantity(max(jump.size for jump in continuity.jumps), "N")
    return f"its force jumps, by up to {largest} where that was located"


_LOOPS = {
    LoopKind.EVERY_LOOP: "every closed loop: zero by the symbolic curl",
    LoopKind.NO_GAIN: "no evaluated loop gains energy",
    LoopKind.CURL_BY_DEPTH: "around the region of one sign of the curl, depth to {depth:g} mm",
    LoopKind.CURL_BY_DISTANCE: (
        "around the region of one sign of the curl where the surface is nearer than {depth:g} mm"
    ),
    LoopKind.FRICTION_PATH: (
        "the paper's path of (27), worst of {starts} starts: {deflection:g} mm along in light "
        "contact, back at {depth:g} mm"
    ),
    LoopKind.IN_PLANE: "in the plane at {depth:g} mm about an anchor that sticks",
}


def loop_description(leak: Leak) -> str:
    """Return the worst loop in words."""
    origin = leak.origin
    text = _LOOPS[origin.kind].format(
        depth=1e3 * origin.depth, starts=origin.starts, deflection=1e3 * origin.deflection
    )
    if origin.lines > 1:
        return f"{text}, the worst of {origin.lines} lines"
    return text


def leak_energy_text(leak: Leak) -> str:
    """Return the energy gained on the worst loop, per period or line length if that is proved.

    Example:
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.surface import Surface
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> leak_energy_text(worst_loop(Surface(Sinusoid(0.8e-3, 2e-3), "A", max_depth=0.8e-3)))
        '1.28 mJ per period'
    """
    energy = format_quantity(leak.worst_per_period, "J")
    if math.isinf(leak.upper_per_period):
        return f"{energy} per loop"
    if leak.line.periodic:
        return f"{energy} per period"
    return f"{energy} per {format_quantity(leak.line.length, 'm')}"
