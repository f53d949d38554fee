"""A user-defined contact, in a file outside the package, works everywhere.

Its contact is at half of the height: depth h/2 - z, contact point (x, y).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from tests.helpers.pages import page_example
from tests.helpers.reference import exact_force, exact_jacobian
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.contacts import VERTICAL
from asperity.core.errors import LawError, ParameterError
from asperity.laws import Law
from asperity.simulation import Cartesian, PrescribedHand, Servo, Strokes, simulate

MODULE = page_example("howto/extend.md", "A contact")

TEXTURES = {
    "sinusoid": asp.Sinusoid(0.3e-3, 2e-3, 0.4, (2.0, 1.0)),
    "map": asp.HeightMap(1e-4 * np.random.default_rng(3).normal(size=(9, 8)), 0.5e-3),
}


@pytest.fixture(scope="module")
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("own")
    (folder / "my_contact.py").write_text(MODULE, encoding="utf-8")
    with imported(folder, "my_contact") as module:
        yield module


def probes(texture: asp.Texture, count: int) -> np.ndarray:
    """Return points around half of the height, one in three of them out of contact."""
    rng = np.random.default_rng(5)
    xy = rng.uniform(0.0, 4e-3, (count, 2))
    return np.column_stack([xy, 0.5 * texture.height(xy) + rng.uniform(-0.4e-3, 0.2e-3, count)])


def expected_force(texture: asp.Texture, p: np.ndarray) -> np.ndarray:
    """Return the force of the law at stiffness 500 N/m and gain 0.7."""
    depth = 0.5 * texture.height(p[:, :2]) - p[:, 2]
    w = np.column_stack([-texture.gradient(p[:, :2]), np.ones(len(p))])
    force = 500.0 * 0.7 * depth[:, None] * w / np.linalg.norm(w, axis=1)[:, None]
    return np.where(depth[:, None] > 0.0, force, 0.0)


@pytest.mark.parametrize("name", TEXTURES)
def test_force_equals_the_formula(plugin: ModuleType, name: str) -> None:
    texture = TEXTURES[name]
    surface, p = asp.Surface(texture, plugin.LAW, 500.0), probes(texture, 300)
    force, expected = surface.force(p), expected_force(texture, p)
    assert (np.linalg.norm(expected, axis=1) > 0.0).mean() == pytest.approx(2 / 3, abs=0.1)
    np.testing.assert_allclose(force, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(surface.trace(p), force)
    # The contact at the full height gives another force.
    full = asp.Surface(
        texture, Law("V", "full", VERTICAL, plugin.LAW.force, parameters={"gain": 0.7})
    )
    assert np.abs(full.to_stiffness(500.0).force(p) - expected).max() > 0.01


def jacobian_error(surface: asp.Surface, step: float = 1e-8) -> float:
    """Return the error of the Jacobian against central differences, relative to its norm."""
    p = probes(surface.texture, 300)
    p = p[np.abs(surface.law.contact.depth(surface.texture, p)) > 1e-6]
    steps = step * np.eye(3)
    columns = [(surface.force(p + m) - surface.force(p - m)) / (2.0 * step) for m in steps]
    jacobian = surface.jacobian(p)
    return float(np.abs(np.stack(columns, axis=-1) - jacobian).max() / np.abs(jacobian).max())


@pytest.mark.parametrize("name", TEXTURES)
def test_jacobian_equals_central_differences(plugin: ModuleType, name: str) -> None:
    assert jacobian_error(asp.Surface(TEXTURES[name], plugin.LAW, 500.0)) < 1e-5


def test_derivatives_of_another_contact_give_a_wrong_jacobian(plugin: ModuleType) -> None:
    class Wrong(plugin.Halved):
        def derivatives(self) -> Any:
            return VERTICAL.derivatives()

    law = Law("wrong", "wrong", Wrong(), plugin.LAW.force, parameters={"gain": 0.7})
    assert jacobian_error(asp.Surface(TEXTURES["sinusoid"], law, 500.0)) > 0.05


def test_kernels_equal_the_symbolic_definition(plugin: ModuleType) -> None:
    surface = asp.Surface(TEXTURES["sinusoid"], plugin.LAW, 500.0)
    for p in probes(surface.texture, 6):
        force = np.array(exact_force(surface, p.tolist()), dtype=float).ravel()
        jacobian = np.array(exact_jacobian(surface, p.tolist()).tolist(), dtype=float)
        np.testing.assert_allclose(surface.force(p[None])[0], force, atol=1e-13)
        np.testing.assert_allclose(surface.jacobian(p[None])[0], jacobian, atol=1e-9)


def test_clamp_limits_the_depth_of_the_contact(plugin: ModuleType) -> None:
    texture = TEXTURES["sinusoid"]
    surface = asp.Surface(texture, plugin.LAW, 500.0, max_depth=0.1e-3, clamp="whole")
    p = probes(texture, 300)
    depth = 0.5 * texture.height(p[:, :2]) - p[:, 2]
    length = np.linalg.norm(surface.force(p), axis=1)
    expected = 500.0 * 0.7 * np.clip(depth, 0.0, 0.1e-3)
    np.testing.assert_allclose(length, expected, atol=1e-12)
    assert (depth > 0.1e-3).any()


def test_anchor_is_held_only_in_contact(plugin: ModuleType) -> None:
    """The path leaves the contact at half height, below the full height, and returns."""
    texture, limit = TEXTURES["sinusoid"], 0.2e-3
    surface = asp.Surface(texture, plugin.PULLED, 500.0, max_deflection=limit)
    t = np.linspace(0.0, 1.0, 400)
    path = np.column_stack([3e-3 * t, 1e-3 * t, 0.2e-3 * np.sin(30.0 * t) - 0.05e-3])
    depth = 0.5 * texture.height(path[:, :2]) - path[:, 2]
    assert ((depth <= 0.0) & (path[:, 2] < 0.0)).any()
    expected, anchor = np.zeros((400, 3)), None
    for i in range(400):
        if depth[i] <= 0.0:
            anchor = None
            continue
        d = np.zeros(2) if anchor is None else path[i, :2] - anchor
        length = float(np.hypot(*d))
        d *= min(1.0, limit / length) if length > 0.0 else 1.0
        anchor = path[i, :2] - d
        expected[i] = 500.0 * depth[i] * np.array([*(-d / 1e-3), 1.0])
    assert np.abs(expected[:, :2]).max() > 0.01
    np.testing.assert_allclose(surface.trace(path), expected, atol=1e-12)


def test_simulation_gives_the_force_and_a_closed_energy_ledger(plugin: ModuleType) -> None:
    texture = TEXTURES["sinusoid"]
    surface = asp.Surface(texture, plugin.LAW, 500.0)
    motion = Strokes((0.0, 0.0, -0.1e-3), (5e-3, 2e-3, -0.1e-3), speed=0.05, count=3)
    run = simulate(surface, Cartesian(0.05), PrescribedHand(), Servo(1e-4), motion, 0.2)
    np.testing.assert_allclose(run.commanded, expected_force(texture, run.position), atol=1e-12)
    assert (run.commanded[:, 2] > 0.0).any()
    assert (run.commanded[:, 2] == 0.0).any()
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged


def test_it_is_analyzed_and_compared(plugin: ModuleType) -> None:
    texture = TEXTURES["sinusoid"]
    surface = asp.Surface(texture, plugin.LAW, 500.0, max_depth=0.2e-3)
    bound = asp.characteristic_number(surface)
    assert 0.7 * 0.9 < bound.lower <= bound.upper
    table = asp.compare(texture, laws=["W", plugin.LAW], max_depth=0.2e-3)
    assert [row.law.letter for row in table.rows] == ["W", "half"]


def test_missing_kernel_functions_are_named_in_the_error(plugin: ModuleType) -> None:
    class Bare(plugin.Halved):
        name = "bare"

        def kernels(self) -> tuple[ModuleType, ...]:
            return ()

    law = Law("bare", "bare", Bare(), plugin.LAW.force, parameters={"gain": 0.7})
    message = r"lacks .* 'contact_point' .*, required by law bare \(bare\) on the bare contact"
    with pytest.raises(ParameterError, match=message):
        asp.Surface(TEXTURES["sinusoid"], law).force([[0.0, 0.0, 0.0]])


def test_law_without_the_parameters_of_its_contact_is_refused() -> None:
    with pytest.raises(LawError, match="split contact must have the parameter continuity"):
        Law("S", "split-without", "split", lambda c: c.k * c.toward)


Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]


def test_command_line_uses_it(plugin: ModuleType, call: Call, read_json: Answer) -> None:
    file = Path(plugin.__file__ or "")
    arguments = (
        "sinusoid:amplitude=0.1mm,period=2mm",
        "--max-depth",
        "0.2mm",
        "--plugin",
        str(file),
    )
    assert read_json("compare", *arguments, "--laws", "half")["laws"][0]["law"] == "half"
    assert read_json("analyze", *arguments, "--law", "half")["law"] == "half"
    code, page, _err = call("analyze", *arguments, "--law", "half", "--html", "-")
    assert (code, "half-texture-normal" in page or "half texture normal" in page) == (0, True)
