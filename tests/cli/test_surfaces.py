"""``asperity surfaces``: the list, its data, and the page of pictures."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image
from tests.report.report_pages import check_alone, check_alts

from asperity.cli.surface_commands import surfaces_command
from asperity.core.errors import ParameterError
from asperity.core.units import parse_quantity
from asperity.report.document.html import render_page
from asperity.report.pages.catalogue_report import find_surfaces, surfaces_page
from asperity.report.pictures.style import svg_text
from asperity.report.pictures.surface_pictures import gallery_figure
from asperity.scene import TEXTURE_KINDS, load_scene
from asperity.textures import Sinusoid
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.kinds.named_surfaces import LIBRARY


def call(*arguments: str) -> Result:
    return CliRunner().invoke(surfaces_command, arguments, env={"COLUMNS": "80"})


def load_json(*arguments: str) -> dict[str, dict]:
    result = call(*arguments, "--json", "-")
    assert result.exit_code == 0
    data = json.loads(result.output)
    assert data["schema"] == 2
    return {surface["name"]: surface for surface in data["surfaces"]}


def test_table_lists_the_catalogue_in_80_columns():
    result = call()
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 80
    # A name starts its row; the further lines of a row are indented.
    names = [line[:16].strip() for line in lines if re.match(r" ?[a-z]", line)]
    assert names[1 : 1 + len(CATALOGUE)] == list(CATALOGUE)
    for word in ("grit=P120", "spacing=420µm", "rms [m]", "duty=0.5", "3.5 mm"):
        assert word in result.stdout


def test_table_shows_size_and_height():
    text = call("tile", "sinusoid").stdout
    assert "0.8 mm" in text
    assert "1.5 mm" in text
    assert "50 mm x" in text


def test_single_name_shows_its_details():
    text = call("sandpaper").stdout
    assert "FEPA 43-1" in text
    assert "P60, P80, P120" in text
    assert "cloth" not in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80


@pytest.mark.parametrize("name", ["Cloth", "cloth:", "CLOTH"])
def test_names_accept_any_case_and_a_colon(name: str):
    assert list(load_json(name)) == ["cloth"]


def test_json_has_all_data_of_the_catalogue():
    content = load_json()
    assert list(content) == list(CATALOGUE)
    assert [name for name, entry in content.items() if entry["named"]] == list(LIBRARY)
    paper = content["sandpaper"]
    assert paper["size"] == pytest.approx([3.5e-3, 3.5e-3])
    assert paper["texture"]["kind"] == "sandpaper"
    assert paper["arguments"][0]["name"] == "grit"
    assert paper["arguments"][0]["choices"][0] == "P60"
    assert content["sinusoid"]["peak_to_valley"] == pytest.approx(0.8e-3)
    assert content["noise"]["arguments"][0] == {
        "name": "rms",
        "description": "root mean square height",
        "unit": "m",
        "default": None,
        "default_description": "",
        "form": "quantity",
        "required": True,
        "choices": [],
    }


def test_specification_matches_the_example_arguments():
    for surface in find_surfaces():
        kind, _, rest = surface.specification.partition(":")
        assert kind == surface.kind.name
        values = dict(part.split("=") for part in rest.split(",") if part)
        assert set(values) == set(surface.kind.example)
        arguments = {argument.name: argument for argument in surface.kind.arguments}
        for name, text in values.items():
            if arguments[name].form == "quantity":
                value = parse_quantity(name, text, arguments[name].unit)
                assert value == pytest.approx(surface.kind.example[name], rel=1e-12)


def test_scenes_accept_the_whole_catalogue():
    assert set(CATALOGUE) <= set(TEXTURE_KINDS)


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_specification_gives_the_same_texture_in_a_scene(name: str):
    surface = find_surfaces([name])[0]
    assert load_scene(surface.specification).texture.describe() == surface.texture.describe()


def test_example_has_every_required_argument():
    for kind in CATALOGUE.values():
        assert {argument.name for argument in kind.required_arguments} <= set(kind.example)
        assert set(kind.example) <= {argument.name for argument in kind.arguments}


def test_html_page_is_complete_and_self_contained(tmp_path: Path):
    path = tmp_path / "surfaces.html"
    result = call("--html", str(path))
    assert result.exit_code == 0
    assert "Report:" in result.stdout
    assert [item.name for item in tmp_path.iterdir()] == ["surfaces.html"]
    page = path.read_text("utf-8")
    assert page.lower().startswith("<!doctype html>")
    assert page.rstrip().endswith("</html>")
    assert path.stat().st_size < 3_000_000
    reader = check_alone(page)
    check_alts(reader, page)
    assert len(reader.alts) == len(CATALOGUE)
    maps = [link for link in reader.loaded if len(link) > 1000]
    assert len(maps) == sum(
        not kind.factory(**kind.example).is_profile for kind in CATALOGUE.values()
    )
    for encoded in maps:
        image = np.asarray(Image.open(io.BytesIO(base64.b64decode(encoded.split(",")[1]))))
        assert image.shape[1] > 200
        assert image[..., :3].std() > 20.0  # something is drawn
    for name, kind in CATALOGUE.items():
        assert f'id="{name}"' in page
        assert f"asperity compare {name}:" in page or f"asperity compare &#39;{name}:" in page
        for argument in kind.arguments:
            assert argument.name in page


def test_pictures_differ_exactly_when_the_surfaces_differ():
    first, repeated, other = (
        svg_text(gallery_figure(Sinusoid(a, 1e-3))) for a in (1e-4, 1e-4, 4e-4)
    )
    assert first == repeated
    assert first != other


def test_page_of_selected_surfaces_has_only_these():
    page = render_page(surfaces_page(find_surfaces(["knurl"])))
    assert page.count("<svg") == 1
    assert "Kinds of textures" not in page


def test_html_is_the_only_output_on_stdout():
    result = call("knurl", "--html", "-")
    assert result.stdout.startswith("<!DOCTYPE html>")
    assert result.stdout.rstrip().endswith("</html>")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["cloht"], "did you mean 'cloth'"),
        (["--json", "-", "--html", "-"], "cannot both go to standard output"),
        (["--json", "/nowhere/at/all.json"], "must lie in a folder that exists"),
        (["--html", "."], "must be a file"),
    ],
)
def test_invalid_input_is_refused_without_output(arguments: list[str], words: str):
    result = call(*arguments)
    assert isinstance(result.exception, ParameterError)
    assert words in str(result.exception)
    assert result.stdout == ""
