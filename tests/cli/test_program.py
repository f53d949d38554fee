"""The program as the system sees it: exit codes, streams, interrupts, and never a traceback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = [sys.executable, "-c", "from asperity.__main__ import main; main()"]
DEVICES = [*PROGRAM, "devices"]


def run(command: str, **options: object) -> subprocess.CompletedProcess[str]:
    """Run a shell command in which ``asperity`` is the program."""
    program = f'asperity() {{ {sys.executable} -m asperity "$@"; }}\n'
    return subprocess.run(
        ["bash", "-c", program + command], capture_output=True, text=True, timeout=120, check=False,
        **options,
    )  # fmt: skip  # options are those of run


def one_line(text: str) -> str:
    """Return the only line of a text."""
    (line,) = text.splitlines()
    return line


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_a_full_standard_output_is_said_in_one_line() -> None:
    done = run("asperity devices > /dev/full")
    assert done.returncode == 74
    assert one_line(done.stderr) == "asperity: output cannot be written: No space left on device"


def test_a_reader_that_has_enough_is_no_error() -> None:
    done = run("asperity devices --json - | true; echo ${PIPESTATUS[0]}")
    assert int(done.stdout) in {0, 1, 141}  # before or after the reader left
    assert not done.stderr


@pytest.mark.parametrize("closed", ["0<&-", "1>&-", "2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-"])
def test_closed_streams_do_no_harm(closed: str, tmp_path: Path) -> None:
    path = tmp_path / "devices.json"
    done = run(f"asperity devices --json {path} {closed}")
    assert (done.returncode, done.stderr) == (0, "")
    assert path.read_text().rstrip().endswith("}") or path.read_text().rstrip().endswith("]")


def test_signs_that_an_encoding_lacks_are_written_plainly() -> None:
    done = run("PYTHONIOENCODING=ascii asperity devices")
    assert done.returncode == 0
    assert done.stdout.isascii()
    assert "sigma0(B)" in done.stdout
    assert "30 um" in done.stdout
    assert "10 um ?" in done.stdout  # "not verified", not a sign that was lost
    assert "???" not in done.stdout


def test_bad_input_is_said_in_such_an_encoding_too() -> None:
    done = run("PYTHONIOENCODING=ascii asperity compare sinusoid:amplitude=0.8µs,period=1mm")
    assert done.returncode == 2
    assert one_line(done.stderr).isascii()


def test_a_foreign_backend_of_matplotlib_does_not_matter(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    surface = "sinusoid:amplitude=0.8mm,period=1mm"
    done = run(f"MPLBACKEND=nonsense asperity analyze {surface} --law C --html {page}")
    assert (done.returncode, done.stderr) == (0, "")
    assert "<svg" in page.read_text()


def test_foreign_settings_of_matplotlib_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: purple\n")
    surface = "sinusoid:amplitude=0.8mm,period=1mm"
    done = run(f"asperity analyze {surface} --law C --html page.html", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


_FAULT = """
import asperity.cli.main as command_line
def main():
    raise ZeroDivisionError("float division\\nby zero")
command_line.main = main
from asperity.__main__ import main
main()
"""


def test_a_fault_is_one_line_that_says_what_was_done_and_where() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _FAULT, "compare", "a b"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 70
    line = one_line(done.stderr)
    for part in ("asperity compare 'a b'", "ZeroDivisionError: float division by zero", "line 4"):
        assert part in line.replace('"', "")


def test_a_fault_shows_its_traceback_when_asked() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _FAULT], capture_output=True, text=True, check=False,
        env=os.environ | {"ASPERITY_TRACEBACK": "1"},
    )  # fmt: skip
    assert done.returncode == 70
    assert "Traceback" in done.stderr


_SWALLOWS = """
import os, signal, time
import asperity.cli.main as command_line
class Finalized:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)
def main():
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except BaseException:
        print("went on", flush=True)
    {work}
command_line.main = main
from asperity.__main__ import main
main()
"""


@pytest.mark.parametrize(
    "work", ["return", "time.sleep(30); print('to the end')"], ids=["no longer", "and works on"]
)
@pytest.mark.parametrize("swallowed_by", ["try", "finalizer"])
def test_an_interrupt_that_was_swallowed_is_told_and_ends_the_work(
    work: str, swallowed_by: str
) -> None:
    script = _SWALLOWS.replace("{work}", work)
    if swallowed_by == "finalizer":
        script = script.replace(
            "        os.kill(os.getpid(), signal.SIGINT)\n    except",
            ("        Finalized()\n        print('went on', flush=True)\n    except"),
        )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout) == (130, "went on\n")
    assert done.stderr == "asperity: interrupted\n"


def test_an_interrupt_after_the_work_does_not_end_by_the_signal() -> None:
    """Python hands signals back to the system while it ends: none may come then."""
    script = (
        "import atexit, os, signal\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))\n"
        "import asperity.cli.main as command_line\n"
        "command_line.main = lambda: print('done')\n"
        "from asperity.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


def test_an_interrupt_inside_exec_ends_with_its_exit_code(tmp_path: Path) -> None:
    """Run by -m, Python would end by the signal: a dataclass is made by exec(), for one."""
    interrupted = "exec('import os, signal; os.kill(os.getpid(), signal.SIGINT)')"
    (tmp_path / "own.py").write_text(
        "import sys, types\n"
        "fake = types.ModuleType('fake')\n"
        f"fake.main = lambda: {interrupted}\n"
        "sys.modules['asperity.cli.main'] = fake\n"
        "from asperity.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "own"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (130, "asperity: interrupted\n")


@pytest.mark.parametrize("module", ["click", "asperity.cli.analysis_commands", "numba", "numpy"])
def test_an_interrupt_during_imports_ends_with_its_exit_code(module: str, tmp_path: Path) -> None:
    """The interrupt comes while a module is being imported, wherever that is; nothing is kept."""
    script = f"""
import os, signal, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
from asperity.__main__ import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", script, "compare", "sinusoid:amplitude=0.8mm,period=1mm"],
        capture_output=True, text=True, check=False, timeout=120,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 130
    assert one_line(done.stderr.strip()) == "asperity: interrupted"
    assert not done.stdout


def test_an_interrupt_at_work_leaves_no_file(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    command = [*PROGRAM, "compare", "sandpaper:grit=P60", "--html", str(page)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.5)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert said.decode().strip() == "asperity: interrupted"
    assert list(tmp_path.iterdir()) == []


def test_control_characters_of_a_name_never_reach_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[31mred\x07\nline.x3p"
    path.write_bytes(b"no surface")
    for command in (["compare"], ["prepare", "-o", str(tmp_path / "out.npz")]):
        done = subprocess.run(
            [*PROGRAM, *command, str(path)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert one_line(done.stderr).isprintable()
