"""Text files in the styles of instruments, of known heights.

``python -m bench.stress.text_headers [n]`` reads so many.

Every file is read, and judged: "right" (heights and pitch are the true ones), "asked" (an error, or
heights or a pitch left open, so that the preparation asks), "WRONG" (anything else). The control
reads the same files by the rule "a unit of length in any line of the header is that of the
heights", and must be found wrong.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.measured.reader import RawSurface as Surface
from asperity.measured.reading import RawSurface, ReadingOptions, SurfaceFile
from asperity.measured.reading.text_reader import read_text

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9}
COUNT = 10_000
DISTRACTIONS = (
    *("Lateral sampling (um)", "Tip radius: 2 um", "Cutoff: 0.8mm", "Scan 10 um"),
    *("Wavelength: 633 nm", "Sample: 5 mm steel plate", r"File: C:\nm\data\um.txt", "Lens [mm] 4"),
    *("Date: 2020-03-12 10:11:12", "Operator,A. B.", "Objective,50x", "Range: 500 um"),
    *("Laser power (nm) 633", "Filter lc;2.5;mm", "ls=8 um", "Stylus,Radius: 2.5 um"),
    *("Speed 1 mm/s", "Notes: none", "Tilt removed", "Unit,um", "in mm", "Sampling length,0.8,mm"),
    *("Scan size: 20 um", "Z range: 80 um", "Sa = 12 nm", "Height of fixture 40 mm", "Gain 4"),
    *("Measurement Range,524 um", "Force,3.00 mg", "Roughness (nm)", "Stage z position: 3.2 mm"),
)


@dataclass
class Sheet:
    """What a file is made of: true heights [m] and pitch [m], units, and the code of a gap."""

    rng: np.random.Generator
    heights: FloatArray
    pitch: tuple[float, float]
    unit: str
    lateral: str
    gap: str

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.heights)

    @property
    def columns(self) -> int:
        """Number of columns."""
        return len(self.heights[0])

    def keep_first_row(self) -> None:
        """Make the surface a profile, its first row."""
        self.heights = self.heights[:1]
        self.pitch = (self.pitch[0], self.pitch[0])

    def z(self, unit: str = "", values: FloatArray | None = None) -> list[list[str]]:
        """Return the heights as text in a unit."""
        scale = UNITS[unit or self.unit]
        rows = self.heights if values is None else values
        return [[self.gap if np.isnan(v) else f"{v / scale:.9g}" for v in row] for row in rows]

    def matrix(self, separator: str = "\t", unit: str = "") -> str:
        """Return the heights as a matrix."""
        return lines(separator.join(row) for row in self.z(unit))

    def counts(self, step: float, separator: str = " ") -> str:
        """Return whole numbers of a step [m], which become the true heights."""
        self.heights = np.round(self.heights / step) * step
        whole = np.round(self.heights / step)
        cells = [["-32768" if np.isnan(v) else f"{v:.0f}" for v in row] for row in whole]
        return lines(separator.join(row) for row in cells)

    def points(self, order: str = "xyz", separator: str = ",", unit: str = "") -> str:
        """Return a list of points with the columns in some order."""
        heights, scale = self.z(unit), UNITS[self.lateral]
        out = []
        for i in range(self.rows):
            for j in range(self.columns):
                x, y = j * self.pitch[0] / scale, i * self.pitch[1] / scale
                cells = {"x": f"{x:.9g}", "y": f"{y:.9g}", "z": heights[i][j], "i": "1"}
                out.append(separator.join(cells[c] for c in order))
        return lines(out)

    def profile(self, order: str = "xz", separator: str = ",", unit: str = "") -> str:
        """Return the first row as positions and heights; the truth becomes that row."""
        self.heights = self.heights[:1]
        return self.points(order, separator, unit)

    def size(self, axis: int) -> str:
        """Return the width or the height of the map with its unit."""
        count = self.columns if axis == 0 else self.rows
        return f"{self.pitch[axis] * count / UNITS[self.lateral]:.9g} {self.lateral}"

    def step(self, axis: int) -> str:
        """Return the pitch along an axis as a number."""
        return f"{self.pitch[axis] / UNITS[self.lateral]:.9g}"


def lines(rows: Iterator[str] | list[str]) -> str:
    """Return the rows as a text."""
    return "\n".join(rows) + "\n"


def draw_sheet(rng: np.random.Generator) -> Sheet:
    """Return a rough surface with a few gaps."""
    rows, columns = int(rng.integers(6, 14)), int(rng.integers(6, 14))
    columns += columns == rows
    unit, lateral = (str(rng.choice(["mm", "um", "µm", "nm"])) for _ in range(2))
    size = 10.0 ** rng.uniform(-8, -4.5)
    kind = rng.integers(3)
    heights = rng.normal(size=(rows, columns))
    if kind == 1:
        heights = heights.cumsum(axis=0).cumsum(axis=1)
    elif kind == 2:
        heights = 0.1 * heights + np.add.outer(np.arange(rows), 2.0 * np.arange(columns))
    heights = np.asarray(heights * size / np.abs(heights).max())
    heights = np.round(heights / size, 6) * size
    if rng.random() < 0.5:
        heights[rng.random(heights.shape) < 0.05] = np.nan
        heights[0, 0] = heights[0, 1] = size
    p = float(f"{10.0 ** rng.uniform(-7, -4.5):.3g}")
    pitch = (p, p if rng.random() < 0.6 else float(f"{p * rng.uniform(1.2, 3):.3g}"))
    gap = str(rng.choice(["nan", "-9999", "-32768", "1.70141e38", "-9999.0", "NaN"]))
    return Sheet(rng, heights, pitch, unit, lateral, gap)


Style = Callable[[Sheet], tuple[str, str]]  # to header (with distractions before it) and numbers


def _gwyddion(s: Sheet, width: str = "Width", height: str = "Height") -> tuple[str, str]:
    head = f"# Channel: Topo\n# {width}: {s.size(0)}\n# {height}: {s.size(1)}\n"
    return head + f"# Value units: {s.unit}\n", s.matrix()


def _gwyddion_other_channel(s: Sheet) -> tuple[str, str]:
    name = s.rng.choice(["Deflection", "AmplitudeError", "Phase", "Friction", "Amplitude Error"])
    head, numbers = _gwyddion(s)
    s.heights = np.full_like(s.heights, -1.0)  # whatever is read is wrong
    return head.replace("Topo", str(name)), numbers


def _gwyddion_points(s: Sheet) -> tuple[str, str]:
    head = f"# XYZ data: Z\n# Lateral units: {s.lateral}\n# Value units: {s.unit}\n"
    return head, s.points(separator="\t")


def _factor(s: Sheet) -> tuple[str, str]:
    """An interferometer's export in radians."""
    step = float(f"{s.rng.uniform(1, 9) * 1e-9:.6g}")
    values = lines(
        " ".join("nan" if np.isnan(v) else f"{v / step:.9g}" for v in r) for r in s.heights
    )
    head = f"pixel size={s.pitch[0]:.9g} m\ndata unit=rad\nheight conversion factor (-> m)={step}\n"
    s.pitch = (s.pitch[0], s.pitch[0])
    return head, values


