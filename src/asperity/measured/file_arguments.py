"""Arguments for reading and preparing a measured surface, in the order in which they apply.

All lengths are in the surface's own metres, before magnification.
"""

from __future__ import annotations

from dataclasses import replace

from asperity.core.arguments import Argument

READING_ARGUMENTS = (
    Argument(
        "channel",
        "data channel to read, by name or number, if the file has several",
        form="channel",
    ),
    Argument("unit", "unit of the heights, if the file states none", form="text", example="um"),
    Argument("integrate_normals", "integrate a normal map to heights", form="switch"),
    Argument(
        "resample",
        "interpolate scattered points on a regular grid of this pitch",
        "m",
        example="5um",
    ),
)
"""Arguments of reading."""

MAGNIFICATION_ARGUMENTS = (
    Argument("magnify", "magnification in all directions", default=1.0),
    Argument(
        "magnify_height", "magnification of the heights", default_description="that of magnify"
    ),
)
"""Arguments for a surface that is already prepared."""

_PITCH = "distance between points, one value or one each for x and y"
_CUTOFF = "cut-off wavelength of the Gaussian S-filter, before magnification"
_DEGREE = "degree of the polynomial to subtract: 0 for the mean, 1 for a plane, at most 10"
PREPARATION_ARGUMENTS = (
    Argument("pitch", _PITCH, "m", form="pair", example="5um; 8um"),
    Argument(
        "height_range",
        "scale the heights to this peak-to-valley height",
        "m",
        None,
        "none",
        example="0.2mm",
    ),
    Argument(
        "outliers",
        "replace points that deviate by more than this number of robust standard deviations",
        "",
        None,
        "none",
        example="6",
    ),
    Argument("max_missing", "maximum fraction of missing points", default=0.25),
    Argument("form", _DEGREE, "", 1, "1, levelling", form="integer"),
    Argument("cutoff", _CUTOFF, "m", None, "4 samples", example="10um"),
    Argument(
        "l_cutoff",
        "cut-off wavelength of the L-filter, which removes longer wavelengths",
        "m",
        None,
        "no L-filter",
        example="0.8mm",
    ),
    Argument(
        "tip_radius",
        "radius of the spherical stylus tip that traces the surface, before magnification",
        "m",
        None,
        "none",
        example="5um",
    ),
    Argument("periodic", "blend opposite borders so that the surface repeats", form="switch"),
    Argument(
        "blend", "width of the blended band", "m", None, "a tenth of each side", example="0.1mm"
    ),
    *MAGNIFICATION_ARGUMENTS,
)
"""Arguments of the preparation."""

FILE_ARGUMENTS = (*READING_ARGUMENTS, *PREPARATION_ARGUMENTS)
"""All arguments of a measured file."""

_SYNTHETIC_NAMES = ("height_range", "cutoff", "l_cutoff", "tip_radius", "magnify", "magnify_height")
SYNTHETIC_ARGUMENTS = tuple(
    replace(argument, default_description="none") if argument.name == "cutoff" else argument
    for argument in PREPARATION_ARGUMENTS
    if argument.name in _SYNTHETIC_NAMES
)
"""Arguments for any texture: a synthetic one has no missing points, no spikes and no form."""
