"""A user-defined law, in a file outside the package, works everywhere.

The law has a parameter with a unit and bounds. It is used through ``--plugin``, a scene and
Python, and every result contains the parameter.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.helpers.pages import page_example

import asperity as asp
from asperity.laws import REGISTERED_LAWS
from asperity.scene import load_scene
from asperity.scene.setup import make_setup

Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]

MODULE = page_example("tutorials/own_law.md", "Use it on the command line", "{run}").split("'''")[1]
LOOP = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "Q"
stiffness = "400 N/m"
max_depth = "0.4 mm"
soft_depth = "0.2 mm"
[device]
apparent_mass = "50 g"
damping = "1 N*s/m"
update_rate = "4 kHz"
max_stiffness = "2 N/mm"
[hand]
kind = "spring"
stiffness = "300 N/m"
damping = "3 N*s/m"
[motion]
kind = "still"
point = ["0 mm", "0 mm", "-0.3 mm"]
[run]
duration = "0.05 s"
"""
SPEC = "sinusoid:amplitude=0.1mm,period=2mm"
PARAMETERS, ASSUMPTION = {"soft_depth": 2e-4}, "Given soft depth 200 µm"


@pytest.fixture
def module(tmp_path: Path) -> str:
    (tmp_path / "mine.py").write_text(MODULE, encoding="utf-8")
    return str(tmp_path / "mine.py")


@pytest.fixture
def scene(tmp_path: Path) -> str:
    (tmp_path / "loop.toml").write_text(LOOP, encoding="utf-8")
    return str(tmp_path / "loop.toml")


def test_compare_passes_the_parameter_only_to_the_law_that_has_it(
    call: Call, read_json: Answer, module: str
) -> None:
    options = ["--plugin", module, "--laws", "WQ", "--set", "soft-depth=0.2 mm"]
    data = read_json("compare", SPEC, *options)
    assert [(row["law"], row["law_parameters"]) for row in data["laws"]] == [
        ("W", {}),
        ("Q", PARAMETERS),
    ]
    assert data["laws"][1]["conservative"]
    assert "Given soft depth 200 µm for law Q" in data["assumptions"]
    softer = read_json("compare", SPEC, *options[:4])["laws"][1]
    assert softer["law_parameters"] == {"soft_depth": 0.5e-3}
    assert softer["support"] > data["laws"][1]["support"]
    code, page, _err = call("compare", SPEC, *options, "--html", "-")
    assert (code, ASSUMPTION in page) == (0, True)
    code, out, _err = call("compare", SPEC, *options)
    assert (code, "Q" in [line.split(" ")[0] for line in out.splitlines()]) == (0, True)


def test_compare_without_laws_includes_it(read_json: Answer, module: str) -> None:
    data = read_json("compare", SPEC, "--plugin", module)
    assert "".join(row["law"] for row in data["laws"]) == "WABCDEFGHQ"


@pytest.mark.parametrize("command", ["analyze", "limits"])
def test_analyze_and_limits_use_the_parameter(
    call: Call, read_json: Answer, module: str, command: str
) -> None:
    options = ["--plugin", module, "--law", "saturating change of height"]
    data = read_json(command, SPEC, *options, "--set", "soft_depth=200um")
    assert (data["law"], data["law_parameters"]) == ("Q", PARAMETERS)
    code, page, _err = call(command, SPEC, *options, "--set", "soft_depth=200um", "--html", "-")
    assert (code, ASSUMPTION in page) == (0, True)


def test_scene_sets_the_parameter_and_set_overrides_it(
    call: Call, read_json: Answer, module: str, scene: str
) -> None:
    data = read_json("simulate", scene, "--plugin", module)
    assert (data["scene"]["surface"]["law"], data["scene"]["surface"]["parameters"]) == (
        "Q",
        PARAMETERS,
    )
    code, page, _err = call("simulate", scene, "--plugin", module, "--html", "-")
    assert (code, ASSUMPTION in page) == (0, True)
    data = read_json("analyze", scene, "--plugin", module)
    assert data["law_parameters"] == PARAMETERS
    data = read_json("simulate", scene, "--plugin", module, "--set", "soft_depth=0.3 mm")
    assert data["scene"]["surface"]["parameters"] == {"soft_depth": 3e-4}
    data = read_json("compare", scene, "--plugin", module, "--laws", "CQ")
    assert [row["law_parameters"] for row in data["laws"]] == [{}, PARAMETERS]


