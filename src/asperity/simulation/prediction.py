"""What the criteria of the analysis say of the onset that a simulation finds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.devices.five_bar import handle_damping
from asperity.files import plain, record
from asperity.simulation.hands import Hand, SpringHand
from asperity.simulation.onset import Onset
from asperity.simulation.plants import Pantograph, Plant
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import left_workspace
from asperity.surface import Surface

# Relative gap of the characteristic numbers: far less than the bracket of an onset.
TOLERANCE = 0.01


@dataclass(frozen=True)
class Prediction:
    """Stiffnesses that criteria allow, beside the one at which cycles begin.

    Attributes:
        onset: of the simulation.
        depth: to which the handle got where it cycles [m], below the highest crest, or below z = 0
            for laws on the nominal contact; the numbers are those of this depth.
        damping: σ₀ [N s/m], the least over where the handle got.
        q: upper bound of the characteristic number, or the value where none is proved.
        one_sided: the same of the one-sided number.
        conservative: whether the law is; only then is the delay rule a proof.
        paper: of the paper's (1), σ₀/(2 T q) [N/m].
        delay_rule: σ₀/(T (q⁺/2 + d q)) [N/m].
        wall_rule: the onset of the smooth wall at the same delay over q [N/m]; ``None`` if it was
            not simulated.
    """

    onset: Onset
    depth: float
    damping: float
    q: float
    one_sided: float
    conservative: bool
    paper: float
    delay_rule: float
    wall_rule: float | None

    @property
    def missed(self) -> bool:
        """Whether a loop cycled below what the delay rule allows a conservative law.

        With exact positions it never may; the proof knows no steps of the encoder.
        """
        cycling = self.onset.cycling
        return self.conservative and math.isfinite(cycling) and cycling <= self.delay_rule

    @property
    def wall_rule_missed(self) -> bool:
        """Whether a loop cycled at a stiffness that K₀/q calls safe, K₀ being the wall's onset."""
        return self.wall_rule is not None and self.onset.cycling < self.wall_rule

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            **self.onset.to_dict(),
            **record(self, "depth", "damping", "q", "one_sided"),
            "paper_1": plain(self.paper),  # equation (1) of the paper
            **record(self, "delay_rule", "wall_rule", "conservative"),
            **record(self, "missed", "wall_rule_missed"),
        }


def least_damping(
    plant: Plant, low: ArrayLike, high: ArrayLike, hand: Hand | None = None, top: float = 0.0
) -> float:
    """Return σ₀(B) [N s/m]: the least damping over the directions in which the handle moves.

    Args:
        plant: what moves; of a five-bar the brakes count as on.
        low: least position that it gets to [m], shape (3,).
        high: greatest position [m], shape (3,); of a five-bar 9 x 9 places in between are tried.
        hand: whose damping counts too, of a spring on a mass in space; elsewhere it is left out,
            which is on the safe side.
        top: height up to which the brakes of a five-bar may be on [m].
    """
    if not isinstance(plant, Pantograph):
        # Behind a resonance the hand does not damp the handle.
        held = np.zeros((3, 3))
        if isinstance(hand, SpringHand) and plant.resonance is None:
            held = np.diag(hand.damping)
        return float(np.linalg.eigvalsh(plant.damping + held)[0])
    if plant.joint_damping == 0.0:
        return 0.0
    (x0, _, z0), (x1, _, z1) = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    grid = [
        np.array([x, 0.0, z])
        for x in np.unique(np.linspace(x0, x1, 9))  # of a box without width each place once
        for z in np.unique(np.linspace(z0, min(z1, max(z0, top)), 9))
    ]
    # Corners of the box that the arms do not reach are places where it was not.
    places = [plant.centre + p[[0, 2]] for p in grid if not left_workspace(plant, p)]
    dampings = [
        float(np.linalg.eigvalsh(handle_damping(plant.linkage, plant.joint_damping, place))[0])
        for place in places
    ]
    return min(dampings, default=0.0)


def expected(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, start: ArrayLike
) -> float | None:
    """Return the stiffness [N/m] near which cycles may be expected to begin: the delay rule.

    With the numbers of the surface's max_depth and the damping where the handle starts. Nothing
    where the rule says nothing: without damping, or for a law without a Jacobian.

    Args:
        surface: texture, law and depth; its stiffness does not count.
        plant: of the simulation.
        hand: of the simulation.
        servo: with the delay of the simulation.
        start: of the handle [m], shape (3,).
    """
    top = surface.law.contact.extremes(surface.texture)[1]
    damping = least_damping(plant, start, start, hand, top)
    plus = one_sided_number(surface, TOLERANCE).value
    q = characteristic_number(surface, TOLERANCE).value
    # Below a medial axis q has no bound, and most starts never get there.
    weight = 0.5 * plus + servo.delay * (q if math.isfinite(q) else plus)
    rule = damping / servo.period / weight if weight > 0.0 else math.inf
    return rule if 0.0 < rule < math.inf else None


def predict(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    onset: Onset,
    wall: Onset | None = None,
) -> Prediction:
    """Return what the criteria allow beside what was found.

    Args:
        surface: texture and law; stiffness and max_depth do not count.
        plant: of the simulation.
        hand: of the simulation.
        servo: with the delay of the simulation.
        onset: what the simulation found.
        wall: what it found for the smooth wall at the same delay.

    Reference:
        The paper's (1) and III.B; the delay rule is derived on the page "Passivity".
    """
    top = surface.law.contact.extremes(surface.texture)[1]
    depth = max(top - onset.low[2], 0.0)
    damping = least_damping(plant, onset.low, onset.high, hand, top)
    q = plus = 0.0
    if depth > 0.0:
        # Deeper than a clamp holds the depth, the numbers are those of the clamped force.
        clamped = surface.acting_clamp != "none" and depth > surface.max_depth
        pressed = surface if clamped else surface.to_depth(depth)
        q = characteristic_number(pressed, TOLERANCE).value
        plus = one_sided_number(pressed, TOLERANCE).value
    budget = damping / servo.period
    weight = 0.5 * plus + (servo.delay * q if servo.delay else 0.0)
    return Prediction(
        onset=onset,
        depth=depth,
        damping=damping,
        q=q,
        one_sided=plus,
        conservative=surface.facts.conservative,
        paper=0.5 * budget / q if q > 0.0 else math.inf,
        delay_rule=budget / weight if weight > 0.0 else math.inf,
        wall_rule=None if wall is None or q == 0.0 else wall.quiet / q,
    )


def with_wall(onsets: Sequence[Onset], delay: int) -> Onset | None:
    """Return the onset of the smooth wall at a delay, if it is among these."""
    return next((onset for onset in onsets if onset.wall and onset.delay == delay), None)
