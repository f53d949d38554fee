"""What stands around the loop and takes time: pictures of the surface, and its limit."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.lab import workshop
from asperity.lab.messages import Look
from asperity.lab.workshop import Workshop
from asperity.surface import Surface

MOST_ENDS, WITHIN = 3, 600.0
"""How often in how many seconds the process that makes pictures may end, and another begins."""
_AGAIN = "the process that makes the pictures has ended: another one begins"
_NO_MORE = "there are no pictures of this surface: the process that makes them ended each time"
_NO_LIMIT = "the process that computes it has ended, twice"


class Backdrop:
    """Pictures and the limit of the surface that is shown, computed by other processes.

    A process that ends is followed by another, which is shown the surface again; a surface that
    ends each of them has no pictures, until another one is shown.

    Args:
        pictures: process for pictures.
        limits: process for limits, which take longer.
        told: is called when something new is known.

    Attributes:
        limit: what :func:`asperity.lab.workshop.limit` returns; empty while it is computed.
        version: grows with each surface whose pictures can be had.
        words: what there is to say of the pictures.
    """

    def __init__(
        self, pictures: Workshop, limits: Workshop, told: Callable[[], Coroutine[Any, Any, None]]
    ) -> None:
        self._pictures, self._limits, self._told = pictures, limits, told
        self._wanted: Surface | None = None
        self._device: Device | None = None
        self._ready: Surface | None = None
        self._ends: list[float] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self.limit: dict[str, Any] = {}
        self.version = 0
        self.words = ""

    def show(self, surface: Surface, device: Device) -> None:
        """Make ready for a surface on a device, unless it is shown already."""
        if surface is self._wanted and device == self._device:
            return
        former, self.limit = self._wanted, {}
        self._wanted, self._device = surface, device
        if surface is former:
            self._begin(self._judge(surface, device))
            return
        self._ends, self.words = [], ""
        self._begin(self._make(surface, device))

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def close(self) -> None:
        """Wait for nothing any more."""
        for task in self._tasks:
            task.cancel()

    async def _make(self, surface: Surface, device: Device) -> None:
        """Make pictures ready first: they are waited for, and the limit takes longer."""
        await self._prepare(surface)
        await self._judge(surface, device)

    async def _prepare(self, surface: Surface) -> None:
        while surface is self._wanted and len(self._ends) < MOST_ENDS:
            try:
                await _done(self._pictures, workshop.show, surface)
            except BrokenProcessPool:
                await self._ended(surface)
                continue
            if surface is self._wanted:
                self._ready, self.words = surface, ""
                self.version += 1
                await self._told()
            return

    async def _ended(self, surface: Surface) -> None:
        """Hear that the process has ended while it worked on a surface."""
        self._ready = None
        if surface is self._wanted:
            now = time.monotonic()
            self._ends = [when for when in self._ends if when > now - WITHIN] + [now]
            self.words = _AGAIN if len(self._ends) < MOST_ENDS else _NO_MORE
            await self._told()

    async def _judge(self, surface: Surface, device: Device) -> None:
        limit = {"stiffness": None, "basis": _NO_LIMIT, "q": None, "one_sided": None}
        for _attempt in range(2):  # the process may have ended of something else
            with suppress(BrokenProcessPool):
                limit = await _done(self._limits, workshop.limit, surface, device)
                break
        if surface is self._wanted and device == self._device:
            self.limit = limit
            await self._told()

    async def picture(self, look: Look) -> bytes:
        """Return a picture as a message; empty while there is no surface that can be shown."""
        surface = self._ready
        if surface is None:
            return b""
        answer = b""
        with suppress(BrokenProcessPool):
            answer = await _done(self._pictures, workshop.picture, look.kind, look.numbers)
        if not answer and surface is self._ready:  # the first to hear that the process is another
            await self._ended(surface)
            self._begin(self._prepare(surface))
        return answer

    def nearest(self, point: FloatArray) -> FloatArray:
        """Return the point of the surface that is nearest to a point (3,) [m].

        It is not a number until the other process has compiled what that takes.
        """
        if self._ready is None:
            return np.full(3, np.nan)
        return self._ready.texture.nearest(point)


async def _done(where: Workshop, work: Callable[..., Any], *arguments: Any) -> Any:
    return await asyncio.wrap_future(where.submit(work, *arguments))
