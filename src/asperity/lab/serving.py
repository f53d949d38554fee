"""The lab from its beginning to its end: processes, server, browser."""

from __future__ import annotations

import asyncio
import signal
import socket
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import active_children
from pathlib import Path

from websockets.asyncio.server import serve

from asperity.errors import ParameterError
from asperity.lab.access import MOST_BYTES, Door
from asperity.lab.handle import Handle
from asperity.lab.reel import Reel
from asperity.lab.server import Lab
from asperity.lab.site import answer
from asperity.lab.stage import Stage
from asperity.lab.workshop import Workshop
from asperity.servo.process import Spare

LOOPBACK = "127.0.0.1"
PORT = 8137
"""Where the lab is, if that port is free."""
PORTS = 65_536
_TRIED = 50  # ports after one that is not free


def free_socket(port: int | None) -> socket.socket:
    """Return a socket that is bound to the loopback interface.

    Args:
        port: wanted, 0 for any; ``None`` for ``PORT`` or one of the next.

    Raises:
        ParameterError: for no port, or one that is not free; the next one that is is named.
    """
    wanted = PORT if port is None else port
    if not 0 <= wanted < PORTS:
        raise ParameterError("port", f"must be 0 (any that is free) to {PORTS - 1}", wanted)
    for number in range(wanted, min(wanted + _TRIED, PORTS)):
        bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.bind((LOOPBACK, number))
        except OSError:
            bound.close()
            continue
        if port is not None and number != wanted:
            bound.close()
            raise ParameterError("port", f"{wanted} cannot be had; {number} is free")
        return bound
    raise ParameterError("port", "cannot be had, nor can the next ones", wanted)


def run_lab(
    stage: Stage, bound: socket.socket, ready: Callable[[str], None],
    learn: Callable[[], None] | None = None, spare: Spare | None = None,
    reel: Reel | None = None, handle: Handle | None = None, *, accepts_risk: bool = False,
) -> None:  # fmt: skip
    """Serve the lab until Ctrl-C.

    Args:
        stage: what is shown at first.
        bound: where it listens.
        ready: receives the address, once it answers.
        learn: makes the user's own laws known in another process.
        spare: the process of the first loop.
        reel: rows that were recorded on what is shown at first, to be shown again.
        handle: what somebody holds; ``None`` for the simulated device.
        accepts_risk: whether a handle is given a stiffness above the limit.
    """
    serving = serve_lab(stage, bound, ready, learn, spare, reel, handle, accepts_risk=accepts_risk)
    asyncio.run(serving)


async def serve_lab(
    stage: Stage, bound: socket.socket, ready: Callable[[str], None],
    learn: Callable[[], None] | None = None, spare: Spare | None = None,
    reel: Reel | None = None, handle: Handle | None = None, *, accepts_risk: bool = False,
) -> None:  # fmt: skip
    """Serve the lab until a signal ends it, or the task is cancelled."""
    door = Door(bound.getsockname()[1])
    over = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        # Where the system or the thread cannot, Ctrl-C cancels the task.
        with suppress(NotImplementedError, RuntimeError, ValueError):
            asyncio.get_running_loop().add_signal_handler(number, over.set)
    with Workshop(learn) as pictures, Workshop(learn) as limits:
        lab = Lab(stage, pictures, limits, spare, handle, accepts_risk=accepts_risk)
        if reel is not None:
            lab.shelf.lay("recording", reel, stage, Path(stage.named).name)
        tasks = [asyncio.create_task(work()) for work in (lab.follow, lab.attend)]
        try:
            with lab.session:
                async with serve(
                    lab.welcome, sock=bound, max_size=MOST_BYTES, compression=None,
                    process_request=lambda _line, asked: answer(door, asked, lab.shelf.fetch),
                ):  # fmt: skip
                    ready(door.address)
                    await over.wait()
        finally:
            for task in tasks:
                task.cancel()
            lab.backdrop.close()
            # The loop has ended: what is left computes pictures and limits, maybe for long.
            for child in active_children():
                child.terminate()
