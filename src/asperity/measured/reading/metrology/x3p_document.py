"""The main.xml of an X3P file, which describes its binary data."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import parse_number
from asperity.measured.reading.raw_surface import check_point_count

DTYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


@dataclass(frozen=True)
class CoordinateAxis:
    """A coordinate axis: a coordinate is offset + factor * stored number.

    The data of an absolute axis are in metres: its increment is ignored, with a note.
    """

    name: str
    is_incremental: bool
    type_code: str
    increment: float
    offset: float

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy type of the stored numbers."""
        return np.dtype(DTYPES[self.type_code])

    @property
    def factor(self) -> float:
        """Metres per stored unit."""
        return self.increment if self.is_incremental else 1.0


@dataclass(frozen=True)
class BinaryLink:
    """Name and MD5 (empty if none) of a binary file in the archive."""

    name: str
    md5: str


@dataclass(frozen=True)
class X3pDocument:
    """The content of main.xml; either ``points_link`` or ``datums`` is set."""

    axes: tuple[CoordinateAxis, CoordinateAxis, CoordinateAxis]
    is_profile: bool
    shape: tuple[int, int]
    points_link: BinaryLink | None
    validity_link: BinaryLink | None
    datums: tuple[str, ...] | None
    checksum_file: str
    notes: tuple[str, ...]

    @property
    def stored_axes(self) -> tuple[CoordinateAxis, ...]:
        """The axes whose coordinates are stored with each point."""
        x, y, z = self.axes
        return (*(axis for axis in (x, y) if not axis.is_incremental), z)


class _Builder(ET.TreeBuilder):
    """Builds the tree with local names; refuses a DOCTYPE, which would allow entity attacks."""

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str, /) -> ET.Element:
        return super().end(tag.rpartition("}")[2])

    def doctype(self, name: str, *_: str | None) -> None:
        raise SurfaceFileError(f"main.xml declares a DOCTYPE ({name}), which an X3P must not have")


def parse_document(content: bytes) -> X3pDocument:
    """Parse main.xml.

    Args:
        content: the bytes of main.xml.

    Returns:
        The validated content.

    Raises:
        SurfaceFileError: not the main.xml of a surface or profile that can be read.
    """
    notes: list[str] = []
    root = _parse_tree(content, notes)
    profile = _is_profile(_required_text(root, "Record1/FeatureType"))
    x, y, z = (_parse_axis(root, name, notes) for name in ("CX", "CY", "CZ"))
    if root.find("Record1/Axes/Rotation") is not None:
        notes.append("the rotation in main.xml is not applied: heights are along the file's z")
    points, validity, datums = _parse_data(root)
    return X3pDocument(
        axes=(x, y, z),
        is_profile=profile,
        shape=_parse_shape(root, profile),
        points_link=points,
        validity_link=validity,
        datums=datums,
        checksum_file=(root.findtext("Record4/ChecksumFile") or "").strip() or "md5checksum.hex",
        notes=tuple(notes),
    )


def _parse_tree(content: bytes, notes: list[str]) -> ET.Element:
    try:
        root = _parse_xml(content)
    except SurfaceFileError:  # also a ValueError, but no wrong encoding
        raise
    except (ET.ParseError, ValueError, LookupError) as error:
        if _is_utf8(content):
            raise SurfaceFileError(f"main.xml is not valid XML ({error})") from error
        # Only free text can be affected: all numbers and names that are used are ASCII.
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", content.decode("latin-1"))
        try:
            root = _parse_xml(text.encode())
        except ET.ParseError as second:
            raise SurfaceFileError(f"main.xml is not valid XML ({second})") from second
        notes.append("main.xml is not in the encoding it names: read as Latin-1")
    if not root.tag.startswith("ISO5436"):
        raise SurfaceFileError(f"main.xml has the root <{root.tag}>; <ISO5436_2> is expected")
    return root


def _parse_xml(content: bytes) -> ET.Element:
    parser = ET.XMLParser(target=_Builder())
    parser.feed(content)
    root = parser.close()
    assert isinstance(root, ET.Element)
    return root


def _is_utf8(content: bytes) -> bool:
    try:
        return bool(content.decode("utf-8"))
    except UnicodeDecodeError:
        return False


