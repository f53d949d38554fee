"""A prepared surface, its parameters after each preparation step, and its NPZ file."""

from __future__ import annotations

import hashlib
import json
import os
import tokenize
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.files import Serializable, json_text, open_input, open_output, to_plain_data
from asperity.measured.form import HeightStatistics
from asperity.measured.lengths import Pitch, is_pitch
from asperity.measured.parameters import ParameterValues, compute_parameters, find_parameter
from asperity.measured.reader import ARCHIVE_ERRORS, MAX_POINTS, ZIP_MAGIC


@dataclass(frozen=True)
class PreparationStage(Serializable):
    """A surface after a step of its preparation.

    Attributes:
        name: short name of the step: "levelled", "S-filter 10 µm".
        values: parameters of the surface after it, by symbol, see
            :mod:`asperity.measured.parameters`.
        removed: RMS about the mean and range of the heights that the step subtracted [m]; None for
            steps that subtract nothing (a fill) or change the size.
        nesting: nesting index L of the L-filter applied in this step or before [m]; None for none.
    """

    name: str
    values: ParameterValues
    removed: HeightStatistics | None = None
    nesting: float | None = None


StageCallback = Callable[[PreparationStage, Pitch, FloatArray, FloatArray | None], None]
"""Called with the stage, the pitch, the heights after it, and those before if it subtracts [m]."""


class StageRecorder:
    """Records the stages of a preparation.

    Args:
        on_stage: called with each stage.
    """

    def __init__(self, on_stage: StageCallback | None = None) -> None:
        self.stages: list[PreparationStage] = []
        self._on_stage = on_stage
        self._previous_heights: FloatArray | None = None
        self._nesting: float | None = None

    def __call__(
        self,
        name: str,
        heights: FloatArray,
        pitch: Pitch,
        *,
        removes: bool = False,
        nesting: float | None = None,
    ) -> None:
        """Record the surface after a step.

        Args:
            name: name of the step.
            heights: heights after it [m].
            pitch: pitch [m].
            removes: whether the step subtracted heights.
            nesting: L of an L-filter [m], if the step is one.
        """
        self._nesting = nesting or self._nesting
        before = None
        removed = None
        if removes:
            before = self._previous_heights
        if before is not None:
            removed = _removed_statistics(before, heights)
        values = compute_parameters(heights, pitch, self._nesting)
        stage = PreparationStage(name, values, removed, self._nesting)
        self.stages.append(stage)
        if self._on_stage is not None:
            self._on_stage(stage, pitch, heights, before)
        self._previous_heights = heights.copy()


def parse_stages(data: Any) -> tuple[PreparationStage, ...]:
    """Return the stages of plain data as returned by :meth:`PreparationStage.to_dict`.

    Raises:
        ValueError: the data are no stages.
    """
    try:
        return tuple(map(_parse_stage, data))
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"no stages of a preparation: {error}") from None


def _parse_stage(data: dict[str, Any]) -> PreparationStage:
    def number(value: Any) -> float | None:
        return None if value is None else float(value)

    values = {name: number(v) for name, v in data["values"].items() if find_parameter(name)}
    part = data["removed"]
    removed = part and HeightStatistics(float(part["rms"]), float(part["range"]))
    return PreparationStage(str(data["name"]), values, removed, number(data["nesting"]))


def resized_stage(
    name: str, heights: FloatArray, pitch: Pitch, previous: PreparationStage, factor: float
) -> PreparationStage:
    """Return the stage of a surface that was only scaled.

    Args:
        name: name of the step.
        heights: heights after it [m].
        pitch: pitch after it [m].
        previous: the stage before.
        factor: factor of the lengths along x and y.
    """
    nesting = previous.nesting
    if nesting is not None:
        nesting *= factor
    return PreparationStage(name, compute_parameters(heights, pitch, nesting), None, nesting)


def _removed_statistics(before: FloatArray, after: FloatArray) -> HeightStatistics | None:
    """Return RMS about the mean and range of the difference; None if all its points are missing."""
    difference = before - after
    known = difference[~np.isnan(difference)]
    return None if not known.size else HeightStatistics.of(known)


FilePath = str | os.PathLike[str]
SCHEMA = 1
"""Version of the file format."""

_SCHEMA_KEY = "asperity_schema"
_MAX_BYTES = 9 * MAX_POINTS + 2**26  # heights, mask and sentences
_DAMAGE_ERRORS = (*ARCHIVE_ERRORS, MemoryError, tokenize.TokenError)  # the last: array headers


