"""Session of the lab: the loop, and the thread that starts, changes, polls and stops it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import astuple, dataclass, replace
from queue import Empty, Queue
from typing import Any, Literal

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError, ParameterError
from asperity.devices import Device
from asperity.lab.messages import SteerRequest
from asperity.lab.scene_state import PREVIOUS_SCENE, SCENE_KEY, TOUR_SCENE, SavedScenes, SceneState
from asperity.scene.setup import Setup
from asperity.servo.driver import Driver
from asperity.servo.drivers.pointer import PointerHand, pointer_driver
from asperity.servo.loop_memory import DeviceFault, EndReason, LoopMemory
from asperity.servo.process import PrestartedProcess, ServoProcess
from asperity.surface import Surface

_RECOVERY_ADVICE = {
    EndReason.DEVICE: "Check the device, its power and its cable",
    EndReason.NOT_FINITE: "Check the device, its power and its cable",
    EndReason.WORKSPACE: "Move the handle to its centre, and calibrate the device if it asks",
    EndReason.DEPTH: "Lift the handle out of the surface, or set a greater depth",
    EndReason.LATE_SAMPLE: "Close other programs on this machine, and check the cable",
    EndReason.NO_HEARTBEAT: "Close other programs on this machine",
    EndReason.UNRESPONSIVE: "Switch off the force at the device before you touch it",
    EndReason.DIED: "Switch off the force at the device before you touch it",
}


@dataclass(frozen=True)
class Handle:
    """A handle that is moved by a user or a recording, not by the page.

    Attributes:
        driver: of the device.
        motion_source: what moves the handle, for the page.
        start_prompt: shown before the first start.
        risk_advice: ends the refusal of a stiffness above the limit.
    """

    driver: Driver
    motion_source: str
    start_prompt: str
    risk_advice: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return driver, motion source and behaviour on loss for the page."""
        return {
            "driver": self.driver.name,
            "motion_source": self.motion_source,
            "loss_notice": self.driver.loss_notice,
        }


def make_handle(driver: Driver, setup: Setup, risk_advice: str = "") -> Handle:
    """Return the handle of a driver on the device of a setup; see :class:`Handle`."""
    if not driver.has_moving_handle:
        source = "A recording moves the handle; the pointer has no effect"
        return Handle(driver, source, "stopped: Start replays the recording", risk_advice)
    name = setup.device.name
    return Handle(
        driver,
        f"You hold the handle of {name}; the pointer has no effect. Delay and resolution are"
        " those of the device",
        f"stopped. Keep a hand near the switch of {name}, the handle in the air: Start ramps the"
        f" force up. If the loop dies: {driver.loss_notice}",
        risk_advice,
    )


def recovery_advice(fault: DeviceFault | None) -> str:
    """Return advice after a fault, to be appended to its message; empty without a fault.

    Example:
        >>> recovery_advice(DeviceFault(EndReason.DEPTH, "too deep"))[:42]
        '. Lift the handle out of the surface, or s'
    """
    if fault is None:
        return ""
    advice = _RECOVERY_ADVICE[fault.cause]
    return f". {advice}. Start, with the handle in the air, ramps the force up again"


POLL_INTERVAL = 0.05
"""Interval at which the loop is polled [s]."""
CLOCK_SPEED = 1
"""Seconds of a simulated loop in one of the system; tests, which wait for loops, set more."""
START_HEIGHT = 1e-3
"""Initial height of the hand above the highest point of the surface [m]."""

LoopState = Literal["starting", "running", "changing", "stopped"]
RiskAssessor = Callable[[Surface, Device], "Future[str]"]
"""Starts to determine why a surface is a risk on a device; an empty text if it is none."""


class _StartRequest(int):
    """Request to start, with the number of stops before it."""


class _StopRequest(str):
    """Request to stop, with the reason."""


_Request = Mapping[str, Any] | _StartRequest | _StopRequest


