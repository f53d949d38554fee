"""Write valid and invalid X3P files for tests."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

STORED = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


@dataclass
class X3pSpec:
    """The content of a file; all defaults are valid."""

    stored: NDArray[np.float64]  # shape (ny, nx), in stored units
    code: str = "D"
    z_type: str = "A"
    z_increment: str = "1"
    z_offset: str = "0"
    x_type: str = "I"
    y_type: str = "I"
    x_increment: str = "2e-6"
    y_increment: str = "3e-6"
    x_positions: NDArray[np.float64] | None = None  # of an absolute axis, one per point
    y_positions: NDArray[np.float64] | None = None
    position_code: str = "D"
    feature: str = "SUR"
    size: tuple[str, str, str] | None = None
    folder: str = ""
    inline: bool = False
    valid: NDArray[np.bool_] | None = None
    prolog: str = '<?xml version="1.0" encoding="UTF-8"?>'
    revision: str = "ISO5436 – 2000"
    date: str = "some day in May"
    encoding: str = "utf-8"
    root: str = "p:ISO5436_2"
    point_md5: str | None = None
    valid_md5: str | None = None
    main_md5: str | None = None
    md5_file: str | None = "{md5} *main.xml\n"
    cut: int = 0  # bytes cut from the point data
    rotation: str = ""
    with_main: bool = True
    extra: dict[str, bytes] = field(default_factory=dict)


def point_bytes(spec: X3pSpec) -> bytes:
    """Pack the points one by one: absolute axes first, x running fastest."""
    columns = []
    for kind, positions in ((spec.x_type, spec.x_positions), (spec.y_type, spec.y_positions)):
        if kind == "A":
            assert positions is not None
            columns.append(positions.ravel().astype(STORED[spec.position_code]))
    columns.append(spec.stored.ravel().astype(STORED[spec.code]))
    content = b"".join(column[k].tobytes() for k in range(spec.stored.size) for column in columns)
    return content[: len(content) - spec.cut]


def _axis(name: str, kind: str, code: str, increment: str, offset: str) -> str:
    return (
        f"<{name}><AxisType>{kind}</AxisType><DataType>{code}</DataType>"
        f"<Increment>{increment}</Increment><Offset>{offset}</Offset></{name}>"
    )


def _md5(content: bytes) -> str:
    return hashlib.md5(content).hexdigest()


def main_xml(spec: X3pSpec, points: bytes, valid: bytes | None) -> bytes:
    """Return main.xml."""
    ny, nx = spec.stored.shape
    size = spec.size or (str(nx), str(ny), "1")
    if spec.inline:
        data = "<DataList><Datum>0;0;1</Datum></DataList>"
    else:
        md5 = spec.point_md5 if spec.point_md5 is not None else _md5(points)
        data = f"<PointDataLink>bindata/data.bin</PointDataLink><MD5ChecksumPointData>{md5}"
        data += "</MD5ChecksumPointData>"
        if valid is not None:
            md5 = spec.valid_md5 if spec.valid_md5 is not None else _md5(valid)
            data += "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>"
            data += f"<MD5ChecksumValidPoints>{md5}</MD5ChecksumValidPoints>"
        data = f"<DataLink>{data}</DataLink>"
    sizes = "".join(f"<Size{k}>{v}</Size{k}>" for k, v in zip("XYZ", size, strict=True))
    text = (
        f"{spec.prolog}<{spec.root} xmlns:p='http://www.opengps.eu/2008/ISO5436_2'>"
        f"<Record1><Revision>{spec.revision}</Revision><FeatureType>{spec.feature}</FeatureType>"
        f"<Axes>{_axis('CX', spec.x_type, spec.position_code, spec.x_increment, '0')}"
        f"{_axis('CY', spec.y_type, spec.position_code, spec.y_increment, '0')}"
        f"{_axis('CZ', spec.z_type, spec.code, spec.z_increment, spec.z_offset)}"
        f"{spec.rotation}</Axes></Record1>"
        f"<Record2><Date>{spec.date}</Date></Record2>"
        f"<Record3><MatrixDimension>{sizes}</MatrixDimension>{data}</Record3>"
        f"<Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></{spec.root}>"
    )
    return text.encode(spec.encoding)


def write_x3p(path: Path, spec: X3pSpec) -> Path:
    """Write the file and return its path."""
    points = point_bytes(spec)
    valid = None
    if spec.valid is not None:
        valid = np.packbits(spec.valid.ravel(), bitorder="little").tobytes()
    main = main_xml(spec, points, valid)
    members = dict(spec.extra)
    if spec.with_main:
        members["main.xml"] = main
    if not spec.inline:
        members["bindata/data.bin"] = points
    if valid is not None:
        members["bindata/valid.bin"] = valid
    if spec.md5_file is not None:
        members["md5checksum.hex"] = spec.md5_file.format(md5=spec.main_md5 or _md5(main)).encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name if name.startswith("__MACOSX") else spec.folder + name, content)
    return path
