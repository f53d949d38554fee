"""The server of the lab: the loop's frames to every page, and one page's wishes to the loop."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from asperity.devices import Device, device_names
from asperity.errors import ParameterError
from asperity.files import plain
from asperity.lab.access import MalformedError, Pace
from asperity.lab.backdrop import Backdrop
from asperity.lab.frames import frame, layout
from asperity.lab.handle import Handle
from asperity.lab.messages import (
    Change,
    Look,
    Save,
    Seen,
    Start,
    Steer,
    Stop,
    Take,
    read_message,
)
from asperity.lab.session import Session
from asperity.lab.shelf import Shelf
from asperity.lab.stage import RANGES, Stage
from asperity.lab.workshop import Workshop
from asperity.laws import KNOWN_LAWS
from asperity.servo.process import Spare
from asperity.servo.risk import risk
from asperity.servo.statistics import Statistics
from asperity.surface import Surface
from asperity.textures.naming import KINDS

LEAST = 5e-3
"""[s] between two frames at least, whatever a page wishes."""
EVERY = 1e-2
"""[s] between two frames, but where the hand is moved: more of them only take the processor from
those that are waited for."""
UNDER_WAY = 8
"""Frames that a page has not painted yet, at most: what waits for a slow one would be old."""
AWAY = 3.0
"""[s] without a word from the page that steers, after which the force of a real device goes."""
_SHORT = 5e-4  # [s] for which others can wait: the clock of asyncio goes in milliseconds
_LOOK = 0.1  # [s] between two looks at that
_LONGEST_SEND = 10.0  # [s] after which a page that takes nothing is let go
_MOST_REASON = 120  # bytes that a closing frame holds, less its code


class Page:
    """A page that is connected.

    Args:
        line: its connection.

    Attributes:
        looks: pictures that it waits for, by kind: only the newest of each counts.
        asked: is set when there is one.
        steered: is set when it has moved the hand.
        sent: number of the newest frame that it was sent.
    """

    def __init__(self, line: ServerConnection) -> None:
        self.line = line
        self.looks: dict[str, Look] = {}
        self.asked, self.steered = asyncio.Event(), asyncio.Event()
        self.sent = self._seen = 0.0
        self._taken = asyncio.Event()

    def see(self, frame: float) -> None:
        """Hear that a frame was painted.

        Raises:
            MalformedError: for one that was not sent.
        """
        if frame > self.sent:
            raise MalformedError("no such frame was sent")
        self._seen = frame
        self._taken.set()

    async def keeps_up(self) -> None:
        """Wait until the page has painted all frames but the newest few."""
        while self.sent - self._seen >= UNDER_WAY:
            self._taken.clear()
            await self._taken.wait()

    async def say(self, what: str, **content: Any) -> None:
        """Send words."""
        with suppress(ConnectionClosed):
            await self.line.send(json.dumps({"say": what, **plain(content)}))


class Lab:
    """A session and the pages that watch it.

    Args:
        stage: what is shown at first.
        pictures: process for pictures, see ``workshop``.
        limits: process for limits.
        spare: the process of the first loop.
        handle: what somebody holds; ``None`` for the simulated device.
        accepts_risk: whether a handle is given a stiffness above the limit.
    """

    def __init__(
        self, stage: Stage, pictures: Workshop, limits: Workshop, spare: Spare | None = None,
        handle: Handle | None = None, *, accepts_risk: bool = False,
    ) -> None:  # fmt: skip
        self._loop = asyncio.get_running_loop()
        self._pages: list[Page] = []
        self._master: Page | None = None
        self._changed = asyncio.Event()
        self._heard = 0.0  # when the page that steers said something [s]
        judged = handle is not None and not accepts_risk
        judge = partial(_judge, limits) if judged else None
        self.session = Session(stage, self._tell, spare, handle, judge)
        self.backdrop = Backdrop(pictures, limits, self._announce)
        self.shelf = Shelf(self.session)
        self._saving: set[asyncio.Task[None]] = set()

    def _tell(self) -> None:
        """Hear of a change, in the session's thread."""
        with suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(self._changed.set)

    def _show(self) -> None:
        stage = self.session.stage
        self.backdrop.show(stage.setup.surface, stage.judged)

    async def follow(self) -> None:
        """Tell the pages what happens to the session, for ever."""
        self._show()
        while True:
            await self._changed.wait()
            self._changed.clear()
            if self.session.state in {"running", "stopped"}:
                self._show()
            await self._announce()

    async def attend(self) -> None:
        """Let the force of a real device go when no page is there any more to do so, for ever."""
        handle = self.session.handle
        while handle is not None and handle.driver.moving:
            await asyncio.sleep(_LOOK)
            if self.session.state in {"starting", "stopped"}:
                self._heard = self._loop.time()  # a page has nothing to answer to
            elif self.session.going and self._loop.time() - self._heard > AWAY:
                self.session.halt("no page steers that could let the force go, so it went")

    async def welcome(self, line: ServerConnection) -> None:
        """Serve a page until it goes."""
        page = Page(line)
        self._pages.append(page)
        self._master = self._master or page
        tasks: list[asyncio.Task[None]] = []
        try:
            await page.say("hello", **_hello())
            for said in self.shelf.told:
                await page.say("take", **said)
            await self._announce()
            tasks = [
                asyncio.create_task(_while_there(work, page))
                for work in (self._frames, self._pictures)
            ]
            await self._listen(page)
        except ConnectionClosed:
            pass
        finally:
            for task in tasks:
                task.cancel()
            self._pages.remove(page)
            if self._master is page:
                self._master = None
                await self._announce()

    async def _listen(self, page: Page) -> None:
        pace = Pace()
        async for content in page.line:
            try:
                pace.count()
                await self._obey(page, content)
            except MalformedError as error:
                await page.line.close(1008, str(error)[:_MOST_REASON])
                return
            except ParameterError as error:
                await page.say("refused", words=str(error))

    async def _obey(self, page: Page, content: str | bytes) -> None:
        message = read_message(content)
        if self._master is page:
            self._heard = self._loop.time()
        if isinstance(message, Look):
            page.looks[message.kind] = message
            page.asked.set()
        elif isinstance(message, Seen):
            page.see(message.frame)
        elif isinstance(message, Take):
            if self._master is not None:
                raise ParameterError("steering", "is done by a page: close that one first")
            self._master = page
            await self._announce()
        elif self._master is not page:
            raise ParameterError("steering", "is done by another page: this one watches")
        elif isinstance(message, Steer):
            self.session.steer(message)
            page.steered.set()
        elif isinstance(message, Change):
            self.session.change(message.wishes)
        elif isinstance(message, Start):
            self.session.start()
        elif isinstance(message, Stop):
            self.session.halt("you let the force go")
        elif isinstance(message, Save):
            saving = asyncio.create_task(self._save(page))  # who steers goes on meanwhile
            self._saving.add(saving)
            saving.add_done_callback(self._saving.discard)

    async def _save(self, page: Page) -> None:
        """Keep the newest seconds."""
        try:
            await page.say("take", **await self.shelf.keep())
        except ParameterError as error:
            await page.say("refused", words=str(error))

    async def _announce(self) -> None:
        """Tell all pages how things stand."""
        session, setup = self.session, self.session.stage.setup
        low, high = map(float, setup.surface.texture.extremes)
        steps = session.stage.electronics
        news = {
            "state": session.state, "words": session.words, "starts": session.starts,
            "settings": session.stage.settings, "assumptions": setup.assumptions,
            "free": self._master is None, "wishes": session.steered["wishes"],
            "handle": session.handle,
            "rate": 1.0 / setup.servo.period, "max_force": setup.servo.max_force,
            "step": steps.position_resolution, "force_step": steps.force_resolution,
            "low": low, "high": high, "middle": session.stage.middle,
            "limit": self.backdrop.limit, "version": self.backdrop.version,
            "pictures": self.backdrop.words,
        }  # fmt: skip
        for page in tuple(self._pages):
            await page.say("news", steers=page is self._master, **news)

    async def _follows(self) -> None:
        """Wait until the loop has followed the newest wish: two samples."""
        span = 2.0 * self.session.stage.setup.servo.period
        if span <= _SHORT:
            await asyncio.sleep(0.0)
            time.sleep(span)
        else:
            await asyncio.sleep(span)

    async def _frames(self, page: Page) -> None:
        """Send the rows since the last frame, after a wish at once, as fast as the page goes."""
        session, starts, seen = self.session, -1, 0
        while True:
            await asyncio.sleep(LEAST)
            with suppress(TimeoutError):
                async with asyncio.timeout(EVERY - LEAST):
                    await page.steered.wait()
            if page.steered.is_set():
                page.steered.clear()
                await self._follows()
            await page.keeps_up()
            if session.shared is None:
                continue
            shared, heard = session.shared, session.steered["heard"]
            if session.starts != starts:
                starts, seen = session.starts, max(shared.head - 1, 0)
            rows, first = shared.rows(seen)
            if not len(rows):
                continue
            seen = first + len(rows)
            counted = Statistics.of(shared.status)
            page.sent += 1
            counts = {
                "frame": page.sent, "heard": heard,
                "late": counted.late, "skipped": counted.skipped,
            }  # fmt: skip
            places = [self.backdrop.nearest(rows[-1, 1:4]), session.anchor]
            async with asyncio.timeout(_LONGEST_SEND):
                await page.line.send(frame(rows, first, counts, np.concatenate(places)))

    async def _pictures(self, page: Page) -> None:
        """Send the pictures that a page asks for."""
        while True:
            await page.asked.wait()
            page.asked.clear()
            for kind in tuple(page.looks):
                content = await self.backdrop.picture(page.looks.pop(kind))
                await (page.line.send(content) if content else page.say("later", kind=kind))


def _judge(limits: Workshop, surface: Surface, device: Device) -> Future[str]:
    """Begin to find out why a surface is a risk on a device."""
    return limits.submit(risk, surface, device)


async def _while_there(work: Callable[[Page], Coroutine[Any, Any, None]], page: Page) -> None:
    """Do something for a page until it goes, or takes nothing any more."""
    try:
        await work(page)
    except ConnectionClosed:
        return
    except TimeoutError:
        await page.line.close(1008, "the page does not take what it is sent")


def _hello() -> dict[str, Any]:
    laws = [
        {
            "letter": law.letter,
            "name": law.name,
            "words": law.summary,
            "parameters": [argument.to_dict() for argument in law.arguments.values()],
        }
        for law in KNOWN_LAWS.values()
    ]
    kinds = [name for name, kind in KINDS.items() if not kind.required]
    return {
        "layout": layout(), "laws": laws, "devices": device_names(), "textures": kinds,
        "ranges": RANGES,
    }  # fmt: skip
