"""Exported C of baked fields: bit-identical to the kernel, as arrays or from a file."""

from __future__ import annotations

import shutil
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from bench.speed.firmware import build_firmware, missing_tool
from tests.helpers.c_programs import (
    COMPILERS,
    STRICT,
    header,
    kernel_ticks,
    library,
    probes,
    run_command,
    same_bits,
    ticks,
    tool,
)

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.surface import Surface
from asperity.textures import Texture
from asperity.textures.fields import bake as baking
from asperity.textures.fields.field_file import HEADER, save_field

KINDS = ("fourier", "map", "periodic profile")


@pytest.fixture(scope="module")
def baked(make_texture: Callable[[str], Texture]) -> Callable[..., Surface]:
    """Return a function that returns law H of a kind of texture, baked coarsely and only once.

    In bricks, as large fields are stored, for a second argument that is true.
    """

    @cache
    def bake(kind: str, in_bricks: bool = False) -> Surface:
        texture = make_texture(kind)
        low, high = texture.extremes
        depth = max(high - low, 1e-5)
        surface = Surface(texture, "H", 800.0, max_depth=depth)
        limit = 0 if in_bricks else baking.BRICK_BYTES
        with mock.patch.object(baking, "BRICK_BYTES", limit):
            return asp.bake(surface, 0.1 * depth, press=1e-6)

    return bake


@pytest.mark.parametrize("in_bricks", [False, True])
@pytest.mark.parametrize("flags", [("-O3", "-march=native"), ("-O2", "-std=gnu99")])
def test_field_in_the_source_gives_the_force_of_the_kernel(
    baked: Callable[..., Surface], flags: tuple[str, ...], tmp_path: Path, in_bricks: bool
) -> None:
    surfaces = {f"t{i}": baked(kind, in_bricks) for i, kind in enumerate(KINDS)}
    fields: list[Any] = [surface.texture for surface in surfaces.values()]
    assert {len(field.arguments.bricks) > 0 for field in fields} == {in_bricks}
    headers = {name: header(s, name, folder=tmp_path) for name, s in surfaces.items()}
    for compiler in COMPILERS:
        program = library(tmp_path, compiler, headers, *flags)
        for name, surface in surfaces.items():
            points = probes(surface.texture, surface.max_depth, 20_000, 3)
            forces = ticks(program, name, points)
            assert same_bits(forces, kernel_ticks(surface, points)).all(), (compiler, name)
            assert np.any(forces[:, :3] != 0.0)


# --- loaded from a file ---------------------------------------------------------------------------

SANITIZE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0", "-g")
_LOADER = """
#include <stdio.h>
#include "t.h"

int main(int count, char **names)
{
    const double outside[3] = {1e9, 0.0, 0.0};
    double at[3], f[3];
    t_state state;
    FILE *in = fopen("points.bin", "rb");
    const int result = t_load(names[count - 1]);
    t_reset(&state);
    if (in == NULL || result != 0) {
        return 10 + result;
    }
    t_prepare();
    t_force(&state, outside, f);
    while (fread(at, sizeof at[0], 3, in) == 3) {
        t_force(&state, at, f);
        fwrite(f, sizeof f[0], 3, stdout);
    }
    fprintf(stderr, "%.17g", T_Q_UPPER);
    t_load(NULL);
    t_force(&state, at, f);
    fclose(in);
    return f[0] != 0.0 || f[1] != 0.0 || f[2] != 0.0 || t_q() != 0.0;
}
"""


@pytest.fixture(scope="module")
def build_loader(
    baked: Callable[..., Surface], tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., None]:
    """Return a function that puts a program into a folder, compiled only once.

    It loads a field and writes the forces at the positions of a file.
    """

    @cache
    def build(compiler: str, *flags: str) -> Path:
        folder = tmp_path_factory.mktemp("loader")
        write_source(folder, baked("map"))
        command = (tool(compiler), *STRICT, *SANITIZE, *flags, "main.c", "-o", "main", "-lm")
        run_command(*command, cwd=folder)
        return folder / "main"

    return lambda folder, *command: shutil.copy(build(*command), folder)


def write_source(folder: Path, surface: Surface) -> None:
    """Write the source of that program, and the code of a surface."""
    request = ExportRequest(surface, "t", loads_field=True)
    for name, text in c99_files(request, "t").items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "main.c").write_text(_LOADER)


