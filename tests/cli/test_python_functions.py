"""Python functions that do what a command does, and the tables of results."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cli.conftest import Call

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.devices import override_device
from asperity.laws import Law

ROOT = Path(__file__).parents[2]
STROKE, PRESS = (str(ROOT / "examples" / name) for name in ("stroke.toml", "press.toml"))


def read_json(path: Path) -> Any:
    return json.loads(path.read_text("utf-8"))


def as_json(result: Any) -> Any:
    return json.loads(json.dumps(result.to_dict()))


def test_simulate_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "run.json"
    options = ("--law", "C", "--duration", "50ms", "--json", str(output))
    assert call("simulate", STROKE, *options)[0] == 0
    run = asp.simulate(STROKE, law="C", duration=0.05)
    assert read_json(output)["run"] == as_json(run)
    other = asp.simulate(STROKE, law="A", duration=0.05)
    assert other.ledger.total != run.ledger.total


def test_onset_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "onset.json"
    options = ("--laws", "WC", "--delays", "1", "--starts", "2", "--lowest", "7N/m")
    device = ("--device", "pantograph", "--set", "update_rate=5kHz", "--json", str(output))
    assert call("onset", PRESS, *options, *device)[0] == 0
    pantograph = override_device(asp.load_device("pantograph"), {"update_rate": "5 kHz"})
    result = asp.onset(PRESS, "WC", 1, device=pantograph, n_phases=2, min_stiffness=7.0)
    assert read_json(output) == as_json(result)
    assert result.setup.servo.period == pytest.approx(2e-4)
    rows = result.table_rows()
    assert [row["law"] for row in rows] == ["W", "C"]
    assert rows[1]["cycling [N/m]"] == result.onsets[1].onset.cycling
    assert result.to_html().startswith("<!DOCTYPE html>")
    other = asp.onset(PRESS, "C", 1, device=pantograph, n_phases=2, min_stiffness=9.0)
    assert other.onsets[0].onset.quiet != result.onsets[1].onset.quiet


def test_scan_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "scan.json"
    options = ("--speeds", "0.1m/s", "--strokes", "3", "--json", str(output))
    assert call("scan", STROKE, "--laws", "AF", "--friction", "0.3", *options)[0] == 0
    result = asp.scan(STROKE, "AF", speeds="0.1 m/s", strokes=3, friction=0.3)
    assert read_json(output) == as_json(result)
    assert result.table_rows()[0]["gains energy"]
    assert "Energy per stroke" in result.to_html()
    assert as_json(asp.scan(STROKE, "AF", speeds=0.1, strokes=3)) != as_json(result)


WAVES = """[texture]
kind = "fourier"
amplitudes = ["50 um", "30 um"]
wavevectors = [["6000 1/m", "0 1/m"], ["0 1/m", "6000 1/m"]]
"""


def write_waves(folder: Path, source: str) -> Path:
    """Write a scene with two waves, on which law H is baked and law D searches."""
    text, scene = Path(source).read_text("utf-8"), folder / "waves.toml"
    before, after = text.split("[texture]")[0], text[text.index("[surface]") :]
    scene.write_text(f"{before}{WAVES}\n{after}", encoding="utf-8")
    return scene


def test_strokes_state_how_each_law_is_rendered(tmp_path: Path) -> None:
    scene = write_waves(tmp_path, STROKE)
    notes = asp.scan(scene, "WHD", speeds=0.1, strokes=3, device="touch").setup.assumptions
    baked, presses, searched = notes[:3]
    assert baked.startswith("Law H baked as a potential field: ")
    assert presses.startswith("At 1000 N/m its error is known for presses of ")
    assert searched.startswith("Law D finds its contact by a search")
    assert len(set(notes)) == len(notes)
    plain = asp.scan(scene, "WC", speeds=0.1, strokes=3, device="touch").setup.assumptions
    assert not any("baked" in note or "search" in note for note in plain)


def test_onsets_state_how_each_law_is_rendered(tmp_path: Path) -> None:
    """And nothing about the delay of the device, which the delays of the sweep replace."""
    scene = write_waves(tmp_path, PRESS)
    text = scene.read_text("utf-8")
    scene.write_text(re.sub("^centre = .*", "", text, flags=re.MULTILINE), encoding="utf-8")
    result = asp.onset(
        scene, "H", 1, device="touch", n_phases=1, duration=0.1, min_stiffness=1000.0
    )
    baked, *others = result.setup.assumptions
    assert baked.startswith("Law H baked as a potential field: ")
    assert any(note.startswith("The update rate") for note in others)
    assert not any("delay" in note for note in others)


def test_sweeps_take_laws_of_the_user() -> None:
    law = Law("Y", "doubled-height", "vertical", lambda c: 2 * c.k * c.depth * c.w)
    result = asp.scan(STROKE, [law, "C"], speeds=0.1, strokes=3)
    assert [stroke.law for stroke in result.strokes] == ["Y", "C"]


def test_tables_name_units() -> None:
    pandas = pytest.importorskip("pandas", reason="not run: no pandas here")
    result = asp.compare("sinusoid:amplitude=0.8mm,period=1mm", laws="WA")
    frame = result.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame["law"]) == ["W", "A"]
    limit = result["A"].stability_limit.stiffness
    assert frame["stability limit [N/m]"][1] == limit
    row = result.table_rows()[1]
    assert row["ripple [m]"] * row["stiffness [N/m]"] == pytest.approx(row["texture force RMS [N]"])
    several = asp.compare_devices("sinusoid:amplitude=0.1mm,period=1mm", ["touch", "omega.3"])
    assert list(several.to_dataframe()["device"].unique()) == ["touch", "omega.3"]


def test_unknown_numbers_are_none() -> None:
    """On this device nothing is known to be stable for D below crests: no stiffness, no force."""
    result = asp.compare("sinusoid:amplitude=0.8mm,period=1mm", "omega.3", "D", max_depth=1e-3)
    (row,) = result.table_rows()
    assert result["D"].recommended_stiffness == 0.0
    names = ("recommended stiffness [N/m]", "texture force RMS [N]", "resolved force RMS [N]")
    assert [row[name] for name in names] == [None, None, None]


def test_table_without_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)  # as if it were not installed
    result = asp.compare("sinusoid:amplitude=0.8mm,period=1mm", laws="W")
    with pytest.raises(ParameterError, match="needs pandas: pip install pandas"):
        result.to_dataframe()


def test_compare_devices_takes_one_device_and_depth() -> None:
    result = asp.compare_devices("sinusoid:amplitude=0.1mm,period=1mm", "touch", 1e-4, "W")
    assert [(one.device.id, one.max_depth) for one in result.comparisons] == [("touch", 1e-4)]


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda: asp.compare("cloth", devices="touch"), "compare_devices compares several"),
        (lambda: asp.compare("cloth", ["touch", "omni"]), "compare_devices compares several"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: asp.compare("cloth", max_depth=[1e-4]), "max_depth must be a number"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: asp.Surface("cloth", "C", stiffness=[9.0]), "stiffness must be a number"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: asp.compare("cloth", law="C"), "law is unknown; did you mean 'laws'"),
        (lambda: asp.limits("cloth", stifness=3.0), "stifness is unknown; did you mean"),
        (lambda: asp.analyze("cloth", depth=1e-4), "depth is unknown; did you mean 'max_depth'"),
        (lambda: asp.onset(PRESS, starts=3), "starts is unknown"),
        (lambda: asp.onset(PRESS, "W", []), "delays must be one or several"),
        (lambda: asp.onset(PRESS, "W", 1, stiffness=5.0), "stiffness is the result of onset"),
        (lambda: asp.onset(PRESS, "W", 1, law="C"), "law is unknown; did you mean 'laws'"),
        (lambda: asp.onset(PRESS, []), "laws must name at least one law"),
        (lambda: asp.scan(STROKE, speed=[0.1]), "speed is unknown; did you mean 'speeds'"),
        (lambda: asp.scan(STROKE, "A", speeds=[]), "speeds must be one or several"),
        (lambda: asp.scan(STROKE, "A", speeds=-0.1), "speeds must be positive"),
        (lambda: asp.simulate(STROKE, lw="C"), "lw is unknown; did you mean 'law'"),
        (lambda: asp.simulate(STROKE, law="A", friction=0.3), "friction has no effect: law A"),
        (lambda: asp.simulate(None), "scene must be the path of a scene file"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: asp.compare_devices("cloth", []), "device must be one or several"),
        (lambda: asp.simulate("cloth", law="C"), r"needs a section \[hand\]"),
        (lambda: asp.replay("missing.mcap"), "missing.mcap"),
    ],
)
def test_mistakes_are_named(mistake: Callable[[], Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        mistake()


def test_export_is_the_command(call: Call, tmp_path: Path) -> None:
    options = ("--device", "touch", "--law", "C", "--stiffness", "300N/m", "--name", "felt")
    assert call("export", "cloth", "-o", str(tmp_path / "a.h"), *options)[0] == 0
    law = {"law": "C", "stiffness": 300, "name": "felt"}
    files = asp.export_code("cloth", tmp_path / "b.h", "touch", **law)
    assert files == (tmp_path / "b.h", tmp_path / "b_data.c")
    texts = [(tmp_path / name).read_text("utf-8") for name in ("a.h", "b.h")]
    assert texts[0].replace("a.h", "b.h").replace("a_data", "b_data") == texts[1]
    assert "felt_force" in texts[1]
    surface = asp.Surface(asp.named_surface("cloth"), "C", stiffness=300, clamp="backed")
    asp.export_code(surface, tmp_path / "c.h", "touch", name="felt")
    text = (tmp_path / "c.h").read_text("utf-8")
    assert text.replace("c.h", "b.h").replace("c_data", "b_data") == texts[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"lang": "c98"}, "lang is unknown: .c98."),
        ({"name": "2"}, "name must be a C identifier"),
        ({"stifness": 3}, "stifness"),
        ({"path": "texture.c"}, "must be a file that ends in .h"),
        ({"path": "here.h"}, "path exists"),
        ({"load": True}, "load needs a baked field"),
    ],
)
def test_export_refuses_what_the_command_refuses(
    arguments: dict[str, Any], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here.h").touch()
    given = {"path": "there.h", "law": "C", "stiffness": 300} | arguments
    with pytest.raises(ParameterError, match=words):
        asp.export_code("cloth", **given)
    assert [file.name for file in tmp_path.iterdir()] == ["here.h"]


def test_export_writes_the_field_beside_the_program(
    make_texture: Callable[[str], asp.Texture], tmp_path: Path
) -> None:
    texture = make_texture("periodic map")
    law = {"law": "H", "stiffness": 300, "load": True}
    files = asp.export_code(texture, tmp_path / "soft.h", "touch", **law)
    assert [file.name for file in files] == ["soft.h", "soft.field"]
    with pytest.raises(ParameterError, match="path exists"):
        asp.export_code(texture, tmp_path / "soft.h", "touch", **law)
    (tmp_path / "soft.h").unlink()
    with pytest.raises(ParameterError, match="path exists"):
        asp.export_code(texture, tmp_path / "soft.h", "touch", **law)


def test_run_is_the_command(call: Call, tmp_path: Path) -> None:
    done: list[float] = []
    law = {"law": "C", "stiffness": 5, "duration": 0.2}
    recordings = [str(tmp_path / name) for name in ("a.mcap", "b.mcap")]
    result = asp.run("cloth", device="touch", record=recordings[0], progress=done.append, **law)
    assert result.ended.name == "FINISHED"
    assert done == sorted(done)
    options = ("--law", "C", "--stiffness", "5N/m", "--duration", "0.2s", "--device", "touch")
    output = tmp_path / "run.json"
    options += ("--record", recordings[1], "--json", str(output))
    assert call("run", "cloth", *options)[0] == 0
    # Both end by the clock, so their samples differ by some; each recording has all of its own.
    samples = [result.statistics.samples, read_json(output)["statistics"]["samples"]]
    assert [asp.open_recording(path).rows for path in recordings] == samples
    assert min(samples) > 200
    own, other = (asp.open_recording(path).metadata for path in recordings)
    for key in ("surface", "servo", "driver"):
        assert own[key] == other[key], key
    with pytest.raises(ParameterError, match="record exists"):
        asp.run("cloth", record=recordings[0], **law)
    with pytest.raises(ParameterError, match="stiffness is refused"):
        asp.run("cloth", device="touch", law="C", stiffness=300)
    with pytest.raises(ParameterError, match="stifness"):
        asp.run("cloth", stifness=3)


def test_run_takes_the_recommended_law() -> None:
    wave = "sinusoid:amplitude=50um,period=2mm"
    result = asp.run(wave, device="omega.3", duration=0.05)
    row = asp.compare(wave, "omega.3").recommended_row
    assert row is not None
    assert result.scene.surface.law == row.law
    assert result.scene.surface.stiffness == row.recommended_stiffness
    assert any("as compare recommends" in text for text in result.scene.assumptions)


def test_show_is_the_command(call: Call, tmp_path: Path) -> None:
    file, output = tmp_path / "rough.npy", tmp_path / "show.json"
    np.save(file, 1e-6 * np.random.default_rng(1).standard_normal((40, 50)))
    options = ("--pitch", "2um", "--unit", "m", "--form", "2", "--json", str(output))
    assert call("show", str(file), *options)[0] == 0
    assert read_json(output) == as_json(asp.show(file, pitch=2e-6, unit="m", form=2))
