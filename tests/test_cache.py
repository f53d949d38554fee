"""What is kept between runs is checked before it is used."""

from __future__ import annotations

import os
import pickle
import random
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from asperity import cache
from asperity.errors import ParameterError

ROOM, KEY, CONTENT = "room", "key of the entry", b"content" * 20


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setitem(cache._unseen, "left", 0)
    cache._told.clear()
    yield tmp_path / "cache"
    cache._told.clear()


def entry(folder: Path) -> Path:
    (found,) = [path for path in (folder / ROOM).iterdir() if path.suffix != ".damaged"]
    return found


def test_what_is_kept_is_found_by_its_key_alone():
    assert cache.recall(ROOM, KEY) is None
    cache.keep(ROOM, KEY, CONTENT)
    assert cache.recall(ROOM, KEY) == CONTENT
    assert cache.recall(ROOM, KEY + " ") is None
    assert cache.recall("another", KEY) is None


@pytest.mark.parametrize("seed", range(40))
def test_a_flipped_bit_or_a_cut_is_never_believed(folder: Path, seed: int):
    cache.keep(ROOM, KEY, CONTENT)
    draw, path = random.Random(seed), entry(folder)
    whole = bytearray(path.read_bytes())
    if seed % 4:
        whole[draw.randrange(len(whole))] ^= 1 << draw.randrange(8)
    else:
        del whole[draw.randrange(len(whole)) :]
    path.write_bytes(whole)
    with pytest.warns(cache.CacheWarning, match="damaged entries: they were set aside") as said:
        assert cache.recall(ROOM, KEY) is None
    assert str(folder) in str(said[0].message)
    assert cache.recall(ROOM, KEY) is None  # said once, and out of the way
    cache.keep(ROOM, KEY, CONTENT)
    assert cache.recall(ROOM, KEY) == CONTENT


def test_entries_that_change_places_are_not_believed(folder: Path):
    cache.keep(ROOM, KEY, CONTENT)
    first = entry(folder)
    cache.keep(ROOM, "another", b"other")
    (other,) = set((folder / ROOM).iterdir()) - {first}
    other.write_bytes(first.read_bytes())
    with pytest.warns(cache.CacheWarning, match="damaged"):
        assert cache.recall(ROOM, "another") is None


class _Planted:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("touch planted-code-ran",)


def test_a_planted_pickle_is_not_even_read(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder.parent)
    cache.keep(ROOM, KEY, CONTENT)
    entry(folder).write_bytes(pickle.dumps(_Planted()))
    with pytest.warns(cache.CacheWarning):
        assert cache.recall(ROOM, KEY) is None
    assert not (folder.parent / "planted-code-ran").exists()


@pytest.mark.parametrize(
    ("mode", "reason"), [(0o777, "everybody may write"), (0o1777, "everybody may write")]
)
def test_a_folder_that_everybody_may_write_is_refused(folder: Path, mode: int, reason: str):
    cache.keep(ROOM, KEY, CONTENT)
    folder.chmod(mode)
    with pytest.warns(cache.CacheWarning, match=reason):
        assert cache.recall(ROOM, KEY) is None
    folder.chmod(0o755)
    assert cache.recall(ROOM, KEY) == CONTENT


