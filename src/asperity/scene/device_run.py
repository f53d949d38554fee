"""Run a surface in real time on the simulated device: ``run``."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from asperity.analysis.results.compare import DEFAULT_DEVICE, compare
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable, check_not_existing
from asperity.core.units import format_quantity
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import REGISTERED_LAWS, find_law
from asperity.laws.clamps import BACKED
from asperity.scene.loops import SceneLike, as_scene, make_loop
from asperity.scene.scene_file import Scene, surface_keywords
from asperity.scene.setup import SIMULATED_DRIVER, Setup
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import EndReason, LoopStatistics
from asperity.servo.process import LoopRecorder, PrestartedProcess, ServoProcess
from asperity.servo.safety import excess_stiffness_reason
from asperity.textures import Texture

POLL_INTERVAL = 0.05
"""Interval at which a loop is polled [s]."""


@dataclass(frozen=True)
class DeviceRun(Serializable):
    """A loop in real time that has ended.

    Attributes:
        scene: the closed loop that was run.
        ended: why it ended.
        notes: what the system did not permit, in sentences.
        statistics: counts of ticks and late ticks, periods, force, energy.
    """

    scene: Setup
    ended: EndReason
    notes: tuple[str, ...]
    statistics: LoopStatistics


def recommend_law_and_stiffness(
    texture: Texture,
    device: Device,
    surface: dict[str, Any],
    progress: Callable[[str], None] | None = None,
) -> tuple[dict[str, Any], str]:
    """Return surface arguments with the recommended law and stiffness, and a note about them.

    A law or a stiffness among the arguments is not replaced.

    Raises:
        ParameterError: if nothing can be recommended.
    """
    laws = list(REGISTERED_LAWS.values())
    if "law" in surface:
        laws = [find_law(surface["law"])]
    keywords = surface_keywords(surface, *laws)
    keywords.pop("law", None)
    result = compare(texture, device, laws, progress=progress, **keywords)
    row = result.recommended_row or result.nearest_row
    if "law" in surface:
        row = result.rows[0]
    if row is None:
        raise ParameterError("law", f"is missing, and none is recommended: {result.recommendation}")
    chosen = {**surface, "law": row.law}
    if "stiffness" in surface:
        return chosen, f"Law {row.law.letter}, as compare recommends"
    if not row.recommended_stiffness:
        reason = f"is missing, and none is known to be stable for law {row.law.letter}"
        raise ParameterError(
            "stiffness", f"{reason} on {device.id}: try {{stiffness}}", stiffness="100 N/m"
        )
    chosen["stiffness"] = row.recommended_stiffness
    stiffness = format_quantity(row.recommended_stiffness, "N/m")
    return chosen, f"Law {row.law.letter} at {stiffness}, as compare recommends"


_NO_HAND: dict[str, Any] = {
    "hand": {"kind": "moved"},
    "motion": {"kind": "still", "point": [0, 0, 0]},
}


def without_hand(scene: Scene) -> Scene:
    """Return a scene for a real device: its hand is not simulated."""
    servo = {name: section for name, section in scene.loop.items() if name == "servo"}
    return replace(scene, loop={**_NO_HAND, **servo})


def check_stiffness_limit(setup: Setup, *, accept_risk: bool = False) -> None:
    """Check that the stiffness is within the analyzed limit, unless the risk is accepted.

    Raises:
        ParameterError: otherwise, with the reason.
    """
    if not accept_risk and (reason := excess_stiffness_reason(setup.rendered, setup.device)):
        raise ParameterError(
            "stiffness", f"is refused: {reason}; {{accept_risk}} accepts it", accept_risk=True
        )


def simulated_process(setup: Setup, prestarted: PrestartedProcess | None = None) -> ServoProcess:
    """Return the process of a loop on the simulated device; it is not started."""
    driver = simulated_driver(
        setup.plant,
        setup.hand,
        setup.servo,
        setup.motion,
        setup.duration,
        setup.start,
        setup.velocity,
    )
    reach = setup.safety.reach_limit(setup.device)
    return ServoProcess(
        setup.rendered,
        driver,
        setup.servo,
        setup.safety,
        reach,
        setup.duration,
        prestarted=prestarted,
    )


def run(
    scene: SceneLike,
    *,
    device: DeviceLike | None = None,
    duration: float | None = None,
    record: str | Path | None = None,
    accept_risk: bool = False,
    progress: Callable[[float], None] | None = None,
    **surface_arguments: Any,
) -> DeviceRun:
    """Run a surface in real time on the simulated device, as ``asperity run`` does.

    The loop runs in a process of its own at the update rate of the device, with the limits of the
    section [servo]. A real device is run by the command ``asperity run --driver``, which releases
    the force at every signal and when the terminal is lost.

    Args:
        scene: as for :func:`~asperity.scene.loops.simulate`; or a texture with its arguments, or a
            measured file, which get a hand that strokes the surface and, unless they are given, the
            recommended law and stiffness.
        device: as for :func:`~asperity.scene.loops.simulate`.
        duration: in place of the scene's [s].
        accept_risk: whether a stiffness above the stability limit is allowed.
        record: path of a recording of every sample (``run.mcap``), which must not exist.
        progress: called with the fraction done.
        **surface_arguments: as for :func:`~asperity.scene.loops.simulate`.

    Raises:
        ParameterError: as for :func:`~asperity.scene.loops.simulate`; for a stiffness above the
            limit, and for a recording that exists.
        DeviceFault: for a fault, which sets the force to zero.

    Example:
        >>> result = run("sinusoid:amplitude=20um,period=1mm", law="C", stiffness=50, duration=0.2)
        >>> result.ended.name
        'FINISHED'
    """
    loaded = as_scene(scene)
    chosen = load_device(device or loaded.device or DEFAULT_DEVICE)
    surface = {"clamp": BACKED.name, **loaded.surface, **surface_arguments}
    note = ""
    if not {"law", "stiffness"} <= surface.keys() and "hand" not in loaded.loop:
        surface, note = recommend_law_and_stiffness(loaded.texture, chosen, surface)
    loaded = replace(loaded, surface=surface)
    setup = make_loop(
        run, loaded, chosen, surface_arguments, duration=duration, use_defaults=True
    ).with_rendering([note])
    check_stiffness_limit(setup, accept_risk=accept_risk)
    if record is not None:
        check_not_existing("record", Path(record), force=False)
    loop = simulated_process(setup)
    with ExitStack() as stack:
        stack.enter_context(loop)
        write_rows = None
        if record is not None:
            metadata = setup.recording_metadata(SIMULATED_DRIVER)
            recorder = LoopRecorder(record, loop, setup.rendered, setup.servo, metadata)
            write_rows = stack.enter_context(recorder).write_new_rows
        while (reason := loop.poll()) is EndReason.RUNNING:
            if write_rows is not None:
                write_rows()
            if progress is not None:
                progress(min(1.0, loop.statistics.samples * setup.servo.period / setup.duration))
            time.sleep(POLL_INTERVAL)
    return DeviceRun(setup, reason, loop.notes, loop.statistics)
