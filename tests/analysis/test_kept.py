"""Certificates on disk: found again, made anew when anything changes, never a source of harm."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity
from asperity import cache
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.gain import kept as keeping
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.sources import used_modules
from asperity.analysis.gain.theorems import Theorem, register_theorem
from asperity.files import json_text, record
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import HeightMap, Sinusoid, Texture

HEIGHTS = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
BOUND = Bound(1.0, 2.0, "certified", (0.1, 0.2, -0.3), "a note", (1e-4, -1e-4), sliding=True)


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the certificates, empty."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    return tmp_path / keeping.ROOM


def texture(**changes: Any) -> HeightMap:
    return HeightMap(**{"heights": HEIGHTS, "pitch": 3e-4, **changes})


def surface(law: str | Law = "B", like: Texture | None = None, **options: Any) -> Surface:
    return Surface(like or texture(), law, **{"max_depth": 1e-4, **options})


class Maker:
    """Makes certificates and counts them."""

    def __init__(self, bound: Bound = BOUND) -> None:
        self.bound, self.made = bound, 0

    def __call__(self) -> Bound:
        self.made += 1
        return self.bound

    def asked(self, of: Surface, name: str = "norm", search: Search | None = None) -> Bound:
        return keeping.kept(of, name, search or Search(), self)


BOUNDS = [
    BOUND,
    Bound(math.inf, math.inf, "certified", (0.0, 0.0, -1.0), "onset"),
    Bound(1.0, math.inf, "sampled", None),
    Bound(0.1 + 0.2, 1.0 / 3.0 + 1.0, "closed form", (1e-300, -0.0, 5e-324)),
]


@pytest.mark.parametrize("bound", BOUNDS, ids=["state", "infinite", "unproved", "digits"])
def test_a_certificate_comes_back_as_it_was(kept: Path, bound: Bound) -> None:
    maker = Maker(bound)
    assert maker.asked(surface()) == bound
    assert maker.asked(surface()) == bound
    assert maker.made == 1
    assert len(list(kept.iterdir())) == 1


def test_a_certificate_is_that_of_the_content_not_of_the_object(kept: Path) -> None:
    maker = Maker()
    maker.asked(surface())
    # The numbers are those of J/k, and how a surface was prepared is only words.
    maker.asked(surface(like=texture(preparation=("as measured",)), stiffness=77.0))
    assert maker.made == 1
    assert len(list(kept.iterdir())) == 1


other = HEIGHTS.copy()
other[3, 4] *= 1.0 + 1e-14


def law(factor: float) -> Law:
    return Law("U", "own", "vertical", lambda c: factor * c.k * c.depth * c.normal)


CHANGES = {
    "one height by a few digits": lambda: surface(like=texture(heights=other)),
    "pitch": lambda: surface(like=texture(pitch=(3e-4, 3.1e-4))),
    "origin": lambda: surface(like=texture(origin=(1e-3, 0.0))),
    "periodic": lambda: surface(like=texture(periodic=True)),
    "depth": lambda: surface(max_depth=1.0000001e-4),
    "clamp": lambda: surface(clamp="whole"),
    "law": lambda: surface("C"),
    "law of one's own": lambda: surface(law(1.5)),
    "another law of the same name": lambda: surface(law(1.25)),
    "friction": lambda: surface("F", friction=0.5),
    "deflection": lambda: surface("F", max_deflection=2e-3),
    "modulation": lambda: surface("F", modulation_depth=0.5),
    "law F": lambda: surface("F"),
}


@pytest.mark.usefixtures("kept")
def test_whatever_changes_the_certificate_is_made_anew() -> None:
    maker = Maker()
    maker.asked(surface())
    for index, change in enumerate(CHANGES.values()):
        maker.asked(change())
        assert maker.made == index + 2
    for search in (Search(1e-4), Search(work_limit=10), Search(extent=(1.0, 1.0))):
        maker.asked(surface(), search=search)
    maker.asked(surface(), name="curl")
    assert maker.made == len(CHANGES) + 5
    for change in CHANGES.values():  # all of them are still there
        maker.asked(change())
    assert maker.made == len(CHANGES) + 5


@pytest.mark.usefixtures("kept")
def test_a_law_with_another_parameter_is_another() -> None:
    maker = Maker()
    for value in (1.0, 2.0):
        with_parameter = Law(
            "P", "own", "vertical", lambda c: c.parameter("a") * c.k * c.depth * c.e_z,
            parameters={"a": 1.0},
        )  # fmt: skip
        maker.asked(surface(with_parameter, law_parameters={"a": value}))
    assert maker.made == 2
    for continuity in (2.0, 3.0):
        maker.asked(surface("H", continuity=continuity), name="q")
    assert maker.made == 4


@pytest.mark.usefixtures("kept")
def test_another_version_of_the_package_makes_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    maker = Maker()
    maker.asked(surface())
    monkeypatch.setattr(keeping, "source_digest", lambda _roots: "another")
    maker.asked(surface())
    assert maker.made == 2


USED = ("enclosures/taylor.py", "textures/samplers/heightmap.py", "contacts/vertical.py",
        "kernels/contact_loop.py", "derive/facts.py", "analysis/gain/friction.py")  # fmt: skip
UNUSED = ("report/page.py", "analysis/words/comparison.py", "cli/compare.py", "paper/plane.py",
          "analysis/compare.py", "simulation/onset.py", "textures/library/knurl.py",
          "analysis/gain/characteristic.py", "devices/device.py")  # fmt: skip

_KEY = """
import numpy as np
from asperity.analysis.gain.kept import _key
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.sources import used_modules
from asperity.analysis.gain.theorems import Theorem, register_theorem
from asperity import HeightMap, Surface
heights = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
print(_key(Surface(HeightMap(heights, 3e-4), "B", max_depth=1e-4), "norm", Search()))
"""


def test_only_what_a_certificate_rests_on_voids_it(tmp_path: Path) -> None:
    """A copy of the package: rewording leaves the key as it is, another search does not."""
    package = tmp_path / "asperity"
    shutil.copytree(Path(asperity.__file__).parent, package,
                    ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip

    def key() -> str:
        done = subprocess.run(
            [sys.executable, "-c", _KEY], capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
        )  # fmt: skip
        return done.stdout.strip()

    before = key()
    assert len(before) == 32
    for name in UNUSED:
        with (package / name).open("a") as file:
            file.write("# reworded\n")
    assert key() == before
    assert all(used_by(name) for name in USED)
    with (package / "analysis/bounds/branch_and_bound.py").open("a") as file:
        file.write("# changed\n")
    assert key() != before


def used_by(name: str) -> bool:
    """Return whether a file is among those that the certificate of a map rests on."""
    module = "asperity." + name.removesuffix(".py").replace("/", ".")
    return module in used_modules(keeping._makers(surface()))


class Mine(HeightMap):
    """A kind of one's own: what its bounds follow from is not known."""


