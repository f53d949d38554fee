"""The history of a preparation: parameters of the surface after each step."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import SurfaceFileError
from asperity.measured.preparation import magnify_surface, prepare
from asperity.measured.prepared import PreparationStage, load_prepared, parse_stages, save_prepared
from asperity.measured.reading import RawSurface
from asperity.textures.catalogue import texture_from_prepared

MICRO = 1e-6


def surface(hole: bool = True) -> RawSurface:
    """Return waves of 1 mm, 0.1 mm and 20 µm, 4, 2 and 1 µm high, on a tilt of 1 %."""
    x = np.arange(401) * 5e-6
    line = sum(
        height * MICRO * np.cos(2 * np.pi * x / length)
        for height, length in ((4, 1e-3), (2, 1e-4), (1, 2e-5))
    )
    heights = np.tile(line + 0.01 * x, (21, 1))
    if hole:
        heights[3:6, 100:110] = np.nan
    return RawSurface(heights, (5e-6, 5e-6), "made", ())


def stage_names(stages: tuple[PreparationStage, ...]) -> list[str]:
    return [stage.name for stage in stages]


def test_every_step_is_recorded() -> None:
    arguments: dict[str, Any] = {"s_cutoff": 2e-5, "l_cutoff": 1e-4, "tip_radius": 1e-5}
    ready = prepare(surface(), outliers=9.0, periodic=True, blend=5e-5, magnify=3.0, **arguments)
    assert stage_names(ready.history) == [
        "as read",
        "without outliers",
        "levelled",
        "holes filled",
        "S-filter 20 µm",
        "L-filter 100 µm",
        "tip 10 µm",
        "periodic",
        "magnified",
    ]
    assert stage_names(prepare(surface(hole=False)).history) == [
        "as read",
        "levelled",
        "S-filter 20 µm",
    ]
    with_form = prepare(surface(), height_range=1e-3, form=2, max_missing=0.5)
    assert stage_names(with_form.history)[:2] == ["as read", "form removed"]
    assert texture_from_prepared(ready).history == ready.history


def test_stages_state_the_removed_heights_of_each_filter() -> None:
    """Cosines are smooth at the mirrored border, so the filters remove known shares."""
    ready = prepare(surface(hole=False), form=0, s_cutoff=2e-5, l_cutoff=1e-4)
    by_name = {stage.name: stage for stage in ready.history}
    tilt = 0.01 * np.arange(401) * 5e-6
    assert by_name["mean removed"].removed is not None
    assert by_name["mean removed"].removed.range == 0.0
    short = by_name["S-filter 20 µm"].removed
    long = by_name["L-filter 100 µm"].removed
    assert short is not None
    assert long is not None
    # The S-filter removes half of the shortest wave and 3 % of the middle one ...
    removed = [
        (1 - 2.0 ** -((2e-5 / length) ** 2)) * h * MICRO
        for h, length in ((4, 1e-3), (2, 1e-4), (1, 2e-5))
    ]
    assert short.rms == pytest.approx(math.hypot(*removed) / math.sqrt(2), rel=0.01)
    # ... the L-filter nearly all of the longest, half of the middle one, and the tilt.
    passed = math.hypot(4 * MICRO * 2.0 ** -(0.1**2), MICRO * 2.0 ** -(0.2**2)) / math.sqrt(2)
    assert long.rms == pytest.approx(math.hypot(passed, tilt.std()), rel=0.02)
    left = by_name["L-filter 100 µm"].values["Sq"]
    assert left == pytest.approx(np.std(ready.heights), rel=1e-12)


def test_parameters_use_measured_points_until_holes_are_filled() -> None:
    raw = surface()
    ready = prepare(raw)
    first, level, filled = ready.history[:3]
    assert first.values["Sq"] == pytest.approx(np.nanstd(raw.heights), rel=1e-12)
    assert level.removed is not None
    assert level.removed.range == pytest.approx(0.01 * 400 * 5e-6, rel=0.1)
    assert (first.removed, filled.removed) == (None, None)
    assert filled.values["Sq"] != level.values["Sq"]


def test_profile_parameters_change_from_p_to_r_after_the_l_filter() -> None:
    raw = surface(hole=False)
    line = RawSurface(raw.heights[0], raw.pitch[:1], "made", ())  # type: ignore[index]  # it has one
    history = prepare(line, l_cutoff=2e-4, tip_radius=1e-5, magnify=2.0).history
    kinds = [next(iter(stage.values))[0] for stage in history]
    assert kinds == ["P", "P", "P", "R", "R", "R"]
    assert [stage.nesting for stage in history] == [None, None, None, 2e-4, 2e-4, 4e-4]
    for symbol, before in history[-2].values.items():
        factor = 1.0 if symbol in {"Rsk", "Rku", "Rdq"} else 2.0
        assert before is not None
        assert history[-1].values[symbol] == pytest.approx(factor * before, rel=1e-9)


def test_stage_callback_receives_heights_before_and_after() -> None:
    calls: list[tuple[str, float | None]] = []

    def watch(stage: PreparationStage, pitch: Any, after: Any, before: Any) -> None:
        assert pitch == (5e-6, 5e-6)
        calls.append((stage.name, None if before is None else float(np.nanstd(before - after))))

    ready = prepare(surface(), on_stage=watch)
    assert calls == [
        (stage.name, None if stage.removed is None else pytest.approx(stage.removed.rms, rel=1e-9))
        for stage in ready.history
    ]


def test_history_is_saved_and_loaded(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"x")
    flat = RawSurface(np.zeros((5, 6)), (1e-6, 1e-6), "flat", ())  # its skewness is undefined
    for raw in (surface(), flat):
        ready = prepare(raw)
        save_prepared(tmp_path / "ready.npz", ready, source)
        loaded = load_prepared(tmp_path / "ready.npz")
        assert loaded.history == ready.history
    assert stage_names(magnify_surface(loaded, 2.0).history)[-1] == "magnified"


def test_missing_and_damaged_history_is_refused(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"x")
    save_prepared(tmp_path / "ready.npz", prepare(surface()), source)
    with np.load(tmp_path / "ready.npz") as members:
        members_without_history = {name: members[name] for name in members if name != "history"}
    np.savez(tmp_path / "bad.npz", **members_without_history)
    with pytest.raises(SurfaceFileError, match="damaged prepared surface"):
        load_prepared(tmp_path / "bad.npz")
    for wrong in ("[", "{}", '[{"name": "x"}]', '[{"name": "x", "values": {"Q": 1}}]', "[1]"):
        np.savez(tmp_path / "bad.npz", **members_without_history, history=np.array(wrong))
        if wrong == "{}":
            assert load_prepared(tmp_path / "bad.npz").history == ()
            continue
        with pytest.raises(SurfaceFileError, match="damaged prepared surface"):
            load_prepared(tmp_path / "bad.npz")


def test_stages_round_trip_through_json() -> None:
    stages = prepare(surface(), l_cutoff=1e-4).history
    assert parse_stages([stage.to_dict() for stage in stages]) == stages
