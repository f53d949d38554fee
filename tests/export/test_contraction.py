"""The exported header disables fused multiply-add, which would change the last bits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.helpers.c_programs import COMPILERS, header, run_command, tool

from asperity.surface import Surface
from asperity.textures import Texture


def _count_fused(compiler: str, language: str, text: str, folder: Path) -> int:
    """Return the number of fused operations that a compiler generates for a header."""
    (folder / "t.h").write_text(text)
    (folder / "t.c").write_text(
        '#include "t.h"\nvoid f(t_state *s, const double *p, double *f)\n'
        "{ t_force(s, p, f); }\ndouble g(double a, double b) { return a * b; }\n"
    )
    kind = ("-x", "c++") if "++" in language else ()
    flags = (*kind, f"-std={language}", "-O2", "-mfma", "-S", "-o", "-")
    return run_command(tool(compiler), *flags, "t.c", cwd=folder).count("vfm")


@pytest.mark.parametrize("compiler", COMPILERS)
def test_compilers_generate_no_fused_operations(
    compiler: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    text = header(Surface(make_texture("map"), "F"), "t")
    for language in ("c99", "gnu99", "c++17", "gnu++17"):
        assert _count_fused(compiler, language, text, tmp_path) == 0, language
    unprotected = text.replace('#pragma GCC optimize ("fp-contract=off")', "")
    unprotected = unprotected.replace("#pragma STDC FP_CONTRACT OFF", "#pragma STDC FP_CONTRACT ON")
    assert _count_fused(compiler, "gnu99", unprotected, tmp_path) > 20


@pytest.mark.parametrize("compiler", COMPILERS)
def test_fast_math_is_a_compile_error(compiler: str, wave: Texture, tmp_path: Path) -> None:
    (tmp_path / "t.h").write_text(header(Surface(wave, "B"), "t"))
    (tmp_path / "t.c").write_text('#include "t.h"\n')
    with pytest.raises(RuntimeError, match="compile without -ffast-math"):
        run_command(tool(compiler), "-ffast-math", "-c", "t.c", "-o", "t.o", cwd=tmp_path)
