"""Fused modules: their contents and their cached code."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core import cache as checked
from asperity.kernels import fuse
from asperity.kernels import numba_internals as code_store
from asperity.laws import LAWS, Law
from asperity.laws.clamps import BACKED, CLAMPS, Clamp
from asperity.textures import Texture

Check = Callable[..., Any]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache folder."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    fuse._load_module.cache_clear()
    yield tmp_path / "cache"
    fuse._load_module.cache_clear()


LOOP = """
from numba import njit
from asperity.kernels.numba_internals import cache_machine_code
@cache_machine_code(njit(nogil=True))
def twice(x):
    return 2.0 * x
"""


def test_module_name_depends_on_its_content():
    first, second = fuse.load_fused("VALUE = 1\n"), fuse.load_fused("VALUE = 2\n")
    assert (first.VALUE, second.VALUE, first.__name__ == second.__name__) == (1, 2, False)


def test_second_load_uses_the_cache(cache: Path):
    first = fuse.load_fused(LOOP).twice
    assert first(3.0) == 6.0
    assert sum(first.stats.cache_misses.values()) == 1
    assert len(list(cache.rglob("*/[!.]*"))) == 1
    fuse._load_module.cache_clear()
    second = fuse.load_fused(LOOP).twice
    assert second(3.0) == 6.0
    assert not second.stats.cache_misses
    assert sum(second.stats.cache_hits.values()) == 1


def test_damaged_cache_entry_is_recompiled_with_a_warning(cache: Path):
    fuse.load_fused(LOOP).twice(3.0)
    (path,) = cache.rglob("*/[!.]*")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)
    fuse._load_module.cache_clear()
    checked._warned.clear()
    recompiled = fuse.load_fused(LOOP).twice
    with pytest.warns(checked.CacheWarning, match="damaged entries"):
        assert recompiled(3.0) == 6.0
    assert sum(recompiled.stats.cache_misses.values()) == 1


@pytest.mark.usefixtures("cache")
def test_incompatible_cache_entry_is_recompiled(monkeypatch: pytest.MonkeyPatch):
    fuse.load_fused(LOOP).twice(3.0)
    fuse._load_module.cache_clear()
    checked._warned.clear()

    def raise_type_error(*_arguments: object) -> None:
        raise TypeError("of another build")

    monkeypatch.setattr(code_store.compiler.CompileResult, "_rebuild", raise_type_error)
    with pytest.warns(checked.CacheWarning):
        assert fuse.load_fused(LOOP).twice(3.0) == 6.0


@pytest.mark.parametrize("texture", ["map"], indirect=True)
@pytest.mark.parametrize("clamp", CLAMPS.values(), ids=str)
def test_fused_module_contains_only_the_requested_clamp(
    clamp: Clamp, texture: Texture, interpreted: Check
):
    module = interpreted(lambda: fuse.fuse_surface(LAWS["B"], texture.sampler, clamp))
    body = module.fused_source.split("def probe_force")[1]
    assert ("min(depth, clamp_depth)" in body) == clamp.holds_whole_force
    assert ("z < floor" in body) == clamp.has_backing_wall


def test_fused_functions_have_unique_names_and_decorators(texture: Texture, interpreted: Check):
    module = interpreted(lambda: fuse.fuse_surface(LAWS["F"], texture.sampler, BACKED))
    body = ast.parse(module.fused_source).body
    functions = [node for node in body if isinstance(node, ast.FunctionDef)]
    names = [function.name for function in functions]
    assert len(names) == len(set(names))
    assert {"sample_gradient", "law_force", "jacobian_batch"} <= set(names)
    assert {"sample_hessian", "closest_point"}.isdisjoint(
        names
    )  # only required functions are included
    for function in functions:
        decorator = function.decorator_list[0]
        assert isinstance(decorator, ast.Name)
        assert (decorator.id == "loop") == function.name.endswith("_batch")


def test_user_defined_law_never_uses_a_shipped_kernel():
    law = Law("A", "own", "nominal", lambda c: 3 * c.k * c.depth * c.e_z)
    assert "3*depth*k" in fuse.kernel_source(law)
    assert "3*depth*k" not in fuse.kernel_source(LAWS["A"])


# --- contacts without a texture -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("letter", "compiled"),
    [*((letter, False) for letter in LAWS if letter != "H"), ("D", True), ("F", True)],
)
def test_contact_batch_agrees_with_closed_forms(
    letter: str, compiled: bool, interpreted: Check, force_by_hand: Check, jacobian_by_hand: Check
):
    law = LAWS[letter]
    module = fuse.fuse_contact(law) if compiled else interpreted(lambda: fuse.fuse_contact(law))
    rng = np.random.default_rng(41)
    scale = np.array([2e-4, 1.0, 1.0, 900.0, 400.0, 900.0])
    derivatives = rng.normal(size=(7, 6)) * scale
    depths = np.array([0.0, 1e-6, 1e-4, 2e-4, 2e-4, 3e-4, 4e-4])
    deflection = rng.normal(size=(7, 2)) * 3e-4
    sliding = np.array([False, True, True, False, True, False, True])
    force, jacobian = np.empty((7, 3)), np.empty((7, 3, 3))
    shared = (700.0, 1e-4, 5e-4, 1.0, 0.0)
    law_parameters = (0.7, 0.8e-3, 0.9) if letter == "F" else ()
    module.contact_batch(
        rng.normal(size=(7, 3)),
        depths,
        derivatives,
        deflection,
        sliding,
        force,
        jacobian,
        shared + law_parameters,
    )
    for i in range(7):
        h, hx, hy, hxx, hxy, hyy = derivatives[i]
        values: dict[str, Any] = {"k": 700.0, "depth": depths[i]}
        state: dict[str, Any] = {}
        if letter == "F":
            state = {"d": deflection[i], "m": (1 + 0.9 * (h - 1e-4) / 5e-4) / 2}
            state |= {"friction": 0.7, "max_deflection": 0.8e-3}
        expected = force_by_hand(letter, g=(hx, hy), **values, **state)
        assert np.abs(force[i] - expected).max() <= 1e-14 * (1 + np.abs(expected).max())
        if letter == "F":
            state |= {"m_slope": 0.9 * np.array([hx, hy]) / 1e-3, "sliding": sliding[i]}
        hessian = np.array([[hxx, hxy], [hxy, hyy]])
        expected = jacobian_by_hand(letter, g=(hx, hy), hessian=hessian, **values, **state)
        assert np.abs(jacobian[i] - expected).max() <= 1e-11 * np.linalg.norm(expected, 2)


def test_law_that_depends_on_position(interpreted: Check):
    """The force k depth (1 + a · p) e_z, with a different weight for each coordinate."""
    a = np.array([300.0, -200.0, 500.0])
    law = Law("P", "placed", "vertical", lambda c: c.k * c.depth * (1 + c.position.dot(a)) * c.e_z)
    assert fuse.uses_position(law)
    assert not fuse.uses_position(LAWS["A"])
    rng = np.random.default_rng(43)
    points, depths, derivatives = rng.normal(size=(5, 3)), rng.random(5), rng.normal(size=(5, 6))
    force, jacobian = np.empty((5, 3)), np.empty((5, 3, 3))
    no_deflection = np.zeros((5, 2)), np.zeros(5, dtype=bool)
    module = interpreted(lambda: fuse.fuse_contact(law))
    module.contact_batch(
        points, depths, derivatives, *no_deflection, force, jacobian, (700.0, 0.0, 1.0, 1.0, 0.0)
    )
    gain = 1.0 + points @ a
    slope_vectors = np.column_stack([derivatives[:, 1:3], -np.ones(5)])
    expected = 700.0 * (gain[:, None] * slope_vectors + depths[:, None] * a)
    np.testing.assert_allclose(force[:, 2], 700.0 * depths * gain, rtol=1e-12)
    np.testing.assert_allclose(jacobian[:, 2], expected, rtol=1e-11)
    assert not jacobian[:, :2].any()
