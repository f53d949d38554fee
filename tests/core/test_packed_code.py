"""Machine code of the package is used on the target that it is for, and nowhere else."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from asperity.core import cache, packed_code
from asperity.core.packed_code import INTERPRETER, CodeTarget, PackedCode, find_packed_code

PACKED = CodeTarget("0.68.1", "0.50.0", "x86_64-linux", "x86-64-v3", "+avx,+avx2,-sse4a")
HOST = PACKED._replace(processor="znver3", features="+aes,+avx,+avx2,-avx512f,+sse4a")
KEY, CONTENT = "key of the entry", b"machine code"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the folder of the machine code, with one entry for ``PACKED``."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(packed_code, "FOLDER", tmp_path / "package")
    cache.put_entry(packed_code.CODE_NAMESPACE, KEY, CONTENT)
    assert packed_code.store_packed_code(packed_code.FOLDER, PACKED) == 1
    cache._warned.clear()
    find_packed_code.cache_clear()
    yield packed_code.FOLDER
    find_packed_code.cache_clear()
    cache._warned.clear()


def description(folder: Path) -> Path:
    return folder / INTERPRETER / "description.json"


def test_entry_is_found_on_a_processor_that_has_more(recwarn: pytest.WarningsRecorder) -> None:
    packed = find_packed_code(HOST)
    assert packed == PackedCode(PACKED)
    assert packed.get_entry(KEY) == CONTENT
    assert packed.get_entry("another key") is None
    packed.warn("another key")  # a function of a user's law is compiled without a word
    assert not recwarn.list


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"features": "+aes,-avx2,+avx"}, "for processors of x86-64-v3, this one lacks avx2"),
        ({"features": ""}, "lacks avx, avx2"),
        ({"numba": "0.68.2"}, "for Numba 0.68.1"),
        ({"llvmlite": "0.51.0"}, "llvmlite 0.50.0"),
        ({"system": "x86_64-darwin"}, "and x86_64-linux"),
    ],
)
def test_nothing_is_read_on_another_target(change: dict[str, str], problem: str) -> None:
    packed = find_packed_code(HOST._replace(**change))
    assert packed.target is None
    assert packed.get_entry(KEY) is None
    with pytest.warns(cache.CacheWarning, match=f"package is .*{problem}.*: it is compiled"):
        packed.warn(KEY)
    packed.warn(KEY)  # once per process


def test_another_python_compiles(folder: Path) -> None:
    (folder / INTERPRETER).rename(folder / "cpython-310")
    with pytest.warns(cache.CacheWarning, match=f"not for this Python, {INTERPRETER}"):
        find_packed_code(HOST).warn(KEY)


def test_package_without_machine_code_compiles_silently(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packed_code, "FOLDER", folder / "absent")
    packed = find_packed_code(HOST)
    packed.warn(KEY)
    assert packed == PackedCode(None)


def test_code_for_a_package_is_compiled_whatever_the_package_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NUMBA_CPU_NAME", PACKED.processor)
    assert find_packed_code(HOST) == PackedCode(None)


@pytest.mark.parametrize("position", [0, 20, 40, 55, -1])
def test_damaged_entry_is_compiled(folder: Path, position: int) -> None:
    (path,) = (folder / INTERPRETER).glob("[!d]*")
    data = bytearray(path.read_bytes())
    data[position] ^= 1
    path.write_bytes(data)
    packed = find_packed_code(HOST)
    assert packed.get_entry(KEY) is None
    with pytest.warns(cache.CacheWarning, match="damaged"):
        packed.warn(KEY)


@pytest.mark.parametrize("text", ["", "[1]", "{}", '{"numba": 1}', "\xff", None])
def test_damaged_description_is_reported(folder: Path, text: str | None) -> None:
    wrong: dict[str, Any] = {**PACKED._asdict(), "features": 7}
    description(folder).write_bytes((text or json.dumps(wrong)).encode("latin-1"))
    with pytest.warns(cache.CacheWarning, match="damaged"):
        find_packed_code(HOST).warn(KEY)
