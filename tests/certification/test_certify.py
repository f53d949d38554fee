"""Renderers as black boxes: our own laws against their certified numbers, and planted faults."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from bench.stress.callers import build_library, compile_source, map_surface
from bench.stress.certification import found_sets, jump_sets
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from asperity import Fourier, ParameterError, Sinusoid, Surface, characteristic_number, worst_loop
from asperity.certification import isolated, jump_search
from asperity.certification.certify import Certification, certify
from asperity.certification.jump_search import JumpSearch
from asperity.certification.region import Region, RendererCalls
from asperity.certification.renderers import FunctionRenderer, LibraryRenderer, RendererSource
from asperity.certification.resolution import Resolution
from asperity.contacts.warm_start import WARM_START_SIZE
from asperity.core.checks import FloatArray
from asperity.report.sentences.certification_sentences import certification_answer, point_text

BOX = ((-1e-3, 1e-3), (-1e-3, 1e-3), (-1e-3, 1e-4))
TEXTURE = Sinusoid(amplitude=0.4e-3, period=2e-3)
DEPTH = 0.8e-3


def law_region(surface: Surface) -> Callable[[FloatArray], FloatArray]:
    """Return whether points are in the working region of a law of vertical or nominal contact."""

    def contains(points: FloatArray) -> FloatArray:
        height = TEXTURE.height(points[:, :2]) * (surface.law.contact.name != "nominal")
        depth = height - points[:, 2]
        return np.asarray((depth > 0.0) & (depth < DEPTH))

    return contains


def certify_law(letter: str) -> tuple[Surface, Certification]:
    surface = Surface(TEXTURE, letter, stiffness=1000.0, max_depth=DEPTH)
    box = ((-1e-3, 1e-3), (-1e-3, 1e-3), (-1.3e-3, 0.5e-3))
    surface.force(np.zeros((1, 3)))  # compiles, which takes none of the four seconds
    result = certify(surface.force, region=box, inside=law_region(surface), seconds=4.0)
    return surface, result


@pytest.mark.parametrize("letter", ["A", "B", "C", "G"])
def test_gain_and_leak_of_laws_are_found(letter: str) -> None:
    surface, result = certify_law(letter)
    gain = 1000.0 * characteristic_number(surface).upper
    assert 0.95 * gain <= result.gain <= gain * (1.0 + 1e-6)
    if letter == "C":
        assert result.worst_loop is None
    else:
        leak = worst_loop(surface, direction=(1.0, 0.0))
        assert result.worst_loop is not None
        assert 0.85 * leak.energy <= result.worst_loop.energy <= 1.001 * leak.energy
    assert result.jumps == ()
    assert result.history_spread == 0.0


def test_jumps_of_the_god_object_are_found_and_no_loop() -> None:
    _surface, result = certify_law("D")
    assert result.worst_loop is None
    assert result.jumps
    for jump in result.jumps:
        # At the edge of the medial axis a jump is small beside the slope that it ends.
        is_small = jump.size < 0.05 * result.jumps[0].size
        assert jump.exponent < (0.1 if is_small else 0.01)
        # The medial axis is below the crests at l/4.
        assert abs(jump.at[0] % 2e-3 - 0.5e-3) < 1e-8


def test_every_set_of_jumps_of_the_god_object_has_a_witness(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(RendererCalls, "rate", 1e5)  # [1/s], whatever else the machine does
    texture = Fourier([1e-4, 6e-5], np.array([[9e3, 2e3], [-3e3, 8e3]]), [0.3, 1.1])
    surface = Surface(texture, "D", stiffness=1000.0, max_depth=4e-4)
    box = np.array([[-1e-3, 1e-3], [-1e-3, 1e-3], [-5e-4, 1.6e-4]])

    def inside(points: FloatArray) -> NDArray[np.bool_]:
        depth = texture.height(points[:, :2]) - points[:, 2]
        return np.asarray((depth > 0.0) & (depth < 4e-4))

    labels, count = jump_sets(surface, box, inside, 24)
    assert count > 8
    calls = RendererCalls(FunctionRenderer(surface.force), Region(box[:, 0], box[:, 1], inside))
    resolution = Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7)
    search = JumpSearch(calls, resolution, seed=0)
    clock = SimpleNamespace(monotonic=lambda: calls.calls / calls.rate)
    monkeypatch.setattr(jump_search, "time", clock)
    search.run(1.0, None)
    places = np.array([jump.at for jump in search.jumps])
    assert inside(places).all()
    assert len(found_sets(labels, box, places)) == count


@pytest.mark.parametrize("letter", ["A", "D"])
def test_renderer_is_tried_in_the_region_alone(letter: str) -> None:
    surface = Surface(Sinusoid(1e-4, 2e-3), letter, stiffness=1000.0, max_depth=4e-4)
    low = np.array([-0.3e-3, -1e-3, -3e-4])
    high = np.array([1.7e-3, 1e-3, 5e-5])
    beyond = [0.0]

    def force(points: FloatArray) -> FloatArray:
        beyond.append(float(np.max([low - points, points - high])))
        return surface.force(points)

    result = certify(force, region=np.column_stack([low, high]), seconds=1.0)
    assert max(beyond) <= 1e-15
    assert result.largest_at is not None
    assert (low - 1e-15 <= result.largest_at).all()


def test_slopes_that_are_no_jumps_are_kept_for_the_gain() -> None:
    def force(points: FloatArray) -> FloatArray:
        # A ramp of a newton over a micrometre.
        return np.clip(1e6 * points[:, :1], -0.5, 0.5) * [0.0, 0.0, 1.0]

    calls = RendererCalls(FunctionRenderer(force), Region(*np.array([[-1e-3] * 3, [1e-3] * 3])))
    search = JumpSearch(calls, Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7), seed=0)
    search.run(0.0, None)
    assert search.jumps == ()
    steps = np.diff(search.steepest, axis=1)[:, 0]
    ends = force(search.steepest.reshape(-1, 3)).reshape(-1, 2, 3)
    changes = np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1)
    assert np.max(changes / np.linalg.norm(steps, axis=1)) > 0.9e6


def planted(library: str, name: str) -> Certification:
    return certify(library, name=name, region=BOX, seconds=3.0)


def test_spring_of_a_library_has_its_gain_and_no_fault(library: str) -> None:
    result = planted(library, "spring")
    assert result.gain == pytest.approx(1000.0, rel=1e-6)
    assert result.one_sided_gain == pytest.approx(1000.0, rel=1e-6)
    assert result.worst_loop is None
    assert result.jumps == ()
    assert not result.history.has_memory
    assert result.invalid_at is None
    assert result.contact.highest == 0.0
    assert 0.0 < result.cost.median < 1e-3


def test_step_of_a_millinewton_is_a_jump(library: str) -> None:
    jumps = planted(library, "step").jumps
    assert jumps
    for jump in jumps:
        assert jump.size == pytest.approx(1e-3, rel=1e-3)
        # The step ends at the surface, where the force jumps as well.
        assert min(abs(jump.at[0] - 1.2345e-4), abs(jump.at[2])) < 1e-8
    assert min(abs(jump.at[0] - 1.2345e-4) for jump in jumps) < 1e-8


def test_steep_ramp_is_a_slope_and_not_a_jump(library: str) -> None:
    result = planted(library, "ramp")
    assert result.jumps == ()
    assert result.gain == pytest.approx(1e6, rel=1e-3)


def test_curl_of_one_percent_is_a_loop(library: str) -> None:
    result = planted(library, "curl")
    assert result.worst_loop is not None
    # Both half waves of a period gain 10 N/m / pi per metre of height.
    assert result.worst_loop.energy > 0.5 * 2 * 10.0 * 1e-3 / np.pi * 1e-3
    assert not result.history.has_memory


def test_memory_of_a_tick_is_dependence_on_history(library: str) -> None:
    result = planted(library, "tick")
    assert result.history.spread > 0.0
    assert result.history.is_reset
    assert result.jumps == ()


def test_force_that_is_not_finite_is_found_with_its_place(library: str) -> None:
    result = planted(library, "nan")
    at = result.invalid_at
    assert at is not None
    assert certification_answer(result).startswith(f"The force is not finite at {point_text(at)}. ")
    assert abs(at[0] - 2e-4) < 5e-5
    assert abs(at[2] + 3e-4) < 5e-5
    with pytest.raises(ParameterError, match="gives no force that is finite at"):
        certify(lambda points: np.full((len(points), 3), np.nan), region=BOX, seconds=0.2)


def test_crash_is_reported_with_its_position(library: str) -> None:
    with pytest.raises(
        ParameterError, match=r"crashed with exit code -6 at the position .* -0\.\d"
    ):
        planted(library, "crash")


def test_renderer_that_never_returns_is_reported(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(isolated, "_CALL_TIMEOUT", 0.5)
    with pytest.raises(ParameterError, match=r"did not return in 0\.5 s at the position"):
        planted(library, "hang")


def test_library_that_opens_a_renderer_in_millimetres(library: str) -> None:
    result = certify(library, name="own", text="surface", unit="mm", region=BOX, seconds=1.0)
    assert result.gain == pytest.approx(2000.0, rel=1e-6)
    with pytest.raises(ParameterError, match="returned no renderer"):
        certify(library, name="own", text="nothing", region=BOX, seconds=1.0)


@pytest.mark.parametrize(
    ("precision", "version", "message"),
    [
        ("float", "1", "is in single precision"),
        ("double", "2", "has ABI 2, this version calls ABI 1"),
    ],
)
def test_exported_library_that_does_not_fit_is_refused(
    precision: str, version: str, message: str, tmp_path: Path
) -> None:
    built = build_library(map_surface(), tmp_path, precision=precision)
    header = tmp_path / "texture.h"
    header.write_text(header.read_text().replace("_ABI 1\n", f"_ABI {version}\n"))
    compile_source(tmp_path)
    with pytest.raises(ParameterError, match=message):
        certify(str(built), name="texture", region=BOX, seconds=1.0)


def test_exported_library_is_given_a_state_of_its_size(tmp_path: Path) -> None:
    library = str(build_library(map_surface(), tmp_path))
    renderer = LibraryRenderer(RendererSource("library", library, "texture"))
    size = renderer._call("state_size", ctypes.c_size_t)
    assert size > 8 * (3 + WARM_START_SIZE)
    assert len(renderer._memory) == size + 64
    expected = map_surface().force([[0.0, 0.0, -1e-4]])
    np.testing.assert_allclose([renderer.force(np.array([0.0, 0.0, -1e-4]))], expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("renderer", "arguments", "message"),
    [
        ("library", {"name": "none"}, "has no function none_reset"),
        ("missing.so", {}, "is no file"),
        ("library", {"name": "spring", "region": ((1.0, 0.0),) * 3}, "increasing"),
        ("library", {"name": "spring", "unit": "km"}, "unit"),
        ("library", {"name": "spring", "seconds": 0.0}, "seconds must be positive"),
        ("library", {"name": "spring", "region": ((0.0, 1e-3),) * 3}, "has no force anywhere"),
    ],
)
def test_bad_arguments_are_refused(
    library: str, renderer: str, arguments: dict[str, object], message: str
) -> None:
    source = library if renderer == "library" else renderer
    with pytest.raises(ParameterError, match=message):
        certify(source, **{"seconds": 0.2, "region": BOX, **arguments})


@pytest.mark.parametrize("is_vectorized", [True, False])
def test_error_of_a_function_is_reported_with_its_position(
    tmp_path: Path, is_vectorized: bool
) -> None:
    path = tmp_path / "mine.py"
    check = "" if is_vectorized else "    assert points.shape == (3,)\n"
    path.write_text(
        f"import numpy as np\ndef force(points):\n{check}"
        "    if (points.T[0] > 0.9e-3).any():\n"
        "        raise ValueError('out of range')\n"
        "    return np.maximum(-points, 0.0) * [0.0, 0.0, 500.0]\n"
    )
    message = r"ValueError: out of range at the position \((1|0\.9\d+) mm"
    with pytest.raises(ParameterError, match=message):
        certify(f"{path}:force", region=((-1e-3, 1e-3),) * 3, seconds=1.0)


def test_function_of_another_size_is_refused() -> None:
    with pytest.raises(ParameterError, match="returned 2 numbers for 1 points"):
        certify(lambda _point: [1.0, 2.0], region=BOX, seconds=0.2)


class Friction:
    """Friction with an anchor that is set where contact begins."""

    def reset(self) -> None:
        self.anchor: FloatArray | None = None

    def __call__(self, point: FloatArray) -> list[float]:
        if point[2] >= 0.0:
            self.anchor = None
            return [0.0, 0.0, 0.0]
        if self.anchor is None:
            self.anchor = point[:2].copy()
        pull = -300.0 * (point[:2] - self.anchor)
        return [pull[0], pull[1], -1000.0 * point[2]]


def test_function_with_a_reset_may_have_memory() -> None:
    result = certify(Friction(), region=BOX, seconds=2.0)
    assert result.history.spread > 0.02
    assert result.history.is_reset


# --- conservative controls: nothing may be reported ---


def random_heights(seed: int) -> RectBivariateSpline:
    random = np.random.default_rng(seed)
    side = np.linspace(-2e-3, 2e-3, 24)
    return RectBivariateSpline(side, side, random.normal(size=(24, 24)) * 2e-5)


def gain_bound(spline: RectBivariateSpline) -> float:
    """Return a bound of the gain of the force of a height: k (1 + |grad h|^2 + depth |hess h|)."""
    side = np.linspace(-1e-3, 1e-3, 400)
    height = spline(side, side)
    slope = np.hypot(spline(side, side, dx=1), spline(side, side, dy=1))
    parts = [(2, 0), (0, 2), (1, 1), (1, 1)]
    curvature = np.sqrt(sum(spline(side, side, dx=i, dy=j) ** 2 for i, j in parts))
    return float(1.02e3 * (1.0 + slope**2 + (height + 1e-3) * curvature).max())


def potential_force(spline: RectBivariateSpline) -> Callable[[FloatArray], FloatArray]:
    """Return the force of the potential k (h - z)^2 / 2 on a wall."""

    def force(points: FloatArray) -> FloatArray:
        x, y, z = points.T
        depth = np.maximum(spline.ev(x, y) - z, 0.0)
        slopes = [spline.ev(x, y, dx=1), spline.ev(x, y, dy=1), -np.ones_like(x)]
        return -1000.0 * np.stack(slopes, axis=1) * depth[:, None]

    return force


def single_precision(force: Callable[[FloatArray], FloatArray]) -> Callable[..., FloatArray]:
    return lambda points: force(points.astype(np.float32).astype(float)).astype(np.float32)


def encoder(
    force: Callable[[FloatArray], FloatArray], step: float
) -> Callable[[FloatArray], FloatArray]:
    return lambda points: force(step * np.round(points / step))


def force_steps(
    force: Callable[[FloatArray], FloatArray], step: float
) -> Callable[[FloatArray], FloatArray]:
    return lambda points: step * np.round(force(points) / step)


def noise(
    force: Callable[[FloatArray], FloatArray], size: float
) -> Callable[[FloatArray], FloatArray]:
    random = np.random.default_rng(5)
    return lambda points: force(points) + size * random.normal(size=points.shape)


def rare_noise(
    force: Callable[[FloatArray], FloatArray], size: float
) -> Callable[[FloatArray], FloatArray]:
    random = np.random.default_rng(6)

    def noisy(points: FloatArray) -> FloatArray:
        is_noisy = random.uniform(size=(len(points), 1)) < 1e-3
        return force(points) + size * is_noisy * random.normal(size=points.shape)

    return noisy


CONTROLS = {
    "rare noise": lambda force: rare_noise(force, 1e-3),
    "noise and encoder": lambda force: noise(encoder(force, 2e-5), 1e-3),
    "exact": lambda force: force,
    "single precision": single_precision,
    "encoder of 1 um": lambda force: encoder(force, 1e-6),
    "encoder of 20 um": lambda force: encoder(force, 2e-5),
    "encoder of 55 um": lambda force: encoder(force, 5.5e-5),
    "force steps": lambda force: force_steps(force, 1e-3),
    "encoder and force steps": lambda force: force_steps(encoder(force, 1e-5), 5e-3),
}


@pytest.mark.parametrize("name", CONTROLS)
def test_conservative_control_has_no_fault(name: str) -> None:
    heights = random_heights(7)
    result = certify(CONTROLS[name](potential_force(heights)), region=BOX, seconds=1.5)
    assert result.jumps == ()
    assert result.worst_loop is None
    assert not result.history.has_memory
    # Steps make the gain that is certain smaller, never larger.
    bound = gain_bound(heights)
    assert 0.1 * bound <= result.gain <= bound
