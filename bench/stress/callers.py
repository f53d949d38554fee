"""Forces of an exported library through its callers against those of the kernel, bit by bit.

``python -m bench.stress.callers [COUNT]``: 1 000 000 forces through each of Python, C#, Rust,
WebAssembly, and the component for Unity in a rotated frame. A map needs neither sine nor cosine,
whose last bits are those of the C library or of the browser; for a wave the greatest difference is
given.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from asperity.export.surface_functions import ExportRequest
from asperity.export.targets import find_target, write_files
from asperity.surface import Surface
from asperity.textures import HeightMap, Sinusoid
from bench.speed.c_programs import probes, run_command, surface_ticks

EXAMPLES = Path(__file__).parents[2] / "examples" / "export"
STAND_INS = Path(__file__).parents[1] / "stand_ins" / "unity"
WASM_FLAGS = (
    *("--target=wasm32", "-std=c99", "-O2", "-ffreestanding", "-nostdlib", "-mbulk-memory"),
    *("-fvisibility=hidden", "-DTEXTURE_BUILD", "-DTEXTURE_NO_LIBC", "-Wl,--no-entry"),
    *("-Wl,--export-dynamic", "-Wl,--export=__heap_base", "-Wl,--allow-undefined"),
)
LIBRARY_FLAGS = ("-std=c99", "-O2", "-fvisibility=hidden", "-DTEXTURE_BUILD", "-shared", "-fPIC")
TOOLS = {
    "Python": (),
    "C#": ("mcs", "mono"),
    "Rust": ("rustc",),
    "WebAssembly": ("clang", "wasm-ld", "node"),
    "Unity": ("mcs", "mono"),
}
"""Programs that each caller needs beside gcc."""
POSE = (0.48, -0.6, 0.64, 0.0, 0.01, -0.02, 0.03)
"""Rotation (x, y, z, w) and origin [m] of the patch of the component for Unity."""


def missing_tool(caller: str) -> str | None:
    """Return a program that a caller needs and that is not installed; ``None`` if all are."""
    return next((name for name in ("gcc", *TOOLS[caller]) if shutil.which(name) is None), None)


def map_surface(law: str = "C") -> Surface:
    """Return a surface whose force needs no function of a library but the square root."""
    heights = 1e-4 * np.random.default_rng(5).normal(size=(24, 20))
    return Surface(HeightMap(heights, (3e-4, 2e-4)), law, 800.0, max_depth=2e-4, clamp="backed")


def build_library(surface: Surface, folder: Path, **options: Any) -> Path:
    """Write the library of a surface into a folder, build it and return its path."""
    request = ExportRequest(surface, as_library=True, **options)
    write_files(folder / "texture.h", find_target("c99"), request, force=True)
    return compile_source(folder)


def compile_source(folder: Path, *flags: str) -> Path:
    """Build the library of the source in a folder and return its path."""
    library = folder / "libtexture.so"
    run_command("gcc", *LIBRARY_FLAGS, *flags, folder / "texture.c", "-o", library, "-lm")
    return library


def build_caller(caller: str, folder: Path) -> list[str | Path]:
    """Build a caller beside its library and return its command, without files."""
    if caller == "Python":
        return [sys.executable, EXAMPLES / "caller.py", folder / "libtexture.so"]
    if caller == "C#":
        run_command("mcs", EXAMPLES / "Caller.cs", f"-out:{folder / 'Caller.exe'}")
        return ["mono", folder / "Caller.exe"]
    if caller == "Rust":
        rust = ("rustc", "--edition", "2021", "-O", EXAMPLES / "caller.rs", "-L", folder)
        run_command(*rust, "-o", folder / "caller")
        return [folder / "caller"]
    run_command("clang", *WASM_FLAGS, folder / "texture.c", "-o", folder / "texture.wasm")
    return ["node", EXAMPLES / "caller.mjs", folder / "texture.wasm"]


def run_caller(folder: Path, *command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a program that finds its library in a folder."""
    words = [str(part) for part in command]
    paths = {**os.environ, "LD_LIBRARY_PATH": str(folder)}
    return subprocess.run(words, capture_output=True, text=True, check=False, env=paths)


def caller_forces(caller: str, surface: Surface, points: Any, folder: Path) -> Any:
    """Return the forces of a surface at points through a caller, shape (n, 3)."""
    if caller == "Unity":
        return unity_forces(surface, points, folder, "0")[0]
    build_library(surface, folder)
    return run_on_files(build_caller(caller, folder), points, folder)[0]