def run_loader(folder: Path, field: str) -> np.ndarray:
    (folder / "run.sh").write_text(f"./main {field} > forces.bin 2> q.txt\n")
    run_command(tool("sh"), "run.sh", cwd=folder)
    return np.fromfile(folder / "forces.bin").reshape(-1, 3)


@pytest.mark.parametrize(
    ("compiler", "flags"), [("gcc", ()), ("gcc", ("-DT_POSIX",)), ("clang", ("-DT_POSIX",))]
)
def test_loaded_field_gives_the_force_of_the_kernel(
    baked: Callable[..., Surface],
    build_loader: Callable[..., None],
    compiler: str,
    flags: tuple[str, ...],
    tmp_path: Path,
) -> None:
    """One program loads fields of another shape, too, a profile, and fields in bricks."""
    surfaces = {kind: baked(kind) for kind in KINDS}
    surfaces |= {f"{kind} in bricks": baked(kind, True) for kind in KINDS}
    build_loader(tmp_path, compiler, *flags)
    for kind, surface in surfaces.items():
        save_field(tmp_path / "a.field", surface.texture)
        points = probes(surface.texture, surface.max_depth, 2000, 5)
        points.tofile(tmp_path / "points.bin")
        forces = run_loader(tmp_path, "a.field")
        assert np.array_equal(forces, kernel_ticks(surface, points)[:, :3]), kind
        q = float((tmp_path / "q.txt").read_text())
        assert q == surface.texture.baked_numbers["norm"].upper
    with pytest.raises(RuntimeError):  # TEXTURE_NO_FILE
        run_loader(tmp_path, "none.field")


@pytest.mark.parametrize("in_bricks", [False, True])
@pytest.mark.parametrize("flags", [(), ("-DT_POSIX",)])
def test_damaged_fields_are_refused(
    baked: Callable[..., Surface],
    build_loader: Callable[..., None],
    flags: tuple[str, ...],
    tmp_path: Path,
    in_bricks: bool,
) -> None:
    surface = baked("map", in_bricks)
    build_loader(tmp_path, "gcc", *flags)
    save_field(tmp_path / "whole.field", surface.texture)
    probes(surface.texture, surface.max_depth, 8, 5).tofile(tmp_path / "points.bin")
    whole = (tmp_path / "whole.field").read_bytes()
    rng = np.random.default_rng(0)
    damaged = [whole[:n] for n in (0, 8, 255, 256, 5000, len(whole) - 1)] + [whole + b"0"]
    for place in (*rng.integers(256, len(whole), 6), 3, 9, 12, 24, 40, 100, 250):
        changed = bytearray(whole)
        changed[place] ^= 0x40
        damaged.append(bytes(changed))
    script = []
    for i, content in enumerate(damaged):
        (tmp_path / f"{i}.field").write_bytes(content)
        script.append(f"./main {i}.field; case $? in 11|12|13) ;; *) exit 1;; esac")
    (tmp_path / "run.sh").write_text("\n".join(script))
    run_command(tool("sh"), "run.sh", cwd=tmp_path)
    assert len(run_loader(tmp_path, "whole.field")) == 8


@pytest.mark.parametrize("flags", [(), ("-DT_POSIX",)])
def test_offset_of_the_heights_lies_behind_the_header(
    baked: Callable[[str], Surface],
    build_loader: Callable[..., None],
    flags: tuple[str, ...],
    tmp_path: Path,
) -> None:
    """Up to it pages are touched before the loop: with 0 the byte before the file was read."""
    surface = baked("map")
    build_loader(tmp_path, "gcc", *flags)
    save_field(tmp_path / "a.field", surface.texture)
    probes(surface.texture, surface.max_depth, 8, 5).tofile(tmp_path / "points.bin")
    for offset in (0, 255):
        content = bytearray((tmp_path / "a.field").read_bytes())
        header = np.frombuffer(content, HEADER, 1)
        header["heights_offset"] = offset
        header["header_checksum"] = zlib.crc32(content[:252])
        (tmp_path / "b.field").write_bytes(content)
        (tmp_path / "run.sh").write_text("./main b.field; test $? -eq 13\n")
        run_command(tool("sh"), "run.sh", cwd=tmp_path)


