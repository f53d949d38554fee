"""A device file to fill in: every field with its unit and what it is."""

from __future__ import annotations

from asperity.devices.device import FIELD_TABLE
from asperity.devices.reading import device_names, load_device

_HEAD = """\
# A device of your own. Take the "# " away from the lines of what you know, put your number in the
# place of the example, and leave the others as they are: what is not known is said, not guessed.
# Every number needs its unit. Then: asperity compare cloth --device mine.toml

id = "mine"
name = "My device"
# axes = "x to the right, y away from the user, z up"
# driver = "./device.so"  # what `asperity run --driver real` is on it
# notes = ["what else one must know, in sentences"]

"""
_TABLE = """
# Of each number more can be said, in a table at the end of the file instead of the line above:
# [max_stiffness]
# value = "1.8 N/mm"
# source = "smooth wall, raised until it buzzed"  # where the number was read
# verified = "measured"  # or "read" in a source that others can read, or false
# cycled = "2 N/mm"  # the least stiffness at which the wall began to cycle
# directions = ["x", "z"]  # along which it was pushed
# update_rate = "1 kHz"  # of this test
# positions = "stepped"  # by an encoder, or "exact"
# lightest = 0.8  # damping in the lightest direction as a share of that along directions
"""


def device_template() -> str:
    """Return a device file (TOML) to fill in; it is read as it stands, and with every line.

    Example:
        >>> [line for line in device_template().splitlines() if "max_force" in line]
        ['# max_force = "3.3 N"  # greatest force, for a moment [N]']
    """
    lines = []
    for name, field in FIELD_TABLE.items():
        unit = "" if field.unit == "1" else f" [{field.unit}]"
        lines.append(f"# {name} = {_example(name)}  # {field.words}{unit}\n")
    return "".join([_HEAD, *lines, _TABLE])


def _example(name: str) -> str:
    """Return a value that a device of the catalogue has, or one in the right unit."""
    unit = FIELD_TABLE[name].unit
    for known in ("touch", "pantograph", *device_names()):
        datum = load_device(known).data.get(name)
        if datum is not None:
            plain = datum.text.replace("·", "*").replace("µ", "u")
            return plain if unit == "1" else f'"{plain}"'
    return "1" if unit == "1" else f'"0.1 {unit}"'
