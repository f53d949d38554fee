"""The six conditions of the paper's section II.B, each between two quantities of one dimension.

With the period T, position steps δ, force steps b, stiffest wall K₀ and first resonance F₀ of the
device; α, β and γ samples per wave; a wave of length l scanned at speed v that pushes with
amplitude A_F; and a surface of stiffness k that multiplies it by q:

1. α v T < l, 2. β δ < l, 3. α δ < l, 4. γ b < A_F, 5. q k <= K₀, 6. v/l < F₀.

The paper prints 4 as γ b/l < A, a force over a length against a force, and 5 as 2πA/l < A₀, a
number against a stiffness. 2 and 3 are one condition as printed, but for the number of samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.files import Record


@dataclass(frozen=True)
class Case:
    """What the conditions are asked of.

    Attributes:
        device: the device's numbers [SI] by field; those that are not known are missing.
        speed: v [m/s].
        time_samples: α.
        position_samples: β.
        force_steps: γ.
        wavelengths: l [m], shape (n,).
        forces: A_F [N], shape (n,).
        shares: of the variance of the heights, shape (n,).
        gain: q, or q⁺ where that decides.
        stiffness: k [N/m].
    """

    device: Mapping[str, float]
    speed: float
    time_samples: float
    position_samples: float
    force_steps: float
    wavelengths: FloatArray
    forces: FloatArray
    shares: FloatArray
    gain: float
    stiffness: float


Side = FloatArray | float


@dataclass(frozen=True)
class Rule:
    """One of the six conditions.

    Attributes:
        number: the paper's.
        name: the paper's, without "limit".
        inequality: as used here.
        unit: of both sides.
        field: of the device that it needs.
        sides: both sides [SI] for a case and that number of the device, for each wave or for all.
        top_speed: speed [m/s] below which each wave fulfils it; ``None`` if that does not matter.
    """

    number: int
    name: str
    inequality: str
    unit: str
    field: str
    sides: Callable[[Case, float], tuple[Side, Side]]
    top_speed: Callable[[Case, float], FloatArray] | None = None


RULES = (
    Rule(1, "scanning velocity", "α v T < l", "m", "update_rate",
         lambda case, rate: (case.time_samples * case.speed / rate, case.wavelengths),
         lambda case, rate: case.wavelengths * rate / case.time_samples),
    Rule(2, "low speed reconstruction", "β δ < l", "m", "position_resolution",
         lambda case, step: (case.position_samples * step, case.wavelengths)),
    Rule(3, "high speed reconstruction", "α δ < l", "m", "position_resolution",
         lambda case, step: (case.time_samples * step, case.wavelengths)),
    Rule(4, "force reconstruction", "γ b < A_F", "N", "force_resolution",
         lambda case, step: (case.force_steps * step, case.forces)),
    Rule(5, "gain", "q k ≤ K₀", "N/m", "max_stiffness",
         lambda case, wall: (case.gain * case.stiffness, wall)),
    Rule(6, "device structure", "v / l < F₀", "Hz", "bandwidth",
         lambda case, resonance: (case.speed / case.wavelengths, resonance),
         lambda case, resonance: case.wavelengths * resonance),
)  # fmt: skip


@dataclass(frozen=True)
class Limit(Record):
    """One of the six limits, decided for all waves at once.

    Attributes:
        number: the paper's.
        name: the paper's, without "limit".
        inequality: left and right side in symbols.
        unit: of both sides.
        left: left side [SI], for the wave that comes closest to breaking it; ``None`` if the limit
            cannot be decided.
        right: right side [SI].
        wavelength: of that wave [m]; ``None`` where the limit is on the surface as a whole.
        holds: whether it holds for every wave at this speed; ``None`` if it cannot be decided.
        share: of the variance of the heights, in waves for which it holds.
        speeds: scanning speeds [m/s], from the first up to but without the second, at which it
            holds for every wave: (0, inf) all, (0, 0) none.
        uses: the field of the device that it needs.
        needs: what is missing to decide it.
    """

    number: int
    name: str
    inequality: str
    unit: str
    left: float | None = None
    right: float | None = None
    wavelength: float | None = None
    holds: bool | None = None
    share: float | None = None
    speeds: tuple[float, float] | None = None
    uses: str = ""
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """A limit with its answer wave by wave.

    Attributes:
        limit: for all waves at once.
        holds: whether it holds for each wave, shape (n,); ``None`` if it cannot be decided.
        top: speed [m/s] below which it holds for each wave, shape (n,).
    """

    limit: Limit
    holds: NDArray[np.bool_] | None
    top: FloatArray | None


def decide(rule: Rule, case: Case, inequality: str | None = None) -> Decision:
    """Return whether a condition holds, wave by wave and for all.

    Args:
        rule: the condition.
        case: what it is asked of.
        inequality: in symbols, where it differs from the rule's.
    """
    shown, on_waves = inequality or rule.inequality, rule.number != 5
    limit = Limit(rule.number, rule.name, shown, rule.unit, uses=rule.field)
    needs = [] if rule.field in case.device else [rule.field]
    if on_waves and not len(case.wavelengths):
        needs.append("waves: the surface is flat")
    if needs:
        return Decision(replace(limit, needs=tuple(needs)), None, None)
    number = case.device[rule.field]
    left, right = np.broadcast_arrays(*map(np.atleast_1d, rule.sides(case, number)))
    # A stiffness that was made K₀/q may miss it by rounding; the other limits are strict.
    holds = left < right if on_waves else left <= right * (1.0 + 1e-12)
    top = np.where(holds, math.inf, 0.0)
    if rule.top_speed is not None:
        top = rule.top_speed(case, number)
    worst = int(np.argmin(right / left))
    limit = replace(
        limit,
        left=float(left[worst]),
        right=float(right[worst]),
        wavelength=float(case.wavelengths[worst]) if on_waves else None,
        holds=bool(holds.all()),
        share=float(case.shares[holds].sum() / case.shares.sum()) if on_waves else None,
        speeds=(0.0, float(top.min())),
    )
    return Decision(limit, holds, top)