def _lsb(s: Sheet) -> tuple[str, str]:
    text = str(s.rng.choice(["LSB = {} nm", "Z step {} nm", "1 LSB: {} nm", "z_scale: {} nm/LSB"]))
    return text.format(0.5) + "\n", s.counts(0.5e-9)


def _counts_and_pitch(s: Sheet) -> tuple[str, str]:
    head = f"Dx={s.step(0)}{s.lateral}\nDy={s.step(1)}{s.lateral}\n"
    return head, s.counts(1e-9)


def _z_scale(s: Sheet) -> tuple[str, str]:
    text = str(
        s.rng.choice(["Z-scale = 1e-9 m", "Scale factor z: 1e-9", "Z units per count: 1e-9"])
    )
    return f"{text}\n", s.counts(1e-9)


def _unit_and_step(s: Sheet) -> tuple[str, str]:
    return "Z unit: nm\nZ resolution: 0.1 nm\n", s.counts(0.1e-9)


def _dektak(s: Sheet) -> tuple[str, str]:
    names = {"mm": "Millimeter", "um": "Micrometer", "µm": "Micrometer", "nm": "Nanometer"}
    head = f"Resolution,0.156 um/sample\n\nScan Data\nLateral {s.lateral},Raw {names[s.unit]},\n"
    return head, s.profile().replace("\n", ",,\n")


