"""The arguments of reading and preparing a measured surface, in the order of the work.

All lengths are in the surface's own metres, before magnification.
"""

from __future__ import annotations

from dataclasses import replace

from asperity.arguments import Argument

READING = (
    Argument(
        "channel",
        "which data channel of a file that has several, by name or number",
        form="channel",
    ),
    Argument("unit", "unit of the heights where the file names none", form="text", example="um"),
    Argument("integrate_normals", "make heights of a normal map", form="switch"),
    Argument(
        "resample",
        "pitch of the map or profile that is interpolated through points on no regular grid",
        "m",
        example="5um",
    ),
)
"""What is told to the reader of a file."""

MAGNIFYING = (
    Argument("magnify", "factor of the size, and of the height unless told otherwise", default=1.0),
    Argument("magnify_height", "factor of the height", default_words="that of the size"),
)
"""What can be told of a surface that was prepared before."""

PREPARING = (
    Argument(
        "pitch",
        "distance of the points, one or two for x and y",
        "m",
        form="pair",
        example="5um; 8um",
    ),
    Argument(
        "height_range",
        "peak-to-valley height that the heights are scaled to",
        "m",
        example="0.2mm",
    ),
    Argument("outliers", "replace spikes beyond so many robust standard deviations", example="6"),
    Argument("max_missing", "share of the points that may be missing", default=0.25),
    Argument(
        "form",
        "degree of the polynomial that is subtracted: 0 the mean, 1 a plane, up to 10",
        default=1,
        default_words="1, levelling",
        form="integer",
    ),
    Argument(
        "cutoff",
        "cut-off wavelength of the Gaussian S-filter, before magnification",
        "m",
        default_words="4 samples",
        example="10um",
    ),
    Argument(
        "l_cutoff",
        "cut-off wavelength of the L-filter, which removes longer waves",
        "m",
        example="0.8mm",
    ),
    Argument(
        "tip_radius",
        "radius of the ball that feels the surface, before magnification",
        "m",
        example="5um",
    ),
    Argument("periodic", "blend opposite borders so that the surface repeats", form="switch"),
    Argument(
        "blend",
        "width of the blended band",
        "m",
        default_words="a tenth of each side",
        example="0.1mm",
    ),
    *MAGNIFYING,
)
"""What is told to the preparation."""

FILE_ARGUMENTS = (*READING, *PREPARING)
"""Everything that can be told of a measured file."""

_OF_ANY = ("height_range", "cutoff", "l_cutoff", "tip_radius", "magnify", "magnify_height")
DRAWN = tuple(
    replace(argument, default_words="none") if argument.name == "cutoff" else argument
    for argument in PREPARING
    if argument.name in _OF_ANY
)
"""What can be told of any texture: a drawn one has no missing points, no spikes and no form."""
