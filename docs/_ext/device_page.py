"""Pages of devices: ``{device} ID`` says what the catalogue and the driver know of it.

``{frames}`` draws how a surface lies, ``{frames} NAME`` the axes of the devices of a driver. All is
drawn from what the drivers declare.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from docutils import nodes
from runblock import make_table
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from asperity.devices import FIELD_TABLE, Device, load_device
from asperity.report.sentences.analysis_text import missing_fields, verified_text
from asperity.servo.driver import AWAY, RIGHT, TOWARDS, UP, WALL_AXES, Driver, Vector
from asperity.servo.drivers.driver_registry import DRIVER_KINDS

Point = tuple[float, float]
_PROJECTED_AXES: tuple[Point, Point, Point] = ((1.0, 0.0), (0.5, -0.42), (0.0, -1.0))
"""Where right, away and up point on the paper: the user stands below it and looks at the device."""
_WORDS = {RIGHT: "right", AWAY: "away", UP: "up", TOWARDS: "towards you"}
_WORDS[(-1.0, 0.0, 0.0)], _WORDS[(0.0, 0.0, -1.0)] = "left", "down"
_LENGTH, _WIDTH, _HEIGHT = 62.0, 250.0, 195.0
_CENTRE: Point = (118.0, 95.0)
_UNITS = {1.0: "metres", 1e-3: "millimetres"}


def project_to_page(vector: Sequence[float], length: float = _LENGTH) -> Point:
    """Return where a vector of right, away and up ends on the paper, drawn from the middle."""
    x, y = (
        sum(part * axis[i] for part, axis in zip(vector, _PROJECTED_AXES, strict=True))
        for i in (0, 1)
    )
    return _CENTRE[0] + length * x, _CENTRE[1] + length * y


def axis_svg(vector: Vector, label: str) -> str:
    """Return an axis with its name, as SVG."""
    (x0, y0), (x, y), (lx, ly) = (
        _CENTRE,
        project_to_page(vector),
        project_to_page(vector, 1.16 * _LENGTH),
    )
    line = f'<line x1="{x0:g}" y1="{y0:g}" x2="{x:.1f}" y2="{y:.1f}" marker-end="url(#tip)"/>'
    side = "start" if lx > x0 + 1.0 else "end" if lx < x0 - 1.0 else "middle"
    return f'{line}<text x="{lx:.1f}" y="{ly + 4:.1f}" style="text-anchor:{side}">{label}</text>'


def axes_svg(axes: Sequence[Vector], title: str, ground: str = "") -> str:
    """Return three axes, as the user sees them, as SVG."""
    arrows = "".join(
        axis_svg(axis, f"{name}, {_WORDS[axis]}") for name, axis in zip("xyz", axes, strict=True)
    )
    return (
        f'<svg class="frame" role="img" aria-label="{title}" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="6"'
        ' markerHeight="6" orient="auto-start-reverse"><path d="M0 0 8 4 0 8z"/></marker></defs>'
        f"{ground}{arrows}"
        f'<text class="title" x="{_WIDTH / 2:g}" y="{_HEIGHT - 6:g}">{title}</text></svg>'
    )


def wall_svg(name: str) -> str:
    """Return how a surface lies before the user, with its axes, as SVG."""
    across, along, _out = WALL_AXES[name]
    corners = [
        tuple(0.8 * (i * a + j * b) for a, b in zip(across, along, strict=True))
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(project_to_page, corners))
    return axes_svg(
        WALL_AXES[name], f"wall = {name}", f'<polygon points="{points}" class="ground"/>'
    )  # fmt: skip


def driver_axes_svg(name: str) -> str:
    """Return the axes of the devices of a driver, as SVG."""
    kind = DRIVER_KINDS[name]
    return axes_svg(kind.axes, f"{name}: {_UNITS[kind.unit]}, newtons")


def find_driver(device: Device) -> Driver:
    """Return the driver that the entry of a device names."""
    from asperity.servo.drivers.driver_registry import hardware_driver

    return hardware_driver("real", "lying", (0.0, 0.0, 0.0), device)


class Frames(SphinxDirective):
    """Drawings of frames: of the drivers that are named, or of the surface."""

    optional_arguments = 8

    def run(self) -> list[nodes.Node]:
        """Return the drawings, side by side."""
        drawings = [driver_axes_svg(name) for name in self.arguments] or [
            wall_svg(name) for name in WALL_AXES
        ]
        return [nodes.raw("", f'<div class="frames">{"".join(drawings)}</div>', format="html")]


class DevicePage(SphinxDirective):
    """What is known of a device: its numbers with their sources, its driver, what is missing."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return tables, sentences and a drawing."""
        device = load_device(self.arguments[0])
        rows = [["", "value", "pedigree", "source"]]
        for field, datum in device.data.items():
            for one in (datum, *datum.also):
                rows.append(
                    [FIELD_TABLE[field].description, one.text, verified_text(one), one.source]
                )
        content: list[nodes.Node] = [make_table(rows)]
        content += [nodes.paragraph(text=note) for note in device.notes]
        if missing := missing_fields(device):
            items = [nodes.list_item("", nodes.paragraph(text=words)) for words in missing]
            content += [nodes.paragraph(text="Not known, so what needs it is not decided:")]
            content += [nodes.bullet_list("", *items)]
        if device.driver:
            kind = nodes.literal(text=f"--driver {device.driver}")
            lost = f". If the loop's process dies: {find_driver(device).loss_notice}"
            content.append(nodes.paragraph("", "Driver: ", kind, nodes.Text(lost)))
            content.append(nodes.raw("", driver_axes_svg(device.driver), format="html"))
        return content


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("device", DevicePage)
    app.add_directive("frames", Frames)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
