"""A user-defined texture kind with its own sampler works everywhere, without further code.

The kind is that of the documented example, as a file outside the package.
"""

from __future__ import annotations

import ast
import itertools
import json
import math
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
from tests.helpers.reference import exact_force, exact_jacobian
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.analysis import one_sided_number
from asperity.analysis.bounds.branch_and_bound import supremum
from asperity.analysis.gain.proofs import CrestProblem
from asperity.analysis.gain.surface_cache import surface_content
from asperity.core.errors import InternalError, ParameterError
from asperity.enclosures.cells import DERIVATIVE_NAMES
from asperity.report import html_text
from asperity.textures import Domain, Texture, catalogue
from asperity.textures.texture import TextureKind

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_texture.py"
A, PERIOD = 0.1e-3, 2e-3
WAVE = 2.0 * math.pi / PERIOD
DEPTH = 0.2e-3
Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]


@pytest.fixture(scope="module")
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Return the user-defined module, imported from a directory outside the package."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copy(EXAMPLE, folder / "my_eggs.py")
    with imported(folder, "my_eggs") as module:
        yield module


@pytest.fixture
def texture(plugin: ModuleType) -> Any:
    return plugin.EggBox(amplitude=A, period=PERIOD)


@pytest.fixture
def plain(plugin: ModuleType) -> Any:
    """Return a texture of the same kind without its optional members."""

    class Plain(plugin.EggBox):
        third_derivative_bound = Texture.third_derivative_bound

    return Plain(A, PERIOD)


@pytest.fixture
def finite(plain: Any) -> Any:
    """Return a part of the texture that is not periodic: suprema lie on its border."""
    part = Domain(np.zeros(2), 0.2 * PERIOD * np.eye(2), periodic=False, description="a part")
    return type("Finite", (type(plain),), {"domain": part})(A, PERIOD)


@pytest.fixture
def registered(plugin: ModuleType, monkeypatch: pytest.MonkeyPatch) -> TextureKind:
    # Change the catalogue in place: other modules hold a reference to it.
    monkeypatch.setitem(catalogue.CATALOGUE, "egg-box", plugin.EGG_BOX)
    monkeypatch.delitem(catalogue.CATALOGUE, "egg-box")
    return catalogue.register(plugin.EGG_BOX)


def class_names(base: type) -> set[str]:
    return {base.__name__}.union(*(class_names(kind) for kind in base.__subclasses__()))


def type_checks(path: Path, classes: set[str]) -> list[str]:
    """Return the calls of isinstance or issubclass on one of these classes in a module."""
    checks = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"isinstance", "issubclass"}:
            names = {n.id for n in ast.walk(node.args[1]) if isinstance(n, ast.Name)}
            if names & classes:
                checks.append(f"{path.name}: {ast.unparse(node)}")
    return checks


def test_no_code_outside_textures_checks_the_class_of_a_texture() -> None:
    package, textures = Path(asp.__file__).parent, class_names(Texture)
    assert {"Sinusoid", "HeightMap", "Grating"} <= textures
    folder = package / "textures"
    others = [path for path in package.rglob("*.py") if not path.is_relative_to(folder)]
    assert [check for path in others for check in type_checks(path, textures)] == []
    assert type_checks(folder / "catalogue.py", textures) == [
        "catalogue.py: isinstance(texture, Texture)"
    ]


# --- values, by independent formulas ----------------------------------------------------------


def grid(count: int) -> np.ndarray:
    ticks = (np.arange(count) + 0.3) / count * PERIOD
    return np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)


def formulas(xy: np.ndarray) -> np.ndarray:
    """Return h, h_x, h_y, h_xx, h_xy, h_yy by the sum of two waves along the diagonals."""
    total = np.zeros((len(xy), 6))
    for sign in (1.0, -1.0):
        k = WAVE * np.array([1.0, sign])
        s, c = 0.5 * A * np.sin(xy @ k), 0.5 * A * np.cos(xy @ k)
        total += np.stack(
            [c, *(-k[i] * s for i in (0, 1)), *(-k[i] * k[j] * c for i, j in PAIRS)]
        ).T
    return total


PAIRS = ((0, 0), (0, 1), (1, 1))


