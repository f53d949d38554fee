"""One page with a picture of every surface, readable without a network."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.cli.surfaces import Listed, words_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from asperity.checks import FloatArray
    from asperity.textures.texture import Texture

_MAP_POINTS = 420
_SECTION_POINTS = 900
_DPI = 110
# A neutral material: what tells the surfaces apart is their relief.
_MATERIAL = ("#5f5547", "#b9ab92", "#ddd1ba")

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Surfaces of asperity</title>
<style>
:root { color-scheme: light dark; --ink: #1d2733; --soft: #5b6673; --page: #f4f5f7;
  --card: #ffffff; --line: #d9dde3; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6eaf0; --soft: #a3adba; --page: #14181e;
  --card: #1e242d; --line: #343c48; } }
body { margin: 0 auto; max-width: 1180px; padding: 1.5rem; background: var(--page);
  color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 .3rem; }
h2 { font-size: 1.15rem; margin: 2rem 0 .8rem; }
p { margin: .3rem 0; max-width: 70ch; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 1rem; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: .9rem; break-inside: avoid; }
.card h3 { margin: 0; font-size: 1.05rem; }
.card img { width: 100%; height: auto; border-radius: 4px; margin: .5rem 0; background: #fff; }
.soft { color: var(--soft); font-size: .87rem; }
code { font: .82rem/1.4 ui-monospace, monospace; overflow-wrap: anywhere; }
table { border-collapse: collapse; font-size: .84rem; width: 100%; margin: .4rem 0; }
th, td { text-align: left; padding: .15rem .5rem .15rem 0; vertical-align: top;
  border-top: 1px solid var(--line); }
th { font-weight: 600; }
@media print { body { background: #fff; max-width: none; } }
</style>
</head>
<body>
<h1>Surfaces that can be asked for by name</h1>
<p>Every surface repeats without a seam. The maps are lit from the upper left, their slopes scaled
so that light and shade tell; the section below each runs along x through the middle of the map,
its heights scaled to fill the frame.</p>
{% for title, group in groups if group %}
<h2>{{ title }}</h2>
<div class="cards">
{% for one, picture in group %}
<section class="card" id="{{ one.kind.name }}">
<h3>{{ one.kind.name }}</h3>
<p class="soft">{{ one.kind.summary }}</p>
<img src="{{ picture }}" alt="{{ one.kind.name }}: {{ one.kind.summary }}">
<p class="soft">{{ one.size_text }}, {{ one.height_text }} from peak to valley</p>
<p><code>asperity compare {{ quoted(one.specification) }}</code></p>
<table>
<tr><th>argument</th><th>default</th><th>what it is</th></tr>
{% for argument in one.kind.arguments %}
<tr><td><code>{{ argument.name }}{% if argument.unit %} [{{ argument.unit }}]{% endif %}</code></td>
<td>{{ argument.default_text }}</td><td>{{ words_of(argument) }}</td></tr>
{% endfor %}
</table>
{% if one.kind.source %}<p class="soft">Sizes: {{ one.kind.source }}.</p>{% endif %}
</section>
{% endfor %}
</div>
{% endfor %}
</body>
</html>
"""


def gallery_text(listed: Sequence[Listed]) -> str:
    """Return the page: one self-contained HTML text.

    Args:
        listed: what to show, see :func:`asperity.cli.surfaces.listed_surfaces`.
    """
    from jinja2 import Environment, StrictUndefined

    shown = [(one, picture(one.texture)) for one in listed]
    groups = (
        ("Named surfaces", [pair for pair in shown if pair[0].named]),
        ("Kinds of textures", [pair for pair in shown if not pair[0].named]),
    )
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    template = environment.from_string(_PAGE)
    return template.render(groups=groups, words_of=words_of, quoted=_quoted) + "\n"


def _quoted(specification: str) -> str:
    """A shell splits at blanks and at semicolons."""
    return f"'{specification}'" if set(" ;") & set(specification) else specification