def test_scan_passes_the_parameter_only_to_the_law_that_has_it(
    read_json: Answer, module: str, scene: str
) -> None:
    motion = (
        'kind = "strokes"\nstart = "0mm;0mm;-0.3mm"\nend = "4mm;0mm;-0.3mm"\nspeed = "0.1 m/s"\n'
    )
    Path(scene).write_text(
        LOOP.replace('kind = "still"\n', motion).replace("point = ", "# "), "utf-8"
    )
    options = ["--plugin", module, "--laws", "WQ", "--speeds", "0.1m/s", "--strokes", "1"]
    soft = read_json("scan", scene, *options)
    hard = read_json("scan", scene, *options, "--set", "soft_depth=10 mm")
    assert [stroke["law"] for stroke in soft["strokes"]] == ["W", "Q"]
    assert f"{ASSUMPTION} for law Q" in soft["scene"]["assumptions"]
    assert soft["strokes"][0] == hard["strokes"][0]
    assert soft["strokes"][1] != hard["strokes"][1]


def test_python_functions_use_the_law_and_its_parameter(scene: str) -> None:
    names: dict[str, Any] = {}
    exec(MODULE, names)
    law = names["SATURATING"]
    texture = asp.Sinusoid(amplitude=0.1e-3, period=2e-3)
    result = asp.compare(texture, laws=["C", law], max_depth=4e-4, law_parameters=PARAMETERS)
    assert [dict(row.surface.law_parameters) for row in result.rows] == [{}, PARAMETERS]
    with pytest.raises(
        asp.ParameterError, match="'soft_dept', which is no parameter of the laws C, Q; did you"
    ):
        asp.compare(texture, laws=["C", law], law_parameters={"soft_dept": 2e-4})
    from asperity.laws import register

    try:
        register(law)
        setup = make_setup(load_scene(scene))
        assert dict(setup.surface.law_parameters) == PARAMETERS
        assert asp.limits(texture, law="Q", law_parameters=PARAMETERS).surface.law is law
    finally:
        REGISTERED_LAWS.pop("Q", None)


BAD = [
    (["--laws", "Q", "--set", "soft_dept=1mm"], "set names 'soft_dept', which is a parameter of no"
     " law and no field of a device; did you mean 'soft_depth'?"),
    (["--laws", "W", "--set", "soft_depth=1mm"], "law W does not take it; law Q does"),
    (["--laws", "Q", "--set", "soft_depth=1N"], "soft_depth must be a quantity such as '1.5 m'"),
    (["--laws", "Q", "--set", "soft_depth=1m"], "soft_depth must be 10 µm to 10 mm"),
    (["--laws", "Q", "--set", "soft_depth"], "set must be NAME=VALUE"),
    (["--laws", "Q", "--set", "soft_depth=1mm", "--set", "soft-depth=2mm"], "given twice"),
    (["--laws", "F", "--friction", "1", "--set", "friction=1"], "friction is given twice"),
    (["--laws", "Y"], "'Y'"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), BAD, ids=lambda value: str(value)[:50])
def test_invalid_options_give_a_one_line_error(
    call: Call, module: str, options: list[str], message: str
) -> None:
    code, out, err = call("compare", SPEC, "--plugin", module, *options)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert "Q" not in REGISTERED_LAWS


FILES = {
    "x = (": "line 1: SyntaxError: '(' was never closed",
    "\n1 / 0": "line 2: ZeroDivisionError: division by zero",
    "import sys\nsys.exit('no')": "line 2: SystemExit: no",
    "from asperity.laws import Law\n\nL = Law('Q', 'x', 'sideways', print)":
        "line 3: law Q: contact must be one of nominal",
    "from asperity.laws import Law\nL = Law('C', 'x', 'nominal', print)":
        "line 2: law C (x): 'C' is taken by law C (change-of-height)",
    "from asperity.laws import Law\nL = Law('Q', 'God object', 'nominal', print)":
        "line 2: law Q (God object): 'God object' is taken by law D",
    "from asperity.laws import Law\n"
    "L = Law('Q', 'x', 'nominal', print, parameters={'max_deflection': 1e-3})":
        "line 2: law Q (x): its parameter 'max_deflection' is in [1], that of another law in [m]",
    "from asperity.laws import LAWS, find_law\nC = find_law('C')": "registers nothing: no Law, ",
    "\x00": "line 1: ",
    "from asperity.laws import Law\n\ndef force(c):\n    return c.k * nothing\n\n"
    "L = Law('Q', 'x', 'vertical', force)": "line 4: law Q: its force is not a symbolic formula "
    "(name 'nothing' is not defined)",
    "from asperity.laws import Law\nL = Law('Q', 'x', 'vertical', lambda c: [c.k, 0])":
        "line 2: law Q: force must have 3 components",
}  # fmt: skip


