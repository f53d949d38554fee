"""Stiffnesses that the stability criteria allow, compared with the simulated onset."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.simulation.hands import Hand
from asperity.simulation.limit_cycles.onset import Onset
from asperity.simulation.sampled_plant import Plant
from asperity.simulation.servo import Servo
from asperity.surface import Surface

# Relative tolerance of the characteristic numbers: far below the bracket of an onset.
TOLERANCE = 0.01


@dataclass(frozen=True)
class Prediction:
    """Stiffnesses that criteria allow, and the onset of limit cycles.

    Attributes:
        onset: onset in the simulation.
        depth: depth of the handle in the cycle [m], below the highest crest, or below z = 0 for
            laws
            on the nominal contact; the numbers hold for this depth.
        damping: σ₀ [N s/m], the least in the region that the handle reached.
        q: upper bound of the characteristic number, or its value if no bound is proved.
        one_sided: the same for the one-sided number.
        conservative: whether the law is conservative; only then is the delay rule a proof.
        paper_limit: limit of the paper's (1), σ₀/(2 T q) [N/m].
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
    paper_limit: float
    delay_rule: float
    wall_rule: float | None

    @property
    def violates_delay_rule(self) -> bool:
        """Whether a conservative law cycled below the delay rule.

        With exact positions it cannot; the proof does not cover encoder steps.
        """
        cycling = self.onset.cycling
        return self.conservative and math.isfinite(cycling) and cycling <= self.delay_rule

    @property
    def violates_wall_rule(self) -> bool:
        """Whether a loop cycled at a stiffness below K₀/q, with K₀ the onset of the wall."""
        return self.wall_rule is not None and self.onset.cycling < self.wall_rule

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            **self.onset.to_dict(),
            **attributes_to_dict(self, "depth", "damping", "q", "one_sided"),
            "paper_1": to_plain_data(self.paper_limit),  # equation (1) of the paper
            **attributes_to_dict(self, "delay_rule", "wall_rule", "conservative"),
            **attributes_to_dict(self, "violates_delay_rule", "violates_wall_rule"),
        }


def expected_onset(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, start: ArrayLike
) -> float | None:
    """Return the expected onset of limit cycles [N/m], by the delay rule.

    It uses the numbers at the surface's max_depth and the damping at the start; ``None`` without
    damping, or for a law without a Jacobian.

    Args:
        surface: texture, law and depth; its stiffness is not used.
        plant: plant of the simulation.
        hand: hand of the simulation.
        servo: servo with the delay of the simulation.
        start: initial position of the handle [m], shape (3,).
    """
    top = surface.law.contact.extremes(surface.texture)[1]
    damping = plant.min_damping(start, start, hand, top)
    plus = one_sided_number(surface, TOLERANCE).value
    q = characteristic_number(surface, TOLERANCE).value
    # Below a medial axis q is unbounded; most trajectories never reach it.
    weight = 0.5 * plus + servo.delay * (q if math.isfinite(q) else plus)
    onset = damping / servo.period / weight if weight > 0.0 else math.inf
    return onset if 0.0 < onset < math.inf else None


def predict(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, onset: Onset,
    wall: Onset | None = None,
) -> Prediction:  # fmt: skip
    """Return the stiffnesses that the criteria allow, with the simulated onset.

    Args:
        surface: texture and law; stiffness and max_depth are not used.
        plant: plant of the simulation.
        hand: hand of the simulation.
        servo: servo with the delay of the simulation.
        onset: simulated onset.
        wall: simulated onset of the smooth wall at the same delay.

    Reference:
        The paper's (1) and III.B; the delay rule is derived on the page "Passivity".
    """
    top = surface.law.contact.extremes(surface.texture)[1]
    depth = max(top - onset.low[2], 0.0)
    damping = plant.min_damping(onset.low, onset.high, hand, top)
    q = plus = 0.0
    if depth > 0.0:
        # Below the depth of a clamp the numbers are those of the clamped force.
        clamped = surface.effective_clamp.changes_force and depth > surface.max_depth
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
        paper_limit=0.5 * budget / q if q > 0.0 else math.inf,
        delay_rule=budget / weight if weight > 0.0 else math.inf,
        wall_rule=None if wall is None or q == 0.0 else wall.quiet / q,
    )


def smooth_wall_onset(onsets: Sequence[Onset], delay: int) -> Onset | None:
    """Return the onset of the smooth wall at a delay, if there is one."""
    return next((onset for onset in onsets if onset.is_smooth_wall and onset.delay == delay), None)
