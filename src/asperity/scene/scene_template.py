"""A template of a scene file, which runs as it is and lists all arguments as comments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from asperity.core.arguments import Argument
from asperity.devices import device_names
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.scene.scene_file import TEXTURE_KINDS
from asperity.scene.sections import HANDS, MOTIONS, RUN_ARGUMENTS, SectionKind, surface_arguments
from asperity.servo import safety
from asperity.textures.texture import TextureKind

_TEMPLATE = Path(__file__).with_suffix(".txt")
# Values of the template, in TOML.
_TEXTURE = {"amplitude": '"0.1 mm"', "period": '"2 mm"'}
_SURFACE = {"law": '"C"', "stiffness": '"300 N/m"', "max_depth": '"0.5 mm"'}
_HAND = {"stiffness": '["300 N/m", "300 N/m", "0 N/m"]', "damping": '"3 N*s/m"', "mass": '"50 g"',
         "force": '["0 N", "0 N", "-0.3 N"]'}  # fmt: skip
_MOTION = {"start": '["-10 mm", "0 mm", "0 mm"]', "end": '["10 mm", "0 mm", "0 mm"]',
           "speed": '"0.05 m/s"', "count": "2"}  # fmt: skip
_AXIS_COUNTS = {"space": 3, "plane": 2}


def scene_template(name: str = "scene.toml") -> str:
    """Return a scene file (TOML) with comments, which runs as it stands.

    Args:
        name: name of the file, for the commands in its header.

    Example:
        >>> [line for line in scene_template().splitlines() if line.startswith("period")]
        ['period = "2 mm"  # wavelength [m]']
    """
    sinusoid = TEXTURE_KINDS["sinusoid"].arguments
    names = {argument.name for argument in sinusoid}
    others = [argument for argument in SYNTHETIC_ARGUMENTS if argument.name not in names]
    texture = _kind_line("sinusoid", TEXTURE_KINDS, "asperity surfaces lists their arguments")
    hand = _kind_line("spring", HANDS)
    motion = _kind_line("strokes", MOTIONS)
    return _TEMPLATE.read_text("utf-8").format(
        name=name,
        texture=texture + _argument_lines((*sinusoid, *others), _TEXTURE),
        surface=_argument_lines(surface_arguments(), _SURFACE),
        devices=", ".join(device_names()),
        hand=hand + _argument_lines(HANDS["spring"].arguments, _HAND),
        motion=motion + _argument_lines(MOTIONS["strokes"].arguments, _MOTION),
        run=_argument_lines(RUN_ARGUMENTS, {}),
        servo=_argument_lines(safety.ARGUMENTS, {}).rstrip("\n"),
    )


def _kind_line(
    name: str, kinds: Mapping[str, TextureKind] | Mapping[str, SectionKind], more: str = ""
) -> str:
    others = ", ".join(other for other in sorted(kinds) if other != name)
    return f'kind = "{name}"  # or {others}' + (f"; {more}" if more else "") + "\n"


def _argument_lines(arguments: Iterable[Argument], values: Mapping[str, str]) -> str:
    """Return a line for each argument, as a comment if it has no value."""
    lines = []
    for argument in arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        words = f"{argument.description}{unit}"
        if argument.name in values:
            lines.append(f"{argument.name} = {values[argument.name]}  # {words}")
        else:
            default = f"; default {argument.default_text}" if argument.default_text else ""
            lines.append(f"# {argument.name} = {_example_value(argument)}  # {words}{default}")
    return "\n".join(lines) + "\n"


def _example_value(argument: Argument) -> str:
    """Return a value in TOML: the example, the default, or one of this form."""
    quoted = '"{}"'.format
    if argument.form == "switch":
        return "true"
    if argument.form in _AXIS_COUNTS:
        zeros = [quoted(f"0 {argument.unit}")] * _AXIS_COUNTS[argument.form]
        return f"[{', '.join(zeros)}]"
    if argument.form == "vector":
        return "[1, 0]"
    if argument.example:
        return quoted(argument.example) if argument.unit else argument.example
    value = 1 if argument.default is None else argument.default
    if not argument.unit:
        return quoted(value) if argument.form == "text" else f"{value}"
    return quoted(argument.format_value(value).replace("°", " deg").replace("µ", "u"))
