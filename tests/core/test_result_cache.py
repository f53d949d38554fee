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
from uuid import uuid4

import numpy as np
import pytest

from asperity.analysis import characteristic_number
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.straight_scan import merit
from asperity.analysis.gain import surface_cache
from asperity.analysis.results.compare import compare
from asperity.core import cache, files
from asperity.core.files import json_text
from asperity.laws import LAWS, Law
from asperity.measured.reading.measured_file import prepare_file
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

pytestmark = pytest.mark.caches_results
Compute = Callable[[], Any]


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Use an empty namespace of results; compiled code is shared with other tests."""
    monkeypatch.setattr(cache, "RESULTS_NAMESPACE", f"results-{uuid4().hex}")
    yield cache.cache_folder() / cache.RESULTS_NAMESPACE
    for entry in cache.list_entries():
        if entry.namespace == cache.RESULTS_NAMESPACE:
            entry.path.unlink()
    with suppress(FileNotFoundError):
        (cache.cache_folder() / cache.RESULTS_NAMESPACE).rmdir()


@pytest.fixture
def without_cache(monkeypatch: pytest.MonkeyPatch) -> Callable[[Compute], Any]:
    """Return a function that computes a result without the cache."""

    def compute(make: Compute) -> Any:
        with monkeypatch.context() as patch:
            patch.setattr(cache, "get_entry", lambda _namespace, _key: None)
            patch.setattr(cache, "put_entry", lambda _namespace, _key, _content: None)
            return make()

    return compute


# --- comparisons ----------------------------------------------------------------------------------

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


def change_two(draw: random.Random, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments with two of them changed at random."""
    changed = {name: draw.choice(CHOICES[name]) for name in draw.sample(sorted(CHOICES), 2)}
    return arguments | changed


def compare_json(arguments: dict[str, Any]) -> str:
    keywords = dict(arguments)
    if "F" not in keywords["laws"]:
        keywords["law_parameters"] = {}
    return json_text(compare(keywords.pop("texture")(), **keywords))


@pytest.mark.parametrize("seed", range(4))
def test_cached_comparison_equals_a_computed_one(
    seed: int, without_cache: Callable[[Compute], Any]
) -> None:
    draw = random.Random(seed)
    arguments = {name: choices[0] for name, choices in CHOICES.items()}
    for _ in range(6):
        arguments = change_two(draw, arguments)
        expected = without_cache(lambda current=arguments: compare_json(current))
        assert compare_json(arguments) == expected  # with results of earlier comparisons
        assert compare_json(arguments) == expected  # with its own results


def test_another_device_or_stiffness_uses_cached_results(monkeypatch: pytest.MonkeyPatch) -> None:
    wave = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(wave, laws="AD", stiffness=1000.0)
    stored = []
    monkeypatch.setattr(cache, "put_entry", lambda _namespace, key, _content: stored.append(key))
    equal_wave = Sinusoid(0.31e-3, 1.1e-3, phase=0.4)
    compare(equal_wave, "touch", laws="AD", stiffness=321.0)
    assert stored == []
    compare(equal_wave, laws="AD", max_depth=0.3e-3)
    assert stored != []


# --- keys: negative controls ----------------------------------------------------------------------

WAVE = Sinusoid(0.31e-3, 1.1e-3)
FIELDS: dict[int, tuple[str, Callable[[], Surface], Callable[[], Surface]]] = {
    0: (
        "texture",
        lambda: Surface(WAVE, "A", max_depth=2e-4),
        lambda: Surface(Sinusoid(0.32e-3, 1.1e-3), "A", max_depth=2e-4),
    ),
    1: ("law", lambda: Surface(WAVE, "A"), lambda: Surface(WAVE, "D")),
    2: (
        "depth",
        lambda: Surface(WAVE, "A", max_depth=2e-4),
        lambda: Surface(WAVE, "A", max_depth=2.1e-4),
    ),
    3: ("clamp", lambda: Surface(WAVE, "A"), lambda: Surface(WAVE, "A", clamp="whole")),
    4: ("parameters", lambda: Surface(WAVE, "F"), lambda: Surface(WAVE, "F", friction=0.5)),
}


