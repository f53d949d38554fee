"""Certification of any renderer: what a search of its forces finds, each with a witness.

Everything found is a lower bound: "at least". No search proves that there is no more.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.certification.gain_search import GainSearch, GainWitness, number_of_climbs
from asperity.certification.history import History, find_history
from asperity.certification.isolated import RendererPool
from asperity.certification.jump_search import ForceJump, JumpSearch
from asperity.certification.loop_search import ClosedLoop, LoopSearch
from asperity.certification.region import (
    Predicate,
    Region,
    RendererCalls,
    contact_heights,
    find_region,
)
from asperity.certification.renderers import (
    UNITS,
    ForceFunction,
    FunctionRenderer,
    Renderer,
    RendererSource,
)
from asperity.certification.resolution import Resolution, find_resolution
from asperity.core.checks import FloatArray, check_array, check_positive, check_real
from asperity.core.display import Displayable
from asperity.core.errors import ParameterError, find_named
from asperity.core.files import Serializable, written
from asperity.core.processes import available_cores
from asperity.core.units import count_text, format_quantity

DEFAULT_SECONDS = 10.0
"""Time of a search [s]."""
_SHARES = {
    "first gain": 0.1,
    "first jumps": 0.05,
    "gain": 0.2,
    "jumps": 0.15,
    "one-sided gain": 0.12,
    "loops": 0.38,
}
_SHARE_OF_KNOWN_JUMPS = 2.1
"""Share of the search for more jumps once one is known, in place of the search for the gain."""
_FIRST_CALLS = 4096
_COST_CALLS = 10_000
_PLACES = 512
_FULL_EFFORT = 5e6
"""Calls within the time of a search from which on all first tests are whole."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class ContactRange(Serializable):
    """Where the force begins.

    Attributes:
        lowest: least height at which the force begins [m]; NaN without a force.
        highest: greatest height [m].
        untouched: share of the columns without any force.
        dead: share of the columns in which the force vanishes again below its beginning.
        dead_at: a place without a force below a place with one [m]; ``None`` if there is none.
    """

    lowest: float
    highest: float
    untouched: float
    dead: float
    dead_at: tuple[float, ...] | None


@dataclass(frozen=True)
class Cost(Serializable):
    """Time of a call with its reset [s], one at a time and in batches.

    Attributes:
        median: of single calls.
        percentile_999: 99.9 % of single calls take at most this.
        largest: the longest single call.
        batch: mean in batches.
    """

    median: float
    percentile_999: float
    largest: float
    batch: float


@dataclass(frozen=True, eq=False)
class Certification(Serializable, Displayable):
    """What was found of a renderer; every number is "at least".

    Attributes:
        gain: largest change of force per change of position [N/m].
        gain_witness: two points that show it; ``None`` if the force never changes.
        one_sided_gain: largest change of force against the motion, per metre [N/m].
        one_sided_witness: two points that show it.
        worst_loop: closed path of the greatest energy gained; ``None`` if none was found.
        densest_loop: closed path of the greatest energy gained per length, which damping or dry
            friction has to absorb.
        rejected_loops: loops whose gain was within its error.
        jumps: jumps of the force, the largest first.
        history: dependence on what was before.
        contact: where the force begins.
        largest_force: greatest force [N].
        largest_at: where it occurred [m].
        invalid_at: a place where a force was not finite [m]; ``None`` if none was seen.
        resolution: noise and steps of the renderer.
        region_low: least coordinates of the region [m].
        region_high: greatest coordinates [m].
        calls: forces computed.
        seconds: duration of the search [s].
        cost: time of a call.
    """

    gain: float
    gain_witness: GainWitness | None
    one_sided_gain: float
    one_sided_witness: GainWitness | None
    worst_loop: ClosedLoop | None
    densest_loop: ClosedLoop | None
    rejected_loops: int
    jumps: tuple[ForceJump, ...]
    history: History
    contact: ContactRange
    largest_force: float
    largest_at: tuple[float, ...] | None
    invalid_at: tuple[float, ...] | None
    resolution: Resolution
    region_low: tuple[float, ...]
    region_high: tuple[float, ...]
    calls: int
    seconds: float
    cost: Cost

    def __repr__(self) -> str:
        leak = format_quantity(self.leak, "J", digits=3)
        gain = format_quantity(self.gain, "N/m", digits=4)
        jumps = count_text(len(self.jumps), "jump")
        return f"<Certification: gain at least {gain}, leak {leak}, {jumps}>"

    @property
    @written
    def history_spread(self) -> float:
        """Greatest difference of the force at one point after different approaches [N]."""
        return self.history.spread

    @property
    def leak(self) -> float:
        """Energy of the worst loop [J]; 0 without one."""
        return 0.0 if self.worst_loop is None else self.worst_loop.energy


