"""Simulations of a scene by one call each: ``simulate``, ``onset`` and ``scan``."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from asperity.core.checks import check_keywords
from asperity.core.errors import ParameterError
from asperity.devices import DeviceLike, load_device
from asperity.frictional import check_arguments_apply
from asperity.laws import REGISTERED_LAWS, Law, find_law, find_laws, registered_arguments
from asperity.scene.scene_file import SURFACE_FIELDS, Scene, load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.scene.sweeps import (
    DEFAULT_DELAYS,
    DEFAULT_SPEEDS,
    DEFAULT_STARTS,
    DEFAULT_TOLERANCE,
    OnsetSweep,
    StrokeSweep,
    sweep_onsets,
    sweep_strokes,
)
from asperity.simulation import Run
from asperity.simulation.onset import MIN_STIFFNESS

SceneLike = Scene | str | os.PathLike[str]
Laws = str | Sequence[str | Law]


def as_scene(scene: SceneLike) -> Scene:
    """Return the scene of a path, or the scene itself."""
    if not isinstance(scene, (Scene, str, os.PathLike)):
        raise ParameterError("scene", "must be the path of a scene file, or a Scene", scene)
    if isinstance(scene, Scene):
        return scene
    return load_scene(os.fspath(scene))


def make_loop(
    function: Callable[..., Any],
    scene: SceneLike,
    device: DeviceLike | None,
    arguments: Mapping[str, Any],
    laws: Sequence[Law] = (),
    **options: Any,
) -> Setup:
    """Return the closed loop of a scene, with the arguments that a function was given.

    Args:
        function: the function, for messages.
        scene: see :func:`simulate`.
        device: see :func:`simulate`.
        arguments: arguments of [surface], in place of the scene's.
        laws: laws of a sweep, which replace the scene's.
        options: further arguments of :func:`~asperity.scene.setup.make_setup`.
    """
    loaded = as_scene(scene)
    surface = {**loaded.surface, **arguments}
    accepted = {argument.name for argument in SURFACE_FIELDS}
    used = list(laws)
    if laws:
        # The law of the surface is replaced by each of a sweep.
        surface = {**loaded.surface, "law": "W", **arguments}
        accepted.remove("law")
    elif "law" in surface:
        used = [find_law(surface["law"])]
    known = registered_arguments([*REGISTERED_LAWS.values(), *used])
    check_keywords(arguments, accepted.union(known), function)
    check_arguments_apply(arguments, used)
    if device is not None:
        device = load_device(device)
    return make_setup(loaded, surface=surface, device=device, laws=laws, **options)


def _find_laws(laws: Laws | None) -> tuple[Law, ...]:
    """Return the laws of a sweep; all registered ones by default."""
    if laws is None:
        return tuple(REGISTERED_LAWS.values())
    return find_laws(laws)


def simulate(
    scene: SceneLike,
    *,
    device: DeviceLike | None = None,
    duration: float | None = None,
    trace: bool | str | Path = True,
    progress: Callable[[float], None] | None = None,
    **surface_arguments: Any,
) -> Run:
    """Simulate the closed loop of a scene, as ``asperity simulate`` does.

    Args:
        scene: path of a scene file (TOML), or a :class:`~asperity.scene.Scene`, with the sections
            [hand] and [motion].
        device: device in place of the scene's: an id, a TOML file, or a device.
        duration: in place of the scene's [s].
        trace: whether to keep the samples, or the path of a file for them; see
            :func:`asperity.simulation.simulate`.
        progress: called with the fraction done.
        **surface_arguments: in place of those of the section [surface]: ``law``, ``stiffness``,
            ``max_depth``, ``clamp``, ``rendering``, parameters of the law.

    Raises:
        ParameterError: for a missing section, an unknown argument, one that the law does not take,
            or an invalid value.

    Example:
        >>> run = simulate("examples/stroke.toml", law="C", duration=0.05)
        >>> run.samples, run.is_energy_balanced
        (500, True)
    """
    setup = make_loop(simulate, scene, device, surface_arguments, duration=duration)
    return setup.with_rendering().simulate(trace=trace, progress=progress)


def onset(
    scene: SceneLike,
    laws: Laws | None = None,
    delays: int | Sequence[int] = DEFAULT_DELAYS,
    *,
    device: DeviceLike | None = None,
    duration: float | None = None,
    n_phases: int = DEFAULT_STARTS,
    tolerance: float = DEFAULT_TOLERANCE,
    min_stiffness: float = MIN_STIFFNESS,
    progress: Callable[[], None] | None = None,
    **surface_arguments: Any,
) -> OnsetSweep:
    """Find the stiffness at which limit cycles begin, for each law and delay.

    Args:
        scene: as for :func:`simulate`; its hand must come to rest.
        laws: letters, names, or laws; all by default.
        delays: delays [samples].
        device: as for :func:`simulate`.
        duration: as for :func:`simulate`.
        n_phases: phases of the texture at which the handle starts.
        tolerance: relative width of the bracket.
        min_stiffness: lowest stiffness to try [N/m].
        progress: called after every law and delay.
        **surface_arguments: as for :func:`simulate`, without law and stiffness.

    Raises:
        ParameterError: as for :func:`simulate`, and for a hand that does not come to rest.

    Example:
        >>> result = onset("examples/press.toml", "W", 1, n_phases=2)
        >>> [row["law"] for row in result.table_rows()]
        ['W']
    """
    if "stiffness" in surface_arguments:
        raise ParameterError("stiffness", "is the result of onset: leave it out")
    chosen = _find_laws(laws)
    setup = make_loop(
        onset, scene, device, surface_arguments, chosen, duration=duration, uses_delay=False
    )
    return sweep_onsets(
        setup,
        chosen,
        delays,
        n_phases=n_phases,
        tolerance=tolerance,
        min_stiffness=min_stiffness,
        progress=progress,
    )


def scan(
    scene: SceneLike,
    laws: Laws | None = None,
    *,
    device: DeviceLike | None = None,
    speeds: float | Sequence[float] = DEFAULT_SPEEDS,
    depths: float | Sequence[float] | None = None,
    strokes: int | None = None,
    progress: Callable[[float], None] | None = None,
    **surface_arguments: Any,
) -> StrokeSweep:
    """Simulate strokes on the surface of a scene: energy by law, speed and depth.

    Args:
        scene: as for :func:`simulate`; its motion must consist of strokes.
        laws: letters, names, or laws; all by default.
        device: as for :func:`simulate`.
        speeds: speeds of the hand [m/s].
        depths: depths of the hand below z = 0 [m]; the motion's by default.
        strokes: number of strokes of a run; the motion's by default, at least 5.
        progress: called with the fraction done.
        **surface_arguments: as for :func:`simulate`, without law.

    Raises:
        ParameterError: as for :func:`simulate`, and for another motion.

    Example:
        >>> result = scan("examples/stroke.toml", "AC", speeds=0.1, strokes=3)
        >>> [(row["law"], row["gains energy"]) for row in result.table_rows()]
        [('A', True), ('C', False)]
    """
    chosen = _find_laws(laws)
    setup = make_loop(scan, scene, device, surface_arguments, chosen)
    return sweep_strokes(
        setup, chosen, speeds=speeds, depths=depths, strokes=strokes, progress=progress
    )
