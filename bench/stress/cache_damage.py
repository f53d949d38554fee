"""Damage a filled cache at random, and see that nothing comes of it.

``python -m bench.stress.cache_damage [COUNT] [--unchecked]``, 1000 by default.

Each round copies a filled cache, damages it, and lets a fresh process compute forces, Jacobians
and certificates with it: a fork of one that has imported all modules and computed nothing. Counted
are crashes, tracebacks, numbers that changed and planted code that ran; all must be zero. With
``--unchecked`` the check of the digests is switched off: then they must not be zero, or the run
shows nothing.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import pickle
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.progress import track

from bench.stress.damage import mutate

_CHILD = """
import sys
import numpy as np
from asperity import HeightMap, Surface, characteristic_number
from asperity.core import cache
if "--unchecked" in sys.argv:
    class Anything(bytes):
        def __radd__(self, _magic): return self
        def __eq__(self, _other): return True
    cache._digest = lambda key, content: Anything(32)
heights = 1e-4 * np.random.default_rng(1).normal(size=(8, 9))
texture = HeightMap(heights, 3e-4)
points = np.random.default_rng(2).uniform((0, 0, -1e-4), (2e-3, 2e-3, 1e-4), (200, 3))
for law in "BF":
    surface = Surface(texture, law, max_depth=1e-4)
    force, jacobian = surface.force_and_jacobian(points)
    bound = characteristic_number(surface)
    print(law, force.tobytes().hex(), jacobian.tobytes().hex(), repr(bound), flush=True)
"""
_MODULES = """
print(*(name for name in sys.modules if name.startswith(("asperity.", "numba", "scipy"))))
"""
_SECONDS = 300.0  # by the clock, for one round
_STARTS = 41  # noise of single starts is 5 %

_FORKS = multiprocessing.get_context("forkserver")

Damage = Callable[[Path, random.Random], None]


class Planted:
    """What is unpickled leaves a file behind."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        """Say what unpickling is to call."""
        return os.system, (f"touch {self.path}",)


def run(count: int, unchecked: bool, console: Console) -> bool:
    """Print what so many damages did; return whether that is as it must be."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        filled = folder / "filled"
        modules = _compute_in_process(filled, _CHILD + _MODULES).splitlines()[-1]
        expected = _compute_in_process(filled)
        warm = [_cpu_time(filled, unchecked) for unchecked in (False, True) * _STARTS]
        _FORKS.set_forkserver_preload(modules.split())
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            rounds = pool.map(
                lambda seed: _round(folder, filled, expected, seed, unchecked), range(count)
            )
            found = Counter(track(rounds, "damages", total=count, console=console, transient=True))
    said = ", ".join(f"{words}: {number}" for words, number in sorted(found.items()))
    console.print(f"{count} damages{' without the check' if unchecked else ''}: {said}")
    ratio = median(warm[::2]) / median(warm[1::2])
    console.print(
        f"warm start, processor time, median of {_STARTS} in turns:"
        f" {ratio:.3f} x that without a check"
    )
    harm = sum(number for words, number in found.items() if words not in HARMLESS_OUTCOMES)
    return bool(harm) == unchecked


HARMLESS_OUTCOMES = ("made again", "not noticed, not needed")


def _round(folder: Path, filled: Path, expected: str, seed: int, unchecked: bool) -> str:
    draw = random.Random(seed)
    cache, planted = folder / f"cache{seed}", folder / f"planted{seed}"
    shutil.copytree(filled, cache)
    for _ in range(draw.choice((1, 1, 2, 5))):
        _damage_cache(cache, draw, planted)
    output, errors, status = _compute_in_fork(cache, folder / f"said{seed}", unchecked)
    _remove_cache(cache)
    if status is None:
        return "HANGS"
    if planted.exists():
        return "PLANTED CODE RAN"
    if status:
        return "CRASH" if status < 0 else "ERROR"
    if "Traceback" in errors:
        return "TRACEBACK"
    if output != expected:
        return "CHANGED NUMBER"
    return HARMLESS_OUTCOMES[0] if "the cache" in errors else HARMLESS_OUTCOMES[1]


def _damage_cache(cache: Path, draw: random.Random, planted: Path) -> None:
    files = sorted(path for path in cache.rglob("*") if path.is_file())
    if not files:
        return
    path, other = draw.choice(files), draw.choice(files)
    content = path.read_bytes()
    kind = draw.randrange(11)
    if kind < 3:
        path.write_bytes(mutate(content, draw))
    elif kind == 3:  # one bit, anywhere
        bits = bytearray(content or b" ")
        bits[draw.randrange(len(bits))] ^= 1 << draw.randrange(8)
        path.write_bytes(bits)
    elif kind == 4:
        path.write_bytes(b"")
    elif kind == 5:
        path.write_bytes(other.read_bytes())
        other.write_bytes(content)
    elif kind == 6:  # with the head of a true entry or without
        head = content[: draw.choice((0, 17, 49))]
        path.write_bytes(head + pickle.dumps(Planted(planted)))
    elif kind == 7:
        path.unlink()
        path.mkdir()
    elif kind == 8:
        os.utime(path, (4e9, 4e9))
    elif kind == 9 and hasattr(os, "chown") and os.geteuid() == 0:
        os.chown(draw.choice((path, path.parent, cache)), 54321, 54321)
    else:
        draw.choice((path, path.parent, cache)).chmod(draw.choice((0o000, 0o444, 0o555, 0o777)))


def _compute_in_fork(
    cache: Path, output_folder: Path, unchecked: bool
) -> tuple[str, str, int | None]:
    """Return output, errors and exit code of a fork; None for one that does not end."""
    output_folder.mkdir()
    process = _FORKS.Process(target=_compute, args=(cache, output_folder, unchecked))
    process.start()
    process.join(_SECONDS)
    status = process.exitcode
    process.kill()
    output, errors = [(output_folder / name).read_text() for name in ("output", "errors")]
    shutil.rmtree(output_folder)
    return output, errors, status


def _compute(cache: Path, output_folder: Path, unchecked: bool) -> None:
    """Be the fork: run the program, its output and errors in files."""
    for number, name in ((1, "output"), (2, "errors")):
        os.dup2(os.open(output_folder / name, os.O_WRONLY | os.O_CREAT), number)
    os.environ["ASPERITY_CACHE_DIR"] = str(cache)
    sys.argv = ["-c", *(["--unchecked"] if unchecked else [])]
    exec(_CHILD, {})
    atexit._run_exitfuncs()  # as a process that is no fork does: temporary folders go


def _compute_in_process(cache: Path, program: str = _CHILD, *options: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program, *options],
        capture_output=True,
        text=True,
        check=True,
        timeout=_SECONDS,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(cache)},
    )
    return done.stdout


def _cpu_time(cache: Path, unchecked: bool) -> float:
    """Return the processor time of a start with a filled cache [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    _compute_in_process(cache, _CHILD, *(["--unchecked"] if unchecked else []))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _remove_cache(cache: Path) -> None:
    for path in (cache, *cache.iterdir()):
        path.chmod(0o700)
    shutil.rmtree(cache)


if __name__ == "__main__":
    count = next((int(word) for word in sys.argv[1:] if word.isdigit()), 1000)
    sys.exit(not run(count, "--unchecked" in sys.argv, Console(width=100, highlight=False)))
