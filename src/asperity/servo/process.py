"""A loop in a process of its own, as the program sees it that starts and watches it."""

from __future__ import annotations

import math
import pickle
import sys
import threading
import time
from contextlib import suppress
from importlib.util import find_spec
from multiprocessing.context import SpawnContext
from types import TracebackType
from typing import Any, Self

from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.errors import AsperityError, ParameterError
from asperity.servo.child import Job, Modules, serve
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import KEPT, Cause, DeviceFault, words_of
from asperity.servo.loop import Rendered, render
from asperity.servo.safety import Safety
from asperity.servo.shared import Shared
from asperity.servo.statistics import Statistics
from asperity.simulation.servo import Servo
from asperity.surface import Surface

LONGEST_START = 120.0
"""[s] until the loop must run: compiling for the first time takes most of it."""
_FOREVER = 2**62
_TOO_LATE = "comes too late: the loop has ended"
_LAST_WORDS = 2.0  # [s] that a process gets to say how it ended


class Spare:
    """A process that stands ready for a loop, made before it is known which: starting takes time.

    Whoever makes one and has no loop for it says so by :meth:`end`.

    Args:
        shared: memory that it shares; its own if ``None``.
    """

    def __init__(self, shared: Shared | None = None) -> None:
        context = SpawnContext()
        self.shared = shared or Shared()
        self.line, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, self.shared), daemon=True)
        self.process.start()
        theirs.close()

    def end(self, patience: float = 0.0) -> None:
        """End it; what it does may take so long to come to an end [s]."""
        self.line.close()
        self.process.join(patience)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


