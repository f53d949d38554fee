"""Taylor models enclose the values of functions; without their remainder they do not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.helpers.reference import exact_jacobian

from asperity.analysis.bounds.bound import NORM
from asperity.analysis.bounds.problems import law_constants, law_kernel, stack_entries
from asperity.enclosures.cells import DERIVATIVE_NAMES, cells_with_depth
from asperity.enclosures.taylor import TaylorMath, TaylorModel, reciprocal
from asperity.kernels.fuse import kernel_source
from asperity.laws import Law, find_law
from asperity.surface import Surface
from asperity.textures import Fourier

SAMPLES = 64
WIDE = np.longdouble
# Wider than a double where the machine has it; the checks are strict only then.
STRICT = np.finfo(WIDE).eps < 1e-18


@dataclass(frozen=True)
class Case:
    """An operation on models, the same on numbers, and the range of its arguments."""

    name: str
    model: Callable[..., Any]
    number: Callable[..., Any]
    low: float = -2.0
    high: float = 2.0
    arguments: int = 1
    linear: bool = False


M = TaylorMath
CASES = [
    Case("+", lambda x, y: x + y, lambda x, y: x + y, arguments=2, linear=True),
    Case("-", lambda x, y: x - y, lambda x, y: x - y, arguments=2, linear=True),
    Case("+ 3", lambda x: 3.0 + x + 0.1, lambda x: 3.0 + x + WIDE(0.1), linear=True),
    Case("1 -", lambda x: 1.0 - x, lambda x: 1.0 - x, linear=True),
    Case("* 0.3", lambda x: -(0.3 * x), lambda x: -(WIDE(0.3) * x), linear=True),
    Case("*", lambda x, y: x * y, lambda x, y: x * y, arguments=2),
    Case("square", lambda x: x * x, lambda x: x * x),
    Case("/", lambda x, y: x / y, lambda x, y: x / y, 0.5, 3.0, 2),
    Case("1/", lambda x: 2.0 / x, lambda x: 2.0 / x, 0.5, 3.0),
    Case("1/-", lambda x: 2.0 / x, lambda x: 2.0 / x, -3.0, -0.5),
    Case("/ 7", lambda x: x / 7.0, lambda x: x * WIDE(1.0 / 7.0), linear=True),
    Case("**5", lambda x: x**5, lambda x: x**5),
    Case("**-3", lambda x: x**-3, lambda x: x**-3, 0.5, 3.0),
    Case("**1.5", lambda x: x**1.5, lambda x: x ** WIDE(1.5), 0.3, 3.0),
    Case("pow", lambda x: x**-0.7, lambda x: x ** WIDE(-0.7), 0.3, 3.0),
    Case("abs+", lambda x: abs(x) * x, lambda x: abs(x) * x, 0.5, 2.0),
    Case("sqrt", M.sqrt, np.sqrt, 0.3, 3.0),
    Case("exp", M.exp, np.exp),
    Case("log", M.log, np.log, 0.3, 3.0),
    Case("sin", M.sin, np.sin, -7.0, 7.0),
    Case("cos", M.cos, np.cos, -7.0, 7.0),
    Case("tan", M.tan, np.tan, -1.0, 1.0),
    Case("asin", M.asin, np.arcsin, -0.8, 0.8),
    Case("acos", M.acos, np.arccos, -0.8, 0.8),
    Case("sinh", M.sinh, np.sinh),
    Case("cosh", M.cosh, np.cosh),
    Case("tanh", M.tanh, np.tanh),
    Case("atan", M.atan, np.arctan),
]
CURVED = [case for case in CASES if not case.linear]


def parametrize_cases(cases: list[Case]) -> Any:
    return pytest.mark.parametrize("case", cases, ids=lambda case: case.name)


def random_models(
    case: Case, rng: np.random.Generator, half: float, cells: int, noise: float = 0.2
) -> tuple[list[TaylorModel], list[Any]]:
    """Return models of the arguments, and values that they enclose, (samples, cells)."""
    d = int(rng.integers(1, 4))
    points = rng.uniform(-1.0, 1.0, (SAMPLES, d)).astype(WIDE)
    points[: 2**d] = np.array(np.meshgrid(*[[-1.0, 1.0]] * d)).reshape(d, -1).T
    models, values = [], []
    for _ in range(case.arguments):
        reach = half * (case.high - case.low)
        g = reach / d * rng.uniform(-1.0, 1.0, (d, cells)) / (1.0 + noise)
        e = noise * np.abs(g).sum(axis=0)
        margin = np.abs(g).sum(axis=0) + e
        c = rng.uniform(case.low + margin, case.high - margin)
        linear = c + points @ g.astype(WIDE)
        models.append(TaylorModel(c, g, e))
        values.append(linear + e * rng.choice([-1.0, 0.3, 1.0], (SAMPLES, cells)))
    return models, [points, *values]


def excess(model: TaylorModel, points: Any, values: Any) -> Any:
    """Return the distance of values (samples, cells) outside a model; at most 0 if enclosed."""
    linear = model.c.astype(WIDE) + points @ model.g.astype(WIDE)
    slack = 0.0 if STRICT else 1e-14 * np.abs(values).max(axis=0)
    return (np.abs(values - linear) - model.e - slack).max(axis=0)


@parametrize_cases(CASES)
@pytest.mark.parametrize("half", [0.2, 1e-2, 1e-5, 0.0])
def test_every_operation_encloses_dense_samples(case: Case, half: float) -> None:
    rng = np.random.default_rng(CASES.index(case))
    for _ in range(4):
        models, (points, *values) = random_models(case, rng, half, cells=200)
        result = case.model(*models)
        assert np.isfinite(result.e).mean() >= (0.7 if half > 0.1 else 1.0)
        assert (excess(result, points, case.number(*values)) <= 0.0).all()


@parametrize_cases(CURVED)
def test_models_without_their_remainder_do_not_enclose(case: Case) -> None:
    rng = np.random.default_rng(7)
    models, (points, *values) = random_models(case, rng, 0.1, cells=200, noise=0.0)
    result = case.model(*models)
    bare = replace(result, e=1e-13 * np.abs(result.c))
    assert (excess(bare, points, case.number(*values)) > 0.0).mean() > 0.9


@parametrize_cases([case for case in CASES if case.linear])
def test_linear_models_with_a_reduced_error_do_not_enclose(case: Case) -> None:
    rng = np.random.default_rng(8)
    models, (points, *values) = random_models(case, rng, 0.1, cells=200)
    result = case.model(*models)
    bare = replace(result, e=0.4 * result.e)
    assert (excess(bare, points, case.number(*values)) > 0.0).mean() > 0.9


@pytest.mark.skipif(not STRICT, reason="no floating point wider than double here")
@parametrize_cases([case for case in CASES if case.name not in {"+", "-", "1 -"}])  # exact there
def test_rounding_is_included_in_the_error(case: Case) -> None:
    """On cells of width zero the error is only rounding; without it values are not enclosed."""
    rng = np.random.default_rng(9)
    models, (points, *values) = random_models(case, rng, 0.0, cells=500)
    result = case.model(*models)
    assert (result.e <= 1e-13 * (1.0 + np.abs(result.c))).all()
    bare = replace(result, e=0.0 * result.e)
    assert (excess(bare, points, case.number(*values)) > 0.0).any()


@parametrize_cases(CURVED)
def test_error_has_order_two(case: Case) -> None:
    rng = np.random.default_rng(11)
    models, _ = random_models(case, rng, 0.05, cells=50, noise=0.0)
    sizes = 2.0 ** -np.arange(2.0, 10.0)
    errors = []
    for size in sizes:
        scaled = [replace(m, g=size * m.g) for m in models]
        errors.append(case.model(*scaled).e.sum())
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)


# --- unbounded results ----------------------------------------------------------------------------


def interval_model(low: float, high: float) -> TaylorModel:
    """Return a model of all values between two numbers."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return TaylorModel(np.array([middle]), np.array([[0.7 * half]]), np.array([0.3 * half]))


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (reciprocal, -1.0, 2.0),
        (reciprocal, 0.0, 2.0),
        (lambda x: 1.0 / (x * x), -1e-8, 1.0),
        (lambda x: 3.0 * x / x, -1.0, 1.0),
        (M.sqrt, -1e-9, 1.0),
        (M.sqrt, 0.0, 1.0),
        (M.log, 0.0, 1.0),
        (M.log, -3.0, -1.0),
        (lambda x: x**-2, -1.0, 1.0),
        (lambda x: x**0.5, -1.0, 1.0),
        (lambda x: x**100, -1.0, 1.0),  # an integer power too large for repeated multiplication
        (M.asin, 0.5, 1.0),
        (M.asin, 1.5, 2.0),
        (M.acos, -1.0, 0.0),
        (M.tan, 1.5, 1.6),
        (M.exp, 0.0, 1000.0),
        (M.cosh, -1000.0, 0.0),
    ],
)
def test_pole_in_the_cell_gives_an_infinite_error(function: Any, low: float, high: float) -> None:
    result = function(interval_model(low, high))
    assert np.isposinf(result.e).all()
    assert np.isfinite(result.c).all()
    assert np.isfinite(result.g).all()


