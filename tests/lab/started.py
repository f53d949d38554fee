"""A lab that runs in a process of its own, as a user starts it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys


class Started:
    """A lab.

    Attributes:
        address: of its page.
        process: that serves it.
    """

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "asperity", "lab", "--no-browser", *arguments]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
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

    def end(self) -> tuple[int, str]:
        """End it as Ctrl-C does; exit code, and what else it said."""
        self.process.send_signal(signal.SIGINT)
        _out, error = self.process.communicate(timeout=60)
        return self.process.returncode, error

    def close(self) -> None:
        """End it, if nobody has."""
        if self.process.poll() is None:
            self.end()
