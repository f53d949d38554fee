"""``asperity export``: the C files that it writes, its options and its errors."""

from __future__ import annotations

import errno
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest
from tests.helpers.c_programs import STRICT, run_command, tool

import asperity as asp
from asperity.analysis.passivity.recommended_stiffness import render_on_device
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.arguments import FIELD
from asperity.export import c99
from asperity.export import targets as writing
from asperity.export.export_surface import fit_surface
from asperity.export.surface_functions import ExportRequest

FILE = ("--pitch", "50um", "--unit", "m")
Call = Callable[..., tuple[int, str, str]]
WAVE = "sinusoid:amplitude=0.2mm,period=2mm"
MAIN = '#include <stdio.h>\n#include "{stem}.h"\nint main(void)\n{{\n{body}\n    return 0;\n}}\n'


def run_exported(folder: Path, stem: str, name: str, *sources: str) -> list[str]:
    """Compile a program that includes an exported header; return the words that it prints."""
    body = f"""    {name}_state state;
    const double at[3] = {{1e-4, 2e-4, -5e-5}};
    double f[3];
    {name}_reset(&state);
    {name}_force(&state, at, f);
    printf("%a %a %a %s", f[0], f[1], f[2], {name.upper()}_CONTENT);"""
    (folder / "main.c").write_text(MAIN.format(stem=stem, body=body))
    run_command(tool("gcc"), *STRICT, "-O1", "main.c", *sources, "-o", "main", "-lm", cwd=folder)
    return run_command(folder / "main").split()


def test_exported_header_gives_the_force_of_the_surface(call: Call, tmp_path: Path) -> None:
    target = tmp_path / "wall.h"
    code, out, err = call("export", WAVE, "--law", "B", "--stiffness", "500N/m", "-o", str(target))
    assert (code, err) == (0, "")
    assert out.startswith(f"Written: {target}\n")
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "B", 500.0, clamp="backed")
    *force, content = run_exported(tmp_path, "wall", "texture")
    expected = surface.force([1e-4, 2e-4, -5e-5])
    assert [float.fromhex(part) for part in force] == pytest.approx(expected, rel=1e-14)
    text = target.read_text()
    assert content == surface.digest  # as a recording has it
    assert "#define TEXTURE_STIFFNESS 500.0" in text
    assert "#define TEXTURE_MAX_DEPTH 0.0004" in text
    q = re.search(r"#define TEXTURE_Q_UPPER (\S+)", text)
    assert q is not None
    assert float(q[1]) == asp.characteristic_number(surface).upper


def test_header_comment_describes_the_law_and_the_device(call: Call, tmp_path: Path) -> None:
    call("export", WAVE, "--law", "C", "--device", "touch", "-o", str(tmp_path / "t.h"))
    comment = (tmp_path / "t.h").read_text().split("#ifndef")[0]
    for words in (
        "f = k δ w",
        "closed form",
        "backed",
        "Touch",
        asp.__version__,
        "0 J per period",
        "every depth",
        "period = 0.002",
        "heights -200 µm to 200 µm",
    ):
        assert words in comment, words
    assert "between" not in comment


def test_header_of_a_baked_field_has_each_number_once(call: Call, tmp_path: Path) -> None:
    target = tmp_path / "t.h"
    np.save(tmp_path / "map.npy", 1e-5 * np.sin(np.add.outer(np.arange(24.0), np.arange(32.0))))
    call("export", str(tmp_path / "map.npy"), *FILE, "--law", "H", "-o", str(target))
    comment = target.read_text().split("#ifndef")[0]
    assert comment.index("The exact law:") < comment.index("q⁺ = 1")
    assert re.search(r"q\+ +1\.[\d.]+ to 1\.\d+ \(certified\)", comment)
    assert "{" not in comment.split(" * surface ")[1]


def test_content_digest_depends_on_the_law_and_not_on_the_name(call: Call, tmp_path: Path) -> None:
    contents = {}
    for name, law in (("texture", "B"), ("wall", "B"), ("texture", "A")):
        target = tmp_path / f"{name}_{law}.h"
        call("export", WAVE, "--law", law, "--name", name, "-o", str(target))
        match = re.search(r'_CONTENT "(\w+)"', target.read_text())
        assert match is not None
        contents[name, law] = match[1]
    assert contents["texture", "B"] == contents["wall", "B"] != contents["texture", "A"]


@pytest.mark.parametrize(
    ("options", "budget"),
    [((), "1500.0"), (("--max-evaluations", "90"), "90"), (("--exact",), "HUGE_VAL")],
)
def test_evaluation_budget_is_written_to_the_header(
    options: tuple[str, ...], budget: str, call: Call, tmp_path: Path
) -> None:
    target = tmp_path / "t.h"
    assert call("export", WAVE, "--law", "D", *options, "-o", str(target))[0] == 0
    assert f"#define TEXTURE_MAX_EVALUATIONS {budget} " in target.read_text()