@parametrize_cases(CASES)
@pytest.mark.parametrize("bad", [math.inf, math.nan])
def test_infinite_and_nan_errors_propagate(case: Case, bad: float) -> None:
    finite = (
        interval_model(max(case.low, 0.4), 0.7) if case.high > 0 else interval_model(-0.7, -0.5)
    )
    unbounded = replace(finite, e=np.array([bad]))
    others = [finite] * (case.arguments - 1)
    with np.errstate(invalid="ignore"):
        result = case.model(unbounded, *others)
    assert not np.isfinite(result.e).any()
    c, g, e = stack_entries([[result]], 1, 1)
    with np.errstate(all="ignore"):
        assert np.isposinf(NORM.upper_bounds(c, g, e, 0.0)).all()


def test_abs_and_copysign_across_zero_enclose_all_values() -> None:
    result = abs(interval_model(-1.0, 3.0))
    assert result.c - result.e <= 0.0
    assert result.c + result.e >= 3.0
    sign = M.copysign(2.0, interval_model(-1.0, 3.0))
    assert (sign.c - sign.e, sign.c + sign.e) == (-2.0, 2.0)
    assert M.copysign(2.0, interval_model(-3.0, -1.0)).c == -2.0


def test_comparisons_and_truth_values_of_models_raise() -> None:
    x, y = interval_model(-1.0, 1.0), interval_model(3.0, 4.0)
    for compare in (
        lambda: x > 0.0,
        lambda: x < y,
        lambda: x <= y,
        lambda: y >= x,
        lambda: x == 0.0,
        lambda: x != y,
        lambda: bool(x),
        lambda: max(x, 0.0),
        lambda: hash(x),
    ):
        with pytest.raises(TypeError):
            compare()
    with pytest.raises(TypeError, match="atan2"):
        _ = M.atan2
    with pytest.raises(TypeError):
        _ = 2.0**x


