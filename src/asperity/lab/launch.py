"""Start and shutdown of the lab: worker processes, socket and server."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from multiprocessing import active_children

from websockets.asyncio.server import serve

from asperity.core.errors import ParameterError
from asperity.lab.access import MAX_MESSAGE_BYTES, AccessToken, respond
from asperity.lab.background import BackgroundWorker
from asperity.lab.scene_state import SceneState
from asperity.lab.server import LabOptions, LabServer
from asperity.lab.session import Session

LOOPBACK_ADDRESS = "127.0.0.1"
DEFAULT_PORT = 8137
"""Port of the lab, if it is free."""
PORT_COUNT = 65_536
_PORT_ATTEMPTS = 50  # consecutive ports that are tried


def bind_socket(port: int | None) -> socket.socket:
    """Return a socket that listens on the loopback interface.

    Args:
        port: the port, 0 for any; ``None`` for the first free one from ``DEFAULT_PORT``.

    Raises:
        ParameterError: for an invalid port, or one that is not free; the next free one is named.
    """
    wanted = DEFAULT_PORT if port is None else port
    if not 0 <= wanted < PORT_COUNT:
        raise ParameterError("port", f"must be 0 (any free port) to {PORT_COUNT - 1}", wanted)
    for number in range(wanted, min(wanted + _PORT_ATTEMPTS, PORT_COUNT)):
        try:
            bound = socket.create_server((LOOPBACK_ADDRESS, number))
        except OSError:
            continue
        if port is not None and number != wanted:
            bound.close()
            raise ParameterError("port", f"{wanted} is not available; {number} is free")
        return bound
    raise ParameterError("port", "is not available, nor are the next ones", wanted)


async def serve_lab(
    scene_state: SceneState,
    listener: socket.socket,
    on_ready: Callable[[str], None],
    options: LabOptions,
) -> None:
    """Serve the lab until a signal arrives, or the task is cancelled.

    Args:
        scene_state: the initial scene.
        listener: the bound socket.
        on_ready: called with the address once the server answers.
        options: see :class:`LabOptions`.
    """
    token = AccessToken(listener.getsockname()[1])
    stopped = asyncio.Event()
    with ExitStack() as stack:
        workers = [stack.enter_context(BackgroundWorker(options.load_plugins)) for _ in range(3)]
        lab = LabServer(scene_state, workers, options)
        tasks = [asyncio.create_task(work()) for work in (lab.watch_session, lab.watch_steering)]
        fetch = lab.clip_store.fetch
        _handle_signals(lab.session, stopped)
        try:
            with lab.session, lab.second_lane.session:
                async with serve(
                    lab.serve_client,
                    sock=listener,
                    max_size=MAX_MESSAGE_BYTES,
                    compression=None,
                    process_request=lambda _line, request: respond(token, request, fetch),
                ):
                    on_ready(token.url)
                    await stopped.wait()
        finally:
            for task in (*tasks, *lab.pending_tasks):
                task.cancel()
            lab.pictures.close()
            lab.second_lane.pictures.close()
            # The loop has ended; remaining processes compute pictures and limits, maybe for long.
            for child in active_children():
                child.terminate()


def _handle_signals(session: Session, stopped: asyncio.Event) -> None:
    """Release the force and stop at a signal; at Ctrl-Z release it, then suspend this process."""
    events = asyncio.get_running_loop()

    def stop(*, now: bool = False) -> None:
        session.release_force("", now=now)
        stopped.set()

    def suspend() -> None:
        if session.is_ended:
            os.kill(os.getpid(), signal.SIGSTOP)
        else:
            events.call_later(0.01, suspend)

    def release_and_suspend() -> None:
        session.release_force("stopped by Ctrl-Z; Start runs it again")
        suspend()

    handlers: dict[int, Callable[[], None]] = dict.fromkeys(
        (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), stop
    )
    handlers |= {signal.SIGQUIT: partial(stop, now=True), signal.SIGTSTP: release_and_suspend}
    for number, handler in handlers.items():
        # Without support by system or thread, Ctrl-C cancels the task.
        with suppress(NotImplementedError, RuntimeError, ValueError):
            events.add_signal_handler(number, handler)
