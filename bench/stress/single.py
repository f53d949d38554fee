"""Exported C in single precision: how far its forces are from those in double, and why.

``python -m bench.stress.single`` prints the share of probes of every law and texture kind whose
force is within 1e-5 of k max(|h|, |z|), and puts each of the others under the first witness that it
has:

- *position*: it is as near to forces in double along the path moved by four roundings of its
  largest coordinates. Positions are rounded on the way from metres to cells and phases;
- *tie* (laws that search for a nearest point): it is as long, of another point as near.

What has none is not explained.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from asperity.export.surface_functions import is_searching
from asperity.laws import LAWS
from asperity.surface import Surface
from bench.speed import cases
from bench.speed.c_programs import as_exported, header, library, probes, ticks
from bench.speed.timing import number_table

NEAR = 1e-5
PROBES = 2000


class SinglePrecisionError(NamedTuple):
    """Probes by what their force is; the largest error of those not near, over k max(|h|, |z|)."""

    near: int
    position: int
    tie: int
    unexplained: int
    worst: float


def measure_single_precision(
    surface: Surface, count: int = PROBES, seed: int = 3
) -> SinglePrecisionError:
    """Return how exported C in single precision compares with that in double, searched exactly."""
    surface = as_exported(surface)
    at = probes(surface.texture, surface.max_depth, count, seed).astype(np.float32)
    with tempfile.TemporaryDirectory() as directory:
        double, found = (
            _forces(surface, Path(directory), precision) for precision in ("double", "float")
        )
        return _compare_forces(surface, at.astype(float), double, found(at).astype(float))


def _forces(surface: Surface, folder: Path, precision: str) -> Any:
    """Return a function from positions to forces."""
    name = precision[0]
    text = header(surface, name, precision, folder, max_evaluations=np.inf)
    made = library(
        folder, "gcc", {name: text}, "-O1", "-Wdouble-promotion", single=precision == "float"
    )
    return partial(_first_three, made, name)


def _first_three(made: Any, name: str, at: Any) -> Any:
    return ticks(made, name, np.ascontiguousarray(at))[:, :3]


def _compare_forces(surface: Surface, at: Any, double: Any, found: Any) -> SinglePrecisionError:
    exact, k = double(at), surface.stiffness
    h = surface.texture.height(np.ascontiguousarray(at[:, :2]))
    size = k * np.maximum(np.abs(h), np.abs(at[:, 2]))
    error = np.abs(found - exact).max(axis=1)
    near = error <= NEAR * size
    position = error <= NEAR * size + _position_rounding_error(at, h, double, exact)
    length, whole = (np.linalg.norm(force, axis=1) for force in (found, exact))
    tie = (np.abs(length - whole) <= NEAR * size) & is_searching(surface.law.contact)
    left = np.ones(len(at), bool)
    counts = []
    for witness in (near, position, tie, left):
        counts.append(int((witness & left).sum()))
        left &= ~witness
    return SinglePrecisionError._make(
        [*counts, float(np.max(error[~near] / size[~near], initial=0.0))]
    )


def _position_rounding_error(at: Any, h: Any, double: Any, exact: Any) -> Any:
    """Return what the force changes by along the path moved by roundings of its coordinates."""
    across = 4.0 * float(np.spacing(np.float32(np.abs(at[:, :2]).max())))
    up = 4.0 * float(np.spacing(np.float32(max(np.abs(at[:, 2]).max(), np.abs(h).max()))))
    moves = np.array([[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, up]])
    others = [double(at + sign * move) for move in moves for sign in (-1.0, 1.0)]
    return np.max([np.abs(other - exact).max(axis=1) for other in others], axis=0)


def run(console: Console) -> None:
    """Print a row for each law and texture kind."""
    table = number_table("law, texture", "within 1e-5", "position", "tie", "not", "worst")
    for kind, texture in cases.textures().items():
        for law in LAWS:
            one = measure_single_precision(Surface(texture, law, clamp="backed"))
            shares = [f"{100.0 * part / PROBES:.2f} %" for part in one[:4]]
            table.add_row(f"{law}, {kind}", *shares, f"{one.worst:.1e}")
    console.print(f"float against double, {PROBES:,} probes for each law and texture kind:")
    console.print(table)


if __name__ == "__main__":
    run(Console(width=100, highlight=False))
