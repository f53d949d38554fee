"""The source of the package: its modules, their syntax trees, and places in them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src"


@cache
def parse(text: str) -> ast.Module:
    return ast.parse(text)


@lru_cache(maxsize=1)
def read_modules() -> dict[str, str]:
    """Return the text of every module of the package by its dotted name."""
    texts = {}
    for path in SOURCE.rglob("*.py"):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        texts[name] = path.read_text(encoding="utf-8")
    return texts


def modules_outside(*packages: str) -> dict[str, str]:
    """Return the modules outside these packages."""
    inside = tuple(f"asperity.{package}." for package in packages)
    return {
        name: text for name, text in read_modules().items() if not f"{name}.".startswith(inside)
    }


def find_places(texts: Mapping[str, str], checker: Callable[[str], list[int]]) -> list[str]:
    """Return the places that a checker finds, "module:line"."""
    return [f"{name}:{line}" for name, text in texts.items() for line in checker(text)]