def _dektak_angstrom(s: Sheet) -> tuple[str, str]:
    head = "Profile,Hills\nLateral um,Total Profile Angstrom\n"
    s.lateral = "um"
    UNITS["angstrom"] = 1e-10
    return head, s.profile(unit="angstrom")


def _talysurf(s: Sheet) -> tuple[str, str]:
    head = f"Form Talysurf\nData spacing {s.step(0)} {s.lateral}\nX ({s.lateral}) Z ({s.unit})\n"
    return head, s.profile(separator=" ")


def _mitutoyo(s: Sheet) -> tuple[str, str]:
    head = f"Mitutoyo;SJ-410\nCutoff;0.8;mm\nPos. [{s.lateral}];Height [{s.unit}]\n"
    return head, s.profile(separator=";")


def _mitutoyo_column(s: Sheet) -> tuple[str, str]:
    s.keep_first_row()
    head = f"Sampling pitch,{s.step(0)},{s.lateral}\nZ unit,{s.unit}\n"
    return head, lines(s.z()[0])


def _keyence(s: Sheet) -> tuple[str, str]:
    s.pitch = (s.pitch[0], s.pitch[0])
    head = f'"Output image data","Height"\n"XY calibration","{s.step(0)}","{s.lateral}/pixel"\n'
    return head + f'"Horizontal","{s.columns}"\n"Unit","{s.unit}"\n"Height"\n', s.matrix(",")


def _keyence_known(s: Sheet) -> tuple[str, str]:
    return f"Image type,Height\nHeight unit,{s.unit}\nPixel size,{s.step(0)} {s.lateral}\n" + (
        f"Line spacing,{s.step(1)} {s.lateral}\n"
    ), s.matrix(",")


def _keyence_digits(s: Sheet) -> tuple[str, str]:
    s.pitch = (s.pitch[0], s.pitch[0])
    head = f"Z Calibration (nm/digit),0.1\nPixel size [{s.lateral}],{s.step(0)}\nHeight\n"
    return head, s.counts(0.1e-9, ",")


def _alicona(s: Sheet) -> tuple[str, str]:
    return f"x [{s.lateral}] y [{s.lateral}] z [{s.unit}]\n", s.points(separator=" ")


def _alicona_bare(s: Sheet) -> tuple[str, str]:
    return "", s.points(separator=" ")


def _sensofar(s: Sheet) -> tuple[str, str]:
    head = f"SENSOFAR\nSize X {s.columns}\nSize Y {s.rows}\nPixel size {s.step(0)} {s.lateral}\n"
    return head + "Data [x y z]\n", s.points(separator="\t")


def _sensofar_csv(s: Sheet) -> tuple[str, str]:
    return f"X pixel size: {s.step(0)} {s.lateral}\nY pixel size: {s.step(1)} {s.lateral}\n" + (
        f"Z unit: {s.unit}\n"
    ), s.matrix(";")


def _mountains(s: Sheet) -> tuple[str, str]:
    s.gap = "nan"
    head = f"X Spacing: {s.step(0)} {s.lateral}\nY Spacing: {s.step(1)} {s.lateral}\n"
    return head + f"Z-axis unit: {s.unit}\n", s.matrix()


def _mountains_factor(s: Sheet) -> tuple[str, str]:
    head = f"Spacing X = {s.step(0)} {s.lateral}\nZ unit = {s.unit}\nZ factor = 0.001\n"
    s.heights = s.heights * 1e-3
    return head, lines(" ".join(row) for row in s.z(values=s.heights * 1e3))


