"""A lab that runs in a process of its own, as a user starts it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

LAB = (sys.executable, "-m", "asperity", "lab", "--no-browser")
_FAST = """from asperity.__main__ import main
from asperity.lab import session

session.CLOCK_SPEED = 2
main()"""
FAST_LAB = (sys.executable, "-c", _FAST, *LAB[3:])
"""A lab whose simulated loop runs twice as fast as the time of the system."""


class Started:
    """A lab.

    Args:
        arguments: further arguments of the command.
        command: starts the lab; this Python's by default.
        environment: its variables; those of this process by default.

    Attributes:
        address: of its page.
        process: that serves it.
    """

    def __init__(
        self,
        *arguments: str,
        command: Sequence[str] = LAB,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.process = subprocess.Popen(
            [*command, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        assert self.process.stderr is not None
        said = ""
        while (found := re.search(r"http://\S+", said)) is None:
            if not (line := self.process.stderr.readline()):
                raise AssertionError(said + self.process.communicate()[1])
            said += line
        self.address = found[0]

    @property
    def host(self) -> str:
        return self.address.split("/")[2]

    def children(self) -> list[int]:
        """Return the processes that it has started, among them that of the loop."""
        children = ""
        for task in Path(f"/proc/{self.process.pid}/task").iterdir():
            with suppress(FileNotFoundError):  # a thread that ended meanwhile
                children += (task / "children").read_text()
        return [int(child) for child in children.split()]

    def end(self) -> tuple[int, str]:
        """End it as Ctrl-C does; exit code, and what else it said."""
        self.process.send_signal(signal.SIGINT)
        _out, error = self.process.communicate(timeout=60)
        return self.process.returncode, error

    def close(self) -> None:
        """End it, if nobody has."""
        if self.process.poll() is None:
            self.end()
