"""Checks that every certified number must pass."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import Bound, curl_norm, precise_norm, precise_one_sided
from asperity.analysis.gain.characteristic import curl_number
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid


def deterministic_settings(examples: int) -> settings:
    """Return hypothesis settings that give the same examples in every run."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


MEASURES = {
    "norm": (characteristic_number, precise_norm),
    "one-sided": (one_sided_number, precise_one_sided),
    "curl": (curl_number, curl_norm),
}


def as_fourier(texture: Sinusoid) -> Fourier:
    """Return the same surface as a Fourier sum, which has no closed form."""
    k = 2.0 * math.pi / texture.period
    vector = [[k * texture.direction[0], k * texture.direction[1]]]
    return Fourier([texture.amplitude], vector, [texture.phase])


def value_at_witness(surface: Surface, bound: Bound, name: str) -> float:
    """Return the measure of the surface's Jacobian at the witness."""
    state: tuple[Any, ...] = ()
    if bound.deflection is not None:
        state = (np.array([bound.deflection]), np.array([bound.sliding]))
    jacobian = surface.jacobian([bound.at], *state) / surface.stiffness
    return float(MEASURES[name][1](jacobian)[0])


def check_bound(surface: Surface, bound: Bound, name: str, gap: float) -> None:
    """Check that ``lower <= upper``, that ``lower`` is attained, and that the gap is reached."""
    assert bound.lower <= bound.upper
    assert value_at_witness(surface, bound, name) == pytest.approx(bound.lower, rel=1e-12)
    assert bound.gap <= 1.01 * gap
