"""Cached results equal computed ones; results of user-defined code are not cached."""

from __future__ import annotations

import random
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.analysis import characteristic_number, compare
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain import characteristic as answers
from asperity.core import cache, digests
from asperity.core.files import json_text
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture
from asperity.textures.texture_loading import prepare_file

pytestmark = pytest.mark.keeps_answers
Compute = Callable[[], Any]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty namespace of results; compiled code is shared with other tests."""
    monkeypatch.setattr(cache, "RESULTS_NAMESPACE", f"results-{tmp_path.name}")
    yield cache.cache_folder() / cache.RESULTS_NAMESPACE
    for entry in cache.list_entries():
        if entry.namespace == cache.RESULTS_NAMESPACE:
            entry.path.unlink()
    with suppress(FileNotFoundError):
        (cache.cache_folder() / cache.RESULTS_NAMESPACE).rmdir()


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Callable[[Compute], Any]:
    """Return a function that works an answer out without what is cache."""

    def compute(make: Compute) -> Any:
        with monkeypatch.context() as patch:
            patch.setattr(cache, "get_entry", lambda _namespace, _key: None)
            patch.setattr(cache, "put_entry", lambda _namespace, _key, _content: None)
            return make()

    return compute


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


def change(draw: random.Random, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments with two of them changed at random."""
    changed = {name: draw.choice(CHOICES[name]) for name in draw.sample(sorted(CHOICES), 2)}
    return arguments | changed


def compare_json(arguments: dict[str, Any]) -> str:
    given = dict(arguments)
    if "F" not in given["laws"]:
        given["law_parameters"] = {}
    return json_text(compare(given.pop("texture")(), **given))


@pytest.mark.parametrize("seed", range(4))
def test_a_cached_comparison_equals_a_computed_one(
    seed: int, fresh: Callable[[Compute], Any]
) -> None:
    draw = random.Random(seed)
    arguments = {name: choices[0] for name, choices in CHOICES.items()}
    for _ in range(6):
        arguments = change(draw, arguments)
        alone = fresh(lambda given=arguments: compare_json(given))
        assert compare_json(arguments) == alone  # with results of earlier comparisons
        assert compare_json(arguments) == alone  # with its own results


def test_another_device_or_stiffness_computes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    wave = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(wave, laws="AD")
    made = []
    monkeypatch.setattr(cache, "put_entry", lambda _namespace, key, _content: made.append(key))
    again = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(again, "touch", laws="AD", stiffness=321.0)
    assert made == []
    compare(again, laws="AD", max_depth=0.3e-3)
    assert made != []


