"""Layers and imports of the package, public names, and the example of a user-defined law."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.helpers.source_modules import find_places, parse, read_modules

import asperity

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