def test_scene_sets_law_and_clamp_and_options_override_them(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.2 mm"\nperiod = "2 mm"\n'
        '[surface]\nlaw = "A"\nstiffness = "700 N/m"\nclamp = "none"\n'
    )
    assert call("export", str(scene), "-o", str(tmp_path / "a.h"))[0] == 0
    assert call("export", str(scene), "-o", str(tmp_path / "b.h"), "--clamp", "whole")[0] == 0
    assert "clamp     none; meant to be pressed to 400 µm" in (tmp_path / "a.h").read_text()
    assert "clamp     whole, the depth is held at 400 µm" in (tmp_path / "b.h").read_text()


@pytest.fixture
def large_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the path of a measured map whose data exceed the limit of a header."""
    monkeypatch.setattr(c99, "MAX_HEADER_DATA", 5_000)
    rng = np.random.default_rng(3)
    path = tmp_path / "large.npy"
    np.save(path, 1e-4 * rng.normal(size=(30, 40)))
    return path


def test_large_data_are_written_to_a_separate_source(
    call: Call, large_map: Path, tmp_path: Path
) -> None:
    target = tmp_path / "m.h"
    options = ("--pitch", "0.2mm", "--law", "D", "--max-depth", "0.2mm")
    assert call("export", str(large_map), *options, "-o", str(target))[0] == 0
    source = tmp_path / "m_data.c"
    assert "_data_c[32][42] = {" in source.read_text()
    assert "_data_c[32][42] = {" not in target.read_text()
    *force, _content = run_exported(tmp_path, "m", "texture", str(source))
    texture = asp.load_texture(large_map, pitch=2e-4)
    expected = asp.Surface(texture, "D").force([1e-4, 2e-4, -5e-5])
    assert [float.fromhex(part) / 1.0 for part in force] != [0.0, 0.0, 0.0]
    ratio = np.array([float.fromhex(part) for part in force]) / expected
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-14)  # the stiffness is the device's
    run_command(tool("gcc"), *STRICT, "-c", source, "-o", tmp_path / "m_data.o")
    # The second export finds both files.
    target.unlink()
    code, _out, err = call("export", str(large_map), *options, "-o", str(target))
    assert code == 2
    assert err == f"asperity: output exists: {source}; --force replaces it\n"
    assert not target.exists()


def test_full_disk_leaves_no_partial_export(
    call: Call, large_map: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A header without its data file would not compile."""
    folder = tmp_path / "full"
    folder.mkdir()
    open_atomic = writing.open_atomic

    @contextmanager
    def open_on_full_disk(path: Path) -> Iterator[IO[bytes]]:
        with open_atomic(path) as stream:
            if path.suffix == ".c":
                raise OSError(errno.ENOSPC, "No space left on device")
            yield stream

    monkeypatch.setattr(writing, "open_atomic", open_on_full_disk)
    options = ("--pitch", "0.2mm", "--law", "B", "-o", str(folder / "m.h"))
    code, _out, err = call("export", str(large_map), *options)
    assert code == 2
    assert err.startswith("asperity: output cannot be written: No space left on device")
    assert not list(folder.iterdir())


def test_error_for_too_much_data_names_the_size_that_fits(
    call: Call, large_map: Path, tmp_path: Path
) -> None:
    target = str(tmp_path / "m.h")
    options = ("--pitch", "0.2mm", "--law", "B", "-o", target, "--max-data")
    code, _out, err = call("export", str(large_map), *options, "8kB")
    assert code == 2
    match = re.search(r"max_data must be at least (\d+) bytes.* at most (\d+) x (\d+) points", err)
    assert match is not None
    assert int(match[1]) == 32 * 42 * 8
    assert 8 * int(match[2]) * int(match[3]) <= 8_000 * 1.1
    assert call("export", str(large_map), *options, match[1] + "B")[0] == 0
    # With the tree of a search beside the heights the message still gives the size of the map.
    code, _out, err = call(
        "export", str(large_map), "--force", *options[:3], "D", *options[4:], "8kB"
    )
    match = re.search(r"at most (\d+) x (\d+) points", err)
    assert match is not None
    assert int(match[1]) / int(match[2]) == pytest.approx(32 / 42, rel=0.1)


