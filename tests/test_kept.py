"""Answers that are kept: the same as fresh ones; what code of one's own does is not kept."""

from __future__ import annotations

import random
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity import cache, kept
from asperity.analysis import characteristic_number, compare
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain import answers
from asperity.files import json_text
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture
from asperity.textures.loading import prepare_file

pytestmark = pytest.mark.keeps_answers
Kept = Callable[[], Any]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty room of answers; compiled code is shared with other tests."""
    monkeypatch.setattr(kept, "ROOM", f"answers-{tmp_path.name}")
    yield cache.cache_folder() / kept.ROOM
    for entry in cache.entries():
        if entry.room == kept.ROOM:
            entry.path.unlink()
    room = cache.cache_folder() / kept.ROOM
    if room.exists():
        room.rmdir()


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Callable[[Kept], Any]:
    """Return a function that works an answer out without what is kept."""

    def work_out(make: Kept) -> Any:
        with monkeypatch.context() as patch:
            patch.setattr(kept, "recall", lambda _room, _key: None)
            patch.setattr(kept, "keep", lambda _room, _key, _content: None)
            return make()

    return work_out


# --- a comparison ---------------------------------------------------------------------------------

ROUGH = 1e-4 * np.random.default_rng(7).normal(size=9)
CHOICES: dict[str, list[Any]] = {
    "texture": [
        lambda: Sinusoid(0.31e-3, 1.1e-3, phase=0.4),
        lambda: Sinusoid(0.31e-3, 1.1e-3, phase=0.5),
        lambda: Profile(ROUGH, 3e-4),
        lambda: Profile(ROUGH * (1.0 + 1e-9), 3e-4),
        lambda: Profile(ROUGH, 3e-4, origin=1e-4),
    ],
    "laws": ["WA", "AD", "DF", "F"],
    "device": ["omega.3", "touch", "pantograph"],
    "max_depth": [None, 0.21e-3, 0.22e-3],
    "stiffness": [None, 333.3, 1000.1],
    "clamp": ["none", "whole"],
    "law_parameters": [{}, {"friction": 0.3}, {"friction": 0.31}],
    "speed": [None, 0.05],
}


def asked(draw: random.Random, before: dict[str, Any]) -> dict[str, Any]:
    """Return the question with two things changed at random."""
    changed = {name: draw.choice(CHOICES[name]) for name in draw.sample(sorted(CHOICES), 2)}
    return before | changed


def answer(question: dict[str, Any]) -> str:
    given = dict(question)
    if "F" not in given["laws"]:
        given["law_parameters"] = {}
    return json_text(compare(given.pop("texture")(), **given))


@pytest.mark.parametrize("seed", range(4))
def test_a_kept_comparison_is_the_fresh_one(seed: int, fresh: Callable[[Kept], Any]) -> None:
    draw = random.Random(seed)
    question = {name: choices[0] for name, choices in CHOICES.items()}
    for _ in range(6):
        question = asked(draw, question)
        alone = fresh(lambda given=question: answer(given))
        assert answer(question) == alone  # from what other questions have kept
        assert answer(question) == alone  # from what it has kept itself


def test_a_device_or_a_stiffness_asks_for_nothing_new(monkeypatch: pytest.MonkeyPatch) -> None:
    wave = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(wave, laws="AD")
    made = []
    monkeypatch.setattr(kept, "keep", lambda _room, key, _content: made.append(key))
    again = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(again, "touch", laws="AD", stiffness=321.0)
    assert made == []
    compare(again, laws="AD", max_depth=0.3e-3)
    assert made != []


# --- the key: negative controls -------------------------------------------------------------------

WAVE = Sinusoid(0.31e-3, 1.1e-3)
FIELDS: dict[int, tuple[str, Callable[[], Surface], Callable[[], Surface]]] = {
    0: ("texture", lambda: Surface(WAVE, "A", max_depth=2e-4),
        lambda: Surface(Sinusoid(0.32e-3, 1.1e-3), "A", max_depth=2e-4)),
    1: ("law", lambda: Surface(WAVE, "A"), lambda: Surface(WAVE, "D")),
    2: ("depth", lambda: Surface(WAVE, "A", max_depth=2e-4),
        lambda: Surface(WAVE, "A", max_depth=2.1e-4)),
    3: ("clamp", lambda: Surface(WAVE, "A"), lambda: Surface(WAVE, "A", clamp="whole")),
    4: ("parameters", lambda: Surface(WAVE, "F"), lambda: Surface(WAVE, "F", friction=0.5)),
}  # fmt: skip


def numbers(surface: Surface) -> str:
    return json_text([characteristic_number(surface), merit(surface), worst_loop(surface)])


@pytest.mark.parametrize("field", FIELDS)
def test_a_key_that_forgets_a_field_is_noticed(
    field: int, fresh: Callable[[Kept], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    _name, before, after = FIELDS[field]
    right = fresh(lambda: numbers(after()))
    numbers(before())
    assert numbers(after()) == right
    whole = kept.content_digest

    def forgetful(*parts: Any) -> str:
        return whole(*parts[:field], "forgotten", *parts[field + 1 :])

    monkeypatch.setattr(answers, "content_digest", forgetful)
    numbers(before())
    assert numbers(after()) != right


HEIGHTS = np.random.default_rng(3).normal(size=(5, 6))
CONTENTS: list[Callable[[], Texture]] = [
    lambda: Sinusoid(1e-4, 1e-3),
    lambda: Sinusoid(1e-4, 1e-3, 0.1),
    lambda: Sinusoid(1e-4, 1e-3, 0.1, (1.0, 1.0)),
    lambda: Fourier([1e-4], [6283.0]),
    lambda: Fourier([1e-4], [6283.0], [0.1]),
    lambda: HeightMap(HEIGHTS, 1e-3),
    lambda: HeightMap(HEIGHTS.T, 1e-3),
    lambda: HeightMap(np.where(HEIGHTS[2, 3] == HEIGHTS, HEIGHTS + 1e-16, HEIGHTS), 1e-3),
    lambda: HeightMap(HEIGHTS, (1e-3, 2e-3)),
    lambda: HeightMap(HEIGHTS, 1e-3, periodic=True),
    lambda: HeightMap(HEIGHTS, 1e-3, origin=(0.0, 1.0)),
    lambda: Profile(HEIGHTS[0], 1e-3),
]


def test_textures_have_the_same_content_where_they_are_the_same() -> None:
    assert len({make().content for make in CONTENTS}) == len(CONTENTS)
    for make in CONTENTS:
        assert make().content == make().content is not None
    assert HeightMap(HEIGHTS, 1e-3, preparation=("said",)).content == CONTENTS[5]().content


def test_of_code_of_one_s_own_nothing_is_kept(folder: Path) -> None:
    class Mine(HeightMap):
        pass

    assert Mine(HEIGHTS, 1e-3).content is None
    own = Law("U", "own", "vertical", lambda c: (c.k * c.depth + c.k**2 * c.depth) * c.e_z)
    bent = Surface(WAVE, own, stiffness=2.0)  # not proportional to k
    assert merit(bent).ripple == pytest.approx(3.0 * merit(Surface(WAVE, "A")).ripple)
    assert answers.at_unit_stiffness(bent) is bent
    said = {entry.path for entry in cache.entries() if entry.path.parent == folder}
    merit(bent)
    assert {entry.path for entry in cache.entries() if entry.path.parent == folder} == said


def test_every_shipped_law_is_proportional_to_the_stiffness() -> None:
    import sympy as sp

    from asperity.contacts.symbols import K
    from asperity.derive.jacobian import symbolic_force

    for law in LAWS.values():
        force = symbolic_force(law)
        assert sp.simplify(K * force.diff(K) - force) == sp.zeros(3, 1), law


# --- what a kept answer imports, another package --------------------------------------------------

_HEAVY = """
import sys
from asperity.cli.main import cli
cli(["compare", "sinusoid:amplitude=0.31mm,period=1.1mm", "--laws", "AC"], standalone_mode=False)
heavy = {"numba", "llvmlite", "sympy", "matplotlib", "pint", "scipy.ndimage", "scipy.fft"}
print(sorted(heavy & set(sys.modules)), file=sys.stderr)
"""


def test_a_kept_comparison_imports_nothing_heavy() -> None:
    said = [
        subprocess.run([sys.executable, "-c", _HEAVY], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert said[0].stdout == said[1].stdout
    assert said[1].stderr.strip() == "[]"


def test_another_package_keeps_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    made = iter("abcd")
    ask = lambda: kept.kept("letter", "content", lambda: next(made))  # noqa: E731 - asked again
    assert (ask(), ask()) == ("a", "a")
    monkeypatch.setattr(kept, "package_digest", lambda: "another")
    assert (ask(), ask()) == ("b", "b")
    monkeypatch.setattr(kept, "package_digest", lambda: None)  # not known
    assert (ask(), ask()) == ("c", "d")


@pytest.mark.parametrize("library", ["numpy", "scipy", "numba", "llvmlite"])
def test_another_version_of_a_library_has_its_own_answers(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    digest = kept.package_digest.__wrapped__
    before, version = digest(), kept.version
    assert digest() == before
    if library in ("numpy", "scipy"):
        monkeypatch.setattr(f"{library}.__version__", "another")
    else:
        other = lambda name: "another" if name == library else version(name)  # noqa: E731
        monkeypatch.setattr(kept, "version", other)
    assert digest() != before


@pytest.mark.filterwarnings("ignore::asperity.cache.CacheWarning")
def test_an_entry_that_cannot_be_read_is_made_again() -> None:
    key = f"letter\ncontent\n{kept.package_digest()}"
    cache.keep(kept.ROOM, key, b"no pickle")
    assert kept.kept("letter", "content", lambda: "made") == "made"
    assert kept.kept("letter", "content", lambda: "again") == "made"


def _full(*_arguments: Any, **_named: Any) -> None:
    raise OSError(28, "No space left on device")


def _read_only(*_arguments: Any, **_named: Any) -> None:
    raise PermissionError(13, "Permission denied")


def _flipped(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 16])


def _of_another_build(_content: bytes) -> Any:
    raise AttributeError("a class that this version does not have")


@pytest.mark.parametrize("trouble", ["full", "read-only", "damaged", "another version"])
def test_a_comparison_is_the_same_whatever_ails_its_cache(
    trouble: str, folder: Path, fresh: Callable[[Kept], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every number of every row comes all the same, and one note, however many entries it is."""
    ask = lambda: json_text(compare(WAVE, laws="WAD"))  # noqa: E731 - asked again
    right = fresh(ask)
    if trouble in ("full", "read-only"):
        broken = _full if trouble == "full" else _read_only
        monkeypatch.setattr(cache, "whole_file", broken)
    else:
        assert ask() == right
    entries = [path for path in folder.rglob("*") if path.is_file()]
    assert bool(entries) == (trouble in ("damaged", "another version"))
    if trouble == "damaged":
        for path in entries:
            path.write_bytes(_flipped(path.read_bytes()))
    elif trouble == "another version":
        monkeypatch.setattr(kept.pickle, "loads", _of_another_build)
    cache._told.clear()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert ask() == right
    notes = [str(one.message) for one in said if one.category is cache.CacheWarning]
    assert len(notes) == 1, notes
    assert ("cannot be written" if trouble in ("full", "read-only") else "damaged") in notes[0]