def _lext(s: Sheet) -> tuple[str, str]:
    head = f"OLYMPUS LEXT\nPixel pitch({s.lateral}),{s.step(0)}\nHeight[{s.unit}]\n"
    s.pitch = (s.pitch[0], s.pitch[0])
    return head, s.matrix(",")


def _framed(s: Sheet, corner: str, separator: str) -> str:
    scale = UNITS[s.lateral]
    head = [corner, *(f"{j * s.pitch[0] / scale:.9g}" for j in range(s.columns))]
    body = [[f"{i * s.pitch[1] / scale:.9g}", *row] for i, row in enumerate(s.z())]
    return lines(separator.join(row) for row in [head, *body])


def _coordinates(s: Sheet) -> tuple[str, str]:
    corner = str(s.rng.choice(["0", "nan", "", "y\\x", "um"]))
    return f"Z unit: {s.unit}\n", _framed(s, corner, ",")


def _numbering(s: Sheet) -> tuple[str, str]:
    head = ["", *(str(j) for j in range(s.columns))]
    body = [[str(i), *row] for i, row in enumerate(s.z())]
    return f"z [{s.unit}]\n", lines(",".join(row) for row in [head, *body])


def _first_column(s: Sheet) -> tuple[str, str]:
    body = [[f"{2 + 0.5 * i:g}", *row] for i, row in enumerate(s.z())]
    names = ",".join(["Y [mm]", *(f"P{j}" for j in range(s.columns))])
    return f"Height unit: {s.unit}\n{names}\n", lines(",".join(row) for row in body)


def _order(order: str) -> Style:
    def make(s: Sheet) -> tuple[str, str]:
        units = {"x": s.lateral, "y": s.lateral, "z": s.unit}
        return ",".join(f"{c} [{units[c]}]" for c in order) + "\n", s.points(order)

    return make


def _order_two_lines(s: Sheet) -> tuple[str, str]:
    return f"Y;X;Z\n[{s.lateral}];[{s.lateral}];[{s.unit}]\n", s.points("yxz", ";")


def _reversed_profile(s: Sheet) -> tuple[str, str]:
    return f"Height ({s.unit}),Position ({s.lateral})\n", s.profile("zx")


def _with_intensity(s: Sheet) -> tuple[str, str]:
    head = f"X ({s.lateral}),Y ({s.lateral}),Z ({s.unit}),Intensity\n"
    return head, s.points("xyzi")


def _one_unit(s: Sheet) -> tuple[str, str]:
    return f"x y z [{s.unit}]\n", s.points(separator=" ")


def _ntmdt(s: Sheet) -> tuple[str, str]:
    head = f"File Format = ASCII\nNX = {s.columns}\nNY = {s.rows}\nScale X = {s.step(0)}\n"
    return head + f"Unit X = {s.lateral}\nScale Z = 0.01\nUnit Z = {s.unit}\n", s.matrix()


def _wsxm(s: Sheet) -> tuple[str, str]:
    head = f"WSxM file copyright UAM\nX[{s.lateral}] Y[{s.lateral}] Z[{s.unit}]\n"
    return head, s.points(separator=" ")


def _filmetrics(s: Sheet) -> tuple[str, str]:
    head = f"Filmetrics Profilm3D\nX [{s.lateral}],Y [{s.lateral}],Height [{s.unit}]\n"
    return head, s.points()


def _nanoscope(s: Sheet) -> tuple[str, str]:
    head = f"Scan Size: 10 um\nSamps/line: {s.columns}\nZ scale: 100 nm\nHeight({s.unit})\n"
    return head, s.matrix(" ")


def _nanoscope_plain(s: Sheet) -> tuple[str, str]:
    return f'"Height Sensor({s.unit})"\n', s.matrix(" ")


def _veeco(s: Sheet) -> tuple[str, str]:
    s.lateral, s.pitch = "mm", (s.pitch[0], s.pitch[0])
    head = f"X Size\t{s.columns}\nPixel_size\t{s.step(0)}\tmm\nWavelength\t580\tnm\n"
    return head + "RAW_DATA\t3\t4\n", s.matrix()


