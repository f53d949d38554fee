"""Callers of an exported library: the same forces, and refusal of a library that does not fit."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stress import callers
from bench.stress.callers import (
    TOOLS,
    build_caller,
    build_library,
    compile_source,
    count_differing,
    map_surface,
    missing_tool,
    run_caller,
    surface_probes,
)
from tests.helpers.c_programs import COMPILERS, STRICT, run_command, tool

import asperity as asp
from asperity.export.abi import ABI_VERSION
from asperity.export.surface_functions import ExportRequest
from asperity.export.targets import find_target, write_files

CPP = Path(__file__).parent / "cpp"
EXAMPLES = Path(__file__).parents[2] / "examples" / "export"
SCRIPTED = ("Python", "C#", "WebAssembly")


def require(caller: str) -> None:
    """Skip the test if a caller cannot be built or run here."""
    missing = missing_tool(caller)
    if missing is not None:
        pytest.skip(f"not run: no {missing} here")


@pytest.mark.parametrize("caller", TOOLS)
def test_forces_have_the_bits_of_the_kernel(caller: str, tmp_path: Path) -> None:
    require(caller)
    surface = map_surface()
    points = surface_probes(surface, 1000)
    assert count_differing(caller, surface, points, tmp_path) == (0, 0.0)


def test_other_force_is_counted_as_different(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("Python")
    surface = map_surface()
    build = callers.build_library

    def build_stiffer(_surface: Any, folder: Path) -> Path:
        return build(surface.to_stiffness(800.0000001), folder)

    monkeypatch.setattr(callers, "build_library", build_stiffer)
    count, most = count_differing("Python", surface, surface_probes(surface, 400), tmp_path)
    assert count > 100
    assert most > 0.0


def test_sine_of_a_browser_changes_last_bits_alone(tmp_path: Path) -> None:
    require("WebAssembly")
    surface = asp.Surface(asp.Sinusoid(1e-4, 2e-3), "C", 800.0, clamp="backed")
    points = surface_probes(surface, 1000)
    assert count_differing("WebAssembly", surface, points, tmp_path)[1] <= 1e-15


# --- libraries that do not fit -------------------------------------------------------------------


def make_other_abi(folder: Path, number: int = ABI_VERSION + 1) -> None:
    """Turn the source in a folder into that of another ABI, whose state is four times as large."""
    for file in ("texture.h", "texture.c"):
        text = (folder / file).read_text()
        text = text.replace(f"_ABI {ABI_VERSION}\n", f"_ABI {number}\n")
        text = re.sub(r"double memory\[\d+\]", "double memory[100]", text)
        (folder / file).write_text(text.replace(f"_abi_{ABI_VERSION}", f"_abi_{number}"))


@pytest.mark.parametrize("caller", [*SCRIPTED, "Rust", "Unity"])
def test_library_of_another_abi_is_refused_with_both_numbers(caller: str, tmp_path: Path) -> None:
    require(caller)
    surface = map_surface()
    source = tmp_path
    if caller == "Unity":
        command = callers.build_unity_loop(surface, tmp_path)
        command += ["none", "none", "0", "1", "9", *map(str, callers.POSE)]
        source = tmp_path / "Assets" / "Source~"
        make_other_abi(source)
        shutil.copy(compile_source(source), tmp_path)
    else:
        build_library(surface, tmp_path)
        if caller == "WebAssembly":  # the caller is built with its library
            make_other_abi(tmp_path)
        command = build_caller(caller, tmp_path)
        if caller != "WebAssembly":
            make_other_abi(tmp_path)
            compile_source(tmp_path)
    done = run_caller(tmp_path, *command)
    assert done.returncode == 1
    assert re.search(rf"ABI {ABI_VERSION + 1}, this \w+ ABI {ABI_VERSION}\b", done.stderr)


@pytest.mark.parametrize("caller", ["Python", "C#"])
def test_library_without_an_abi_is_refused(caller: str, tmp_path: Path) -> None:
    require(caller)
    build_library(map_surface(), tmp_path)
    command = build_caller(caller, tmp_path)
    compile_source(tmp_path, "-Dtexture_abi_version=texture_nothing")
    done = run_caller(tmp_path, *command)
    assert done.returncode == 1
    assert f"has ABI 0, this program ABI {ABI_VERSION}" in done.stderr


@pytest.mark.parametrize("caller", [*SCRIPTED, "Rust"])
def test_library_in_single_precision_is_refused(caller: str, tmp_path: Path) -> None:
    require(caller)
    build_library(map_surface(), tmp_path, precision="float")
    done = run_caller(tmp_path, *build_caller(caller, tmp_path))
    assert done.returncode == 1
    assert "float" in done.stderr


@pytest.mark.parametrize("caller", ["Python", "C#"])
@pytest.mark.parametrize(("place", "value"), [(4, 1), (18, 0x28)], ids=["32 bit", "ARM"])
def test_library_of_another_machine_is_refused(
    caller: str, place: int, value: int, tmp_path: Path
) -> None:
    """The word size and the processor stand in the header of the file."""
    require(caller)
    library = build_library(map_surface(), tmp_path)
    command = build_caller(caller, tmp_path)
    data = bytearray(library.read_bytes())
    data[place] = value
    library.write_bytes(data)
    done = run_caller(tmp_path, *command)
    assert done.returncode == 1
    assert re.search("cannot be loaded|no library for this word size", done.stderr)
    assert "Traceback" not in done.stderr


def test_library_of_another_surface_is_refused_by_unity(tmp_path: Path) -> None:
    require("Unity")
    command = callers.build_unity_loop(map_surface("C"), tmp_path)
    build_library(map_surface("B"), tmp_path)
    done = run_caller(tmp_path, *command, "none", "none", "0", "1", "9", *map(str, callers.POSE))
    assert done.returncode == 1
    assert f"this script is for double and {map_surface('C').digest}" in done.stderr


@pytest.mark.parametrize(("language", "program"), [("gcc", "loop.c"), ("g++", "values.cpp")])
def test_program_linked_to_another_abi_does_not_load(
    language: str, program: str, tmp_path: Path
) -> None:
    folder = tmp_path
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), "C", 800.0, clamp="backed")
    build_library(surface, folder)
    source = EXAMPLES / program
    if language == "g++":
        source = CPP / program
    flags = (f"-I{folder}", f"-I{EXAMPLES}", source, "-o", folder / "program")
    run_command(tool(language), *flags, f"-L{folder}", "-ltexture", "-lm")
    assert run_caller(folder, folder / "program").returncode == 0
    make_other_abi(folder)
    compile_source(folder)
    done = run_caller(folder, folder / "program")
    assert done.returncode == 127
    assert f"undefined symbol: texture_abi_{ABI_VERSION}" in done.stderr


def test_cpp_value_refuses_another_abi(tmp_path: Path) -> None:
    """One that still has the symbol of the earlier ABI, as no library should."""
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), "C", 800.0, clamp="backed")
    build_library(surface, tmp_path)
    flags = (f"-I{tmp_path}", f"-I{EXAMPLES}", CPP / "values.cpp", "-o", tmp_path / "program")
    run_command(tool("g++"), "-std=c++17", *flags, f"-L{tmp_path}", "-ltexture")
    make_other_abi(tmp_path)
    compile_source(tmp_path, f"-Dtexture_abi_{ABI_VERSION + 1}=texture_abi_{ABI_VERSION}")
    done = run_caller(tmp_path, tmp_path / "program")
    assert f"ABI {ABI_VERSION + 1}, this program ABI {ABI_VERSION}" in done.stderr


# --- the ABI itself ------------------------------------------------------------------------------

_FACTS = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "texture.h"

int main(void)
{
    const uint32_t sizes[] = {0, 7, 8, 40, sizeof(texture_facts), sizeof(texture_facts) + 64};
    texture_facts all;
    for (int k = 0; k < 6; k++) {
        unsigned char *asked = (unsigned char *)malloc(sizes[k] < 4 ? 4 : sizes[k]);
        memset(asked, 0xAA, sizes[k] < 4 ? 4 : sizes[k]);
        memcpy(asked, &sizes[k], 4);
        printf("%u ", (unsigned)texture_info((texture_facts *)(void *)asked));
        free(asked);
    }
    printf("%zu %zu ", sizeof(texture_facts), sizeof(texture_state));
    all.size = sizeof all;
    texture_info(&all);
    printf("%u %u %u %u ", all.size, all.abi, all.real_size, all.state_size);
    printf("%g %g %g %g %g %g ", all.stiffness, all.max_depth, all.q, all.q_plus, all.max_force,
           all.max_press);
    printf("%g %g %g %g %d ", all.friction, all.presliding_stiffness, all.friction_modulation,
           all.max_deflection, (int)all.holds_deeper);
    printf("%s %s %s", all.precision, all.content, all.law);
    return 0;
}
"""


