"""Options shared by several commands, derived from the declarations of the arguments."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from asperity.cli.main import help_surface_option
from asperity.cli.plugins import load_plugins
from asperity.core.arguments import MAX_DEPTH, RENDERING, STIFFNESS, Argument, read_arguments
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.memory import limit_memory
from asperity.core.processes import available_cores, limit_processes
from asperity.devices import FIELD_UNITS, Device, load_device, override_device
from asperity.laws import (
    REGISTERED_LAWS,
    SHIPPED_LAW_ARGUMENTS,
    Law,
    find_law,
    find_laws,
    registered_arguments,
)
from asperity.measured.file_arguments import FILE_ARGUMENTS

if TYPE_CHECKING:
    from asperity.scene import Scene
    from asperity.textures import Texture


_DEVICE_PREFIX = "device."


@dataclass(frozen=True)
class Overrides:
    """Values of ``--set``.

    Attributes:
        law: parameters of laws by name [SI].
        device: fields of the device by name, as texts with units.
    """

    law: Mapping[str, Any] = field(default_factory=dict)
    device: Mapping[str, str] = field(default_factory=dict)

    def apply_to(self, device: Device) -> Device:
        """Return the device with the overridden fields."""
        return device if not self.device else override_device(device, self.device)


def parse_settings(
    _ctx: click.Context, _option: click.Parameter, texts: Sequence[str]
) -> Overrides:
    """Return the values of all ``--set`` options.

    A parameter of a law takes precedence over a device field of the same name, which is written
    "device.friction=80mN".

    Raises:
        ParameterError: for an unknown name, an invalid value, or two values of one name.
    """
    law: dict[str, Any] = {}
    device: dict[str, str] = {}
    earlier = dict[tuple[bool, str], str]()
    parameters = registered_arguments()
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise ParameterError("set", "must be NAME=VALUE", text)
        name = name.strip().replace("-", "_")
        of_device = name.startswith(_DEVICE_PREFIX) or (
            name not in parameters and name in FIELD_UNITS
        )
        name = name.removeprefix(_DEVICE_PREFIX)
        known: Collection[str] = FIELD_UNITS if of_device else parameters
        if name not in known:
            fault = f"names {name!r}, which is a parameter of no law and no field of a device"
            shared = {
                f"{_DEVICE_PREFIX}{field}" for field in FIELD_UNITS.keys() & parameters.keys()
            }
            hint = suggest_names(name, {*parameters, *FIELD_UNITS, *shared})
            raise ParameterError("set", f"{fault}; {hint}")
        first = earlier.setdefault((of_device, name), text)
        if first is not text:
            raise ParameterError("set", f"is given twice for {name}: {first!r} and {text!r}")
        if of_device:
            device[name] = value.strip()
        else:
            try:
                law[name] = parameters[name].parse(value)
            except ParameterError as error:
                if name not in FIELD_UNITS:
                    raise
                fault = f"{error.requirement}; the device's is {_DEVICE_PREFIX}{text}"
                raise ParameterError(name, fault, error.value) from None
    return Overrides(law, device)


set_option = click.option(
    "--set",
    "settings",
    metavar="NAME=VALUE",
    multiple=True,
    callback=parse_settings,
    help="Set a law parameter, such as 'gain=2.5', or a device field, such as"
    " 'max_stiffness=1500N/m' or 'device.friction=80mN'; may be repeated.",
)


Command = TypeVar("Command", bound=Callable[..., Any])


def command_arguments(command: str) -> tuple[Argument, ...]:
    """Return the declarations of a command's own options, or of the ``shared`` ones."""
    path = Path(__file__).with_name("command_options.toml")
    return tuple(read_arguments(path, command).values())


REQUESTED_STIFFNESS, SPEED, GRIP, MEMORY, JOBS = command_arguments("shared")
LAW_OPTIONS = (STIFFNESS, MAX_DEPTH, RENDERING, *SHIPPED_LAW_ARGUMENTS.values())


Parser = Callable[[str], Any]
"""Function that converts the text of an option to its value."""


def parser_callback(parse: Parser) -> Callable[[click.Context, click.Parameter, str | None], Any]:
    """Return a callback that parses the text of an option."""

    def parse_given(_ctx: click.Context, _option: click.Parameter, text: str | None) -> Any:
        return None if text is None else parse(text)

    return parse_given