def certify(
    renderer: ForceFunction | str | Path | RendererSource,
    *,
    name: str | None = None,
    region: Any = None,
    inside: Predicate | None = None,
    seconds: float = DEFAULT_SECONDS,
    unit: str = "m",
    rate: float = 0.0,
    text: str = "",
    seed: int = 0,
    progress: Progress | None = None,
) -> Certification:
    """Search a renderer for its gain, its worst loop, jumps, and dependence on history.

    Args:
        renderer: a function of points [m] of shape (n, 3), or of one point, that returns forces
            [N]; a method ``reset`` of it is called before each path. Or the path of a shared
            library, or ``"file.py:function"``.
        name: prefix of the functions of a library; default ``"texture"``.
        region: box [m] ((x0, x1), (y0, y1), (z0, z1)); by default around the place where the force
            begins near the z axis.
        inside: whether points of the box belong to the region, shape (n, 3) to (n,); by default
            all do.
        seconds: time of the search [s].
        unit: unit of positions of the renderer, ``"m"`` or ``"mm"``.
        rate: update rate of a loop that the renderer runs by itself, at which it is called [Hz].
        text: passed to ``NAME_open`` of a library.
        seed: of the random numbers.
        progress: called with the completed fraction and a text.

    Returns:
        What was found. Every number is a lower bound with a witness: no search proves that there
        is no more.

    Raises:
        ParameterError: for a renderer that cannot be loaded, crashes, does not return, or returns
            another size; a region without a force.

    Reference:
        docs/theory/black_box.md.

    Example:
        >>> spring = lambda points: -1000.0 * points * (points[:, 2:] < 0.0) * [0.0, 0.0, 1.0]
        >>> result = certify(spring, region=((-1e-3, 1e-3),) * 3, seconds=0.5)
        >>> round(result.gain), result.worst_loop, result.jumps
        (1000, None, ())
    """
    with open_renderer(renderer, name=name, unit=unit, rate=rate, text=text) as opened:
        calls = open_calls(opened, region, inside)
        return search_renderer(calls, seconds=seconds, seed=seed, progress=progress)


@contextmanager
def open_renderer(
    renderer: ForceFunction | str | Path | RendererSource,
    *,
    name: str | None = None,
    unit: str = "m",
    rate: float = 0.0,
    text: str = "",
) -> Iterator[Renderer]:
    """Open a renderer, and close it in the end; see :func:`certify`.

    A library, file or program runs in processes of its own: one for each core, unless it keeps its
    own rate or is a program.
    """
    find_named("unit", unit, UNITS)
    rate = check_real("rate", rate, "Hz")
    source = renderer
    if isinstance(source, (str, Path)):
        source = parse_source(str(source), name=name, text=text, unit=unit, rate=rate)
    if isinstance(source, RendererSource):
        is_alone = source.kind == "pipe" or bool(source.rate)
        opened: Renderer = RendererPool(source, 1 if is_alone else available_cores())
    else:
        opened = FunctionRenderer(source, unit, rate)
    with closing(opened):
        yield opened


def open_calls(
    renderer: Renderer, region: Any = None, inside: Predicate | None = None
) -> RendererCalls:
    """Return the calls of a renderer in a region; see :func:`certify`."""
    box = find_region(renderer) if region is None else _check_region(region)
    return RendererCalls(renderer, replace(box, predicate=inside))


