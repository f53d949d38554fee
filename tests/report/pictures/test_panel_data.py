"""The data and descriptions extracted from pictures, and their SVG for a page."""

from __future__ import annotations

import json
import math
import re
from importlib import resources

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from asperity.report.pictures import style
from asperity.report.pictures.panel_data import extract_panels, panels_to_json, ranges_text
from asperity.report.pictures.style import svg_text

HOSTILE = "</script><b>"


def two_panels() -> Figure:
    """Return lines beside a sheared mesh whose value is its x in mm, with a bar."""
    figure = style.new_figure(8.0, 3.0)
    left, right = style.axes_grid(figure, 2, 2, x="x [mm]", y="z [µm]", sharey=False)
    left.plot(np.linspace(0.0, 2.0, 9), np.linspace(-1.0, 1.0, 9), label="_rise")
    left.plot([0.0, 0.3, 2.0], [0.0, math.nan, 5.0], label=HOSTILE)
    left.plot([0.0, 2.0], [9.0, 9.0])  # without a label: decoration
    left.axhline(3.0, label="border")
    style.set_panel_title(left, "A", "first")
    style.mark_law(left, "A")
    x, part = np.meshgrid(np.linspace(0.0, 2.0, 41), np.linspace(0.0, 1.0, 21), indexing="ij")
    z = -1.0 + part * (1.0 + 0.5 * x)  # from −1 up to 0.5 x
    middles = 0.5 * (x[1:, 1:] + x[:-1, 1:])
    mesh = right.pcolormesh(x, z, middles, rasterized=True)
    right.set_xlim(0.0, 2.0)
    right.set_ylim(-1.0, 1.0)
    style.add_colorbar(figure, mesh, right, "curl [N/m]: white is none")
    return figure


@pytest.fixture(scope="module")
def rendered() -> tuple[str, Figure]:
    figure = two_panels()
    return svg_text(figure), figure


def test_labelled_lines_and_axis_names_are_extracted(rendered: tuple[str, Figure]) -> None:
    left, right = extract_panels(rendered[1])
    assert (left.name, left.law, left.x, left.y) == ("A, first", "A", "x [mm]", "z [µm]")
    assert [one.name for one in left.series] == ["rise", HOSTILE]
    assert right.y == "z [µm]"  # taken from the neighbour, which labels the shared axis
    assert right.series == []


def test_field_values_are_extracted_at_their_positions(rendered: tuple[str, Figure]) -> None:
    field = extract_panels(rendered[1])[1].field
    assert field is not None
    assert field.name == "curl [N/m]"
    rows, columns = field.values.shape
    x = (np.arange(columns) + 0.5) * 2.0 / columns
    z = -1.0 + (np.arange(rows) + 0.5) * 2.0 / rows
    # Cell edges are straight between corners; half a cell is 25 µm.
    inside = z[:, None] < 0.5 * x - 0.03
    assert np.nanmax(np.abs(field.values - x)[inside]) <= 0.026
    assert np.isnan(field.values[z[:, None] > 0.5 * x + 0.03]).all()
    assert not np.isnan(field.values[inside]).any()


def test_image_with_lower_origin_is_extracted_bottom_row_first() -> None:
    figure = style.new_figure(4.0, 3.0)
    axes = style.single_axes(figure)
    axes.imshow(np.array([[1.0, 2.0], [3.0, math.nan]]), origin="lower", extent=(0, 4, 0, 2))
    svg_text(figure)
    field = extract_panels(figure)[0].field
    assert field is not None
    assert (field.values[0, 0], field.values[0, -1], field.values[-1, 0]) == (1.0, 2.0, 3.0)
    assert math.isnan(field.values[-1, -1])


def test_json_of_panels_cannot_close_a_script_element(rendered: tuple[str, Figure]) -> None:
    text = panels_to_json(extract_panels(rendered[1]))
    assert "<" not in text
    left, right = json.loads(text)
    assert left["series"][0]["x"] == {"from": 0, "to": 2, "count": 9}
    assert left["series"][1] == {"name": HOSTILE, "law": "A", "x": [0, 0.3, 2], "y": [0, None, 5]}
    assert left["x"]["scale"] == "linear"
    assert len(right["field"]["values"]) % right["field"]["columns"] == 0


