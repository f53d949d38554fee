"""Integer relations of wave vectors."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator

import numpy as np
import pytest

from asperity.textures.plane_waves import integer_lattice

PROFILES = {
    "one wave": ([[3.0, 4.0]], [5.0]),
    "a harmonic": ([[2.0, 0.0], [6.0, 0.0]], [2.0]),
    "the least common measure": ([[4.0, 0.0], [6.0, 0.0]], [2.0]),
    "three of them": ([[6.0, 8.0], [9.0, 12.0], [-3.75, -5.0]], [1.25]),
    "64:63": ([[64.0, 0.0], [63.0, 0.0]], [1.0]),
    "in any order": ([[15.0, 0.0], [6.0, 0.0], [10.0, 0.0]], [1.0]),
    "opposite": ([[2.0, 1.0], [-2.0, -1.0]], [math.sqrt(5.0)]),
    "repeated": ([[2.0, 1.0], [2.0, 1.0]], [math.sqrt(5.0)]),
}
# Waves and the area of the cell of their integer lattice.
PLANES = {
    "square": ([[3.0, 0.0], [0.0, 3.0]], 9.0),
    "centred": ([[2.0, 0.0], [0.0, 2.0], [1.0, 1.0]], 2.0),
    "hexagonal": ([[1.0, 0.0], [0.5, math.sqrt(0.75)], [-0.5, math.sqrt(0.75)]], math.sqrt(0.75)),
    "long vectors": ([[21.0, 3.0], [-5.0, 17.0], [16.0, 20.0], [47.0, -11.0]], 372.0),
}
FREE = {
    "rank 2 on a line": ([[1.0, 0.0], [math.sqrt(2), 0.0]], 2),
    "rank 2 on a line, three waves": ([[1.0, 0.0], [math.sqrt(2), 0.0], [1 + math.sqrt(2), 0]], 2),
    "rank 3 in the plane": ([[1.0, 0.0], [0.0, 1.0], [math.sqrt(2), 0.3]], 3),
    "rank 3, four waves": (
        [[1.0, 0.0], [0.0, 1.0], [math.sqrt(2), 0.3], [1 + math.sqrt(2), 1.3]],
        3,
    ),
    "rank 3 with a half": (
        [[1.0, 0.0], [0.0, 1.0], [math.sqrt(2), 0.3], [math.sqrt(2) / 2, 0.15]],
        3,
    ),
    "nearly a ratio": ([[1.0, 0.0], [2.0 + 1e-6, 0.0]], 2),
}


@pytest.mark.parametrize(("waves", "length"), PROFILES.values(), ids=list(PROFILES))
def test_basis_of_waves_on_a_line(waves: list[list[float]], length: list[float]):
    basis, _multiples = integer_lattice(np.array(waves))
    np.testing.assert_allclose(np.hypot(*basis.T), length, rtol=1e-12)


@pytest.mark.parametrize(("waves", "area"), PLANES.values(), ids=list(PLANES))
def test_basis_of_waves_in_the_plane(waves: list[list[float]], area: float):
    basis, _multiples = integer_lattice(np.array(waves))
    assert basis.shape == (2, 2)
    assert abs(np.linalg.det(basis)) == pytest.approx(area, rel=1e-9)
    a, b = basis  # reduced basis: no combination is shorter
    assert abs(a @ b) <= 0.5 * min(a @ a, b @ b) * (1 + 1e-12)


@pytest.mark.parametrize(("waves", "rank"), FREE.values(), ids=list(FREE))
def test_number_of_free_phases(waves: list[list[float]], rank: int):
    basis, _multiples = integer_lattice(np.array(waves))
    assert len(basis) == rank


ALL_WAVES = [waves for group in (PROFILES, PLANES, FREE) for waves, _ in group.values()]


@pytest.mark.parametrize("waves", ALL_WAVES, ids=[*PROFILES, *PLANES, *FREE])
def test_every_wave_is_an_integer_combination(waves: list[list[float]]):
    vectors = np.array(waves)
    basis, multiples = integer_lattice(vectors)
    assert multiples.shape == (len(vectors), len(basis))
    np.testing.assert_array_equal(multiples, np.round(multiples))
    np.testing.assert_allclose(multiples @ basis, vectors, rtol=0, atol=1e-8)


def test_zero_wave_vectors_are_ignored():
    basis, multiples = integer_lattice(np.array([[0.0, 0.0], [2.0, 0.0]]))
    np.testing.assert_array_equal(basis, [[2.0, 0.0]])
    np.testing.assert_array_equal(multiples, [[0.0], [1.0]])
    assert integer_lattice(np.zeros((2, 2)))[0].shape == (0, 2)


@pytest.fixture
def time_limit() -> Iterator[None]:
    """Stop a test after 20 s that would run for hours."""

    def raise_timeout(*_: object) -> None:
        raise TimeoutError("this would run for hours")

    before = signal.signal(signal.SIGALRM, raise_timeout)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("time_limit")
def test_many_unrelated_waves_have_free_phases():
    """Noise may have dozens of waves, so the search must not be exponential in their number."""
    waves = np.random.default_rng(7).normal(size=(12, 2)) * 1000.0
    basis, multiples = integer_lattice(waves)
    assert len(basis) == 12
    np.testing.assert_array_equal(multiples @ basis, waves)


@pytest.mark.usefixtures("time_limit")
def test_rotated_hexagonal_lattices_are_periodic():
    """The reduction must end although the shortest vectors are equally long up to rounding."""
    rng = np.random.default_rng(0)
    for _ in range(100):
        angles = rng.uniform(0.0, 4.0) + np.arange(3) * math.pi / 3
        number = 2 * math.pi / (round(rng.uniform(0.1, 9.9), 1) * 1e-3)
        rays = number * np.column_stack([np.cos(angles), np.sin(angles)])
        basis, multiples = integer_lattice(np.concatenate([rays, 2.0 * rays]))
        assert basis.shape == (2, 2)
        assert np.hypot(*basis.T) == pytest.approx(number, rel=1e-12)
        np.testing.assert_allclose(multiples @ basis, np.concatenate([rays, 2.0 * rays]), rtol=1e-9)


def test_waves_from_wavelengths_are_related_despite_rounding():
    rng = np.random.default_rng(1)
    for _ in range(500):
        length, angle = round(rng.uniform(0.1, 9.9), 2) * 1e-3, math.radians(rng.integers(0, 360))
        numbers = 2 * math.pi / (length / rng.integers(1, 9, 3))
        waves = numbers[:, None] * [math.cos(angle), math.sin(angle)]
        assert len(integer_lattice(waves)[0]) == 1


@pytest.mark.parametrize("deviation", [1e-15, 1e-14, 1e-12, 1e-9])
def test_nearly_rational_ratio_is_irrational(deviation: float):
    """A deviation of five roundings exceeds the error of a wavenumber from a wavelength."""
    for factor in (1.0, 2.0, 1.5, 63 / 64):
        waves = 6283.185307179586 * np.array([[1.0, 0.0], [factor * (1.0 + deviation), 0.0]])
        assert len(integer_lattice(waves)[0]) == 2
    tilted = np.array([[1.0, 0.0], [0.5, 0.8], [1.5 + 40 * deviation, 0.8]])
    assert len(integer_lattice(tilted)[0]) == 3
