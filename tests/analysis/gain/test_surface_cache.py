"""Cached numbers of a surface: keyed by content, recomputed after any change."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.surface_cache import surface_content
from asperity.core import cache
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import HeightMap, Sinusoid, Texture

pytestmark = pytest.mark.caches_results

HEIGHTS = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
OTHER_HEIGHTS = HEIGHTS.copy()
OTHER_HEIGHTS[3, 4] *= 1.0 + 1e-14


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty cache folder."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    return tmp_path


def texture(**changes: Any) -> HeightMap:
    return HeightMap(**{"heights": HEIGHTS, "pitch": 3e-4, **changes})


def surface(law: str | Law = "B", of: Texture | None = None, **options: Any) -> Surface:
    return Surface(of or texture(), law, **{"max_depth": 1e-4, **options})


def user_law(factor: float, contact: str = "vertical") -> Law:
    return Law("U", "own", contact, lambda c: factor * c.k * c.depth * c.normal)


def law_with_parameter() -> Law:
    return Law(
        "P",
        "own",
        "vertical",
        lambda c: c.parameter("a") * c.k * c.depth * c.e_z,
        parameters={"a": 1.0},
    )


CHANGES = {
    "one height by a few digits": lambda: surface(of=texture(heights=OTHER_HEIGHTS)),
    "pitch": lambda: surface(of=texture(pitch=(3e-4, 3.1e-4))),
    "origin": lambda: surface(of=texture(origin=(1e-3, 0.0))),
    "periodic": lambda: surface(of=texture(periodic=True)),
    "depth": lambda: surface(max_depth=1.0000001e-4),
    "clamp": lambda: surface(clamp="whole"),
    "law": lambda: surface("C"),
    "user-defined law": lambda: surface(user_law(1.5)),
    "another law of the same name": lambda: surface(user_law(1.25)),
    "the same formula on another contact": lambda: surface(user_law(1.5, "nominal")),
    "a parameter of a user-defined law": lambda: surface(
        law_with_parameter(), law_parameters={"a": 2.0}
    ),
    "its default": lambda: surface(law_with_parameter()),
    "friction": lambda: surface("F", friction=0.5),
    "deflection": lambda: surface("F", max_deflection=2e-3),
    "modulation": lambda: surface("F", modulation_depth=0.5),
    "law F": lambda: surface("F"),
    "continuity": lambda: surface("H", continuity=2.0),
    "law H": lambda: surface("H"),
}


def test_every_change_of_the_surface_changes_its_cache_content() -> None:
    contents = [surface_content(make()) for make in (surface, *CHANGES.values())]
    assert None not in contents
    assert len(set(contents)) == len(contents)


def test_equal_surfaces_have_equal_cache_content() -> None:
    """The stiffness of a law is a factor, and the preparation of a texture is only text."""
    same = surface(of=texture(preparation=("as measured",)), stiffness=77.0)
    assert surface_content(same) == surface_content(surface())
    own = surface(user_law(1.5))
    assert surface_content(own) == surface_content(surface(user_law(1.5), stiffness=77.0))


class UserMap(HeightMap):
    """A user-defined texture, whose bounds depend on unknown code."""


def test_results_of_user_defined_textures_are_not_cached() -> None:
    """User code may read values from files that change."""
    assert surface_content(surface(user_law(1.5))) is not None
    assert surface_content(surface(of=UserMap(HEIGHTS, 3e-4))) is None


def entries(folder: Path) -> Iterator[Path]:
    return (path for path in folder.glob(f"{cache.RESULTS_NAMESPACE}/*") if path.suffix == "")


def test_each_number_is_stored_once(folder: Path) -> None:
    before = {path.name for path in folder.iterdir()} if folder.exists() else set()
    for number in (characteristic_number, one_sided_number):
        number(surface())
        number(surface(stiffness=77.0))
    names = {entry.namespace for entry in cache.list_entries()} - before
    assert "certificates" not in names
    bounds = [path for path in entries(folder) if b"bounds.bound" in path.read_bytes()]
    assert len(bounds) == 2
    characteristic_number(surface(), tolerance=1e-4)
    characteristic_number(surface(), work_limit=1000)
    bounds = [path for path in entries(folder) if b"bounds.bound" in path.read_bytes()]
    assert len(bounds) == 4


def test_theorems_and_closed_forms_are_not_cached(folder: Path) -> None:
    for law in "WACE":
        characteristic_number(Surface(Sinusoid(1e-4, 1e-3), law))
    assert list(entries(folder)) == []


_SECOND_PROCESS = """
import sys, numpy as np
from asperity import HeightMap, Surface, characteristic_number
from asperity.analysis.gain import medial_axis
def refuse(*_arguments):
    raise SystemExit("computed again")
medial_axis.supremum = refuse
heights = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
print(repr(characteristic_number(Surface(HeightMap(heights, 3e-4), "B", max_depth=1e-4))))
"""


def test_cached_number_is_read_by_another_process(folder: Path) -> None:
    bound = characteristic_number(surface())
    environment = {"ASPERITY_CACHE_DIR": str(folder), "PYTHONPATH": ":".join(sys.path)}
    command = [sys.executable, "-c", _SECOND_PROCESS]

    def run() -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, capture_output=True, text=True, check=False, env=environment, timeout=120
        )

    assert run().stdout.strip() == repr(bound)
    cache.clear()
    assert "computed again" in run().stderr
