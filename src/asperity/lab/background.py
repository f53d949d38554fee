"""Pictures of the surface and its stability limit, computed in worker processes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.core.processes import make_pool
from asperity.devices import Device
from asperity.lab.messages import BESIDE, ViewRequest, encode_relief, encode_section
from asperity.laws import REGISTERED_LAWS
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture

_STATE: dict[str, Surface] = {}
_NICENESS = 10  # lower priority than the loop and the page


class BackgroundWorker(AbstractContextManager["BackgroundWorker"]):
    """A process that computes one task at a time; a context manager.

    If the process dies, of a crash in compiled code or for lack of memory, the pending task raises
    ``BrokenProcessPool``; later tasks run in a new process without state.

    Args:
        load_plugins: called in the process first, to register user-defined laws.
    """

    def __init__(self, load_plugins: Callable[[], None] | None = None) -> None:
        self._load_plugins = load_plugins
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        return make_pool(1, self._load_plugins, _NICENESS)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task."""
        pool = self._pool
        try:
            result = pool.submit(function, *arguments)
        except BrokenProcessPool as error:
            result = Future()
            result.set_exception(error)
        result.add_done_callback(partial(self._replace_broken_pool, pool))
        return result

    def _replace_broken_pool(self, pool: ProcessPoolExecutor, result: Future[Any]) -> None:
        is_broken = not result.cancelled() and isinstance(result.exception(), BrokenProcessPool)
        if is_broken and self._pool is pool:
            self._pool = self._new_pool()

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()


def set_surface(surface: Surface, lane: str = "") -> None:
    """Set the surface of the pictures of a lane, and compile what they need."""
    surface.texture.nearest([(0.0, 0.0, 0.0)])
    _STATE[lane] = surface


def render_view(kind: str, numbers: tuple[float, ...]) -> bytes:
    """Return a picture of the surface as a message; empty without a surface.

    Args:
        kind: "relief", "section" or ``BESIDE``, the section of the second lane.
        numbers: the arguments of ``encode_relief`` or ``encode_section`` after the surface.
    """
    surface = _STATE.get(kind if kind == BESIDE else "")
    if surface is None:
        return b""
    encode = encode_relief if kind == "relief" else encode_section
    return encode(surface, *numbers)


def compute_limit(surface: Surface, device: Device) -> dict[str, Any]:
    """Return the stability limit of the stiffness of a surface on a device, with its criterion.

    ``stiffness`` is in N/m, or ``None`` if no limit is known; ``criterion`` and ``basis`` are those
    of the stability limit; ``q`` is the characteristic number, ``one_sided`` the one-sided number.
    """
    try:
        q = characteristic_number(surface)
        one_sided = one_sided_number(surface)
        limit = recommend_stiffness(surface, device, q, one_sided).stability_limit
    except AsperityError as error:
        return {"stiffness": None, "basis": str(error), "q": None, "one_sided": None}
    return {
        "stiffness": limit.stiffness or None,
        "basis": limit.basis,
        "criterion": limit.criterion,
        "q": q.value,
        "one_sided": one_sided.value,
    }


def compute_recommendation(
    texture: Texture, device: Device, max_depth: float, clamp: str
) -> dict[str, Any]:
    """Return what a comparison recommends among all registered laws.

    ``reason`` is the recommendation in words. If there is a law to show, ``changes`` are those of
    the scene that apply it, ``is_recommended`` is false for the law that comes nearest where no
    texture is felt, ``limit`` is its stability limit, ``tier`` its perceptibility, ``amount`` the
    amount of texture, and ``grip`` the assumed hand.
    """
    # Imported by the worker process alone: the server starts sooner.
    from asperity.analysis.results.compare import compare
    from asperity.report.sentences.limit_sentences import grip_text, texture_amount_text

    laws = tuple(REGISTERED_LAWS.values())
    is_default = max_depth == default_max_depth(texture)
    depth = None if is_default else max_depth
    try:
        result = compare(texture, device, laws, max_depth=depth, clamp=clamp)
    except AsperityError as error:
        return {"reason": str(error)}
    row = result.recommended_row or result.nearest_row
    reason = {"reason": result.recommendation}
    if row is None or row.perceptibility is None:
        return reason
    settings = {"law": row.law.letter, "stiffness": row.recommended_stiffness}
    return reason | {
        "changes": {**settings, **row.surface.law_parameters},
        "is_recommended": result.recommended_row is not None,
        "limit": row.stability_limit.to_dict(),
        "tier": row.tier,
        "amount": texture_amount_text(row.perceptibility),
        "grip": grip_text(result.grip),
    }


_CRASH_TEXT = "the process that computes it has crashed twice"
_CRASH_RESULT = {"stiffness": None, "basis": _CRASH_TEXT, "reason": _CRASH_TEXT}


