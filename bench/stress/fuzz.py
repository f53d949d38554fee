"""Long fuzz run of the readers: ``python -m bench.stress.fuzz [count] [reader ...]``.

Every reader gets count mutated files (10 000 by default) from a fixed seed. A worker process
reads them with 1 GB of memory and 20 s of the processor for each; anything but a surface or one of
asperity's own errors is counted as "other", and so is a file for which the memory did not do.
Isolated readers run in a fork of the worker, which has imported the libraries and reads many files,
each with the usual limits; a file that exceeds them is counted as "stopped" and as refused.
"""

from __future__ import annotations

import functools
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from bench.stress import fuzz_seeds
from bench.stress.damage import mutate

COUNT = 10_000
MEMORY = 2**30  # [bytes] of data that a worker may hold, its own start included
SECONDS = 20  # of the processor, for one file
_PATIENCE = 6  # times as long by the clock
_LIMIT_MESSAGES = ("to be read, the limit", "ends its reader with")
_MAX_PRINTED = 3  # faults of a reader that are printed


class _TooSlowError(Exception):
    """A file took longer than SECONDS."""


def outcomes(reader: str, count: int, folder: Path) -> Iterator[tuple[str, str]]:
    """Read mutated files in this process: ("read" | "refused" | "other", what) for each."""
    from asperity.core.errors import AsperityError
    from asperity.measured.reading import read_surface

    seed = fuzz_seeds.SEEDS[reader](folder)
    options = fuzz_seeds.OPTIONS.get(reader, {})
    path = folder / "mutated.dat"
    for trial in range(count):
        rng = random.Random(f"{reader} {trial}")
        whole = rng.choice(seed)
        content = fuzz_seeds.repair_checksums(reader, whole, mutate(whole, rng), rng)
        path.write_bytes(content)
        try:
            _set_time_limit(SECONDS)
            raw = read_surface(path, **options)
            _set_time_limit(0)
        except AsperityError as error:
            yield _classify_message(str(error))
        except BaseException as error:  # the very thing that is looked for
            if isinstance(error, KeyboardInterrupt):
                raise
            yield "other", f"trial {trial}: {type(error).__name__}: {error}"
        else:
            yield (
                ("read", "")
                if _is_valid_surface(raw)
                else ("other", f"trial {trial}: unsound surface")
            )
        finally:
            _set_time_limit(0)


def _set_time_limit(seconds: int) -> None:
    """Allow what follows so much time of this process, and some more by the clock; 0 ends it."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(_PATIENCE * seconds)


def _classify_message(message: str) -> tuple[str, str]:
    if "not enough memory" in message:
        return "other", message
    if "\n" in message or not message:
        return "other", f"message of several lines or none: {message!r}"
    return "refused", message


def _is_valid_surface(raw: Any) -> bool:
    """A surface whose numbers can be used: no infinity, a positive pitch."""
    import numpy as np

    if raw.heights.ndim not in (1, 2) or np.isinf(raw.heights).any() or not raw.heights.size:
        return False
    return raw.pitch is None or all(p > 0 and np.isfinite(p) for p in raw.pitch)


def run_worker(readers: Sequence[str], count: int) -> None:
    """Be the worker: print one JSON object a line for each reader."""
    from asperity.measured.reading import isolation
    from asperity.measured.reading import readers as registry
    from bench.stress.fuzz_child import ReadingWorker

    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    warnings.simplefilter("error")  # a warning on the terminal is no clear error either
    signal.signal(signal.SIGALRM, _too_slow)
    signal.signal(signal.SIGPROF, _too_slow)
    # What is installed stays so: looking it up took half the time of a file.
    vars(registry).update(entry_points=functools.cache(entry_points))
    for reader in readers:
        with ReadingWorker() as reading:
            isolation.run_subprocess = reading.start
            totals = _totals(reader, count)
        # A fork begins with what the worker has.
        peak = max(_peak(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
        print(json.dumps({**totals, "peak": peak}), flush=True)


def _totals(reader: str, count: int) -> dict[str, Any]:
    totals = {"read": 0, "refused": 0, "stopped": 0, "other": 0}
    faults: list[str] = []
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for outcome, what in outcomes(reader, count, Path(folder)):
            totals[outcome] += 1
            totals["stopped"] += outcome == "refused" and any(
                word in what for word in _LIMIT_MESSAGES
            )
            if outcome == "other" and len(faults) < _MAX_PRINTED:
                faults.append(what[:300])
    return {**totals, "faults": faults, "seconds": time.monotonic() - start}


def _peak() -> float:
    """Return the greatest memory of this process [MB].

    getrusage would count what the parent held when it started this process; Linux keeps the
    process's own mark as well.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
        return float(status.split("VmHWM:")[1].split()[0]) / 1024
    except (OSError, IndexError):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _too_slow(*_: object) -> None:
    raise _TooSlowError(f"longer than {SECONDS} s")


def run(readers: Sequence[str], count: int, console: Console) -> int:
    """Fuzz the readers, print the table, return how many outcomes were neither of the two."""
    table = Table("reader", "files", "read", "refused", "stopped", "other", "peak [MB]", "time [s]")
    faults: list[str] = []
    bad = 0
    for reader in readers:
        result = results([reader], count)[0]
        bad += result["other"]
        faults += [f"{reader}: {fault}" for fault in result["faults"]]
        numbers = [str(result[key]) for key in ("read", "refused", "stopped", "other")]
        table.add_row(
            reader, str(count), *numbers, f"{result['peak']:.0f}", f"{result['seconds']:.0f}"
        )
        console.print(f"{reader}: {' / '.join(numbers)}", style="dim")
    console.print(table)
    for fault in faults:
        console.print(fault, markup=False, soft_wrap=True)
    return bad


def results(readers: Sequence[str], count: int) -> list[dict[str, Any]]:
    """Fuzz some readers in one worker: a dictionary of totals, faults, peak and time for each."""
    command = [sys.executable, "-m", "bench.stress.fuzz", "--worker", str(count), *readers]
    # One thread: the stacks of others would count as data.
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment, cwd=_ROOT
    )
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode == 0 and len(found) == len(readers):
        return found
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    fault = f"worker ended with code {done.returncode}: {last}"
    lost = {
        "read": 0,
        "refused": 0,
        "stopped": 0,
        "other": 1,
        "faults": [fault],
        "peak": 0.0,
        "seconds": 0.0,
    }
    return [*found, *[lost] * (len(readers) - len(found))]


_ROOT = Path(__file__).parents[2]


def main(arguments: Sequence[str]) -> int:
    if arguments[:1] == ["--worker"]:
        run_worker(arguments[2:], int(arguments[1]))
        return 0
    counts = [int(word) for word in arguments if word.isdecimal()]
    readers = [word for word in arguments if not word.isdecimal()] or fuzz_seeds.available_readers()
    unknown = [reader for reader in readers if reader not in fuzz_seeds.SEEDS]
    if unknown:
        known = ", ".join(fuzz_seeds.SEEDS)
        print(f"unknown reader {unknown[0]!r}; choose from {known}", file=sys.stderr)
        return 2
    bad = run(readers, counts[0] if counts else COUNT, Console(width=100, highlight=False))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