# --- keys: negative controls ----------------------------------------------------------------------

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
def test_a_key_without_a_field_gives_wrong_results(
    field: int, fresh: Callable[[Compute], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    _name, before, after = FIELDS[field]
    right = fresh(lambda: numbers(after()))
    numbers(before())
    assert numbers(after()) == right
    whole = digests.content_digest

    def incomplete(*parts: Any) -> str:
        return whole(*parts[:field], "omitted", *parts[field + 1 :])

    monkeypatch.setattr(answers, "content_digest", incomplete)
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


def test_equal_textures_have_equal_digests() -> None:
    assert len({make().digest for make in CONTENTS}) == len(CONTENTS)
    for make in CONTENTS:
        assert make().digest == make().digest is not None
    assert HeightMap(HEIGHTS, 1e-3, preparation=("said",)).digest == CONTENTS[5]().digest


def test_results_of_user_defined_code_are_not_shared() -> None:
    class Mine(HeightMap):
        pass

    assert Mine(HEIGHTS, 1e-3).digest is None
    own = Law("U", "own", "vertical", lambda c: (c.k * c.depth + c.k**2 * c.depth) * c.e_z)
    nonlinear = Surface(WAVE, own, stiffness=2.0)  # not proportional to k
    assert merit(nonlinear).ripple == pytest.approx(3.0 * merit(Surface(WAVE, "A")).ripple)
    assert answers.at_unit_stiffness(nonlinear) is nonlinear
    stiffer = nonlinear.to_stiffness(3.0)
    assert answers.surface_content(nonlinear) != answers.surface_content(stiffer)


def test_every_shipped_law_is_proportional_to_the_stiffness() -> None:
    import sympy as sp

    from asperity.contacts.symbols import K
    from asperity.derive.jacobian import symbolic_force

    for law in LAWS.values():
        force = symbolic_force(law)
        assert sp.simplify(K * force.diff(K) - force) == sp.zeros(3, 1), law


# --- imports, versions and damaged entries -------------------------------------------------------

_HEAVY = """
import sys
from asperity.cli.main import cli
cli(["compare", "sinusoid:amplitude=0.31mm,period=1.1mm", "--laws", "AC"], standalone_mode=False)
heavy = {"numba", "llvmlite", "sympy", "matplotlib", "pint", "scipy.ndimage", "scipy.fft"}
print(sorted(heavy & set(sys.modules)), file=sys.stderr)
"""


def test_a_cached_comparison_imports_no_heavy_package() -> None:
    done = [
        subprocess.run([sys.executable, "-c", _HEAVY], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert done[0].stdout == done[1].stdout
    assert done[1].stderr.strip() == "[]"


def test_results_depend_on_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    made = iter("abcd")
    ask = lambda: cache.get_or_compute("letter", "content", lambda: next(made))  # noqa: E731 - called again
    assert (ask(), ask()) == ("a", "a")
    monkeypatch.setattr(cache, "package_digest", lambda: "another")
    assert (ask(), ask()) == ("b", "b")


@pytest.mark.parametrize("library", ["numpy", "scipy", "numba", "llvmlite"])
def test_results_depend_on_the_versions_of_libraries(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    digest = digests.package_digest.__wrapped__
    before, version = digest(), digests.version
    assert digest() == before
    if library in ("numpy", "scipy"):
        monkeypatch.setattr(f"{library}.__version__", "another")
    else:
        other = lambda name: "another" if name == library else version(name)  # noqa: E731
        monkeypatch.setattr(digests, "version", other)
    assert digest() != before


@pytest.mark.filterwarnings("ignore::asperity.core.cache.CacheWarning")
def test_an_incompatible_entry_is_computed_again() -> None:
    key = f"letter\ncontent\n{digests.package_digest()}"
    cache.put_entry(cache.RESULTS_NAMESPACE, key, b"no pickle")
    assert cache.get_or_compute("letter", "content", lambda: "made") == "made"
    assert cache.get_or_compute("letter", "content", lambda: "again") == "made"


def _full(*_arguments: Any, **_named: Any) -> None:
    raise OSError(28, "No space left on device")


def _read_only(*_arguments: Any, **_named: Any) -> None:
    raise PermissionError(13, "Permission denied")


def _flipped(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 16])


def _of_another_build(_content: bytes) -> Any:
    raise AttributeError("a class that this version does not have")


@pytest.mark.parametrize("trouble", ["full", "read-only", "damaged", "another version"])
def test_a_comparison_does_not_depend_on_problems_of_the_cache(
    trouble: str, folder: Path, fresh: Callable[[Compute], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All numbers are the same, and there is one warning for any number of entries."""
    ask = lambda: json_text(compare(WAVE, laws="WAD"))  # noqa: E731 - called again
    right = fresh(ask)
    if trouble in ("full", "read-only"):
        broken = _full if trouble == "full" else _read_only
        monkeypatch.setattr(cache, "open_atomic", broken)
    else:
        assert ask() == right
    entries = [path for path in folder.rglob("*") if path.is_file()]
    assert bool(entries) == (trouble in ("damaged", "another version"))
    if trouble == "damaged":
        for path in entries:
            path.write_bytes(_flipped(path.read_bytes()))
    elif trouble == "another version":
        monkeypatch.setattr(cache.pickle, "loads", _of_another_build)
    cache._warned.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert ask() == right
    notes = [str(one.message) for one in caught if one.category is cache.CacheWarning]
    assert len(notes) == 1, notes
    assert ("cannot be written" if trouble in ("full", "read-only") else "damaged") in notes[0]


def test_a_value_without_a_digest_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot compute a content digest"):
        digests.content_digest({"a": 1})


# --- measured surfaces ----------------------------------------------------------------------------


def test_a_file_is_prepared_again_only_after_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "land.npy"
    made = []
    put = cache.put_entry

    def counted(namespace: str, key: str, content: bytes) -> None:
        made.append(key)
        put(namespace, key, content)

    monkeypatch.setattr(cache, "put_entry", counted)
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


def test_a_report_draws_each_picture_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from asperity.report import html_text
    from asperity.report.pictures import plotting as plots

    drawn: list[str] = []

    def counted(name: str, draw: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda result: drawn.append(name) or draw(result)

    monkeypatch.setattr(plots, "COMPARISON_PICTURES", {
        name: counted(name, draw) for name, draw in plots.COMPARISON_PICTURES.items()
    })  # fmt: skip
    first = html_text(compare(WAVE, laws="WA"))
    assert sorted(drawn) == sorted(plots.COMPARISON_PICTURES)
    assert html_text(compare(WAVE, laws="WA")) == first
    assert len(drawn) == len(plots.COMPARISON_PICTURES)
    for changed in ({"laws": "WC"}, {"stiffness": 321.0}, {"device": "touch"}):
        html_text(compare(WAVE, **{"laws": "WA"} | changed))
    assert len(drawn) == 4 * len(plots.COMPARISON_PICTURES)
