"""Reports of a calibration and of a loop on a device, and the status line of a running loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from asperity.core.errors import escape_unprintable
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.report.document.page import Page, Paragraph, Row, Table, terminal_page
from asperity.report.pages.run_report import energy_text
from asperity.report.sentences.number_text import readable_name
from asperity.report.sentences.texts import table_data
from asperity.scene.setup import Setup
from asperity.servo.calibration.calibrator import AxisCalibration, Calibration
from asperity.servo.calibration.measured_device import effective_resolution, format_uncertainty
from asperity.servo.loop_memory import EndReason, LoopStatistics
from asperity.servo.process import ServoProcess

_CALIBRATION_HEADINGS = ("axis", "wall held", "cycled at", "damping N·s/m", "friction mN", "mass g")
_START_HEADINGS = ("law", "start before", "start now", "change")
_START_NOTE = "start: for q = 1, else divided by q; known damping makes it limit buzz (max_buzz)"
_QUANTILES = (0.5, 0.99, 0.999)
_CAUSE_TEXT = {EndReason.STOPPED: "stopped", EndReason.FINISHED: "done"}


def calibration_page(
    device: Device, calibration: Calibration, path: str, starts: Mapping[str, tuple[float, float]]
) -> Page:
    """Return the measured numbers with their uncertainties, for a terminal.

    Args:
        device: the calibrated device.
        calibration: its calibration.
        path: the device file.
        starts: recommended stiffness [N/m] of each law before and after the calibration, see
            :func:`~asperity.analysis.passivity.verdict.unit_starts`.
    """
    force = format_quantity(calibration.max_force, "N")
    rows = [Row(_calibration_cells(axis)) for axis in calibration.axes]
    changes = [Row(_start_cells(law, *pair)) for law, pair in starts.items()]
    numeric = range(1, len(_CALIBRATION_HEADINGS))
    return terminal_page(
        Paragraph(f"{device.name}: {len(calibration.axes)} axes, with up to {force}"),
        Table(_CALIBRATION_HEADINGS, rows, numeric),
        *map(Paragraph, _calibration_lines(calibration)),
        Table(_START_HEADINGS, changes, (1, 2, 3)),
        Paragraph(_START_NOTE),
        Paragraph(f"Written: {escape_unprintable(path)}", "code"),
    )


def _start_cells(law: str, before: float, after: float) -> tuple[str, ...]:
    cells = (format_quantity(one, "N/m") if one else "none" for one in (before, after))
    return law, *cells, f"{after / before:.2g} times" if before and after else "–"


def _calibration_cells(axis: AxisCalibration) -> tuple[str, ...]:
    wall = axis.wall
    motion = axis.dynamics
    cycling = wall.cycling_stiffness
    return (
        axis.name,
        format_quantity(wall.stable_stiffness, "N/m"),
        "none" if cycling is None else format_quantity(cycling, "N/m"),
        format_uncertainty(motion.damping),
        format_uncertainty(motion.friction, 1e3),
        format_uncertainty(motion.mass, 1e3),
    )


def _calibration_lines(calibration: Calibration) -> list[str]:
    """Return resolution, rate, delay and K₀, and the axes that could not be measured."""
    step = calibration.position_step
    delay = calibration.delay
    weakest = calibration.weakest_axis
    resolution = "exact" if step is None else f"step {format_uncertainty(step, 1e6)} µm"
    noise = format_uncertainty(calibration.noise, 1e6)
    effective = format_quantity(effective_resolution(calibration).value, "m")
    others = ", ".join(map(str, delay.alternatives))
    ambiguity = f", or {others}: not written" if others else ""
    stiffness = format_quantity(weakest.wall.stable_stiffness, "N/m")
    return [
        f"Positions: {resolution}; noise at rest {noise} µm; effective step {effective}",
        f"Rate: {format_uncertainty(calibration.update_rate)} Hz of new readings; delay: "
        f"{delay.samples} samples{ambiguity}",
        f"K₀: {stiffness}, along {weakest.name}, the weakest axis",
        *[
            f"- The handle does not move along {name}: nothing was measured there"
            for name in calibration.immobile_axes
        ],
    ]


def status_line(loop: ServoProcess) -> str:
    """Return time, position, force, energy and late samples of a running loop in one line."""
    rows, _first = loop.rows(loop.memory.row_count - 1)
    if not len(rows):
        return "waiting for the first sample"
    time, x, y, z, _cx, _cy, _cz, fx, fy, fz, _share, supplied = rows[-1, :12]
    place = ", ".join(f"{1e3 * value:+8.3f}" for value in (x, y, z))
    force = math.sqrt(fx * fx + fy * fy + fz * fz)
    late = loop.statistics.late
    return f"{time:8.2f} s  ({place}) mm  {force:6.3f} N  {energy_text(supplied):>10}  late {late}"


def timing_lines(statistics: LoopStatistics) -> list[str]:
    """Return late samples, start delay and period error of a loop.

    Example:
        >>> counts = [0] * 9 + [900] * 1 + [99, 1] + [0] * 29
        >>> for line in timing_lines(
        ...     LoopStatistics(1000, 1, 2, 2e-6, 0, 0, 0, tuple(counts), tuple(counts))
        ... ):
        ...     print(line)
        Late: 1 of 1000 samples finished after the next was due, 2 skipped
        Start delay:   50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs, worst 2 µs
        Period error:  50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs
    """

    def quantiles(quantile: Callable[[float], float]) -> str:
        spans = [f"{100.0 * q:g} % {format_quantity(quantile(q), 's')}" for q in _QUANTILES]
        return ", ".join(spans).replace("% ", "% within ", 1)

    worst = format_quantity(statistics.max_lateness, "s")
    return [
        f"Late: {statistics.late} of {statistics.samples} samples finished after the next was due, "
        f"{statistics.skipped} skipped",
        f"Start delay:   {quantiles(statistics.lateness_quantile)}, worst {worst}",
        f"Period error:  {quantiles(statistics.jitter_quantile)}",
    ]


def device_run_page(setup: Setup, loop: ServoProcess, cause: EndReason, path: str | None) -> Page:
    """Return timing, limits and energy of a loop that has ended, for a terminal."""
    statistics = loop.statistics
    rows = loop.rows(loop.memory.row_count - 1)[0]
    surface = setup.surface
    period = setup.servo.period
    driver = "" if loop.driver.has_moving_handle else f", {loop.driver.name}"
    span = format_quantity(period * statistics.samples, "s", digits=3)
    limited = [(getattr(statistics, name), text) for name, text in table_data("limited").items()]
    lines = [
        f"Law {surface.law.letter}, {readable_name(surface.law.name)}, at "
        f"{format_quantity(surface.stiffness, 'N/m')} on {setup.device.name}{driver}: "
        f"{_CAUSE_TEXT[cause]}",
        f"{statistics.samples} samples in {span}, at {format_quantity(1.0 / period, 'Hz')}",
        *timing_lines(statistics),
        *[text.format(count) for count, text in limited if count],
        *([f"Energy to the hand: {energy_text(float(rows[-1, 11]))}"] if len(rows) else ()),
        *[f"- {assumption}" for assumption in (*setup.assumptions, *loop.notes)],
    ]
    blocks = [Paragraph(line) for line in lines]
    if path is not None:
        blocks.append(Paragraph(f"Recording: {escape_unprintable(path)}", "code"))
    return terminal_page(*blocks)
