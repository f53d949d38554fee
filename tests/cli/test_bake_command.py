"""The command ``bake``: a field of a surface or a body, and what other commands make of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import trimesh
from click.testing import CliRunner, Result

from asperity.cli.main import cli
from asperity.surface import Surface

SURFACE = "fourier:amplitudes=40um;30um,wavevectors=6000rad/m 0;0 5000rad/m"


def call(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(one) for one in arguments])


def test_field_of_a_surface_is_accepted_by_other_commands(tmp_path: Path) -> None:
    path = tmp_path / "waves.field"
    result = call("bake", SURFACE, "-o", path, "--resolution", "40um", "--json", "-")
    assert result.exit_code == 0, result.output
    numbers = json.loads(result.output)
    assert numbers["kind"] == "field"
    analysis = call("analyze", path, "--law", "H", "--json", "-")
    assert json.loads(analysis.output)["q"]["upper"] == numbers["gain"]["upper"] > 1.0
    comparison = call("compare", path, "--json", "-")
    assert comparison.exit_code == 0
    assert '"law": "H"' in comparison.output
    assert '"law": "A"' not in comparison.output


def test_field_is_shown_with_its_accuracy(tmp_path: Path) -> None:
    path = tmp_path / "waves.field"
    baked = call("bake", SURFACE, "-o", path, "--resolution", "40um")
    result = call("show", path)
    words = " ".join(baked.output.split()).replace("; force", "; the file claims: force")
    assert (result.exit_code, " ".join(result.output.split())) == (0, words)
    assert "its contact begins at most" in words
    numbers = json.loads(call("show", path, "--json", "-").output)
    assert numbers["kind"] == "field"
    refused = call("show", path, "--s-cutoff", "1mm")
    assert "was baked already" in str(refused.exception)


def test_existing_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "waves.field"
    path.write_text("mine")
    result = call("bake", SURFACE, "-o", path)
    assert isinstance(result.exception, ValueError)
    assert "--force" in str(result.exception)
    assert path.read_text() == "mine"


def test_body_needs_a_unit_and_renders_its_side(tmp_path: Path) -> None:
    mesh, path = tmp_path / "box.stl", tmp_path / "box.field"
    trimesh.creation.box((10.0, 8.0, 6.0)).export(mesh)
    refused = call("bake", mesh, "--body", "-o", path)
    assert "unit" in str(refused.exception)
    assert not path.exists()
    options = ["--unit", "mm", "--resolution", "0.15mm", "--max-depth", "0.5mm"]
    form = call("bake", mesh, "--body", *options, "--form", "2", "-o", path)
    assert "form does not apply to a body" in str(form.exception)
    press = call("bake", mesh, "--body", *options, "--press", "2N", "-o", path)
    assert "a body is baked down to --max-depth" in " ".join(str(press.exception).split())
    result = call("bake", mesh, "--body", *options, "-o", path)
    assert result.exit_code == 0, result.output
    force = Surface(path, "H", 1000.0).force([[5e-3 - 0.4e-3, 0.0, 0.0]])[0]
    assert force == pytest.approx([0.4, 0.0, 0.0], abs=0.02)


def test_body_is_probed_by_a_ball(tmp_path: Path) -> None:
    """Its force begins a radius outside; a ball larger than the body is refused."""
    mesh, path = tmp_path / "box.stl", tmp_path / "box.field"
    trimesh.creation.box((10.0, 8.0, 6.0)).export(mesh)
    options = ["--unit", "mm", "--resolution", "0.2mm", "--max-depth", "0.5mm", "-o", path]
    refused = call("bake", mesh, "--body", "--tip-radius", "7mm", *options)
    assert "tip_radius must be at most the shortest side of the body, 6 mm" in str(
        refused.exception
    )
    assert not path.exists()
    result = call("bake", mesh, "--body", "--tip-radius", "1mm", *options)
    assert "ball of radius 1 mm, whose centre is the position" in " ".join(result.output.split())
    force = Surface(path, "H", 1000.0).force([[5e-3 + 0.6e-3, 0.0, 0.0]])[0]
    assert force == pytest.approx([0.4, 0.0, 0.0], abs=0.02)


@pytest.mark.parametrize("content", [b"ASPFIELD", b"ASPFIELD" + bytes(400)])
def test_damaged_field_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.field"
    path.write_bytes(content)
    result = call("compare", path)
    assert "bad.field" in str(result.exception)


def test_thin_parts_are_drawn_in_reports(tmp_path: Path) -> None:
    """Of the bake and a comparison of its file; a thick body has no such picture."""
    mesh, path, report = (tmp_path / name for name in ("box.stl", "box.field", "box.html"))
    trimesh.creation.box((8.0, 8.0, 0.8)).export(mesh)
    options = ["--unit", "mm", "--resolution", "0.2mm", "--max-depth", "0.3mm"]
    waist = trimesh.load(mesh).subdivide().subdivide()
    waist.vertices[:, 2] *= 0.5 + 0.5 * (abs(waist.vertices[:, 0]) > 2.5)
    waist.export(mesh)
    made = call("bake", mesh, "--body", *options, "-o", path, "--html", report)
    assert made.exit_code == 0, made.output
    assert "Thin parts" in report.read_text()
    result = call("compare", path, "--html", report, "--force")
    assert result.exit_code == 0, result.output
    assert "1 thin parts, the thinnest with a depth of 200" in report.read_text()
    options[-1] = "0.15mm"
    call("bake", mesh, "--body", *options, "-o", path, "--html", report, "--force")
    assert "Thin parts" not in report.read_text()


def test_repair_is_an_option(tmp_path: Path) -> None:
    pytest.importorskip("networkx", reason="not run: the extra 'meshes' is not installed")
    mesh, path = tmp_path / "open.stl", tmp_path / "box.field"
    box = trimesh.creation.box((10.0, 8.0, 6.0))
    box.update_faces([face != 3 for face in range(12)])
    box.export(mesh)
    options = ["--body", "--unit", "mm", "--resolution", "0.5mm", "--max-depth", "0.5mm"]
    refused = call("bake", mesh, *options, "-o", path)
    assert "3 open edges, one at (" in str(refused.exception)
    assert "repair" in str(refused.exception)
    assert not path.exists()
    result = call("bake", mesh, *options, "--repair", "-o", path)
    assert result.exit_code == 0, result.output
    assert "repaired: 3 open edges" in " ".join(result.output.split())
    alone = call("bake", SURFACE, "--repair", "-o", path, "--force")
    assert "--body" in str(alone.exception)
