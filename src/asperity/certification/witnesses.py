"""Witnesses as paths that anybody can replay, and baselines for continuous integration."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity.certification.certify import Certification
from asperity.certification.loop_search import resample
from asperity.certification.region import RendererCalls, approach_paths, step_changes
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import open_input

_HEADINGS = ("witness", "x [m]", "y [m]", "z [m]", "fx [N]", "fy [N]", "fz [N]")
_LOOP_POINTS = 20_000
_BASELINE_POINTS = 512
_GAIN_TOLERANCE = 0.05
_MAX_BYTES = 2**28


@dataclass(frozen=True, eq=False)
class WitnessPath:
    """A path, walked after a reset, with the forces along it.

    Attributes:
        name: ``"gain"``, ``"one-sided gain"``, ``"loop"`` or ``"jump"``.
        path: [m], shape (m, 3).
        forces: [N], shape (m, 3).
    """

    name: str
    path: FloatArray
    forces: FloatArray

    @property
    def value(self) -> float:
        """What the forces show: gain [N/m], energy of the loop [J], or jump [N]."""
        if self.name == "loop":
            steps = np.diff(self.path, axis=0)
            return float((0.5 * (self.forces[1:] + self.forces[:-1]) * steps).sum())
        step = self.path[-1] - self.path[-2]
        changes, sizes = step_changes(self.forces[None])
        length = math.hypot(*step)
        if self.name == "one-sided gain":
            return -float(changes[0] @ step) / length**2
        return float(sizes[0]) / (1.0 if self.name == "jump" else length)


def witness_paths(result: Certification) -> dict[str, FloatArray]:
    """Return the path of each witness of a result [m], shape (m, 3)."""
    paths = {}
    gains = {"gain": result.gain_witness, "one-sided gain": result.one_sided_witness}
    for name, witness in gains.items():
        if witness is not None:
            start = np.array([witness.start])
            paths[name] = approach_paths(
                np.array([witness.approach]), start, np.array([witness.end])
            )[0]
    if result.jumps:
        jump = result.jumps[0]
        half = 0.5 * jump.length * np.array(jump.direction)
        approach = np.array([jump.approach])
        paths["jump"] = approach_paths(approach, jump.at - half[None], jump.at + half[None])[0]
    if result.worst_loop is not None:
        loop = resample(result.worst_loop.path, _LOOP_POINTS)
        paths["loop"] = np.concatenate([np.tile(loop, (result.worst_loop.turns, 1)), loop[:1]])
    return paths


def walk(calls: RendererCalls, paths: dict[str, FloatArray]) -> list[WitnessPath]:
    """Return witnesses with the forces of a renderer along their paths."""
    return [WitnessPath(name, path, calls.along(path[None])[0]) for name, path in paths.items()]


def witness_text(witnesses: list[WitnessPath]) -> str:
    """Return witnesses as CSV."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_HEADINGS)
    for witness in witnesses:
        for point, force in zip(witness.path.tolist(), witness.forces.tolist(), strict=True):
            writer.writerow([witness.name, *[f"{value:.17g}" for value in (*point, *force)]])
    return stream.getvalue()


def read_witnesses(path: str | Path) -> list[WitnessPath]:
    """Return the witnesses of a CSV file.

    Raises:
        ParameterError: for a file that is none.
    """
    rows: dict[str, list[list[float]]] = {}
    try:
        with open_input(path, _MAX_BYTES) as stream:
            table = list(csv.reader(stream.read().decode().splitlines()))
        if tuple(table[0]) != _HEADINGS:
            raise ValueError("its headings are not those of witnesses")
        for name, *numbers in table[1:]:
            rows.setdefault(name, []).append([float(number) for number in numbers])
        tables = {name: np.array(values).reshape(-1, 6) for name, values in rows.items()}
    except (OSError, ValueError, IndexError) as error:
        raise ParameterError("replay", f"{path} cannot be read: {error}") from None
    return [WitnessPath(name, table[:, :3], table[:, 3:]) for name, table in tables.items()]


# --- baselines -----------------------------------------------------------------------------------


def make_baseline(calls: RendererCalls, result: Certification) -> dict[str, Any]:
    """Return forces at fixed positions with gain, leak and jumps, as plain data."""
    from scipy.stats import qmc

    points = calls.region.points(qmc.Halton(3, seed=0).random(_BASELINE_POINTS))
    return {
        "schema": 1,
        "positions": points.tolist(),
        "forces": calls.at(points).tolist(),
        "gain": result.gain,
        "leak": result.leak,
        "jump": max((jump.size for jump in result.jumps), default=0.0),
    }


@dataclass(frozen=True, eq=False)
class BaselineDifference:
    """The first difference of a renderer from a baseline.

    Attributes:
        quantity: ``"force"``, ``"gain"``, ``"leak"`` or ``"jump"``.
        before: in the baseline, SI units.
        now: of the renderer.
        at: position of a force [m].
    """

    quantity: str
    before: Any
    now: Any
    at: tuple[float, ...] | None = None


def compare_baseline(
    calls: RendererCalls, result: Certification, path: str | Path, tolerance: float
) -> BaselineDifference | None:
    """Return the first difference from a baseline; ``None`` if there is none.

    Forces are the same within a tolerance [N] and the noise of the renderer; gain, leak and jumps
    are no worse by more than 5 %.

    Raises:
        ParameterError: for a file that is no baseline.
    """
    try:
        with open_input(path, _MAX_BYTES) as stream:
            baseline = json.load(stream)
        points = np.array(baseline["positions"], dtype=float).reshape(-1, 3)
        forces = np.array(baseline["forces"], dtype=float).reshape(-1, 3)
        limits = {name: float(baseline[name]) for name in ("gain", "leak", "jump")}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ParameterError("baseline", f"{path} is no file of results: {error}") from None
    now = calls.at(points)
    changes = np.abs(now - forces).max(axis=1)
    changed = np.flatnonzero(~(changes <= tolerance + result.resolution.force_error))
    if len(changed):
        first = int(changed[0])
        at = tuple(points[first].tolist())
        return BaselineDifference("force", forces[first].tolist(), now[first].tolist(), at)
    current = make_baseline(calls, result)
    for name, before in limits.items():
        if current[name] > (1.0 + _GAIN_TOLERANCE) * before + 1e-12:
            return BaselineDifference(name, before, current[name])
    return None