def test_description_states_the_ranges(rendered: tuple[str, Figure]) -> None:
    words = ranges_text(extract_panels(rendered[1]))
    assert "Rise, z [µm]: −1 to 1 in A, first." in words
    assert "Curl [N/m]: 0.025 to 1.98." in words


def test_description_of_many_panels_names_the_extremes() -> None:
    figure, panels = style.law_panels(4, 2.0, 0.5, x="x", y="force [N]")
    for axes, letter, size in zip(panels, "ABCD", (2.0, 1.0, 9.0, 3.0), strict=True):
        axes.plot([0.0, 1.0], [-size, size], label="f")
        style.set_panel_title(axes, letter, "")
    words = ranges_text(extract_panels(figure))
    assert words == " F, force [N]: varies most in C, −9 to 9, and least in B, −1 to 1."


def test_description_lists_single_points_up_to_a_limit() -> None:
    figure = style.new_figure(4.0, 3.0)
    axes = style.single_axes(figure)
    style.label_axes(axes, "T", "S")
    for number in range(13):
        assert f"{number} points" not in ranges_text(extract_panels(figure))
        axes.plot(number, 2 * number, "o", label=f"_P{number}")
        if number == 1:
            assert ranges_text(extract_panels(figure)) == " T and S: P0 at 0, 0; P1 at 1, 2."
    assert ranges_text(extract_panels(figure)) == " 13 points."


# --- as SVG ---------------------------------------------------------------------------------------


def test_svg_text_is_reproducible(rendered: tuple[str, Figure]) -> None:
    assert svg_text(two_panels()) == rendered[0]


def test_svg_has_only_referenced_and_unique_identifiers(rendered: tuple[str, Figure]) -> None:
    text = rendered[0]
    references = set(re.findall(r'(?:url\(|href=")#([^")]+)', text))
    identifiers = re.findall(r' id="([^"]+)"', text)
    assert references == set(identifiers)
    assert len(references) == len(identifiers) > 5
    assert 'data-law="A"' in text
    assert text.count('class="shared"') >= 4  # two axes of each panel
    other = svg_text(Figure())
    assert not references & set(re.findall(r' id="([^"]+)"', other))


def test_palette_colours_become_theme_variables(rendered: tuple[str, Figure]) -> None:
    for colour in style.THEME_VARIABLES:
        assert f": {colour}" not in rendered[0]
    assert f"var(--p-ink, {style.INK})" in rendered[0]


def luminance(colour: str) -> float:
    parts = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in to_rgb(colour)]
    return float(np.dot(parts, (0.2126, 0.7152, 0.0722)))


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2.2: 21 for black on white."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_theme_colours_have_enough_contrast() -> None:
    css = resources.files("asperity.report").joinpath("templates", "style.css").read_text("utf-8")
    dark = dict(re.findall(r"--p-(\w+): (#[0-9a-f]{6})", css))
    light = {name: colour for colour, name in style.THEME_VARIABLES.items() if colour != "#000000"}
    assert set(dark) == set(light)
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    for theme in (light, dark):
        for name, least in {
            "ink": 7.0,
            "soft": 4.5,
            "blue": 3.0,
            "orange": 3.0,
            "green": 3.0,
        }.items():
            assert contrast(theme[name], theme["card"]) >= least, (name, theme)
        # Ink on the full colours of the curl, and these on the ground; no curl is clear.
        for colour in map(to_hex, style.CURL([0.0, 1.0])):
            assert contrast(theme["ink"], colour) >= 3.0
            assert contrast(theme["card"], colour) >= 3.0
        assert contrast(theme["card"], theme["free"]) > 1.1
    assert style.CURL([0.0, 0.5, 1.0])[:, 3] == pytest.approx([1.0, 0.0, 1.0], abs=0.005)