_CHANGED_LOADER = """
#include <stdio.h>
#include "t.h"

int main(void)
{
    const double at[3] = {1e-4, 2e-4, -1e-4};
    double before[3], after[3];
    t_state state;
    FILE *file;
    t_reset(&state);
    if (t_load("a.field") != 0) {
        return 1;
    }
    t_force(&state, at, before);
    file = fopen("a.field", "wb"); /* cut */
    if (file == NULL || fclose(file) != 0) {
        return 2;
    }
    t_reset(&state);
    t_force(&state, at, after);
    return before[2] == 0.0 || before[0] != after[0] || before[2] != after[2];
}
"""


@pytest.mark.parametrize("flags", [(), ("-DT_POSIX",)])
def test_a_file_that_is_cut_does_not_reach_the_loaded_field(
    baked: Callable[[str], Surface], flags: tuple[str, ...], tmp_path: Path
) -> None:
    surface = baked("map")
    write_source(tmp_path, surface)
    save_field(tmp_path / "a.field", surface.texture)
    (tmp_path / "main.c").write_text(_CHANGED_LOADER)
    command = (tool("gcc"), *STRICT, *SANITIZE, *flags, "main.c", "-o", "main", "-lm")
    run_command(*command, cwd=tmp_path)
    run_command(str(tmp_path / "main"), cwd=tmp_path)


@pytest.mark.parametrize("in_bricks", [False, True])
def test_wrong_checksum_does_not_hide_a_table_that_points_outside(
    baked: Callable[..., Surface],
    build_loader: Callable[..., None],
    tmp_path: Path,
    in_bricks: bool,
) -> None:
    """The checksums of a file can be right and its table wrong: it is refused all the same."""
    surface = baked("map", in_bricks)
    build_loader(tmp_path, "gcc")
    save_field(tmp_path / "a.field", surface.texture)
    content = bytearray((tmp_path / "a.field").read_bytes())
    header = np.frombuffer(content, HEADER, 1)[0]
    table = np.frombuffer(content, "<i4", 4, int(header["columns_offset"]))
    table[0] += 10**6
    header = np.frombuffer(content, HEADER, 1)
    header["checksum"] = zlib.crc32(content[256:])
    header["header_checksum"] = zlib.crc32(content[:252])
    (tmp_path / "b.field").write_bytes(content)
    (tmp_path / "run.sh").write_text("./main b.field; test $? -eq 13\n")
    run_command(tool("sh"), "run.sh", cwd=tmp_path)


def test_law_h_is_exported_baked_only(
    make_texture: Callable[[str], Texture], baked: Callable[[str], Surface]
) -> None:
    with pytest.raises(ParameterError, match="must be baked to export law H"):
        ExportRequest(Surface(make_texture("map"), "H"))
    with pytest.raises(ParameterError, match="load needs a baked field"):
        ExportRequest(Surface(make_texture("map"), "B"), loads_field=True)
    assert ExportRequest(baked("map")).evaluation_budget == 1.0


# --- on a microcontroller -------------------------------------------------------------------------


@pytest.mark.parametrize(("least", "instructions"), [(200_000, 1_180), (130_000, 2_100)])
def test_field_of_256_kb_on_a_microcontroller(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, least: int, instructions: int
) -> None:
    """A field of a periodic texture in flash, in single precision, one by one and in bricks."""
    missing = missing_tool()
    if missing is not None:
        pytest.skip(f"not run: no {missing} here")
    waves = asp.Fourier([1e-4, 6e-5], [[2000.0, 0.0], [0.0, 3000.0]], [0.3, 1.1])
    surface = Surface(waves, "H", 800.0, max_depth=3e-4)
    if least < 200_000:
        monkeypatch.setattr(baking, "BRICK_BYTES", 0)
    surface = asp.bake(surface, 51e-6, press=0.24, max_gain=None)
    field: Any = surface.texture
    size = field.bytes
    assert least < size < 1.31 * least
    firmware = build_firmware(surface, tmp_path)
    points = np.column_stack([250e-6 * np.arange(8), np.zeros(8), np.full(8, -0.05e-3)])
    forces = [[int(part) for part in line.split()[:3]] for line in firmware.output.splitlines()]
    np.testing.assert_allclose(forces, 1e6 * surface.force(points), atol=20.0)
    assert size < firmware.flash < size + 16_000
    assert firmware.ram < 1_000
    assert firmware.instructions < instructions