def picture(texture: Texture) -> str:
    """Return a picture of a texture as a data URI: its map lit from the side, and a section."""
    from asperity.report.pictures import style

    figure = style.new_figure(4.4, 2.0 if texture.is_profile else 5.0)
    if texture.is_profile:
        _draw_section(figure.subplots(), texture)
    else:
        upper, lower = figure.subplots(2, 1, height_ratios=[4.0, 1.0])
        _draw_map(upper, texture)
        _draw_section(lower, texture)
    buffer = io.BytesIO()
    figure.savefig(
        buffer, format="png", dpi=_DPI, facecolor=style.CARD, metadata={"Software": None}
    )
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def _draw_map(axes: Axes, texture: Texture) -> None:
    from matplotlib.colors import LightSource, LinearSegmentedColormap

    from asperity.report.pictures import style

    size, heights = _map(texture)
    step = size / np.array(heights.shape[::-1])
    slopes = np.hypot(*np.gradient(heights, step[1], step[0]))
    # The steepest tenth is shown at 35 degrees, whatever the true slopes are.
    steep = 0.7 / max(float(np.quantile(slopes, 0.9)), 1e-300)
    shaded = LightSource(azdeg=315, altdeg=45).shade(
        heights,
        cmap=LinearSegmentedColormap.from_list("material", _MATERIAL),
        blend_mode="soft",
        vert_exag=steep,
        dx=float(step[0]),
        dy=float(step[1]),
    )
    axes.imshow(shaded, origin="lower", extent=(0.0, size[0], 0.0, size[1]))
    axes.set_axis_off()
    length = style.nice_length(0.3 * float(size[0]))
    unit = style.length_unit(float(size[0]))
    x0, y0 = 0.05 * size[0], 0.05 * size[1]
    for colour, thickness in (("white", 7.0), (style.INK, 3.5)):
        axes.plot([x0, x0 + length], [y0, y0], color=colour, linewidth=thickness,
                  solid_capstyle="butt")  # fmt: skip
    axes.annotate(
        f"{length * unit.scale:g} {unit.name}",
        (x0 + 0.5 * length, y0),
        (0, 6),
        textcoords="offset points",
        ha="center",
        fontsize=style.LABEL,
        color=style.INK,
        bbox={"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 1.5},
    )


def _map(texture: Texture) -> tuple[FloatArray, FloatArray]:
    """Return the size (2,) [m] of the rectangle about the domain and its heights [m]."""
    spans = texture.domain.spans
    size = np.abs(spans).sum(axis=0)
    low = texture.domain.origin + np.minimum(spans, 0.0).sum(axis=0)
    counts = np.maximum(np.rint(_MAP_POINTS * size / size.max()), 2).astype(int)
    x, y = (low[i] + (np.arange(n) + 0.5) * size[i] / n for i, n in enumerate(counts.tolist()))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return size, texture.height(grid).reshape(counts[1], counts[0])


def _draw_section(axes: Any, texture: Texture) -> None:
    from asperity.report.pictures import style

    line = texture.scan_line()
    periods = 3.0 if texture.is_profile and texture.peak_to_valley > 0.05 * line.length else 1.0
    along = np.linspace(0.0, periods * line.length, _SECTION_POINTS)
    heights = texture.height(line.start + along[:, None] * line.direction)
    wide, high = style.length_unit(float(along[-1])), style.length_unit(texture.peak_to_valley)
    x, z = along * wide.scale, heights * high.scale
    margin = 0.15 * float(np.ptp(z))
    axes.fill_between(x, z, z.min() - margin, color=style.BODY, linewidth=0.0)
    axes.plot(x, z, color=style.INK, linewidth=0.9)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(float(z.min()) - margin, float(z.max()) + margin)
    style.dress(axes)
    style.label(axes, f"[{wide.name}]", f"[{high.name}]")
