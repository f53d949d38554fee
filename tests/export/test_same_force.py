"""Exported C gives the force of the kernel bit by bit, for every law and texture kind."""

from __future__ import annotations

import platform
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import (
    as_exported,
    header,
    kernel_ticks,
    library,
    list_differing,
    probes,
    same_bits,
    ticks,
)

from asperity.laws import LAWS, Law
from asperity.laws.clamps import CLAMPS
from asperity.surface import Surface
from asperity.textures import HeightMap, Sinusoid, Texture
from asperity.textures.catalogue import as_texture

# Laws of each texture: a search is compared on the roughest map and on one with plateaus. Parts
# suffice: most of the time is the text of the coefficients, and its compilation.
PART = slice(60, 160)  # of the nodes along both axes; it contains a joint between tiles
LIBRARY = {
    "sandpaper:grit=P60": "BH",
    "tile:": "H",
    "cloth:": "B",
    "knurl:": "B",
    "wood:": "B",
    "brushed-metal:": "B",
}
# Laws that each compiler compiles: most of the code of E is the search of D.
COMPILED = {"gcc": "".join(LAWS), "clang": "".join(LAWS).replace("E", "")}
SAME_MACHINE = platform.machine() == "x86_64"


def _probe_count(law: Law) -> int:
    """Return the number of probes: fewer for laws with a long search."""
    return (
        20_000
        if not law.contact.requires_search
        else 2_000
        if law.contact.relative_cost < 1000
        else 400
    )


def _assert_equal_forces(folder: Path, surfaces: dict[str, Surface], *flags: str) -> None:
    surfaces = {name: as_exported(surface) for name, surface in surfaces.items()}
    headers = {name: header(s, name, folder=folder) for name, s in surfaces.items()}
    paths = {
        name: probes(surface.texture, surface.max_depth, _probe_count(surface.law), 11)
        for name, surface in surfaces.items()
    }
    kernel = {name: kernel_ticks(surface, paths[name]) for name, surface in surfaces.items()}
    for compiler, laws in COMPILED.items():
        names = [name for name in headers if surfaces[name].law.letter in laws]
        program = library(folder, compiler, {n: headers[n] for n in names}, *(flags or ("-O1",)))
        equal = [
            _equal_ticks(surfaces[n], paths[n], ticks(program, n, paths[n]), kernel[n])
            for n in names
        ]
        assert not list_differing(names, equal), compiler
    assert all(np.any(tick[:, :3] != 0.0) for tick in kernel.values())


def _equal_ticks(
    surface: Surface, points: np.ndarray, tick: np.ndarray, kernel: np.ndarray
) -> np.ndarray:
    if SAME_MACHINE:
        return same_bits(tick, kernel)
    h = surface.texture.height(np.ascontiguousarray(points[:, :2]))
    size = surface.stiffness * np.maximum(np.abs(h), np.abs(points[:, 2]))
    return np.abs(tick - kernel)[:, :3].max(axis=1) <= 2.0 * np.finfo(float).eps * size


def test_every_law_on_every_texture_kind(texture: Texture, tmp_path: Path) -> None:
    _assert_equal_forces(tmp_path, {f"t{x}": Surface(texture, x, clamp="backed") for x in LAWS})


@pytest.mark.parametrize("name", LIBRARY)
def test_library_textures(name: str, tmp_path: Path) -> None:
    texture = _part_of(as_texture(name))
    _assert_equal_forces(
        tmp_path, {f"t{x}": Surface(texture, x, max_depth=2e-4) for x in LIBRARY[name]}
    )


def _part_of(texture: Texture) -> HeightMap:
    """Return a part of a map, with the same pitch and roughness."""
    return HeightMap(texture.samples()[0][PART, PART], texture.describe()["pitch"])


def test_every_clamp(make_texture: Callable[[str], Texture], tmp_path: Path) -> None:
    texture = make_texture("map")
    surfaces = {
        f"{x}_{clamp}": Surface(texture, x, clamp=clamp) for x in "BCGF" for clamp in CLAMPS
    }
    _assert_equal_forces(tmp_path, surfaces)


@pytest.mark.parametrize("flags", [("-O3", "-march=native"), ("-O2", "-std=gnu99")])
def test_any_optimisation(
    make_texture: Callable[[str], Texture], tmp_path: Path, flags: tuple[str, ...]
) -> None:
    texture = make_texture("map")
    _assert_equal_forces(
        tmp_path, {f"t{x}": Surface(texture, x, clamp="backed") for x in "BDFH"}, *flags
    )


def test_flat_texture(tmp_path: Path) -> None:
    texture = HeightMap(np.zeros((4, 5)), 1e-3)
    _assert_equal_forces(tmp_path, {f"t{x}": Surface(texture, x, max_depth=1e-3) for x in "WDF"})


def test_changed_formula_is_detected(wave: Sinusoid, tmp_path: Path) -> None:
    surface = Surface(wave, "B")
    points = probes(wave, surface.max_depth, 400, 3)
    text = header(surface, "t")
    assert "1.0 + hx * hx" in text
    program = library(tmp_path, "gcc", {"t": text.replace("1.0 + hx * hx", "1.0 - hx * hx")})
    assert not same_bits(ticks(program, "t", points), kernel_ticks(surface, points)).all()
