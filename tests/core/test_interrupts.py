"""Ctrl-C while a block runs that must not end half-way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

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

START = {
    "loop": "from asperity.servo.process import PrestartedProcess\n"
    "parent = PrestartedProcess()\n"
    "child = parent.process",
    "renderer": "from asperity.certification.isolated import IsolatedRenderer\n"
    "from asperity.certification.renderers import RendererSource\n"
    "parent = IsolatedRenderer(RendererSource('pipe', 'cat'))\n"
    "child = parent._process",
    "worker": "from asperity.core.processes import make_pool\n"
    "pool = make_pool(1)\n"
    "pool.submit(abs, 1)\n"
    "child, = pool._processes.values()",
}
INTERRUPT = """
import os, signal, time
try:
    time.sleep({delay})
    os.killpg(0, signal.SIGINT)
    time.sleep(3600)
except KeyboardInterrupt:
    child.join(0.5)
    print(child.is_alive(), signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))
child.kill()
"""


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes here")
@pytest.mark.parametrize("delay", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("start", START)
def test_child_process_takes_no_interrupt_while_it_starts(start: str, delay: float) -> None:
    command = [sys.executable, "-c", START[start] + INTERRUPT.format(delay=delay)]
    process = subprocess.run(
        command, capture_output=True, text=True, check=False, start_new_session=True
    )
    assert (process.stdout, process.stderr) == ("True False\n", "")


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


PIPE = """
import signal, subprocess, sys
from asperity.core.processes import ShieldedContext, ignore_interrupts

def start():
    ignore_interrupts()
    signal.raise_signal(signal.SIGINT)
    program = "import signal; print(signal.pthread_sigmask(0, []) == set(), "
    program += "signal.getsignal(2) is signal.default_int_handler)"
    subprocess.run([sys.executable, "-c", program])

if __name__ == "__main__":
    child = ShieldedContext().Process(target=start)
    child.start()
    child.join()
    print(child.exitcode)
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no masks of signals here")
def test_programs_of_a_child_process_take_interrupts(tmp_path: Path) -> None:
    """Otherwise a program that hangs would outlive Ctrl-C."""
    script = tmp_path / "parent.py"
    script.write_text(PIPE, encoding="utf-8")
    command = [sys.executable, str(script)]
    process = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert process.stdout.split() == ["True", "True", "0"]
