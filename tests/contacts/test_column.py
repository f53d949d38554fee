"""The axis through a probe along which the depth grows, and the relative cost of a contact."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.contacts import CONTACTS
from asperity.textures import Fourier

# Generic: no axis, no crest and no trough at the probes.
HILLS = Fourier([4e-5, 3e-5], [[6e3, 1e3], [-2e3, 5e3]], phases=[0.3, 1.1])
PROBES = np.array([[0.11e-3, 0.23e-3, -0.12e-3], [0.71e-3, -0.34e-3, -0.09e-3]])


@pytest.mark.parametrize("name", ["nominal", "vertical", "nearest", "split"])
@pytest.mark.parametrize("probe", PROBES)
def test_depth_equals_the_distance_along_the_axis(name: str, probe: np.ndarray) -> None:
    contact = CONTACTS[name]
    surface_point, direction = contact.depth_axis(HILLS, probe)
    depth = contact.depth(HILLS, probe[None])[0]
    assert depth > 0.0
    assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(surface_point + depth * direction, probe, atol=1e-12)
    distances = np.array([0.0, 0.3, 0.8]) * depth
    np.testing.assert_allclose(
        contact.depth(HILLS, surface_point + distances[:, None] * direction), distances, atol=1e-10
    )


def test_axes_of_vertical_and_nearest_contact_differ() -> None:
    directions = {
        name: contact.depth_axis(HILLS, PROBES[0])[1] for name, contact in CONTACTS.items()
    }
    assert directions["vertical"][2] == -1.0
    assert abs(directions["nearest"][2]) < 0.999


def test_contacts_with_a_search_cost_more() -> None:
    costs = {
        name: CONTACTS[name].relative_cost for name in ("nominal", "vertical", "nearest", "split")
    }
    assert costs["nominal"] == costs["vertical"] == 1.0
    assert costs["vertical"] < costs["nearest"] < costs["split"]
    assert [CONTACTS[name].requires_search for name in costs] == [False, False, True, True]