@dataclass(frozen=True, eq=False)
class PreparedSurface:
    """A surface that is ready to become a texture.

    Attributes:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        steps: the preparation steps in order, one sentence each with its numbers.
        filled_mask: True for interpolated heights, same shape; None if there are none.
        periodic: whether the surface repeats after n times the pitch.
        history: parameters of the surface as read and after each step.
    """

    heights: FloatArray
    pitch: Pitch
    steps: tuple[str, ...]
    filled_mask: NDArray[np.bool_] | None = None
    periodic: bool = False
    history: tuple[PreparationStage, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the heights, SI units."""
        pitch = list(self.pitch)
        steps = list(self.steps)
        data = {"pitch": pitch, "periodic": self.periodic, "steps": steps}
        points = list(self.heights.shape[::-1])
        stages = to_plain_data(self.history)
        return {"schema": SCHEMA, "points": points, **data, "stages": stages}


def save_prepared(path: FilePath, prepared: PreparedSurface, source: FilePath) -> None:
    """Save a prepared surface as NPZ: heights, pitch, mask, steps and source.

    The file is written atomically; see :func:`asperity.core.files.open_output`.

    Args:
        path: the file to write; an existing one is replaced.
        prepared: the surface.
        source: the file that it was prepared from; its name and SHA-256 are saved.

    Raises:
        ParameterError: the path does not end in .npz, is the source, or cannot be written.
    """
    check_output_path(Path(path), Path(source))
    filled = prepared.filled_mask
    if filled is None:
        filled = np.zeros(prepared.heights.shape, bool)
    with open_input(source) as stream:
        sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
    members = {
        _SCHEMA_KEY: np.array(SCHEMA),
        "heights": prepared.heights,
        "pitch": np.array(prepared.pitch),
        "periodic": np.array(prepared.periodic),
        "filled": filled,
        "steps": np.array(prepared.steps, dtype=np.str_),
        "history": np.array(json_text(prepared.history)),
        "source": np.array(Path(source).name),
        "sha256": np.array(sha256),
    }
    with open_output("output", path, durable=True) as file:
        np.savez(file, **members)  # type: ignore[arg-type]  # typed as if one might be a flag


def check_output_path(path: Path, source: Path) -> None:
    """Refuse a path that is not NPZ, or is the source itself, before any work is done."""
    if path.exists() and source.exists() and path.samefile(source):
        raise ParameterError("output", "must be another file than the surface", str(path))
    if path.suffix.lower() != ".npz":
        raise ParameterError("output", "must be a file that ends in .npz", str(path))


def is_prepared(path: FilePath) -> bool:
    """Whether a file is a prepared surface, by its content."""
    try:
        with open_input(path) as stream:
            if stream.read(4) != ZIP_MAGIC[0]:
                return False
            with zipfile.ZipFile(stream) as archive:
                return f"{_SCHEMA_KEY}.npy" in archive.namelist()
    except (OSError, *ARCHIVE_ERRORS):  # which the reader of surfaces reports
        return False


def load_prepared(path: FilePath) -> PreparedSurface:
    """Load a surface saved by :func:`save_prepared`.

    Raises:
        SurfaceFileError: the file is damaged, or of a later version.
    """
    name = Path(path).name
    try:
        with open_input(path) as stream, zipfile.ZipFile(stream) as archive:
            size = sum([member.file_size for member in archive.infolist()])
            if size > _MAX_BYTES:
                raise SurfaceFileError(f"unpacks to {size} bytes; at most {_MAX_BYTES} are read")
            return _read_archive(archive)
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from None
    except OSError as error:
        raise SurfaceFileError(f"{name}: cannot be read ({error.strerror or error})") from None
    except _DAMAGE_ERRORS as error:
        raise SurfaceFileError(f"{name}: damaged prepared surface ({error})") from None


def _read_archive(archive: zipfile.ZipFile) -> PreparedSurface:
    schema = int(_read_member(archive, _SCHEMA_KEY, "iu", 0))
    if schema != SCHEMA:
        raise SurfaceFileError(f"has version {schema}; this asperity reads version {SCHEMA}")
    heights = _read_member(archive, "heights", "f")
    pitch = tuple(_read_member(archive, "pitch", "f", 1).tolist())
    filled = _read_member(archive, "filled", "b")
    steps = tuple(_read_member(archive, "steps", "U", 1).tolist())
    periodic = bool(_read_member(archive, "periodic", "b", 0))
    if heights.dtype != np.float64 or heights.ndim not in (1, 2) or min(heights.shape) < 4:
        raise SurfaceFileError("heights must be float64 of shape (ny, nx) or (n,), at least 4")
    if len(pitch) != heights.ndim or not is_pitch(pitch):
        raise SurfaceFileError(f"pitch must be {heights.ndim} positive lengths, got {pitch}")
    if filled.shape != heights.shape:
        raise SurfaceFileError(f"the mask has shape {filled.shape}, the heights {heights.shape}")
    if not np.isfinite(heights).all():
        raise SurfaceFileError("has heights that are not finite")
    history = parse_stages(json.loads(str(_read_member(archive, "history", "U", 0))))
    return PreparedSurface(
        np.ascontiguousarray(heights), pitch, steps, some_or_none(filled), periodic, history
    )


def some_or_none(mask: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Return a mask, or None if it is False everywhere."""
    return mask if mask.any() else None


def _read_member(archive: zipfile.ZipFile, name: str, kinds: str, n_axes: int | None = None) -> Any:
    """Return one array, refused if its type or its number of axes is wrong."""
    with archive.open(f"{name}.npy") as stream:
        array = np.lib.format.read_array(stream, allow_pickle=False)
    if array.dtype.kind not in kinds or (n_axes is not None and array.ndim != n_axes):
        raise SurfaceFileError(f"member {name} is damaged: {array.dtype} of shape {array.shape}")
    return array
