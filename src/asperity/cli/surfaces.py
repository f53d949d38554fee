"""``asperity surfaces``: which surfaces there are, what they take, how they look."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.output import Outputs, output_options
from asperity.errors import ParameterError, nearest_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console
    from rich.table import Table

    from asperity.arguments import Argument
    from asperity.textures.kinds import Kind
    from asperity.textures.texture import Texture

SCHEMA = 1


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
        from asperity.units import engineering

        return " x ".join(engineering(length, "m") for length in self.size)

    @property
    def height_text(self) -> str:
        """The peak-to-valley height for reading."""
        from asperity.units import engineering

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


@click.command("surfaces")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@output_options(
    "Write a page with a picture of each; - is standard output.",
    "Write the list as JSON; - is standard output.",
)
def command(names: tuple[str, ...], outputs: Outputs) -> None:
    """List kinds of textures and named surfaces: arguments, units, defaults, size and height.

    Given NAMEs, says more about those. Use them as SURFACE in other commands, with arguments or
    without: cloth: or sandpaper:grit=P60 or noise:rms=20um,size=10mm
    """
    listed = listed_surfaces(names)

    def page() -> str:
        from asperity.cli.gallery import gallery_text

        return gallery_text(listed)

    data = {"schema": SCHEMA, "surfaces": listed}
    outputs.write(data, lambda console: _print(listed, bool(names), console), page, "Pictures")


def listed_surfaces(names: Sequence[str] = ()) -> list[Listed]:
    """Return the surfaces of these names, all by default, in the order of the catalogue.

    Raises:
        ParameterError: for an unknown name; the nearest are offered.
    """
    from asperity.textures.catalogue import CATALOGUE
    from asperity.textures.library import LIBRARY

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
        return "; ".join(" ".join(f"{part:g}" for part in row) for row in value)
    if isinstance(value, list):
        return "; ".join(_plain(argument, part) for part in value)
    return _plain(argument, value)


def _plain(argument: Argument, value: Any) -> str:
    return argument.readable(value).replace("µ", "u").replace(" ", "")


def _print(listed: Sequence[Listed], in_detail: bool, console: Console) -> None:
    console.print(_table(listed))
    if not in_detail:
        console.print(
            "Size and height are those of the defaults, of the example for a kind that needs "
            "arguments. More about one: asperity surfaces NAME"
        )
        return
    for one in listed:
        console.print(_detail(one))
        if one.kind.source:
            console.print(f"Sizes: {one.kind.source}.", markup=False)


def _table(listed: Sequence[Listed]) -> Table:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("name", no_wrap=True, style="bold")
    table.add_column("what it is, and its arguments")
    table.add_column("size", justify="right", min_width=9)
    table.add_column("height", justify="right", no_wrap=True)
    for one in listed:
        words = f"{one.kind.summary}\n[dim]{escape(arguments_text(one.kind))}[/dim]"
        if one.kind.example:
            words += f"\n{escape(one.specification)}"
        table.add_row(one.kind.name, words, one.size_text.replace(" x ", " x\n"), one.height_text)
    return table


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


def _detail(one: Listed) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("argument", "unit", "default", "what it is"):
        table.add_column(heading, style="bold" if heading == "argument" else "")
    for argument in one.kind.arguments:
        table.add_row(argument.name, argument.unit, argument.default_text, words_of(argument))
    return table


def words_of(argument: Argument) -> str:
    """Return what an argument is, with the choice for a word."""
    choice = f": {', '.join(argument.choices)}" if argument.choices else ""
    return argument.words + choice