def _required_text(root: ET.Element, path: str) -> str:
    value = (root.findtext(path) or "").strip()
    if not value:
        raise SurfaceFileError(f"main.xml has no {path}")
    return value


def _is_profile(feature: str) -> bool:
    kinds = {"SUR": False, "PRF": True}
    if feature == "PCL":
        raise SurfaceFileError("an X3P point cloud (PCL) has no grid; SUR or PRF is expected")
    if feature not in kinds:
        raise SurfaceFileError(f"FeatureType is {feature[:40]!r}; SUR or PRF is expected")
    return kinds[feature]


def _parse_axis(root: ET.Element, name: str, notes: list[str]) -> CoordinateAxis:
    path = f"Record1/Axes/{name}"
    kind = _required_text(root, f"{path}/AxisType")
    if kind not in ("I", "A"):
        raise SurfaceFileError(f"{name} has AxisType {kind[:40]!r}; I or A is expected")
    incremental = kind == "I"
    code = _parse_type_code(root, name, stored=name == "CZ" or not incremental)
    text = (root.findtext(f"{path}/Increment") or "").strip()
    if not text and incremental:
        raise SurfaceFileError(f"{name} is incremental but has no Increment")
    increment = parse_number(text, f"{name} Increment") if text else 1.0
    offset = (root.findtext(f"{path}/Offset") or "").strip()
    axis = CoordinateAxis(
        name=name,
        is_incremental=incremental,
        type_code=code,
        increment=increment,
        offset=parse_number(offset, f"{name} Offset") if offset else 0.0,
    )
    if axis.factor <= 0:
        raise SurfaceFileError(f"{name} Increment is {text}; it must be positive [m]")
    if axis.factor != increment:
        notes.append(f"{name} Increment {text} ignored: the axis is absolute, in metres")
    return axis


def _parse_type_code(root: ET.Element, name: str, *, stored: bool) -> str:
    code = (root.findtext(f"Record1/Axes/{name}/DataType") or "").strip()
    if not stored:  # an incremental x or y axis stores no numbers
        return "D"
    if code not in DTYPES:
        raise SurfaceFileError(f"{name} has DataType {code[:40]!r}; I, L, F or D is expected")
    return code


def _parse_shape(root: ET.Element, profile: bool) -> tuple[int, int]:
    if root.find("Record3/MatrixDimension") is None:
        raise SurfaceFileError("main.xml has no Record3/MatrixDimension: the points have no grid")
    nx, ny, nz = (_parse_size(root, f"Size{letter}") for letter in "XYZ")
    if nz != 1:
        raise SurfaceFileError(f"SizeZ is {nz}: a file of several layers is no single surface")
    if profile and ny != 1:
        raise SurfaceFileError(f"a profile (PRF) has SizeY 1, got {ny}")
    check_point_count(nx, ny)
    return ny, nx


def _parse_size(root: ET.Element, name: str) -> int:
    text = _required_text(root, f"Record3/MatrixDimension/{name}")
    if not re.fullmatch(r"[0-9]{1,12}", text) or int(text) < 1:
        raise SurfaceFileError(f"{name} is {text[:40]!r}; a positive integer is expected")
    return int(text)


def _parse_data(
    root: ET.Element,
) -> tuple[BinaryLink | None, BinaryLink | None, tuple[str, ...] | None]:
    inline = root.find("Record3/DataList")
    linked = root.find("Record3/DataLink")
    if (inline is None) == (linked is None):
        raise SurfaceFileError("Record3 must have either a DataLink or a DataList")
    if inline is not None:
        return None, None, tuple((datum.text or "").strip() for datum in inline.iter("Datum"))
    points = _required_text(root, "Record3/DataLink/PointDataLink")
    valid = (root.findtext("Record3/DataLink/ValidPointsLink") or "").strip()
    validity = BinaryLink(valid, _parse_md5(root, "MD5ChecksumValidPoints")) if valid else None
    return BinaryLink(points, _parse_md5(root, "MD5ChecksumPointData")), validity, None


def _parse_md5(root: ET.Element, name: str) -> str:
    text = (root.findtext(f"Record3/DataLink/{name}") or "").strip().lower()
    return text if re.fullmatch(r"[0-9a-f]{32}", text) else ""
