"""Atomic writing, reading of regular files, and conversion of values to plain data."""

from __future__ import annotations

import json
import math
import os
import stat
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.core.files import (
    OMITTED,
    Serializable,
    attributes_to_dict,
    check_output,
    json_text,
    open_atomic,
    open_input,
    read_toml,
    to_plain_data,
    write_bytes,
    written,
    written_names,
)


class Side(StrEnum):
    LEFT = "left"


class Sign(Enum):
    LESS = -math.inf


@dataclass(frozen=True)
class Inner:
    reach: float
    at: tuple[float, float]


@dataclass(frozen=True)
class Outer(Serializable):
    name: str
    inner: Inner
    more: tuple[Inner, ...] = ()

    @property
    def size(self) -> int:
        return len(self.more)


@dataclass(frozen=True)
class Custom:
    def to_dict(self) -> dict[str, Any]:
        return {"said": "by itself"}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        (math.nan, None),
        (np.float64("inf"), "inf"),
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (True, True),
        (None, None),
        ("inf", "inf"),
        (np.array([[1.0, np.nan], [-np.inf, 2.0]]), [[1.0, None], ["-inf", 2.0]]),
        (np.array([], dtype=int), []),
        ((1, 2.0), [1, 2.0]),
        (Side.LEFT, "left"),
        (Sign.LESS, "-inf"),
        (MappingProxyType({3: np.inf}), {"3": "inf"}),
        (Custom(), {"said": "by itself"}),
        (Inner(math.inf, (0.0, 1.0)), {"reach": "inf", "at": [0.0, 1.0]}),
    ],
)
def test_values_are_converted_to_plain_data(value: object, expected: object) -> None:
    result = to_plain_data(value)
    assert result == expected
    assert type(result) is type(expected)
    json.dumps(result, allow_nan=False)


def test_infinity_may_be_converted_to_none() -> None:
    data = {"a": [math.inf, -math.inf], "b": Inner(math.inf, (math.nan, 1.0))}
    assert to_plain_data(data, infinity=None) == {
        "a": [None, None],
        "b": {"reach": None, "at": [None, 1.0]},
    }


@pytest.mark.parametrize("value", [object(), {1}, 1j])
def test_values_without_plain_data_are_refused(value: object) -> None:
    with pytest.raises(TypeError, match="no plain data"):
        to_plain_data(value)


def test_record_is_converted_by_its_fields_or_by_named_attributes() -> None:
    outer = Outer("o", Inner(1.0, (2.0, 3.0)), (Inner(math.inf, (0.0, 0.0)),))
    inner = {"reach": 1.0, "at": [2.0, 3.0]}
    result = outer.to_dict()
    assert list(result.items())[:2] == [("name", "o"), ("inner", inner)]
    assert result["more"] == [{"reach": "inf", "at": [0.0, 0.0]}]
    assert list(attributes_to_dict(outer, "size", "name").items()) == [("size", 1), ("name", "o")]


def test_omitted_fields_are_not_written_and_marked_properties_are() -> None:
    @dataclass(frozen=True)
    class Marked(Outer):
        more: tuple[Inner, ...] = field(default=(), metadata=OMITTED)

        @property
        @written
        def size(self) -> int:
            return 7

        @cached_property
        @written
        def double(self) -> int:
            return 2 * self.size

    assert written_names(Outer) == ("name", "inner", "more")
    data = Marked("o", Inner(1.0, (2.0, 3.0))).to_dict()
    assert data == {
        "name": "o", "inner": {"reach": 1.0, "at": [2.0, 3.0]}, "size": 7, "double": 14,
    }  # fmt: skip


def test_json_is_readable_and_strict() -> None:
    text = json_text({"Länge": np.inf, "n": [1]})
    assert text == '{\n  "Länge": "inf",\n  "n": [\n    1\n  ]\n}\n'


@pytest.mark.parametrize("exists", [False, True])
@pytest.mark.parametrize("error", [OSError("full"), KeyboardInterrupt(), MemoryError()])
def test_failed_write_leaves_the_old_file(
    tmp_path: Path, error: BaseException, exists: bool
) -> None:
    target = tmp_path / "a.txt"
    if exists:
        target.write_text("old")

    def write_half() -> None:
        with open_atomic(target, durable=True) as stream:
            stream.write(b"half")
            raise error

    with pytest.raises(type(error)):
        write_half()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"] * exists
    assert not exists or target.read_text() == "old"