@pytest.mark.usefixtures("kept")
def test_where_code_of_one_s_own_has_a_part_nothing_is_kept() -> None:
    """It may read a number in another file, which then changes."""
    maker, own = Maker(), law(1.5)
    most = [7.0]
    for _ in range(2):
        maker.asked(surface(own))  # a formula is known whole
    assert maker.made == 1
    register_theorem(own, Theorem(norm_at_most=lambda _surface: most[0]))
    for asked in (surface(own), surface(like=Mine(HEIGHTS, 3e-4))):
        before = maker.made
        maker.asked(asked)
        maker.asked(asked)
        assert maker.made == before + 2


@pytest.mark.usefixtures("kept")
def test_a_law_of_one_s_own_need_not_be_proportional_to_the_stiffness() -> None:
    maker, own = Maker(), law(1.5)
    for stiffness in (1000.0, 77.0):
        maker.asked(surface(own, stiffness=stiffness))
    assert maker.made == 2


def test_small_textures_are_not_kept(kept: Path) -> None:
    maker = Maker()
    for _ in range(2):
        maker.asked(surface(like=Sinusoid(1e-4, 1e-3)))
    assert maker.made == 2
    assert not kept.exists()


TEXT = json_text(record(BOUND)).encode()
CORRUPT = {
    "empty": lambda _whole: b"",
    "cut short": lambda whole: whole[:-9],
    "another number": lambda whole: whole.replace(b"2.0", b"1.5"),
    "a certificate without a digest": lambda _whole: TEXT,
    "bytes that are no text": lambda _whole: b"\xff\xfe\x00{",
}