def test_nothing_is_made_in_a_folder_that_is_refused(folder: Path):
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.warns(cache.CacheWarning, match="everybody may write"):
        cache.keep(ROOM, KEY, CONTENT)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("uid", "gid", "mode", "reason"),
    [
        (4321, 4321, 0o755, "somebody else"),
        (4321, None, 0o775, "somebody else"),
        (4321, None, 0o2775, ""),  # made for a group that one is in
        (4321, 4321, 0o2775, "somebody else"),
        (None, 4321, 0o775, "another group"),
        (None, None, 0o775, ""),  # a group of one's own
        (0, 0, 0o755, ""),  # of the system
    ],
)
def test_who_may_have_put_code_there(
    uid: int | None, gid: int | None, mode: int, reason: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(os, "geteuid", lambda: 77)
    monkeypatch.setattr(os, "getegid", lambda: 88)
    monkeypatch.setattr(os, "getgroups", lambda: [88, 99])
    numbers = (stat.S_IFDIR | mode, 0, 0, 0, 77 if uid is None else uid, 88 if gid is None else gid)
    assert cache._why_not(os.stat_result((*numbers, 0, 0, 0, 0))).startswith(reason)
    assert bool(cache._why_not(os.stat_result((*numbers, 0, 0, 0, 0)))) == bool(reason)


def test_a_file_where_the_folder_should_be_costs_time_only(folder: Path):
    folder.write_text("not a folder")
    with pytest.warns(cache.CacheWarning, match="cannot be written"):
        cache.keep(ROOM, KEY, CONTENT)
    assert cache.recall(ROOM, KEY) is None
    assert folder.read_text() == "not a folder"


def test_a_file_where_a_room_should_be_costs_time_only(folder: Path):
    folder.mkdir()
    (folder / ROOM).write_text("not a folder")
    with pytest.warns(cache.CacheWarning, match="cannot be written"):
        cache.keep(ROOM, KEY, CONTENT)
    assert cache.recall(ROOM, KEY) is None


def test_a_pipe_in_place_of_an_entry_does_not_hang(folder: Path):
    cache.keep(ROOM, KEY, CONTENT)
    path = entry(folder)
    path.unlink()
    os.mkfifo(path)
    with pytest.warns(cache.CacheWarning, match="damaged"):
        assert cache.recall(ROOM, KEY) is None
    assert cache.recall(ROOM, KEY) is None


@pytest.mark.parametrize("mode", [0o700, 0o755, 0o2775])
def test_a_room_is_for_whom_the_folder_is(folder: Path, mode: int):
    folder.mkdir()
    folder.chmod(mode)
    cache.keep(ROOM, KEY, CONTENT)
    assert stat.S_IMODE((folder / ROOM).stat().st_mode) == mode
    assert cache.recall(ROOM, KEY) == CONTENT


def test_nobody_else_may_write_into_a_new_folder(folder: Path):
    before = os.umask(0)
    try:
        cache.keep(ROOM, KEY, CONTENT)
    finally:
        os.umask(before)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o755
    assert cache.recall(ROOM, KEY) == CONTENT


@pytest.mark.parametrize("trouble", ["loop", "device", "no permission"])
def test_a_folder_that_cannot_be_used_at_all_is_said_once(
    trouble: str, folder: Path, monkeypatch: pytest.MonkeyPatch
):
    if trouble == "loop":
        folder.symlink_to(folder)
    elif trouble == "device":
        monkeypatch.setenv("ASPERITY_CACHE_DIR", os.devnull)
    else:
        for name in ("open_input", "whole_file"):
            monkeypatch.setattr(cache, name, _refuse)  # root may open whatever it wants
        (folder / ROOM).mkdir(parents=True)
    with pytest.warns(cache.CacheWarning) as said:
        found = [(cache.recall(ROOM, key), cache.keep(ROOM, key, CONTENT)) for key in "ab"]
    assert found == [(None, None)] * 2
    assert len(said) == 1


def test_without_a_home_the_cache_is_among_the_temporary_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """As in a container that runs under a number without a name."""

    def nobody(_name: str) -> Path:
        raise RuntimeError("could not determine the home directory")

    monkeypatch.delenv("ASPERITY_CACHE_DIR")
    monkeypatch.setattr("platformdirs.user_cache_path", nobody)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    cache.keep(ROOM, KEY, CONTENT)
    assert cache.recall(ROOM, KEY) == CONTENT
    assert cache.cache_folder() == tmp_path / f"asperity-{os.getuid()}"


def _refuse(*_arguments: object, **_named: object) -> None:
    raise PermissionError(13, "Permission denied")


def test_a_read_only_folder_serves_what_it_has(monkeypatch: pytest.MonkeyPatch):
    cache.keep(ROOM, KEY, CONTENT)
    monkeypatch.setattr(cache, "whole_file", _refuse)  # root may write wherever it wants
    with pytest.warns(cache.CacheWarning, match="cannot be written .Permission denied"):
        cache.keep(ROOM, "another", CONTENT)
    assert cache.recall(ROOM, KEY) == CONTENT


def test_a_full_disk_costs_time_only(folder: Path, monkeypatch: pytest.MonkeyPatch):
    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    cache.keep(ROOM, KEY, CONTENT)
    monkeypatch.setattr(Path, "replace", full)
    with pytest.warns(cache.CacheWarning, match="No space left on device"):
        cache.keep(ROOM, "another", CONTENT)
    assert len(list((folder / ROOM).iterdir())) == 1


# --- its size -------------------------------------------------------------------------------------


def test_what_was_not_used_for_longest_goes_first(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "10kB")
    for number in range(8):
        cache.keep(ROOM, str(number), bytes(1000))
        for entry in cache.entries():  # a clock that every keeping moves by a second
            os.utime(entry.path, ns=(entry.used - 10**9, entry.used - 10**9))
    assert cache.recall(ROOM, "0") is not None  # used now
    for number in range(8, 12):
        cache.keep(ROOM, str(number), bytes(1000))
    assert sum(entry.size for entry in cache.entries()) <= 10_000
    there = {number for number in range(12) if cache.recall(ROOM, str(number)) is not None}
    assert {0, 11} <= there
    assert there.isdisjoint({1, 2})


def test_a_content_that_would_drive_out_all_others_is_not_kept(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "8kB")
    cache.keep(ROOM, "small", bytes(1000))
    cache.keep(ROOM, "large", bytes(1001))
    assert cache.recall(ROOM, "small") is not None
    assert cache.recall(ROOM, "large") is None


def test_a_size_of_nothing_keeps_nothing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "0")
    cache.keep(ROOM, KEY, CONTENT)
    assert cache.entries() == []


