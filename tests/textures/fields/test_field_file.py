"""Damaged files of baked fields: each is refused with what is wrong, and nothing is written."""

from __future__ import annotations

import gzip
import json
import math
import random
import tempfile
import zlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.cli.main import cli
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.textures.fields import field_file
from asperity.textures.fields.field_file import HEADER
from asperity.textures.fields.potential_field import PotentialField

_BEFORE = Path(__file__).with_name("wave-version-2.field.gz")


@cache
def content() -> bytes:
    surface = asp.Surface(asp.Sinusoid(1e-4, 1e-3), "H", max_depth=1e-4)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wave.field"
        asp.save_field(path, asp.bake(surface, resolution=50e-6).texture)
        return path.read_bytes()


def change_header(**values: float) -> bytes:
    """Return the file with a header that is changed, and with the right checksum."""
    header = np.frombuffer(content()[: HEADER.itemsize], HEADER).copy()
    for name, value in values.items():
        header[name] = value
    header["header_checksum"] = zlib.crc32(header.tobytes()[:-4])
    return header.tobytes() + content()[HEADER.itemsize :]


def flip(place: int) -> bytes:
    data = bytearray(content())
    data[place] ^= 1
    return bytes(data)


def test_undamaged_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "wave.field"
    path.write_bytes(change_header())
    assert asp.load_texture(path).digest == asp.Surface(path, "H").texture.digest


def test_file_of_the_version_before_has_the_same_forces(tmp_path: Path) -> None:
    """Written by the program that wrote version 2; the forces are those that it printed."""
    path = tmp_path / "wave.field"
    path.write_bytes(gzip.decompress(_BEFORE.read_bytes()))
    surface = asp.Surface(path, "H", stiffness=500.0)
    points = [[1e-4, 0, -5e-5], [3e-4, 0, -1.7e-4], [6.3e-4, 2e-4, -2.3e-4], [9e-4, 0, -6e-4]]
    expected = [
        [-0.023973150887500756, 0.0, 0.04083289966402624],
        [0.025662484305975217, 0.0, 0.09223671400172923],
        [0.020822238894668506, 0.0, 0.07036510043721156],
        [-0.03344129743935712, 0.0, 0.2500015563132453],
    ]
    np.testing.assert_allclose(surface.force(np.array(points)), expected, rtol=0.0, atol=1e-15)
    field = surface.texture
    assert isinstance(field, PotentialField)
    assert field.gain.upper == pytest.approx(1.0802650858877603, rel=1e-9)
    assert field.claimed_gain == field.gain.upper
    again = asp.save_field(tmp_path / "again.field", field)
    saved = asp.Surface(tmp_path / "again.field", "H", stiffness=500.0)
    assert np.array_equal(saved.force(np.array(points)), surface.force(np.array(points)))
    assert again.gain.upper == field.gain.upper


@pytest.mark.parametrize("change", ["cut", "zeros"])
def test_a_loaded_field_does_not_depend_on_its_file(change: str, tmp_path: Path) -> None:
    """A mapped file would end the process when it is cut, and change the force when overwritten."""
    path = tmp_path / "wave.field"
    path.write_bytes(content())
    surface = asp.Surface(path, "H", stiffness=500.0)
    points = np.array([[1e-4, 0.0, -5e-5], [3e-4, 0.0, -2e-5]])
    before = surface.force(points)
    with path.open("r+b") as stream:
        stream.truncate(0) if change == "cut" else stream.write(bytes(len(content())))
    assert np.array_equal(asp.Surface(surface.texture, "H", stiffness=500.0).force(points), before)
    assert before.any()


DAMAGES: dict[str, tuple[Callable[[], bytes], str]] = {
    "coefficient": (lambda: flip(HEADER.itemsize + 5000), "is damaged: its checksum is wrong"),
    "header": (lambda: flip(60), "has a damaged header"),
    "cut": (lambda: content()[:-100], r"is cut: \d+ of \d+ bytes"),
    "cut header": (lambda: content()[:100], "is cut: it has no whole header"),
    "version": (lambda: change_header(version=1), r"is a \.field file of version 1, of which 2"),
    "order": (lambda: change_header(byte_order=0x04030201), "has another byte order"),
    "count": (lambda: change_header(count=2**40), "has sections beyond its end"),
    "table": (lambda: change_header(rows=2**31, columns=2**31), "has sections beyond its end"),
    "offset": (lambda: change_header(values_offset=2**50), "has sections beyond its end"),
    "size": (lambda: change_header(file_bytes=2**43), f"is cut: .* of {2**43} bytes"),
    "levels": (lambda: change_header(levels=2), "has a damaged table of columns"),
}


WRONG = (None, True, -1, 10**30, "", "x", [], ["a"], [[1]], [{}], {}, {"a": 1}, [1, 2, 3], math.inf)
NESTED = (b"", b"[]", b"null", b'"x"', b"\xff", b"[" * 200_000, b'{"a":' * 100_000)


def seal(text: bytes) -> bytes:
    """Return the file with another description, and the right checksums."""
    header = np.frombuffer(content()[: HEADER.itemsize], HEADER).copy()
    body = content()[HEADER.itemsize : int(header["json_offset"][0])] + text
    header["file_bytes"] = HEADER.itemsize + len(body)
    header["checksum"] = zlib.crc32(body)
    header["header_checksum"] = zlib.crc32(header.tobytes()[:-4])
    return header.tobytes() + body


def described() -> dict[str, Any]:
    place = int(np.frombuffer(content()[: HEADER.itemsize], HEADER)["json_offset"][0])
    description: dict[str, Any] = json.loads(content()[place:])
    return description