def build_unity_loop(surface: Surface, folder: Path) -> list[str | Path]:
    """Build the component of a surface with a loop on it; return the command, without files."""
    assets = folder / "Assets"
    write_files(assets, find_target("unity"), ExportRequest(surface), force=True)
    source = assets / "Source~" / "texture.c"
    run_command("gcc", *LIBRARY_FLAGS, source, "-o", folder / "libtexture.so", "-lm")
    scripts = [*assets.glob("*.cs"), *assets.glob("Examples~/*.cs"), *STAND_INS.glob("*.cs")]
    run_command("mcs", f"-out:{folder / 'Loop.exe'}", *scripts)
    return ["mono", folder / "Loop.exe"]


def unity_forces(surface: Surface, points: Any, folder: Path, rate: str) -> tuple[Any, str]:
    """Return forces of a rotated component in the frame of the surface; and what the loop says."""
    axes, origin = unity_axes()
    positions = points[:, [0, 2, 1]] @ axes.T + origin
    command = build_unity_loop(surface, folder)
    return run_on_files(command, positions, folder, rate, "1", "1e9", *map(repr, POSE))


def run_on_files(
    command: list[str | Path], positions: Any, folder: Path, *options: str
) -> tuple[Any, str]:
    """Return the forces of a program that reads positions from a file, and what it says."""
    np.ascontiguousarray(positions).tofile(folder / "positions")
    done = run_caller(folder, *command, folder / "positions", folder / "forces", *options)
    if done.returncode != 0:
        raise RuntimeError(done.stdout + done.stderr)
    return np.fromfile(folder / "forces").reshape(-1, 3), done.stdout


def unity_axes() -> tuple[Any, Any]:
    """Return the axes of the patch in Unity, as columns, and its origin."""
    x, y, z, w = np.array(POSE[:4], np.float32).astype(float)
    axes = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    return axes, np.array(POSE[4:], np.float32).astype(float)


def expected_unity_forces(surface: Surface, folder: Path) -> Any:
    """Return the forces of the kernel at the positions of the loop, in Unity's axes."""
    axes, origin = unity_axes()
    u, v, w = (np.fromfile(folder / "positions").reshape(-1, 3) - origin).T
    local = [axes[0, i] * u + axes[1, i] * v + axes[2, i] * w for i in (0, 2, 1)]
    right, forward, up = surface_ticks(surface, np.column_stack(local)).result()[:, :3].T
    return np.column_stack([a[0] * right + a[1] * up + a[2] * forward for a in axes])


def count_differing(caller: str, surface: Surface, points: Any, folder: Path) -> tuple[int, float]:
    """Return how many forces of a caller differ in any bit, and the greatest difference [N]."""
    found = caller_forces(caller, surface, points, folder)
    if caller == "Unity":
        expected = expected_unity_forces(surface, folder)
    else:
        expected = np.ascontiguousarray(surface_ticks(surface, points).result()[:, :3])
    bits = (found.view(np.int64) != expected.view(np.int64)).any(axis=1)
    return int(bits.sum()), float(np.abs(found - expected).max())


def surface_probes(surface: Surface, count: int) -> Any:
    """Return positions whose first is outside of the body."""
    points = probes(surface.texture, surface.max_depth, count, 11)
    points[0] = [0.0, 0.0, 1e-2]
    return points


def main(count: int = 1_000_000, say: Callable[[str], object] = print) -> int:
    """Compare and print; return 1 if a force differs where the arithmetic is the same."""
    failed = 0
    surfaces = {"map": map_surface(), "wave": Surface(Sinusoid(1e-4, 2e-3), "C", 800.0)}
    for kind, surface in surfaces.items():
        points = surface_probes(surface, count)
        for caller in TOOLS:
            if missing_tool(caller) is not None:
                say(f"{caller}: not run, no {missing_tool(caller)} here")
                continue
            with tempfile.TemporaryDirectory() as directory:
                differing, most = count_differing(caller, surface, points, Path(directory))
            say(f"{caller}, {kind}: {differing} of {len(points):,} differ, at most {most:.3g} N")
            failed |= differing > 0 and (kind == "map" or caller != "WebAssembly")
    return failed


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000))
