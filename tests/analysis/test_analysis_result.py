"""Results of analyze() for one law on one surface and one device."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.results.analyze import STEPS, Analysis, analyze
from asperity.core.errors import ParameterError
from asperity.devices import Device, parse_device
from asperity.devices.device import Datum
from asperity.laws import find_law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid

AMPLITUDE, PERIOD, DEPTH, K = 0.3e-3, 1.1e-3, 0.37e-3, 730.0
# Not symmetric about the origin.
TEXTURE = Sinusoid(AMPLITUDE, PERIOD, phase=0.4)
SLOPE = 2 * math.pi * AMPLITUDE / PERIOD
HESSIAN = SLOPE * 2 * math.pi / PERIOD
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 0, "max_stiffness": "3 N/mm"}
PARTIAL = {"max_stiffness": "3 N/mm"}


def surface(law: str, **arguments: float) -> Surface:
    return Surface(TEXTURE, law, **{"stiffness": K, "max_depth": DEPTH, **arguments})


@pytest.fixture(scope="module")
def rig() -> Device:
    return parse_device(RIG, "rig")


@pytest.fixture(scope="module")
def groove(rig: Device) -> Analysis:
    return analyze(surface("A"), rig)


def test_numbers_equal_the_closed_forms(groove: Analysis, rig: Device) -> None:
    """MATH section 4: q, q⁺ and the curl of A; for B the maximum of slope and curvature terms."""
    expected = {
        "q": math.hypot(1.0, SLOPE),
        "one_sided": 0.5 * (1.0 + math.hypot(1.0, SLOPE)),
        "curl": SLOPE,
    }
    for name, value in expected.items():
        bound = getattr(groove, name)
        assert bound.lower <= value * (1 + 1e-12), name
        assert bound.upper >= value * (1 - 1e-12), name
        assert bound.upper / bound.lower < 1 + 1e-5, name
    other = analyze(surface("B"), rig).q
    assert other.value == pytest.approx(max(math.hypot(1.0, SLOPE), DEPTH * HESSIAN), rel=1e-9)


def test_curl_density_is_the_curl_times_the_stiffness(groove: Analysis) -> None:
    density = groove.curl_density
    assert density is not None
    assert density.lower <= K * SLOPE <= density.upper
    assert density.upper == pytest.approx(K * SLOPE, rel=1e-5)


@pytest.mark.parametrize("law", ["A", "B", "C", "F", "G"])
def test_witness_attains_the_lower_bound(law: str, rig: Device) -> None:
    bound = analyze(surface(law), rig).q
    state = ()
    if law == "F":
        assert bound.deflection is not None
        state = (np.array([bound.deflection]), np.array([bound.sliding]))
    else:
        assert bound.deflection is None
    jacobian = surface(law).jacobian([bound.at], *state)[0]
    assert np.linalg.norm(jacobian, 2) / K == pytest.approx(bound.lower, rel=1e-12)


def test_worst_loop_and_critical_speed_of_law_a(groove: Analysis) -> None:
    """The energy is k D 2A; v* is the greatest W/length over σ₀."""
    energy = 2 * K * DEPTH * AMPLITUDE
    assert groove.leak.energy == pytest.approx(energy, rel=1e-3)
    assert groove.leak.energy <= energy <= groove.leak.upper_per_period
    assert asp.loop_work(groove.surface, groove.leak.vertices) == pytest.approx(
        groove.leak.energy, rel=1e-9
    )
    corners = np.vstack([groove.leak.vertices, groove.leak.vertices[:1]])
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    assert groove.v_star == groove.leak.absorbing.found / 2.0
    assert groove.leak.absorbing.found > 1.2 * groove.leak.energy / length
    assert not groove.conservative
    assert groove.passivity.verdict == "not passive"
    assert "is not passive: a loop gains" in groove.answer


def test_conservative_law_has_zero_leak_and_v_star(rig: Device) -> None:
    result = analyze(surface("C"), rig)
    assert result.conservative
    assert result.curl is not None
    assert (result.curl.upper, result.leak.energy, result.v_star) == (0.0, 0.0, 0.0)
    density = result.curl_density
    assert density is not None
    assert density.upper == 0.0
    assert result.continuity.continuous
    assert result.continuity.jumps == ()


@pytest.mark.parametrize(
    ("law", "device", "verdict", "words"),
    [
        ("H", RIG, "passive", "is passive up to 16000 N/m, proved by k q⁺ <= 2σ₀/T;"),
        (
            "H",
            PARTIAL,
            "plausible",
            "is plausibly passive up to 3000 N/m, by k q <= K₀, not proved",
        ),
        ("A", PARTIAL, "not passive", "is not passive: a loop gains"),
        ("D", PARTIAL, "undecided", "is not known to be passive: "),
    ],
)
def test_answer_states_the_verdict(
    law: str, device: dict[str, str], verdict: str, words: str
) -> None:
    result = analyze(surface(law), parse_device(device, "mine"))
    assert result.passivity.verdict == verdict
    assert words in result.answer
    assert f"law {law} at 730 N/m, pressed to 370 µm" in result.answer.lower().replace(
        f"law {law.lower()}", f"law {law}"
    ).replace("n/m", "N/m")
    assert ("its force jumps" in result.answer) == (law == "D")


def test_missing_data_are_listed() -> None:
    result = analyze(surface("A"), parse_device(PARTIAL, "mine"))
    assert result.v_star is None
    assert result.to_dict()["v_star"] is None
    assert result.passivity.criterion("paper (1)").missing == ("update_rate", "damping")
    nothing = analyze(surface("C"), parse_device({"max_force": "5 N"}, "mine"))
    missing = {name for c in nothing.passivity.criteria for name in c.missing}
    assert missing >= {"update_rate", "damping", "delay_samples", "max_stiffness"}
    assert nothing.passivity.verdict == "undecided"


def test_zero_damping_gives_an_infinite_v_star() -> None:
    rig = parse_device(RIG, "mine")
    without = replace(rig, data={**rig.data, "damping": Datum(0.0, "N*s/m", "by hand", True)})
    result = analyze(surface("A"), without)
    assert result.v_star == math.inf
    assert result.to_dict()["v_star"] == "inf"


def test_law_d_has_jumps_and_its_infinite_number_is_a_string_in_json(rig: Device) -> None:
    result = analyze(surface("D"), rig)
    assert result.q.lower == math.inf
    onset = np.array(result.q.at)
    closest_point = TEXTURE.nearest([onset])[0]
    assert np.linalg.norm(onset - closest_point) == pytest.approx(1.0 / HESSIAN, rel=1e-6)
    assert len(result.continuity.jumps) > 3
    for jump in result.continuity.jumps:
        forces = result.surface.force([jump.before, jump.after])
        assert np.linalg.norm(forces[1] - forces[0]) == pytest.approx(jump.size, rel=1e-12)
    data = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert (data["schema"], data["q"]["value"], data["merit"]["gain"]) == (4, "inf", "inf")
    assert data["continuity"]["jumps"][0]["size"] == result.continuity.jumps[0].size
    assert data["law_parameters"] == {}


def test_worst_loop_lies_in_the_plane_of_the_direction_argument(rig: Device) -> None:
    across = analyze(surface("A"), rig, direction=(0.0, 2.0))
    assert across.leak.line.direction.tolist() == [0.0, 1.0]
    # Along the grooves the height is constant: no loop there gains energy, though others do.
    assert across.leak.energy < 1e-9 * K * DEPTH * AMPLITUDE
    assert across.passivity.verdict != "passive"
    assert any("along (0, 1)" in sentence for sentence in across.assumptions)


def _map() -> HeightMap:
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(24), np.arange(20))
    heights = 4e-5 * np.sin(0.8 * x + 0.3 * y) + 4e-6 * rng.normal(size=(20, 24))
    return HeightMap(heights, 5e-5)


def test_tolerance_and_work_limit_are_passed_to_the_search(rig: Device) -> None:
    patch = Surface(_map(), "C", max_depth=1e-4)
    fine, coarse = analyze(patch, rig, tolerance=1e-5), analyze(patch, rig, tolerance=0.2)
    assert fine.q.gap <= 1e-5 < coarse.q.gap <= 0.2
    assert coarse.q.lower <= fine.q.upper
    assert fine.q.lower <= coarse.q.upper
    truncated = analyze(patch, rig, work_limit=1)
    assert "work limit" in truncated.q.note
    assert truncated.q.lower <= fine.q.upper
    assert fine.q.lower <= truncated.q.upper
    assert "work limit" not in fine.q.note


def test_extent_tightens_the_bounds_of_a_sum_of_many_waves(rig: Device) -> None:
    vectors = [[9e3, 0], [0, 9e3 / 2**0.5], [9e3 / 3**0.5, 4e3], [-9e3 / 5**0.5, 9e3 / 7**0.5]]
    waves = Fourier([1e-5] * 5, [*vectors, [3e3, -9e3 / 11**0.5]])
    patch = Surface(waves, "A")
    everywhere = analyze(patch, rig)
    assert everywhere.q.gap > 2e-3
    assert "need an extent" in everywhere.q.note
    bounded = analyze(patch, rig, extent=(1e-3, 1e-3), tolerance=1e-3)
    assert bounded.q.method == "certified"
    assert bounded.q.gap <= 1e-3
    assert bounded.q.lower <= everywhere.q.upper
    assert "1 mm x 1 mm from the origin" in " ".join(bounded.assumptions)


def test_sampled_number_is_reported_as_unproved(rig: Device) -> None:
    """A user-defined law is sampled below the medial axis and certified at half that depth."""
    user_law = replace(find_law("D"), letter="Z", name="mine")
    sampled = analyze(Surface(TEXTURE, user_law, K, DEPTH), rig, tolerance=0.2)
    assert sampled.q.upper == math.inf
    assert math.isfinite(sampled.q.lower)
    assert any("not a proof" in sentence for sentence in sampled.assumptions)
    proved = analyze(Surface(TEXTURE, user_law, K, 0.5 / HESSIAN), rig, tolerance=0.2)
    assert not any("not a proof" in sentence for sentence in proved.assumptions)


def test_progress_reports_every_step_in_order(rig: Device) -> None:
    seen: list[str] = []
    analyze(surface("W"), rig, progress=seen.append)
    assert tuple(seen) == STEPS


def test_assumptions_state_only_the_defaults_in_use(rig: Device) -> None:
    explicit = analyze(surface("F", friction=0.3), rig).assumptions
    assert not any("stiffness" in s or "max depth" in s for s in explicit if "Default" in s)
    assert "Default friction 0.8" not in explicit
    assert "Default modulation depth 0.8" in explicit
    defaults = analyze(Surface(TEXTURE, "F"), rig).assumptions
    assert "Default stiffness 1000 N/m" in defaults
    assert "Default friction 0.8" in defaults
    assert any(sentence.startswith("Default max depth 600 µm") for sentence in defaults)


def test_assumptions_state_unverified_data_and_device_notes() -> None:
    assumptions = " ".join(analyze(surface("W"), "pantograph").assumptions)
    assert "Not verified for the Pantograph Mk-II (the paper's): damping 1.16 N·s/m" in assumptions
    assert "brakes act inside the virtual body" in assumptions


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"surface": 3.0}, "^surface must be a texture"),
        ({"surface": "scene.toml"}, "^surface is a scene"),
        ({"device": "omga.3"}, "device"),
        ({"direction": (0.0, 0.0)}, "direction"),
        ({"direction": (1.0, 0.0, 0.0)}, "direction"),
        ({"direction": (math.nan, 1.0)}, "direction"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"work_limit": 0}, "work_limit"),
        ({"extent": (1e-3, -1e-3)}, "extent"),
    ],
)
def test_error_messages_name_the_invalid_argument(arguments: dict[str, object], name: str) -> None:
    values = {"surface": surface("A"), "device": "omega.3", **arguments}
    with pytest.raises(ParameterError, match=name):
        analyze(**values)  # deliberately invalid


def test_invalid_device_file_raises_naming_the_field(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('damping = "2 N/m"\n')
    with pytest.raises(ParameterError, match="damping"):
        analyze(surface("A"), path)


def test_notebook_table_escapes_html(rig: Device) -> None:
    hostile = "<script>alert(1)</script>"
    device = parse_device({**RIG, "name": hostile}, "mine")
    text = analyze(surface("A"), device)._repr_html_()
    assert hostile not in text
    assert "&lt;script&gt;" in text
    assert text.count("<tr") == 2 + 4 + len(analyze(surface("A"), rig).passivity.criteria)


def test_max_depth_above_the_width_of_a_finite_surface_raises() -> None:
    heights = 1e-5 * np.random.default_rng(2).normal(size=(8, 9))
    shallow = asp.Surface(asp.HeightMap(heights, 1e-5), "A", max_depth=6e-5)
    assert analyze(shallow).q.method == "certified"
    deep = asp.Surface(asp.HeightMap(heights, 1e-5), "A", max_depth=8e-5)
    with pytest.raises(asp.ParameterError, match="max_depth must not exceed the width"):
        analyze(deep)
    endless = asp.Surface(asp.HeightMap(heights, 1e-5, periodic=True), "A", max_depth=8e-5)
    assert analyze(endless).q.method == "certified"


def test_default_depth_above_the_width_is_stated_as_an_assumption() -> None:
    flat = asp.Surface(asp.HeightMap(np.full((8, 8), 1e-3), 1e-5), "A")
    assert flat.max_depth == 1e-3  # 1 mm below a surface of 70 um
    sentence = "Below 70 µm, the surface's width, only its mirror images are in contact"
    assert sentence in analyze(flat).assumptions
    wide = asp.Surface(asp.HeightMap(np.full((8, 8), 1e-3), 1e-3), "A")
    assert sentence not in analyze(wide).assumptions
    assert not any("mirror" in words for words in analyze(wide).assumptions)
