"""Entries of the cache: integrity checks, trusted folders, size limit and locks."""

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

from asperity.core import cache
from asperity.core.errors import ParameterError

NAMESPACE, KEY, CONTENT = "namespace", "key of the entry", b"content" * 20


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setitem(cache._unchecked_bytes, "left", 0)
    cache._warned.clear()
    cache._unresponsive.clear()
    yield tmp_path / "cache"
    cache._warned.clear()


def entry_path(folder: Path) -> Path:
    (path,) = [item for item in (folder / NAMESPACE).iterdir() if item.suffix != ".damaged"]
    return path


def test_get_returns_the_entry_of_the_key():
    assert cache.get_entry(NAMESPACE, KEY) is None
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT
    assert cache.get_entry(NAMESPACE, KEY + " ") is None
    assert cache.get_entry("another", KEY) is None


@pytest.mark.parametrize("seed", range(40))
def test_damaged_entry_is_moved_aside_with_one_warning(folder: Path, seed: int):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    draw, path = random.Random(seed), entry_path(folder)
    content = bytearray(path.read_bytes())
    if seed % 4:
        content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    else:
        del content[draw.randrange(len(content)) :]
    path.write_bytes(content)
    with pytest.warns(cache.CacheWarning, match="damaged entries: they were moved aside") as record:
        assert cache.get_entry(NAMESPACE, KEY) is None
    assert str(folder) in str(record[0].message)
    assert cache.get_entry(NAMESPACE, KEY) is None  # reported once, and moved aside
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


def test_entry_of_another_key_is_not_used(folder: Path):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    first = entry_path(folder)
    cache.put_entry(NAMESPACE, "another", b"other")
    (other,) = set((folder / NAMESPACE).iterdir()) - {first}
    other.write_bytes(first.read_bytes())
    with pytest.warns(cache.CacheWarning, match="damaged"):
        assert cache.get_entry(NAMESPACE, "another") is None


class _MaliciousPickle:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("touch planted-code-ran",)


def test_foreign_pickle_is_not_loaded(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder.parent)
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    entry_path(folder).write_bytes(pickle.dumps(_MaliciousPickle()))
    with pytest.warns(cache.CacheWarning):
        assert cache.get_entry(NAMESPACE, KEY) is None
    assert not (folder.parent / "planted-code-ran").exists()


@pytest.mark.parametrize(
    ("mode", "reason"),
    [(0o777, "others may write"), (0o1777, "others may write"), (0o775, "others may write")],
)
def test_folder_that_others_may_write_is_not_used(folder: Path, mode: int, reason: str):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    folder.chmod(mode)
    with pytest.warns(cache.CacheWarning, match=reason):
        assert cache.get_entry(NAMESPACE, KEY) is None
    folder.chmod(0o755)
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


def test_nothing_is_written_to_an_untrusted_folder(folder: Path):
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.warns(cache.CacheWarning, match="others may write"):
        cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("uid", "gid", "mode", "reason"),
    [
        (4321, 4321, 0o755, "somebody else"),
        (4321, None, 0o775, "somebody else"),
        (4321, None, 0o2775, "somebody else"),
        (None, 4321, 0o775, "others"),
        (None, None, 0o775, "others"),  # its group may have other members
        (None, None, 0o755, ""),
        (0, 0, 0o755, ""),  # owned by root
    ],
)
def test_trust_depends_on_owner_group_and_mode(
    uid: int | None, gid: int | None, mode: int, reason: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(os, "geteuid", lambda: 77)
    monkeypatch.setattr(os, "getegid", lambda: 88)
    monkeypatch.setattr(os, "getgroups", lambda: [88, 99])
    numbers = (stat.S_IFDIR | mode, 0, 0, 0, 77 if uid is None else uid, 88 if gid is None else gid)
    assert cache._distrust_reason(os.stat_result((*numbers, 0, 0, 0, 0))).startswith(reason)
    assert bool(cache._distrust_reason(os.stat_result((*numbers, 0, 0, 0, 0)))) == bool(reason)


def test_entry_that_others_may_write_is_not_used(folder: Path):
    before = os.umask(0o002)
    try:
        cache.put_entry(NAMESPACE, KEY, CONTENT)
    finally:
        os.umask(before)
    assert stat.S_IMODE(entry_path(folder).stat().st_mode) == 0o644
    entry_path(folder).chmod(0o664)
    with pytest.warns(cache.CacheWarning, match="others may write"):
        assert cache.get_entry(NAMESPACE, KEY) is None
    cache.put_entry(NAMESPACE, KEY, CONTENT)  # computed again
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


def test_cache_path_that_is_a_file_gives_a_warning(folder: Path):
    folder.write_text("not a folder")
    with pytest.warns(cache.CacheWarning, match="cannot be written"):
        cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) is None
    assert folder.read_text() == "not a folder"