@pytest.mark.parametrize("source", FILES)
def test_errors_in_the_plugin_are_reported_with_line_and_reason(
    call: Call, tmp_path: Path, source: str
) -> None:
    path = tmp_path / "broken.py"
    path.write_text(source, encoding="utf-8")
    code, out, err = call("analyze", SPEC, "--law", "C", "--plugin", str(path))
    assert (code, out) == (2, "")
    assert f"plugin {path}" in err
    assert FILES[source] in err
    assert len(err.strip().splitlines()) == 1


def test_error_at_the_first_use_is_reported_with_its_line(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "late.py"
    path.write_text(
        "from asperity.textures.texture import TextureKind\n\n\n"
        "def make():\n    raise ValueError('not\\ntoday')\n\n\n"
        "LATE = TextureKind('late', 'x', make, ())\n"
    )
    code, out, err = call("compare", "late:", "--plugin", str(path))
    assert (code, out) == (2, "")
    assert err == f"asperity: {path}, line 5: ValueError: not today\n"


def test_missing_plugin_file_is_reported(call: Call) -> None:
    code, _out, err = call("analyze", SPEC, "--law", "C", "--plugin", "no/file.py")
    assert code == 2
    assert "plugin no/file.py cannot be read: No such file" in err


def test_several_plugins_may_import_modules_of_their_folder(
    read_json: Answer, tmp_path: Path
) -> None:
    (tmp_path / "parts_of_mine.py").write_text("LETTER = 'Q'\n")
    first = MODULE.replace('letter="Q"', "letter=LETTER")
    (tmp_path / "first.py").write_text("from parts_of_mine import LETTER\n" + first, "utf-8")
    second = "Y = Law('Y', 'y', 'nominal', lambda c: c.k * c.depth * c.e_z)\n"
    second = "from asperity.laws import Law\n" + second
    (tmp_path / "second.py").write_text(second, encoding="utf-8")
    files = ["--plugin", str(tmp_path / "first.py"), "--plugin", str(tmp_path / "second.py")]
    data = read_json("compare", SPEC, *files, "--laws", "YQ")
    assert [row["law"] for row in data["laws"]] == ["Y", "Q"]


def test_plugin_may_define_a_texture_kind(call: Call, read_json: Answer, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import asperity as asp\n"
        "from asperity.core.arguments import Argument\n"
        "from asperity.textures.texture import TextureKind\n"
        "def made(height):\n    return asp.Sinusoid(height / 2, 2e-3)\n"
        "HEIGHT = Argument('height', 'of it', 'm', required=True)\n"
        "MINE = TextureKind('my-wave', 'mine', made, (HEIGHT,))\n"
    )
    module = ["--plugin", str(tmp_path / "mine.py")]
    data = read_json("compare", "my-wave:height=0.1mm", "--laws", "A", *module)
    assert data["texture"]["amplitude"] == 5e-5
    code, _out, err = call("compare", "my-wave:height=0.1mm", "--laws", "A")
    assert (code, "'my-wave'" in err) == (2, True)


def test_plugin_may_define_a_reader(call: Call, read_json: Answer, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import numpy as np\n"
        "from asperity.measured.reading import RawSurface, Reader\n"
        "def read(file, options):\n"
        "    heights = np.frombuffer(file.content, '<f8', offset=8)\n"
        "    return RawSurface(heights, (1e-5,), file.name, ())\n"
        "MINE = Reader('a WAFFLE file', lambda file: file.head.startswith(b'WAFFLE__'), read)\n"
    )
    heights = 1e-5 * np.sin(np.arange(64.0))
    (tmp_path / "land.waffle").write_bytes(b"WAFFLE__" + heights.tobytes())
    arguments = ["limits", str(tmp_path / "land.waffle"), "--law", "A"]
    data = read_json(*arguments, "--plugin", str(tmp_path / "mine.py"))
    assert data["texture"]["pitch"] == pytest.approx(1e-5)
    assert call(*arguments)[0] == 2


@pytest.mark.parametrize(
    "text",
    ['law_module = "mine.py"\n[texture]\nkind = "sinusoid"\namplitude = 1e-4\nperiod = 1e-3\n',
     '[texture]\nkind = "sinusoid"\namplitude = 1e-4\nperiod = 1e-3\n'
     '[surface]\nlaw-module = "mine.py"\n'],
    ids=["at the top", "in a section"],
)  # fmt: skip
def test_scene_never_runs_code(call: Call, tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.py").write_text("raise SystemExit('it was run')\n")
    (tmp_path / "scene.toml").write_text(text)
    code, out, err = call("compare", str(tmp_path / "scene.toml"))
    assert (code, out) == (2, "")
    assert "a scene never runs code" in err
    assert "--plugin FILE" in err
