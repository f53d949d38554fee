"""Simulations of a scene by one call each: ``simulate``, ``onset`` and ``scan``."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.core.checks import check_keywords
from asperity.core.display import Reportable, Tabular
from asperity.core.files import to_plain_data
from asperity.devices import Device, load_device
from asperity.laws import REGISTERED_LAWS, Law, find_laws
from asperity.scene.scene_file import Scene, load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.scene.sweeps import sweep_onsets, sweep_strokes
from asperity.simulation import Run
from asperity.simulation.limit_cycles.onset import Prediction
from asperity.simulation.scan import Stroke

SCHEMA = 2
DEFAULT_DELAYS = tuple(range(6))  # [samples]
_ALL_LAWS = tuple(REGISTERED_LAWS)

SceneLike = str | os.PathLike[str] | Scene
DeviceLike = str | os.PathLike[str] | Device
Laws = str | Sequence[str | Law]


@dataclass(frozen=True)
class OnsetSweep(Reportable, Tabular):
    """The onset of limit cycles of a scene, for each law and delay.

    Attributes:
        setup: the closed loop.
        onsets: one for each law and delay, laws first.
    """

    setup: Setup
    onsets: tuple[Prediction, ...]

    def __repr__(self) -> str:
        return f"<OnsetSweep of {len(self.onsets)} onsets on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, delay, bracket of the onset and the rules; SI units."""
        return [
            {
                "law": one.onset.law,
                "delay [samples]": one.onset.delay,
                "quiet [N/m]": one.onset.quiet,
                "cycling [N/m]": one.onset.cycling,
                "cycling starts": one.onset.cycles,
                "starts": one.onset.starts,
                "depth [m]": one.depth,
                "q": one.q,
                "one-sided q": one.one_sided,
                "paper (1) [N/m]": one.paper_limit,
                "delay rule [N/m]": one.delay_rule,
                "wall rule [N/m]": one.wall_rule,
                "conservative": one.conservative,
            }
            for one in self.onsets
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        onsets = to_plain_data(self.onsets)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "onsets": onsets}


@dataclass(frozen=True)
class StrokeSweep(Reportable, Tabular):
    """The energy per stroke of a scene, for each law, speed and depth.

    Attributes:
        setup: the closed loop.
        strokes: one for each law, speed and depth, laws first.
    """

    setup: Setup
    strokes: tuple[Stroke, ...]

    def __repr__(self) -> str:
        return f"<StrokeSweep of {len(self.strokes)} cases on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, speed, depth and the energies per stroke; SI units."""
        return [
            {
                "law": one.law,
                "speed [m/s]": one.speed,
                "depth [m]": one.depth,
                "mean depth [m]": one.mean_depth,
                "energy per stroke [J]": one.total,
                "energy of the field [J]": one.field,
                "error of the field [J]": one.error,
                "spread of the field [J]": one.spread,
                "gains energy": one.gains_energy,
                "the paper's sum [J]": one.same_sample_sum,
                "contact losses per stroke": one.lost_contact,
                "stop message": one.stop_message,
            }
            for one in self.strokes
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        strokes = to_plain_data(self.strokes)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "strokes": strokes}


def _make_loop(
    scene: SceneLike,
    device: DeviceLike | None,
    duration: float | None,
    surface: dict[str, Any],
    laws: Sequence[Law] = (),
    *,
    uses_delay: bool = True,
) -> Setup:
    """Return the closed loop of a scene with other surface arguments, device and duration."""
    loaded = scene if isinstance(scene, Scene) else load_scene(os.fspath(scene))
    if laws:
        surface = {"law": "W", **surface}  # replaced by each of the laws
    chosen = None if device is None else load_device(device)
    setup = make_setup(
        loaded, surface=surface, device=chosen, duration=duration, laws=laws, uses_delay=uses_delay
    )
    return setup.with_rendering()


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
            ``max_depth``, ``clamp``, parameters of the law.

    Raises:
        ParameterError: for a missing section, an unknown argument, or an invalid value.

    Example:
        >>> run = simulate("examples/stroke.toml", law="C", duration=0.05)
        >>> run.samples, run.is_energy_balanced
        (500, True)
    """
    setup = _make_loop(scene, device, duration, surface_arguments)
    return setup.simulate(trace=trace, progress=progress)


def onset(
    scene: SceneLike,
    laws: Laws = _ALL_LAWS,
    delays: Sequence[int] = DEFAULT_DELAYS,
    *,
    device: DeviceLike | None = None,
    duration: float | None = None,
    surface_arguments: dict[str, Any] | None = None,
    **search: Any,
) -> OnsetSweep:
    """Find the stiffness at which limit cycles begin, for each law and delay.

    Args:
        scene: as for :func:`simulate`; its hand must come to rest.
        laws: letters or names.
        delays: delays [samples].
        device: as for :func:`simulate`.
        duration: as for :func:`simulate`.
        surface_arguments: in place of those of the section [surface].
        **search: arguments of :func:`~asperity.scene.sweeps.sweep_onsets`: ``n_phases``,
            ``tolerance``, ``min_stiffness``, ``progress``.

    Raises:
        ParameterError: as for :func:`simulate`, and for a hand that does not come to rest.

    Example:
        >>> result = onset("examples/press.toml", "W", [1], n_phases=2)
        >>> [row["law"] for row in result.table_rows()]
        ['W']
    """
    check_keywords(search, ("n_phases", "tolerance", "min_stiffness", "progress"), onset)
    chosen = find_laws(laws if isinstance(laws, str) else list(laws))
    surface = surface_arguments or {}
    setup = _make_loop(scene, device, duration, surface, chosen, uses_delay=False)
    letters = [law.letter for law in chosen]
    return OnsetSweep(setup, sweep_onsets(setup, letters, delays, **search))


def scan(
    scene: SceneLike,
    laws: Laws = _ALL_LAWS,
    *,
    device: DeviceLike | None = None,
    surface_arguments: dict[str, Any] | None = None,
    **arguments: Any,
) -> StrokeSweep:
    """Simulate strokes on the surface of a scene: energy by law, speed and depth.

    Args:
        scene: as for :func:`simulate`; its motion must consist of strokes.
        laws: letters or names.
        device: as for :func:`simulate`.
        surface_arguments: in place of those of the section [surface].
        **arguments: arguments of :func:`~asperity.scene.sweeps.sweep_strokes`: ``speeds``,
            ``depths``, ``strokes``, ``progress``.

    Raises:
        ParameterError: as for :func:`simulate`, and for another motion.

    Example:
        >>> result = scan("examples/stroke.toml", "AC", speeds=[0.1], strokes=3)
        >>> [(row["law"], row["gains energy"]) for row in result.table_rows()]
        [('A', True), ('C', False)]
    """
    check_keywords(arguments, ("speeds", "depths", "strokes", "progress"), scan)
    chosen = find_laws(laws if isinstance(laws, str) else list(laws))
    setup = _make_loop(scene, device, None, surface_arguments or {}, chosen)
    letters = [law.letter for law in chosen]
    return StrokeSweep(setup, sweep_strokes(setup, letters, **arguments))