def search_renderer(
    calls: RendererCalls,
    *,
    seconds: float = DEFAULT_SECONDS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Certification:
    """Search a renderer in a region; see :func:`certify`."""
    seconds = check_positive("seconds", seconds, "s")
    return _Search(calls, seconds, seed, progress or (lambda _fraction, _text: None)).run()


def parse_source(
    renderer: str, *, name: str | None = None, text: str = "", unit: str = "m", rate: float = 0.0
) -> RendererSource:
    """Return the source of a renderer from a path of a library or ``"file.py:function"``.

    Raises:
        ParameterError: for a file that does not exist.
    """
    path, separator, function = renderer.rpartition(":")
    if separator and path.endswith(".py"):
        source = RendererSource("python", path, function, text, unit, rate)
    elif renderer.endswith(".py"):
        source = RendererSource("python", renderer, name or "force", text, unit, rate)
    else:
        source = RendererSource("library", renderer, name or "texture", text, unit, rate)
    if not Path(source.target).is_file():
        raise ParameterError("renderer", "is no file", source.target)
    return source


def _check_region(region: Any) -> Region:
    """Return a box.

    Raises:
        ParameterError: for anything but three ranges.
    """
    ranges = check_array("region", region, (3, 2), "m")
    if not (ranges[:, 0] < ranges[:, 1]).all():
        raise ParameterError("region", "must be three ranges of increasing numbers [m]", region)
    return Region(ranges[:, 0], ranges[:, 1])


@dataclass
class _Search:
    """The searches of one renderer, one after the other."""

    calls: RendererCalls
    seconds: float
    seed: int
    progress: Progress
    started: float = field(default_factory=time.monotonic)
    shares: dict[str, float] = field(default_factory=_SHARES.copy)

    def run(self) -> Certification:
        """Return what was found.

        Raises:
            ParameterError: for a region without a force.
        """
        calls = self.calls
        region = calls.region
        contact, points = self._find_contact()
        # A slow renderer is tried at fewer places, so that most of the time is left.
        effort = min(1.0, calls.rate * self.seconds / _FULL_EFFORT)
        resolution = find_resolution(calls, points, effort)
        history = find_history(calls, resolution, points, self.seed, effort)
        calls.approaches = history.has_memory
        gain, one_sided, jumps = self._search_changes(resolution)
        loops = LoopSearch(calls, resolution, gain.value, self.seed)
        self._report("loops")
        loops.run(self._deadline("loops"))
        if loops.best is not None and not calls.approaches:
            # The loop was searched with a reset before each force: what does a walk around it say?
            spread, at = loops.walking_spread(loops.best)
            if spread:
                history = replace(history, spread=spread, at=_plain(at))
                calls.approaches = True
                loops = LoopSearch(calls, resolution, gain.value, self.seed)
                loops.run(time.monotonic() + _SHARES["loops"] * self.seconds)
        return Certification(
            gain=gain.value,
            gain_witness=gain.best,
            one_sided_gain=one_sided.value,
            one_sided_witness=one_sided.best,
            worst_loop=None if loops.best is None else loops.held_work(loops.best),
            densest_loop=loops.densest,
            rejected_loops=loops.rejected,
            jumps=jumps.jumps,
            history=history,
            contact=contact,
            largest_force=calls.largest_force,
            largest_at=_plain(calls.largest_at),
            invalid_at=_plain(calls.invalid_at),
            resolution=resolution,
            region_low=tuple(region.low.tolist()),
            region_high=tuple(region.high.tolist()),
            calls=calls.calls,
            seconds=time.monotonic() - self.started,
            cost=self._measure_cost(calls, points),
        )

    def _search_changes(self, resolution: Resolution) -> tuple[GainSearch, GainSearch, JumpSearch]:
        """Return the searches of changes of force: gain, one-sided gain, jumps."""
        calls = self.calls
        gain = GainSearch(calls, resolution, False, self.seed)
        one_sided = GainSearch(calls, resolution, True, self.seed + 1)
        jumps = JumpSearch(calls, resolution, self.seed)
        self._search_gain(gain, "first gain")
        jumps.run(self._deadline("first jumps"), gain.best)
        if not jumps.jumps:
            self._search_gain(gain, "gain")
        if jumps.jumps:
            self.shares["jumps"] = _SHARE_OF_KNOWN_JUMPS
        jumps.run(self._deadline("jumps"), gain.best)
        steep = jumps.steepest
        if len(steep):
            for search in (gain, one_sided):
                for ends in (steep, steep[:, ::-1]):
                    search.record(ends[:, 0], ends[:, 1], ends)
        self._search_gain(one_sided, "one-sided gain")
        if one_sided.best is not None:  # no one-sided gain exceeds the gain
            start, end, approach = np.array(
                [one_sided.best.start, one_sided.best.end, one_sided.best.approach]
            )
            gain.record(start[None], end[None], np.stack([start, approach])[None])
        return gain, one_sided, jumps

    def _find_contact(self) -> tuple[ContactRange, FloatArray]:
        """Return where the force begins, and points with a force, shape (n, 3).

        Raises:
            ParameterError: if there are none, or none that is finite.
        """
        calls = self.calls
        region = calls.region
        random = np.random.default_rng(self.seed)
        first = region.points(random.uniform(size=(_FIRST_CALLS, 3)))
        calls.at(first[:_PLACES])
        count = int(min(_FIRST_CALLS, max(_PLACES, 0.01 * calls.rate * self.seconds)))
        points = first[:count][region.contains(first[:count])]
        forces = calls.at(points)
        has_force = np.nan_to_num(np.square(forces).sum(axis=1)) > 0.0
        low = float(region.low[2])
        high = float(region.high[2])
        if not has_force.any():
            if calls.invalid_at is not None:
                place = ", ".join(
                    format_quantity(value, "m", digits=4) for value in calls.invalid_at
                )
                raise ParameterError("renderer", f"gives no force that is finite at {place}")
            raise ParameterError("region", f"has no force anywhere: {count} places were tried")
        xy = points[: count // 16, :2]
        heights = contact_heights(calls, xy, low, high)
        depths = np.where(np.isnan(heights), low, heights)
        below = np.column_stack([xy, low + (depths - low) * random.uniform(size=len(xy))])
        silent = (calls.at(below) == 0.0).all(axis=1) & ~np.isnan(heights)
        silent &= region.contains(below)
        contact = ContactRange(
            lowest=float(np.nanmin(heights, initial=np.inf)),
            highest=float(np.nanmax(heights, initial=-np.inf)),
            untouched=float(np.isnan(heights).mean()),
            dead=float(silent.mean()),
            dead_at=_plain(below[np.argmax(silent)]) if silent.any() else None,
        )
        order = np.argsort(-np.square(forces[has_force]).sum(axis=1))
        return contact, points[has_force][order[:_PLACES]]

    def _search_gain(self, search: GainSearch, name: str) -> None:
        climbs = number_of_climbs(search.calls, self.shares[name] * self.seconds)
        search.run(self._deadline(name), climbs, self._report)

    def _deadline(self, name: str) -> float:
        """Return when a search ends: its share of what is left of the time."""
        names = list(self.shares)
        left = sum(self.shares[other] for other in names[names.index(name) :])
        now = time.monotonic()
        return now + max(self.started + self.seconds - now, 0.0) * self.shares[name] / left

    def _report(self, text: str) -> None:
        fraction = (time.monotonic() - self.started) / self.seconds
        self.progress(min(fraction, 1.0), text)

    @staticmethod
    def _measure_cost(calls: RendererCalls, points: FloatArray) -> Cost:
        """Return the time of calls."""
        count = int(min(_COST_CALLS, max(8.0, 0.05 * calls.rate)))
        times = calls.renderer.call_times(np.resize(points, (count, 3)))
        median, high = np.quantile(times, [0.5, 0.999]).tolist()
        return Cost(median, high, float(times.max()), calls.seconds / calls.calls)


def _plain(point: NDArray[np.float64] | None) -> tuple[float, ...] | None:
    return None if point is None else tuple(point.tolist())