def test_map_is_coarsened_until_it_fits(call: Call, large_map: Path, tmp_path: Path) -> None:
    target = tmp_path / "m.h"
    options = ("--pitch", "0.2mm", "--law", "D", "-o", str(target), "--max-bytes")
    code, out, err = call("export", str(large_map), *options, "6kB")
    assert (code, err) == (0, "")
    match = re.search(
        r"resampled to (\d+) x (\d+) of 40 x 30 points: heights differ by (\S+) (\S+) \(", out
    )
    assert match is not None
    counts = int(match[1]), int(match[2])
    whole = asp.load_texture(large_map, pitch=0.2e-3)
    coarse = whole.coarsened(max(counts[0] / 40, counts[1] / 30) + 1e-9)
    assert coarse is not None
    assert tuple(coarse.grid_counts()) == counts
    surface = asp.Surface(coarse, "D", clamp="backed")
    assert 5000 < c99.data_size(ExportRequest(surface)) <= 6000
    points = np.random.default_rng(1).uniform(0.0, 5.7e-3, (4000, 2))
    lost = np.abs(whole.height(points) - coarse.height(points)).max()
    unit = {"mm": 1e-3, "µm": 1e-6, "nm": 1e-9}[match[4]]
    assert 0.3 * float(match[3]) * unit < lost <= 1.01 * float(match[3]) * unit
    code, out, _err = call("export", str(large_map), "--force", *options, "64kB")
    assert code == 0
    assert "resampled" not in out
    for size in ("90B", "0B"):
        code, _out, err = call("export", str(large_map), "--force", *options, size)
        assert code == 2
        assert err.startswith("asperity: max_bytes is too small: no coarser map or field")


def test_field_is_baked_again_until_it_fits(call: Call, tmp_path: Path) -> None:
    source = tmp_path / "gentle.npy"
    wave = np.cos(np.linspace(0.0, 2.0 * np.pi, 13))
    np.save(source, 3e-5 * wave[:, None] * wave)
    options = ("--pitch", "0.2mm", "--law", "H", "-o", str(tmp_path / "m.h"), "--max-bytes")
    texture = asp.load_texture(source, pitch=0.2e-3)
    whole = render_on_device(asp.Surface(texture, "H"), asp.load_device(DEFAULT_DEVICE), FIELD)
    limit = c99.data_size(ExportRequest(whole)) // 2
    small = fit_surface(whole, limit, {})
    assert 0.7 * limit < c99.data_size(ExportRequest(small)) <= limit
    field: Any = small.texture
    assert field.accuracy.share > 1.5 * whole.texture.accuracy.share
    code, out, err = call("export", str(source), *options, f"{limit}B")
    assert (code, err) == (0, "")
    assert f"To fit: Law H baked as a potential field: {field.arguments.c.size} nodes" in out
    assert f"force {100 * field.accuracy.share:.2g} % RMS from exact H" in out
    code, _out, err = call("export", str(source), "--force", *options, "50B")
    assert code == 2
    assert err.startswith("asperity: max_bytes is too small: no coarser map or field")


BAD = {
    ("--name", "2fast"): "name must be a C identifier: letters, digits and single _, a letter "
    "first, got '2fast'",
    ("--name", "my-wall"): "name must be a C identifier",
    ("--name", "double"): "name must not be a reserved word of C or C++, got 'double'",
    ("--name", "class"): "name must not be a reserved word of C or C++",
    ("--name", "a__b"): "name must be a C identifier",
    ("--lang", "fortran"): "lang is unknown: 'fortran'; known: c99, unity",
    ("--precision", "half"): "precision must be one of double, float",
    ("--clamp", "soft"): "clamp must be one of none, whole, lateral, backed",
    ("-o", "wall.txt"): "output must be a file that ends in .h",
    ("-o", "./"): "output must be a file that ends in .h, got '.'",
    ("-o", "no/such/folder/wall.h"): "output must lie in a folder that exists",
    ("--law", "Z"): "law",
    ("--max-data", "soft"): "max_data",
    ("--max-evaluations", "0"): "max_evaluations must be positive, got 0",
    ("--max-evaluations", "many"): "max_evaluations must be a number, got 'many'",
    ("--exact", "--max-evaluations", "9"): "exact searches without a budget: leave out "
    "--max-evaluations",
}


@pytest.mark.parametrize("options", BAD, ids=" ".join)
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    options: tuple[str, ...], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    output = () if options[0] == "-o" else ("-o", "wall.h")
    code, out, err = call("export", WAVE, *output, *options)
    assert (code, out) == (2, "")
    assert err.startswith(f"asperity: {BAD[options]}")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_existing_file_is_replaced_only_with_force(call: Call, tmp_path: Path) -> None:
    target = tmp_path / "t.h"
    target.write_text("mine")
    code, _out, err = call("export", WAVE, "--law", "C", "-o", str(target))
    assert (code, err) == (2, f"asperity: output exists: {target}; --force replaces it\n")
    assert target.read_text() == "mine"
    assert call("export", WAVE, "--law", "C", "-o", str(target), "--force")[0] == 0
    assert "texture_force" in target.read_text()


def test_law_without_a_c_equivalent_is_refused(call: Call, tmp_path: Path) -> None:
    module = tmp_path / "mine.py"
    module.write_text(
        "import sympy as sp\nimport asperity as asp\n"
        "LAW = asp.Law('Q', 'odd', 'vertical', lambda c: c.k * c.depth * sp.Abs(sp.gamma("
        "1 + c.depth)) * c.e_z)\n"
    )
    target = tmp_path / "t.h"
    code, _out, err = call("export", WAVE, "--plugin", str(module), "--law", "Q", "-o", str(target))
    assert code == 2
    assert err.count("\n") == 1
    assert not target.exists()
