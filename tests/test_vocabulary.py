"""Names, docstrings, help and pages use the terms of the field.

``RETIRED`` maps each retired word to the term that replaces it. A new text that needs one of these
words in its ordinary sense is almost always clearer with another one.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import click
import pytest

from asperity.cli.main import COMMANDS, cli

ROOT = Path(__file__).parents[1]
RETIRED = {
    "foot": "closest point",
    "feet": "closest points",
    "look": "evaluation",
    "looks": "evaluations",
    "hopeless": "can_prune",
    "bend": "hessian_bound",
    "twist": "third_derivative_bound",
    "kept": "cached, stored",
    "anew": "again",
    "wish": "request",
    "wished": "requested",
    "wishes": "requests",
    "said": "message",
    "told": "reported",
    "asked": "requested",
    "heard": "acknowledged",
    "shelf": "clip store",
    "reel": "playback",
    "backdrop": "background",
    "workshop": "worker",
    "brisk": "speed",
    "restless": "cycling",
    "restlessness": "cycling",
    "shaken": "feels alive",
    "begun": "started",
    "stretch": "segment",
    "lacking": "missing",
    "spare": "prestarted",
    "bell": "wake-up pipe",
    "beginnings": "due times",
    "remade": "rebuilt",
}
"""Retired words in identifiers, whatever stands beside them: ``foot`` in ``next_foot``."""

PARTICIPLES = {"asked", "drawn", "given", "kept", "known", "made", "said", "shown", "told"}
"""Participles that do not say what a function, parameter, attribute or constant is."""

PHRASES = {
    "closest point": r"\bfoot\b|\bfeet\b",
    "evaluation": r"\blooks\b(?! (?:like|passive|for|at|up|into))",
    "again, recompute": r"\banew\b",
    "release the force": r"\bl(?:et|ets|etting) the force go\b|\bforce goes\b",
    "truncated": r"\bcut short\b",
    "recommended stiffness": r"\bto begin with\b|\bbegin at\b",
    "subnormal": r"\bnext to nothing\b",
    "user-defined": r"\bof one's own\b",
    "request": r"\bwish(?:es|ed)?\b",
    "docs/theory/PAGE.md, as the file is not in the repository": r"\bMATH(?:\.md)? sections?\b",
    "message, result": r"\bwhat (?:is|was|were|has been) (?:said|told|asked|wished|meant|given)\b",
}
"""Retired phrases in text, by what to write instead."""


def words_of(name: str) -> set[str]:
    """Return the lower-case words of an identifier."""
    return {word.lower() for word in re.split(r"_|(?<=[a-z0-9])(?=[A-Z])", name) if word}


def identifiers(text: str) -> Iterator[tuple[str, int, bool]]:
    """Yield the names that a source binds, their lines, and whether they are local variables."""
    tree = ast.parse(text)
    outer = {id(name) for node in tree.body for name in ast.walk(node) if _is_global(node)}
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name, node.lineno, False
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno, False
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno, id(node) not in outer
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno, False


def _is_global(node: ast.stmt) -> bool:
    return isinstance(node, (ast.Assign, ast.AnnAssign))


def retired_names(text: str) -> list[str]:
    """Return the retired names of a source, "name (line)"."""
    return [
        f"{name} ({line})"
        for name, line, is_local in identifiers(text)
        if words_of(name) & RETIRED.keys()
        or (name.strip("_").lower() in PARTICIPLES and not is_local)
    ]


def prose(text: str) -> Iterator[tuple[str, int]]:
    """Yield docstrings, other texts and comments of a source, with their first lines."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.STRING, tokenize.COMMENT) and " " in token.string:
            yield token.string, token.start[0]


def retired_phrases(text: str) -> list[str]:
    """Return the retired phrases of a text, "phrase -> what to write instead"."""
    return [
        f"{match[0]} -> {term}"
        for term, pattern in PHRASES.items()
        for match in re.finditer(pattern, text, re.I)
    ]


@cache
def sources() -> dict[str, str]:
    """Return the Python files of the package that people write, by path."""
    paths = (path for path in (ROOT / "src").rglob("*.py") if "generated" not in path.parts)
    return {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in paths}


def pages() -> list[Path]:
    """Return the pages of the documentation, and the texts of the reports."""
    generated = {"_build", "_generated", "gallery"}
    return [
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
        ROOT / "src/asperity/report/texts.toml",
        *(p for p in sorted((ROOT / "docs").rglob("*.md")) if not generated & {*p.parts}),
    ]


def test_no_identifier_has_a_retired_word() -> None:
    found = {path: names for path, text in sources().items() if (names := retired_names(text))}
    assert found == {}


def test_no_docstring_or_message_has_a_retired_phrase() -> None:
    found = [
        f"{path}:{line} {phrase}"
        for path, text in sources().items()
        for words, line in prose(text)
        for phrase in retired_phrases(words)
    ]
    assert found == []


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_has_a_retired_phrase(page: Path) -> None:
    assert retired_phrases(page.read_text("utf-8")) == []


SUMMARY_VERBS = {
    "Analyze",
    "Bake",
    "Calibrate",
    "Compare",
    "Compile",
    "Compute",
    "Convert",
    "Export",
    "Find",
    "List",
    "Measure",
    "Prepare",
    "Render",
    "Report",
    "Run",
    "Show",
    "Simulate",
    "Write",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_imperative_and_in_current_terms(name: str) -> None:
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    assert COMMANDS[name][1].split()[0].strip(",") in SUMMARY_VERBS
    for subcommand in (command, *getattr(command, "commands", {}).values()):
        text = subcommand.get_help(click.Context(subcommand, **cli.context_settings))
        assert retired_phrases(text) == []


@pytest.mark.parametrize("name", ["next_foot", "LookCost", "_kept", "SAID"])
def test_retired_name_is_detected(name: str) -> None:
    assert retired_names(f"{name} = 1\n") == [f"{name} (1)"]
    assert retired_names(f"def f({name}): ...\n") == [f"{name} (1)"]


def test_participle_is_detected_unless_it_is_a_local_name() -> None:
    assert retired_names("GIVEN = 1\ndef known(drawn):\n    made = drawn\n") == [
        "known (2)",
        "GIVEN (1)",
        "drawn (2)",
    ]


@pytest.mark.parametrize("name", ["outlook", "given_argument", "footer", "unknown_fields"])
def test_other_names_are_accepted(name: str) -> None:
    assert retired_names(f"{name} = 1\n") == []


def test_retired_phrase_is_detected() -> None:
    assert retired_phrases("The search is cut short.") == ["cut short -> truncated"]
    assert retired_phrases("It looks like a footnote.") == []