@pytest.mark.parametrize("compiler", COMPILERS)
def test_facts_are_filled_as_far_as_the_caller_has_room(compiler: str, tmp_path: Path) -> None:
    surface = asp.Surface(
        asp.Sinusoid(1e-4, 2e-3), "C", 800.0, friction=0.4, friction_modulation=0.5, clamp="backed"
    )
    asp.export_code(surface, tmp_path / "texture.h")
    (tmp_path / "main.c").write_text(_FACTS)
    sanitize = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0")
    flags = (*STRICT, *sanitize, "-Wno-overflow", tmp_path / "main.c", "-lm")
    run_command(tool(compiler), *flags, "-o", tmp_path / "main")
    *numbers, precision, content, letter, law = run_command(tmp_path / "main").split()
    assert (precision, content, f"{letter} {law}") == ("double", surface.digest, str(surface.law))
    facts, state = numbers[6:8]
    assert numbers[:6] == ["0", "0", "8", "40", facts, facts]
    assert numbers[8:14] == [facts, str(ABI_VERSION), "8", state, "800", "0.0002"]
    q, q_plus, max_force, max_press = map(float, numbers[14:18])
    assert q == pytest.approx(asp.characteristic_number(surface).upper, rel=1e-5)
    assert q_plus == pytest.approx(asp.one_sided_number(surface).upper, rel=1e-5)
    line = np.column_stack([np.linspace(0, 2e-3, 400), np.zeros(400), np.full(400, -1e-4)])
    forces = surface.force(line)
    path = surface.trace(np.tile(line, (2, 1)))  # with friction
    assert max_force == pytest.approx(np.linalg.norm(path, axis=1).max(), rel=1e-3)
    assert max_force > 1.02 * np.linalg.norm(forces, axis=1).max()
    assert max_press == pytest.approx(forces[:-1, 2].mean(), rel=1e-2)
    assert numbers[18:] == ["0.4", "200", "0.5", "0", "1"]


