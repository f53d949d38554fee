"""Texts of the pages, read from ``texts.toml``; results are filled in."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from importlib import resources
from typing import Any


@lru_cache(maxsize=1)
def _load_texts() -> dict[str, Any]:
    return tomllib.loads(
        resources.files("asperity.report").joinpath("texts.toml").read_text("utf-8")
    )


def sentence(name: str, **values: object) -> str:
    """Return a sentence by its name in ``texts.toml``, with values for the names in braces."""
    text: str = _load_texts()["sentences"][name]
    return text.format(**values)


def glossary(result: str) -> list[tuple[str, str]]:
    """Return terms and definitions for a kind of result: "comparison", "analysis" or "limits"."""
    return list(_load_texts()["glossary"][result].items())


def column_meanings(table: str) -> list[tuple[str, str]]:
    """Return headings and meanings of the columns of a table, "laws" or "cases"."""
    return list(_load_texts()["columns"][table].items())


def table_notes(table: str) -> list[str]:
    """Return the notes of a table or page, by their name in ``texts.toml``."""
    return list(_load_texts()["notes"][table])


def figure_text(name: str, **values: object) -> tuple[str, str, str]:
    """Return title, caption and description of a figure.

    Args:
        name: of its report and of the figure, "comparison.force".
        values: that replace the names in braces.

    Returns:
        The texts; the description is empty where it is more than a sentence with values.
    """
    report, figure = name.split(".")
    text = _load_texts()["figures"][report][figure]
    description = text.get("description", "")
    return text["title"], text["caption"].format(**values), description.format(**values)


def sentence_case(name: str) -> str:
    """Return a name with a capital letter, for the beginning of a sentence or of a title."""
    return f"{name[:1].upper()}{name[1:]}"
