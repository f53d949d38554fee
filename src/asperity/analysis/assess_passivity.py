"""Passivity of a surface on a device: every criterion and the verdict."""

from __future__ import annotations

import os

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.analysis.passivity.criteria import buzz_bound, evaluate_criteria
from asperity.analysis.passivity.device_loop import (
    critical_speed,
    make_device_loop,
    max_proved_delay,
)
from asperity.analysis.passivity.verdict import Passivity, decide_verdict, stability_limit
from asperity.analysis.sentences.analysis_sentences import verdict_reason, with_sentences
from asperity.core.errors import ParameterError
from asperity.devices import Device, load_device
from asperity.surface import Surface


def passivity(
    surface: Surface,
    device: str | os.PathLike[str] | Device,
    q: Bound,
    one_sided: Bound,
    leak: Leak,
) -> Passivity:
    """Return whether the loop of hand, device and texture is passive, with every criterion.

    With T the period of the update rate, σ₀ the device's damping, b_v its virtual damping, d its
    whole samples of delay and K₀ the stiffest smooth wall that it renders, the criteria are:

    * paper (1): k q <= σ₀/(2T), as printed;
    * one-sided: k q⁺ <= 2σ₀/T, for a conservative law without delay;
    * delay: k (q⁺/2 + d q) <= σ₀/T, for a conservative law;
    * virtual damping: k (q⁺/2 + d q) T + |b_v| <= σ₀, for a conservative law;
    * steps and friction: k q |δ|/2 + |b|/2 <= f_c, for a conservative law, beside one of these;
    * smooth-wall rule: k q <= K₀, as printed in the paper's III.B: a rule of thumb;
    * wall test: k (q⁺/2 + d q) <= K₀ (1/2 + d), k q <= K₀ for any delay, for a conservative law:
      plausible, not proved;
    * leak: no loop of the field gains energy.

    Missing data of the device are never guessed: an unknown delay, damping or rate decides
    nothing. Virtual damping, quantisation and dry friction that are not given count as none.

    Args:
        surface: the surface.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        q: its characteristic number.
        one_sided: its one-sided number.
        leak: its worst loop.

    Raises:
        ParameterError: for another type, or device data out of range.

    Reference:
        The paper's (1) and III.B; Colgate and Schenkel (the paper's [25]); MATH section 4.

    Example:
        >>> from asperity.analysis import characteristic_number, one_sided_number
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.devices import parse_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> rig = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "H")
        >>> numbers = characteristic_number(surface), one_sided_number(surface)
        >>> leak = worst_loop(surface)
        >>> result = passivity(surface, parse_device(rig, "mine"), *numbers, leak)
        >>> result.verdict, result.decided_by, round(result.safe_stiffness, 3)
        ('passive', 'delay', 5333.333)
    """
    types = (("surface", surface, Surface), ("q", q, Bound), ("one_sided", one_sided, Bound))
    for name, value, kind in (*types, ("leak", leak, Leak)):
        if not isinstance(value, kind):
            raise ParameterError(name, f"must be a {kind.__name__}", value)
    loop = make_device_loop(surface, load_device(device), q, one_sided, leak)
    criteria = {
        name: with_sentences(loop, criterion) for name, criterion in evaluate_criteria(loop).items()
    }
    buzz = buzz_bound(loop)
    verdict, decisive, ground = decide_verdict(loop, criteria, buzz)
    return Passivity(
        criteria=tuple(criteria.values()),
        decided_by=decisive,
        verdict=verdict,
        ground=ground,
        reason=verdict_reason(loop, criteria[decisive], ground, buzz),
        stiffness=surface.stiffness,
        stability_limit=stability_limit(loop, criteria),
        critical_speed=critical_speed(loop),
        greatest_delay=max_proved_delay(loop),
        buzz=buzz,
    )