def test_abi_has_the_layout_of_its_number(tmp_path: Path) -> None:
    """Raise the number with whatever changes here, and then only add a line."""
    layouts = {1: "texture_abi_1 208 104 200 136 texture_abi_1_float"}
    found = []
    for precision in ("double", "float"):
        folder = tmp_path / precision
        folder.mkdir()
        library = build_library(map_surface(), folder, precision=precision)
        symbols = run_command(tool("nm"), "-D", "--defined-only", library)
        found += re.findall(r"texture_abi_\d\w*", symbols)
        source = '#include <stdio.h>\n#include "texture.h"\nint main(void)\n{\n'
        sizes = "sizeof(texture_state), sizeof(texture_facts), offsetof(texture_facts, law)"
        (folder / "main.c").write_text(f'{source}printf("%zu %zu %zu", {sizes});\nreturn 0;\n}}\n')
        flags = (*STRICT, folder / "main.c", folder / "texture.c", "-DTEXTURE_BUILD", "-lm")
        run_command(tool("gcc"), *flags, "-o", folder / "main")
        found += run_command(folder / "main").split()
    linked, state, facts, law, single, single_state, *_facts = found
    assert " ".join([linked, state, single_state, facts, law, single]) == layouts[ABI_VERSION]


_NEVER_RESET = """
#include <stdio.h>
#include <string.h>
#include "t.h"
#include "other.h"

int main(void)
{
    const int bytes[] = {0x00, 0xAA, 0xFF, 0x7F};
    const double at[3] = {1e-4, 2e-4, -5e-5}, beside[3] = {9e-4, 7e-4, -5e-5};
    double f[3];
    t_state state;
    other_state other;
    for (int k = 0; k < 4; k++) {
        memset(&state, bytes[k], sizeof state);
        t_force(&state, at, f);
        printf("%a %a %a\\n", f[0], f[1], f[2]);
    }
    other_reset(&other);
    other_force(&other, beside, f);
    memcpy(&state, &other, sizeof state);
    t_force(&state, at, f);
    printf("%a %a %a\\n", f[0], f[1], f[2]);
    return 0;
}
"""


@pytest.mark.parametrize("law", "DF")
def test_state_that_was_never_reset_is_reset(law: str, tmp_path: Path) -> None:
    surface = map_surface(law)
    for name, one in {"t": surface, "other": surface.to_stiffness(700.0)}.items():
        request = ExportRequest(one, name)
        write_files(tmp_path / f"{name}.h", find_target("c99"), request, force=False)
    (tmp_path / "main.c").write_text(_NEVER_RESET)
    sanitize = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0")
    flags = (*STRICT, *sanitize, tmp_path / "main.c", "-o", tmp_path / "main", "-lm")
    run_command(tool("gcc"), *flags)
    first, *rest = run_command(tmp_path / "main").splitlines()
    assert rest == 4 * [first]
    assert float.fromhex(first.split()[2]) != 0.0
