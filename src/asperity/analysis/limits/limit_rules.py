"""The six limits of the paper's section II.B, each between two quantities of one dimension.

With the period T, position steps δ, force steps b, stiffest wall K₀ and first resonance F₀ of the
device; α, β and γ samples per wave; a wave of length l scanned at speed v with force amplitude
A_F; and a surface of stiffness k with characteristic number q:

1. α v T < l, 2. β δ < l, 3. α δ < l, 4. γ b < A_F, 5. q k <= K₀, 6. v/l < F₀.

The paper prints 4 as γ b/l < A, a force over a length against a force, and 5 as 2πA/l < A₀, a
number against a stiffness. 2 and 3 are one condition as printed, up to the number of samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_real
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.devices import Device

DEFAULT_SPEED = 0.1  # [m/s], a fast stroke
DEFAULT_SAMPLES = 5.0  # "typically 5 to 10"
LEAST_SAMPLES = {"time_samples": 2.0, "position_samples": 2.0, "force_steps": 1.0}
"""Least α, β and γ."""


@dataclass(frozen=True)
class LimitCase:
    """The conditions under which the limits are evaluated.

    Attributes:
        device: known data of the device [SI] by field.
        wavelengths: l [m], shape (n,).
        forces: A_F [N], shape (n,).
        shares: shares of the variance of the heights, shape (n,).
        gain: q, or q⁺ where that decides; only for limit 5.
        stiffness: k [N/m]; only for limit 5.
        speed: v [m/s].
        time_samples: α, updates that a wave needs.
        position_samples: β, position steps that a wave needs.
        force_steps: γ, force steps that an amplitude needs.
    """

    device: Mapping[str, float]
    wavelengths: FloatArray
    forces: FloatArray
    shares: FloatArray
    gain: float = math.nan
    stiffness: float = math.nan
    speed: float = DEFAULT_SPEED
    time_samples: float = DEFAULT_SAMPLES
    position_samples: float = DEFAULT_SAMPLES
    force_steps: float = DEFAULT_SAMPLES


Side = FloatArray | float


@dataclass(frozen=True)
class LimitRule:
    """One of the six limits as an inequality.

    Attributes:
        number: number in the paper.
        name: name in the paper, without "limit".
        inequality: the inequality in symbols.
        unit: unit of both sides.
        device_field: the field of the device that it needs.
        sides: both sides [SI] from a case and that field, for each wave or for all.
        top_speed: speed [m/s] below which each wave fulfils it; ``None`` if independent of speed.
    """

    number: int
    name: str
    inequality: str
    unit: str
    device_field: str
    sides: Callable[[LimitCase, float], tuple[Side, Side]]
    top_speed: Callable[[LimitCase, float], FloatArray] | None = None


LIMIT_RULES = (
    LimitRule(
        1,
        "scanning velocity",
        "α v T < l",
        "m",
        "update_rate",
        lambda case, rate: (case.time_samples * case.speed / rate, case.wavelengths),
        lambda case, rate: case.wavelengths * rate / case.time_samples,
    ),
    LimitRule(
        2,
        "low speed reconstruction",
        "β δ < l",
        "m",
        "position_resolution",
        lambda case, step: (case.position_samples * step, case.wavelengths),
    ),
    LimitRule(
        3,
        "high speed reconstruction",
        "α δ < l",
        "m",
        "position_resolution",
        lambda case, step: (case.time_samples * step, case.wavelengths),
    ),
    LimitRule(
        4,
        "force reconstruction",
        "γ b < A_F",
        "N",
        "force_resolution",
        lambda case, step: (case.force_steps * step, case.forces),
    ),
    LimitRule(
        5,
        "gain",
        "q k ≤ K₀",
        "N/m",
        "max_stiffness",
        lambda case, wall: (case.gain * case.stiffness, wall),
    ),
    LimitRule(
        6,
        "device structure",
        "v / l < F₀",
        "Hz",
        "bandwidth",
        lambda case, resonance: (case.speed / case.wavelengths, resonance),
        lambda case, resonance: case.wavelengths * resonance,
    ),
)


@dataclass(frozen=True)
class Limit(Serializable):
    """One of the six limits, decided for all waves at once.

    Attributes:
        number: number in the paper.
        name: name in the paper, without "limit".
        inequality: left and right side in symbols.
        unit: unit of both sides.
        left: left side [SI], for the wave closest to violating it; ``None`` if undecidable.
        right: right side [SI].
        wavelength: length of that wave [m]; ``None`` where the limit concerns the whole surface.
        holds: whether it holds for every wave at this speed; ``None`` if undecidable.
        share: share of the variance of the heights in waves for which it holds.
        speeds: scanning speeds [m/s], from the first up to but excluding the second, at which it
            holds for every wave: (0, inf) all, (0, 0) none.
        device_field: the field of the device that it needs.
        missing_data: data missing to decide it.
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
    device_field: str = ""
    missing_data: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """A limit with its result wave by wave.

    Attributes:
        limit: the result for all waves.
        holds: whether it holds for each wave, shape (n,); true if undecidable.
        top_speeds: speed [m/s] below which it holds for each wave, shape (n,).
    """

    limit: Limit
    holds: NDArray[np.bool_]
    top_speeds: FloatArray


