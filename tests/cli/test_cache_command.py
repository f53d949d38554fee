"""``asperity cache``, ``--no-cache``, and damaged cache folders."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from asperity.core import cache

Call = Callable[..., tuple[int, str, str]]
DEMO = ("compare", "sinusoid:amplitude=0.31mm,period=1.1mm", "--laws", "W")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "500MB")
    cache._warned.clear()
    return tmp_path / "cache"


def test_command_lists_and_deletes_entries(call: Call, folder: Path) -> None:
    cache.put_entry("results", "a", bytes(10**6))
    cache.put_entry("older", "b", b"")
    code, out, err = call("cache", width=200)
    assert (code, err) == (0, "")
    first, *namespaces = out.splitlines()
    assert first == f"{folder}: 1.0 MB of at most 500.0 MB"
    assert [line.split()[:3] for line in namespaces] == [
        ["code", "0", "0.0"],
        ["older", "1", "0.0"],
        ["results", "1", "1.0"],
    ]
    code, out, err = call("cache", "--clear")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "Deleted: 2 entries"
    assert cache.list_entries() == []


def test_json_has_the_entries_of_each_namespace(call: Call, folder: Path) -> None:
    cache.put_entry("results", "a", b"content")
    code, out, _err = call("cache", "--json", "-")
    result = json.loads(out)
    assert (code, result["folder"], result["limit"]) == (0, str(folder), 500_000_000)
    assert {namespace["name"]: namespace["entries"] for namespace in result["rooms"]} == {
        "code": 0,
        "results": 1,
    }


def test_invalid_size_limit_is_a_usage_error(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "much")
    code, out, err = call(*DEMO)
    assert (code, out) == (2, "")
    assert "ASPERITY_CACHE_SIZE must be a size such as '4GB', '500MB' or '2GiB', got 'much'" in err


@pytest.mark.caches_results
def test_no_cache_gives_the_same_output_and_leaves_entries_unused(call: Call, folder: Path) -> None:
    code, out, _err = call(*DEMO)
    entries = {entry.path: entry.last_used for entry in cache.list_entries()}
    assert (code, any(path.parent.name == "results" for path in entries)) == (0, True)
    assert call(*DEMO, "--no-cache") == (0, out, "")
    assert {entry.path: entry.last_used for entry in cache.list_entries()} == entries
    assert cache.cache_folder() == folder


@pytest.mark.caches_results
@pytest.mark.filterwarnings("default::asperity.core.cache.CacheWarning")
def test_damaged_entries_are_recomputed_with_one_warning(call: Call) -> None:
    _code, out, _err = call(*DEMO)
    for entry in cache.list_entries():
        if entry.namespace == "results":
            entry.path.write_bytes(entry.path.read_bytes()[:-1])
    code, recomputed, err = call(*DEMO)
    assert (code, recomputed) == (0, out)
    assert err.count("damaged entries") == 1
    assert call(*DEMO) == (0, out, "")


@pytest.mark.caches_results
@pytest.mark.filterwarnings("default::asperity.core.cache.CacheWarning")
def test_cache_path_that_is_a_file_gives_one_warning(call: Call, folder: Path) -> None:
    folder.write_text("no folder")
    code, out, err = call(*DEMO)
    assert (code, out != "") == (0, True)
    assert err.count("cannot be written") == 1