def entries(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the place of each entry of a description."""
    items = value.items() if isinstance(value, dict) else ()
    for key, part in enumerate(value) if isinstance(value, list) else items:
        yield (*place, key)
        yield from entries(part, (*place, key))


def test_descriptions_of_other_types_are_refused_or_read(tmp_path: Path) -> None:
    path = tmp_path / "bad.field"
    n_refused = 0
    arguments = set()
    contents = list(NESTED)
    for place in entries(described()):
        for value in random.Random(str(place)).sample(WRONG, 4):
            changed = described()
            part = changed
            for key in place[:-1]:
                part = part[key]
            part[place[-1]] = value
            contents.append(json.dumps(changed).encode())
    for text in contents:
        path.write_bytes(seal(text))
        try:
            surface = asp.Surface(path, "H", stiffness=100.0)
            surface.force(np.array([[0.0, 0.0, -1e-5]]))
            surface.texture.describe()
        except SurfaceFileError:
            n_refused += 1
        except ParameterError as error:  # arguments of the surface that was baked
            arguments.add(error.argument)
    assert n_refused > len(NESTED) + 50
    assert arguments <= {"amplitude", "period", "direction", "phase", "texture", "max_depth"}


@pytest.mark.parametrize("name", DAMAGES)
def test_damaged_file_is_refused(name: str, tmp_path: Path) -> None:
    make, reason = DAMAGES[name]
    path, output = tmp_path / "bad.field", tmp_path / "out.json"
    path.write_bytes(make())
    for load in (asp.load_texture, lambda file: asp.Surface(file, "H")):
        with pytest.raises(SurfaceFileError, match=rf"bad\.field: {reason}"):
            load(path)
    result = CliRunner().invoke(cli, ["compare", str(path), "--json", str(output)])
    assert isinstance(result.exception, SurfaceFileError)
    assert result.exception.exit_code == 2
    assert not output.exists()


def test_file_larger_than_the_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sparse file of the size that its header states."""
    path = tmp_path / "huge.field"
    size = 50 * 2**20
    path.write_bytes(change_header(file_bytes=size))
    with path.open("r+b") as stream:
        stream.truncate(size)
    monkeypatch.setattr(field_file, "free_memory", lambda: size - 1)
    with pytest.raises(SurfaceFileError, match="its 52,428,800 bytes exceed the free memory"):
        asp.load_texture(path)
    monkeypatch.setattr(field_file, "free_memory", lambda: size)
    with pytest.raises(SurfaceFileError, match="checksum"):
        asp.load_texture(path)


def test_resolution_coarser_than_the_texture_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cloth.field"
    result = CliRunner().invoke(cli, ["bake", "cloth", "--resolution", "0.3mm", "-o", str(path)])
    assert "resolution is coarser than the texture" in str(result.exception)
    assert not path.exists()


# --- edited files, with the right checksums -------------------------------------------------------


def edit_values(change: Callable[[np.ndarray], np.ndarray]) -> bytes:
    """Return the file with other coefficients."""
    header = np.frombuffer(content()[: HEADER.itemsize], HEADER)[0]
    start = int(header["values_offset"])
    values = np.frombuffer(content(), "<f4", int(header["count"]), start)
    edited = change(values).astype("<f4").tobytes()
    body = content()[HEADER.itemsize : start] + edited + content()[start + len(edited) :]
    changed = change_header(checksum=zlib.crc32(body))
    return changed[: HEADER.itemsize] + body


def noise(values: np.ndarray) -> np.ndarray:
    return values * np.random.default_rng(0).uniform(0.97, 1.03, values.shape)


def attained_gain(surface: asp.Surface) -> float:
    """Return the greatest norm of the Jacobian at random points, over the stiffness."""
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (20_000, 3)) * [1e-3, 1e-3, 2.4e-4]
    points[::2, 2] = np.linspace(-0.04, 0.0, 10_000)
    return float(np.linalg.norm(surface.jacobian(points), 2, axis=(1, 2)).max())


@pytest.mark.parametrize(
    "data",
    [
        lambda: edit_values(lambda values: 3.0 * values),
        lambda: edit_values(noise),
        lambda: change_header(lift=9e-2),
    ],
    ids=["times 3", "noise", "lift"],
)
def test_gain_of_an_edited_file_is_computed_from_its_coefficients(
    data: Callable[[], bytes], tmp_path: Path
) -> None:
    path = tmp_path / "edited.field"
    path.write_bytes(content())
    stated = asp.Surface(path, "H", 1.0).texture
    path.write_bytes(data())
    surface = asp.Surface(path, "H", 1.0)
    field = surface.texture
    assert isinstance(stated, asp.PotentialField)
    assert isinstance(field, asp.PotentialField)
    found = attained_gain(surface)
    assert found > 1.5 * stated.gain.upper
    assert field.claimed_gain == stated.gain.upper
    assert found <= asp.characteristic_number(surface).upper == field.gain.upper
    assert "computed from its coefficients: the file claims 1" in field.preparation[-1]


def test_undamaged_file_states_what_is_a_claim(tmp_path: Path) -> None:
    path = tmp_path / "wave.field"
    path.write_bytes(content())
    field = asp.Surface(path, "H").texture
    assert isinstance(field, asp.PotentialField)
    text = field.preparation[-1]
    assert "the file claims: force" in text
    assert "computed from" not in text
    assert field.claimed_gain == field.gain.upper


@pytest.mark.parametrize("name", ["x0", "z0", "m00", "iz", "margin", "q", "floor"])
def test_header_that_differs_from_the_description_is_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.field"
    number = np.frombuffer(content()[: HEADER.itemsize], HEADER)[0][name].item()
    path.write_bytes(change_header(**{name: 10.0 * number + 1.0}))
    with pytest.raises(SurfaceFileError, match=f"{name} of its header is .*, of its description"):
        asp.load_texture(path)
