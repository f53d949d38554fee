"""Every parser accepts or refuses any text of at most 100 kB within 1 s."""

from __future__ import annotations

import contextlib
import gc
import random
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import get_args

import pytest

from asperity.core.arguments import Argument, Form
from asperity.core.errors import AsperityError
from asperity.core.units import parse_quantity
from asperity.devices.device_file import load_device
from asperity.measured.reading import ReadingOptions, SurfaceFile
from asperity.measured.reading.grids import read_sdf
from asperity.measured.reading.pixels import ome_scale
from asperity.measured.reading.readers import SIGNATURE_READERS
from asperity.measured.reading.text_reader import read_text
from asperity.measured.reading.x3p import parse_header
from asperity.scene.loop_sections import read_path
from asperity.scene.scene_file import load_scene

MAX_LENGTH = 100_000  # [bytes]
SECONDS = 1.0  # processor time, as the machine may be busy
N_RANDOM = 8  # texts of random pieces for each prefix

PIECES = (
    *("[(", "[", "(", "{", "<", "<a>", "</a>", "((1", "[1,", "{a=", "a.", "a:", "a=1,", "a=", "="),
    *(" ", "\t", "\n", "\r", "\r\n", "\f", "\x00", "\u00a0", "#", "%", ";", ",", ".", "-", "_"),
    *("9", "0", "1e9", "1_", "1 ", "1,", "1;", "1\n", "1 2 3\n", "1,5;", "nan ", "+", "-1", "0x"),
    *("m", "m*", "m^9", "m**9", "m/", "1/", "mm ", "²", "µ", "°", "um ", "e", "E9", "''", '"', ":"),
    *("no data ", "factor ", "h=1 w=1 ", "[um] ", "BAD ", "*", "v 1 2 3\n", "f 1 2 3\n", "solid "),
    *(
        "&a;",
        "&#1;",
        "<!--",
        "]]>",
        "[[a]]\n",
        "[a]\n",
        "a = 1\n",
        "a.b.c.d=1\n",
        "é",
        "\\",
        '"=".',
    ),
)


def texts(prefix: str) -> Iterator[str]:
    """Yield a prefix followed by repetitions of each piece, then by random pieces."""
    length = (MAX_LENGTH - len(prefix.encode())) // 2
    for piece in PIECES:
        repeated = piece * (length // len(piece.encode()))
        yield f"{prefix}x{repeated}x\n1 2 3 4\n5 6 7 8\n"
        yield prefix + repeated + repeated
    rng = random.Random(prefix)
    for _ in range(N_RANDOM):
        text = prefix
        while len(text.encode()) < MAX_LENGTH - 20_000:
            piece = "".join(rng.choices(PIECES, k=rng.randrange(1, 4)))
            text += piece * rng.choice((1, 3, 1000))
        yield text.encode()[:MAX_LENGTH].decode(errors="ignore")


def to_surface_file(text: str) -> SurfaceFile:
    Path("text.dat").write_text(text, encoding="utf-8", newline="")
    return SurfaceFile(Path("text.dat"), text.encode()[:4096])


def from_path(read: Callable[[str], object]) -> Callable[[str], object]:
    def parse(text: str) -> object:
        Path("text.toml").write_text(text, encoding="utf-8", newline="")
        return read("text.toml")

    return parse


def recognise(text: str) -> None:
    for reader in SIGNATURE_READERS:
        reader.recognises(to_surface_file(text))


def parse_every_form(text: str) -> None:
    for form in get_args(Form):
        try:
            Argument("a", "an argument", "m", form=form).parse(text)
        except AsperityError:
            continue


BOMB = '<!DOCTYPE a [<!ENTITY a "aaaaaaaa">' + "".join(
    f'<!ENTITY a{k} "{f"&a{k - 1 or str()};" * 10}">' for k in range(1, 12)
)
SDF = (
    "aISO-1.0\nManufacID = x\nNumPoints = 4\nNumProfiles = 2\nXscale = 1\nYscale = 1\nZscale = 1\n"
)
PARSERS: dict[str, tuple[Callable[[str], object], tuple[str, ...]]] = {
    "quantity": (lambda text: parse_quantity("period", text, "m"), ("", "1 ", "1 mm")),
    "argument": (parse_every_form, ("",)),
    "surface": (load_scene, ("", "sinusoid:", "sinusoid:amplitude=1mm,period=", "fourier:phases=")),
    "scene": (from_path(load_scene), ("", "a = ", '[texture]\nkind = "sinusoid"\namplitude = "')),
    "device": (from_path(load_device), ("", "[workspace]\nvalue = [")),
    "path of a motion": (from_path(read_path), ("", "t,x,y,z\n")),
    "mark of a format": (recognise, ("", "solid ", "aISO-1.0\n", "v 1 2 3\n")),
    "text": (
        lambda text: read_text(to_surface_file(text), ReadingOptions()),
        ("", "# Width: ", "x [um] "),
    ),
    "text with columns": (
        lambda text: read_text(to_surface_file(text), ReadingOptions()),
        ("x;z;valid\n[mm];[mm];[1/0]\n", "index,x [m],z [m]\n"),
    ),
    "OME": (ome_scale, ("", "<Pixels ", '<a:Pixels PhysicalSizeX="1" ')),
    "SDF": (
        lambda text: read_sdf(to_surface_file(text), ReadingOptions()),
        ("aISO-1.0\n", SDF, SDF + "*"),
    ),
    "XML of an X3P": (
        lambda text: parse_header(text.encode(), []),
        ("", "<ISO5436_2>", '<?xml version="1.0"?>', BOMB, f"{BOMB}]><ISO5436_2>&a11;", "<a b='"),
    ),
}


def find_faults(parse: Callable[[str], object], prefixes: tuple[str, ...]) -> list[str]:
    """Return the texts that take too long or raise anything but an AsperityError."""
    faults = []
    for text in (text for prefix in prefixes for text in texts(prefix)):
        assert len(text.encode()) <= MAX_LENGTH + 100
        start = time.process_time()
        try:
            parse(text)
        except AsperityError:
            pass
        except Exception as error:  # any other error is a fault
            faults.append(f"{type(error).__name__} ({error!s:.60}): {text[:60]!r}")
        duration = time.process_time() - start
        if duration > SECONDS:
            faults.append(f"{duration:.1f} s: {text[:60]!r}")
    return faults


@pytest.mark.parametrize("name", PARSERS)
def test_every_text_is_accepted_or_refused_in_a_second(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    parse, prefixes = PARSERS[name]
    for prefix in prefixes:
        with contextlib.suppress(AsperityError):
            parse(prefix)  # imports at the first call are not measured
    # Objects of other tests are excluded from garbage collection: with ten million of them
    # one collection takes a second.
    gc.collect()
    gc.freeze()
    try:
        assert find_faults(parse, prefixes) == []
    finally:
        gc.unfreeze()


def test_slow_and_failing_parsers_are_detected() -> None:
    """Negative control: a search with quadratic time, and a ValueError."""
    calls = []

    def quadratic(text: str) -> object:
        calls.append(text)
        return re.search(r"\s+$", " " * 30_000 + "y") if len(calls) == 1 else None

    assert "s: " in find_faults(quadratic, ("",))[0]
    faults = find_faults(lambda text: int(text[:1]), ("",))
    assert any("ValueError" in fault for fault in faults)
