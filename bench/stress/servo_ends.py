"""Ends of `asperity run` at random: what force was commanded last, when, and what is left behind.

``python -m bench.stress.servo_ends [COUNT [SEED]] [DRIVER ...]`` (200 by default). Each end is one
command on a pseudo-terminal of its own, with a device that stands in for a vendor's and writes down
what it is told. While it holds a force, a signal comes, the terminal closes, a process is killed or
suspended, or a call of the device takes long. ``python -m bench.stress.servo_ends table`` tries
each end once.
"""

from __future__ import annotations

import fcntl
import os
import random
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import termios
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from mmap import mmap
from pathlib import Path
from typing import Self

from rich.console import Console

from bench.speed.cases import HELD_HANDLE
from bench.stand_ins.fake_haply import FakeHaply
from bench.stand_ins.fakes import compile_library

HERE = Path(__file__).parents[1] / "stand_ins" / "c"
COUNT, PATIENCE = 200, 12.0
STARTS = 5
"""Most starts of a run that a busy machine makes too late."""
RAMP, RELEASE = 0.25, 0.02
"""Time of the ramp, and of everything else until the force is zero [s]."""
SCENE = f"""
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "200 N/m"
max_depth = "9 mm"
[device]
id = "touch"
update_rate = "1 kHz"
max_force = "3 N"
{HELD_HANDLE}
[servo]
origin = ["0.3 mm", "0.2 mm", "1 mm"]
"""
NANO = 1_000_000_000


@dataclass(frozen=True)
class Log:
    """What a device was told.

    Attributes:
        force: commanded last [N].
        zero_at: when it became zero [ns]; 0 while it is not.
        closed: whether the device was closed; ``None`` if it does not know.
        process: number of the process that opened it; 0 if it does not know.
    """

    force: tuple[float, ...]
    zero_at: int
    closed: bool | None = None
    process: int = 0


class StandIn:
    """A device behind a compiled library; use it in a ``with``.

    Args:
        source: file of C.
        driver: name on the command line; ``{}`` is the path of the library.
        variable: of the environment that names the library; empty for none.
    """

    _FIELDS = struct.Struct("3d5q")

    def __init__(self, source: str, driver: str, variable: str = "") -> None:
        self._kept = ExitStack()
        folder = Path(self._kept.enter_context(tempfile.TemporaryDirectory()))
        library = str(compile_library(HERE / source, folder))
        path = folder / "log"
        path.write_bytes(bytes(self._FIELDS.size))
        self.driver = driver.format(library)
        self.environment = {"ASPERITY_FAKE_LOG": str(path)} | (
            {variable: library} if variable else {}
        )
        self._memory = mmap(self._kept.enter_context(path.open("r+b")).fileno(), self._FIELDS.size)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._kept.close()

    def read(self) -> Log:
        """Return what it was told."""
        x, y, z, zero_at, _written, closed, _stall, pid = self._FIELDS.unpack(self._memory[:])
        return Log((x, y, z), zero_at, bool(closed), pid)

    def stall(self, seconds: float) -> None:
        """Let the next command take long."""
        self._memory[48:56] = struct.pack("q", round(seconds * NANO))


class HaplyStandIn(StandIn):
    """A service on a port of its own."""

    def __init__(self) -> None:
        self._kept = ExitStack()
        self._service = self._kept.enter_context(FakeHaply())
        self.driver, self.environment = "haply", {"ASPERITY_HAPLY": self._service.address}

    def read(self) -> Log:
        """Return the last force that came, and when the first zero after the last other one did."""
        zero_at, last = 0, (0.0, 0.0, 0.0)
        for when, last in reversed(self._service.forces[-3000:]):
            if any(last):
                break
            zero_at = when
        force = self._service.forces[-1][1] if self._service.forces else (0.0, 0.0, 0.0)
        return Log(force, zero_at)


