"""Options that several commands share, made from the arguments' declarations."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from asperity.arguments import JOBS, MAX_DEPTH, MEMORY, STIFFNESS, Argument
from asperity.cli.own_code import load_own_code
from asperity.cli.settings import Settings, set_option
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.laws import KNOWN_LAWS, LAW_ARGUMENTS, Law, find_law, find_laws, known_arguments
from asperity.measured.arguments import FILE_ARGUMENTS
from asperity.memory import limited
from asperity.processes import at_most, cores

if TYPE_CHECKING:
    from asperity.scene import Scene
    from asperity.textures import Texture

Command = TypeVar("Command", bound=Callable[..., Any])

LAW_OPTIONS = (STIFFNESS, MAX_DEPTH, *LAW_ARGUMENTS.values())


Read = Callable[[str], Any]
"""Returns what the text of an option stands for."""


def as_read(read: Read) -> Callable[[click.Context, click.Parameter, str | None], Any]:
    """Return a callback that reads the text of an option that is given."""
    return lambda _ctx, _option, text: None if text is None else read(text)


def help_of(argument: Argument) -> str:
    """Return the help of an argument's option.

    Example:
        >>> help_of(Argument("length", "of the scan", "m", 0.1, example="5mm"))
        "Of the scan, '5mm'.  [default: 100 mm]"
    """
    first, rest = argument.words[:1], argument.words[1:]
    # A symbol stays as it is written: "c of law H".
    words = f"{first.upper()}{rest}" if rest[:1].isalpha() else f"{first}{rest}"
    example = f", '{argument.example}'" if argument.example else ""
    default = f"  [default: {argument.default_text}]" if argument.default_text else ""
    return f"{words}{example}.{default}"


def options(
    arguments: Iterable[Argument], read: Callable[[Argument], Read] | None = None
) -> Callable[[Command], Command]:
    """Return a decorator that adds an option for each argument.

    Args:
        arguments: their declarations.
        read: returns how the text of one is read; by default as it is declared.
    """

    def decorate(command: Command) -> Command:
        for argument in reversed(list(arguments)):
            flag, words = f"--{argument.name.replace('_', '-')}", help_of(argument)
            if argument.form == "switch":
                command = click.option(flag, is_flag=True, default=None, help=words)(command)
                continue
            value = as_read(argument.read if read is None else read(argument))
            listed = read is several or argument.form == "items"
            shown = "LIST" if listed else "N" if argument.form == "integer" else "TEXT"
            command = click.option(flag, metavar=shown, callback=value, help=words)(command)
        return command

    return decorate


def one(argument: Argument) -> Read:
    """Read a single value, and say so where a list is given."""

    def read(text: str) -> Any:
        values = several(argument)(text)
        if len(values) > 1:
            raise ParameterError(argument.name, "must be a single one", text)
        return values[0]

    return read


def several(argument: Argument) -> Read:
    """Read "a; b; c"."""

    def read(text: str) -> list[Any]:
        parts = [part for part in text.replace(",", ";").split(";") if part.strip()]
        if not parts:
            raise ParameterError(argument.name, "must be one or several, 'a; b'", text)
        return [argument.read(part) for part in parts]

    return read


def given(values: Mapping[str, Any], arguments: Iterable[Argument]) -> dict[str, Any]:
    """Return the values of the options that the user gave, by argument name."""
    return {one.name: values[one.name] for one in arguments if values[one.name] is not None}


def read_device(text: str) -> Device:
    """Return the one device that a text names.

    Raises:
        ParameterError: for one that is unknown, or several.
    """
    if len(devices := read_devices(text)) > 1:
        raise ParameterError("device", "must be a single one here: compare takes several", text)
    return devices[0]


def device_option(
    words: str = "Device of the catalogue, or a TOML file.  [default: omega.3]",
    read: Read = read_device,
) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--device``."""
    return click.option("--device", metavar="ID|FILE", callback=as_read(read), help=words)


def read_devices(text: str) -> tuple[Device, ...]:
    """Return the devices that a text names, with commas or semicolons between.

    Raises:
        ParameterError: for one that is unknown, or is named twice.
    """
    if os.path.exists(text):  # whatever signs the name of a file has
        return (load_device(text),)
    parts = [part.strip() for part in text.replace(";", ",").split(",") if part.strip()]
    devices = tuple(load_device(part) for part in parts or [text])
    if len({device.id for device in devices}) < len(devices):
        raise ParameterError("device", "names one device twice", text)
    return devices