def numbers(surface: Surface) -> str:
    return json_text([characteristic_number(surface), merit(surface), worst_loop(surface)])


@pytest.mark.parametrize("field", FIELDS)
def test_key_without_a_field_gives_wrong_results(
    field: int, without_cache: Callable[[Compute], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    _name, before, after = FIELDS[field]
    expected = without_cache(lambda: numbers(after()))
    numbers(before())
    assert numbers(after()) == expected
    content_digest = files.content_digest

    def incomplete(*parts: Any) -> str:
        return content_digest(*parts[:field], "omitted", *parts[field + 1 :])

    monkeypatch.setattr(surface_cache, "content_digest", incomplete)
    numbers(before())
    assert numbers(after()) != expected


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


def test_textures_have_equal_digests_exactly_when_they_are_equal() -> None:
    assert len({make().digest for make in CONTENTS}) == len(CONTENTS)
    for make in CONTENTS:
        assert make().digest == make().digest is not None
    assert HeightMap(HEIGHTS, 1e-3, preparation=("said",)).digest == CONTENTS[5]().digest


def test_results_of_user_defined_textures_and_laws_are_not_shared() -> None:
    class Mine(HeightMap):
        pass

    assert Mine(HEIGHTS, 1e-3).digest is None
    law = Law("U", "own", "vertical", lambda c: 3 * c.k * c.depth * c.e_z)
    own = Surface(WAVE, law, stiffness=2.0)
    assert merit(own).ripple == pytest.approx(3.0 * merit(Surface(WAVE, "A")).ripple)
    stiffer = own.to_stiffness(3.0)
    assert surface_cache.surface_content(own) == surface_cache.surface_content(stiffer)
    other = Surface(WAVE, Law("U", "own", "vertical", lambda c: 2 * c.k * c.depth * c.e_z))
    assert surface_cache.surface_content(own) != surface_cache.surface_content(other)


def test_every_shipped_law_is_proportional_to_the_stiffness() -> None:
    import sympy as sp

    from asperity.contacts.symbols import K
    from asperity.derive.derivatives import symbolic_force

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


def test_cached_comparison_imports_no_heavy_package() -> None:
    processes = [
        subprocess.run([sys.executable, "-c", _HEAVY], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert processes[0].stdout == processes[1].stdout
    assert processes[1].stderr.strip() == "[]"


def test_cached_results_depend_on_the_package_source(monkeypatch: pytest.MonkeyPatch) -> None:
    letters = iter("abcd")
    request = lambda: cache.get_or_compute("letter", "content", lambda: next(letters))  # noqa: E731 - called again
    assert (request(), request()) == ("a", "a")
    monkeypatch.setattr(cache, "package_digest", lambda: "another")
    assert (request(), request()) == ("b", "b")


@pytest.mark.parametrize("library", ["numpy", "scipy", "numba", "llvmlite"])
def test_package_digest_depends_on_library_versions(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    digest = files.package_digest.__wrapped__
    before, version = digest(), files.version
    assert digest() == before
    if library in ("numpy", "scipy"):
        monkeypatch.setattr(f"{library}.__version__", "another")
    else:
        other = lambda name: "another" if name == library else version(name)  # noqa: E731 - one use
        monkeypatch.setattr(files, "version", other)
    assert digest() != before


@pytest.mark.filterwarnings("ignore::asperity.core.cache.CacheWarning")
def test_incompatible_entry_is_recomputed() -> None:
    key = f"letter\ncontent\n{files.package_digest()}"
    cache.put_entry(cache.RESULTS_NAMESPACE, key, b"no pickle")
    assert cache.get_or_compute("letter", "content", lambda: "made") == "made"
    assert cache.get_or_compute("letter", "content", lambda: "again") == "made"


def _raise_no_space(*_arguments: Any, **_named: Any) -> None:
    raise OSError(28, "No space left on device")


def _raise_no_permission(*_arguments: Any, **_named: Any) -> None:
    raise PermissionError(13, "Permission denied")


def _flip_bit(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 16])


def _raise_missing_class(_content: bytes) -> Any:
    raise AttributeError("a class that this version does not have")


@pytest.mark.parametrize("trouble", ["full", "read-only", "damaged", "another version"])
def test_comparison_does_not_depend_on_problems_of_the_cache(
    trouble: str,
    folder: Path,
    without_cache: Callable[[Compute], Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All numbers are the same, with one warning for any number of entries."""
    request = lambda: json_text(compare(WAVE, laws="WAD"))  # noqa: E731 - called again
    expected = without_cache(request)
    if trouble in ("full", "read-only"):
        broken = _raise_no_space if trouble == "full" else _raise_no_permission
        monkeypatch.setattr(cache, "open_atomic", broken)
    else:
        assert request() == expected
    entries = [path for path in folder.rglob("*") if path.is_file()]
    assert bool(entries) == (trouble in ("damaged", "another version"))
    if trouble == "damaged":
        for path in entries:
            path.write_bytes(_flip_bit(path.read_bytes()))
    elif trouble == "another version":
        monkeypatch.setattr(cache.pickle, "loads", _raise_missing_class)
    cache._warned.clear()
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        assert request() == expected
    messages = [str(item.message) for item in record if item.category is cache.CacheWarning]
    assert len(messages) == 1, messages
    assert ("cannot be written" if trouble in ("full", "read-only") else "damaged") in messages[0]


def test_value_without_a_digest_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot compute a content digest"):
        files.content_digest({"a": 1})


# --- measured surfaces ----------------------------------------------------------------------------


def test_file_is_prepared_again_only_after_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "land.npy"
    stored = []
    put_entry = cache.put_entry

    def record_put(namespace: str, key: str, content: bytes) -> None:
        stored.append(key)
        put_entry(namespace, key, content)

    monkeypatch.setattr(cache, "put_entry", record_put)
    np.save(file, 1e-5 * HEIGHTS.repeat(4, 0).repeat(4, 1))
    first = prepare_file(file, pitch=1e-4)
    second = prepare_file(file, pitch=1e-4)
    assert len(stored) == 1
    assert np.array_equal(first.heights, second.heights)
    assert (first.steps, first.history, first.pitch) == (second.steps, second.history, second.pitch)
    changes = [{"magnify": 2.0}, {"s_cutoff": 9e-4}, {"pitch": [1e-4, 2e-4]}]
    for count, changed in enumerate(changes):
        prepare_file(file, **{"pitch": 1e-4} | changed)
        assert len(stored) == 2 + count
    np.save(file, 2e-5 * HEIGHTS.repeat(4, 0).repeat(4, 1))
    assert np.ptp(prepare_file(file, pitch=1e-4).heights) > 1.5 * np.ptp(first.heights)
    assert len(stored) == 5


# --- pictures -------------------------------------------------------------------------------------


def test_report_draws_each_picture_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from asperity.report import html_text
    from asperity.report.pictures import plotting as plots
    from asperity.report.pictures import style

    drawn: list[str] = []

    def record_draw(name: str) -> Callable[[Any], Any]:
        return lambda _result: drawn.append(name) or style.new_figure(1.0, 1.0)

    monkeypatch.setattr(
        plots,
        "COMPARISON_PICTURES",
        {name: record_draw(name) for name in plots.COMPARISON_PICTURES},
    )
    first = html_text(compare(WAVE, laws="WA"))
    assert sorted(drawn) == sorted(plots.COMPARISON_PICTURES)
    assert html_text(compare(WAVE, laws="WA")) == first
    assert len(drawn) == len(plots.COMPARISON_PICTURES)
    for changed in ({"laws": "WC"}, {"stiffness": 321.0}, {"device": "touch"}):
        html_text(compare(WAVE, **{"laws": "WA"} | changed))
    assert len(drawn) == 4 * len(plots.COMPARISON_PICTURES)
