"""Results of loops, simulated, recorded and on a device, as sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from asperity.core.errors import escape_unprintable
from asperity.core.units import count_text, format_quantity
from asperity.devices import Device
from asperity.recording.recorded_field import LimitCounts
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay, recorded_limits
from asperity.report.sentences.surface_text import describe_texture
from asperity.report.sentences.texts import energy_text, sentence
from asperity.scene.doctor import MachineReport
from asperity.scene.setup import Setup
from asperity.servo.calibration.calibrator import Calibration
from asperity.servo.calibration.measured_device import effective_resolution, format_uncertainty
from asperity.servo.loop_memory import EndReason, LoopStatistics
from asperity.servo.process import ServoProcess
from asperity.simulation import Run
from asperity.simulation.onset import Prediction, is_at_rest
from asperity.simulation.onset_search import MotionState, felt_speed, motion_state
from asperity.simulation.scan import Stroke
from asperity.surface import Surface


def work_text(surface: Surface, run: Run) -> str:
    """Return the work that the texture did on the hand."""
    total = run.ledger.total
    energy = format_quantity(abs(total), "J", digits=3)
    if total == 0.0:
        work = "does no work"
    elif not math.isfinite(total):
        work = "delivers an energy that is not finite"
    elif total > 0.0:
        work = f"delivers {energy} to the hand"
    else:
        work = f"takes {energy} from the hand"
    stiffness = format_quantity(surface.stiffness, "N/m")
    duration = format_quantity(run.duration, "s")
    return f"Law {surface.law.letter} at {stiffness} {work} in {duration}"


def run_answer(setup: Setup, run: Run) -> str:
    """Return the result of a run in one or two sentences."""
    sentences = [work_text(setup.surface, run)]
    if run.stop_message:
        sentences.append(f"The run stopped: it {run.stop_message}")
    if not run.is_energy_balanced:
        sentences.append("The energy balance does not close: do not rely on this run")
    if run.truncated_ticks:
        sentences.append(search_error_text(run))
    sentences += limit_texts(run, run.surface.max_depth)
    if not run.stop_message:
        sentences.append(rest_text(setup, run))
    return f"{'. '.join(sentences)}."


def limit_texts(counts: Run | LoopStatistics | LimitCounts, max_depth: float) -> list[str]:
    """Return in how many samples the force was limited or the probe too deep, in sentences."""
    sentences = []
    if counts.force_limited:
        count = count_text(counts.force_limited, "sample")
        sentences.append(f"The device's force limit acts in {count}: not the force of the law")
    if counts.too_deep:
        depth = format_quantity(max_depth, "m")
        deepest = format_quantity(counts.deepest, "m", digits=3)
        count = count_text(counts.too_deep, "sample")
        below = f"The probe was below max_depth, {depth}, in {count}"
        sentences.append(f"{below}, up to {deepest} deep")
    return sentences


def search_error_text(run: Run) -> str:
    """Return the error bound of the forces where searches were truncated."""
    share = sentence("truncated", count=run.truncated_ticks, samples=run.samples)
    if run.surface.law.contact.bounds_force_error:
        error = format_quantity(run.surface.stiffness * run.search_error, "N", digits=2)
        return f"{share}: the error of the force was at most {error}"
    distance = format_quantity(run.search_error, "m", digits=2)
    return f"{share}: another point was nearer by at most {distance}"


_MOTION_TEXT = {
    MotionState.AT_REST: "comes to rest",
    MotionState.CYCLE: "keeps moving: a limit cycle",
    MotionState.NOT_FED: "still moves, but the texture does not feed it",
    MotionState.UNDECIDED: "still moves; a longer run tells whether it comes to rest",
}


def rest_text(setup: Setup, run: Run) -> str:
    """Return whether the handle came to rest."""
    if not is_at_rest(setup.motion, run.duration):
        return "The hand was moving to the end"
    if run.tail is None or not run.tail.is_complete:
        return "Too few samples were traced to decide whether the handle came to rest"
    before, last = run.tail.last_quarters
    speed = last.velocity_spread
    felt = felt_speed(speed, last.position_spread)
    state = motion_state(before, last, 0.25 * run.duration)
    verdict = _MOTION_TEXT[state]
    has_steps = setup.servo.position_resolution or setup.servo.force_resolution
    if state is MotionState.CYCLE and has_steps:
        verdict += ", or the chatter of steps"
    limit = format_quantity(felt, "m/s", digits=3)
    spread = format_quantity(speed, "m/s", digits=3)
    return sentence("rest", verdict=verdict, spread=spread, limit=limit)


def closure_text(run: Run) -> str:
    """Return definitions of the energies, and the relative residual."""
    ledger = run.ledger
    share = 0.0
    if ledger.exchanged > 0.0:
        share = abs(ledger.closure) / ledger.exchanged
    if not math.isfinite(share):
        return "The run diverged: its energies are not finite."
    exchanged = format_quantity(ledger.exchanged, "J", digits=3)
    return sentence("ledger", share=f"{share:.1g}", exchanged=exchanged)


def recording_answer(recording: Recording) -> str:
    """Return size, surface and completeness of a recording in one or two sentences."""
    period = row_period(recording.metadata)
    surface = surface_metadata(recording.metadata)
    text = f"{recording.rows} rows, {format_quantity(recording.duration, 's')}"
    if period:
        text += f" at {format_quantity(1.0 / period, 'Hz')}"
    if surface is not None:
        stiffness = format_quantity(float(surface["stiffness"]), "N/m")
        text += f": law {surface['law']} at {stiffness} on {describe_texture(surface['texture'])}"
    limits = recorded_limits(recording)
    if limits is not None:
        text = ". ".join([text, *limit_texts(limits, limits.max_depth)])
    return f"{text}. {_truncation_text(recording)}".rstrip()


def _truncation_text(recording: Recording) -> str:
    """Return why samples may be missing; nothing for a complete recording."""
    if recording.is_complete:
        return "" if recording.rows else "Nothing was recorded."
    if not recording.rows:
        return "The recording was not closed, and contains no complete block."
    if not recording.unread_bytes:
        return "The recording was not closed: it ends with the last complete block."
    return sentence("unread_block", count=recording.unread_bytes)


def surface_metadata(metadata: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the surface of a recording; ``None`` if its description is incomplete."""
    surface = metadata.get("surface")
    names = {"texture", "law", "law_name", "stiffness", "max_depth", "content"}
    if not isinstance(surface, Mapping) or not surface.keys() >= names:
        return None
    has_kind = isinstance(surface["texture"], Mapping) and "kind" in surface["texture"]
    if not has_kind or not _are_positive_numbers(surface["stiffness"], surface["max_depth"]):
        return None
    return surface


