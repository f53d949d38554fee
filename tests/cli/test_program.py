"""The program as a process: exit codes, streams and interrupts, without tracebacks."""

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
        ["bash", "-c", program + command],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        **options,
    )  # options are those of run


def one_line(text: str) -> str:
    """Return the only line of a text."""
    (line,) = text.splitlines()
    return line


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_full_stdout_gives_a_one_line_error() -> None:
    process = run("asperity devices > /dev/full")
    assert process.returncode == 74
    assert one_line(process.stderr) == "asperity: output cannot be written: No space left on device"


def test_closed_pipe_is_not_an_error() -> None:
    process = run("asperity devices --json - | true; echo ${PIPESTATUS[0]}")
    assert int(process.stdout) in {0, 141}  # before or after the reader left
    assert not process.stderr


def test_reader_that_ends_early_is_told_by_the_exit_code() -> None:
    process = run("asperity devices | (exec 0<&-; sleep 1); echo ${PIPESTATUS[0]}")
    assert (process.stdout, process.stderr) == ("141\n", "")


@pytest.mark.parametrize("closed", ["0<&-", "1>&-", "2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-"])
def test_closed_standard_streams_are_accepted(closed: str, tmp_path: Path) -> None:
    path = tmp_path / "devices.json"
    process = run(f"asperity devices --json {path} {closed}")
    assert (process.returncode, process.stderr) == (0, "")
    assert path.read_text().rstrip().endswith("}") or path.read_text().rstrip().endswith("]")


def test_characters_outside_the_encoding_are_replaced() -> None:
    process = run("PYTHONIOENCODING=ascii asperity devices")
    assert process.returncode == 0
    assert process.stdout.isascii()
    assert "30 ?m" in process.stdout


def test_error_messages_are_ascii_in_an_ascii_encoding() -> None:
    process = run("PYTHONIOENCODING=ascii asperity compare sinusoid:amplitude=0.8µs,period=1mm")
    assert process.returncode == 2
    assert one_line(process.stderr).isascii()


def test_matplotlib_backend_of_the_environment_is_ignored(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    surface = "sinusoid:amplitude=0.8mm,period=1mm"
    process = run(f"MPLBACKEND=nonsense asperity analyze {surface} --law C --html {page}")
    assert (process.returncode, process.stderr) == (0, "")
    assert "<svg" in page.read_text()


def test_matplotlibrc_of_the_user_is_ignored(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: purple\n")
    surface = "sinusoid:amplitude=0.8mm,period=1mm"
    process = run(f"asperity analyze {surface} --law C --html page.html", cwd=tmp_path)
    assert (process.returncode, process.stderr) == (0, "")


_FAULT = """
import asperity.cli.main as command_line
def main():
    raise ZeroDivisionError("float division\\nby zero")
command_line.main = main
from asperity.__main__ import main
main()
"""


def test_internal_error_is_one_line_with_command_exception_and_line() -> None:
    process = subprocess.run(
        [sys.executable, "-c", _FAULT, "compare", "a b"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 70
    line = one_line(process.stderr)
    for part in ("asperity compare 'a b'", "ZeroDivisionError: float division by zero", "line 4"):
        assert part in line.replace('"', "")


def test_internal_error_shows_its_traceback_on_request() -> None:
    process = subprocess.run(
        [sys.executable, "-c", _FAULT],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"ASPERITY_TRACEBACK": "1"},
    )
    assert process.returncode == 70
    assert "Traceback" in process.stderr


def test_interrupt_during_interpreter_shutdown_is_ignored() -> None:
    """Python restores the default handlers while it exits, so it ignores interrupts before."""
    script = (
        "import atexit, os, signal\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))\n"
        "import asperity.cli.main as command_line\n"
        "command_line.main = lambda: print('done')\n"
        "from asperity.__main__ import main\n"
        "main()\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (process.returncode, process.stdout, process.stderr) == (0, "done\n", "")


@pytest.mark.parametrize("module", ["click", "asperity.cli.analysis_commands", "numba", "numpy"])
def test_interrupt_during_imports_ends_with_exit_code_130(module: str, tmp_path: Path) -> None:
    """An empty cache makes the program import every module, wherever the import stands."""
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
    process = subprocess.run(
        [sys.executable, "-c", script, "compare", "sinusoid:amplitude=0.8mm,period=1mm"],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(tmp_path)},
    )
    assert process.returncode == 130
    assert one_line(process.stderr.strip()) == "asperity: interrupted"
    assert not process.stdout


def test_interrupt_of_a_comparison_leaves_no_file(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    command = [*PROGRAM, "compare", "sandpaper:grit=P60", "--html", str(page)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.5)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.decode().strip() == "asperity: interrupted"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_program_that_is_killed_with_workers_warns_of_nothing(
    tmp_path: Path, end: signal.Signals
) -> None:
    plugin = tmp_path / "kill.py"
    plugin.write_text(
        "import os\n"
        "from asperity.core.processes import make_pool\n"
        "pool = make_pool(1)\n"
        "pool.submit(abs, 1).result()\n"
        f"os.kill(os.getpid(), {int(end)})\n"
    )
    command = [*PROGRAM, "compare", "cloth", "--plugin", str(plugin)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (process.returncode, process.stdout, process.stderr) == (-end, "", "")


def test_control_characters_of_a_path_are_not_printed(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[31mred\x07\nline.x3p"
    path.write_bytes(b"no surface")
    for command in (["compare"], ["prepare", "-o", str(tmp_path / "out.npz")]):
        process = subprocess.run(
            [*PROGRAM, *command, str(path)], capture_output=True, text=True, check=False
        )
        assert process.returncode == 2
        assert one_line(process.stderr).isprintable()