DEVICES: dict[str, Callable[[], StandIn]] = {
    "own": lambda: StandIn("fake_own.c", "{}"),
    "forcedimension": lambda: StandIn("fake_dhd.c", "forcedimension", "ASPERITY_LIBDHD"),
    "openhaptics": lambda: StandIn("fake_hd.c", "openhaptics", "ASPERITY_LIBHD"),
    "haply": HaplyStandIn,
}
"""A stand-in for each vendor's driver, and for a device of a user."""


class LateStartError(AssertionError):
    """A loop that ended itself before its event, because a busy machine made it late."""


class Run:
    """A command on a pseudo-terminal, with a loop that holds a force.

    Args:
        device: stand-in.
        folder: for its scene.
        options: further ones of the command.
        settings: further lines of the section ``[servo]`` of the scene.

    Attributes:
        command: the command.
        environment: of its process.
        parent: process of the command.
        loop: number of the loop's process.
        device: stand-in.
    """

    def __init__(self, device: StandIn, folder: Path, *options: str, settings: str = "") -> None:
        self.device = device
        scene = folder / "scene.toml"
        scene.write_text(SCENE + settings)
        self._terminal, theirs = os.openpty()
        self.command = [
            *(sys.executable, "-m", "asperity", "run", str(scene)),
            *("--driver", device.driver, "--accept-risk", *options),
        ]
        self.environment = os.environ | device.environment | {"TMPDIR": str(folder)}
        self.parent = subprocess.Popen(
            self.command,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env=self.environment,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # noqa: PLW1509 - no threads
        )
        os.close(theirs)
        os.set_blocking(self._terminal, False)
        self.said, self.loop = b"", 0
        self.children: set[int] = set()
        self._wait_for_force()

    def _wait_for_force(self) -> None:
        end, seen = time.monotonic() + 90.0, 0.0
        while time.monotonic() < end and self.parent.poll() is None:
            self.drain()
            log = self.device.read()
            self.children |= set(descendants(self.parent.pid))
            held = any(log.force)
            if held and not seen:
                seen = time.monotonic()
            if held and time.monotonic() - seen > 0.5:
                loops = [one for one in self.children if b"spawn_main" in _command(one)]
                self.loop = log.process or (loops[0] if loops else 0)
                return
            time.sleep(0.02)
        error = LateStartError if self.was_late else AssertionError
        raise error(f"no force: {self.said.decode(errors='replace')[-500:]}")

    @property
    def was_late(self) -> bool:
        """Whether the loop has said that it ended because it was late."""
        return b"late for too long" in self.said

    def drain(self) -> None:
        """Read what the command printed, so that it can print more."""
        with suppress(OSError):
            while more := os.read(self._terminal, 1 << 16):
                self.said += more

    def close_terminal(self) -> None:
        """Close the terminal, as closing its window does."""
        os.close(self._terminal)
        self._terminal = -1

    def end(self) -> list[int]:
        """Wait for the command, and return the processes that are left, which are then killed."""
        end = time.monotonic() + PATIENCE
        while self.parent.poll() is None and time.monotonic() < end:
            if self._terminal >= 0:
                self.drain()
            time.sleep(0.01)
        ended = self.parent.poll() is not None
        known = self.children | ({self.loop} if self.loop else set())
        end = time.monotonic() + 3.0 + (PATIENCE if ended else 0.0)
        while (left := [one for one in known if is_alive(one)]) and time.monotonic() < end:
            time.sleep(0.02)
        left += [] if ended else [self.parent.pid]
        for one in left:
            with suppress(OSError):
                os.kill(one, signal.SIGKILL)
        self.parent.wait()
        if self._terminal >= 0:
            os.close(self._terminal)
        return left


def descendants(pid: int) -> Iterator[int]:
    """Yield the processes that a process started, directly or not."""
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in map(int, (task / "children").read_text().split()):
                yield child
                yield from descendants(child)


