"""Another process, which computes what the page shows around the loop: pictures and limits.

They take from milliseconds to seconds, and compiling for them holds the interpreter: the process
that sends the loop's frames must not wait for that.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing.context import SpawnContext
from typing import Any, Self

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.allowed import allowed_stiffness
from asperity.devices import Device
from asperity.errors import AsperityError
from asperity.lab.views import cut, relief
from asperity.surface import Surface

_SHOWN: dict[str, Surface] = {}
# Behind the loop and the page, wherever they want to run.
_NICENESS = 10


class Workshop:
    """A process that waits for work, one piece at a time; use it in a ``with``.

    If it ends, of a crash in compiled code or for want of memory, whoever waits for it hears a
    ``BrokenProcessPool``; what is asked for after that is done by another one, which knows nothing.

    Args:
        learn: is called in it first, so that it knows the user's own laws.
    """

    def __init__(self, learn: Callable[[], None] | None = None) -> None:
        self._learn = learn
        self._pool = self._new()

    def _new(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            1, mp_context=SpawnContext(), initializer=_begin, initargs=(self._learn,)
        )

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begin a piece of work."""
        pool = self._pool
        try:
            answer = pool.submit(work, *arguments)
        except BrokenProcessPool as error:
            answer = Future()
            answer.set_exception(error)
        answer.add_done_callback(partial(self._mend, pool))
        return answer

    def _mend(self, pool: ProcessPoolExecutor, answer: Future[Any]) -> None:
        ended = not answer.cancelled() and isinstance(answer.exception(), BrokenProcessPool)
        if ended and self._pool is pool:
            self._pool = self._new()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()


def _begin(learn: Callable[[], None] | None) -> None:
    # Ctrl-C goes to all processes of a terminal: the server decides how all ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    if learn is not None:
        learn()


def show(surface: Surface) -> None:
    """Take the surface that pictures are made of from now on, and compile what they need."""
    surface.texture.nearest([(0.0, 0.0, 0.0)])
    _SHOWN["surface"] = surface


def picture(kind: str, numbers: tuple[float, ...]) -> bytes:
    """Return a picture of the surface as a message, see ``views``; empty if none was shown.

    Args:
        kind: "relief" or "cut".
        numbers: what it takes.
    """
    surface = _SHOWN.get("surface")
    if surface is None:
        return b""
    if kind == "relief":
        x, y, size = numbers
        return relief(surface, x, y, size)
    left, right, bottom, top, y = numbers
    return cut(surface, (left, right, bottom, top, y))


def limit(surface: Surface, device: Device) -> dict[str, Any]:
    """Return up to which stiffness a device renders a surface, and by which criterion.

    ``stiffness`` is [N/m], or nothing where no limit is known; ``criterion`` is the name of the one
    that gives it, and ``basis`` how well that is known, see
    :class:`~asperity.analysis.passivity.judgement.Allowed`; ``q`` is the characteristic number,
    ``one_sided`` the one-sided one.
    """
    try:
        q, one_sided = characteristic_number(surface), one_sided_number(surface)
        allowed, _wall = allowed_stiffness(surface, device, q, one_sided)
    except AsperityError as error:
        return {"stiffness": None, "basis": str(error), "q": None, "one_sided": None}
    return {
        "stiffness": allowed.stiffness or None, "basis": allowed.basis,
        "criterion": allowed.criterion, "q": q.value,
        "one_sided": one_sided.value,
    }  # fmt: skip