def law_option(words: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--law``."""
    return click.option("--law", metavar="LETTER", callback=as_read(find_law), help=words)


def laws_option(words: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--laws``."""
    return click.option("--laws", metavar="LETTERS", callback=as_read(find_laws), help=words)


own_code_option = click.option(
    "--law-module",
    metavar="FILE",
    multiple=True,
    is_eager=True,  # what it defines can be named in the other options
    expose_value=False,
    callback=load_own_code,
    help="Python file of your own, which is run: laws, textures, claims; more by repeating it.",
)


def law_options(arguments: Iterable[Argument] = LAW_OPTIONS) -> Callable[[Command], Command]:
    """Return a decorator that adds the options of surface and law."""

    def decorate(command: Command) -> Command:
        return options(arguments)(set_option(own_code_option(command)))

    return decorate


def _limit(context: click.Context, _option: click.Parameter, text: str | None) -> None:
    """Limit the memory of surfaces until the command ends."""
    size = None if text is None else MEMORY.read(text)
    context.with_resource(limited(str(context.command.name), size))


_memory_option = click.option(
    "--memory", metavar="SIZE", expose_value=False, callback=_limit, help=help_of(MEMORY)
)


def _share(context: click.Context, _option: click.Parameter, text: str | None) -> None:
    """Share the work out until the command ends."""
    context.with_resource(at_most(cores() if text is None else JOBS.checked(JOBS.read(text))))


jobs_option = click.option(
    "--jobs", metavar="N", expose_value=False, callback=_share, help=help_of(JOBS)
)


def file_options(command: Command) -> Command:
    """Add the options of a measured file, and of the memory that it may take."""
    return options(FILE_ARGUMENTS)(_memory_option(command))


def file_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the options say of a measured file."""
    return given(values, FILE_ARGUMENTS)


def surface_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the options say of the surface and of the parameters of laws.

    Raises:
        ParameterError: for a parameter that has an option and is given by ``--set``, too.
    """
    result = given(values, LAW_OPTIONS)
    if values.get("law") is not None:
        result["law"] = values["law"]
    for name, value in values["settings"].law.items():
        if name in result:
            flag = f"--{name.replace('_', '-')}"
            raise ParameterError(name, f"is given twice: by {flag} and by --set {name}=...")
        result[name] = value
    return result


def chosen_device(device: Device | None, scene: Scene, values: Mapping[str, Any]) -> Device:
    """Return the device of ``--device``, the scene or the default, changed by ``--set``."""
    from asperity.scene.setup import DEFAULT_DEVICE

    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    settings: Settings = values["settings"]
    return settings.changed(chosen)


def refuse_idle(asked: Iterable[str], laws: Sequence[Law]) -> None:
    """Refuse a parameter that was asked for and that none of the laws takes.

    Raises:
        ParameterError: with the laws that take it.
    """
    taken = known_arguments(laws)
    for name in asked:
        takers = [law.letter for law in KNOWN_LAWS.values() if name in law.arguments]
        if takers and name not in taken:
            letters, others = (", ".join(part) for part in ((law.letter for law in laws), takers))
            words = f"would change nothing: law {letters} does not take it; taken by law {others}"
            raise ParameterError(name, words)


def read_surface(
    source: str,
    device: Device | None,
    values: Mapping[str, Any],
    laws: Sequence[Law] = (),
    **defaults: Any,
) -> tuple[Texture, Device, dict[str, Any]]:
    """Return the texture and the device that SURFACE and the options name, and all other arguments.

    Args:
        source: a texture with its arguments, a file, or a scene.
        device: the one of ``--device``; it comes before the scene's.
        values: of the options, by name.
        laws: those that are compared; by default the one of ``--law`` or of the scene, which is
            then among the arguments.
        defaults: of the other arguments.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    from asperity.scene import load_scene
    from asperity.scene.sections import surface_keywords

    asked = surface_values(values)
    scene = load_scene(source, file_values(values))
    merged = {**defaults, **scene.surface, **asked}
    if not laws:
        laws = [find_law(merged["law"])] if "law" in merged else tuple(KNOWN_LAWS.values())
    refuse_idle(asked, laws)
    arguments = surface_keywords(merged, *laws)
    return scene.texture, chosen_device(device, scene, values), arguments