@dataclass
class BackgroundResult:
    """Result of a function for the newest arguments, computed in a worker process.

    Attributes:
        worker: the process; if it crashes twice, ``basis`` and ``reason`` of the result say so.
        function: computes the result from the arguments.
        on_update: called when the result is new.
        value: the result; empty until computed.
    """

    worker: BackgroundWorker
    function: Callable[..., dict[str, Any]]
    on_update: Callable[[], None]
    value: dict[str, Any] = field(default_factory=dict)
    _arguments: tuple[Any, ...] = ()
    _lock: asyncio.Lock = field(default_factory=asyncio.Lock)

    def request(self, subject: object, *conditions: Any) -> bool:
        """Set the arguments; false if these are the current subject and equal conditions."""
        old = self._arguments
        if old and old[0] is subject and old[1:] == conditions:
            return False
        self._arguments = (subject, *conditions)
        self.value = {}
        return True

    async def compute(self) -> None:
        """Compute the result, after one that is being computed; only the newest one counts."""
        arguments = self._arguments
        value = _CRASH_RESULT
        async with self._lock:
            for _attempt in range(2):  # the crash may have had another cause
                if arguments is not self._arguments or self.value:
                    return
                with suppress(BrokenProcessPool):
                    value = await _run_in_worker(self.worker, self.function, *arguments)
                    break
        if arguments is self._arguments:
            self.value = value
            self.on_update()


def start_task(pending: set[asyncio.Task[None]], work: Coroutine[Any, Any, None]) -> None:
    """Start a task, and store it until it is done."""
    task = asyncio.create_task(work)
    pending.add(task)
    task.add_done_callback(pending.discard)


MAX_CRASHES = 3
CRASH_WINDOW = 600.0
"""Crashes of the picture process, within so many seconds, after which it is not restarted."""
_RESTART_TEXT = "the picture process has crashed and is restarted"
_NO_PICTURES_TEXT = "no pictures of this surface: the picture process crashed each time"


class BackgroundRenderer:
    """Pictures and stability limit of the current surface, computed by worker processes.

    A process that crashes is replaced; a surface that crashes each of them has no pictures, until
    another surface is shown.

    Args:
        picture_worker: process for pictures.
        limit_worker: process for limits, which take longer.
        on_update: called when a result or a message is new.
        lane: ``BESIDE`` for the second lane.

    Attributes:
        version: incremented with each surface whose pictures are available.
        is_current: whether these are pictures of the requested surface.
        message: state of the pictures, for the user.
    """

    def __init__(
        self,
        picture_worker: BackgroundWorker,
        limit_worker: BackgroundWorker,
        on_update: Callable[[], None],
        lane: str = "",
    ) -> None:
        self._lane = lane
        self._picture_worker = picture_worker
        self._on_update = on_update
        self._limit = BackgroundResult(limit_worker, compute_limit, on_update)
        self._requested_surface: Surface | None = None
        self._ready_surface: Surface | None = None
        self._crash_times: list[float] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self.version = 0
        self.is_current = False
        self.message = ""

    @property
    def limit(self) -> dict[str, Any]:
        """The limit, see :func:`asperity.lab.background.compute_limit`; empty until computed."""
        return self._limit.value

    def show(self, surface: Surface, device: Device) -> None:
        """Start the computations for a surface on a device, unless it is the current one."""
        if not self._limit.request(surface, device):
            return
        if surface is self._requested_surface:
            start_task(self._tasks, self._limit.compute())
            return
        self._requested_surface = surface
        self.is_current = False
        self._crash_times = []
        self.message = ""
        start_task(self._tasks, self._compute(surface))

    def shows(self, surface: Surface) -> bool:
        """Whether pictures and limit are those of a surface, or are being computed for it."""
        return surface is self._requested_surface

    def close(self) -> None:
        """Cancel all tasks."""
        for task in self._tasks:
            task.cancel()

    async def _compute(self, surface: Surface) -> None:
        """Prepare the pictures first: the page waits for them, and the limit takes longer."""
        await self._prepare_pictures(surface)
        await self._limit.compute()

    async def _prepare_pictures(self, surface: Surface) -> None:
        while surface is self._requested_surface and len(self._crash_times) < MAX_CRASHES:
            try:
                await _run_in_worker(self._picture_worker, set_surface, surface, self._lane)
            except BrokenProcessPool:
                self._record_crash(surface)
                continue
            if surface is self._requested_surface:
                self._ready_surface = surface
                self.message = ""
                self.version = self.version + 1
                self.is_current = True
                self._on_update()
            return

    def _record_crash(self, surface: Surface) -> None:
        """Count a crash of the picture process, and report it."""
        self._ready_surface = None
        if surface is self._requested_surface:
            now = time.monotonic()
            recent = [when for when in self._crash_times if when > now - CRASH_WINDOW]
            self._crash_times = [*recent, now]
            restarts = len(self._crash_times) < MAX_CRASHES
            self.message = _RESTART_TEXT if restarts else _NO_PICTURES_TEXT
            self._on_update()

    async def render(self, request: ViewRequest) -> bytes:
        """Return a picture as a message; empty while no surface is ready."""
        surface = self._ready_surface
        if surface is None:
            return b""
        view = b""
        with suppress(BrokenProcessPool):
            arguments = request.kind, request.numbers
            view = await _run_in_worker(self._picture_worker, render_view, *arguments)
        if not view and surface is self._ready_surface:  # the crash was not yet recorded
            self._record_crash(surface)
            start_task(self._tasks, self._prepare_pictures(surface))
        return view

    def nearest(self, point: FloatArray) -> FloatArray:
        """Return the closest point of the surface to a point (3,) [m].

        It is NaN until the worker process has compiled the search.
        """
        if self._ready_surface is None:
            return np.full(3, np.nan)
        return self._ready_surface.texture.nearest(point)


async def _run_in_worker(
    worker: BackgroundWorker, work: Callable[..., Any], *arguments: Any
) -> Any:
    return await asyncio.wrap_future(worker.submit(work, *arguments))
