"""Upper bounds of dependencies: what each of them protects, and whether that still holds.

A new version of a library is tried by raising its bound in pyproject.toml. If a test here fails,
its message states what has changed and what depends on it.
"""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import requires, version
from pathlib import Path

import mpmath
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROTECTS = {
    "numba": "private names of the compiler and its cache, in asperity/kernels/numba_internals.py"
    " (tests/kernels/test_numba_internals.py lists them)",
    "numpy": "random numbers of Generator, whose streams a release may change (NEP 19): the library"
    " of synthetic surfaces, noise and the cases of asperity reproduce are made of them; and Numba,"
    " which refuses to be imported with a NumPy that it does not know",
    "mpmath": "SymPy, which does not allow mpmath 1.4, and the precision of the reference"
    " implementation",
}
"""What would break beyond the bound."""
_RANDOM_METHOD = re.compile(r"\b(?:rng|draw|default_rng\(\w+(?: \+ \w+)?\))\.([a-z_]+)\(")
_REQUIREMENT = re.compile(r"([A-Za-z0-9_.-]+)([^;\[]*)")


def upper_bounds(requirements: list[str]) -> dict[str, str]:
    """Return the upper bound of each dependency that has one, of what is always installed."""
    parts = (_REQUIREMENT.match(one) for one in requirements if "extra ==" not in one)
    names = {part[1].lower(): part[2] for part in parts if part is not None}
    return {
        name: found[1] for name, text in names.items() if (found := re.search(r"<([^,]+)", text))
    }


def release(text: str) -> tuple[int, ...]:
    """Return major and minor version."""
    return tuple(int(part) for part in text.split(".")[:2])


def test_each_upper_bound_has_a_reason() -> None:
    bounds = upper_bounds(PROJECT["project"]["dependencies"])
    assert bounds.keys() == PROTECTS.keys(), "state in PROTECTS what the bound protects"
    assert upper_bounds(["numba>=0.60,<0.69", "rich>=13", "a<2; extra == 'b'"]) == {"numba": "0.69"}


def test_metadata_have_the_bounds_of_the_project() -> None:
    installed = upper_bounds(requires("asperity") or [])
    assert installed == upper_bounds(PROJECT["project"]["dependencies"]), "make .venv/runtime"


@pytest.mark.parametrize("name", PROTECTS)
def test_installed_version_is_below_its_bound(name: str) -> None:
    bound = upper_bounds(PROJECT["project"]["dependencies"])[name]
    assert release(version(name)) < release(bound), f"{name} {version(name)}: {PROTECTS[name]}"


def test_bound_of_numba_is_the_next_minor_version() -> None:
    """Private names change without notice, so only versions that were tested are allowed."""
    major, minor = release(version("numba"))
    assert upper_bounds(PROJECT["project"]["dependencies"])["numba"] == f"{major}.{minor + 1}"


def test_bound_of_numpy_is_that_of_numba() -> None:
    ours, theirs = (
        upper_bounds(some)["numpy"]
        for some in (PROJECT["project"]["dependencies"], requires("numba") or [])
    )
    assert release(ours) <= release(theirs), PROTECTS["numpy"]


STREAMS = {
    "random": [0.269147884, 0.365924131, 0.0200496007],
    "standard_normal": [-0.326967305, -0.974315114, 0.494587741],
    "normal": [0.673032695, 0.0256848865, 1.49458774],
    "uniform": [-1.46170423, -1.26815174, -1.9599008],
    "integers": [971, 269, 398],
    "permutation": [677, 501, 102],
    "choice": [971, 269, 398],
    "dirichlet": [0.30178547, 0.644342917, 0.0538716134],
}


ARGUMENTS: dict[str, tuple[object, ...]] = {
    "normal": (1.0, 1.0, 3),
    "uniform": (-2.0, 0.0, 3),
    "integers": (0, 1000, 3),
    "permutation": (1000,),
    "choice": (1000, 3),
    "dirichlet": ((1.0, 1.0, 1.0),),
}


@pytest.mark.parametrize("method", STREAMS)
def test_random_streams_of_numpy_are_unchanged(method: str) -> None:
    """Every method of ``Generator`` that the package uses gives the numbers that it gave."""
    rng = np.random.default_rng(20240501)
    numbers = np.asarray(getattr(rng, method)(*ARGUMENTS.get(method, (3,))))[:3]
    message = f"NumPy {np.__version__}: Generator.{method} changed. It protects {PROTECTS['numpy']}"
    np.testing.assert_allclose(numbers, STREAMS[method], rtol=1e-7, err_msg=message)


def test_every_random_method_in_use_is_pinned() -> None:
    """Random numbers are called ``rng`` or ``draw`` in the package."""
    sources = (path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))
    used = {name for text in sources for name in _RANDOM_METHOD.findall(text)}
    assert used - {"bit_generator", "spawn"} == STREAMS.keys()


def test_mpmath_computes_with_the_requested_digits() -> None:
    """``workdps`` sets, nests and restores the precision, and numbers of doubles are exact."""
    message = f"mpmath {mpmath.__version__}: precision changed. It protects {PROTECTS['mpmath']}"
    before = mpmath.mp.dps
    with mpmath.workdps(50):
        assert abs(mpmath.sqrt(2) ** 2 - 2) < mpmath.mpf(10) ** -49, message
        with mpmath.workdps(20):
            assert mpmath.mp.dps == 20, message
        assert mpmath.mp.dps == 50, message
        assert mpmath.mpf(0.1) != mpmath.mpf("0.1"), message
    assert mpmath.mp.dps == before, message
    assert release(upper_bounds(requires("sympy") or [])["mpmath"]) == (1, 4), message
