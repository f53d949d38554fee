"""Server of the lab: frames of the loop to every page, requests of one page to the loop."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import active_children
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.core.platform.process_control import (
    STOP_NOW_SIGNALS,
    STOP_SIGNALS,
    SUSPEND_SIGNALS,
    suspend_this_process,
)
from asperity.devices import device_names
from asperity.frictional import accepts_friction
from asperity.lab import background, messages
from asperity.lab.access import (
    MAX_MESSAGE_BYTES,
    AccessToken,
    MalformedMessageError,
    RateLimit,
    respond,
)
from asperity.lab.background import BackgroundRenderer, BackgroundResult, BackgroundWorker
from asperity.lab.law_lanes import FrameReader, LawLane, SecondLane
from asperity.lab.messages import BESIDE
from asperity.lab.scene_state import RANGES, SceneState
from asperity.lab.session import Handle, Session
from asperity.laws import REGISTERED_LAWS
from asperity.servo.process import PrestartedProcess
from asperity.servo.safety import excess_stiffness_reason
from asperity.textures.catalogue import KINDS

MIN_FRAME_INTERVAL = 5e-3
"""Least interval of frames [s]."""
FRAME_INTERVAL = 1e-2
"""Interval of frames [s] unless the hand moves: more frames would delay those that count."""
MAX_PENDING_FRAMES = 8
"""Greatest number of unpainted frames of a page: frames queued for a slow page would be stale."""
STEERING_TIMEOUT = 3.0
"""Silence of the controlling page [s] after which the force of a real device is released."""
# Waits up to this [s] block: the clock of asyncio has a resolution of milliseconds.
_MAX_BLOCKING_WAIT = 5e-4
_POLL_INTERVAL = 0.1  # of the silence of the controlling page [s]
_SEND_TIMEOUT = 10.0  # after which a page that does not receive is disconnected [s]
_MAX_REASON_BYTES = 120  # of the reason in a closing frame


@dataclass(frozen=True)
class LabOptions:
    """Options of the lab.

    Attributes:
        load_plugins: registers user-defined laws in another process.
        prestarted: the process of the first loop.
        handle: of a real device; ``None`` for the simulated device.
        accept_risk: whether a real device renders a stiffness above the limit.
    """

    load_plugins: Callable[[], None] | None = None
    prestarted: PrestartedProcess | None = None
    handle: Handle | None = None
    accept_risk: bool = False


class Client:
    """A page that is connected.

    Args:
        connection: its connection.

    Attributes:
        view_requests: requested pictures by kind; only the newest request of a kind counts.
        view_requested: set by a request.
        state_changed: set by a change of the state.
        hand_moved: set by a motion of the hand.
        last_sent: number of the newest sent frame.
    """

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.view_requests: dict[str, messages.ViewRequest] = {}
        self.view_requested = asyncio.Event()
        self.state_changed = asyncio.Event()
        self.hand_moved = asyncio.Event()
        self.last_sent = self._last_acknowledged = 0.0
        self._acknowledgement = asyncio.Event()

    def request_view(self, request: messages.ViewRequest) -> None:
        """Request a picture."""
        self.view_requests[request.kind] = request
        self.view_requested.set()

    def acknowledge(self, frame: float) -> None:
        """Note that a frame was painted.

        Raises:
            MalformedMessageError: for a frame that was not sent.
        """
        if frame > self.last_sent:
            raise MalformedMessageError("no such frame was sent")
        self._last_acknowledged = frame
        self._acknowledgement.set()

    async def wait_until_ready(self) -> None:
        """Wait until the page has painted all frames but the newest few."""
        while self.last_sent - self._last_acknowledged >= MAX_PENDING_FRAMES:
            self._acknowledgement.clear()
            await self._acknowledgement.wait()

    async def send(self, topic: str, /, **content: Any) -> None:
        """Send a message with its content."""
        with suppress(ConnectionClosed):
            await self.connection.send(json.dumps({"type": topic, **to_plain_data(content)}))


class LabServer:
    """A session and the pages connected to it, one of which has control.

    Args:
        scene_state: the initial scene.
        workers: processes for pictures, limits and comparisons, see ``background``.
        options: see :class:`LabOptions`.
    """

    def __init__(
        self, scene_state: SceneState, workers: Sequence[BackgroundWorker], options: LabOptions
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._clients: list[Client] = []
        self._controller: Client | None = None
        self._state_changed = asyncio.Event()
        self._last_contact = 0.0  # time of the last message of the controlling page [s]
        handle = options.handle
        assess_risk = None
        pictures, limits, comparisons = workers
        if handle is not None and not options.accept_risk:
            assess_risk = partial(limits.submit, excess_stiffness_reason)
        self.session = Session(scene_state, self._notify, options.prestarted, handle, assess_risk)
        self.pictures = BackgroundRenderer(pictures, limits, self._broadcast_state)
        self.recommendation = BackgroundResult(
            comparisons, background.compute_recommendation, self._broadcast_state
        )
        self.lane = LawLane(self.session, self.pictures)
        beside = BackgroundRenderer(pictures, limits, self._broadcast_state, BESIDE)
        self.second_lane = SecondLane(self.session, beside)
        self.pending_tasks: set[asyncio.Task[None]] = set()

    def _notify(self) -> None:
        """Signal a change, from the thread of the session."""
        with suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(self._state_changed.set)

    def _update_background(self) -> None:
        scene = self.session.scene_state
        surface = self.session.scene_state.setup.surface
        self.pictures.show(scene.setup.rendered, scene.rated_device)
        conditions = scene.rated_device, surface.max_depth, surface.clamp
        if self.recommendation.request(surface.texture, *conditions):
            background.start_task(self.pending_tasks, self.recommendation.compute())

    async def watch_session(self) -> None:
        """Send changes of the session to the pages, until cancelled."""
        self._update_background()
        while True:
            await self._state_changed.wait()
            self._state_changed.clear()
            if self.session.state in {"running", "stopped"}:
                self._update_background()
            self.second_lane.update()
            self._broadcast_state()

    async def watch_steering(self) -> None:
        """Release the force of a real device when no page can do so, until cancelled."""
        handle = self.session.handle
        while handle is not None and handle.driver.has_moving_handle:
            await asyncio.sleep(_POLL_INTERVAL)
            silence = self._loop.time() - self._last_contact
            if self.session.state in {"starting", "stopped"}:
                self._last_contact = self._loop.time()  # no frames to acknowledge
            elif self.session.is_running and silence > STEERING_TIMEOUT:
                self.session.release_force("released: no page with control is connected")

    async def serve_client(self, connection: ServerConnection) -> None:
        """Serve a page until it disconnects."""
        page = Client(connection)
        self._clients.append(page)
        self._controller = self._controller or page
        tasks: list[asyncio.Task[None]] = []
        try:
            await page.send("hello", **_greeting())
            self._broadcast_state()
            tasks = [
                asyncio.create_task(_run_while_connected(work, page))
                for work in (self._send_states, self._send_frames, self._send_pictures)
            ]
            await self._receive(page)
        except ConnectionClosed:
            pass
        finally:
            for task in tasks:
                task.cancel()
            self._clients.remove(page)
            if self._controller is page:
                self._controller = None
                if self.session.handle is None:
                    self.session.end_tour()
                self._broadcast_state()

    async def _receive(self, client: Client) -> None:
        rate = RateLimit()
        async for content in client.connection:
            try:
                rate.consume()
                await self._handle_message(client, content)
            except MalformedMessageError as error:
                await client.connection.close(1008, str(error)[:_MAX_REASON_BYTES])
                return
            except ParameterError as error:
                await client.send("error", message=str(error))

    async def _handle_message(self, client: Client, message: str | bytes) -> None:
        kind, content = messages.parse_message(message)
        if self._controller is client:
            self._last_contact = self._loop.time()
        if isinstance(content, messages.ViewRequest):
            client.request_view(content)
        elif kind == "acknowledge":
            client.acknowledge(content)
        elif kind == "take_control":
            if self._controller is not None:
                raise ParameterError("steering", "is done by a page: close that one first")
            self._controller = client
            self._broadcast_state()
        elif self._controller is not client:
            raise ParameterError("steering", "is done by another page: this one watches")
        else:
            self._control(client, kind, content)

    def _control(self, client: Client, kind: str, content: Any) -> None:
        """Handle a message that needs control."""
        if isinstance(content, messages.SteerRequest):
            self.session.steer(content)
            client.hand_moved.set()
        elif kind == "change":
            changes = dict(content)
            if BESIDE in changes:
                self.second_lane.choose(str(changes.pop(BESIDE)))
            self.session.change(changes)
        elif kind == "start":
            self.session.start()
        elif kind == "stop":
            self.session.release_force("the force was released")

    def _broadcast_state(self) -> None:
        """Have the state sent to all pages."""
        for page in self._clients:
            page.state_changed.set()

    async def _send_states(self, client: Client) -> None:
        """Send the state after each change, as it is then: a slow page delays no other."""
        while True:
            await client.state_changed.wait()
            client.state_changed.clear()
            await client.send("status", has_control=client is self._controller, **self._state())

    def _state(self) -> dict[str, Any]:
        session = self.session
        setup = session.scene_state.setup
        lowest, highest = map(float, setup.surface.texture.extremes)
        electronics = session.scene_state.electronics
        return {
            **self.lane.status,
            BESIDE: self.second_lane.status,
            "settings": session.scene_state.settings | {BESIDE: self.second_lane.law},
            "assumptions": setup.assumptions,
            "control_available": self._controller is None,
            "request_count": session.steering_progress["requested"],
            "handle": session.handle,
            "update_rate": 1.0 / setup.servo.period,
            "max_force": setup.servo.max_force,
            "position_resolution": electronics.position_resolution,
            "force_resolution": electronics.force_resolution,
            "lowest": lowest,
            "highest": highest,
            "centre": session.scene_state.centre,
            "recommendation": self.recommendation.value,
        }

    async def _wait_for_response(self) -> None:
        """Wait until the loop has processed the newest request: two samples."""
        span = 2.0 * self.session.scene_state.setup.servo.period
        if span <= _MAX_BLOCKING_WAIT:
            await asyncio.sleep(0.0)
            time.sleep(span)
        else:
            await asyncio.sleep(span)

    async def _send_frames(self, client: Client) -> None:
        """Send the rows since the last frame, at once after a motion."""
        first, second = map(FrameReader, (self.lane, self.second_lane))
        while True:
            await asyncio.sleep(MIN_FRAME_INTERVAL)
            with suppress(TimeoutError):
                async with asyncio.timeout(FRAME_INTERVAL - MIN_FRAME_INTERVAL):
                    await client.hand_moved.wait()
            if client.hand_moved.is_set():
                client.hand_moved.clear()
                await self._wait_for_response()
            await client.wait_until_ready()
            contents = [first.read(client.last_sent + 1)]
            if not contents[0]:
                continue
            client.last_sent += 1
            if self.second_lane.law:
                contents.append(second.read(client.last_sent))
            async with asyncio.timeout(_SEND_TIMEOUT):
                for content in filter(None, contents):
                    await client.connection.send(content)

    async def _send_pictures(self, client: Client) -> None:
        """Send the requested pictures."""
        while True:
            await client.view_requested.wait()
            client.view_requested.clear()
            for kind in tuple(client.view_requests):
                pictures = self.second_lane.pictures if kind == BESIDE else self.pictures
                content = await pictures.render(client.view_requests.pop(kind))
                if content:
                    await client.connection.send(content)
                else:
                    await client.send("picture_unavailable", kind=kind)


async def _run_while_connected(
    work: Callable[[Client], Coroutine[Any, Any, None]], client: Client
) -> None:
    """Run a task of a page until the page disconnects, or no longer receives."""
    try:
        await work(client)
    except ConnectionClosed:
        return
    except TimeoutError:
        await client.connection.close(1008, "the page does not receive")


def _greeting() -> dict[str, Any]:
    names = ("letter", "name", "summary")
    laws = [
        {name: getattr(law, name) for name in names}
        | {"parameters": [*law.arguments.values()]}
        | {"has_friction": accepts_friction(law)}
        for law in REGISTERED_LAWS.values()
    ]
    kinds = [name for name, kind in KINDS.items() if not kind.required_arguments]
    return {
        "layout": messages.frame_layout(),
        "laws": laws,
        "devices": device_names(),
        "textures": kinds,
        "ranges": RANGES,
    }


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
        _handle_signals(lab.session, stopped)
        try:
            with lab.session, lab.second_lane.session:
                async with serve(
                    lab.serve_client,
                    sock=listener,
                    max_size=MAX_MESSAGE_BYTES,
                    compression=None,
                    process_request=lambda _line, request: respond(token, request),
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
            suspend_this_process()
        else:
            events.call_later(0.01, suspend)

    def release_and_suspend() -> None:
        session.release_force("stopped by Ctrl-Z; Start runs it again")
        suspend()

    handlers: dict[int, Callable[[], None]] = dict.fromkeys(STOP_SIGNALS, stop)
    handlers |= dict.fromkeys(STOP_NOW_SIGNALS, partial(stop, now=True))
    handlers |= dict.fromkeys(SUSPEND_SIGNALS, release_and_suspend)
    for number, handler in handlers.items():
        # Without support by system or thread, Ctrl-C cancels the task.
        with suppress(NotImplementedError, RuntimeError, ValueError):
            events.add_signal_handler(number, handler)
