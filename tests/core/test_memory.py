"""Memory limit of commands: the estimate against measured peaks, and refused surfaces."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from asperity.cli.main import main
from asperity.cli.options import MEMORY
from asperity.core.errors import ParameterError
from asperity.core.memory import estimate_memory, free_memory, limit_memory, require_memory
from asperity.textures.kinds.noise import Noise
from asperity.textures.spline.spline_texture import HeightMap

_PEAK = """
import sys
from asperity.cli.main import main
sys.argv[0] = "asperity"
main()
# The peak of this program: getrusage starts with the peak of the process that forked it.
(line,) = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
print("PEAK", int(line.split()[1]) * 1024, file=sys.stderr)
"""


def _save_map(folder: Path, side: int, height: float = 20e-6) -> str:
    """Save a smooth map with an amplitude of height [m]; return its path."""
    x = np.linspace(0.0, 8.0 * np.pi, side)
    path = folder / f"map{side}.npy"
    np.save(path, height * np.sin(x) * np.cos(1.3 * x[:, None]))
    return str(path)


@pytest.mark.skipif(sys.platform != "linux", reason="the peak stands in /proc, on Linux")
@pytest.mark.parametrize("command", ["limits", "prepare"])
def test_estimate_is_between_one_and_2_3_times_the_peak(tmp_path: Path, command: str) -> None:
    options = ["-o", str(tmp_path / "out.npz"), "--force"] if command == "prepare" else []
    # The first run may compile. The others find the base memory and that of the points.
    sides = (256, 512) if command == "prepare" else (512,)
    # A random height keeps results of earlier runs from being used.
    heights = np.random.default_rng().uniform(20e-6, 21e-6, 1 + len(sides))
    peaks = {}
    for side, height in zip((32, *sides), heights, strict=True):
        arguments = [command, _save_map(tmp_path, side, height), "--pitch", "10um", *options]
        process = subprocess.run(
            [sys.executable, "-c", _PEAK, *arguments], capture_output=True, text=True, check=True
        )
        peaks[side] = int(process.stderr.split("PEAK")[1])
    for side in sides:
        assert peaks[side] <= estimate_memory(command, side * side) <= 2.3 * peaks[side]


def test_surface_above_the_limit_is_refused_before_its_computation() -> None:
    with limit_memory("compare", 500_000_000):
        require_memory(1000, 1000)
        with pytest.raises(ParameterError, match=r"memory must be about .* 2000 x 2000 points"):
            require_memory(2000, 2000)
        with pytest.raises(ParameterError, match=r"1069 x 1069 points would fit: crop it"):
            Noise(1e-6, 20e-3, pitch=10e-6)
        with pytest.raises(ParameterError, match="2 times as long"):
            HeightMap(np.broadcast_to(0.0, (2000, 2000)), 1e-5)
    require_memory(10**9)  # nothing is limited outside of a command
    message = "at least 420 MB for compare, got 999999 bytes"
    with pytest.raises(ParameterError, match=message), limit_memory("compare", 999_999):
        pass


@pytest.mark.parametrize(
    ("text", "size"),
    [("4GB", 4 * 10**9), ("500 MB", 5 * 10**8), ("2GiB", 2 * 2**30), ("12B", 12), ("1.5k", 1500)],
)
def test_sizes_with_units_are_parsed(text: str, size: int) -> None:
    assert MEMORY.parse(text) == size


@pytest.mark.parametrize("text", ["", "4 apples", "-1GB", "1e9", "GB", "9" * 400])
def test_invalid_sizes_are_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="memory must be a size"):
        MEMORY.parse(text)


def test_free_memory_is_plausible_or_unknown() -> None:
    free = free_memory()
    assert free is None or free > 10**6


@pytest.mark.parametrize("command", ["compare", "analyze", "limits", "prepare", "show"])
def test_every_command_that_reads_a_surface_has_the_limit(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    options = {"prepare": ["-o", str(tmp_path / "o.npz")], "analyze": ["--law", "A"]}
    limit = "105MB" if command == "prepare" else "425MB"
    arguments = [command, _save_map(tmp_path, 512), "--pitch", "10um", "--memory", limit]
    monkeypatch.setattr("sys.argv", ["asperity", *arguments, *options.get(command, [])])
    with pytest.raises(SystemExit) as stop:
        main()
    out, err = capsys.readouterr()
    assert (stop.value.code, out) == (2, "")
    assert "for 512 x 512 points" in err
    assert "would fit" in err
    assert len(err.strip().splitlines()) == 1