def row_period(metadata: Mapping[str, Any]) -> float:
    """Return the time from row to row [s]; 0 if it is not recorded."""
    servo = metadata.get("servo")
    every: Any = metadata.get("every", 1)
    if not isinstance(servo, Mapping) or not _are_positive_numbers(servo.get("period"), every):
        return 0.0
    return float(servo["period"] * every)


def _are_positive_numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) and value > 0 for value in values)


def replay_answer(replay: Replay) -> str:
    """Return the result of a replay in some sentences."""
    which = "rows"
    end = ""
    if replay.missing_before is not None:
        which = "rows before the first missing sample"
        time = format_quantity(replay.missing_before, "s")
        row = f"row {replay.rows} of {replay.recorded_rows}, at {time}"
        end = f" Samples are missing before {row}: the replay ends there."
    if replay.first_difference is None:
        texts = [f"All {replay.rows} {which} are reproduced bit for bit"]
        if replay.limits is not None:
            texts += limit_texts(replay.limits, replay.limits.max_depth)
        return f"{'. '.join(texts)}.{end}"
    first = replay.first_difference
    unit = ""
    if first.column.startswith("commanded"):
        unit = " N"
    elif "anchor" in first.column:
        unit = " m"
    values = f"{first.replayed_value} instead of {first.recorded_value}"
    where = f"row {first.row}, at {format_quantity(first.time, 's')}"
    difference = f"the first is {where}: {first.column} is {values}{unit}"
    largest = format_quantity(replay.max_force_difference, "N", digits=3)
    count = f"{replay.differing_rows} of {replay.rows} {which} differ"
    return f"{count}; {difference}. The largest difference of a force is {largest}.{end}"


