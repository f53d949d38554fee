"""Text files of heights: written, read, refused or asked about."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.preparation import check_plausible
from asperity.measured.reading import RawSurface, read_surface

HEIGHTS = np.array([[0.5, -1.25, 2.0, 1.0], [3.0, 4.5, -5e-3, 1e2], [7.0, 8.0, 9.5, 3.0]])


MAP = "1 -2 3 4\n5 6 7 8\n9 10 11 12\n"


def read_text(tmp_path: Path, text: str | bytes) -> RawSurface:
    path = tmp_path / "test.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_surface(path)


def assert_refused(tmp_path: Path, text: str | bytes, match: str) -> None:
    with pytest.raises(SurfaceFileError, match=match) as caught:
        read_text(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("test.txt")


def assert_asked(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(ParameterError, match=match):
        read_text(tmp_path, text)


def assert_unit_is_open(raw: RawSurface) -> None:
    """The numbers are those of the file, and the preparation asks for their unit."""
    assert raw.relative
    assert raw.lacks_unit
    assert not raw.has_units
    with pytest.raises(ParameterError, match=r"have no unit.*or their unit, such as unit='um'"):
        check_plausible(raw, raw.heights, (1e-6, 1e-6)[: raw.heights.ndim])


def matrix_text(separator: str, decimal: str = ".", end: str = "\n") -> str:
    rows = (separator.join(f"{v!r}" for v in row.tolist()) for row in HEIGHTS)
    return end.join(row.replace(".", decimal) if decimal != "." else row for row in rows) + end


def point_lines(order: list[int] | None = None, left_out: tuple[int, ...] = ()) -> list[str]:
    rows = [(0.5 * i, 2.0 + j, 10.0 * i + j) for j in range(4) for i in range(5)]
    selected = [rows[k] for k in order or range(20) if k not in left_out]
    return [f"{x} {y} {z}" for x, y, z in selected]
