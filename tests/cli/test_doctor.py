"""``asperity doctor``: what a report of a fault has to say about this machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import pytest

import asperity
from asperity.core.errors import ParameterError
from asperity.scene import doctor
from asperity.servo.loop_memory import LoopStatistics

Call = Callable[..., tuple[int, str, str]]
pytestmark = pytest.mark.usefixtures("short_loop")


@pytest.fixture
def short_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the loop for a tenth of a second, without libraries of vendors."""
    (default,) = doctor.examine_machine.__defaults__ or ()
    assert default == doctor.LOOP_TIME == 2.0
    monkeypatch.setattr(doctor.examine_machine, "__defaults__", (0.1,))
    for name in ("ASPERITY_LIBDHD", "ASPERITY_LIBHD"):
        monkeypatch.setenv(name, "/nowhere/library.so")
    monkeypatch.setenv("ASPERITY_HAPLY", "localhost:1")


def test_report_names_system_versions_timing_drivers_and_cache(call: Call) -> None:
    code, out, _err = call("doctor", width=300)
    assert code == 0
    assert f"asperity {asperity.__version__}, Python {sys.version.split()[0]}" in out
    for word in ("System: ", "Simulated loop at 1 kHz:", "Start delay: ", "Cache: "):
        assert word in out
    assert "forcedimension: needs /nowhere/library.so, which is not found" in out
    assert "haply: needs the Haply Inverse Service, which does not answer at localhost:1" in out


def test_json_holds_the_counts_of_the_loop(call: Call) -> None:
    code, out, _err = call("doctor", "--json", "-")
    data = json.loads(out)
    assert (code, data["schema"]) == (0, 1)
    counts = data["statistics"]
    assert counts["samples"] + counts["skipped"] >= 100
    assert sum(counts["lateness_histogram"]) == counts["samples"]
    assert [driver["name"] for driver in data["drivers"]][:3] == [
        "haply",
        "forcedimension",
        "openhaptics",
    ]
    assert all(driver["failure"] for driver in data["drivers"][:3])


def test_a_loop_that_does_not_start_is_reported(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: object, **_options: object) -> LoopStatistics:
        raise ParameterError("driver", "needs memory shared by two processes")

    monkeypatch.setattr(doctor, "ServoProcess", refuse)
    code, out, _err = call("doctor", width=200)
    assert code == 0
    assert "it did not run: driver needs memory shared by two processes" in out