_STEPPED_RULE = "The rule is proved for exact positions, not for steps of {}."
_SLOW_DECAY = (
    "The rule is a proof for exact positions: what moves below it decays, but counts as a cycle "
    "where the texture supplies at least nine tenths of what damping takes."
)


def onset_answer(setup: Setup, predictions: Sequence[Prediction]) -> str:
    """Return the result in two sentences."""
    sentences = [_delay_rule_text(predictions)]
    step = setup.servo.position_resolution
    if any(prediction.violates_delay_rule for prediction in predictions):
        resolution = format_quantity(step, "m")
        sentences.append(_STEPPED_RULE.format(resolution) if step else _SLOW_DECAY)
    textured = [prediction for prediction in predictions if not prediction.onset.is_smooth_wall]
    if any(prediction.wall_rule is not None for prediction in textured):
        sentences.append(_wall_rule_text(predictions))
    return " ".join(sentences)


def _delay_rule_text(predictions: Sequence[Prediction]) -> str:
    """Return the cases that cycle below the delay rule, or how many it holds for."""
    shares = [
        f"{_case_name(case)} ({100.0 * case.onset.cycling / case.delay_rule:.0f} %)"
        for case in predictions
        if case.violates_delay_rule
    ]
    if shares:
        return f"Limit cycles below the delay rule, at this share of it: {', '.join(shares)}."
    cases = count_text(sum([prediction.conservative for prediction in predictions]), "case")
    return f"No limit cycle below the delay rule, in {cases} of conservative laws."


def _wall_rule_text(predictions: Sequence[Prediction]) -> str:
    """Return the cases that cycle below K₀/q."""
    violating = [
        _case_name(prediction) for prediction in predictions if prediction.violates_wall_rule
    ]
    if violating:
        return f"K₀/q was too much for: {', '.join(violating)}."
    return "K₀/q was safe in all of them."


def _case_name(prediction: Prediction) -> str:
    return f"{prediction.onset.law} at d = {prediction.onset.delay}"


def stroke_answer(strokes: Sequence[Stroke]) -> str:
    """Return which laws deliver energy, and which do so by their field, in two sentences."""
    by_all = _group_laws(strokes, lambda stroke: stroke.total > stroke.spread + stroke.error)
    by_field = _group_laws(strokes, lambda stroke: stroke.gains_energy)
    return f"A stroke delivers energy: {by_all}. The field of the law itself does: {by_field}."


def _group_laws(strokes: Sequence[Stroke], gains_energy: Callable[[Stroke], bool]) -> str:
    laws = list(dict.fromkeys([stroke.law for stroke in strokes]))
    groups: dict[str, list[str]] = {"always": [], "at times": [], "never": []}
    for law in laws:
        gains = [gains_energy(stroke) for stroke in strokes if stroke.law == law]
        frequency = "at times"
        if all(gains):
            frequency = "always"
        elif not any(gains):
            frequency = "never"
        groups[frequency].append(law)
    return ", ".join([f"{', '.join(laws)} {when}" for when, laws in groups.items() if laws])


CAUSE_TEXT = {EndReason.STOPPED: "stopped", EndReason.FINISHED: "done"}


def calibration_lines(calibration: Calibration) -> list[str]:
    """Return resolution, rate, delay and K₀, and the axes that could not be measured."""
    step = calibration.position_step
    delay = calibration.delay
    weakest = calibration.weakest_axis
    resolution = "exact"
    if step is not None:
        resolution = f"step {format_uncertainty(step, 1e6)} µm"
    noise = format_uncertainty(calibration.noise, 1e6)
    effective = format_quantity(effective_resolution(calibration).value, "m")
    ambiguity = ""
    if delay.alternatives:
        ambiguity = f", or {', '.join(map(str, delay.alternatives))}: not written"
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
    place = ", ".join([f"{1e3 * value:+8.3f}" for value in (x, y, z)])
    force = math.sqrt(fx * fx + fy * fy + fz * fz)
    late = loop.statistics.late
    return f"{time:8.2f} s  ({place}) mm  {force:6.3f} N  {energy_text(supplied):>10}  late {late}"


