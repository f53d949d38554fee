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