@pytest.mark.parametrize("given", ["5", "much", "-1GB", "4 furlongs", "1e9"])
def test_a_wrong_size_is_said(given: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", given)
    with pytest.raises(ParameterError, match="must be a size such as '500MB' or '4GB'"):
        cache.size_limit()


def test_only_entries_are_deleted(folder: Path):
    cache.keep(ROOM, KEY, CONTENT)
    theirs = [folder / "notes.txt", folder / ROOM / "notes.txt"]
    for path in theirs:
        path.write_text("mine")
    assert len(cache.entries()) == 1
    assert cache.clear() == []
    assert cache.recall(ROOM, KEY) is None
    assert all(path.exists() for path in theirs)


def test_without_the_cache_nothing_is_taken_or_left(folder: Path):
    cache.keep(ROOM, KEY, CONTENT)
    with cache.no_cache():
        assert cache.recall(ROOM, KEY) is None
        cache.keep(ROOM, KEY, b"other")
        elsewhere = cache.cache_folder()
        assert cache.recall(ROOM, KEY) == b"other"
    assert not elsewhere.exists()
    assert cache.cache_folder() == folder
    assert cache.recall(ROOM, KEY) == CONTENT


# --- whose turn it is -----------------------------------------------------------------------------

MAKER = """
import sys, time
from asperity import cache
cache.my_turn("room", "key of the entry")
cache.my_turn("room", "another")
print("mine", flush=True)
sys.stdin.readline()
cache.keep("room", "key of the entry", b"made by another")
cache.turn_is_over("room", "key of the entry")
sys.stdin.readline()
"""


@pytest.fixture
def maker() -> Iterator[subprocess.Popen[str]]:
    """A process that makes the entry, keeps it after a line, and ends after another."""
    with subprocess.Popen(
        [sys.executable, "-c", MAKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "mine\n"
        yield process
        process.kill()


def go_on(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def test_one_process_makes_an_entry_and_the_other_finds_it(maker: subprocess.Popen[str]):
    assert not cache.my_turn(ROOM, KEY + " of something else")
    later = threading.Timer(0.3, go_on, [maker])
    later.start()
    assert cache.my_turn(ROOM, KEY)
    assert cache.recall(ROOM, KEY) == b"made by another"
    assert not cache.my_turn(ROOM, KEY)  # of its own turn no process waits for the end
    later.join()


def test_the_turn_of_a_process_that_dies_is_over(maker: subprocess.Popen[str]):
    threading.Timer(0.3, maker.kill).start()
    assert cache.my_turn(ROOM, KEY)
    assert cache.recall(ROOM, KEY) is None


@pytest.mark.usefixtures("maker")
def test_who_hangs_is_not_waited_for_long(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cache, "PATIENCE", 0.2)
    assert not cache.my_turn(ROOM, KEY)
    monkeypatch.setattr(cache, "PATIENCE", 12.0)
    begin = time.monotonic()
    assert not cache.my_turn(ROOM, "another")  # nor for anything else that it may hold
    assert time.monotonic() - begin < 10.0


@pytest.mark.usefixtures("maker")
@pytest.mark.parametrize("size", ["", "0"])
def test_where_nothing_can_be_kept_nobody_waits(
    folder: Path, monkeypatch: pytest.MonkeyPatch, size: str
):
    """With a size of nothing, or where the file of turns cannot be."""
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", size)
    if not size:
        monkeypatch.setenv("ASPERITY_CACHE_DIR", str(folder / "elsewhere"))
        (folder / "elsewhere" / ROOM / ".turns").mkdir(parents=True)
    begin = time.monotonic()
    assert not cache.my_turn(ROOM, KEY)
    assert time.monotonic() - begin < 10.0
