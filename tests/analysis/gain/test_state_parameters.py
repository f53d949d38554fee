"""Kernel, certificates and loops use the same values of a law's parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.analysis.bounds.bound import NORM, precise_norm, precise_one_sided
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.straight_scan import merit
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.theorems import derivative_bound
from asperity.analysis.limits.spectrum import compute_spectrum
from asperity.analysis.limits.wave_scan import wave_forces
from asperity.core.checks import FloatArray
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid

WAVE = Sinusoid(amplitude=0.2e-3, period=1e-3)
# Too many independent waves to be certified on the whole plane.
FIVE = Fourier(
    [1e-4, 5e-5, 4e-5, 3e-5, 2e-5],
    [[3000.0, 0.0], [0.0, 5000.0], [1234.0, 777.0], [-500.0, 2222.0], [1777.0, -3210.0]],
)
RUBBING = {"friction": 4.0, "max_deflection": 1e-4, "modulation_depth": 0.6}


def _dragged(c: Any) -> Any:
    """Return k δ (e_z - g (1 - m) d/d_max) with a parameter "grip" g in place of "friction"."""
    grip = c.parameter("grip") * (1 - c.relative_height / 2) / c.parameter("max_deflection")
    return c.k * c.depth * (c.e_z - c.tangential(grip * c.deflection))


DRAGGED = Law(
    "dragged",
    "dragged",
    "nominal",
    _dragged,
    stateful=True,
    parameters={"grip": 0.5, "max_deflection": 1e-3},
)
SURFACES = {
    "F": Surface(WAVE, "F", law_parameters=RUBBING),
    "user-defined": Surface(WAVE, DRAGGED, law_parameters={"grip": 2.0, "max_deflection": 5e-5}),
}


def _jacobians(surface: Surface, count: int = 4000) -> FloatArray:
    """Return J/k at random contacts with random deflections, half of them of maximum length."""
    rng = np.random.default_rng(11)
    points = rng.uniform([-1e-3, -1e-3, -surface.max_depth], [1e-3, 1e-3, 0.0], (count, 3))
    longest = surface.law_parameters["max_deflection"]
    angle, length = rng.uniform(0.0, 7.0, count), longest * rng.choice([1.0, 0.5], count)
    deflection = length[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    sliding = (length == longest) & (rng.random(count) < 0.5)
    return surface.jacobian(points, deflection, sliding) / surface.stiffness


@pytest.mark.parametrize("surface", SURFACES.values(), ids=list(SURFACES))
@pytest.mark.parametrize(
    ("number", "measure"),
    [(characteristic_number, precise_norm), (one_sided_number, precise_one_sided)],
)
def test_kernel_values_do_not_exceed_the_certified_number(
    surface: Surface, number: Any, measure: Any
) -> None:
    bound = number(surface, 0.05)
    assert bound.method == "certified"
    greatest = float(measure(_jacobians(surface)).max())
    assert 0.8 * bound.upper < greatest <= bound.upper
    assert bound.upper > 2.0  # more than with the default parameters
    state = (np.array([bound.deflection]), np.array([bound.sliding]))
    attained = measure(surface.jacobian([bound.at], *state) / surface.stiffness)
    assert attained[0] == pytest.approx(bound.lower, rel=1e-12)


def test_parameters_by_mapping_and_by_keyword_are_equivalent() -> None:
    mapping, keywords = Surface(WAVE, "F", law_parameters=RUBBING), Surface(WAVE, "F", **RUBBING)
    for analysis in (characteristic_number, one_sided_number, merit):
        assert analysis(mapping) == analysis(keywords)
    one, other = worst_loop(mapping), worst_loop(keywords)
    assert (one.energy, one.description) == (other.energy, other.description)
    assert "0.1 mm along" in one.description or "in the plane" in one.description
    waves = compute_spectrum(WAVE)
    assert (wave_forces(mapping, waves) == wave_forces(keywords, waves)).all()
    default = characteristic_number(Surface(WAVE, "F"))
    assert characteristic_number(mapping).upper > 2.0 * default.upper


def test_derivative_bound_uses_the_law_parameters() -> None:
    surface = Surface(FIVE, "F", law_parameters=RUBBING)
    bound = characteristic_number(surface)
    assert bound.lower <= bound.upper == derivative_bound(surface, NORM)
    assert bound.upper > 2.0 * characteristic_number(Surface(FIVE, "F")).upper


def test_loops_of_a_user_defined_law_use_its_max_deflection() -> None:
    """The path is as long as the max_deflection of the law, and a larger one gives more energy."""
    surface = SURFACES["user-defined"]
    leak = worst_loop(surface)
    assert leak.energy > 0.0
    span = np.ptp(leak.vertices[:, :2], axis=0).max()
    assert span == pytest.approx(5e-5, rel=1e-6) or span == pytest.approx(1e-4, rel=1e-6)
    longer = Surface(WAVE, DRAGGED, law_parameters={"grip": 2.0, "max_deflection": 1e-4})
    assert worst_loop(longer).energy > 1.5 * leak.energy
