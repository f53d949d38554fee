"""The loop of the lab, and the one thread that starts, changes, watches and ends it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from queue import Empty, Queue
from typing import Any, Literal

from asperity.errors import AsperityError
from asperity.lab.stage import Stage
from asperity.lab.stages import WISH, Stages
from asperity.servo.drivers.steered import Wheel, steered_driver
from asperity.servo.fault import Cause
from asperity.servo.process import ServoProcess, Spare
from asperity.servo.shared import Shared

LOOK = 0.05
"""[s] between two looks at the loop."""
ABOVE = 1e-3
"""Height of the hand above the highest point of the surface, at first [m]."""

State = Literal["starting", "running", "changing", "stopped"]


class Session:
    """A loop on a simulated device, held by a hand that is steered; use it in a ``with``.

    Rows are read and the hand is steered by whoever likes. All else happens in the session's own
    thread, one thing after the other.

    Args:
        stage: what is shown.
        tell: is called when the state has changed, in that thread.
        spare: the process of the first loop.

    Attributes:
        stage: what is shown now.
        stages: others, to go to by name.
        wheel: what moves the hand.
        shared: rows of the loop; another one after each start.
        starts: how often the loop was started.
        state: of the loop.
        words: what there is to say of it.
    """

    def __init__(self, stage: Stage, tell: Callable[[], None], spare: Spare | None = None) -> None:
        self.stage, self._tell, self._spare = stage, tell, spare
        self.stages = Stages()
        highest = float(stage.setup.surface.texture.extremes[1])
        self.wheel = Wheel((*stage.middle, highest + ABOVE))
        self.shared: Shared | None = None
        self.starts = 0
        self.state: State = "starting"
        self.words = ""
        self._loop: ServoProcess | None = None
        self._wishes: Queue[Mapping[str, Any] | None] = Queue()
        self._thread = threading.Thread(target=self._work, name="lab session", daemon=True)

    def __enter__(self) -> Session:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._wishes.put(None)
        self._thread.join()
        self.wheel.close()

    def change(self, wishes: Mapping[str, Any]) -> None:
        """Ask for a change of the stage; an empty one starts a loop that has stopped."""
        self._wishes.put(dict(wishes))

    def _say(self, state: State, words: str = "") -> None:
        self.state, self.words = state, words
        self._tell()

    def _work(self) -> None:
        try:
            self._guarded(self._start, self.stage)
            while (asked := self._asked()) is not None:
                for wishes in asked:
                    self._guarded(self._go_to, wishes)
                self._guarded(self._look)
        finally:
            self._stop()

    def _asked(self) -> list[Mapping[str, Any]] | None:
        """Return all that is asked for, made few wishes, or none; ``None`` for the end."""
        try:
            asked = [self._wishes.get(timeout=LOOK)]
        except Empty:
            return []
        while not self._wishes.empty():
            asked.append(self._wishes.get())
        merged: list[Mapping[str, Any]] = []
        for wishes in asked:
            if wishes is None:
                return None
            # What was wished before another stage was of the former one.
            before = merged.pop() if merged and WISH not in wishes else {}
            merged.append({**before, **wishes})
        return merged

    def _guarded(self, work: Callable[..., None], *arguments: Any) -> None:
        """Do something; say what it found wrong."""
        try:
            work(*arguments)
        except AsperityError as error:
            going = self._loop is not None and self._loop.alive
            if not going:
                self._stop()
            self._say("running" if going else "stopped", str(error))

    def _start(self, stage: Stage) -> None:
        self._say("starting", "compiling the loop: the first time takes some seconds")
        setup = stage.setup
        driver = steered_driver(setup.plant, setup.hand, setup.servo, self.wheel)
        reach = setup.safety.reach_on(setup.device)
        spare, self._spare = self._spare, None
        loop = ServoProcess(setup.surface, driver, setup.servo, setup.safety, reach, spare=spare)
        loop.start()
        self._loop, self.shared, self.stage = loop, loop.shared, stage
        self.starts += 1
        self._say("running", " ".join(loop.notes))

    def _go_to(self, wishes: Mapping[str, Any]) -> None:
        stage = self.stages.changed(self.stage, wishes)
        if stage is self.stage and self._loop is not None:
            self._say("running")
            return
        if self._loop is None or self.stage.restarts(stage):
            self._stop()
            self._start(stage)
            return
        self._say("changing", "compiling the law: the first time takes some seconds")
        # Nobody is hurt by a simulated device: to hear it buzz is what the lab is for.
        self._loop.change(stage.setup.surface, accept_risk=True)
        self.stage = stage
        self._say("running")

    def _look(self) -> None:
        if self._loop is not None and (cause := self._loop.poll()) is not Cause.GOING:
            self._stop()
            self._say("stopped", f"the loop has ended: {cause.name.lower()}")

    def _stop(self) -> None:
        loop, self._loop = self._loop, None
        if loop is not None:
            loop.stop()
