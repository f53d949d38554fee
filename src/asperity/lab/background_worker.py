"""Worker processes of the lab, which compute pictures and limits.

These take from milliseconds to seconds, and compiling for them blocks the interpreter, which must
not delay the process that sends the frames of the loop.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any, Self

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.core.errors import AsperityError
from asperity.core.processes import make_pool
from asperity.devices import Device
from asperity.lab.frames import encode_relief, encode_section
from asperity.surface import Surface

_STATE: dict[str, Surface] = {}
_NICENESS = 10  # lower priority than the loop and the page


class BackgroundWorker:
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

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()


def set_surface(surface: Surface) -> None:
    """Set the surface of the pictures, and compile what they need."""
    surface.texture.nearest([(0.0, 0.0, 0.0)])
    _STATE["surface"] = surface


def render_view(kind: str, numbers: tuple[float, ...]) -> bytes:
    """Return a picture of the surface as a message, see ``frames``; empty without a surface.

    Args:
        kind: "relief" or "cut".
        numbers: the arguments of the encoder, see ``frames``.
    """
    surface = _STATE.get("surface")
    if surface is None:
        return b""
    if kind == "relief":
        x, y, size = numbers
        return encode_relief(surface, x, y, size)
    left, right, bottom, top, y = numbers
    return encode_section(surface, (left, right, bottom, top, y))


def compute_limit(surface: Surface, device: Device) -> dict[str, Any]:
    """Return the stability limit of the stiffness of a surface on a device, with its criterion.

    ``stiffness`` is in N/m, or ``None`` if no limit is known; ``criterion`` and ``basis`` are those
    of :class:`~asperity.analysis.passivity.verdict.StabilityLimit`; ``q`` is the characteristic
    number, ``one_sided`` the one-sided number.
    """
    try:
        q, one_sided = characteristic_number(surface), one_sided_number(surface)
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