def _zygo_xyz(s: Sheet) -> tuple[str, str]:
    head = f"Zygo XYZ Data File - Format 2\n0 0 {s.columns} {s.rows}\n632.8e-9 0.5\n#\n"
    whole = lines(f"{j} {i} {z}" for i, row in enumerate(s.z("um")) for j, z in enumerate(row))
    return head, whole


def _iso(s: Sheet) -> tuple[str, str]:
    s.keep_first_row()
    head = f"ISO 5436-2\nCX M 10 MM {s.step(0)} D\nCZ M 10 {s.unit} 1.0 D\n"
    return head, lines(s.z()[0])


def _plain(s: Sheet) -> tuple[str, str]:
    return "", s.matrix(str(s.rng.choice(["\t", ",", " ", ";"])))


def _sentence(s: Sheet) -> tuple[str, str]:
    text = str(s.rng.choice(["# z in {}", "Höhe [{}]", "heights ({})", "# Data [{}]", "Z: {}"]))
    return text.format(s.unit) + "\n", s.matrix(" ")


def _declared(s: Sheet) -> tuple[str, str]:
    s.gap = str(s.rng.choice(["-1", "12345", "0", "1e5"]))
    if np.any(np.isin([float(v) for r in s.z() for v in r if v != s.gap], [float(s.gap)])):
        s.gap = "nan"
    name = s.rng.choice(["No data value", "Missing value", "NODATA_value", "Invalid"])
    return f"{name}: {s.gap}\nZ unit = {s.unit}\n", s.matrix(";")


def _decimal_comma(s: Sheet) -> tuple[str, str]:
    s.gap = "nan"
    head = f"X-Abstand [{s.lateral}]: {s.step(0)}\nHöhe [{s.unit}]\n".replace(".", ",")
    return head, s.matrix(";").replace(".", ",")


STYLES: dict[str, Style] = {
    "Gwyddion matrix": _gwyddion,
    "Gwyddion matrix, German": lambda s: _gwyddion(s, "Breite", "Höhe"),
    "Gwyddion, other channel": _gwyddion_other_channel,
    "Gwyddion XYZ": _gwyddion_points,
    "interferometer, factor": _factor,
    "counts of an LSB": _lsb,
    "Z-scale": _z_scale,
    "counts and Dx": _counts_and_pitch,
    "unit and resolution": _unit_and_step,
    "Dektak CSV": _dektak,
    "Dektak CSV, angstrom": _dektak_angstrom,
    "Talysurf": _talysurf,
    "Mitutoyo": _mitutoyo,
    "Mitutoyo column": _mitutoyo_column,
    "Keyence CSV": _keyence,
    "Keyence CSV, known keys": _keyence_known,
    "Keyence CSV, digits": _keyence_digits,
    "Alicona points": _alicona,
    "points without header": _alicona_bare,
    "Sensofar .dat": _sensofar,
    "Sensofar CSV": _sensofar_csv,
    "MountainsMap": _mountains,
    "MountainsMap, factor": _mountains_factor,
    "Olympus LEXT CSV": _lext,
    "coordinates around": _coordinates,
    "numbers around": _numbering,
    "positions in column 1": _first_column,
    "points y, x, z": _order("yxz"),
    "points z, y, x": _order("zyx"),
    "points, names and units": _order_two_lines,
    "profile z, x": _reversed_profile,
    "points with intensity": _with_intensity,
    "points, one unit": _one_unit,
    "NT-MDT": _ntmdt,
    "WSxM points": _wsxm,
    "Filmetrics": _filmetrics,
    "Nanoscope, Z scale": _nanoscope,
    "Nanoscope": _nanoscope_plain,
    "Veeco Vision": _veeco,
    "Zygo XYZ": _zygo_xyz,
    "ISO 5436-2 column": _iso,
    "matrix without header": _plain,
    "sentence": _sentence,
    "declared gaps": _declared,
    "decimal comma": _decimal_comma,
}


