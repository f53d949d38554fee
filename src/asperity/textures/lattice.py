"""Which integer combinations a set of wave vectors is made of: the periods of a Fourier sum."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np

from asperity.checks import FloatArray

_LARGEST_DENOMINATOR = 64
_LARGEST_MULTIPLE = 8
_TOLERANCE = 1e-9


def integer_basis(waves: FloatArray) -> FloatArray:
    """Return a basis B, shape (r, 2), with every wave vector an integer combination of its rows.

    r is the number of independent phases: 1 for a periodic profile, 2 for a doubly periodic
    map, more for sums that never repeat. Ratios are recognised as rational up to denominator 64
    and a relative error of 1e-9.

    Args:
        waves: wave vectors [rad/m], shape (n, 2).

    Example:
        >>> integer_basis(np.array([[4.0, 0.0], [6.0, 0.0]]))
        array([[2., 0.]])
    """
    basis = np.zeros((0, 2))
    for wave in waves[np.argsort(np.hypot(*waves.T), kind="stable")]:
        if not wave.any():
            continue
        relation = _relation(basis, wave)
        if relation is None:
            basis = np.vstack([basis, wave])
            continue
        denominator, multiples = relation
        if denominator > 1:
            rows = [
                [denominator * int(i == j) for j in range(len(basis))] for i in range(len(basis))
            ]
            basis = np.array(_row_basis([*rows, multiples]), dtype=float) @ basis / denominator
    return _shorten(basis)


def multiples_of(basis: FloatArray, waves: FloatArray) -> FloatArray:
    """Return integers N, shape (n, r), with waves = N @ basis.

    Example:
        >>> multiples_of(np.array([[2.0, 0.0]]), np.array([[4.0, 0.0], [6.0, 0.0]]))
        array([[2.],
               [3.]])
    """
    result = np.zeros((len(waves), len(basis)))
    for row, wave in enumerate(waves):
        if wave.any():
            relation = _relation(basis, wave)
            assert relation is not None
            result[row] = relation[1]
    return result


def _relation(basis: FloatArray, wave: FloatArray) -> tuple[int, list[int]] | None:
    """Return q and n with q·wave = n @ basis, or nothing if there are none of modest size."""
    rank = len(basis)
    if rank == 0:
        return None
    scale = float(np.hypot(*wave))
    if rank <= 2 and np.linalg.matrix_rank(basis, tol=_TOLERANCE * np.abs(basis).max()) == rank:
        real = np.linalg.lstsq(basis.T, wave, rcond=None)[0]
        if np.abs(real @ basis - wave).max() > _TOLERANCE * scale:
            return None
        parts = [Fraction(float(c)).limit_denominator(_LARGEST_DENOMINATOR) for c in real]
        close = np.array([float(p) for p in parts]) @ basis - wave
        if np.abs(close).max() > _TOLERANCE * scale:
            return None
        q = math.lcm(*(p.denominator for p in parts))
        return q, [int(p * q) for p in parts]
    span = range(-_LARGEST_MULTIPLE, _LARGEST_MULTIPLE + 1)
    for q in range(1, _LARGEST_MULTIPLE + 1):
        for combination in itertools.product(span, repeat=rank):
            if np.abs(np.array(combination) @ basis - q * wave).max() <= _TOLERANCE * scale:
                return q, list(combination)
    return None


def _row_basis(rows: list[list[int]]) -> list[list[int]]:
    """Return a basis of the integer row space (Hermite normal form by the Euclidean algorithm)."""
    rows = [row[:] for row in rows]
    result = []
    for column in range(len(rows[0])):
        while sum(row[column] != 0 for row in rows) > 1:
            rows.sort(key=lambda row: (row[column] == 0, abs(row[column])))
            pivot = rows[0]
            for row in rows[1:]:
                factor = row[column] // pivot[column]
                row[:] = [a - factor * b for a, b in zip(row, pivot, strict=True)]
        rows.sort(key=lambda row: row[column] == 0)
        if rows and rows[0][column] != 0:
            result.append(rows.pop(0))
    return result


def _shorten(basis: FloatArray) -> FloatArray:
    """Return a basis of short vectors of a planar lattice (Lagrange-Gauss reduction)."""
    if len(basis) != 2 or abs(np.linalg.det(basis)) < _TOLERANCE * np.abs(basis).max() ** 2:
        return basis
    a, b = basis
    while True:
        if a @ a > b @ b:
            a, b = b, a
        factor = round(float(a @ b / (a @ a)))
        if factor == 0:
            return np.array([a, b])
        b = b - factor * a
