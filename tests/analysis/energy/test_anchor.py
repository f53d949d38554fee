"""The anchor along straight edges, compared with the step-by-step anchor of the kernel."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from asperity.analysis import loop_work
from asperity.analysis.energy.field_energy import anchored_segments
from asperity.contacts.contact import Contact
from asperity.contacts.contact_kinds import VerticalContact
from asperity.core.arguments import Argument
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

K, LONGEST = 1000.0, 0.4e-3
WAVE = Sinusoid(0.3e-3, 2e-3, 0.4, (2.0, 1.0))


class StatefulVerticalContact(VerticalContact):
    """The vertical contact, whose contact surface is curved, with an anchor."""

    name = "held"
    supports_state = True


PULLED = Law(
    "pull",
    "pulled-back",
    StatefulVerticalContact(),
    lambda c: c.k * c.depth * (c.e_z - c.tangential(c.deflection) / c.parameter("max_deflection")),
    stateful=True,
    parameters={"max_deflection": Argument("max_deflection", "of the anchor", "m", LONGEST)},
)
SURFACES = {
    law.letter: Surface(WAVE, law, K, law_parameters={"max_deflection": LONGEST})
    for law in (*LAWS.values(), PULLED)
    if law.stateful
}


def polylines(surface: Surface, count: int) -> Iterator[np.ndarray]:
    """Yield random closed paths in and out of contact, every other vertex on the surface."""
    rng = np.random.default_rng(11)
    for _ in range(count):
        vertices = rng.uniform([-1e-3, -1e-3, -0.6e-3], [1e-3, 1e-3, 0.2e-3], (7, 3))
        vertices[0, 2] = 1e-3
        on = vertices[1::2]
        on[:, 2] = surface.law.contact.contact_height(WAVE, np.ascontiguousarray(on[:, :2]))
        yield vertices


def traced_work(surface: Surface, vertices: np.ndarray, count: int) -> tuple[float, float]:
    """Return the work along a path of many kernel steps, and the sum of its absolute values."""
    ends = np.roll(vertices, -1, axis=0)
    edges = [np.linspace(a, b, count, endpoint=False) for a, b in zip(vertices, ends, strict=True)]
    path = np.concatenate([*edges, vertices[:1]])
    force = surface.trace(path)
    parts = (0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0)).sum(axis=1)
    return float(parts.sum()), float(np.abs(parts).sum())


def worst_error(surface: Surface) -> float:
    """Return the largest difference from the work of small kernel steps, over its absolute work."""
    worst = 0.0
    for vertices in polylines(surface, 12):
        coarse, _size = traced_work(surface, vertices, 4_000)
        fine, size = traced_work(surface, vertices, 8_000)
        limit = (
            2.0 * fine - coarse
        )  # Richardson extrapolation: the error of the steps is of first order
        worst = max(worst, abs(loop_work(surface, vertices) - limit) / size)
    return worst


@pytest.mark.parametrize("letter", SURFACES)
def test_loop_work_matches_small_kernel_steps(letter: str) -> None:
    assert "F" in SURFACES
    assert worst_error(SURFACES[letter]) < 2e-4


@pytest.mark.parametrize("letter", SURFACES)
def test_counting_surface_points_as_contact_changes_the_work(
    letter: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: if a vertex on the surface counts as contact, the anchor persists."""
    monkeypatch.setattr(
        Contact, "is_in_contact", lambda self, texture, points: self.depth(texture, points) >= 0.0
    )
    assert worst_error(SURFACES[letter]) > 1e-2


def test_reaching_the_surface_from_below_releases_the_anchor() -> None:
    """After the surface vertex the path re-enters contact there with zero deflection."""
    surface = SURFACES["F"]
    path = [[0, 0, 1e-3], [0, 0, -2e-4], [3e-4, 0, -2e-4], [3e-4, 0, 0], [3e-4, 0, -2e-4]]
    corners = np.array(path)
    segments = anchored_segments(surface, corners[:-1], corners[1:])
    held = [float(np.hypot(*segment.deflection(np.ones(1))[0])) for segment in segments]
    assert held == pytest.approx([0.0, 3e-4, 3e-4, 0.0], abs=1e-15)
    ends = [float(segment.end[2]) for segment in segments]
    assert ends == pytest.approx([-2e-4, -2e-4, 0.0, -2e-4], abs=1e-18)


def test_edge_through_two_crests_has_two_contact_intervals() -> None:
    """The anchor is released between the two contact intervals."""
    texture = Sinusoid(0.3e-3, 2e-3)
    surface = Surface(texture, PULLED, K)
    start, end = np.array([[0.0, 0.0, 0.2e-3]]), np.array([[4e-3, 0.0, 0.2e-3]])
    segments = anchored_segments(surface, start, end, wave=2e-3)
    x0 = 2e-3 / (2 * math.pi) * math.asin(2 / 3)
    starts = [float(segment.start[0]) for segment in segments]
    # On each crest the anchor sticks for max_deflection, then is dragged.
    expected = [x0, x0 + LONGEST, x0 + 2e-3, x0 + LONGEST + 2e-3]
    assert starts == pytest.approx(expected, rel=1e-12)
    assert float(segments[1].end[0]) == pytest.approx(1e-3 - x0, rel=1e-12)


def test_dragged_anchor_keeps_its_length_and_follows_the_tractrix() -> None:
    """Finite differences satisfy d' = (I - u uᵀ) t along the edge, with |d| = d_max."""
    surface = SURFACES["F"]
    start, end = np.array([[0.0, 0.0, -1e-3]]), np.array([[5e-4, 0.0, -1e-3]])
    corner = np.concatenate([start, end, end + np.array([[0.3e-3, 1e-3, 0.0]])])
    first, second, third = anchored_segments(surface, corner[:-1], corner[1:])
    assert first.end[0] == pytest.approx(LONGEST)
    s = np.linspace(0, 1, 20_001)
    np.testing.assert_allclose(np.hypot(*second.deflection(s).T), LONGEST, rtol=1e-12)
    d = third.deflection(s)
    np.testing.assert_allclose(np.hypot(*d.T), LONGEST, rtol=1e-12)
    np.testing.assert_allclose(d[0], second.deflection(s)[-1], atol=1e-15)
    move = (third.end - third.start)[:2]
    u = d / LONGEST
    rate = move - (u @ move)[:, None] * u
    np.testing.assert_allclose(np.gradient(d, s, axis=0)[1:-1], rate[1:-1], atol=1e-7 * 1e-3)


def test_deflection_never_exceeds_max_deflection() -> None:
    """On an edge slightly longer than the sticking distance the anchor is dragged at the end."""
    surface = SURFACES["F"]
    ends = np.array([[0.0, 0.0, -1e-3], [1.0005 * LONGEST, 0.0, -1e-3], [0.0, 0.0, -1e-3]])
    stuck, dragged, back = anchored_segments(surface, ends[:-1], ends[1:])
    assert np.hypot(*dragged.deflection(np.ones(1))[0]) == pytest.approx(LONGEST, rel=1e-12)
    assert stuck.end[0] == pytest.approx(LONGEST, rel=1e-12)
    assert back.deflection(np.ones(1))[0, 0] == pytest.approx(-0.0005 * LONGEST, rel=1e-9)