def test_namespace_path_that_is_a_file_gives_a_warning(folder: Path):
    folder.mkdir()
    (folder / NAMESPACE).write_text("not a folder")
    with pytest.warns(cache.CacheWarning, match="cannot be written"):
        cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) is None


def test_pipe_in_place_of_an_entry_does_not_block(folder: Path):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    path = entry_path(folder)
    path.unlink()
    os.mkfifo(path)
    with pytest.warns(cache.CacheWarning, match="damaged"):
        assert cache.get_entry(NAMESPACE, KEY) is None
    assert cache.get_entry(NAMESPACE, KEY) is None


@pytest.mark.parametrize("mode", [0o700, 0o755])
def test_namespace_has_the_mode_of_the_cache_folder(folder: Path, mode: int):
    folder.mkdir()
    folder.chmod(mode)
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert stat.S_IMODE((folder / NAMESPACE).stat().st_mode) == mode
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


def test_new_folder_is_writable_only_by_its_owner(folder: Path):
    before = os.umask(0)
    try:
        cache.put_entry(NAMESPACE, KEY, CONTENT)
    finally:
        os.umask(before)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o755
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


@pytest.mark.parametrize("trouble", ["loop", "device", "no permission"])
def test_unusable_folder_is_reported_once(
    trouble: str, folder: Path, monkeypatch: pytest.MonkeyPatch
):
    if trouble == "loop":
        folder.symlink_to(folder)
    elif trouble == "device":
        monkeypatch.setenv("ASPERITY_CACHE_DIR", os.devnull)
    else:
        for name in ("open_input", "open_atomic"):
            monkeypatch.setattr(cache, name, _refuse)  # root may open any file
        (folder / NAMESPACE).mkdir(parents=True)
    with pytest.warns(cache.CacheWarning) as record:
        results = [
            (cache.get_entry(NAMESPACE, key), cache.put_entry(NAMESPACE, key, CONTENT))
            for key in "ab"
        ]
    assert results == [(None, None)] * 2
    assert len(record) == 1


def test_cache_without_a_home_directory_is_a_temporary_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """A container may run as a user id without a name."""

    def raise_no_home(_name: str) -> Path:
        raise RuntimeError("could not determine the home directory")

    monkeypatch.delenv("ASPERITY_CACHE_DIR")
    monkeypatch.setattr("platformdirs.user_cache_path", raise_no_home)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT
    assert cache.cache_folder() == tmp_path / f"asperity-{os.getuid()}"


def _refuse(*_arguments: object, **_named: object) -> None:
    raise PermissionError(13, "Permission denied")


def test_read_only_folder_can_be_read(monkeypatch: pytest.MonkeyPatch):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    monkeypatch.setattr(cache, "open_atomic", _refuse)  # root may write to any folder
    with pytest.warns(cache.CacheWarning, match="cannot be written .Permission denied"):
        cache.put_entry(NAMESPACE, "another", CONTENT)
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


