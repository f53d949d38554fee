"""Kill and interrupt long commands at random moments.

``python -m bench.stress.kills [COUNT]``: of the rounds three quarters are kills, one quarter
interrupts (400 by default). After each, the output folder holds a whole file or none, no process is
left, nothing says "Traceback", an interrupt has exit code 130, and the next start with the same
cache gives the answer of an undisturbed one.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from asperity.recording.recording import is_recording, open_recording

WAVE = "sinusoid:amplitude=0.8mm,period=1mm"
# Each writes its result to `out`; in a folder that holds a small map and a scene.
COMMANDS = (
    f"compare {WAVE} --json out.csv",
    "compare map.npy --pitch 20um --max-depth 0.1mm --laws B,C --html out.csv",
    f"analyze {WAVE} --law D --json out.csv",
    "prepare map.npy --pitch 20um -o out.csv",
    "simulate scene.toml --trace out.mcap",
    f"limits {WAVE} --device omega.3 --json out.csv",
    "scan scene.toml --laws B,F --json out.csv",
    "onset still.toml --laws W --delays 1 --json out.csv",
    "reproduce --claim eq-5 --json out.csv",
)
_EARLIEST = 0.5  # [s] of an interrupt: before that Python itself may be starting, and swallow it
_INTERRUPTED = "asperity: interrupted\n"
_SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "1 mm"
[surface]
law = "F"
[device]
id = "pantograph"
joint_damping = "4.0 mN*m*s"
[hand]
kind = "spring"
stiffness = ["300 N/m", "300 N/m", "0 N/m"]
damping = ["3 N*s/m", "3 N*s/m", "3 N*s/m"]
mass = "50 g"
force = ["0 N", "0 N", "-1 N"]
[motion]
kind = "strokes"
start = ["0 mm", "0 mm", "-1 mm"]
end = ["5 mm", "0 mm", "-1 mm"]
speed = "50 mm/s"
"""
_STILL = """[motion]
kind = "still"
point = ["0 mm", "0 mm", "-1 mm"]
"""
_OUTPUTS = {"out.csv", "out.mcap"}
_INPUTS = {"map.npy", "scene.toml", "still.toml"}


def write_inputs(folder: Path) -> None:
    """Put the inputs of the commands into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    heights = 2e-5 * np.random.default_rng(3).normal(size=(48, 48))
    np.save(folder / "map.npy", heights)
    (folder / "scene.toml").write_text(_SCENE)
    (folder / "still.toml").write_text(_SCENE.partition("[motion]")[0] + _STILL)


def start(command: str, folder: Path, cache: Path) -> subprocess.Popen[bytes]:
    """Start a command in a folder, in a group of processes of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "asperity", *command.split()],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(cache)},
    )


def disturb_command(command: str, folder: Path, cache: Path, after: float, by: int) -> list[str]:
    """Run a command, disturb it after a while [s], and return what is wrong then."""
    write_inputs(folder)
    process = start(command, folder, cache)
    try:
        output, errors = process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        os.kill(process.pid, by)
        output, errors = process.communicate(timeout=120)
        if by == signal.SIGINT and process.returncode not in {0, 130}:
            return [f"exit code {process.returncode}: {errors.decode()[-300:]}"]
        if process.returncode == 130 and not errors.decode().endswith(_INTERRUPTED):
            return [f"interrupted, but said: {errors.decode()[-300:]!r}"]
    wrong = []
    if b"Traceback" in errors + output:
        wrong.append(f"traceback: {errors.decode()[-300:]}")
    if _is_group_alive(process.pid):
        os.killpg(process.pid, signal.SIGKILL)
        wrong.append("a process is left")
    left = {path.name for path in folder.iterdir()} - _INPUTS
    if left - _OUTPUTS:
        wrong.append(f"files are left: {sorted(left)}")
    wrong += ["half a file" for name in left & _OUTPUTS if not _is_complete(folder / name, command)]
    return wrong


def _is_group_alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def _is_complete(path: Path, command: str) -> bool:
    """Return whether an output is whole; a trace is written row by row, its last may be short."""
    if path.suffix == ".mcap":
        return is_recording(path) and open_recording(path).table().shape[1] > 1
    if "--trace" in command:
        return path.read_text().startswith("time")
    if "--json" in command:
        return bool(json.loads(path.read_text()))
    if "--html" in command:
        return path.read_text().rstrip().endswith("</html>")
    with np.load(path) as archive:
        return {"heights", "steps"} <= set(archive.files)


def _run_to_end(command: str, folder: Path, cache: Path) -> tuple[int, bytes]:
    write_inputs(folder)
    process = start(command, folder, cache)
    process.communicate(timeout=300)
    written = b"".join(path.read_bytes() for name in _OUTPUTS if (path := folder / name).exists())
    return process.returncode, written


def run(count: int, console: Console, seed: int = 0) -> Counter[str]:
    """Print what so many disturbances did; return how often each fault was seen."""
    faults: Counter[str] = Counter()
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        expected, times = {}, {}
        for index, command in enumerate(COMMANDS):
            begin = time.perf_counter()
            expected[command] = _run_to_end(command, root / f"first{index}", root / "cache")
            times[command] = time.perf_counter() - begin
        for index in track(range(count), "disturbing", console=console, transient=True):
            command = draw.choice(COMMANDS)
            folder, by = root / f"run{index}", (signal.SIGKILL, signal.SIGINT)[index % 4 == 3]
            # A quarter begins with an empty cache: then compiling is disturbed too.
            cache = root / ("cache" if draw.random() < 0.75 else f"cache{index}")
            after = draw.uniform(0.1, times[command])
            after = max(after, _EARLIEST) if by == signal.SIGINT else after
            faults.update(disturb_command(command, folder, cache, after, by))
            if index % 10 == 9 and "html" not in command:
                again = _run_to_end(command, root / f"again{index}", cache)
                faults["another answer afterwards"] += again != expected[command]
            shutil.rmtree(folder)
        stray = [path for path in (root / "cache").rglob("*") if ".tmp" in path.name]
        faults["files left in the cache"] += len(stray)
    console.print(f"{count} disturbances: {dict(+faults) or 'no fault'}")
    return +faults


if __name__ == "__main__":
    number = next((int(word) for word in sys.argv[1:] if word.isdigit()), 400)
    sys.exit(bool(run(number, Console(width=100, highlight=False))))
