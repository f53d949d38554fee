"""A scene to begin with: it runs as it stands, and says what else it may say."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from asperity.arguments import Argument
from asperity.devices import device_names
from asperity.measured.arguments import DRAWN
from asperity.scene.loading import KINDS
from asperity.scene.sections import HANDS, MOTIONS, RUN, Part, surface_arguments
from asperity.servo import safety
from asperity.textures.texture import Kind

_HEAD = """\
# A scene: a texture, the law that renders it, the device, the hand and what it does.
#   asperity compare {name}   which law, at which stiffness
#   asperity limits {name}    whether it can be felt
#   asperity simulate {name}  run it and say where the energy goes
#   asperity run {name}       the same as time goes, in a loop as on a device
#   asperity onset {name}     the stiffness at which it begins to buzz (motion: still)
# Take the "# " away from a line to use it. Every quantity needs its unit.
"""
# What the scene says; a value in the form in which TOML has it.
_TEXTURE = {"amplitude": '"0.1 mm"', "period": '"2 mm"'}
_SURFACE = {"law": '"C"', "stiffness": '"300 N/m"', "max_depth": '"0.5 mm"'}
_DEVICE = {"id": '"touch"', "damping": '"0.5 N*s/m"', "update_rate": '"1 kHz"'}
_HAND = {"stiffness": '["300 N/m", "300 N/m", "0 N/m"]', "damping": '"3 N*s/m"', "mass": '"50 g"',
         "force": '["0 N", "0 N", "-0.3 N"]'}  # fmt: skip
_MOTION = {"start": '["-10 mm", "0 mm", "0 mm"]', "end": '["10 mm", "0 mm", "0 mm"]',
           "speed": '"0.05 m/s"', "count": "2"}  # fmt: skip
_SPACES = {"space": 3, "plane": 2}


def scene_template(name: str = "scene.toml") -> str:
    """Return a scene file (TOML) with comments, which runs as it stands.

    Args:
        name: of the file, for the commands in its head.

    Example:
        >>> [line for line in scene_template().splitlines() if line.startswith("period")]
        ['period = "2 mm"  # wavelength [m]']
    """
    sinusoid = KINDS["sinusoid"].arguments
    own = {argument.name for argument in sinusoid}
    drawn = [argument for argument in DRAWN if argument.name not in own]
    devices = (
        f"# One of {', '.join(device_names())}; fields that stand here come before the\n"
        "# catalogue's. These two are assumed: asperity devices touch says what is known.\n"
    )
    return "\n".join(
        [
            _HEAD.format(name=name),
            "[texture]",
            _kind("sinusoid", KINDS, "asperity surfaces says what each takes"),
            _lines((*sinusoid, *drawn), _TEXTURE),
            "[surface]",
            _lines(surface_arguments(), _SURFACE),
            "[device]",
            devices + "".join(f"{key} = {value}\n" for key, value in _DEVICE.items()),
            "[hand]",
            _kind("spring", HANDS),
            _lines(HANDS["spring"].arguments, _HAND),
            "[motion]",
            _kind("strokes", MOTIONS),
            _lines(MOTIONS["strokes"].arguments, _MOTION),
            "[run]",
            _lines(RUN, {}),
            "[servo]",
            _lines(safety.ARGUMENTS, {}),
        ]
    )


def _kind(name: str, kinds: Mapping[str, Kind] | Mapping[str, Part], more: str = "") -> str:
    others = ", ".join(other for other in sorted(kinds) if other != name)
    return f'kind = "{name}"  # or {others}' + (f"; {more}" if more else "")


def _lines(arguments: Iterable[Argument], given: Mapping[str, str]) -> str:
    """Return a line for each argument; those that are not given are comments."""
    lines = []
    for argument in arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        words = f"{argument.words}{unit}"
        if argument.name in given:
            lines.append(f"{argument.name} = {given[argument.name]}  # {words}")
        else:
            default = f"; default {argument.default_text}" if argument.default_text else ""
            lines.append(f"# {argument.name} = {_example(argument)}  # {words}{default}")
    return "\n".join(lines) + "\n"


def _example(argument: Argument) -> str:
    """Return a value as TOML writes it: the example, the default, or one of this form."""
    quoted = '"{}"'.format
    if argument.form == "switch":
        return "true"
    if argument.form in _SPACES:
        zeros = [quoted(f"0 {argument.unit}")] * _SPACES[argument.form]
        return f"[{', '.join(zeros)}]"
    if argument.form == "vector":
        return "[1, 0]"
    if argument.example:
        return quoted(argument.example) if argument.unit else argument.example
    value = 1 if argument.default is None else argument.default
    if not argument.unit:
        return quoted(value) if argument.form == "text" else f"{value}"
    return quoted(argument.readable(value).replace("°", " deg").replace("µ", "u"))
