"""Ends of the lab: no force, and no process that is left."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable

import pytest
from bench.stress.servo_ends import descendants, is_alive
from tests.lab.client import heard, joined, news
from tests.lab.started import Started


def wait_until(reached: Callable[[], bool], patience: float = 30.0) -> bool:
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(0.02)
    return reached()


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGKILL, -9), (signal.SIGHUP, 0), (signal.SIGQUIT, 0)]
)
def test_lab_leaves_no_process(number: int, code: int) -> None:
    lab = Started("--port", "0")
    with joined(lab) as page:
        heard(page, news(state="running"))
        children = set(descendants(lab.process.pid))
        assert len(children) >= 3
        lab.process.send_signal(number)
        lab.process.communicate(timeout=60)
        assert lab.process.returncode == code
    assert wait_until(lambda: not any(map(is_alive, children)))


def test_suspended_lab_has_released_the_force_and_does_not_start_again() -> None:
    lab = Started("--port", "0")
    with joined(lab) as page:
        heard(page, news(state="running"))
        lab.process.send_signal(signal.SIGTSTP)
        assert os.WIFSTOPPED(os.waitpid(lab.process.pid, os.WUNTRACED)[1])
        lab.process.send_signal(signal.SIGCONT)
        told = heard(page, news(state="stopped"))
        assert "Ctrl-Z" in told["message"]
    assert lab.end()[0] == 0