def dense_numbers(law: str, count: int = 401) -> tuple[float, float]:
    """Return the greatest ‖J‖/k and λ_max(-sym J)/k of law A or C on a dense grid."""
    _h, hx, hy, hxx, hxy, hyy = formulas(grid(count)).T
    down = np.stack([hx, hy, np.full_like(hx, -1.0)], axis=-1)
    norms, sides = [], []
    for depth in (0.0, DEPTH):
        if law == "C":  # the gradient of the energy k δ²/2
            second = np.zeros((len(hx), 3, 3))
            second[:, 0, 0], second[:, 0, 1], second[:, 1, 1] = hxx, hxy, hyy
            second[:, 1, 0] = hxy
            jacobian = -(down[:, :, None] * down[:, None, :] + depth * second)
        else:  # A pushes along e_z with k δ
            jacobian = np.zeros((len(hx), 3, 3))
            jacobian[:, 2] = down
        norms.append(np.linalg.norm(jacobian, 2, axis=(1, 2)).max())
        symmetric = -0.5 * (jacobian + jacobian.transpose(0, 2, 1))
        sides.append(np.linalg.eigvalsh(symmetric).max())
    return float(max(norms)), float(max(sides))


def test_sampler_equals_the_formulas(texture: Any) -> None:
    xy = grid(7)
    scale = np.array([A, *[A * WAVE] * 2, *[A * WAVE**2] * 3])
    assert (np.abs(texture.derivatives(xy) - formulas(xy)) < 1e-13 * scale).all()
    points = np.column_stack([xy, np.full(len(xy), -0.3e-3)])
    closest = texture.nearest(points)
    nodes = grid(201)
    around = nodes[None] + PERIOD * np.array([[[i, j]] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    surface = np.column_stack([around.reshape(-1, 2), np.tile(formulas(nodes)[:, 0], 9)])
    for point, closest_point in zip(points, closest, strict=True):
        distance = np.linalg.norm(surface - point, axis=1).min()
        assert np.linalg.norm(closest_point - point) <= distance * (1.0 + 1e-12)


@pytest.mark.parametrize("law", ["A", "C"])
@pytest.mark.parametrize("kind", ["texture", "plain"])
def test_bounds_contain_densely_sampled_numbers(
    law: str, kind: str, request: pytest.FixtureRequest
) -> None:
    """The upper bound is above the values on a grid, and the attained value close to them."""
    surface = asp.Surface(request.getfixturevalue(kind), law, max_depth=DEPTH)
    bounds = (asp.characteristic_number(surface), one_sided_number(surface))
    for bound, dense in zip(bounds, dense_numbers(law), strict=True):
        assert bound.method == "certified"
        assert dense * (1.0 - 1e-9) <= bound.upper
        assert bound.lower >= dense * (1.0 - 1e-4)
        # Without enclosures of second derivatives each entry may be as large as their bound.
        slack = 2.0 * DEPTH * (A * WAVE**2) if law == "C" and kind == "plain" else 0.0
        assert bound.upper <= (dense + slack) * (1.01 if slack else 1.0011)


def test_bounds_hold_for_all_shipped_laws(plain: Any, finite: Any) -> None:
    rng = np.random.default_rng(3)
    for texture, law in itertools.product((plain, finite), "WABCDEFG"):
        surface = asp.Surface(texture, law, max_depth=DEPTH)
        bound = asp.characteristic_number(surface)
        assert bound.lower <= bound.upper
        xy = texture.domain.points(rng.random((2000, 2)))
        jacobians = surface.jacobian(np.column_stack([xy, A - DEPTH * rng.random(2000)]))
        norms = np.linalg.norm(jacobians / surface.stiffness, 2, axis=(1, 2))
        assert norms.max() <= bound.upper * (1.0 + 1e-12)


@pytest.mark.parametrize("law", ["A", "C", "D"])
def test_force_and_jacobian_equal_the_multi_precision_reference(texture: Any, law: str) -> None:
    surface = asp.Surface(texture, law, max_depth=DEPTH)
    point = [0.31e-3, -0.17e-3, -0.05e-3]
    force = np.array(exact_force(surface, point).tolist(), dtype=float)[:, 0]
    np.testing.assert_allclose(surface.force([point])[0], force, atol=1e-12 * 1000.0 * DEPTH)
    jacobian = np.array(exact_jacobian(surface, point).tolist(), dtype=float)
    np.testing.assert_allclose(surface.jacobian([point])[0], jacobian, atol=1e-11 * 1000.0)


def test_line_segments_enclose_the_derivatives(texture: Any) -> None:
    line = texture.scan_line()
    segments = texture.line_segments(line, 64)
    models = segments.models(DERIVATIVE_NAMES)
    for xi in (-1.0, 0.3, 1.0):
        positions = (np.arange(64) + 0.5 + 0.5 * xi) * segments.length
        exact = formulas(line.start + positions[:, None] * line.direction)
        for i, name in enumerate(DERIVATIVE_NAMES):
            model = models[name]
            assert (np.abs(exact[:, i] - model.c - xi * model.g[0]) <= model.e).all()
    assert models["h"].e.max() < 2e-3 * A  # and are tight


# --- wrong bounds are detected -----------------------------------------------------------------


@pytest.mark.parametrize("law", ["A", "C", "G"])
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("extremes", (-0.9 * A, 0.9 * A)),
        ("bounds", (0.9 * A * WAVE, A * WAVE**2)),
        ("bounds", (A * WAVE, 0.9 * A * WAVE**2)),
    ],
)
def test_too_small_bounds_are_detected(
    plugin: ModuleType, law: str, name: str, value: tuple[float, float]
) -> None:
    wrong = type("Wrong", (plugin.EggBox,), {name: value})(A, PERIOD)
    with pytest.raises(InternalError):
        asp.characteristic_number(asp.Surface(wrong, law, max_depth=DEPTH))