def test_old_content_is_visible_until_all_is_written(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    write_bytes("path", target, b"old")
    with open_atomic(target) as stream:
        stream.write(b"new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def refuse_links(*_: object, **__: object) -> None:
    raise PermissionError


@pytest.mark.parametrize("has_links", [True, False])
def test_file_that_appeared_after_the_check_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_links: bool
) -> None:
    if not has_links:
        monkeypatch.delattr(os, "O_TMPFILE", raising=False)
        monkeypatch.setattr(os, "link", refuse_links)
    path = str(tmp_path / "a.txt")
    check_output("json", path, force=False)
    Path(path).write_text("of another process")
    for _ in range(2):
        with pytest.raises(ParameterError, match=f"^json exists: {path}; force=True replaces it$"):
            write_bytes("json", path, b"mine")
    assert [file.read_text() for file in tmp_path.iterdir()] == ["of another process"]
    check_output("json", path, force=True)
    write_bytes("json", path, b"mine")
    assert [file.read_text() for file in tmp_path.iterdir()] == ["mine"]
    for name in ("new", "newer"):
        check_output("json", str(tmp_path / name), force=False)
        write_bytes("json", tmp_path / name, b"first")
        write_bytes("json", tmp_path / name, b"second")  # its own file
        assert (tmp_path / name).read_text() == "second"
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.skipif(os.name != "posix", reason="the mode of a file is one of POSIX")
def test_written_file_has_the_default_mode(tmp_path: Path) -> None:
    write_bytes("path", tmp_path / "a.txt", b"text")
    (tmp_path / "b.txt").write_text("text")
    mode, expected = (stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a.txt", "b.txt"))
    assert mode == expected


def test_file_name_may_have_the_maximum_length(tmp_path: Path) -> None:
    """A temporary name with the file's name as its prefix would be too long."""
    target = tmp_path / ("a" * 255)
    write_bytes("path", target, b"text")
    assert target.read_text() == "text"


def test_link_is_written_through_and_stays(tmp_path: Path) -> None:
    link, real = tmp_path / "link", tmp_path / "real"
    link.symlink_to(real)
    write_bytes("path", link, b"text")
    assert link.is_symlink()
    assert real.read_text() == "text"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_bytes("path", pipe, b"text")
        assert os.read(reader, 100) == b"text"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


# --- reading --------------------------------------------------------------------------------------


def test_link_to_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    with open_input(tmp_path / "link") as stream:
        assert stream.read() == b"content"


@pytest.mark.parametrize("kind", ["pipe", "link to a pipe", "folder", "device"])
def test_input_that_is_not_a_regular_file_is_refused(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "input"
    if kind == "folder":
        path.mkdir()
    elif kind == "device":
        path = Path("/dev/zero")
    else:
        os.mkfifo(path)
    if kind == "link to a pipe":
        path = tmp_path / "link"
        path.symlink_to(tmp_path / "input")
    with pytest.raises(OSError, match="not a regular file"):
        open_input(path)


def test_error_for_a_too_large_file_has_both_sizes(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(bytes(101))
    with pytest.raises(OSError, match="101 bytes; at most 100 are read"):
        open_input(tmp_path / "file", max_bytes=100)
    with open_input(tmp_path / "file", max_bytes=101) as stream:
        assert len(stream.read()) == 101


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a = " + b"[" * 20000 + b"]" * 20000, "nested too deeply"),
        (b"a = " + b"9" * 5000, "not valid TOML"),
        (b"a = \xff", "not valid TOML"),
        (b"#" * (2**22 + 1), "at most 4194304 are read"),
    ],
    ids=["deep", "integer", "encoding", "size"],
)
def test_error_for_invalid_toml_names_the_file(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(ParameterError, match=f"scene file .*file.toml .*{words}"):
        read_toml("scene", path)


def test_file_has_no_name_while_it_is_written(tmp_path: Path) -> None:
    """A process that is killed while it writes then leaves no file."""
    with open_atomic(tmp_path / "target") as stream:
        stream.write(b"half")
        stream.flush()
        assert list(tmp_path.iterdir()) == []
        stream.write(b" and half")
    assert (tmp_path / "target").read_bytes() == b"half and half"
    assert len(list(tmp_path.iterdir())) == 1


def test_temporary_file_is_used_without_o_tmpfile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "O_TMPFILE", raising=False)
    with open_atomic(tmp_path / "target") as stream:
        assert len(list(tmp_path.iterdir())) == 1
        stream.write(b"content")
    assert [path.name for path in tmp_path.iterdir()] == ["target"]