def test_what_has_no_content_is_refused() -> None:
    with pytest.raises(TypeError, match="not known by its content"):
        kept.content_digest({"a": 1})


# --- measured surfaces ----------------------------------------------------------------------------


def test_a_file_is_prepared_once_until_it_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "land.npy"
    made = []
    keep = cache.keep

    def counted(room: str, key: str, content: bytes) -> None:
        made.append(key)
        keep(room, key, content)

    monkeypatch.setattr(kept, "keep", counted)
    np.save(file, 1e-5 * HEIGHTS.repeat(4, 0).repeat(4, 1))
    first = prepare_file(file, pitch=1e-4)
    again = prepare_file(file, pitch=1e-4)
    assert len(made) == 1
    assert np.array_equal(first.heights, again.heights)
    assert (first.steps, first.history, first.pitch) == (again.steps, again.history, again.pitch)
    for count, changed in enumerate([{"magnify": 2.0}, {"cutoff": 9e-4}, {"pitch": [1e-4, 2e-4]}]):
        prepare_file(file, **{"pitch": 1e-4} | changed)
        assert len(made) == 2 + count
    np.save(file, 2e-5 * HEIGHTS.repeat(4, 0).repeat(4, 1))
    assert np.ptp(prepare_file(file, pitch=1e-4).heights) > 1.5 * np.ptp(first.heights)
    assert len(made) == 5


# --- pictures -------------------------------------------------------------------------------------


def test_a_report_draws_no_picture_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    from asperity.report.comparison import comparison_page
    from asperity.report.pictures import plots

    drawn: list[str] = []

    def counted(name: str, draw: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda result: drawn.append(name) or draw(result)

    monkeypatch.setattr(plots, "PICTURES", {
        name: counted(name, draw) for name, draw in plots.PICTURES.items()
    })  # fmt: skip
    first = comparison_page(compare(WAVE, laws="WA"))
    assert sorted(drawn) == sorted(plots.PICTURES)
    assert comparison_page(compare(WAVE, laws="WA")).sections == first.sections
    assert len(drawn) == len(plots.PICTURES)
    for changed in ({"laws": "WC"}, {"stiffness": 321.0}, {"device": "touch"}):
        comparison_page(compare(WAVE, **{"laws": "WA"} | changed))
    assert len(drawn) == 4 * len(plots.PICTURES)
