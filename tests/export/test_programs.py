"""The programs of the page "Export to C" can be built and run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.speed.firmware import build_firmware, missing_tool
from tests.helpers.c_programs import COMPILERS, STRICT, kernel_ticks, run_command, tool

import asperity as asp
from asperity.export.abi import ABI_VERSION
from asperity.export.surface_functions import ExportRequest
from asperity.export.targets import find_target, write_files

CPP = Path(__file__).parent / "cpp"
EXAMPLES = Path(__file__).parents[2] / "examples" / "export"


def write_program(folder: Path, law: str = "C", name: str = "texture.h", **options: Any) -> Path:
    """Write an exported program into a folder and return the folder."""
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), law, 800.0, clamp="backed")
    q = asp.characteristic_number(surface).upper
    request = ExportRequest(surface, q_upper=q, **options)
    write_files(folder / name, find_target("c99"), request, force=False)
    return folder


@pytest.mark.parametrize("compiler", COMPILERS)
def test_servo_loop_in_c(compiler: str, tmp_path: Path) -> None:
    folder = write_program(tmp_path)
    flags = (*STRICT, "-O2", f"-I{folder}", EXAMPLES / "loop.c", "-o", folder / "loop", "-lm")
    run_command(tool(compiler), *flags)
    head, *lines = run_command(folder / "loop").splitlines()
    assert head.startswith("k = 800 N/m, q <= 1.09")
    assert len(lines) == 8
    # The handle is pressed onto the waves with 0.15 N and pulled over them.
    heights = [float(line.split("z =")[1].split()[0]) for line in lines]
    forces = [float(line.split(",")[1].split(")")[0]) for line in lines]
    assert all(-0.4 < z < 0.1 for z in heights)
    assert all(0.1 < f < 0.2 for f in forces[1:])


POSITIONS = [[0.25e-3 * tick, 0.1e-3, -0.05e-3] for tick in range(5)]


def expected_forces(law: str = "C") -> list[list[float]]:
    """Return the forces of the kernel at the positions that the callers use."""
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), law, 800.0, clamp="backed")
    return [list(force) for force in kernel_ticks(surface, np.array(POSITIONS))[:, :3]]


def parse_hex(text: str) -> list[list[float]]:
    return [[float.fromhex(part) for part in line.split()] for line in text.splitlines()]


@pytest.mark.parametrize("law", ["C", "F"])
@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_c_plus_plus_programs(compiler: str, law: str, tmp_path: Path) -> None:
    folder = write_program(tmp_path, law)
    strict = ("-std=c++17", *STRICT[1:], "-O2", *(f"-I{path}" for path in (folder, EXAMPLES, CPP)))
    for name in ("scene", "values"):
        run_command(tool(compiler), *strict, CPP / f"{name}.cpp", "-o", folder / name, "-lm")
        assert parse_hex(run_command(folder / name)) == expected_forces(law)


@pytest.fixture
def shared_library(tmp_path: Path) -> Path:
    """Build an exported library with CMake; return its folder."""
    folder = write_program(tmp_path, as_library=True)
    build = folder / "build"
    run_command(tool("cmake"), "-S", folder, "-B", build)
    run_command(tool("cmake"), "--build", build)
    return build


def test_library_called_from_python(shared_library: Path) -> None:
    output = run_command(sys.executable, EXAMPLES / "caller.py", shared_library / "libtexture.so")
    assert parse_hex(output) == expected_forces()


def test_library_called_from_c_sharp(shared_library: Path) -> None:
    program = shared_library / "Caller.exe"
    run_command(tool("mcs"), EXAMPLES / "Caller.cs", f"-out:{program}")
    output = run_command(tool("env"), f"LD_LIBRARY_PATH={shared_library}", tool("mono"), program)
    assert [
        [float(part) for part in line.split()] for line in output.splitlines()
    ] == expected_forces()


def test_library_exports_only_its_public_functions(shared_library: Path) -> None:
    symbols = run_command(
        tool("nm"), "-D", "--defined-only", shared_library / "libtexture.so"
    ).split()
    assert {name for name in symbols if name.startswith("texture")} == {
        "texture_reset",
        "texture_force",
        "texture_gap",
        "texture_energy",
        "texture_prepare",
        "texture_abi_version",
        "texture_state_size",
        "texture_info",
        f"texture_abi_{ABI_VERSION}",
    }


def test_microcontroller_gives_the_force_within_its_budget(tmp_path: Path) -> None:
    missing = missing_tool()
    if missing is not None:
        pytest.skip(f"not run: no {missing} here")
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), "C", 800.0, clamp="backed")
    firmware = build_firmware(surface, tmp_path)
    points = np.column_stack([250e-6 * np.arange(8), np.zeros(8), np.full(8, -0.05e-3)])
    forces = [[int(part) for part in line.split()[:3]] for line in firmware.output.splitlines()]
    np.testing.assert_allclose(forces, 1e6 * surface.force(points), atol=2.0)
    assert 400 < firmware.flash < 16_000
    assert 12 <= firmware.ram < 1_000
    assert 50 < firmware.instructions < 2_000
