"""Coefficients of a large field, rounded to bricks of 16 bits: see :mod:`.field_record`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.textures.fields.field_record import (
    BRICK_ENTRIES,
    BRICK_LEVELS,
    BRICK_PLACES,
    BRICK_STEP,
    BRICK_VALUES,
    END,
    FIRST,
    ORIGIN_HIGH,
    ORIGIN_LOW,
    REACH,
    FieldArguments,
)

BRICK_BYTES = 2**24
"""Size of coefficients in single precision [bytes] above which a field is stored in bricks.

Less stays in the last cache of most processors, where decoding costs more than it saves
(``python -m bench bricks``).
"""
# Steps from the least to the greatest coefficient of a brick, and powers of two between the steps
# of bricks, which 16 bits hold; bits of single precision; exponent of no step.
_MOST_STEPS = 65532.0
_STEP_RANGE = 14
_PRECISION = 24
_NO_STEP = -1000

Coefficients = NDArray[np.float32]
Table = NDArray[np.int32]


class BrickPacker:
    """The stored columns of a field, as rows of bricks.

    Args:
        depths: at the nodes, less the offsets of their levels [m], (rows, columns, levels).
        offsets: of the levels [m].
        margin: added to depths [m].
        nodes: node stored at each place along the second and the first axis; -1: none.
        table: of the places, in levels.
    """

    def __init__(
        self,
        depths: Coefficients,
        offsets: Coefficients,
        margin: float,
        nodes: tuple[NDArray[np.intp], NDArray[np.intp]],
        table: Table,
    ) -> None:
        self.depths = depths
        self.offsets = offsets
        self.margin = np.float32(margin)
        self.nodes = nodes
        excess = [len(places) % 2 for places in nodes]
        self.excess = excess
        self.places = [np.pad(part, (0, n), "edge") for part, n in zip(nodes, excess, strict=True)]
        self.table = np.pad(table, ((0, excess[0]), (0, excess[1]), (0, 0)), "edge")
        self.slabs = -(-depths.shape[-1] // BRICK_LEVELS)

    def values(self, row: int) -> Coefficients:
        """Return the coefficients of a row of bricks [m], (columns, slabs, 28)."""
        rows, columns = self.places
        rows = rows[2 * row : 2 * row + 2]
        first, end = np.moveaxis(self.table[2 * row : 2 * row + 2, :, FIRST : END + 1], -1, 0)
        level = np.arange(self.depths.shape[-1])
        is_stored = (level >= first[..., None]) & (level < end[..., None])
        part = self.depths[rows[:, None], columns]
        part = np.where(is_stored, np.maximum(part + self.margin, -self.offsets), np.float32(0.0))
        excess = self.slabs * BRICK_LEVELS - part.shape[-1]
        part = np.pad(part, ((0, 0), (0, 0), (0, excess)), "edge")
        bricks = part.reshape(2, -1, 2, self.slabs, BRICK_LEVELS).transpose(1, 3, 4, 2, 0)
        return bricks.reshape(-1, self.slabs, BRICK_PLACES * BRICK_LEVELS)

    def exponents(self) -> NDArray[np.int32]:
        """Return the exponents of the steps of all bricks, (rows, columns, slabs).

        A node that is stored more than once, at both ends of an axis, is rounded to one step.
        """
        exponents = np.stack([_exponents(self.values(row)) for row in range(self.rows)])
        before = exponents - 1
        while not np.array_equal(before, exponents):
            before = exponents.copy()
            for axis, nodes in enumerate(self.nodes):
                for node in np.flatnonzero(np.bincount(nodes[nodes >= 0]) > 1):
                    same = np.unique(np.flatnonzero(nodes == node) // 2)
                    whole = np.moveaxis(exponents, axis, 0)
                    whole[same] = whole[same].max(axis=0)
        greatest = int(exponents.max(initial=_NO_STEP))
        return np.asarray(np.maximum(exponents, greatest - _STEP_RANGE))

    @property
    def rows(self) -> int:
        """Number of rows of bricks."""
        return len(self.places[0]) // 2

    def columns(self) -> Table:
        """Return the table of 2 x 2 columns, in bricks; the first brick is none of theirs."""
        shape = (self.rows, 2, len(self.places[1]) // 2, 2)
        entries = np.moveaxis(self.table, -1, 0)
        is_empty = (entries[FIRST] >= entries[END]).reshape(shape)
        first = (entries[FIRST] // BRICK_LEVELS).reshape(shape)
        first = np.where(is_empty, self.slabs, first).min(axis=(1, 3))
        end = -(-entries[END] // BRICK_LEVELS).reshape(shape)
        end = np.where(is_empty, 0, end).max(axis=(1, 3))
        first = np.minimum(first, end)
        reach = entries[REACH].reshape(shape).max(axis=(1, 3))
        starts = 1 + np.cumsum(end - first).reshape(first.shape) - (end - first)
        return np.stack([starts - first, first, end, reach], axis=-1).astype(np.int32)

    def pack(self) -> dict[str, Any]:
        """Return the coefficients rounded to bricks, as entries of the record of a field."""
        columns = self.columns()
        exponents = self.exponents()
        least = int(exponents.min())
        count = 1 + int((columns[..., END] - columns[..., FIRST]).sum())
        bricks = empty_bricks(count)
        bricks[0] = 0
        slab = np.arange(self.slabs)
        for row in range(self.rows):
            entry = columns[row, :, :, None]
            is_stored = (slab >= entry[:, FIRST]) & (slab < entry[:, END])
            places = (entry[:, 0] + slab)[is_stored]
            powers = exponents[row][is_stored]
            bricks[places] = _encode(self.values(row)[is_stored], powers, least)
        excess = {"excess_rows": self.excess[0], "excess_columns": self.excess[1]}
        unit = float(np.ldexp(1.0, least))
        return {"columns": columns, "bricks": bricks, "unit": unit, **excess}


def empty_bricks(count: int) -> NDArray[np.int16]:
    """Return bricks at multiples of their size: each is one line of the cache."""
    size = 2 * BRICK_ENTRIES
    memory = np.empty((count + 1) * size, np.uint8)
    start = -memory.ctypes.data % size
    return memory[start : start + count * size].view(np.int16).reshape(count, BRICK_ENTRIES)


def align_bricks(field: FieldArguments) -> FieldArguments:
    """Return the record of a field whose bricks have addresses that are multiples of their size."""
    bricks = empty_bricks(len(field.bricks))
    bricks[:] = field.bricks.reshape(bricks.shape)
    return field._replace(bricks=bricks) if len(bricks) else field


def _exponents(values: Coefficients) -> NDArray[np.int32]:
    """Return the exponents of the least steps in which coefficients (..., n) have 16 bits."""
    low = values.min(axis=-1).astype(float)
    high = values.max(axis=-1).astype(float)
    size = np.maximum(high, -low)
    steps = np.where(high > low, np.frexp((high - low) / _MOST_STEPS)[1], _NO_STEP)
    return np.maximum(steps, np.where(size > 0.0, np.frexp(size)[1] - _PRECISION, _NO_STEP))


def _encode(values: Coefficients, exponents: NDArray[np.int32], least: int) -> NDArray[np.int16]:
    """Return bricks (n, BRICK_ENTRIES) of coefficients (n, 28) [m] with steps of 2^exponents."""
    steps = np.rint(np.ldexp(values.astype(float), -exponents[:, None]))
    origin = np.floor(0.5 * (steps.min(axis=1) + steps.max(axis=1)))
    bricks = np.zeros((len(values), BRICK_ENTRIES), np.int16)
    bricks[:, ORIGIN_HIGH] = np.floor((origin + 2.0**15) * 2.0**-16)
    bricks[:, ORIGIN_LOW] = origin - 2.0**16 * bricks[:, ORIGIN_HIGH].astype(float)
    bricks[:, BRICK_STEP] = np.ldexp(1.0, exponents - least)
    bricks[:, BRICK_VALUES:] = steps - origin[:, None]
    return bricks
