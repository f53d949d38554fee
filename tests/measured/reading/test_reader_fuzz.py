"""A bounded fuzz run of every reader; ``python -m bench.stress.fuzz`` is the long one."""

from __future__ import annotations

import importlib
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))
fuzz = importlib.import_module("bench.stress.fuzz")
seeds = importlib.import_module("bench.stress.fuzz_seeds")

COUNT = 200


@pytest.fixture(scope="module")
def results() -> dict[str, dict[str, Any]]:
    """Fuzz all readers in one worker with 1 GB of memory, as the long run does."""
    readers = seeds.available_readers()
    return dict(zip(readers, fuzz.results(readers, COUNT), strict=True))


@pytest.fixture(scope="module")
def worker() -> Iterator[Any]:
    """One process for many files, as in the long run."""
    with importlib.import_module("bench.stress.fuzz_child").ReadingWorker() as started:
        yield started


@pytest.mark.parametrize("reader", seeds.SEEDS)
def test_every_mutated_file_is_read_or_refused(
    reader: str, results: dict[str, dict[str, Any]]
) -> None:
    if reader not in results:
        pytest.skip("real surfaces (../shared/data) or the extra asperity[formats] missing")
    counts = results[reader]
    assert counts["faults"] == []
    assert counts["other"] == 0
    assert counts["read"] + counts["refused"] == COUNT
    assert counts["peak"] < 1024
    # The run is useful only if the damage is neither harmless nor always fatal.
    assert counts["refused"] > COUNT // 20
    if reader not in {"archive", "marks"}:  # whose seeds are not surfaces
        assert counts["read"] > 2


@pytest.mark.parametrize("reader", seeds.SEEDS)
def test_seed_files_are_read(
    reader: str, tmp_path: Path, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from asperity.core.errors import ParameterError, SurfaceFileError
    from asperity.measured.reading import isolation, read_surface

    monkeypatch.setattr(isolation, "run_subprocess", worker.start)

    if reader not in seeds.available_readers():
        pytest.skip("real surfaces (../shared/data) or the extra asperity[formats] missing")
    refused: list[str] = []
    for number, content in enumerate(seeds.SEEDS[reader](tmp_path)):
        path = tmp_path / f"{number}.dat"
        path.write_bytes(content)
        try:
            raw = read_surface(path, **seeds.OPTIONS.get(reader, {}))
        except (ParameterError, SurfaceFileError) as error:
            refused.append(str(error))
        else:
            assert raw.heights.size > 0
    reasons = {"archive": "archive", "png": "normal map", "tiff": "normal map", "marks": ""}
    expected = reasons.get(reader)
    assert all(expected is not None and expected in message for message in refused)


def test_mutations_are_reproducible() -> None:
    content = bytes(range(256)) * 4
    first = [fuzz.mutate(content, random.Random(f"x {k}")) for k in range(50)]
    assert first == [fuzz.mutate(content, random.Random(f"x {k}")) for k in range(50)]
    assert sum(data != content for data in first) > 45
    assert len(set(first)) > 40


def test_fuzz_run_reports_faulty_readers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Negative control: readers that raise, run out of memory, or return infinite heights."""
    import numpy as np

    from asperity.core.errors import SurfaceFileError
    from asperity.measured import reading

    def raising(*_: object, **__: object) -> None:
        raise IndexError("oops")

    def hungry(*_: object, **__: object) -> None:
        raise SurfaceFileError("a.npy: not enough memory to read this surface")

    def wrong(*_: object, **__: object) -> reading.RawSurface:
        return reading.RawSurface(np.full((4, 4), np.inf), None, "", ())

    for reader in (raising, hungry, wrong):
        monkeypatch.setattr(reading, "read_surface", reader)
        observed = [outcome for outcome, _ in fuzz.outcomes("npy", 3, tmp_path)]
        assert observed == ["other"] * 3


def test_memory_limit_of_a_worker_is_effective() -> None:
    code = (
        "import resource, numpy; from bench.stress import fuzz;"
        "resource.setrlimit(resource.RLIMIT_DATA, (fuzz.MEMORY, fuzz.MEMORY));"
        "numpy.ones(fuzz.MEMORY // 8)"
    )
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=environment,
        check=False,
    )
    assert done.returncode == 1
    assert "MemoryError" in done.stderr


def test_command_prints_a_table_and_sets_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert fuzz.main(["20", "npy"]) == 0
    output = capsys.readouterr().out
    assert "npy" in output
    assert "peak [MB]" in output
    assert fuzz.main(["20", "mpy"]) == 2
    assert "unknown reader 'mpy'" in capsys.readouterr().err
