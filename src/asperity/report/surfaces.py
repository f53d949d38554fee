"""The surfaces that can be asked for by name: in a terminal, and as a page of pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from asperity.arguments import Argument
from asperity.errors import ParameterError, nearest_names
from asperity.report import page, terminal
from asperity.report.page import Cards, Cell, Page, Row, Section, Words, added_sections, picture
from asperity.report.terminal import say
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.library import LIBRARY
from asperity.textures.texture import Kind, Texture
from asperity.units import engineering


@dataclass(frozen=True)
class Listed:
    """A kind of texture or named surface with one texture of it.

    Attributes:
        kind: the entry of the catalogue.
        texture: the example, or the surface with its defaults.
        named: whether it is a surface of the library.
    """

    kind: Kind
    texture: Texture
    named: bool

    @property
    def specification(self) -> str:
        """The texture as the command line takes it."""
        values = [
            f"{name}={_written(self.kind, name, value)}"
            for name, value in self.kind.example.items()
        ]
        return f"{self.kind.name}:{','.join(values)}"

    @property
    def size(self) -> tuple[float, ...]:
        """Length of the period along its spans [m]."""
        return tuple(float((span @ span) ** 0.5) for span in self.texture.domain.spans)

    @property
    def size_text(self) -> str:
        """The period for reading."""
        return " x ".join(engineering(length, "m") for length in self.size)

    @property
    def height_text(self) -> str:
        """The peak-to-valley height for reading."""
        return engineering(self.texture.peak_to_valley, "m")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "name": self.kind.name,
            "summary": self.kind.summary,
            "named": self.named,
            "specification": self.specification,
            "arguments": [argument.to_dict() for argument in self.kind.arguments],
            "source": self.kind.source,
            "size": list(self.size),
            "peak_to_valley": self.texture.peak_to_valley,
            "texture": self.texture.describe(),
        }


def listed_surfaces(names: Sequence[str] = ()) -> list[Listed]:
    """Return the surfaces of these names, all by default, in the order of the catalogue.

    Raises:
        ParameterError: for an unknown name; the nearest are offered.
    """
    wanted = [name.lower().rstrip(":") for name in names]
    for name in wanted:
        if name not in CATALOGUE:
            hint = nearest_names(name, CATALOGUE)
            raise ParameterError("surface", f"is unknown: {name!r}; {hint}")
    return [
        Listed(kind, kind.make(**kind.example), name in LIBRARY)
        for name, kind in CATALOGUE.items()
        if not wanted or name in wanted
    ]


def _written(kind: Kind, name: str, value: Any) -> str:
    """Return a value as the command line takes it; micrometres without a Greek letter."""
    argument = next(argument for argument in kind.arguments if argument.name == name)
    if argument.form == "vectors":
        rows = (" ".join(f"{part:g}" for part in row) for row in value)
        return "; ".join(f"{row} {argument.unit}" for row in rows)
    if isinstance(value, list):
        return "; ".join(_plain(argument, part) for part in value)
    return _plain(argument, value)


def _plain(argument: Argument, value: Any) -> str:
    return argument.readable(value).replace("µ", "u").replace(" ", "")


def arguments_text(kind: Kind) -> str:
    """Return the arguments on one line: with their defaults, or with their units.

    Example:
        >>> from asperity.textures.catalogue import CATALOGUE
        >>> arguments_text(CATALOGUE["grating"])
        'height [m], period [m], duty=0.5, edge=ridge or groove/4'
    """
    parts = []
    for argument in kind.arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        # Without blanks, so that a line never breaks inside a quantity.
        default = argument.default_text.replace(" ", "") if argument.default is not None else ""
        value = f"={default or argument.default_words}"
        parts.append(argument.name + (unit if argument.required else value))
    return ", ".join(parts)


def _words_of(argument: Argument) -> str:
    """Return what an argument is, with the choice for a word."""
    choice = f": {', '.join(argument.choices)}" if argument.choices else ""
    return argument.words + choice


# --- in a terminal --------------------------------------------------------------------------------


def print_surfaces(listed: Sequence[Listed], console: Console, *, in_detail: bool = False) -> None:
    """Print one row per surface; in detail, what each of its arguments is."""
    rows = []
    for one in listed:
        words = Cell(one.kind.summary, below=arguments_text(one.kind))
        size = one.size_text.replace(" x ", " x\n")
        rows.append(Row([Cell(one.kind.name, "l"), words, size, one.height_text]))
        if one.kind.example:
            rows.append(Row(["", one.specification, "", ""]))
    headings = ("name", "what it is, and its arguments", "size", "height")
    _print_table(page.Table(headings, rows, (2, 3)), (1,), console)
    if not in_detail:
        console.print()
        say(
            console,
            "Size and height are those of the defaults, of the example for a kind that needs "
            "arguments. More about one: asperity surfaces NAME",
        )
    for one in listed if in_detail else ():
        _print_detail(one, console)


def _print_table(table: page.Table, wraps: tuple[int, ...], console: Console) -> None:
    console.print(terminal.table(table, wraps=wraps, styles={"l": "bold"}, gap=2))


def _print_detail(one: Listed, console: Console) -> None:
    rows = [
        Row([Cell(argument.name, "l"), argument.unit, argument.default_text, _words_of(argument)])
        for argument in one.kind.arguments
    ]
    console.print()
    _print_table(page.Table(("argument", "unit", "default", "what it is"), rows), (2, 3), console)
    if one.kind.source:
        say(console, f"Sizes: {one.kind.source}.")


# --- as a page ------------------------------------------------------------------------------------


def surfaces_page(listed: Sequence[Listed]) -> Page:
    """Return the page: a card with a picture of every surface."""
    groups = (
        ("Named surfaces", [one for one in listed if one.named]),
        ("Kinds of textures", [one for one in listed if not one.named]),
    )
    sections = [
        Section(title, [Cards([_card(one) for one in group])]) for title, group in groups if group
    ]
    return Page(
        title="Surfaces that can be asked for by name",
        answer=(
            "Every surface repeats without a seam. The maps are lit from the upper left, their "
            "slopes scaled so that light and shade tell; the section below each runs along x "
            "through the middle of the map, its heights scaled to fill the frame."
        ),
        facts=(),
        sections=[*sections, *added_sections(Listed, listed)],
    )


def _card(one: Listed) -> Section:
    from asperity.report.pictures.surface_picture import gallery_figure

    kind = one.kind
    rows = []
    for argument in kind.arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        name = Cell(f"{argument.name}{unit}", "mono")
        rows.append(Row([name, argument.default_text, _words_of(argument)]))
    blocks: list[page.Block] = [
        picture(gallery_figure(one.texture), f"{kind.name}: {kind.summary}.", dpi=110),
        Words(f"{one.size_text}, {one.height_text} from peak to valley", "note"),
        Words(f"asperity compare {_quoted(one.specification)}", "mono"),
        page.Table(("argument", "default", "what it is"), rows),
    ]
    notes = [f"Sizes: {kind.source}."] if kind.source else []
    return Section(kind.name, blocks, kind.summary, notes, level=3, id=kind.name)


def _quoted(specification: str) -> str:
    """A shell splits at blanks and at semicolons."""
    return f"'{specification}'" if set(" ;") & set(specification) else specification
