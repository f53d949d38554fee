"""The repr of results and values is one short line."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.results.device_comparisons import compare_devices
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, simulate

MANY = asp.Fourier(np.full(60, 1e-6), 1e3 * np.random.default_rng(0).normal(size=(60, 2)))
HEIGHTS = 1e-5 * np.random.default_rng(1).normal(size=(32, 32))


def surface(law: str = "C") -> asp.Surface:
    return asp.Surface(asp.Sinusoid(2e-4, 2e-3), law)


def record_run() -> Path:
    """Record a short run; return the path of the recording."""
    path = Path(tempfile.mkdtemp(), "run.mcap")
    hand, motion = SpringHand(stiffness=200.0), Stationary((0.0, 0.0, -1e-3))
    simulate(surface("W"), Cartesian(0.05), hand, Servo(1e-3), motion, 0.1, trace=path)
    return path


def closed_writer() -> asp.RecordingWriter:
    writer = asp.RecordingWriter(Path(tempfile.mkdtemp(), "run.mcap"), (("time", "s"),))
    writer.close()
    return writer


EXAMPLES: dict[str, Callable[[], Any]] = {
    "Analysis": lambda: asp.analyze(surface("B"), "touch"),
    "Bound": lambda: asp.characteristic_number(surface("F")),
    "Certification": lambda: asp.certify(
        surface("W").force, region=[[-1e-3, 0.0]] * 3, seconds=0.1
    ),
    "Comparison": lambda: asp.compare(MANY, "touch", "WC", max_depth=1e-5),
    "Design": lambda: asp.design("sinusoid:amplitude=0.1mm,period=2mm", "touch", "C"),
    "Device": lambda: asp.load_device("touch"),
    "DeviceComparisons": lambda: compare_devices(MANY, ["touch"], laws="WC", max_depths=[1e-5]),
    "Envelope": lambda: asp.envelope("touch", "C", wavelengths=[1e-3, 2e-3]),
    "Fourier": lambda: MANY,
    "Grating": lambda: asp.Grating(1e-4, 1e-3),
    "HeightMap": lambda: asp.HeightMap(HEIGHTS, 5e-5),
    "Law": lambda: surface("H").law,
    "Leak": lambda: asp.worst_loop(surface("B")),
    "Limits": lambda: asp.limits(asp.Sinusoid(2e-4, 2e-3), law="C"),
    "Noise": lambda: asp.Noise(rms=2e-5, size=5e-3),
    "NoiseProfile": lambda: asp.NoiseProfile(rms=2e-5, size=5e-3),
    "Passivity": lambda: asp.analyze(surface("B"), "pantograph").passivity,
    "PotentialField": lambda: asp.bake(surface("H"), resolution=1e-4).texture,
    "Profile": lambda: asp.Profile(HEIGHTS[0], 5e-5),
    "Recording": lambda: asp.open_recording(record_run()),
    "RecordingWriter": closed_writer,
    "Replay": lambda: asp.replay(asp.open_recording(record_run())),
    "Sinusoid": lambda: asp.Sinusoid(2e-4, 2e-3),
    "SplitState": lambda: asp.split_state(surface("H"), np.zeros((200, 3))),
    "SweepResult": lambda: asp.sweep("knurl", {"surface.law": "A,C"}, "limits", processes=1),
    "Surface": lambda: asp.Surface(MANY, "F", max_depth=1e-5),
}


def test_every_public_class_is_tested() -> None:
    public = {name for name in asp.__all__ if isinstance(getattr(asp, name), type)}
    errors = {name for name in public if issubclass(getattr(asp, name), Exception)}
    assert set(EXAMPLES) == public - errors


@pytest.mark.parametrize("name", EXAMPLES)
def test_repr_is_one_short_line(name: str) -> None:
    value = EXAMPLES[name]()
    assert isinstance(value, getattr(asp, name))
    text = repr(value)
    assert len(text) < 300
    assert "\n" not in text
    assert " at 0x" not in text
    assert type(value).__name__ in text


def test_default_repr_of_a_dataclass_is_too_long() -> None:
    @dataclasses.dataclass
    class Bare:
        heights: np.ndarray

    assert "\n" in repr(Bare(HEIGHTS))


@pytest.mark.parametrize("name", asp.surface_names())
def test_repr_of_named_surfaces_is_one_short_line(name: str) -> None:
    assert repr(asp.named_surface(name)).startswith(f"named_surface('{name}', ")
    assert len(repr(asp.named_surface(name))) < 200


def test_repr_of_fourier_lists_few_waves_and_counts_many() -> None:
    assert repr(MANY) == "<Fourier of 60 waves>"
    few = asp.Fourier([1e-4, 2e-4], [[1e3, 0.0], [0.0, 2e3]])
    assert repr(few).startswith("Fourier(amplitudes=[0.0001, 0.0002], wavevectors=")


def test_repr_of_a_baked_surface_has_nodes_and_gain() -> None:
    text = repr(asp.bake(surface("H"), resolution=1e-4).texture)
    assert text.startswith("<PotentialField of Sinusoid(amplitude=0.0002, ")
    assert "nodes, q at most 1." in text


def test_repr_of_a_run_has_the_energy_to_the_hand() -> None:
    hand, motion = SpringHand(stiffness=200.0, damping=2.0), Stationary((0.0, 0.0, -1e-3))
    run = simulate(surface(), Cartesian(0.05), hand, Servo(1e-3), motion, 0.1)
    assert repr(run) == f"<Run of law C, 0.1 s, {run.ledger.total:+.4g} J to the hand>"


def test_repr_of_results_has_the_recommendation_or_verdict() -> None:
    texture = asp.Sinusoid(2e-4, 2e-3)
    result = asp.compare(texture, "omega.3", "WCH")
    row = result.recommended_row
    assert row is not None
    recommendation = f"start at {row.recommended_stiffness:g} N/m, felt"
    assert repr(row) == f"<LawRow {row.law.letter}: {recommendation}>"
    assert repr(result) == f"<Comparison of 3 laws on omega.3: {row!r} recommended>"
    assert repr(asp.compare(texture, "touch", "W")).endswith("none recommended>")
    analysis = repr(asp.analyze(asp.Surface(texture, "A", 100.0), "omega.3"))
    assert analysis.startswith("<Analysis of law A on omega.3: q = ")
    assert analysis.endswith("not passive>")
    limits = repr(asp.limits(texture, "omega.3", law="C"))
    assert limits == "<Limits of law C on omega.3 at 0.1 m/s: 4 of 6 hold, felt>"
    several = repr(compare_devices(texture, ["omega.3", "2diy"], laws="W"))
    assert several == "<DeviceComparisons: 1 compared, 1 without data>"
