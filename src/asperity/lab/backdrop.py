"""What stands around the loop and takes time: pictures of the surface, and its limit."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.lab import workshop
from asperity.lab.messages import Look
from asperity.lab.workshop import Sent
from asperity.scene.setup import Setup
from asperity.surface import Surface


class Backdrop:
    """Pictures and the limit of the surface that is shown, computed by other processes.

    Args:
        pictures: process for pictures.
        limits: process for limits, which take longer.
        told: is called when something new is known.

    Attributes:
        limit: what :func:`asperity.lab.workshop.limit` returns; empty while it is computed.
        version: grows with each surface whose pictures can be had.
    """

    def __init__(
        self, pictures: Executor, limits: Executor, told: Callable[[], Coroutine[Any, Any, None]]
    ) -> None:
        self._pictures, self._limits, self._told = pictures, limits, told
        self._wanted: Surface | None = None
        self._ready: Surface | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self.limit: dict[str, Any] = {}
        self.version = 0

    def show(self, setup: Setup) -> None:
        """Make ready for a surface on a device, unless it is shown already."""
        if setup.surface is self._wanted:
            return
        self._wanted, self.limit = setup.surface, {}
        task = asyncio.create_task(self._make(setup))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def close(self) -> None:
        """Wait for nothing any more."""
        for task in self._tasks:
            task.cancel()

    async def _make(self, setup: Setup) -> None:
        """Make pictures ready first: they are waited for, and the limit takes longer."""
        await self._prepare(setup.surface)
        await self._judge(setup)

    async def _prepare(self, surface: Surface) -> None:
        await _done(self._pictures, workshop.show, Sent.of(surface))
        if surface is self._wanted:
            self._ready = surface
            self.version += 1
            await self._told()

    async def _judge(self, setup: Setup) -> None:
        limit = await _done(self._limits, workshop.limit, Sent.of(setup.surface), setup.device)
        if setup.surface is self._wanted:
            self.limit = limit
            await self._told()

    async def picture(self, look: Look) -> bytes:
        """Return a picture as a message; empty before there is a surface."""
        if self._ready is None:
            return b""
        answer: bytes = await _done(self._pictures, workshop.picture, look.kind, look.numbers)
        return answer

    def nearest(self, point: FloatArray) -> FloatArray:
        """Return the point of the surface that is nearest to a point (3,) [m].

        It is not a number until the other process has compiled what that takes.
        """
        if self._ready is None:
            return np.full(3, np.nan)
        return self._ready.texture.nearest(point)


async def _done(where: Executor, work: Callable[..., Any], *arguments: Any) -> Any:
    return await asyncio.get_running_loop().run_in_executor(where, partial(work, *arguments))
