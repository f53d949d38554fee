"""Pages of devices: ``{device} ID`` says what the catalogue and the driver know of it.

``{frames}`` draws how a surface lies, ``{frames} NAME`` the axes of the devices of a driver. All is
drawn from what the drivers declare.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from docutils import nodes
from runblock import table_of
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from asperity.devices import FIELD_TABLE, Device, load_device
from asperity.report.devices import unknown_fields, verified_text
from asperity.servo.drivers.choice import KINDS
from asperity.servo.drivers.driver import AWAY, RIGHT, TOWARDS, UP, WALLS, Driver, Vector

Point = tuple[float, float]
_SEEN: tuple[Point, Point, Point] = ((1.0, 0.0), (0.5, -0.42), (0.0, -1.0))
"""Where right, away and up point on the paper: the user stands below it and looks at the device."""
_WORDS = {RIGHT: "right", AWAY: "away", UP: "up", TOWARDS: "towards you"}
_WORDS[(-1.0, 0.0, 0.0)], _WORDS[(0.0, 0.0, -1.0)] = "left", "down"
_LENGTH, _WIDTH, _HEIGHT = 62.0, 250.0, 195.0
_CENTRE: Point = (118.0, 95.0)
_UNITS = {1.0: "metres", 1e-3: "millimetres"}


def seen(vector: Sequence[float], length: float = _LENGTH) -> Point:
    """Return where a vector of right, away and up ends on the paper, drawn from the middle."""
    x, y = (sum(part * axis[i] for part, axis in zip(vector, _SEEN, strict=True)) for i in (0, 1))
    return _CENTRE[0] + length * x, _CENTRE[1] + length * y


def arrow(vector: Vector, label: str) -> str:
    """Return an axis with its name, as SVG."""
    (x0, y0), (x, y), (lx, ly) = _CENTRE, seen(vector), seen(vector, 1.16 * _LENGTH)
    line = f'<line x1="{x0:g}" y1="{y0:g}" x2="{x:.1f}" y2="{y:.1f}" marker-end="url(#tip)"/>'
    side = "start" if lx > x0 + 1.0 else "end" if lx < x0 - 1.0 else "middle"
    return f'{line}<text x="{lx:.1f}" y="{ly + 4:.1f}" style="text-anchor:{side}">{label}</text>'


def drawing(axes: Sequence[Vector], title: str, ground: str = "") -> str:
    """Return three axes, seen by the user, as SVG."""
    arrows = "".join(
        arrow(axis, f"{name}, {_WORDS[axis]}") for name, axis in zip("xyz", axes, strict=True)
    )
    return (
        f'<svg class="frame" role="img" aria-label="{title}" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="6"'
        ' markerHeight="6" orient="auto-start-reverse"><path d="M0 0 8 4 0 8z"/></marker></defs>'
        f"{ground}{arrows}"
        f'<text class="title" x="{_WIDTH / 2:g}" y="{_HEIGHT - 6:g}">{title}</text></svg>'
    )


def wall(name: str) -> str:
    """Return how a surface lies before the user, with its axes, as SVG."""
    across, along, _out = WALLS[name]
    corners = [
        tuple(0.8 * (i * a + j * b) for a, b in zip(across, along, strict=True))
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(seen, corners))
    return drawing(
        WALLS[name], f"wall = {name}", f'<polygon points="{points}" class="ground"/>'
    )  # fmt: skip


def of_driver(name: str) -> str:
    """Return the axes of the devices of a driver, as SVG."""
    kind = KINDS[name]
    return drawing(kind.axes, f"{name}: {_UNITS[kind.unit]}, newtons")


def driver_of(device: Device) -> Driver:
    """Return the driver that the entry of a device names."""
    from asperity.servo.drivers.choice import hardware_driver

    return hardware_driver("real", "lying", (0.0, 0.0, 0.0), device)


class Frames(SphinxDirective):
    """Drawings of frames: of the drivers that are named, or of the surface."""

    optional_arguments = 8

    def run(self) -> list[nodes.Node]:
        """Return the drawings, side by side."""
        drawn = [of_driver(name) for name in self.arguments] or [wall(name) for name in WALLS]
        return [nodes.raw("", f'<div class="frames">{"".join(drawn)}</div>', format="html")]


class DevicePage(SphinxDirective):
    """What is known of a device: its numbers with their sources, its driver, what is missing."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return tables, sentences and a drawing."""
        device = load_device(self.arguments[0])
        rows = [["", "value", "pedigree", "source"]]
        for field, datum in device.data.items():
            for one in (datum, *datum.also):
                rows.append([FIELD_TABLE[field].words, one.text, verified_text(one), one.source])
        made: list[nodes.Node] = [table_of(rows)]
        made += [nodes.paragraph(text=note) for note in device.notes]
        if missing := unknown_fields(device):
            items = [nodes.list_item("", nodes.paragraph(text=words)) for words in missing]
            made += [nodes.paragraph(text="Not known, so what needs it is not decided:")]
            made += [nodes.bullet_list("", *items)]
        if device.driver:
            kind = nodes.literal(text=f"--driver {device.driver}")
            lost = f". If the loop's process dies: {driver_of(device).when_lost}"
            made.append(nodes.paragraph("", "Driver: ", kind, nodes.Text(lost)))
            made.append(nodes.raw("", of_driver(device.driver), format="html"))
        return made


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("device", DevicePage)
    app.add_directive("frames", Frames)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