class ServoProcess:
    """A surface on a device, rendered by a process of its own.

    Args:
        surface: what is felt, or what stands in its place, see ``servo.loop.Rendered``.
        driver: the device.
        servo: period, steps of position and force, greatest force, virtual damping.
        safety: limits.
        reach: of the handle from the device's origin [m]; a reading further away is a fault.
        duration: after which it ends [s]; ``None`` for not by itself.
        device: whose limit counts for the surfaces of :meth:`change`.
        spare: the process to be used; its end is then this loop's. ``None`` for a new one.

    Raises:
        ParameterError: for a surface that cannot be rendered, or a device that moves and whose
            greatest force is not known.

    Example:
        Not run as a test: it starts a process on a device; ``tests/servo/test_process.py`` does.

        >>> with ServoProcess(surface, driver, Servo(1e-3)) as loop:  # doctest: +SKIP
        ...     while loop.poll() is Cause.GOING:
        ...         time.sleep(0.05)
    """

    def __init__(
        self, surface: Surface | Rendered, driver: Driver, servo: Servo,
        safety: Safety | None = None, reach: float = math.inf, duration: float | None = None,
        device: Device | None = None, spare: Spare | None = None,
    ) -> None:  # fmt: skip
        need_greatest_force(driver, servo)
        self._driver, self._safety, self._device = driver, safety or Safety(), device
        last = _FOREVER if duration is None else round(duration / servo.period)
        shown = surface if isinstance(surface, Rendered) else render(surface, driver)
        self._job = Job(shown, driver, servo, self._safety, reach, last)
        self._spare = spare
        self.shared = Shared() if spare is None else spare.shared
        self.notes: tuple[str, ...] = ()
        self._cause, self._said = Cause.GOING, ""
        self._seen, self._since = 0, 0.0
        self._beating = threading.Event()

    def __enter__(self) -> Self:
        self.start()
        return self

    def start(self) -> None:
        """Start the process; it renders when this returns.

        Raises:
            ParameterError: for a device that cannot be opened.
            DeviceFault: if the process ends or hangs.
        """
        self._made = self._spare or Spare(self.shared)
        self._line, self._process = self._made.line, self._made.process
        threading.Thread(target=self._beat, daemon=True).start()
        try:
            self._line.send(_packed(self._job))
            self.notes = self._heard("ready", LONGEST_START)
        except BaseException:
            self._end()
            raise
        self._since = time.monotonic()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self.stop()

    @property
    def statistics(self) -> Statistics:
        """What the loop counted."""
        return Statistics.of(self.shared.status)

    @property
    def moving(self) -> bool:
        """Whether a real handle moves."""
        return self._driver.moving

    @property
    def driver(self) -> str:
        """Name of the driver."""
        return self._driver.name

    @property
    def alive(self) -> bool:
        """Whether the process of the loop is there."""
        return bool(self._process.is_alive())

    @property
    def pid(self) -> int:
        """Of the process of the loop."""
        return int(self._process.pid or 0)

    def poll(self) -> Cause:
        """Return why the loop has ended, or ``GOING``.

        Raises:
            DeviceFault: if it was a fault.
        """
        if self._cause is Cause.GOING:
            self._look()
        if self._cause.is_fault:
            raise self.fault()
        return self._cause

    def fault(self) -> DeviceFault:
        """Return the fault that ended the loop."""
        words = self._said if self._cause is Cause.DEVICE else words_of(self._cause)
        rows, _first = self.shared.rows(self.shared.head - KEPT)
        at = f" at {rows[-1, 0]:.4g} s" if len(rows) else ""
        end = f"{words}{at}; the force was made zero"
        if self._cause in {Cause.SILENT, Cause.DIED}:
            end = f"{words}{at}. {self._driver.when_lost}"
        return DeviceFault(self._cause, end, rows)

    def change(self, surface: Surface, *, accept_risk: bool = False) -> None:
        """Render another surface: the force goes, the surface is exchanged, the force comes.

        It is analysed and compiled before, while the one that runs goes on. The law's force is
        multiplied by a share that falls from 1 to 0, and rises from 0 to 1 with the next law, so
        that at no time the stiffness is above that of either.

        Args:
            surface: the next one.
            accept_risk: whether it is rendered at a stiffness above the analysed limit, too.

        Raises:
            ParameterError: for a surface that cannot be rendered, or a stiffness above the limit;
                without a device no limit is known.
            DeviceFault: if the loop has ended by one.
        """
        if not accept_risk:
            self._refuse_risk(surface)
        self.exchange(render(surface, self._driver))

    def _refuse_risk(self, surface: Surface) -> None:
        from asperity.servo.risk import risk

        if self._device is None:
            words = "is not known to the loop, so no limit is: ServoProcess(..., device=...)"
            raise ParameterError("device", words)
        if reason := risk(surface, self._device):
            raise ParameterError("stiffness", f"is refused: {reason}; accept_risk=True renders it")

    def exchange(self, shown: Rendered) -> None:
        """Render something else, which nobody has analysed; see :meth:`change`.

        Raises:
            ParameterError: if it cannot be rendered, or the loop was ended.
            DeviceFault: if the loop has ended by one.
        """
        packed = _packed(shown)
        if self.poll() is not Cause.GOING:
            raise ParameterError("surface", _TOO_LATE)
        with suppress(OSError):  # it has just ended, and said why
            self._line.send(packed)
        self._heard("loaded", LONGEST_START)

    def rows(self, first: int) -> tuple[FloatArray, int]:
        """Return the rows from one on that are still there, and the number of the first."""
        return self.shared.rows(first)

    def stop(self) -> None:
        """Let the force go, and end the loop and its process."""
        if self._cause is Cause.GOING:
            self.shared.stop()
            deadline = time.monotonic() + self._safety.ramp + _LAST_WORDS
            while self._cause is Cause.GOING and time.monotonic() < deadline:
                self._look(0.01)
        self._end()

    def _end(self) -> None:
        """End the process, which has let go of the device unless it hangs."""
        self._beating.set()
        self._made.end(_LAST_WORDS)

    def _beat(self) -> None:
        while not self._beating.wait(0.1 * self._safety.silence):
            self.shared.beat()

    def _look(self, patience: float = 0.0) -> None:
        """Listen to the process, and see whether it goes on."""
        try:
            while self._line.poll(patience):
                self._take(self._line.recv())
        except (EOFError, OSError):
            self._cause = Cause.DIED if self._cause is Cause.GOING else self._cause
        now, head = time.monotonic(), self.shared.head
        if head != self._seen:
            self._seen, self._since = head, now
        elif self._cause is Cause.GOING and now - self._since > self._safety.silence:
            self._cause = Cause.SILENT
            self._process.kill()

    def _take(self, message: tuple[str, Any]) -> str:
        kind, content = message
        if kind == "ended":
            self._cause, self._said = content
        return kind

    def _heard(self, wanted: str, patience: float) -> Any:
        """Return what the process says next, of the wanted kind."""
        try:
            while self._line.poll(patience):
                kind, content = message = self._line.recv()
                if kind == wanted:
                    return content
                if kind in {"failed", "refused"}:
                    raise ParameterError("device" if kind == "failed" else "surface", content)
                self._take(message)
                if self.poll() is not Cause.GOING:
                    raise ParameterError("surface", _TOO_LATE)
        except (EOFError, OSError):
            self._cause = Cause.DIED
        else:
            self._cause = Cause.SILENT
        raise self.fault()


def need_greatest_force(driver: Driver, servo: Servo) -> None:
    """Refuse a device that moves and whose greatest force is not known.

    Raises:
        ParameterError: for one.
    """
    if driver.moving and not math.isfinite(servo.max_force):
        words = "is not known: a device that moves needs it, --set max_force=3N"
        raise ParameterError("max_force", words)


def _packed(thing: object) -> tuple[Modules, bytes]:
    """Return a thing for another process, and the files of modules that it cannot import."""
    try:
        packed = pickle.dumps(thing)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise AsperityError(f"cannot be sent to the loop's process: {error}") from None
    files = {
        name: str(getattr(module, "__file__", ""))
        for name, module in list(sys.modules.items())
        if name.startswith("own_") and name.encode() in packed and find_spec_of(name) is None
    }
    return tuple(files.items()), packed


def find_spec_of(name: str) -> Any:
    """Return how a module is found by its name; ``None`` if it is not."""
    try:
        return find_spec(name)
    except ValueError:  # it was made by hand: it has no spec
        return None