def _command(pid: int) -> bytes:
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def is_alive(pid: int) -> bool:
    """Return whether a process runs or is suspended."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


Event = Callable[[Run, random.Random], float]
"""Lets something happen; returns the time after the call from which its end counts [s]."""


def _signal(number: int, *, group: bool = False) -> Event:
    def event(run: Run, _draw: random.Random) -> float:
        (os.killpg if group else os.kill)(run.parent.pid, number)
        return 0.0

    return event


def _close(run: Run, _draw: random.Random) -> float:
    run.close_terminal()
    return 0.0


def _kill_loop(run: Run, _draw: random.Random) -> float:
    os.kill(run.loop, signal.SIGKILL)
    return 0.0


def _stall(least: float, most: float) -> Event:
    def event(run: Run, draw: random.Random) -> float:
        seconds = draw.uniform(least, most)
        run.device.stall(seconds)
        return seconds

    return event


def _suspend(*, loop: bool) -> Event:
    def event(run: Run, draw: random.Random) -> float:
        """Suspend for up to three seconds; what counts is the time after it goes on."""
        (os.kill if loop else os.killpg)(run.loop if loop else run.parent.pid, signal.SIGSTOP)
        time.sleep(draw.uniform(0.1, 3.0))
        if loop:
            return 0.0
        os.killpg(run.parent.pid, signal.SIGCONT)
        return 0.0

    return event


def _hang_up_keys(key: bytes) -> Event:
    def event(run: Run, _draw: random.Random) -> float:
        os.write(run._terminal, key)
        return 0.0

    return event


EVENTS: dict[str, Event] = {
    "Ctrl-C": _hang_up_keys(b"\x03"),
    "Ctrl-\\ (QUIT)": _hang_up_keys(b"\x1c"),
    "Ctrl-Z (TSTP)": _hang_up_keys(b"\x1a"),
    "terminal closed": _close,
    "HUP": _signal(signal.SIGHUP),
    "TERM": _signal(signal.SIGTERM),
    "TERM to the group": _signal(signal.SIGTERM, group=True),
    "HUP to the group": _signal(signal.SIGHUP, group=True),
    "QUIT": _signal(signal.SIGQUIT),
    "USR1": _signal(signal.SIGUSR1),
    "USR1 to the group": _signal(signal.SIGUSR1, group=True),
    "KILL of the command": _signal(signal.SIGKILL),
    "KILL of the group": _signal(signal.SIGKILL, group=True),
    "KILL of the loop": _kill_loop,
    "loop suspended (STOP)": _suspend(loop=True),
    "group suspended (STOP)": _suspend(loop=False),
    "call of 0.03 to 0.9 s": _stall(0.03, 0.9),
    "call of 1 to 5 s": _stall(1.0, 5.0),
}
"""What may happen."""
RAMPED = (
    "Ctrl-C",
    "Ctrl-Z (TSTP)",
    "terminal closed",
    "HUP",
    "TERM",
    "TERM to the group",
    "HUP to the group",
)
"""Ends that ramp the force down first."""
LOSSES = ("KILL of the loop",)
"""Ends after which nobody can command anything, but the device's own library."""


MAY_GO_ON = ("loop suspended (STOP)", "group suspended (STOP)")
"""Events after which a loop goes on that was late, or not supervised, for less than its limit."""
SILENCE = {"group suspended (STOP)": 1.0}
"""Events that the loop notices by a missing heartbeat, and after which time [s]."""


def _end_if_it_goes_on(run: Run) -> int:
    """End a loop that goes on by SIGQUIT, and return when [ns]; 0 if it has ended."""
    time.sleep(0.2)
    if not any(run.device.read().force):
        return 0
    run.parent.send_signal(signal.SIGQUIT)
    return time.monotonic_ns()


