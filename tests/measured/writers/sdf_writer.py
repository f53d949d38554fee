"""Write valid and invalid surface data files (SDF) for tests."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FORMATS = {0: "<B", 1: "<H", 2: "<I", 3: "<f", 4: "<b", 5: "<h", 6: "<i", 7: "<d"}


@dataclass
class SdfSpec:
    """The content of a file in stored numbers, not metres; all defaults are valid."""

    stored: NDArray[np.float64]  # shape (profiles, points); NaN is written as BAD
    version: str = "ISO-1.0"
    scale: tuple[str, str, str] = ("2.5e-6", "3E-06", "1e-9")
    kind: int = 7
    end: str = "\r\n"
    fields: dict[str, str] = field(default_factory=dict)  # replaced or added
    without: tuple[str, ...] = ()
    trailer: str = "\r\n*\r\nOperator = A. N. Other\r\n*\r\n"
    per_line: int = 7  # numbers in a line: not the length of a profile


def write_ascii(path: Path, spec: SdfSpec) -> Path:
    """Write the text form and return the path."""
    profiles, points = spec.stored.shape
    fields = {
        "ManufacID": "tests",
        "CreateDate": "010220261200",
        "ModDate": "010220261201",
        "NumPoints": str(points),
        "NumProfiles": str(profiles),
        "Xscale": spec.scale[0],
        "Yscale": spec.scale[1],
        "Zscale": spec.scale[2],
        "Zresolution": "-1",
        "Compression": "0",
        "DataType": str(spec.kind),
        "CheckType": "0",
    } | spec.fields
    lines = [f"a{spec.version}"]
    lines += [f"{key:12}= {text}" for key, text in fields.items() if key not in spec.without]
    words = ["BAD" if np.isnan(v) else _text(v, spec.kind) for v in spec.stored.ravel().tolist()]
    rows = [" ".join(words[k : k + spec.per_line]) for k in range(0, len(words), spec.per_line)]
    path.write_bytes((spec.end.join([*lines, "*", *rows]) + spec.trailer).encode("latin-1"))
    return path


def _text(value: float, kind: int) -> str:
    return f"{value:.17g}" if kind in (3, 7) else str(int(value))


def write_binary(path: Path, spec: SdfSpec, extra: bytes = b"") -> Path:
    """Write the binary form, value by value, and return the path."""
    profiles, points = spec.stored.shape
    counter = "I" if spec.version.endswith("2.0") else "H"
    content = f"b{spec.version}".encode().ljust(8)
    content += b"tests\0junk" + b"010220261200" + b"010220261201"
    content += struct.pack(f"<{counter}{counter}", points, profiles)
    content += struct.pack("<dddd", *map(float, spec.scale), -1.0)
    options = [int(spec.fields.get(key, "0")) for key in ("Compression", "CheckType")]
    content += struct.pack("<BBB", options[0], spec.kind, options[1]) + extra
    for value in spec.stored.ravel().tolist():
        whole = value if spec.kind in (3, 7) else int(value)
        content += struct.pack(FORMATS[spec.kind], whole)
    path.write_bytes(content)
    return path