class Session:
    """A loop on a simulated device with a steered hand, or on a real device; a context manager.

    The loop of a real device is started by :meth:`start` alone, after a fault too.

    Any thread may read rows and steer the hand. All other requests are processed in the thread of
    the session in order, except :meth:`release_force`, which acts at once.

    Args:
        scene_state: the initial scene.
        on_change: called after a change of the state, in the thread of the session.
        prestarted: the process of the first loop.
        handle: of a real device; ``None`` for the simulated device.
        assess_risk: of surfaces on a real device; ``None`` if risks are accepted.
        leader: session whose hand moves this one's, sample by sample; the first change starts the
            loop.

    Attributes:
        on_change: as given.
        scene_state: the current scene.
        saved_scenes: other scenes by name.
        shared: rows of the loop; replaced at each start.
        start_count: number of starts.
        state: of the loop.
        message: about the state, for the user.
    """

    def __init__(
        self,
        scene_state: SceneState,
        on_change: Callable[[], None],
        prestarted: PrestartedProcess | None = None,
        handle: Handle | None = None,
        assess_risk: RiskAssessor | None = None,
        leader: Session | None = None,
    ) -> None:
        self.scene_state = scene_state
        self.on_change = on_change
        self._prestarted = prestarted
        self.saved_scenes = SavedScenes()
        self.handle = handle
        self._assess_risk = assess_risk
        self.leader = leader
        highest = float(scene_state.setup.surface.texture.extremes[1])
        is_steered = handle is None and leader is None
        self.pointer_hand: PointerHand | None = leader.pointer_hand if leader else None
        if is_steered:
            self.pointer_hand = PointerHand((*scene_state.centre, highest + START_HEIGHT))
        self.shared: LoopMemory | None = None
        self.start_count = 0
        self.state: LoopState = "starting" if is_steered else "stopped"
        self.message = handle.start_prompt if handle else ""
        self._loop: ServoProcess | None = None
        self._active_shared: LoopMemory | None = None
        self._stop_count = 0
        self._is_closing = False
        self._requests: Queue[_Request] = Queue()
        self._thread = threading.Thread(target=self._run, name="lab session", daemon=True)

    def __enter__(self) -> Session:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_closing = True
        self.release_force("")
        self._thread.join()
        if self.pointer_hand is not None and self.leader is None:
            self.pointer_hand.close()

    @property
    def is_running(self) -> bool:
        """Whether a loop runs that was not requested to stop."""
        return self._active_shared is not None

    @property
    def is_ended(self) -> bool:
        """Whether no loop runs, nor ends."""
        return self._loop is None and self._active_shared is None

    @property
    def is_in_tour(self) -> bool:
        """Whether the scene is one of the guided tour."""
        return PREVIOUS_SCENE in self.saved_scenes.scenes

    @property
    def steering_progress(self) -> dict[str, int]:
        """Numbers of the newest request for the hand, and of the newest acknowledged one."""
        hand = self.pointer_hand
        requested, acknowledged = (hand.request_count, hand.acknowledged_count) if hand else (0, 0)
        return {"requested": requested, "acknowledged": acknowledged}

    @property
    def anchor(self) -> FloatArray:
        """Position of the anchor of the hand (3,) [m]; NaN on a real device."""
        return np.full(3, np.nan) if self.pointer_hand is None else self.pointer_hand.anchor

    def steer(self, request: SteerRequest) -> None:
        """Move the hand.

        Raises:
            ParameterError: on a real device.
        """
        if self.pointer_hand is None:
            raise ParameterError("steering", "is done by the user of the handle")
        self.pointer_hand.request_motion(*astuple(request))

    def change(self, changes: Mapping[str, Any]) -> None:
        """Request a change of the scene, which starts a stopped loop on the simulated device."""
        self._requests.put(dict(changes))

    def end_tour(self) -> None:
        """If a guided tour runs, discard requested changes, and request the scene before it."""
        with self._requests.mutex:
            queue = self._requests.queue
            changes = [change for change in queue if isinstance(change, Mapping)]
            names = {change.get(SCENE_KEY) for change in changes}
            is_running = self.is_in_tour or TOUR_SCENE in names
            for change in changes if is_running else ():
                queue.remove(change)
        if is_running:
            self.change({SCENE_KEY: PREVIOUS_SCENE})

    def start(self) -> None:
        """Request the start of a stopped loop."""
        self._requests.put(_StartRequest(self._stop_count))

    def release_force(self, reason: str, *, now: bool = False) -> None:
        """Stop the loop at once, whatever the thread is doing: by a ramp, or with no force now."""
        self._stop_count += 1  # makes earlier start requests stale
        active = self._active_shared
        self._active_shared = None
        if active is not None:
            active.request_stop(now=now)
        self._requests.put(_StopRequest(reason))

    def _set_state(self, state: LoopState, message: str = "") -> None:
        self.state = state
        self.message = message
        self.on_change()

    def _run(self) -> None:
        try:
            if self.state == "starting":
                self._run_guarded(self._start, self.scene_state)
            while not self._is_closing:
                for request in self._next_requests():
                    self._run_guarded(self._handle_request, request)
                self._run_guarded(self._poll)
        finally:
            self._stop()

    def _next_requests(self) -> list[_Request]:
        """Return all pending requests; consecutive changes of one scene are merged."""
        try:
            requests = [self._requests.get(timeout=POLL_INTERVAL)]
        except Empty:
            return []
        while not self._requests.empty():
            last = requests[-1]
            new = self._requests.get()
            # Changes queued before a scene change apply to the previous scene.
            if isinstance(last, Mapping) and isinstance(new, Mapping) and SCENE_KEY not in new:
                requests[-1] = {**last, **new}
            else:
                requests.append(new)
        return requests

    def _run_guarded(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function; report its error in the state."""
        try:
            function(*arguments)
        except AsperityError as error:
            fault = error if isinstance(error, DeviceFault) else None
            message = str(error) if self.handle is None else f"{error}{recovery_advice(fault)}"
            runs = self._loop is not None and fault is None and self._loop.process.is_alive()
            if not runs:
                self._set_state("stopped", message)  # a device may keep the process waiting
                self._stop()
            stops = any(isinstance(request, _StopRequest) for request in self._requests.queue)
            if fault is None and stops:
                return  # the pending stop request sets the state
            self._set_state("running" if runs else "stopped", message)

    def _handle_request(self, request: _Request) -> None:
        if isinstance(request, _StopRequest):
            if self.state != "stopped":
                self._stop()
                self._set_state("stopped", str(request))
        elif isinstance(request, _StartRequest):
            if self._loop is None and request == self._stop_count:
                self._start(self.scene_state)
        else:
            self._apply_changes(request)

    def _start(self, scene_state: SceneState) -> None:
        stop_count = self._stop_count
        setup = scene_state.setup
        self._set_state("starting", "compiling the loop: the first time takes some seconds")
        prestarted = self._prestarted
        self._prestarted = None
        loop = ServoProcess(
            setup.rendered,
            self._make_driver(setup),
            setup.servo,
            setup.safety,
            setup.safety.reach_limit(setup.device),
            self._run_duration(setup),
            prestarted=prestarted,
        )
        self._active_shared = loop.memory
        if stop_count != self._stop_count:  # requested before the loop could receive it
            loop.memory.request_stop()
        try:
            loop.start()
        except BaseException:  # also for an interrupt
            self._active_shared = None
            raise
        self._loop = loop
        self.shared = loop.memory
        self.scene_state = scene_state
        self.start_count += 1
        self._set_state("running", " ".join(loop.notes))

    def _make_driver(self, setup: Setup) -> Driver:
        if self.handle is not None:
            return self.handle.driver
        assert self.pointer_hand is not None  # as there is no handle
        driver = pointer_driver(setup.plant, setup.hand, setup.servo, self.pointer_hand)
        return replace(driver, follows=self.leader is not None, clock_speed=CLOCK_SPEED)

    def _run_duration(self, setup: Setup) -> float | None:
        """Return the time after which the loop ends by itself [s]."""
        readings = self.handle and self.handle.driver.max_readings
        return readings * setup.servo.period if readings else None

    def _apply_changes(self, changes: Mapping[str, Any]) -> None:
        if self.handle is not None and SCENE_KEY in changes:
            raise ParameterError(SCENE_KEY, "needs the simulated device")
        scene = self.saved_scenes.apply_changes(self.scene_state, changes)
        if scene is self.scene_state and self._loop is not None:
            self._set_state("running")
            return
        if scene is self.scene_state and SCENE_KEY in changes:
            return  # no tour to be ended: a stopped loop stays so
        if not (self._is_rendered(scene.setup) and self._is_accepted(scene)):
            return
        if self.handle is not None and self._loop is None:
            self.scene_state = scene  # for the next start: a change never starts a real device
            self._set_state("stopped", self.message)
            return
        if self._loop is None or self.scene_state.needs_restart(scene):
            self._stop()
            self._start(scene)
            return
        self._set_state("changing", "compiling the law: the first time takes some seconds")
        # The risk is assessed already; a simulated device may buzz.
        self._loop.change_surface(scene.setup.rendered, accept_risk=True)
        self.scene_state = scene
        self._set_state("running")

    def _is_rendered(self, setup: Setup) -> bool:
        """Bake a field where one is needed, while polling the loop; false if the loop ended.

        Raises:
            ParameterError: for a surface that cannot be baked.
        """
        with ThreadPoolExecutor(1) as pool:
            baking = pool.submit(getattr, setup, "rendered")
            return self._is_done(baking, "baking law H") and bool(baking.result())

    def _is_done(self, work: Future[Any], text: str) -> bool:
        """Wait for work in the background while polling the loop; false if the loop ended."""
        loop = self._loop
        stop_count = self._stop_count
        if loop is not None:
            self._set_state("changing", f"{text}; the previous one is still rendered")
        while not wait([work], POLL_INTERVAL).done:
            self._poll()
            if self._loop is not loop or self._stop_count != stop_count:
                work.cancel()
                return False
        return True

    def _is_accepted(self, scene_state: SceneState) -> bool:
        """Assess a surface in another process while polling the loop; false if the loop ended.

        Raises:
            ParameterError: for a stiffness above the limit.
        """
        if self._assess_risk is None or scene_state.setup.surface is self.scene_state.setup.surface:
            return True
        assessment = self._assess_risk(scene_state.setup.rendered, scene_state.setup.device)
        if not self._is_done(assessment, "analysing the surface"):
            return False
        try:
            reason = assessment.result()
        except BrokenProcessPool:
            reason = "the process that analyses it has crashed: try again"
        if reason:
            advice = self.handle.risk_advice if self.handle else ""
            raise ParameterError("stiffness", f"is refused: {reason}{advice}")
        return True

    def _poll(self) -> None:
        if self._loop is not None and (cause := self._loop.poll()) is not EndReason.RUNNING:
            if cause is EndReason.STOPPED:
                return  # a stop request follows with the reason
            self._stop()
            self._set_state("stopped", "end of the recording; Start replays it")

    def _stop(self) -> None:
        loop = self._loop
        self._loop = None
        self._active_shared = None
        if loop is not None:
            loop.stop()