def test_too_small_third_derivative_bound_is_detected(plugin: ModuleType) -> None:
    wrong = type("Wrong", (plugin.EggBox,), {"third_derivative_bound": A * WAVE**3})(A, PERIOD)
    with pytest.raises(InternalError):
        asp.characteristic_number(asp.Surface(wrong, "C", max_depth=DEPTH))


def test_attained_hessian_bound_ends_the_search_for_the_sharpest_crest(texture: Any) -> None:
    """The crests attain the curvature that the kind states, so smaller cells are not needed."""
    cells = texture.cells()
    result = supremum(CrestProblem(cells), 1e-4)
    assert result.converged
    assert result.lower == pytest.approx(A * WAVE**2, rel=1e-9)
    assert result.lower <= result.upper <= A * WAVE**2 * (1.0 + 1e-8)
    unbounded_cells = texture.cells()
    unbounded_cells.hessian_bound = math.inf
    unbounded_result = supremum(CrestProblem(unbounded_cells), 1e-2)
    assert result.cell_count < 4096 < 50 * 4096 < unbounded_result.cell_count
    assert unbounded_result.lower == pytest.approx(result.lower, rel=1e-9)
    assert unbounded_result.upper > result.upper


def test_certificates_of_a_user_defined_kind_are_not_cached(texture: Any) -> None:
    """The file of the kind may change, and so may the data that it reads."""
    surface = asp.Surface(texture, "A", max_depth=DEPTH)
    assert surface_content(surface) is None
    assert surface_content(surface.to_texture(asp.Sinusoid(A, PERIOD))) is not None


# --- analyses and reports -------------------------------------------------------------------------


def test_comparison_analysis_and_limits_in_python(texture: Any) -> None:
    result = asp.compare(texture, device="omega.3", laws="CD", max_depth=DEPTH)
    assert [row.law.letter for row in result.rows] == list("CD")
    data = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert data["texture"]["kind"] == "egg-box"
    assert "egg-box" in html_text(result)
    surface = asp.Surface(texture, "C", max_depth=DEPTH)
    analysis = asp.analyze(surface, device="omega.3")
    json.dumps(analysis.to_dict(), allow_nan=False)
    assert "<svg" in html_text(analysis)
    json.dumps(asp.limits(texture, device="omega.3", law="C").to_dict(), allow_nan=False)


def test_energy_of_the_worst_loop_equals_its_work_integral(plain: Any) -> None:
    surface = asp.Surface(plain, "A", max_depth=DEPTH)
    worst = asp.worst_loop(surface)
    assert asp.loop_work(surface, worst.vertices) == pytest.approx(worst.energy, rel=1e-3)
    assert worst.energy <= worst.upper_per_period


