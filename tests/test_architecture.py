"""Layers and imports of the package, public names, and the example of a user-defined law."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.helpers.source_modules import find_places, modules_outside, parse, read_modules

import asperity
from asperity.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]


def test_imports_respect_the_layers() -> None:
    process = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert process.returncode == 0, process.stdout


def test_every_public_name_exists() -> None:
    for name in asperity.__all__:
        assert getattr(asperity, name) is not None


def test_example_of_a_user_defined_law_runs() -> None:
    process = subprocess.run(
        [sys.executable, ROOT / "examples" / "own_law.py"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    assert "the curl is zero identically" in process.stdout
    assert "S: q = " in process.stdout


# --- import cycles -------------------------------------------------------------------------------


def imported_modules(text: str, names: Mapping[str, str]) -> Iterator[str]:
    """Yield the modules that a module imports anywhere: at its top, in functions, for types."""
    for node in ast.walk(parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                full_name = f"{node.module}.{alias.name}"
                yield full_name if full_name in names else node.module


def import_cycles(texts: Mapping[str, str]) -> list[str]:
    """Return the modules that import themselves through others."""
    graph = {
        name: {m for m in imported_modules(text, texts) if m in texts}
        for name, text in texts.items()
    }
    cycles = []
    for name in sorted(graph):
        reached: set[str] = set()
        pending = list(graph[name])
        while pending:
            module = pending.pop()
            if module not in reached:
                reached.add(module)
                pending.extend(graph[module])
        if name in reached:
            cycles.append(name)
    return cycles


def hidden_imports(text: str) -> list[int]:
    """Return the lines that import a module of the package by its name in a string."""
    return [
        node.lineno
        for node in ast.walk(parse(text))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).endswith(("import_module", "__import__"))
        and isinstance(node.args[0], ast.Constant)
        and str(node.args[0].value).startswith("asperity")
    ]


def test_hidden_imports_are_detected() -> None:
    assert hidden_imports("import_module('asperity.report')\nimport_module('numba')") == [1]


def test_package_has_no_hidden_imports() -> None:
    assert find_places(read_modules(), hidden_imports) == []


def test_package_has_no_import_cycles() -> None:
    assert import_cycles(read_modules()) == []


def test_import_cycles_inside_functions_are_detected() -> None:
    texts = {
        "a": "def f():\n    from b import g\n",
        "b": "if TYPE_CHECKING:\n    import c.d\n",
        "c.d": "from c import e\n",
        "c.e": "import a\n",
    }
    assert import_cycles(texts) == ["a", "b", "c.d", "c.e"]
    assert import_cycles(texts | {"c.e": "import b_b\n"}) == []


# --- directions between folders ------------------------------------------------------------------

CATALOGUES = {"catalogue", "readers", "driver_registry", "__init__"}
"""Modules of a folder that may import its subfolders: they list what is in them."""


def folder_of(name: str, texts: Mapping[str, str]) -> str:
    """Return the package of a module; a package is its own."""
    is_package = any(other.startswith(f"{name}.") for other in texts)
    return name if is_package else name.rpartition(".")[0]


def folder_imports(texts: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    """Yield each module with its folder and the folder of a module that it imports."""
    for name, text in texts.items():
        for target in imported_modules(text, texts):
            if target in texts:
                yield name, folder_of(name, texts), folder_of(target, texts)


def two_way_folders(texts: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return the pairs of folders, neither inside the other, that import each other."""
    pairs = {(folder, target) for _, folder, target in folder_imports(texts)}
    return sorted(
        (a, b)
        for a, b in pairs
        if a < b and (b, a) in pairs and not b.startswith(f"{a}.") and not a.startswith(f"{b}.")
    )


def imports_of_subfolders(texts: Mapping[str, str]) -> list[str]:
    """Return the modules, catalogues excepted, that import a subfolder of their own folder."""
    return sorted(
        {
            f"{name} imports {target}"
            for name, folder, target in folder_imports(texts)
            if target.startswith(f"{folder}.")
            and name != folder
            and name.rpartition(".")[2] not in CATALOGUES
        }
    )


def test_folders_beside_each_other_import_one_way() -> None:
    assert two_way_folders(read_modules()) == []


def test_only_catalogues_import_the_subfolders_of_their_folder() -> None:
    inside = {name: text for name, text in read_modules().items() if name.count(".") > 1}
    assert imports_of_subfolders(inside) == []


def test_directions_between_folders_are_detected() -> None:
    texts = {
        "p": "",
        "p.a": "",
        "p.a.x": "from p.b import y",
        "p.b": "",
        "p.b.y": "from p.a import x\nfrom p.b.c import z",
        "p.b.c": "",
        "p.b.c.z": "from p.b import y",
        "p.b.catalogue": "from p.b.c import z",
    }
    assert two_way_folders(texts) == [("p.a", "p.b")]
    assert imports_of_subfolders(texts) == ["p.b.y imports p.b.c"]


