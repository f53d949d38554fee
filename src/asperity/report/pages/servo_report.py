"""Reports of a calibration and of a loop on a device, and the status line of a running loop."""

from __future__ import annotations

from collections.abc import Mapping

from asperity.core.errors import escape_unprintable
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.report.document.page import Page, Paragraph, Row, Table, terminal_page
from asperity.report.sentences.loop_text import CAUSE_TEXT, calibration_lines, timing_lines
from asperity.report.sentences.number_text import NOT_AVAILABLE, energy_text, readable_name
from asperity.report.sentences.texts import table_data
from asperity.scene.setup import Setup
from asperity.servo.calibration.calibrator import AxisCalibration, Calibration
from asperity.servo.calibration.measured_device import format_uncertainty
from asperity.servo.loop_memory import EndReason
from asperity.servo.process import ServoProcess

_CALIBRATION_HEADINGS = ("axis", "wall held", "cycled at", "damping N·s/m", "friction mN", "mass g")
_START_HEADINGS = ("law", "start before", "start now", "change")
_START_NOTE = "start: for q = 1, else divided by q; known damping makes it limit buzz (max_buzz)"


def calibration_page(
    device: Device, calibration: Calibration, path: str, starts: Mapping[str, tuple[float, float]]
) -> Page:
    """Return the measured numbers with their uncertainties, for a terminal.

    Args:
        device: the calibrated device.
        calibration: its calibration.
        path: the device file.
        starts: recommended stiffness [N/m] of each law before and after the calibration, see
            :func:`~asperity.analysis.passivity.recommended_stiffness.unit_starts`.
    """
    force = format_quantity(calibration.max_force, "N")
    rows = [Row(_calibration_cells(axis)) for axis in calibration.axes]
    changes = [Row(_start_cells(law, *pair)) for law, pair in starts.items()]
    numeric = range(1, len(_CALIBRATION_HEADINGS))
    return terminal_page(
        Paragraph(f"{device.name}: {len(calibration.axes)} axes, with up to {force}"),
        Table(_CALIBRATION_HEADINGS, rows, numeric),
        *map(Paragraph, calibration_lines(calibration)),
        Table(_START_HEADINGS, changes, (1, 2, 3)),
        Paragraph(_START_NOTE),
        Paragraph(f"Written: {escape_unprintable(path)}", "code"),
    )


def _start_cells(law: str, before: float, after: float) -> tuple[str, ...]:
    change = NOT_AVAILABLE
    if before and after:
        change = f"{after / before:.2g} times"
    return law, _start_text(before), _start_text(after), change


def _start_text(stiffness: float) -> str:
    return format_quantity(stiffness, "N/m") if stiffness else "none"


def _calibration_cells(axis: AxisCalibration) -> tuple[str, ...]:
    wall = axis.wall
    motion = axis.dynamics
    return (
        axis.name,
        format_quantity(wall.stable_stiffness, "N/m"),
        _start_text(wall.cycling_stiffness or 0.0),
        format_uncertainty(motion.damping),
        format_uncertainty(motion.friction, 1e3),
        format_uncertainty(motion.mass, 1e3),
    )


def device_run_page(setup: Setup, loop: ServoProcess, cause: EndReason, path: str | None) -> Page:
    """Return timing, limits and energy of a loop that has ended, for a terminal."""
    statistics = loop.statistics
    rows = loop.rows(loop.memory.row_count - 1)[0]
    surface = setup.surface
    period = setup.servo.period
    device = setup.device.name
    if not loop.driver.has_moving_handle:
        device += f", {loop.driver.name}"
    span = format_quantity(period * statistics.samples, "s", digits=3)
    limited = [(getattr(statistics, name), text) for name, text in table_data("limited").items()]
    lines = [
        f"Law {surface.law.letter}, {readable_name(surface.law.name)}, at "
        f"{format_quantity(surface.stiffness, 'N/m')} on {device}: "
        f"{CAUSE_TEXT[cause]}",
        f"{statistics.samples} samples in {span}, at {format_quantity(1.0 / period, 'Hz')}",
        *timing_lines(statistics),
        *[text.format(count) for count, text in limited if count],
        *[f"Energy to the hand: {energy_text(float(row[11]))}" for row in rows[-1:]],
        *[f"- {assumption}" for assumption in (*setup.assumptions, *loop.notes)],
    ]
    blocks = [Paragraph(line) for line in lines]
    if path is not None:
        blocks.append(Paragraph(f"Recording: {escape_unprintable(path)}", "code"))
    return terminal_page(*blocks)
