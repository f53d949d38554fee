"""Exported C under AddressSanitizer and UndefinedBehaviorSanitizer."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import (
    COMPILERS,
    STRICT,
    as_exported,
    header,
    kernel_ticks,
    probes,
    run_command,
    tool,
)

from asperity.surface import Surface
from asperity.textures import HeightMap, Profile, Texture

SANITIZE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0", "-g")
LAWS = "BDFH"
_MAIN = """
static int {name}_run(const char *file)
{{
    {number} at[3], f[3];
    {name}_state state;
    FILE *in = fopen(file, "rb");
    if (in == NULL) {{
        return 1;
    }}
    {name}_reset(&state);
    while (fread(at, sizeof at[0], 3, in) == 3) {{
        {name}_force(&state, at, f);
        fwrite(f, sizeof f[0], 3, stdout);
    }}
    return fclose(in);
}}
"""


def _program(names: list[str], number: str = "double") -> str:
    includes = "".join(f'#include "{name}.h"\n' for name in names)
    calls = " || ".join(f'{name}_run("{name}.bin")' for name in names)
    runs = "".join(_MAIN.format(name=name, number=number) for name in names)
    return f"#include <stdio.h>\n{includes}{runs}int main(void)\n{{\n    return {calls};\n}}\n"


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("kind", ["sinusoid", "fourier", "steep map", "periodic profile"])
def test_sanitizers_find_no_undefined_behaviour(
    kind: str, compiler: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    texture = make_texture(kind)
    digest = hashlib.sha256()
    for x in LAWS:
        surface = as_exported(Surface(texture, x, clamp="backed"))
        (tmp_path / f"{x}.h").write_text(header(surface, x))
        points = probes(texture, surface.max_depth, 80 if x == "H" else 400, 21)
        # Positions beyond all borders and positions that are not finite.
        far = [[9e2, -9e2, -1e-4], [np.nan, 0, -1e-4], [np.inf, 0, 0], [0, 0, -1e30], [1e3, 0, 0]]
        points = np.vstack([points, far[:1] if x != "H" else points[:1], far[1:4]])
        points.tofile(tmp_path / f"{x}.bin")
        inside = kernel_ticks(surface, np.ascontiguousarray(points[:-3]))[:, :3]
        digest.update(np.vstack([inside, np.zeros((3, 3))]).tobytes())
    (tmp_path / "main.c").write_text(_program(list(LAWS)))
    run_command(tool(compiler), *STRICT, *SANITIZE, "main.c", "-o", "main", "-lm", cwd=tmp_path)
    (tmp_path / "run.sh").write_text("./main > forces.bin\n")
    run_command(tool("sh"), "run.sh", cwd=tmp_path)
    output = (tmp_path / "forces.bin").read_bytes()
    assert hashlib.sha256(output).hexdigest() == digest.hexdigest()


@pytest.mark.parametrize("compiler", COMPILERS)
def test_search_far_from_the_origin_stays_in_its_arrays(compiler: str, tmp_path: Path) -> None:
    """In single precision, boxes there cannot be halved, and at last cells are below rounding."""
    rng = np.random.default_rng(3)
    heights = rng.normal(size=(33, 41))
    textures = {
        "profile": Profile(3e-5 * rng.normal(size=60), 1e-4, periodic=True),
        "map": HeightMap(2e-7 * heights, (1e-6, 1e-6)),
        "periodic_map": HeightMap(2e-10 * heights, (1e-9, 1e-9), periodic=True),
    }
    distances = np.repeat([1e-3, 1e-2, 0.3, 1.0, 10.0, 100.0, 700.0], 40)[:, None]
    points = distances * rng.uniform(-1.0, 1.0, (len(distances), 3))
    points[:, 2] = -(10.0 ** rng.uniform(-7.0, -1.0, len(points)))
    for name, texture in textures.items():
        text = header(as_exported(Surface(texture, "D")), name, "float")
        (tmp_path / f"{name}.h").write_text(text)
        points.astype(np.float32).tofile(tmp_path / f"{name}.bin")
    (tmp_path / "main.c").write_text(_program(list(textures), "float"))
    run_command(tool(compiler), *STRICT, *SANITIZE, "main.c", "-o", "main", "-lm", cwd=tmp_path)
    (tmp_path / "run.sh").write_text("./main > forces.bin\n")
    run_command(tool("sh"), "run.sh", cwd=tmp_path)
    forces = np.fromfile(tmp_path / "forces.bin", np.float32)
    assert forces.size == len(textures) * points.size
    assert np.isfinite(forces).all()


@pytest.mark.parametrize("compiler", COMPILERS)
def test_sanitizers_detect_an_index_out_of_bounds(
    compiler: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    text = header(Surface(make_texture("map"), "B"), "B")
    assert "B_data_c[i][j + 3]" in text
    (tmp_path / "B.h").write_text(text.replace("B_data_c[i][j + 3]", "B_data_c[i][j + 300]"))
    np.array([[0.0, 0.0, -1e-4]]).tofile(tmp_path / "B.bin")
    (tmp_path / "main.c").write_text(_program(["B"]))
    run_command(tool(compiler), *STRICT, *SANITIZE, "main.c", "-o", "main", "-lm", cwd=tmp_path)
    with pytest.raises(RuntimeError, match=r"out of bounds|overflow"):
        run_command(tmp_path / "main", cwd=tmp_path)
