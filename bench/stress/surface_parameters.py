"""Our surface parameters beside those of other libraries, on the same heights.

    python bench/stress/surface_parameters.py [FILE ...]

In an environment that has surfalize or SurfaceTopography beside asperity. Prints a line for each
parameter; what differs by definition is said below the table.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.measured.parameters import compute_parameters, correlation_parameters
from asperity.measured.reading import read_surface

MICRO = 1e-6
NOTES = """All take the same facets; of Sdq the others count the edges of the map otherwise (a few
differences in thousands). Sal and Str are read at other points between the samples."""


def surfaces(paths: list[str]) -> Iterator[tuple[str, FloatArray, tuple[float, float]]]:
    """Yield made surfaces, then those of the files, holes filled with the mean."""
    y, x = np.mgrid[:256, :300] * MICRO
    yield "sinusoid", MICRO * np.sin(2 * np.pi * x / 30e-6), (MICRO, MICRO)
    yield "crossed", MICRO * np.sin(2 * np.pi * x / 30e-6) * np.cos(y / 9e-6), (MICRO, MICRO)
    rng = np.random.default_rng(1)
    yield "noise", MICRO * rng.standard_normal((256, 300)), (MICRO, MICRO)
    for path in paths:
        raw = read_surface(path)
        if raw.heights.ndim == 2 and raw.pitch is not None:
            filled = np.where(np.isnan(raw.heights), np.nanmean(raw.heights), raw.heights)
            yield path.split("/")[-1], filled, (raw.pitch[0], raw.pitch[1])


def asperity_parameters(heights: FloatArray, pitch: tuple[float, float]) -> dict[str, Any]:
    length, ratio = correlation_parameters(heights, pitch)
    return {**compute_parameters(heights, pitch), "Sal": length, "Str": ratio}


def surfalize_parameters(heights: FloatArray, pitch: tuple[float, float]) -> dict[str, Any]:
    from surfalize import Surface

    surface = Surface(heights / MICRO, pitch[0] / MICRO, pitch[1] / MICRO)
    found = {}
    for symbol in ("Sq", "Sa", "Sz", "Sp", "Sv", "Ssk", "Sku", "Sdq", "Sdr", "Sal", "Str"):
        size = MICRO if symbol in {"Sq", "Sa", "Sz", "Sp", "Sv", "Sal"} else 1.0
        size = 0.01 if symbol == "Sdr" else size
        found[symbol] = float(getattr(surface, symbol)()) * size
    return found


def surface_topography_parameters(
    heights: FloatArray, pitch: tuple[float, float]
) -> dict[str, Any]:
    from SurfaceTopography import Topography

    z = (heights - heights.mean()).T
    sizes = tuple(n * p for n, p in zip(z.shape, pitch, strict=True))
    surface = Topography(z, sizes)
    return {"Sq": surface.rms_height_from_area(), "Sdq": surface.rms_gradient()}


def main() -> None:
    others: dict[str, Callable[..., dict[str, Any]]] = {
        "surfalize": surfalize_parameters,
        "SurfaceTopography": surface_topography_parameters,
    }
    for name, heights, pitch in surfaces(sys.argv[1:]):
        columns = {"ours": asperity_parameters(heights, pitch)}
        for library, measure in others.items():
            try:
                columns[library] = measure(heights, pitch)
            except ImportError:
                print(f"{library} is not installed")
        print(f"\n{name:12}", *(f"{column:>18}" for column in columns))
        for symbol in columns["ours"]:
            values = [column.get(symbol) for column in columns.values()]
            print(f"{symbol:12}", *(f"{'–' if v is None else f'{v:.7g}':>18}" for v in values))
    print(f"\n{NOTES}")


if __name__ == "__main__":
    main()