def test_numpy_scalar_on_the_left_returns_a_model() -> None:
    for result in (
        np.float64(2.0) * interval_model(1.0, 2.0),
        np.float64(1.0) / interval_model(1.0, 2.0),
    ):
        assert isinstance(result, TaylorModel)


def test_taylor_math_of_numbers_equals_math() -> None:
    for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "tanh", "atan"):
        assert getattr(M, name)(0.3) == pytest.approx(getattr(math, name)(0.3), rel=1e-15)
    assert M.copysign(1.0, -3.0) == -1.0
    assert (M.sinh(1.0), M.cosh(1.0)) == pytest.approx((math.sinh(1.0), math.cosh(1.0)))


# --- the kernels of laws --------------------------------------------------------------------------

TEXTURE = Fourier([4e-4, 3e-4], [[2100.0, 300.0], [-500.0, 1700.0]], [0.4, 1.1])
DEPTH = 0.2e-3


def user_defined_law() -> Law:
    return Law("V", "own", "vertical", lambda c: c.k * c.depth**2 * c.normal * 1e3)


def compile_kernel(law: Law) -> Callable[..., Any]:
    names: dict[str, Any] = {"math": math}
    exec(compile(kernel_source(law), "<plain>", "exec"), names)
    return names["law_jacobian"]