def measured_energy_text(energy: float, step: float) -> str:
    """Return the energy to the hand that a loop measured, and the step of its positions [m]."""
    text = f"Energy to the hand: {energy_text(energy)}"
    if step:
        text += f", as measured in encoder steps of {format_quantity(step, 'm')}"
    return text


def timing_lines(statistics: LoopStatistics) -> list[str]:
    """Return late samples, start delay and period error of a loop.

    Example:
        >>> counts = [0] * 9 + [900] * 1 + [99, 1] + [0] * 29
        >>> for line in timing_lines(
        ...     LoopStatistics(1000, 1, 2, 2e-6, 0, 0, 0, 0.0, tuple(counts), tuple(counts))
        ... ):
        ...     print(line)
        Late: 1 of 1000 samples finished after the next was due, 2 skipped
        Start delay:   50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs, worst 2 µs
        Period error:  50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs
    """

    def quantiles(quantile: Callable[[float], float]) -> str:
        spans = [format_quantity(quantile(share), "s") for share in (0.5, 0.99, 0.999)]
        return f"50 % within {spans[0]}, 99 % {spans[1]}, 99.9 % {spans[2]}"

    worst = format_quantity(statistics.max_lateness, "s")
    return [
        f"Late: {statistics.late} of {statistics.samples} samples finished after the next was due, "
        f"{statistics.skipped} skipped",
        f"Start delay:   {quantiles(statistics.lateness_quantile)}, worst {worst}",
        f"Period error:  {quantiles(statistics.jitter_quantile)}",
    ]


_RATE_TOLERANCE = 0.99


def rate_lines(device: Device, period: float, statistics: LoopStatistics) -> list[str]:
    """Return the measured update rate, if it is below the one for which a stiffness holds.

    That is the rate of the loop, or that of the test of K₀ if it is less: a faster loop is not
    allowed more.

    Example:
        >>> from asperity.devices import load_device
        >>> statistics = LoopStatistics(700, 300, 300, 2e-3, 0, 0, 0, 0.0, (), ())
        >>> print(rate_lines(load_device("touch"), 1e-3, statistics)[0])
        Measured update rate 700 Hz, below 1 kHz: only 0.7 of the stiffness for that rate holds
    """
    needed = 1.0 / period
    test = device.wall_test
    if test is not None and test.update_rate is not None:
        needed = min(needed, test.update_rate)
    measured = statistics.measured_rate(period)
    if not statistics.samples or measured >= _RATE_TOLERANCE * needed:
        return []
    rates = [format_quantity(rate, "Hz", digits=3) for rate in (measured, needed)]
    return [
        f"Measured update rate {rates[0]}, below {rates[1]}: only {measured / needed:.2g} of the "
        "stiffness for that rate holds"
    ]


def limited_lines(statistics: LoopStatistics, max_depth: float) -> list[str]:
    """Return in how many samples a limit was active, and why that matters."""
    lines = limit_texts(statistics, max_depth)
    if statistics.slew_limited:
        count = count_text(statistics.slew_limited, "sample")
        lines.append(f"The slew limit acts in {count}: not the force of the law")
    return lines


def machine_lines(report: MachineReport) -> list[str]:
    """Return system, versions, timing of the loop, drivers and cache, in lines."""
    versions = [f"{name} {number}" for name, number in report.versions.items()]
    loop = [f"Simulated loop: it did not run: {report.failure}"]
    if report.statistics is not None:
        loop = ["Simulated loop at 1 kHz:", *_indent(timing_lines(report.statistics))]
        loop += _indent(report.notes or ["Real-time priority is granted"])
    drivers = [f"{driver.name}: {driver.failure or 'found'}" for driver in report.drivers]
    size = f"{report.cache_size / 1e6:.1f} MB of at most {report.cache_limit / 1e6:.1f} MB"
    return [
        f"System: {report.system}, {count_text(report.cores, 'core')}",
        f"Versions: {', '.join(versions)}",
        f"Installed plugins: {', '.join(report.plugins) or 'none'}",
        *loop,
        "Drivers:",
        *_indent(drivers),
        f"Cache: {escape_unprintable(report.cache_folder)}, {size}",
    ]


def _indent(lines: list[str] | tuple[str, ...]) -> list[str]:
    return [f"  {line}" for line in lines]