def option_help(argument: Argument) -> str:
    """Return the help text of the option of an argument.

    Example:
        >>> option_help(Argument("length", "of the scan", "m", 0.1, example="5mm"))
        "Of the scan, such as '5mm'.  [default: 100 mm]"
    """
    text = argument.description
    if text[1:2].isalpha():  # a leading symbol keeps its case: "c of law H"
        text = f"{text[0].upper()}{text[1:]}"
    if argument.example:
        text += f", such as '{argument.example}'"
    if argument.default_text:
        return f"{text}.  [default: {argument.default_text}]"
    return f"{text}."


def argument_options(
    arguments: Iterable[Argument],
    make_parser: Callable[[Argument], Parser] | None = None,
    *,
    hidden: Collection[Argument] = (),
) -> Callable[[Command], Command]:
    """Return a decorator that adds an option for each argument.

    Args:
        arguments: declarations of the arguments.
        make_parser: returns the parser of an argument; default: the one of its declaration.
        hidden: arguments whose options are not shown.
    """

    def decorate(command: Command) -> Command:
        for argument in reversed(list(arguments)):
            flag = f"--{argument.name.replace('_', '-')}"
            help_text = option_help(argument)
            if argument.form == "switch":
                command = click.option(flag, is_flag=True, default=None, help=help_text)(command)
                continue
            parse = argument.parse if make_parser is None else make_parser(argument)
            command = click.option(
                flag,
                argument.name,
                metavar=_metavar(argument, is_list=make_parser is list_parser),
                callback=parser_callback(parse),
                help=help_text,
                hidden=argument in hidden,
            )(command)
        return command

    return decorate


def _metavar(argument: Argument, *, is_list: bool) -> str:
    if is_list or argument.form == "items":
        return "LIST"
    if argument.form == "integer":
        return "N"
    return "|".join(argument.choices) or "TEXT"


def single_value_parser(argument: Argument) -> Parser:
    """Return a parser of a single value that refuses a list."""

    def parse(text: str) -> Any:
        values = list_parser(argument)(text)
        if len(values) > 1:
            raise ParameterError(argument.name, "must be a single value", text)
        return values[0]

    return parse


def list_parser(argument: Argument) -> Parser:
    """Return a parser of lists "a; b; c"."""

    def parse(text: str) -> list[Any]:
        parts = [part for part in text.replace(",", ";").split(";") if part.strip()]
        if not parts:
            raise ParameterError(argument.name, "must be one or several values, 'a; b'", text)
        return [argument.parse(part) for part in parts]

    return parse


def provided_values(values: Mapping[str, Any], arguments: Iterable[Argument]) -> dict[str, Any]:
    """Return the values of the given options, by the keyword of each argument."""
    return {
        argument.keyword or argument.name: values[argument.name]
        for argument in arguments
        if values[argument.name] is not None
    }


def parse_device(text: str) -> Device:
    """Return the device of a text.

    Raises:
        ParameterError: for an unknown device, or several.
    """
    devices = parse_devices(text)
    if len(devices) > 1:
        raise ParameterError("device", "must be a single device: only compare takes several", text)
    return devices[0]


def device_option(
    help_text: str = "Device of the catalogue, or a TOML file.  [default: omega.3]",
    parse: Parser = parse_device,
) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--device``."""
    return click.option(
        "--device", metavar="ID|FILE", callback=parser_callback(parse), help=help_text
    )


def parse_devices(text: str) -> tuple[Device, ...]:
    """Return the devices of a text, separated by commas or semicolons.

    Raises:
        ParameterError: for an unknown device, or one that is named twice.
    """
    if os.path.exists(text):  # the name of a file may contain separators
        return (load_device(text),)
    parts = [part.strip() for part in text.replace(";", ",").split(",") if part.strip()]
    devices = tuple(map(load_device, parts or [text]))
    if len({device.id for device in devices}) < len(devices):
        raise ParameterError("device", "names one device twice", text)
    return devices


def law_option(help_text: str, *, hidden: bool = False) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--law``."""
    parse = parser_callback(find_law)
    return click.option("--law", metavar="LETTER", callback=parse, help=help_text, hidden=hidden)


