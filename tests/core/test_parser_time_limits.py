"""Every text of at most 100 kB is accepted or refused within 1 s, by every parser there is."""

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
from asperity.measured.reading.grids import read_esri
from asperity.measured.reading.images.pixels import ome_scale
from asperity.measured.reading.metrology.sdf import read_sdf
from asperity.measured.reading.metrology.x3p import parse_header
from asperity.measured.reading.plain_text.text_reader import read_text
from asperity.measured.reading.readers import SIGNATURE_READERS
from asperity.scene.scene_file import load_scene
from asperity.scene.sections import read_path

LONGEST = 100_000  # [bytes]
SECONDS = 1.0  # of the processor, on a machine that has other work
RANDOM = 8  # texts that are made of random pieces, for each beginning

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


def texts(beginning: str) -> Iterator[str]:
    """Yield a beginning followed by one piece over and over, then by pieces as they come."""
    room = (LONGEST - len(beginning.encode())) // 2
    for piece in PIECES:
        once = piece * (room // len(piece.encode()))
        yield beginning + once
        yield f"{beginning}x{once}x\n1 2 3 4\n5 6 7 8\n"
        yield beginning + once + once
    rng = random.Random(beginning)
    for _ in range(RANDOM):
        text = beginning
        while len(text.encode()) < LONGEST - 20_000:
            piece = "".join(rng.choices(PIECES, k=rng.randrange(1, 4)))
            text += piece * rng.choice((1, 3, 1000))
        yield text.encode()[:LONGEST].decode(errors="ignore")


def file_of(text: str) -> SurfaceFile:
    Path("text.dat").write_text(text, encoding="utf-8", newline="")
    return SurfaceFile(Path("text.dat"), text.encode()[:4096])


def as_file(read: Callable[[str], object]) -> Callable[[str], object]:
    def parse(text: str) -> object:
        Path("text.toml").write_text(text, encoding="utf-8", newline="")
        return read("text.toml")

    return parse


def recognise(text: str) -> None:
    for reader in SIGNATURE_READERS:
        reader.recognises(file_of(text))


def every_form(text: str) -> None:
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
ESRI = "ncols 4\nnrows 3\ncellsize 1\n"
PARSERS: dict[str, tuple[Callable[[str], object], tuple[str, ...]]] = {
    "quantity": (lambda text: parse_quantity("period", text, "m"), ("", "1 ", "1 mm")),
    "argument": (every_form, ("",)),
    "surface": (load_scene, ("", "sinusoid:", "sinusoid:amplitude=1mm,period=", "fourier:phases=")),
    "scene": (as_file(load_scene), ("", "a = ", '[texture]\nkind = "sinusoid"\namplitude = "')),
    "device": (as_file(load_device), ("", "[workspace]\nvalue = [")),
    "path of a motion": (as_file(read_path), ("", "t,x,y,z\n")),
    "mark of a format": (recognise, ("", "solid ", "aISO-1.0\n", "v 1 2 3\n")),
    "text": (lambda text: read_text(file_of(text), ReadingOptions()), ("", "# Width: ", "x [um] ")),
    "text, resampled": (
        lambda text: read_text(file_of(text), ReadingOptions(resample=1.0)),
        ("", "x;z;valid\n[mm];[mm];[1/0]\n", "index,x [m],z [m]\n"),
    ),
    "ESRI grid": (
        lambda text: read_esri(file_of(text), ReadingOptions()),
        ("ncols ", ESRI, f"{ESRI}1 "),
    ),
    "OME": (ome_scale, ("", "<Pixels ", '<a:Pixels PhysicalSizeX="1" ')),
    "SDF": (lambda text: read_sdf(file_of(text), ReadingOptions()), ("aISO-1.0\n", SDF, SDF + "*")),
    "XML of an X3P": (
        lambda text: parse_header(text.encode(), []),
        ("", "<ISO5436_2>", '<?xml version="1.0"?>', BOMB, f"{BOMB}]><ISO5436_2>&a11;", "<a b='"),
    ),
}


def measured(parse: Callable[[str], object], beginnings: tuple[str, ...]) -> list[str]:
    """Return the texts that take too long, or that raise what is no refusal."""
    faults = []
    for text in (text for beginning in beginnings for text in texts(beginning)):
        assert len(text.encode()) <= LONGEST + 100
        before = time.process_time()
        try:
            parse(text)
        except AsperityError:
            pass
        except Exception as error:  # the very thing that is looked for
            faults.append(f"{type(error).__name__} ({error!s:.60}): {text[:60]!r}")
        taken = time.process_time() - before
        if taken > SECONDS:
            faults.append(f"{taken:.1f} s: {text[:60]!r}")
    return faults


@pytest.mark.parametrize("name", PARSERS)
def test_every_text_is_accepted_or_refused_in_a_second(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    parse, beginnings = PARSERS[name]
    for beginning in beginnings:
        with contextlib.suppress(AsperityError):
            parse(beginning)  # what is imported at the first call is no part of it
    # What other tests left behind is not looked through, should a collection of garbage be due:
    # with their ten million objects one takes a second by itself.
    gc.collect()
    gc.freeze()
    try:
        assert measured(parse, beginnings) == []
    finally:
        gc.unfreeze()


def test_what_is_slow_or_no_refusal_is_found() -> None:
    """Negative control: a search that is quadratic, and an error of somebody else's."""
    found = []

    def quadratic(text: str) -> object:
        found.append(text)
        return re.search(r"\s+$", " " * 30_000 + "y") if len(found) == 1 else None

    assert "s: " in measured(quadratic, ("",))[0]
    raised = measured(lambda text: int(text[:1]), ("",))
    assert any("ValueError" in fault for fault in raised)
