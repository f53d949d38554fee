"""Reports of the catalogues of devices and of surfaces, and the data of a device in others."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from asperity.core.arguments import Argument
from asperity.core.errors import find_named
from asperity.core.units import format_quantity
from asperity.devices import FIELD_TABLE, Device, WallTest
from asperity.report.document.page import (
    HEADED,
    Block,
    Cards,
    Cell,
    Media,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    TableLayout,
    terminal_section,
)
from asperity.report.sentences.analysis_text import (
    datum_text,
    missing_fields,
    verified_text,
    wall_test_text,
)
from asperity.report.sentences.surface_text import argument_text, arguments_text, unit_name
from asperity.report.sentences.texts import readable_name, table_notes
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.kinds.named_surfaces import LIBRARY
from asperity.textures.texture import Texture, TextureKind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Console width [characters] from which the full name has a column.
_NAME_MIN_CONSOLE = 96
# The data that distinguish devices, by heading; all data are listed for one device.
_COLUMNS = {
    "max\nforce": "max_force",
    "stiffest\nwall": "max_stiffness",
    "position\nstep": "position_resolution",
    "force\nstep": "force_resolution",
    "update\nrate": "update_rate",
    "damping\nσ₀(B)": "damping",
}


def devices_page(devices: Sequence[Device], *, detailed: bool = False) -> Page:
    """Return one row per device for a terminal; in detail, all data of each device."""
    if detailed:
        return Page("", "", (), [part for device in devices for part in _device_sections(device)])
    notes = table_notes("devices")
    if all(datum.verified for device in devices for datum in device.data.values()):
        notes = notes[1:]  # the first explains the mark of unverified data
    last = terminal_section(notes=notes)
    return Page("", "", (), [terminal_section(_devices_table(devices)), last])


def _devices_table(devices: Sequence[Device]) -> Table:
    """Return one row per device, the first column its id alone."""
    rows = []
    for device in devices:
        texts = [datum_text(device.data.get(field)) for field in _COLUMNS.values()]
        rows.append(Row([Cell(device.id, "l"), device.name, *texts]))
    headings = ("id", "device", *_COLUMNS)
    layout = TableLayout(wrap=(1,), min_console={1: _NAME_MIN_CONSOLE})
    return Table(headings, rows, range(2, len(headings)), layout)


def _device_table(device: Device) -> Table:
    """Return all data of a device with their sources, alternative values in rows below."""
    rows = []
    for field, datum in device.data.items():
        named = [(readable_name(field), datum), *[("  also", other) for other in datum.also]]
        for name, value in named:
            style = "" if value.verified else "yellow"
            cells = [name, value.text, verified_text(value), value.source]
            rows.append(Row(cells, style=style))
        if isinstance(datum, WallTest) and wall_test_text(datum):
            rows.append(Row(["  the test", "", "", wall_test_text(datum)]))
    headings = ("datum", "value", "verified", "source")
    return Table(headings, rows, (1,), TableLayout(wrap=(3,)))


def device_page(device: Device) -> Page:
    """Return the data of a device for a notebook."""
    table = device_numbers_table(device, list(device.data))
    return Page("", device.name, (), [Section("", [table], media=Media.NOTEBOOK)])


def device_numbers_table(device: Device, fields: Sequence[str]) -> Table:
    """Return data of a device, and which of them are missing.

    Args:
        device: the device.
        fields: names of the data.
    """
    rows = []
    for field in fields:
        name = readable_name(field)
        datum = device.data.get(field)
        if datum is None:
            missing = Cell("not known", "open")
            rows.append(Row([name, "", missing, FIELD_TABLE[field].description]))
            continue
        verified = Cell(verified_text(datum), "" if datum.verified else "open")
        test = wall_test_text(datum) if isinstance(datum, WallTest) else ""
        rows.append(Row([name, datum.text, verified, Cell(datum.source, subtext=test)]))
    return Table((device.name, "value", "verified", "source"), rows, numeric_columns=(1,))


def _device_sections(device: Device) -> list[Section]:
    """Return the data of a device, and what is missing, for a terminal."""
    title = device.name
    if device.name != device.id:
        title += f" ({device.id})"
    access = []
    if device.axes:
        access.append(f"Axes: {device.axes}")
    if device.driver:
        access.append(f"Driver: {device.driver}, which 'real' names")
    missing = [f"  {field}" for field in missing_fields(device)]
    if missing:
        missing.insert(0, "Missing data, without which some results are undecided:")
    parts = [access, *[[note] for note in device.notes], missing]
    return [
        Section(title, (), media=HEADED),
        terminal_section(_device_table(device)),
        *[terminal_section(*map(Paragraph, lines)) for lines in parts if lines],
    ]


@dataclass(frozen=True)
class SurfaceEntry:
    """A kind of texture or a named surface, with one texture of it.

    Attributes:
        kind: the entry of the catalogue.
        texture: the example, or the surface with its defaults.
        is_named: whether it is a surface of the library.
    """

    kind: TextureKind
    texture: Texture
    is_named: bool

    @property
    def specification(self) -> str:
        """The texture as an argument of the command line."""
        values = [
            f"{name}={_format_argument(self.kind, name, value)}"
            for name, value in self.kind.example.items()
        ]
        return f"{self.kind.name}:{','.join(values)}"

    @property
    def size(self) -> tuple[float, ...]:
        """Length of the period along its spans [m]."""
        return tuple(float((span @ span) ** 0.5) for span in self.texture.domain.spans)

    @property
    def size_text(self) -> str:
        """The period as text."""
        return " x ".join([format_quantity(length, "m") for length in self.size])

    @property
    def height_text(self) -> str:
        """The peak-to-valley height as text."""
        return format_quantity(self.texture.peak_to_valley, "m")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "name": self.kind.name,
            "summary": self.kind.summary,
            "named": self.is_named,
            "specification": self.specification,
            "arguments": [argument.to_dict() for argument in self.kind.arguments],
            "source": self.kind.source,
            "size": list(self.size),
            "peak_to_valley": self.texture.peak_to_valley,
            "texture": self.texture.describe(),
        }


def find_surfaces(names: Sequence[str] = ()) -> list[SurfaceEntry]:
    """Return the surfaces of these names, all by default, in the order of the catalogue.

    Raises:
        ParameterError: for an unknown name; the message suggests similar ones.
    """
    wanted = [name.lower().rstrip(":") for name in names]
    for name in wanted:
        find_named("surface", name, CATALOGUE)
    return [
        SurfaceEntry(kind, kind.factory(**kind.example), name in LIBRARY)
        for name, kind in CATALOGUE.items()
        if not wanted or name in wanted
    ]


def _format_argument(kind: TextureKind, name: str, value: Any) -> str:
    """Return a value as an argument of the command line, micrometres in ASCII."""
    argument = next(argument for argument in kind.arguments if argument.name == name)
    if argument.form == "vectors":
        rows = (" ".join([f"{part:g}" for part in row]) for row in value)
        return "; ".join([f"{row} {argument.unit}" for row in rows])
    if isinstance(value, list):
        return "; ".join([_format_quantity(argument, part) for part in value])
    return _format_quantity(argument, value)


def _format_quantity(argument: Argument, value: Any) -> str:
    return argument.format_value(value).replace("µ", "u").replace(" ", "")


# --- the page -------------------------------------------------------------------------------------


def _list_sections(entries: Sequence[SurfaceEntry], *, detailed: bool) -> list[Section]:
    """Return entry row per surface for a terminal; in detail, also its arguments."""
    rows = []
    for entry in entries:
        summary = Cell(entry.kind.summary, subtext=arguments_text(entry.kind))
        size = entry.size_text.replace(" x ", " x\n")
        rows.append(Row([Cell(entry.kind.name, "l"), summary, size, entry.height_text]))
        if entry.kind.example:
            rows.append(Row(["", entry.specification, "", ""]))
    headings = ("name", "summary and arguments", "size", "height")
    table = Table(headings, rows, (2, 3), TableLayout(wrap=(1,), gap=2))
    if detailed:
        return [terminal_section(table), *map(_arguments_section, entries)]
    notes = map(Paragraph, table_notes("surfaces"))
    return [terminal_section(table), terminal_section(*notes)]


def _arguments_section(entry: SurfaceEntry) -> Section:
    rows = [
        Row(
            [
                Cell(argument.name, "l"),
                argument.unit,
                argument.default_text,
                argument_text(argument),
            ]
        )
        for argument in entry.kind.arguments
    ]
    headings = ("argument", "unit", "default", "meaning")
    table = Table(headings, rows, layout=TableLayout(wrap=(2, 3), gap=2))
    return terminal_section(table, *map(Paragraph, _source_notes(entry.kind)))


def _source_notes(kind: TextureKind) -> list[str]:
    return [f"Sizes: {kind.source}."] if kind.source else []


def surfaces_page(
    entries: Sequence[SurfaceEntry], *, detailed: bool = False, command: str = ""
) -> Page:
    """Return a card with a picture of every surface; in detail, a terminal lists arguments.

    Args:
        entries: the surfaces.
        detailed: whether a terminal lists the arguments.
        command: what is written before the surface in an example of its use.
    """
    groups = {
        "Named surfaces": [_card(entry, command) for entry in entries if entry.is_named],
        "Kinds of textures": [_card(entry, command) for entry in entries if not entry.is_named],
    }
    sections = [Section(title, [Cards(cards)]) for title, cards in groups.items() if cards]
    return Page(
        title="Named surfaces and kinds of textures",
        answer="",
        sections=[
            *_list_sections(entries, detailed=detailed),
            Section("", [*map(Paragraph, table_notes("cards"))]),
            *sections,
        ],
    )


def _draw_card(texture: Texture) -> Figure:
    from asperity.report.pictures.surface_pictures import gallery_figure

    return gallery_figure(texture)


def _card(entry: SurfaceEntry, command: str) -> Section:
    kind = entry.kind
    rows = [
        Row([Cell(unit_name(argument), "mono"), argument.default_text, argument_text(argument)])
        for argument in kind.arguments
    ]
    blocks: list[Block] = [
        Picture(partial(_draw_card, entry.texture), f"{kind.name}: {kind.summary}.", dpi=110),
        Paragraph(f"{entry.size_text}, {entry.height_text} from peak to valley", "note"),
        Paragraph(f"{command} {shlex.quote(entry.specification)}".strip(), "mono"),
        Table(("argument", "default", "meaning"), rows),
    ]
    notes = _source_notes(kind)
    return Section(kind.name, blocks, kind.summary, notes, level=3, id=kind.name)
