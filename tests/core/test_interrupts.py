"""Ctrl-C while a block runs that must not end half-way."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from asperity.core.processes import defer_interrupt

COMPILE = """
import os, signal, threading, time
from asperity import Sinusoid, Surface
surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "C", stiffness=500.0)
interrupted = 0
threading.Timer({delay}, os.kill, (os.getpid(), signal.SIGINT)).start()
begun = time.monotonic()
try:
    surface.force([[0.3e-3, 0.1e-3, -0.2e-3]])
    time.sleep(3600)
except KeyboardInterrupt:
    interrupted = 1
print(interrupted, surface.force([[0.3e-3, 0.1e-3, -0.2e-3]])[0, 2])
"""


def test_interrupt_comes_after_the_block() -> None:
    done = []

    def work() -> None:
        with defer_interrupt(), defer_interrupt():
            signal.raise_signal(signal.SIGINT)
            done.append(1)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [1]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("delay", [0.2, 0.6, 1.2, 2.0])
def test_interrupted_compiler_leaves_nothing_half_done(
    delay: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "0")
    command = [sys.executable, "-c", COMPILE.format(delay=delay)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert output[0] == "1"
    assert float(output[1]) > 0.0