@pytest.mark.parametrize("law", [*"WABCDEG", user_defined_law()], ids=str)
@pytest.mark.parametrize("level", [3, 6])
def test_law_kernels_on_models_enclose_their_values_on_numbers(law: str | Law, level: int) -> None:
    """Checked on cells of the torus times a range of depths, at random points of each."""
    surface = Surface(TEXTURE, law, max_depth=DEPTH)
    texture_cells = TEXTURE.cells()
    assert texture_cells is not None
    cells = cells_with_depth(texture_cells, DEPTH)
    rng = np.random.default_rng(level)
    half = np.array([math.pi, math.pi, 0.5 * DEPTH]) / 2.0**level
    centres = half * (2.0 * rng.integers(0, 2**level, (60, 3)) + 1.0)
    models = cells.enclosures(centres, half, DERIVATIVE_NAMES)
    kernel, arguments = law_kernel(surface.law)
    constants = {n: v for n, v in law_constants(surface).items() if n in arguments}
    with np.errstate(all="ignore"):
        entries = kernel(**{n: models[n] for n in arguments if n in models}, **constants)
    kernel_of_numbers = compile_kernel(surface.law)
    points = rng.uniform(-1.0, 1.0, (6, 60, 3))
    points[0] = np.sign(points[0])
    bounded = 0
    for xi in points:
        coordinates = centres + half * xi
        rows = cells.derivatives(coordinates)
        for i, row in enumerate(rows):
            values = {**dict(zip(DERIVATIVE_NAMES, row, strict=True)), "depth": coordinates[i, 2]}
            exact = kernel_of_numbers(
                **{n: values[n] for n in arguments if n in values}, **constants
            )
            for model, value in zip(entries, exact, strict=True):
                bounded += _encloses(model, xi, i, float(value))
    assert bounded > 1000  # most cells have finite bounds


def _encloses(model: Any, xi: np.ndarray, cell: int, value: float) -> bool:
    if not isinstance(model, TaylorModel):
        assert value == model
        return True
    if not math.isfinite(model.e[cell]):
        return False
    linear = model.c[cell] + model.g[:, cell] @ xi[cell]
    assert abs(value - linear) <= model.e[cell] + 1e-14 * (abs(linear) + abs(value))
    return True


@pytest.mark.parametrize("letter", "ABCDG")
def test_law_kernels_enclose_the_symbolic_jacobian(letter: str) -> None:
    """The Jacobian with 30 digits shares only the symbolic force with the kernel."""
    surface = Surface(TEXTURE, letter, stiffness=1.0, max_depth=DEPTH)
    texture_cells = TEXTURE.cells()
    assert texture_cells is not None
    half, rng = np.array([0.02, 0.02]), np.random.default_rng(3)
    centres = rng.uniform(0.0, 6.0, (3, 2))
    kernel, arguments = law_kernel(find_law(letter))
    models = {**texture_cells.enclosures(centres, half, DERIVATIVE_NAMES), "depth": DEPTH}
    entries = kernel(**{n: models[n] for n in arguments if n in models}, k=1.0)[3:]
    for cell, centre in enumerate(centres):
        xi = rng.uniform(-1.0, 1.0, (1, 2))
        xy = texture_cells.to_plane(centre + half * xi)
        point = contact_point(letter, xy[0])
        exact = np.array(exact_jacobian(surface, point).tolist(), dtype=float).ravel()
        positions = np.tile(xi, (len(centres), 1))
        for model, value in zip(entries, exact, strict=True):
            if isinstance(model, TaylorModel):
                assert model.e[cell] < 0.1  # a useful bound
            assert _encloses(model, positions, cell, value) or abs(value) < 1e-12


def contact_point(letter: str, xy: np.ndarray) -> np.ndarray:
    h, hx, hy = TEXTURE.derivatives(xy[None])[0, :3]
    if letter == "G":
        return np.array([*xy, -DEPTH])
    if letter != "D":
        return np.array([*xy, h - DEPTH])
    below = DEPTH / math.sqrt(1.0 + hx * hx + hy * hy)
    return np.array([xy[0] + below * hx, xy[1] + below * hy, h - below])


def test_wrong_kernel_entry_is_detected() -> None:
    """Negative control of the two tests above: an error of 1 part in 1000 is outside."""
    wrong = SimpleNamespace(**vars(interval_model(1.0, 1.0002)))
    model = TaylorModel(wrong.c * 1.001, wrong.g, wrong.e)
    with pytest.raises(AssertionError):
        _encloses(model, np.zeros((1, 1)), 0, 1.0001)