@pytest.mark.parametrize("damage", CORRUPT.values(), ids=list(CORRUPT))
def test_a_changed_certificate_is_made_anew(kept: Path, damage: Callable[[bytes], bytes]) -> None:
    maker = Maker()
    maker.asked(surface())
    (path,) = kept.iterdir()
    assert damage(path.read_bytes()) != path.read_bytes()
    path.write_bytes(damage(path.read_bytes()))
    cache._told.clear()
    with pytest.warns(cache.CacheWarning, match="damaged"):
        assert maker.asked(surface()) == BOUND
    assert maker.made == 2
    assert maker.asked(surface()) == BOUND  # and repaired
    assert maker.made == 2


@pytest.mark.filterwarnings("ignore::asperity.cache.CacheWarning")
def test_a_folder_that_cannot_be_written_is_harmless(kept: Path) -> None:
    kept.write_text("a file where the folder should be")
    maker = Maker()
    assert [maker.asked(surface()) for _ in range(2)] == [BOUND, BOUND]
    assert maker.made == 2


@pytest.mark.filterwarnings("ignore::asperity.cache.CacheWarning")
def test_a_full_disk_leaves_nothing_behind(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_arguments: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    assert Maker().asked(surface()) == BOUND
    assert list(kept.iterdir()) == []


def test_numbers_are_read_where_they_are_kept(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A certificate that was doctored under its digest comes back: nothing was computed again."""
    first = {name: number(surface()) for name, number in NUMBERS.items()}
    assert len(list(kept.iterdir())) == len(NUMBERS)
    read = keeping._read
    doctored = {bound: replace(bound, upper=bound.upper + 1.0) for bound in first.values()}
    monkeypatch.setattr(keeping, "_read", lambda content: doctored[read(content)])
    for name, number in NUMBERS.items():
        assert number(surface()) == doctored[first[name]]
        assert number(surface(max_depth=1.1e-4)).upper < first[name].upper + 0.9


NUMBERS = {"q": characteristic_number, "q+": one_sided_number}

_SECOND = """
import sys, numpy as np
from asperity import HeightMap, Surface, characteristic_number
from asperity.analysis.bounds import branch_and_bound
from asperity.analysis.gain import search
def refuse(*_arguments):
    raise SystemExit("computed again")
search.supremum = refuse
heights = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
print(repr(characteristic_number(Surface(HeightMap(heights, 3e-4), "B", max_depth=1e-4))))
"""


@pytest.mark.usefixtures("kept")
def test_another_process_reads_it(tmp_path: Path) -> None:
    bound = characteristic_number(surface())
    environment = {"ASPERITY_CACHE_DIR": str(tmp_path), "PYTHONPATH": ":".join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", _SECOND],
        capture_output=True, text=True, check=True, env=environment, timeout=120,
    )  # fmt: skip
    assert done.stdout.strip() == repr(bound)
    cache.clear()  # of certificates, and of answers that are kept whole
    again = subprocess.run(
        [sys.executable, "-c", _SECOND],
        capture_output=True, text=True, check=False, env=environment, timeout=120,
    )  # fmt: skip
    assert "computed again" in again.stderr
