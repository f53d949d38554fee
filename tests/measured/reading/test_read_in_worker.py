"""Readers in a subprocess: results and errors are returned, and resource limits hold."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stress.fuzz_child import ReadingWorker

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, ReadingOptions, SurfaceFile, isolation

pytestmark = pytest.mark.starts_readers

READERS = '''
"""Readers as third-party libraries may be."""

import ctypes
import os
import time
from pathlib import Path

import numpy as np

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface

HEIGHTS = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])


def sound(file, options):
    print("a library prints")
    notes = (options.unit, f"{options.channel}", file.head.decode())
    return RawSurface(HEIGHTS, (1e-6, 2e-6), file.name, notes, has_units=False, relative=True)


def nothing(file, options):
    return None


def refusing(file, options):
    raise SurfaceFileError(f"{file.name}: no surface")


def asking(file, options):
    raise ParameterError("channel", "must be given", 3)


def gone(file, options):
    file.path.unlink()
    return file.content


def looping(file, options):
    Path(file.path.with_name("pid")).write_text(str(os.getpid()))
    while True:
        pass


def waiting(file, options):
    time.sleep(4)
    return RawSurface(HEIGHTS, None, file.name, ())


def sleeping(file, options):
    time.sleep(1000)


def hungry(file, options):
    held = []
    while True:
        held.append(np.ones(2**20))


def crashing(file, options):
    ctypes.string_at(0)


def faulty(file, options):
    return {}["nothing"]
'''


@pytest.fixture(scope="module")
def readers(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "hostile_readers.py").write_text(READERS)
    sys.path.insert(0, str(folder))
    try:
        import hostile_readers

        yield hostile_readers
    finally:
        sys.path.remove(str(folder))
        sys.modules.pop("hostile_readers", None)


@pytest.fixture
def file(tmp_path: Path) -> SurfaceFile:
    path = tmp_path / "ä file.dat"
    path.write_bytes(b"head")
    return SurfaceFile(path, b"head")


def test_result_is_returned_unchanged(readers: Any, file: SurfaceFile) -> None:
    raw = isolation.read_isolated(
        readers.sound, file, ReadingOptions(unit="mm", channel=np.int64(2))
    )  # NumPy integers are accepted
    assert isinstance(raw, RawSurface)
    np.testing.assert_array_equal(raw.heights, readers.HEIGHTS)
    assert (raw.pitch, raw.source) == ((1e-6, 2e-6), file.name)
    assert raw.notes == ("mm", "2", "head")
    assert (raw.has_units, raw.relative) == (False, True)
    assert isolation.read_isolated(readers.nothing, file, ReadingOptions()) is None


def test_errors_are_raised_unchanged(readers: Any, file: SurfaceFile) -> None:
    with pytest.raises(SurfaceFileError, match=r"^ä file\.dat: no surface$"):
        isolation.read_isolated(readers.refusing, file, ReadingOptions())
    with pytest.raises(ParameterError, match=r"^channel must be given, got 3$") as caught:
        isolation.read_isolated(readers.asking, file, ReadingOptions())
    assert caught.value.argument == "channel"
    with pytest.raises(SurfaceFileError, match=r"ä file\.dat ends its reader with code 1"):
        isolation.read_isolated(readers.faulty, file, ReadingOptions())
    with pytest.raises(OSError, match="No such file"):
        isolation.read_isolated(readers.gone, file, ReadingOptions())


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("looping", r"^ä file\.dat takes more than 3 s to be read.*save the heights in another"),
        ("sleeping", r"^ä file\.dat takes more than 3 s to be read"),
        ("hungry", r"^ä file\.dat takes more than 0\.3 GB to be read.*MEMORY_LIMIT of asperity\."),
        ("crashing", r"^ä file\.dat ends its reader with signal SIGSEGV: damaged"),
    ],
)
def test_misbehaving_reader_is_stopped(
    readers: Any, file: SurfaceFile, monkeypatch: pytest.MonkeyPatch, name: str, match: str
) -> None:
    monkeypatch.setattr(isolation, "TIME_LIMIT", 3.0 if name in {"looping", "sleeping"} else 20.0)
    monkeypatch.setattr(isolation, "MEMORY_LIMIT", 3 * 10**8)
    # The processor-time limit ends a loop, the wall-clock limit ends a sleep.
    monkeypatch.setattr(isolation, "_WALL_CLOCK_FACTOR", 100 if name == "looping" else 1)
    with pytest.raises(SurfaceFileError, match=match):
        isolation.read_isolated(getattr(readers, name), file, ReadingOptions())


def test_reading_worker_applies_the_limits_to_each_file(
    readers: Any, file: SurfaceFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reading worker of the long fuzz run forks for each file."""
    monkeypatch.setattr(isolation, "TIME_LIMIT", 2.0)
    monkeypatch.setattr(isolation, "MEMORY_LIMIT", 3 * 10**8)
    with ReadingWorker() as reading:
        monkeypatch.setattr(isolation, "run_subprocess", reading.start)
        for name, match in (("looping", "2 s"), ("hungry", r"0\.3 GB")):
            with pytest.raises(SurfaceFileError, match=match):
                isolation.read_isolated(getattr(readers, name), file, ReadingOptions())
            assert isolation.read_isolated(readers.nothing, file, ReadingOptions()) is None


def test_time_limit_counts_processor_time(
    readers: Any, file: SurfaceFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy machine, 3 s of processor time may take much longer."""
    monkeypatch.setattr(isolation, "TIME_LIMIT", 3.0)
    raw = isolation.read_isolated(readers.waiting, file, ReadingOptions())
    assert raw.heights.size == 6
    monkeypatch.setattr(isolation, "_WALL_CLOCK_FACTOR", 1)  # the negative control
    with pytest.raises(SurfaceFileError, match="takes more than 3 s"):
        isolation.read_isolated(readers.waiting, file, ReadingOptions())


def wait_until(condition: Callable[[], bool]) -> bool:
    end = time.monotonic() + 20.0
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def is_running(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


@pytest.mark.usefixtures("readers")
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_subprocess_ends_with_its_parent(file: SurfaceFile, end: signal.Signals) -> None:
    program = (
        f"import sys, pathlib; sys.path[:] = {sys.path!r}; import hostile_readers as r;"
        "from asperity.measured.reading import ReadingOptions, SurfaceFile;"
        # Processes that a shell starts in the background ignore interrupts.
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "from asperity.measured.reading.isolation import read_isolated;"
        f"file = SurfaceFile(pathlib.Path({str(file.path)!r}), b'');"
        "read_isolated(r.looping, file, ReadingOptions())"
    )
    parent = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL)
    pid = file.path.with_name("pid")
    assert wait_until(lambda: pid.exists() and pid.read_text() != "")
    process = int(pid.read_text())
    assert is_running(process)
    os.kill(parent.pid, end)
    parent.wait(20)
    assert wait_until(lambda: not is_running(process))
