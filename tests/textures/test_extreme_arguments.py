"""Every kind with extreme arguments is refused or analyzed in bounded time and memory."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.results.analyze import analyze
from asperity.analysis.results.compare import compare
from asperity.core.errors import ParameterError
from asperity.report.pages.analysis_report import leak_facts
from asperity.scene import load_scene
from asperity.surface import Surface
from asperity.textures.catalogue import CATALOGUE

EXTREMES = ("1e-30", "1e30")
WAVES = [
    "sinusoid:amplitude=1m,period=1nm",
    "sinusoid:amplitude=1e30,period=1e-30",
    "sinusoid:amplitude=1um,period=1e-30",
    "fourier:amplitudes=1e30m,wavevectors=1e30 0 rad/m",
    "fourier:amplitudes=1e-30,wavevectors=1e-30 0",
    "fourier:amplitudes=1,wavevectors=1e10 0",
    "fourier:amplitudes=1,wavevectors=1e10 1e3; 1 1e10",
]


def _specifications() -> Iterator[str]:
    yield from WAVES
    for name, kind in CATALOGUE.items():
        if name == "fourier":
            continue
        for argument in kind.arguments:
            for value in EXTREMES if argument.form in {"quantity", "pair", "integer"} else ():
                arguments = {**(kind.example or {}), argument.name: value}
                yield f"{name}:" + ",".join(f"{key}={text}" for key, text in arguments.items())


# Heights of 1e30 m may overflow; only time and memory are checked.
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("specification", list(_specifications()))
def test_extreme_arguments_take_bounded_time_and_memory(specification: str) -> None:
    start_time, memory_before = (
        time.process_time(),
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    )
    with suppress(ParameterError):
        compare(load_scene(specification).texture, laws="A")
    assert time.process_time() - start_time < 20.0
    assert (
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory_before < 1_000_000
    )  # kilobytes


def test_leak_of_a_wave_too_steep_for_a_loop_is_unknown() -> None:
    """Everything else is computed, and the passivity of the law is undecided."""
    wave = load_scene(WAVES[0]).texture
    with pytest.raises(ParameterError, match=r"too steep for its leak.*amplitude.*period"):
        worst_loop(Surface(wave, "A"))
    full = analyze(Surface(wave, "A"))
    assert math.isnan(full.leak.energy)
    facts = dict(leak_facts(full))
    assert facts["energy"] == "–"
    assert "f_c*" in facts
    assert "W/length" not in str(facts)
    assert full.passivity.reason.startswith("not decidable: the surface is too steep")
    (row,) = compare(wave, laws="A").rows
    assert math.isnan(row.leak.energy)
    assert row.leak.upper_per_period == math.inf
    assert "too steep" in row.leak.description
    assert (row.passivity.verdict, row.tier) == ("undecided", "not felt")
    with pytest.raises(ParameterError, match="amplitudes and wavevectors make a curvature"):
        load_scene("fourier:amplitudes=1e30m,wavevectors=1e30 0 rad/m")


def test_analysis_of_a_curvature_radius_below_double_precision() -> None:
    """Crests of 1 m have a radius of 25e-21 m, and an anchor would pass a million waves."""
    wave = load_scene(WAVES[0]).texture
    assert analyze(Surface(wave, "D")).q.upper == math.inf
    with pytest.raises(ParameterError, match=r"a loop of 4.2 mm turns.*max_deflection"):
        worst_loop(Surface(wave, "F"))
    assert math.isnan(analyze(Surface(wave, "F")).leak.energy)
