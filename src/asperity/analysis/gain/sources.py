"""On which source files a certificate depends: those of this package that its makers import."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

_PACKAGE = Path(__file__).parents[2]
# Which texture a name means: the texture that was found is part of a certificate's key itself.
_BESIDE = frozenset({"asperity.textures.naming"})


def used_modules(roots: Iterable[str]) -> frozenset[str]:
    """Return the modules that the roots import, directly or not, functions included.

    What finds a texture by its name is not followed. What a package imports in its ``__init__``
    counts only where a name of the package itself is asked for.
    """
    found: set[str] = set()
    left = list(roots)
    while left:
        module = left.pop()
        if module not in found | _BESIDE:
            found.add(module)
            file = _file(module)
            left += () if file is None else _imported(file, file.stat().st_mtime_ns)
    return frozenset(found)


def source_digest(roots: Iterable[str]) -> str | None:
    """Return a digest of the files of the roots and of all that they import.

    ``None`` if a file is not to be found.
    """
    digest = hashlib.sha256()
    for module in sorted(used_modules(roots)):
        file = _file(module)
        if file is None:
            return None
        digest.update(f"{module}\n".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _file(module: str) -> Path | None:
    base = _PACKAGE.joinpath(*module.split(".")[1:])
    choice = base.with_suffix(".py"), base / "__init__.py"
    return next((file for file in choice if file.is_file()), None)


@lru_cache(maxsize=512)
def _imported(file: Path, changed: int) -> tuple[str, ...]:  # noqa: ARG001 - a file may change
    """Return the modules of this package that a file imports, as it was last changed."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return tuple(dict.fromkeys(name for node in ast.walk(tree) for name in _names(node)))


def _names(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (name.name for name in node.names if is_own(name.name))
    elif isinstance(node, ast.ImportFrom) and is_own(node.module or ""):
        for name in node.names:
            inner = f"{node.module}.{name.name}"
            yield inner if _file(inner) else str(node.module)


def is_own(module: str) -> bool:
    """Return whether a module, by its name, belongs to this package."""
    return module.partition(".")[0] == _PACKAGE.name
