"""The loop of the lab, and the one thread that starts, changes, watches and ends it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from queue import Empty, Queue
from typing import Any, Literal

import numpy as np

from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.errors import AsperityError, ParameterError
from asperity.lab.handle import Handle, advice
from asperity.lab.messages import Steer
from asperity.lab.stage import Stage
from asperity.lab.stages import WISH, Stages
from asperity.servo.drivers.driver import Driver
from asperity.servo.drivers.steered import Wheel, steered_driver
from asperity.servo.fault import Cause, DeviceFault
from asperity.servo.process import ServoProcess, Spare
from asperity.servo.shared import Shared
from asperity.surface import Surface

LOOK = 0.05
"""[s] between two looks at the loop."""
ABOVE = 1e-3
"""Height of the hand above the highest point of the surface, at first [m]."""

State = Literal["starting", "running", "changing", "stopped"]
Judge = Callable[[Surface, Device], "Future[str]"]
"""Begins to find out why a surface is a risk on a device; empty words if it is none."""


class _Start(int):
    """Wish for a start, with how often the force was let go before it."""


class _Stop(str):
    """Wish for an end, with the reason."""


class Session:
    """A loop on a device; use it in a ``with``.

    The device is simulated and its hand is steered, or somebody holds the handle of a real one.
    That one is started by :meth:`start` alone, after a fault too.

    Rows are read and the hand is steered by whoever likes. All else happens in the session's own
    thread, one thing after the other, but for :meth:`halt`, which acts at once.

    Args:
        stage: what is shown.
        tell: is called when the state has changed, in that thread.
        spare: the process of the first loop.
        handle: what is held; ``None`` for the simulated device.
        judge: of the surfaces of a handle; ``None`` if a risk is accepted.

    Attributes:
        stage: what is shown now.
        stages: others, to go to by name.
        shared: rows of the loop; another one after each start.
        starts: how often the loop was started.
        state: of the loop.
        words: what there is to say of it.
    """

    def __init__(
        self, stage: Stage, tell: Callable[[], None], spare: Spare | None = None,
        handle: Handle | None = None, judge: Judge | None = None,
    ) -> None:  # fmt: skip
        self.stage, self._tell, self._spare = stage, tell, spare
        self.stages = Stages()
        self.handle, self._judge = handle, judge
        highest = float(stage.setup.surface.texture.extremes[1])
        self.wheel = None if handle else Wheel((*stage.middle, highest + ABOVE))
        self.shared: Shared | None = None
        self.starts = 0
        self.state: State = "stopped" if handle else "starting"
        self.words = handle.begins if handle else ""
        self._loop: ServoProcess | None = None
        self._going: Shared | None = None
        self._halts, self._ends = 0, False
        self._wishes: Queue[Mapping[str, Any] | _Start | _Stop] = Queue()
        self._thread = threading.Thread(target=self._work, name="lab session", daemon=True)

    def __enter__(self) -> Session:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends = True
        self.halt("")
        self._thread.join()
        if self.wheel is not None:
            self.wheel.close()

    @property
    def going(self) -> bool:
        """Whether a loop is there that nobody has told to end."""
        return self._going is not None

    @property
    def steered(self) -> dict[str, int]:
        """Numbers of the newest wish for the hand, and of the newest that it follows."""
        wheel = self.wheel
        return {"wishes": wheel.wishes if wheel else 0, "heard": wheel.heard if wheel else 0}

    @property
    def anchor(self) -> FloatArray:
        """Where the hand is pulled to (3,) [m]; no number where a real one holds the handle."""
        return np.full(3, np.nan) if self.wheel is None else self.wheel.anchor

    def steer(self, wish: Steer) -> None:
        """Move the hand.

        Raises:
            ParameterError: where somebody holds the handle.
        """
        if self.wheel is None:
            raise ParameterError("steering", "is done by whoever holds the handle")
        self.wheel.steer(wish.target, wish.cosine, wish.sine, wish.speed)

    def change(self, wishes: Mapping[str, Any]) -> None:
        """Ask for a change of the stage; on the simulated device a stopped loop starts by it."""
        self._wishes.put(dict(wishes))

    def start(self) -> None:
        """Ask for a start of a loop that has stopped."""
        self._wishes.put(_Start(self._halts))

    def halt(self, reason: str) -> None:
        """Let the force go, by the ramp, and end the loop: now, whatever the thread does."""
        self._halts += 1  # what was asked for before counts no more
        going, self._going = self._going, None
        if going is not None:
            going.stop()
        self._wishes.put(_Stop(reason))

    def _say(self, state: State, words: str = "") -> None:
        self.state, self.words = state, words
        self._tell()

    def _work(self) -> None:
        try:
            if self.handle is None:
                self._guarded(self._start, self.stage)
            while not self._ends:
                for wish in self._asked():
                    self._guarded(self._do, wish)
                self._guarded(self._look)
        finally:
            self._stop()

    def _asked(self) -> list[Mapping[str, Any] | _Start | _Stop]:
        """Return all that is asked for; changes of one stage that follow each other are one."""
        try:
            wishes = [self._wishes.get(timeout=LOOK)]
        except Empty:
            return []
        while not self._wishes.empty():
            more, newest = self._wishes.get(), wishes[-1]
            # What was wished before another stage was of the former one.
            if isinstance(more, Mapping) and isinstance(newest, Mapping) and WISH not in more:
                wishes[-1] = {**newest, **more}
            else:
                wishes.append(more)
        return wishes

    def _guarded(self, work: Callable[..., None], *arguments: Any) -> None:
        """Do something; say what it found wrong."""
        try:
            work(*arguments)
        except AsperityError as error:
            fault = error if isinstance(error, DeviceFault) else None
            going = self._loop is not None and fault is None and self._loop.alive
            if not going:
                self._stop()
            if fault is None and any(isinstance(wish, _Stop) for wish in self._wishes.queue):
                return  # the force was let go meanwhile, which is said next
            words = str(error) if self.handle is None else f"{error}{advice(fault)}"
            self._say("running" if going else "stopped", words)

    def _do(self, wish: Mapping[str, Any] | _Start | _Stop) -> None:
        if isinstance(wish, _Stop):
            if self.state != "stopped":
                self._stop()
                self._say("stopped", str(wish))
        elif isinstance(wish, _Start):
            if self._loop is None and wish == self._halts:
                self._start(self.stage)
        else:
            self._go_to(wish)

    def _start(self, stage: Stage) -> None:
        halts = self._halts
        self._say("starting", "compiling the loop: the first time takes some seconds")
        setup, spare = stage.setup, self._spare
        self._spare = None
        loop = ServoProcess(
            setup.surface, self._driver(stage), setup.servo, setup.safety,
            setup.safety.reach_on(setup.device), self._span(stage), spare=spare,
        )  # fmt: skip
        self._going = loop.shared
        if halts != self._halts:  # in between: it would not have been heard
            loop.shared.stop()
        try:
            loop.start()
        except BaseException:
            self._going = None
            raise
        self._loop, self.shared, self.stage = loop, loop.shared, stage
        self.starts += 1
        self._say("running", " ".join(loop.notes))

    def _driver(self, stage: Stage) -> Driver:
        if self.handle is not None:
            return self.handle.driver
        assert self.wheel is not None  # without a handle there is one
        return steered_driver(stage.setup.plant, stage.setup.hand, stage.setup.servo, self.wheel)

    def _span(self, stage: Stage) -> float | None:
        """Return after which time the loop ends by itself [s]."""
        readings = self.handle and self.handle.driver.readings
        return readings * stage.setup.servo.period if readings else None

    def _go_to(self, wishes: Mapping[str, Any]) -> None:
        if self.handle is not None and WISH in wishes:
            raise ParameterError(WISH, "is of the simulated device")
        stage = self.stages.changed(self.stage, wishes)
        if stage is self.stage and self._loop is not None:
            self._say("running")
            return
        if not self._judged(stage):
            return
        if self.handle is not None and self._loop is None:
            self.stage = stage  # for the next start: a change moves no handle
            self._say("stopped", self.words)
            return
        if self._loop is None or self.stage.restarts(stage):
            self._stop()
            self._start(stage)
            return
        self._say("changing", "compiling the law: the first time takes some seconds")
        # It is judged already; on a simulated device to hear it buzz is what the lab is for.
        self._loop.change(stage.setup.surface, accept_risk=True)
        self.stage = stage
        self._say("running")

    def _judged(self, stage: Stage) -> bool:
        """Let another process analyse a surface, and go on watching; false if the loop ended.

        Raises:
            ParameterError: for a stiffness above the limit.
        """
        if self._judge is None or stage.setup.surface is self.stage.setup.surface:
            return True
        loop, halts = self._loop, self._halts
        if loop is not None:
            self._say("changing", "analysing the surface; the former is felt meanwhile")
        answer = self._judge(stage.setup.surface, stage.setup.device)
        while not (done := wait([answer], LOOK).done):
            self._look()
            if self._loop is not loop or self._halts != halts:
                answer.cancel()
                return False
        try:
            reason = done.pop().result()
        except BrokenProcessPool:
            reason = "the process that analyses it has ended: ask again"
        if reason:
            words = f"is refused: {reason}; asperity lab --accept-risk renders it"
            raise ParameterError("stiffness", words)
        return True

    def _look(self) -> None:
        if self._loop is not None and (cause := self._loop.poll()) is not Cause.GOING:
            if cause is Cause.STOPPED:
                return  # somebody let the force go, and says why
            self._stop()
            self._say("stopped", "the recording is at its end; Start begins it again")

    def _stop(self) -> None:
        loop, self._loop, self._going = self._loop, None, None
        if loop is not None:
            loop.stop()
