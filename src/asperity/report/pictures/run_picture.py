"""Motion, force, energy and phase portrait of a simulated run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.recording.recording import Recording
from asperity.recording.replay import recorded_field
from asperity.recording.traced import Parts
from asperity.report.pictures import style
from asperity.simulation.run import MOST_ROWS

_MOST_POINTS = 6000
_AXES = ("x", "y", "z")
_COLOURS = (style.ORANGE, style.GREEN, style.BLUE)


Height = Callable[[FloatArray], FloatArray]
"""Returns the heights of the surface [m], shape (n,), at places (n, 2) [m]."""


def run_figure(run: Parts, height: Height) -> Figure:
    """Return height, force and energy against time, the path, and the phase portrait.

    Args:
        run: with its trace in memory.
        height: of the surface.
    """
    figure = style.new_figure(10.0, 8.2)
    grid: Any = figure.add_gridspec(3, 3, width_ratios=[1.0, 1.0, 0.95])
    step = max(1, -(-len(run.time) // _MOST_POINTS))
    shown = slice(None, None, step)
    motion = figure.add_subplot(grid[0, :2])
    force = figure.add_subplot(grid[1, :2], sharex=motion)
    energy = figure.add_subplot(grid[2, :2], sharex=motion)
    path, phase_z, phase_x = (figure.add_subplot(grid[i, 2]) for i in range(3))
    for axes in (motion, force, energy, path, phase_z, phase_x):
        style.dress(axes)
    _draw_motion(motion, run, height, shown)
    _draw_force(force, run, shown)
    _draw_energy(energy, run, shown)
    _draw_path(path, run, height, shown)
    _draw_phase(phase_z, run, 2, shown)
    _draw_phase(phase_x, run, _scan_axis(run), shown)
    return figure


def recording_figure(recording: Recording) -> Figure:
    """Return motion, force, energy and phase of a recording.

    Raises:
        ParameterError: for one with less than two rows, or without what is drawn.
    """
    traced = recording.traced(MOST_ROWS)
    if len(traced.table) < 2:
        raise ParameterError("recording", "needs at least two rows to be drawn")
    return run_figure(traced, recorded_field(recording).height)


def _scan_axis(run: Parts) -> int:
    """Return 0 or 1: along which the handle moves farther."""
    return int(np.argmax(np.ptp(run.position[:, :2], axis=0)))


def _draw_motion(axes: Axes, run: Parts, height_at: Height, shown: slice) -> None:
    time, place = run.time[shown], run.position[shown]
    height = height_at(place[:, :2])
    unit = style.length_unit(float(np.abs(np.append(place[:, 2], height)).max()))
    low = min(float(place[:, 2].min()), float(height.min())) * unit.scale
    axes.fill_between(time, height * unit.scale, low, color=style.BODY, lw=0.0, alpha=0.7)
    axes.plot(time, place[:, 2] * unit.scale, color=style.BLUE, lw=1.0, label="handle")
    if run.has("anchor z"):  # where the hand is, a device does not know
        anchor = run.part("anchor z")[shown, 0]
        if np.abs(anchor).max() < 4.0 * max(np.abs(place[:, 2]).max(), 1e-9):
            axes.plot(time, anchor * unit.scale, color=style.SOFT, lw=0.8, ls="--", label="hand")
            style.legend(axes)
    style.label(axes, "", f"z [{unit.name}]")
    style.entitle(axes, "Motion", "height of the handle over the surface below it")


def _moving(values: np.ndarray) -> list[int]:
    """Return the axes that are not zero throughout."""
    return [i for i in range(3) if np.any(values[:, i] != 0.0)] or [2]


def _draw_force(axes: Axes, run: Parts, shown: slice) -> None:
    applied = run.applied[shown]
    unit = style.force_unit(float(np.abs(applied).max()))
    for i in _moving(applied):
        axes.plot(
            run.time[shown], applied[:, i] * unit.scale, color=_COLOURS[i], lw=0.8, label=_AXES[i]
        )
    style.legend(axes)
    style.label(axes, "", f"force [{unit.name}]")
    style.entitle(axes, "Force", "applied to the handle")


def _draw_energy(axes: Axes, run: Parts, shown: slice) -> None:
    time = run.time[shown]
    if run.has("supplied x"):
        energies = run.energies
        supplied = energies["supplied"][shown] * 1e3
        for i in _moving(supplied):
            axes.plot(time, supplied[:, i], color=_COLOURS[i], lw=0.8, label=_AXES[i])
        total, paper = supplied.sum(axis=1), energies["same_sample"][shown].sum(axis=1) * 1e3
        axes.plot(time, total, color=style.INK, lw=1.4, label="sum, exact")
        axes.plot(time, paper, color=style.SOFT, lw=0.9, ls="--", label="the paper's sum")
    else:  # of a device: the sum alone
        total = run.part("supplied")[shown, 0] * 1e3
        axes.plot(time, total, color=style.INK, lw=1.4, label="sum, exact")
    style.zero_line(axes)
    style.legend(axes)
    style.label(axes, "time [s]", "energy [mJ]")
    style.entitle(axes, "Energy", "that the texture has supplied; up feeds the hand")


def _draw_path(axes: Axes, run: Parts, height_at: Height, shown: slice) -> None:
    i = _scan_axis(run)
    place = run.position[shown]
    wide = style.length_unit(float(np.abs(place[:, i]).max()))
    high = style.length_unit(float(np.abs(place[:, 2]).max()))
    low, top = float(place[:, i].min()), float(place[:, i].max())
    line = np.repeat(np.median(run.position, axis=0)[None, :2], 600, axis=0)
    line[:, i] = np.linspace(low, top, 600) if top > low else low
    height = height_at(line)
    floor = min(float(place[:, 2].min()), float(height.min()))
    axes.fill_between(
        line[:, i] * wide.scale, height * high.scale, floor * high.scale, color=style.BODY,
        lw=0.0, alpha=0.7,
    )  # fmt: skip
    axes.plot(
        place[:, i] * wide.scale, place[:, 2] * high.scale, color=style.BLUE, lw=0.7, label="path"
    )
    style.label(axes, f"{_AXES[i]} [{wide.name}]", f"z [{high.name}]")
    style.entitle(axes, "Path", f"in the {_AXES[i]}-z plane")


def _speed(run: Parts, i: int) -> FloatArray:
    """Return the velocity along an axis; of a device, that of its positions."""
    if run.has("vx", "vy", "vz"):
        return run.velocity[:, i]
    steps = np.diff(run.position[:, i]) / np.diff(run.time)
    return np.append(steps[:1], steps)


def _draw_phase(axes: Axes, run: Parts, i: int, shown: slice) -> None:
    place, speed = run.position[shown, i], _speed(run, i)[shown]
    unit = style.length_unit(float(np.abs(place).max()))
    fast = style.length_unit(float(np.abs(speed).max()))
    last = len(place) - max(len(place) // 4, 1)
    axes.plot(place * unit.scale, speed * fast.scale, color=style.FAINT, lw=0.6, label="phase")
    axes.plot(place[last:] * unit.scale, speed[last:] * fast.scale, color=style.BLUE, lw=0.8)
    style.label(axes, f"{_AXES[i]} [{unit.name}]", f"d{_AXES[i]}/dt [{fast.name}/s]")
    style.entitle(axes, "Phase", f"along {_AXES[i]}, last quarter blue")