def make_file(style: str, trial: int) -> tuple[str, Sheet]:
    """Return the text of a file and what is true of it."""
    rng = np.random.default_rng([trial, *style.encode()])
    sheet = draw_sheet(rng)
    head, numbers = STYLES[style](sheet)
    extra = [str(line) for line in rng.choice(DISTRACTIONS, rng.integers(0, 4), replace=False)]
    sign = "# " if head.startswith("#") or rng.random() < 0.3 else ""
    if re.search("pixel|spacing|pitch", head, re.IGNORECASE) and rng.random() < 0.3:
        extra.append("Dx=2um")  # which contradicts the pitch
    return "".join(f"{sign}{line}\n" for line in extra) + head + numbers, sheet


def judge(raw: RawSurface, sheet: Sheet) -> str:
    """Return "right", "asked" or what is wrong."""
    truth = sheet.heights if sheet.rows > 1 else sheet.heights[0]
    heights = raw.heights
    if heights.shape != truth.shape:
        return f"WRONG shape {heights.shape} for {truth.shape}"
    if raw.relative:  # the preparation scales them to the range that the user gives
        heights = (heights - np.nanmin(heights)) / np.ptp(heights[~np.isnan(heights)])
        truth = (truth - np.nanmin(truth)) / np.ptp(truth[~np.isnan(truth)])
    scale = float(np.nanmax(np.abs(truth)))
    if not np.array_equal(np.isnan(heights), np.isnan(truth)):
        return "WRONG missing points"
    if np.nanmax(np.abs(heights - truth)) > 1e-5 * scale:
        return f"WRONG heights by {np.nanmax(np.abs(heights)) / scale:.3g}"
    if raw.pitch is not None and not np.allclose(raw.pitch, sheet.pitch[: truth.ndim], rtol=1e-3):
        return f"WRONG pitch {raw.pitch} for {sheet.pitch}"
    return "asked" if raw.relative or raw.pitch is None else "right"


Reading = Callable[[Path], RawSurface]


def read_plain(path: Path) -> RawSurface:
    """Read a file as asperity does, without the readers of instruments."""
    return read_text(SurfaceFile.open(path), ReadingOptions())


def read_by_any_unit(path: Path) -> RawSurface:
    """Read a file by the former rule: a unit in any line of the header is that of the heights."""
    raw = read_plain(path)
    head = [
        line for line in path.read_text("utf-8").splitlines() if re.search("[^\\W\\d_]{2}", line)
    ]
    found = [u for line in head for u in re.findall(r"(?<![^\W_])(mm|um|µm|nm)(?![^\W_])", line)]
    if not raw.relative or not found:
        return raw
    return Surface(raw.heights * UNITS[found[-1]], raw.pitch, raw.source, raw.notes)


def verdicts(style: str, trials: range, read: Reading = read_plain) -> Iterator[tuple[int, str]]:
    """Yield the verdict on each file of a style."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.txt"
        for trial in trials:
            text, sheet = make_file(style, trial)
            path.write_text(text, "utf-8")
            try:
                yield trial, judge(read(path), sheet)
            except AsperityError:
                yield trial, "asked"


def main(count: int) -> int:
    table = Table("style", "right", "asked", "WRONG", "control WRONG", "first fault")
    trials, total = range(-(-count // len(STYLES))), Counter[str]()
    for style in STYLES:
        found = list(verdicts(style, trials))
        control = [what for _, what in verdicts(style, trials[:50], read_by_any_unit)]
        kinds = Counter(what.split()[0] for _, what in found)
        wrong = [f"{trial}: {what}" for trial, what in found if what.startswith("WRONG")]
        faults = sum(what.startswith("WRONG") for what in control)
        total.update(kinds)
        total["control"] += faults
        cells = [kinds["right"], kinds["asked"], kinds["WRONG"], faults]
        table.add_row(style, *map(str, cells), wrong[0] if wrong else "")
    Console(width=140).print(table, dict(total))
    return 1 if total["WRONG"] or not total["control"] else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT))
