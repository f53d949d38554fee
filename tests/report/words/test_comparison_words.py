"""Surfaces in words: every argument that a kind declares has its unit."""

from __future__ import annotations

from asperity.report.words.comparison_words import described
from asperity.textures.catalogue import CATALOGUE


def texture(name: str, **arguments: float) -> dict[str, object]:
    return CATALOGUE[name].make(**arguments).describe()


def test_arguments_are_read_as_their_kind_declares_them() -> None:
    said = described(texture("cloth", yarn_thickness=0.2e-3))
    assert said.startswith("cloth: points 448 × 448, pitch 7.5 µm × 7.5 µm, periodic yes")
    assert "yarn thickness 200 µm, irregularity 0.05, seed 0" in said
    assert "groove angle 30°" in described(texture("knurl"))


def test_a_kind_that_nobody_declared_is_said_as_it_is() -> None:
    found = described({"kind": "moon", "craters": 3, "cutoff": 1e-3, "heights": [1, 2, 3, 4, 5]})
    assert found == "moon: craters 3, cutoff 1 mm, 5 heights"
