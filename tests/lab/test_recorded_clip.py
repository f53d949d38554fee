"""A recording of elsewhere is opened: its rows in pieces, its surface, law, device and hand."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.started import Started

import asperity as asp
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.lab.clips import RECORDING_FILE, find_recording, load_recorded_clip
from asperity.lab.playback import ANCHOR_COLUMNS, CHUNK_ROWS, FORCE_BINS, Playback
from asperity.lab.scene_state import SceneState
from asperity.loop.shared_trace import COLUMNS
from asperity.recording import recorded_field as field
from asperity.recording.recorded_field import TEXTURE_FILE
from asperity.recording.recording import Recording, open_recording
from asperity.recording.writer import RecordingWriter
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.driver_loop import DriverLoop, build_program, no_clock
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.process import LoopRecorder

WIDTH = len(COLUMNS) + 2 * len(ANCHOR_COLUMNS)
NAMES = [name for name, _unit in (*COLUMNS, *ANCHOR_COLUMNS)]
SCENE = """
[texture]
kind = "noise"
rms = "30 um"
size = "10 mm"
[surface]
law = "{law}"
stiffness = "700 N/m"
friction = 0.5
clamp = "whole"
[device]
id = "{device}"
update_rate = "2 kHz"
max_force = "4 N"
{more}
[hand]
{hand}
[motion]
kind = "strokes"
start = ["-3 mm", "0 mm", "0.5 mm"]
end = ["3 mm", "0 mm", "-1 mm"]
speed = "0.02 m/s"
count = 4
"""
SPRING = """kind = "spring"
stiffness = ["300 N/m", "200 N/m", "100 N/m"]
damping = "3 N*s/m"
mass = "50 g"
force = ["0 N", "0 N", "-0.2 N"]"""
BAND = 'kind = "band"\nstiffness = "150 N/m"'
TOUCH = ("touch-x", 'apparent_mass = "60 g"\ndelay_samples = 2\nforce_resolution = "2 mN"', "")
FIVE = (
    "pantograph",
    'joint_damping = "4 mN*m*s"',
    '[run]\ncentre = ["-10 mm", "95 mm"]\nbrakes = "always"\nvelocity_share = 0.4',
)


def scene(
    folder: Path, kind: tuple[str, str, str] = TOUCH, hand: str = SPRING, law: str = "F"
) -> Path:
    device, more, run = kind
    path = folder / "scene.toml"
    path.write_text(SCENE.format(device=device, more=more, hand=hand, law=law) + run)
    return path


def simulated(folder: Path, *kind: Any) -> Recording:
    path = scene(folder, *kind)
    make_setup(load_scene(str(path))).simulate(trace=folder / "run.mcap", max_rows=0)
    path.unlink()
    return open_recording(folder / "run.mcap")


def opened(recording: Recording) -> tuple[SceneState, Playback]:
    return load_recorded_clip(recording.path, str(recording.path), {}, None)


def whole(playback: Playback) -> Any:
    pieces = [np.frombuffer(playback.chunk(number)) for number in range(playback.chunk_count)]
    assert all(piece.size == CHUNK_ROWS * WIDTH for piece in pieces[:-1])
    return np.concatenate(pieces).reshape(-1, WIDTH)


@pytest.mark.parametrize("kind", [TOUCH, FIVE], ids=["mass", "five-bar"])
@pytest.mark.parametrize("hand", [SPRING, BAND], ids=["spring", "band"])
def test_the_loop_behind_is_what_the_recording_says(
    tmp_path: Path, kind: tuple[str, str, str], hand: str
) -> None:
    recording = simulated(tmp_path, kind, hand)
    stage, _reel = opened(recording)
    setup, about = stage.setup, recording.metadata
    assert to_plain_data(setup.servo) == about["servo"]
    assert to_plain_data(setup.plant) == about["plant"]
    assert to_plain_data(setup.hand) == about["hand"]
    assert setup.device.id == kind[0]
    assert (setup.device.value("max_force"), setup.servo.period) == (4.0, 0.5e-3)
    found = asp.replay(recording, setup.surface)
    assert (found.is_identical, found.notes) == (True, ())
    assert not asp.replay(recording, setup.surface.to_stiffness(701.0)).is_identical
    assert setup.surface.parameter("friction") == 0.5
    assert setup.surface.clamp == "whole"


def test_a_loop_that_keeps_time_says_device_and_hand(tmp_path: Path) -> None:
    setup, shared = make_setup(load_scene(str(scene(tmp_path)))), LoopMemory()
    driver = simulated_driver(setup.plant, setup.hand, setup.servo, setup.motion, 1.0)
    DriverLoop(driver, setup.servo, setup.safety, 1.0, shared.block(), no_clock()).run(
        build_program(setup.surface, driver), driver.open(), 900
    )
    for name, kept in (("simulated", True), ("haply", False)):
        path = tmp_path / f"{name}.mcap"
        with LoopRecorder(path, shared, setup.surface, setup.servo, setup.recording_metadata(name)):
            pass
        stage, playback = opened(open_recording(path))
        assert (to_plain_data(stage.setup.hand) == to_plain_data(setup.hand)) is kept
        assert (
            any("has no hand that can be simulated" in said for said in stage.setup.assumptions)
            is not kept
        )
        assert stage.setup.device.data == setup.device.data
        rows, _first = shared.rows(0)
        table = whole(playback)
        assert (table[:, : len(COLUMNS)] == rows).all()
        assert np.isnan(table[:, -3:]).all()  # no hand was recorded


@pytest.mark.parametrize("law", ["F", "C"])  # one feels the wall, one the texture
def test_what_a_simulation_does_not_record_is_made(tmp_path: Path, law: str) -> None:
    recording = simulated(tmp_path, TOUCH, SPRING, law)
    stage, playback = opened(recording)
    table, traced = whole(playback), recording.to_columns()
    assert len(table) == recording.rows > CHUNK_ROWS / 4
    column = {name: table[:, k] for k, name in enumerate(NAMES[: len(COLUMNS)])}
    assert (np.column_stack([column[axis] for axis in "xyz"]) == traced.position).all()
    assert (table[:, -3:] == traced.anchor).all()
    # The energy is the work of the force that is held, from row to row.
    given = (traced.applied[:-1] * np.diff(traced.position, axis=0)).sum(axis=1).cumsum()
    assert np.abs(column["supplied"][1:] - given).max() < 1e-9 < np.abs(given).max()
    high = stage.setup.surface.texture.height(traced.position[:, :2])
    inside, other = (
        traced.position[:, 2] < z for z in ((0.0, high) if law == "F" else (high, 0.0))
    )
    assert (column["inside"] == inside).all()
    assert (inside != other).any()
    near = stage.setup.surface.texture.nearest(traced.position[::10])
    assert (table[::10, len(COLUMNS) : -3] == near).all()


def test_no_force_is_lost_in_the_overview(tmp_path: Path) -> None:
    recording = simulated(tmp_path)
    rows = np.tile(recording.table(), (20, 1))
    rows[:, 0] = np.arange(len(rows)) * 5e-4
    force = [recording.names.index(f"applied {axis}") for axis in "xyz"]
    rows[12_345, force] = 3.0, 0.0, 4.0
    rows[23_456, force] = 0.0
    path = rewritten(recording, tmp_path / "long.mcap", rows)
    _stage, playback = opened(open_recording(path))
    size = np.sqrt((rows[:, force] ** 2).sum(axis=1))
    parts = np.arange(len(rows)) * FORCE_BINS // len(rows)
    for number in (0, parts[12_345], parts[23_456], FORCE_BINS - 1):
        mine = size[parts == number]
        assert tuple(playback.force_range[number]) == pytest.approx((mine.min(), mine.max()))
    assert playback.force_range[:, 1].max() == pytest.approx(5.0)
    assert playback.chunk_count > 3
    assert (whole(playback)[:, 1:4] == rows[:, 1:4]).all()


def rewritten(
    recording: Recording, path: Path, rows: Any = None, about: Any = None, columns: Any = None
) -> Path:
    """Write a recording again with something else in it."""
    held = recording.attachment(TEXTURE_FILE) or b""
    told = dict(recording.metadata) if about is None else about
    with RecordingWriter(path, columns or recording.columns, told, {TEXTURE_FILE: held}) as writer:
        writer.append(recording.table() if rows is None else rows)
    return path


def spoilt(kind: str, data: bytes) -> bytes:
    """Return the bytes of a recording with something wrong in them."""
    place = len(data) * 9 // 10
    return {
        "empty": b"",
        "text": b"time,x\n0,0\n",
        "cut head": data[:500],
        "later format": data.replace(b"format\1\0\0\x001", b"format\1\0\0\x002"),
        "damaged block": data[:place] + bytes([data[place] ^ 255]) + data[place + 1 :],
    }[kind]


def lacking(kind: str, recording: Recording) -> dict[str, Any]:
    """Return what is written instead of what a recording holds."""
    rows, about, columns = recording.table(), dict(recording.metadata), recording.columns
    if kind == "no numbers":
        rows[7, 2] = np.nan
    elif kind == "times":
        rows[9, 0] = rows[7, 0]
    kept = [k for k, (name, _) in enumerate(columns) if "supplied" not in name]
    law = {**about["surface"], "law": "Q"}
    others: dict[str, dict[str, Any]] = {
        "foreign columns": {"rows": rows[:, :4], "columns": columns[:4]},
        "no energy": {"rows": rows[:, kept], "columns": [columns[k] for k in kept]},
        "no surface": {"about": {"made_by": "my loop"}},
        "no servo": {"about": {"surface": about["surface"]}},
        "another law": {"about": {**about, "surface": law}},
        "one row": {"rows": rows[:1]},
    }
    return others.get(kind, {"rows": rows})


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("gone", "No such file"),
        ("empty", "it is empty"),
        ("text", "not an MCAP recording"),
        ("cut head", "it ends before its first row|does not say what its rows are"),
        ("later format", "it is of format 2"),
        ("damaged block", "the block after row .* is damaged"),
        ("foreign columns", "has no column 'applied x'"),
        ("no energy", "has no column of the energy"),
        ("no surface", "does not say which surface"),
        ("no servo", "has no settings of its servo"),
        ("another law", "law is unknown: 'Q'"),
        ("one row", "has 1 rows, too few"),
        ("no numbers", "values that are not finite"),
        ("times", "times that do not increase"),
    ],
)
def test_what_a_recording_lacks_is_said(tmp_path: Path, kind: str, words: str) -> None:
    recording, path = simulated(tmp_path), tmp_path / "bad.mcap"
    if kind in {"empty", "text", "cut head", "later format", "damaged block"}:
        path.write_bytes(spoilt(kind, recording.path.read_bytes()))
    elif kind != "gone":
        rewritten(recording, path, **lacking(kind, recording))
    assert find_recording(str(path), tmp_path) == path
    with pytest.raises(ParameterError, match=words):
        load_recorded_clip(path, str(path), {}, None)


def test_a_surface_that_was_too_large_is_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(field, "MAX_BYTES", 1000)
    with pytest.raises(ParameterError, match="does not contain its surface, which was too large"):
        opened(simulated(tmp_path))


def test_a_file_that_is_cut_is_shown_to_its_end(tmp_path: Path) -> None:
    recording = simulated(tmp_path)
    rows = np.tile(recording.table(), (4, 1))
    rows[:, 0] = np.arange(len(rows)) * 5e-4
    long = rewritten(recording, tmp_path / "long.mcap", rows)
    long.write_bytes(long.read_bytes()[:-900_000])
    cut = open_recording(long)
    _stage, playback = opened(cut)
    assert 100 < playback.row_count == cut.rows < len(rows)
    assert (whole(playback)[:, 1:4] == rows[: cut.rows, 1:4]).all()


def test_a_device_that_is_not_known_is_replaced_and_said(tmp_path: Path) -> None:
    recording = simulated(tmp_path)
    about = {**recording.metadata, "device": {"id": "my-own", "name": "Mine"}}
    stage, _reel = opened(
        open_recording(rewritten(recording, tmp_path / "other.mcap", about=about))
    )
    assert "names no known device" in stage.setup.assumptions[0]
    assert stage.setup.device.id == DEFAULT_DEVICE
    assert (
        load_recorded_clip(recording.path, "", {}, asp.load_device("touch"))[0].settings["device"]
        == "touch"
    )


def test_archives_of_others_are_left_to_who_reads_surfaces(tmp_path: Path) -> None:
    other = tmp_path / "surface.x3p"
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("main.xml", "<p/>")
    for named in (str(other), "knurl", str(tmp_path / "none.zip"), str(tmp_path)):
        assert find_recording(named, tmp_path) is None
    broken = tmp_path / "take.zip"
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr(RECORDING_FILE, b"\x00" * 5000)
    data = bytearray(broken.read_bytes())
    data[100] ^= 255
    broken.write_bytes(data)
    with pytest.raises(ParameterError, match=r"take\.zip cannot be read: Bad CRC"):
        find_recording(str(broken), tmp_path)


def test_the_command_refuses_in_one_line(tmp_path: Path) -> None:
    simulated(tmp_path)
    (tmp_path / "empty.mcap").write_bytes(b"")
    for arguments, words in (
        (["empty.mcap"], "cannot be read: it is empty"),
        (["run.mcap", "--s-cutoff", "1mm"], "s_cutoff has no effect on a recording"),
    ):
        command = [sys.executable, "-m", "asperity", "lab", "--no-browser", *arguments]
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
        )
        assert (done.returncode, done.stdout) == (2, "")
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1


# --- on the page ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shown(
    tmp_path_factory: pytest.TempPathFactory, browser: Browser
) -> Iterator[tuple[Browser, Recording]]:
    """The page of a lab that was opened with a long recording."""
    folder = tmp_path_factory.mktemp("recorded")
    recording = simulated(folder)
    rows = np.tile(recording.table(), (120, 1))
    rows[:, 0] = np.arange(len(rows)) * 5e-4
    path = rewritten(recording, folder / "long.mcap", rows)
    lab = Started(str(path))
    browser.said.clear()
    browser.resize(1280, 900)
    browser.call("Page.navigate", url=lab.address)
    browser.until("globalThis.lab?.frame && lab.hasPictures")
    yield browser, open_recording(path)
    browser.call("Page.navigate", url="about:blank")
    assert lab.end() == (0, "")


def go_to(page: Browser, row: int) -> None:
    page.ask(
        f"(() => {{ const at = document.getElementById('playback-time'); at.value = {row};"
        "at.dispatchEvent(new Event('input')); })()"
    )
    page.until(f"lab.player.targetRow === null && lab.player.row === {row}")


@needs_browser
def test_a_long_recording_is_shown_again_piece_by_piece(shown: tuple[Browser, Recording]) -> None:
    page, recording = shown
    page.until("lab.player.isOpen && lab.player.isPlaying && lab.player.time > 0.2")
    assert page.ask("document.querySelector('#clips button').textContent") == "Show long.mcap"
    page.press("j")
    assert recording.rows > 20 * CHUNK_ROWS
    names = {name: k for k, name in enumerate(recording.names)}
    rows = recording.table()
    random = np.random.default_rng(1)
    for row in (
        *random.integers(1, recording.rows, 25).tolist(),
        10,
        9 * CHUNK_ROWS + 5,
        recording.rows,
    ):
        go_to(page, row)
        force = [rows[row - 1, names[f"applied {axis}"]] for axis in "xyz"]
        assert page.ask("lab.probeState().force") == pytest.approx(force, abs=0)
        probe = [rows[row - 1, names[axis]] for axis in "xyz"]
        assert page.ask("lab.probeState().probe") == pytest.approx(probe, abs=0)
        first, count = page.ask("[lab.frame.firstRow, lab.frame.rowCount]")
        assert first + count == row  # of a frame no extreme is lost, also where pieces meet
        least = rows[first:row, [names[axis] for axis in "xyz"]].min(axis=0)
        seen = page.ask("['x','y','z'].map(a => lab.frame.minima[lab.player.playback.columns[a]])")
        assert seen == pytest.approx(least, abs=0)
        assert page.ask("lab.player.playback.chunks.size") <= 16
    assert page.said == []
    assert page.ask("lab.errorCount") == 0


@needs_browser
def test_it_plays_as_time_goes_and_holds_at_its_end(shown: tuple[Browser, Recording]) -> None:
    page, recording = shown
    page.until("lab.player.isOpen")
    go_to(page, 5000)
    was = page.ask("performance.now()")
    page.press("j")
    page.until("lab.player.time > 3.5")
    ratio = (page.ask("lab.player.time") - 2.5) / (1e-3 * (page.ask("performance.now()") - was))
    assert 0.8 < ratio < 1.1
    page.press("j")
    go_to(page, recording.rows - 100)
    page.press("j")
    page.until("lab.player.row < 20000")  # from the beginning again


@needs_browser
def test_behind_it_is_its_own_surface_and_a_change_is_of_the_loop(
    shown: tuple[Browser, Recording],
) -> None:
    page, recording = shown
    page.until("lab.player.isOpen && lab.status.state === 'running'")
    assert page.ask("lab.status.settings.law") == "F"
    page.ask("document.querySelector('#law-buttons button').click()")  # W
    page.until(
        "!lab.player.isOpen && lab.status.settings.law === 'W' && lab.status.state === 'running'"
    )
    assert page.ask("document.getElementById('playback').hidden")
    page.ask("document.querySelector('#clips button').click()")
    page.until(
        "lab.player.isOpen && lab.status.settings.law === 'F' && lab.status.state === 'running'"
    )
    page.until("lab.hasCurrentPictures")
    shown_heights = np.array(page.ask("Array.from(lab.relief.heights)"))
    x, y, size = page.ask("[lab.relief.x, lab.relief.y, lab.relief.size]")
    along = np.linspace(-0.5 * size, 0.5 * size, 96)
    xs, ys = np.meshgrid(x + along, y + along)
    texture = opened(recording)[0].setup.surface.texture
    assert shown_heights == pytest.approx(
        texture.height(np.column_stack([xs.ravel(), ys.ravel()])), abs=1e-15
    )
    # After a reload it is there again.
    page.call("Page.reload")
    page.until("globalThis.lab?.frame && lab.player.isOpen")
    page.press("l")
    page.until("!lab.player.isOpen")
    assert page.said == []