def holds_for_waves(rule: LimitRule, case: LimitCase) -> NDArray[np.bool_]:
    """Return whether a limit holds for each wave, shape (n,); true if undecidable."""
    number = case.device.get(rule.device_field)
    if number is None:
        return np.full(len(case.wavelengths), True)
    left, right = rule.sides(case, number)
    # A stiffness of K₀/q may exceed it by rounding; the other limits are strict.
    if rule.number == 5:
        return np.atleast_1d(left <= right * (1.0 + 1e-12))
    return np.atleast_1d(left < right)


def evaluate_limit(rule: LimitRule, case: LimitCase, inequality: str | None = None) -> Decision:
    """Return whether a limit holds, wave by wave and for all waves.

    Args:
        rule: the limit.
        case: the conditions.
        inequality: the inequality in symbols, where it differs from the rule's.
    """
    field = rule.device_field
    symbols = inequality or rule.inequality
    on_waves = rule.number != 5
    limit = Limit(rule.number, rule.name, symbols, rule.unit, device_field=field)
    missing = [] if field in case.device else [field]
    if on_waves and not len(case.wavelengths):
        missing.append("waves: the surface is flat")
    if missing:
        limit = replace(limit, missing_data=tuple(missing))
        n = len(case.wavelengths)
        return Decision(limit, np.full(n, True), np.full(n, math.inf))
    number = case.device[field]
    left, right = np.broadcast_arrays(*map(np.atleast_1d, rule.sides(case, number)))
    holds = holds_for_waves(rule, case)
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


def shortest_wavelengths(
    device: Device, speed: float, time_samples: float, position_samples: float
) -> list[tuple[float, int, str]]:
    """Return the wavelengths [m] below which a limit fails at a speed, with number and name.

    Limits 1, 2, 3 and 6 of the paper's section II.B, α v T < l, β δ < l, α δ < l and v/l < F₀; 3
    only where it differs from 2.
    """
    rate = device.value("update_rate")
    step = device.value("position_resolution")
    bandwidth = device.value("bandwidth")
    lengths = []
    if rate is not None:
        lengths.append((time_samples * speed / rate, 1, f"{time_samples:g} updates"))
    if step is not None:
        lengths.append((position_samples * step, 2, f"{position_samples:g} position steps"))
        if time_samples != position_samples:
            lengths.append((time_samples * step, 3, f"{time_samples:g} position steps"))
    if bandwidth is not None:
        lengths.append((speed / bandwidth, 6, "bandwidth"))
    return sorted(lengths)


def check_sample_count(name: str, value: float | None) -> float:
    """Return the number of samples needed, checked; fewer than two cannot represent a wave.

    Raises:
        ParameterError: for less than the least number.
    """
    if value is None:
        return DEFAULT_SAMPLES
    number = check_real(name, value)
    least = LEAST_SAMPLES[name]
    if number < least:
        raise ParameterError(name, f"must be at least {least:g}", value)
    return number