def test_spectrum_is_sampled_and_has_the_diagonal_wave(texture: Any) -> None:
    """Two diagonal waves have all the variance, a²/2 with a = A/√2, at the wavelength l/√2."""
    from asperity.analysis.limits.spectrum import compute_spectrum

    spectrum = compute_spectrum(texture)
    assert not spectrum.exact
    strongest = max(spectrum.waves, key=lambda wave: wave.share)
    assert strongest.share > 0.99
    assert strongest.wavelength == pytest.approx(PERIOD / math.sqrt(2.0), rel=1e-3)
    assert strongest.amplitude == pytest.approx(A / math.sqrt(2.0), rel=1e-2)


# --- names --------------------------------------------------------------------------------------


def test_registering_an_existing_name_is_refused(registered: TextureKind) -> None:
    with pytest.raises(ParameterError, match="'egg-box' is taken: bumps and dimples"):
        catalogue.register(registered)


@pytest.mark.parametrize("name", ["sinusoid", "cloth", "file", "Egg", "egg box", "", "e"])
def test_invalid_names_are_refused(name: str, plugin: ModuleType) -> None:
    before = dict(catalogue.CATALOGUE)
    with pytest.raises(ParameterError, match="kind"):
        catalogue.register(TextureKind(name, "a kind", plugin.EggBox, ()))
    assert before == catalogue.CATALOGUE


SPECIFICATION = "egg-box:amplitude=0.1mm,period=2mm"
MODULE = ("--plugin", str(EXAMPLE))


def test_every_command_accepts_the_kind(read_json: Answer, call: Call) -> None:
    arguments = ("compare", SPECIFICATION, "--laws", "C")
    assert read_json(*arguments, *MODULE)["texture"]["kind"] == "egg-box"
    surfaces = read_json("surfaces", "egg-box", *MODULE)["surfaces"]
    assert [surface["specification"] for surface in surfaces] == [
        "egg-box:amplitude=100um,period=2mm"
    ]
    assert (
        read_json("analyze", SPECIFICATION, "--law", "C", *MODULE)["texture"]["kind"] == "egg-box"
    )
    assert read_json("limits", SPECIFICATION, "--law", "C", *MODULE)["texture"]["kind"] == "egg-box"
    code, _out, err = call("compare", "egg-box:amplitude=0.1mm", *MODULE)
    assert code == 2
    assert "period is missing: a egg-box needs amplitude, period" in err


def test_kind_is_registered_until_the_command_ends(call: Call) -> None:
    assert call("surfaces", "egg-box", *MODULE)[0] == 0
    assert "egg-box" not in catalogue.CATALOGUE
    code, _out, err = call("surfaces", "egg-box")
    assert code == 2
    assert "is unknown: 'egg-box'" in err


def test_scene_accepts_the_kind(read_json: Answer, tmp_path: Path) -> None:
    scene = tmp_path / "eggs.toml"
    scene.write_text(
        '[texture]\nkind = "egg-box"\namplitude = "0.1 mm"\nperiod = "2 mm"\n'
        '[surface]\nlaw = "C"\nmax_depth = "0.2 mm"\n'
        '[device]\nid = "omega.3"\napparent_mass = "250 g"\n'
        '[hand]\nkind = "spring"\nstiffness = "500 N/m"\n'
        '[motion]\nkind = "strokes"\nstart = "0mm; 0mm; -0.05mm"\n'
        'end = "1mm; 0.2mm; -0.05mm"\nspeed = "50 mm/s"\n'
        '[run]\nduration = "20 ms"\n',
        encoding="utf-8",
    )
    assert read_json("analyze", str(scene), *MODULE)["texture"]["kind"] == "egg-box"
    read_json("simulate", str(scene), *MODULE)


def test_documented_example_runs(
    plugin: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(catalogue, "CATALOGUE", dict(catalogue.CATALOGUE))
    plugin.main()
    assert "C: q = 1.1006 (certified)" in capsys.readouterr().out


def test_default_reference_height_has_double_precision(texture: Any) -> None:
    """This is the default of a kind without a formula in multi-precision arithmetic."""
    h = texture.exact_height()
    with mpmath.workdps(40):
        k, x, y = mpmath.mpf(WAVE), mpmath.mpf("0.123e-3"), mpmath.mpf("0.321e-3")
        exact = mpmath.mpf(A) * mpmath.cos(k * x) * mpmath.cos(k * y)
        error = abs(h(x, y, 0, 0) - exact)
    assert error < 1e-15 * A