def laws_option(help_text: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--laws``."""
    parse = parser_callback(find_laws)
    return click.option("--laws", metavar="LETTERS", callback=parse, help=help_text)


plugin_option = click.option(
    "--plugin",
    "--law-module",
    "plugin",
    metavar="FILE",
    multiple=True,
    is_eager=True,  # other options may name what it defines
    expose_value=False,
    callback=load_plugins,
    help="Python file with user-defined laws, textures, readers, drivers or other extensions, which"
    " is executed; may be repeated.",
)


def law_options(
    arguments: Iterable[Argument] = LAW_OPTIONS, hidden: Collection[Argument] = ()
) -> Callable[[Command], Command]:
    """Return a decorator that adds the options of the law, ``--set`` and ``--plugin``."""

    def decorate(command: Command) -> Command:
        return argument_options(arguments, hidden=hidden)(set_option(plugin_option(command)))

    return decorate


def surface_options(
    law_help: str, stiffness: Argument = REQUESTED_STIFFNESS
) -> Callable[[Command], Command]:
    """Return a decorator that adds SURFACE and the options of law, device and measured files."""

    def decorate(command: Command) -> Command:
        command = law_options((stiffness, *LAW_OPTIONS[1:]))(file_options(command))
        return click.argument("surface")(law_option(law_help)(device_option()(command)))

    return decorate


def _apply_memory_limit(context: click.Context, _option: click.Parameter, text: str | None) -> None:
    """Limit the memory of surfaces until the command ends."""
    size = MEMORY.parse(text) if text is not None else None
    context.with_resource(limit_memory(str(context.command.name), size))


_memory_option = click.option(
    "--memory",
    metavar="SIZE",
    expose_value=False,
    callback=_apply_memory_limit,
    help=option_help(MEMORY),
)


def _apply_job_limit(context: click.Context, _option: click.Parameter, text: str | None) -> None:
    """Limit the number of processes until the command ends."""
    count = JOBS.validate(JOBS.parse(text)) if text is not None else available_cores()
    context.with_resource(limit_processes(count))


jobs_option = click.option(
    "--jobs", metavar="N", expose_value=False, callback=_apply_job_limit, help=option_help(JOBS)
)


def file_options(command: Command) -> Command:
    """Add the options of a measured file and ``--memory``."""
    return help_surface_option(argument_options(FILE_ARGUMENTS)(_memory_option(command)))


def file_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the options of a measured file."""
    return provided_values(values, FILE_ARGUMENTS)


def surface_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the options of the surface and of the law parameters.

    Raises:
        ParameterError: for a parameter given by its option and by ``--set``.
    """
    result = provided_values(values, LAW_OPTIONS)
    if values.get("law") is not None:
        result["law"] = values["law"]
    for name, value in values["settings"].law.items():
        if name in result:
            raise ParameterError(
                name, f"is given twice: by --{name.replace('_', '-')} and by --set {name}=..."
            )
        result[name] = value
    return result


def select_device(device: Device | None, scene: Scene, values: Mapping[str, Any]) -> Device:
    """Return the device of ``--device``, of the scene, or the default, with the overrides."""
    from asperity.analysis.results.compare import DEFAULT_DEVICE

    chosen = device or scene.device or load_device(DEFAULT_DEVICE)
    settings: Overrides = values["settings"]
    return settings.apply_to(chosen)


def load_surface(
    source: str,
    device: Device | None,
    values: Mapping[str, Any],
    laws: Sequence[Law] = (),
    **defaults: Any,
) -> tuple[Texture, Device, dict[str, Any]]:
    """Return the texture, the device and all other arguments of SURFACE and the options.

    Args:
        source: a texture with its arguments, a file, or a scene.
        device: the device of ``--device``, which takes precedence over the scene's.
        values: values of the options, by name.
        laws: laws to compare; default: the law of ``--law`` or of the scene, which is then
            among the arguments.
        defaults: defaults of the other arguments.

    Raises:
        ParameterError: for a missing, unknown or invalid value.
    """
    from asperity.frictional import check_arguments_apply
    from asperity.scene import load_scene
    from asperity.scene.scene_file import surface_keywords

    requested = surface_values(values)
    scene = load_scene(source, file_values(values))
    merged = {**defaults, **scene.surface, **requested}
    if not laws and "law" in merged:
        laws = [find_law(merged["law"])]
    elif not laws:
        laws = tuple(REGISTERED_LAWS.values())
    check_arguments_apply(requested, laws)
    arguments = surface_keywords(merged, *laws)
    return scene.texture, select_device(device, scene, values), arguments