@dataclass(frozen=True)
class End:
    """How a command ended.

    Attributes:
        event: what happened.
        driver: name of the driver.
        is_zero: whether the last commanded force is zero.
        delay: from the event to the first zero [s]; infinite for none.
        closed: whether the device was closed; ``None`` if it does not know.
        code: exit code.
        left: processes that were left.
    """

    event: str
    driver: str
    is_zero: bool
    delay: float
    closed: bool | None
    code: int | None
    left: int

    @property
    def is_right(self) -> bool:
        """Whether the force was zero in time, and nothing is left."""
        ramp = RAMP if self.event in RAMPED else 0.0
        allowed = RELEASE + ramp + SILENCE.get(self.event, 0.0)
        released = (self.is_zero and self.delay <= allowed) or self.event in LOSSES
        return released and not self.left


def try_end(driver: str, event: str, draw: random.Random) -> End:
    """Return how a run of a driver ends by an event; one that was late before it is started again.

    Raises:
        AssertionError: if no start of ``STARTS`` comes to hold a force.
    """
    for _attempt in range(STARTS - 1):
        with suppress(LateStartError):
            return _end_of_one_run(driver, event, draw)
    return _end_of_one_run(driver, event, draw)


def _end_of_one_run(driver: str, event: str, draw: random.Random) -> End:
    with tempfile.TemporaryDirectory() as folder, DEVICES[driver]() as device:
        run = Run(device, Path(folder))
        try:
            begun = time.monotonic_ns()
            counted = begun + round(NANO * EVENTS[event](run, draw))
            if "suspended" in event:
                counted = begun
            if event in MAY_GO_ON:
                counted = _end_if_it_goes_on(run) or counted
            if "TSTP" in event:
                time.sleep(1.5)
                os.kill(run.parent.pid, signal.SIGCONT)
        finally:
            left = run.end()
        log = device.read()
        delay = (log.zero_at - counted) / NANO if log.zero_at else float("inf")
        zero = not any(log.force)
        code = run.parent.returncode
        return End(event, driver, zero, max(delay, 0.0), log.closed, code, len(left))


def _print_ends(console: Console, ends: list[End]) -> None:
    by_event: dict[str, list[End]] = defaultdict(list)
    for end in ends:
        by_event[end.event].append(end)
    for event, some in sorted(by_event.items()):
        zero = [1e3 * end.delay for end in some if end.is_zero and end.delay < 1e9]
        text = f"median {statistics.median(zero):.1f} ms, worst {max(zero):.1f} ms" if zero else "-"
        console.print(
            f"{event:24} {len(some):3} ends, {sum(end.is_right for end in some):3} right; zero in"
            f" {sum(end.is_zero for end in some)}: {text}; closed in"
            f" {sum(bool(end.closed) for end in some)}; left {sum(end.left for end in some)}"
        )
    console.print(f"{sum(end.is_right for end in ends)} of {len(ends)} right")


def run(arguments: Sequence[str], console: Console) -> int:
    """Print how runs ended; return how many ended wrongly."""
    wanted = list(arguments)
    table = bool(wanted) and wanted[0] == "table"
    count = int(wanted[0]) if wanted and wanted[0].isdecimal() else COUNT
    seed = int(wanted[1]) if len(wanted) > 1 and wanted[1].isdecimal() else 0
    drivers = [name for name in wanted if name in DEVICES] or list(DEVICES)
    draw, ends = random.Random(seed), list[End]()
    pairs = [(driver, event) for event in EVENTS for driver in drivers]
    if not table:
        pairs = [(draw.choice(drivers), draw.choice(list(EVENTS))) for _ in range(count)]
    for driver, event in pairs:
        silent = "call" in event and driver == "haply"
        try:
            ends.append(try_end("own" if silent else driver, event, draw))
        except AssertionError as error:
            words = str(error).splitlines()[-1][-100:]
            console.print(f"  not started: {driver}, {event}: {words}", markup=False)
            continue
        console.file.flush()
        if not ends[-1].is_right:
            console.print(f"  wrong: {ends[-1]}", markup=False)
    _print_ends(console, ends)
    return sum(not end.is_right for end in ends)


if __name__ == "__main__":
    sys.exit(bool(run(sys.argv[1:], Console(width=140, highlight=False))))
