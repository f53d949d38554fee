"""Fused modules: what is in them, and where they lie."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.kernels import fuse
from asperity.kernels.probe import CLAMPS
from asperity.laws import LAWS, Law
from asperity.textures import Texture

Check = Callable[..., Any]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache directory."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    fuse.cache_directory.cache_clear()
    fuse.load_fused.cache_clear()
    yield tmp_path / "cache" / "kernels"
    fuse.cache_directory.cache_clear()
    fuse.load_fused.cache_clear()


def test_the_cache_lies_where_the_environment_says(cache: Path):
    assert fuse.cache_directory() == cache
    module = fuse.load_fused("VALUE = 3\n")
    assert (module.VALUE, Path(module.__file__ or "").parent) == (3, cache)


def test_without_a_place_to_write_the_cache_is_temporary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "file"))
    fuse.cache_directory.cache_clear()
    try:
        assert fuse.cache_directory().is_dir()
        assert tmp_path not in fuse.cache_directory().parents
    finally:
        fuse.cache_directory.cache_clear()


def test_a_module_is_named_after_its_content(cache: Path):
    one, two = fuse.load_fused("VALUE = 1\n"), fuse.load_fused("VALUE = 2\n")
    assert (one.VALUE, two.VALUE, one.__name__ == two.__name__) == (1, 2, False)
    assert len(list(cache.glob("*.py"))) == 2
    assert not list(cache.glob("*.tmp"))


def test_a_damaged_file_is_written_again(cache: Path):
    path = Path(fuse.load_fused("VALUE = 1\n").__file__ or "")
    path.write_text("VALUE = 1", encoding="utf-8")
    fuse.load_fused.cache_clear()
    fuse.load_fused("VALUE = 1\n")
    assert path.read_text(encoding="utf-8") == "VALUE = 1\n"
    assert path.parent == cache


@pytest.mark.parametrize("texture", ["map"], indirect=True)
@pytest.mark.parametrize("clamp", CLAMPS)
def test_a_fused_module_clamps_only_as_asked(clamp: Any, texture: Texture, interpreted: Check):
    module = interpreted(lambda: fuse.fuse_surface(LAWS["B"], texture.sampler, clamp))
    body = module.fused_source.split("def probe_force")[1]
    assert ("min(depth, clamp_depth)" in body) == (clamp in {"whole", "backed"})
    assert ("z < floor" in body) == (clamp == "backed")


def test_every_function_is_compiled_and_named_once(texture: Texture, interpreted: Check):
    module = interpreted(lambda: fuse.fuse_surface(LAWS["F"], texture.sampler, "backed"))
    body = ast.parse(module.fused_source).body
    functions = [node for node in body if isinstance(node, ast.FunctionDef)]
    names = [function.name for function in functions]
    assert len(names) == len(set(names))
    assert {"slope", "law_force", "trace_batch"} <= set(names)
    assert {"curvature", "foot"}.isdisjoint(names)  # only what is needed is taken
    for function in functions:
        decorator = function.decorator_list[0]
        assert isinstance(decorator, ast.Name)
        assert (decorator.id == "loop") == function.name.endswith("_batch")


def test_a_law_of_ones_own_never_uses_a_shipped_file():
    own = Law("A", "own", "nominal", lambda c: 3 * c.k * c.depth * c.e_z)
    assert "3*depth*k" in fuse.kernel_source(own)
    assert "3*depth*k" not in fuse.kernel_source(LAWS["A"])


# --- contacts without a texture -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("letter", "compiled"),
    [*((letter, False) for letter in LAWS if letter != "H"), ("D", True), ("F", True)],
)
def test_forces_and_jacobians_at_given_contacts(
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
    own = (0.7, 0.8e-3, 0.9) if letter == "F" else ()
    module.contact_batch(
        rng.normal(size=(7, 3)), depths, derivatives, deflection, sliding, force, jacobian,
        shared + own,
    )  # fmt: skip
    for i in range(7):
        h, hx, hy, hxx, hxy, hyy = derivatives[i]
        here: dict[str, Any] = {"k": 700.0, "depth": depths[i]}
        state: dict[str, Any] = {}
        if letter == "F":
            state = {"d": deflection[i], "m": (1 + 0.9 * (h - 1e-4) / 5e-4) / 2}
            state |= {"friction": 0.7, "max_deflection": 0.8e-3}
        expected = force_by_hand(letter, g=(hx, hy), **here, **state)
        assert np.abs(force[i] - expected).max() <= 1e-14 * (1 + np.abs(expected).max())
        if letter == "F":
            state |= {"m_slope": 0.9 * np.array([hx, hy]) / 1e-3, "sliding": sliding[i]}
        hessian = np.array([[hxx, hxy], [hxy, hyy]])
        expected = jacobian_by_hand(letter, g=(hx, hy), hessian=hessian, **here, **state)
        assert np.abs(jacobian[i] - expected).max() <= 1e-11 * np.linalg.norm(expected, 2)