def test_full_disk_gives_a_warning(folder: Path, monkeypatch: pytest.MonkeyPatch):
    def raise_no_space(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    cache.put_entry(NAMESPACE, KEY, CONTENT)
    monkeypatch.setattr(Path, "replace", raise_no_space)
    with pytest.warns(cache.CacheWarning, match="No space left on device"):
        cache.put_entry(NAMESPACE, "another", CONTENT)
    assert len(list((folder / NAMESPACE).iterdir())) == 1


# --- size limit -----------------------------------------------------------------------------------


def test_least_recently_used_entries_are_evicted(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "10kB")
    for number in range(8):
        cache.put_entry(NAMESPACE, str(number), bytes(1000))
        for entry_path in cache.list_entries():  # each put advances the clock by a second
            os.utime(
                entry_path.path, ns=(entry_path.last_used - 10**9, entry_path.last_used - 10**9)
            )
    assert cache.get_entry(NAMESPACE, "0") is not None  # used now
    for number in range(8, 12):
        cache.put_entry(NAMESPACE, str(number), bytes(1000))
    assert sum(entry_path.size for entry_path in cache.list_entries()) <= 10_000
    stored = {number for number in range(12) if cache.get_entry(NAMESPACE, str(number)) is not None}
    assert {0, 11} <= stored
    assert stored.isdisjoint({1, 2})


def test_content_above_an_eighth_of_the_limit_is_not_stored(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "8kB")
    cache.put_entry(NAMESPACE, "small", bytes(1000))
    cache.put_entry(NAMESPACE, "large", bytes(1001))
    assert cache.get_entry(NAMESPACE, "small") is not None
    assert cache.get_entry(NAMESPACE, "large") is None


def test_size_limit_of_zero_stores_nothing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", "0")
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    assert cache.list_entries() == []


@pytest.mark.parametrize("limit", ["5", "much", "-1GB", "4 furlongs", "1e9"])
def test_invalid_size_limit_is_refused(limit: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", limit)
    with pytest.raises(ParameterError, match=r"must be a size such as '4GB'|needs a unit"):
        cache.size_limit()


def test_clear_deletes_only_entries(folder: Path):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    other_files = [folder / "notes.txt", folder / NAMESPACE / "notes.txt"]
    for path in other_files:
        path.write_text("mine")
    assert len(cache.list_entries()) == 1
    assert cache.clear() == []
    assert cache.get_entry(NAMESPACE, KEY) is None
    assert all(path.exists() for path in other_files)


def test_bypass_neither_reads_nor_writes_the_cache(folder: Path):
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    with cache.bypass():
        assert cache.get_entry(NAMESPACE, KEY) is None
        cache.put_entry(NAMESPACE, KEY, b"other")
        elsewhere = cache.cache_folder()
        assert cache.get_entry(NAMESPACE, KEY) == b"other"
    assert not elsewhere.exists()
    assert cache.cache_folder() == folder
    assert cache.get_entry(NAMESPACE, KEY) == CONTENT


# --- locks ----------------------------------------------------------------------------------------

HOLDER = """
import sys, time
from asperity.core import cache
cache.wait_and_lock("namespace", "key of the entry")
cache.wait_and_lock("namespace", "another")
print("locked", flush=True)
sys.stdin.readline()
cache.put_entry("namespace", "key of the entry", b"made by another")
cache.unlock("namespace", "key of the entry")
sys.stdin.readline()
"""


@pytest.fixture
def holder() -> Iterator[subprocess.Popen[str]]:
    """Start a process that locks the entry, stores it after a first line, ends after a second."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "locked\n"
        yield process
        process.kill()


def send_line(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def test_process_waits_for_an_entry_that_another_computes(holder: subprocess.Popen[str]):
    assert not cache.wait_and_lock(NAMESPACE, KEY + " of something else")
    timer = threading.Timer(0.3, send_line, [holder])
    timer.start()
    assert cache.wait_and_lock(NAMESPACE, KEY)
    assert cache.get_entry(NAMESPACE, KEY) == b"made by another"
    assert not cache.wait_and_lock(NAMESPACE, KEY)  # this process holds the lock
    timer.join()


def test_lock_of_a_killed_process_is_released(holder: subprocess.Popen[str]):
    threading.Timer(0.3, holder.kill).start()
    assert cache.wait_and_lock(NAMESPACE, KEY)
    assert cache.get_entry(NAMESPACE, KEY) is None


@pytest.mark.usefixtures("holder")
def test_wait_for_a_lock_has_a_timeout(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cache, "LOCK_TIMEOUT", 0.2)
    assert not cache.wait_and_lock(NAMESPACE, KEY)
    monkeypatch.setattr(cache, "LOCK_TIMEOUT", 12.0)
    start = time.monotonic()
    assert not cache.wait_and_lock(NAMESPACE, "another")  # no wait for another lock of that process
    assert time.monotonic() - start < 10.0


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("size", ["", "0"])
def test_nothing_is_locked_without_a_usable_cache(
    folder: Path, monkeypatch: pytest.MonkeyPatch, size: str
):
    """The size limit is zero, or the lock file cannot be created."""
    monkeypatch.setenv("ASPERITY_CACHE_SIZE", size)
    if not size:
        monkeypatch.setenv("ASPERITY_CACHE_DIR", str(folder / "elsewhere"))
        cache._entry_path(NAMESPACE, KEY).with_suffix(".lock").mkdir(parents=True)
    start = time.monotonic()
    assert not cache.wait_and_lock(NAMESPACE, KEY)
    assert time.monotonic() - start < 10.0


def test_entries_are_listed_while_folders_appear_and_vanish(folder: Path) -> None:
    """As when another process clears the cache: about a third of the lists meet such a folder."""
    cache.put_entry(NAMESPACE, KEY, CONTENT)
    over = threading.Event()

    def change_folders() -> None:
        while not over.is_set():
            for number in range(20):
                (folder / f"vanishing{number}").mkdir()
                (folder / f"vanishing{number}").rmdir()

    thread = threading.Thread(target=change_folders)
    thread.start()
    try:
        for _ in range(300):
            assert [entry.namespace for entry in cache.list_entries()] == [NAMESPACE]
    finally:
        over.set()
        thread.join()