# --- one room for the operating system -----------------------------------------------------------

MODULES_BELOW_THE_ROOM = {
    "asperity.core.cache": {"os.fchmod", "os.geteuid", "os.getuid"},
    "asperity.core.files": {"/proc/", "os.O_TMPFILE"},
    "asperity.core.memory": {"/proc/", "/sys/"},
    "asperity.core.processes": {
        "os.nice",
        "os.sched_getaffinity",
        "signal.pthread_sigmask",
        "signal.SIG_BLOCK",
        "signal.SIG_SETMASK",
    },
    "asperity.__main__": {"platform.system"},
}
"""What modules that cannot import the room ask, each after a check that it is there; and the name
of the system in the message of an internal error."""
PLATFORM_MODULES = re.compile("fcntl|msvcrt|pwd|grp|resource|termios|tty|winreg|_winapi")
PLATFORM_NAMES = re.compile(
    r"sys\.platform|os\.name|platform\.system|ctypes\.(WinDLL|windll)"
    r"|os\.(fchmod|fork|gete?[ug]id|getpg\w+|killpg|mkfifo|nice|pread|pwrite|sched_\w+|set_blocking"
    r"|setsid|O_NOFOLLOW|O_TMPFILE)"
    r"|select\.(e?poll|POLL\w+)|time\.(clock_\w+|CLOCK_\w+)"
    r"|signal\.(pthread_\w+|SIG(?!INT$|TERM$|_IGN$|_DFL$)\w+)"
)
PLATFORM_FOLDERS = re.compile("/(proc|dev|sys)/")


def platform_questions(text: str) -> list[tuple[int, str]]:
    """Return the lines that ask for the operating system, or for what only one of them has."""
    found = []
    for node in ast.walk(parse(text)):
        questions: list[re.Match[str] | None] = []
        if isinstance(node, ast.Import):
            questions = [PLATFORM_MODULES.fullmatch(alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            questions = [PLATFORM_NAMES.fullmatch(name) for name in names]
            questions.append(PLATFORM_MODULES.fullmatch(str(node.module)))
        elif isinstance(node, ast.Attribute):
            questions = [PLATFORM_NAMES.fullmatch(ast.unparse(node))]
        elif isinstance(node, ast.Call):
            questions = [re.fullmatch(r".*CDLL\(None.*\)", ast.unparse(node))]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            questions = [PLATFORM_FOLDERS.match(node.value)]
        found += [(node.lineno, question[0]) for question in questions if question is not None]
    return found


def questions_outside_the_room(texts: Mapping[str, str]) -> list[str]:
    return [
        f"{module}:{line} {name}"
        for module, text in texts.items()
        for line, name in platform_questions(text)
        if name not in MODULES_BELOW_THE_ROOM.get(module, set())
    ]


def test_only_one_room_asks_for_the_operating_system() -> None:
    assert questions_outside_the_room(modules_outside("core.platform")) == []


def test_questions_for_the_operating_system_are_detected() -> None:
    for text in (
        "import fcntl",
        "from termios import tcgetattr",
        "if sys.platform == 'win32': ...",
        "os.name",
        "platform.system()",
        "signal.SIGHUP",
        "os.setsid()",
        "ctypes.CDLL(None)",
        "Path('/proc/self/statm')",
        "select.poll()",
    ):
        assert len(platform_questions(text)) == 1, text
    for text in ("driver.name", "signal.SIGINT", "hasattr(os, 'nice')", "ctypes.CDLL(path)"):
        assert platform_questions(text) == [], text


# --- options and commands are known to the command line only -------------------------------------


def strings_with_options(text: str) -> list[int]:
    """Return the lines of one-line strings that name an option or a command of the program."""
    commands = "|".join(sorted(COMMANDS))
    pattern = re.compile(rf"(^|[\s(])--[a-z]|\basperity ({commands})\b")
    return [
        node.lineno
        for node in ast.walk(parse(text))
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and "\n" not in node.value
        and pattern.search(node.value)
    ]


def test_only_the_command_line_names_options_and_commands() -> None:
    texts = modules_outside("cli", "__main__", "derive.generate")
    assert find_places(texts, strings_with_options) == []


def test_options_and_commands_in_strings_are_detected() -> None:
    assert strings_with_options("a = 'give it with --pitch'\nb = 'asperity compare x'") == [1, 2]
    assert strings_with_options("a = 'the pitch -- in metres'") == []
