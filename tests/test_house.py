"""Structure of the package: imports, seams, sizes and names.

A seam is a place where a newcomer adds one thing in one folder. It works only while no other folder
tests for a texture kind, contact, clamp or law. Each counter is tested on a short source.
"""

from __future__ import annotations

import ast
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src"
LETTERS = set("WABCDEFGH")
CONTACTS = {"nominal", "vertical", "nearest", "split"}
CLAMPS = {"none", "whole", "lateral", "backed"}


@cache
def parsed(text: str) -> ast.Module:
    return ast.parse(text)


@lru_cache(maxsize=1)
def modules() -> dict[str, str]:
    """Return the text of every module of the package by its dotted name."""
    found = {}
    for path in SOURCE.rglob("*.py"):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = path.read_text(encoding="utf-8")
    return found


def rooms_but(*rooms: str) -> dict[str, str]:
    """Return the modules outside these rooms."""
    inside = tuple(f"asperity.{room}." for room in rooms)
    return {name: text for name, text in modules().items() if not f"{name}.".startswith(inside)}


def found_in(texts: Mapping[str, str], counter: Callable[[str], list[int]]) -> list[str]:
    """Return the places that a counter finds, "module:line"."""
    return [f"{name}:{line}" for name, text in texts.items() for line in counter(text)]


# --- import circles ------------------------------------------------------------------------------


def imported(text: str, names: Mapping[str, str]) -> Iterator[str]:
    """Yield the modules that a module imports anywhere: at its top, in functions, for types."""
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if whole in names else node.module


def import_circles(texts: Mapping[str, str]) -> list[str]:
    """Return the modules from which imports lead back to themselves."""
    graph = {name: {m for m in imported(text, texts) if m in texts} for name, text in texts.items()}
    circles = []
    for name in sorted(graph):
        reached: set[str] = set()
        waiting = list(graph[name])
        while waiting:
            here = waiting.pop()
            if here not in reached:
                reached.add(here)
                waiting.extend(graph[here])
        if name in reached:
            circles.append(name)
    return circles


def hidden_imports(text: str) -> list[int]:
    """Return the lines that import a module of the package by a string."""
    return [
        node.lineno
        for node in ast.walk(parsed(text))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).endswith(("import_module", "__import__"))
        and isinstance(node.args[0], ast.Constant)
        and str(node.args[0].value).startswith("asperity")
    ]


def test_hidden_imports_are_counted() -> None:
    assert hidden_imports("import_module('asperity.report')\nimport_module('numba')") == [1]


def test_no_import_hides_in_a_string() -> None:
    assert found_in(modules(), hidden_imports) == []


def test_no_imports_go_in_a_circle() -> None:
    assert import_circles(modules()) == []


def test_a_circle_inside_functions_is_found() -> None:
    inside = {
        "a": "def f():\n    from b import g\n",
        "b": "if TYPE_CHECKING:\n    import c.d\n",
        "c.d": "from c import e\n",
        "c.e": "import a\n",
    }
    assert import_circles(inside) == ["a", "b", "c.d", "c.e"]
    assert import_circles(inside | {"c.e": "import b_b\n"}) == []


# --- who asks for a kind, a contact, a law -------------------------------------------------------


def kinds_of(*roots: str) -> set[str]:
    """Return the names of the classes that derive from classes of these names."""
    bases = {
        node.name: {base.id for base in node.bases if isinstance(base, ast.Name)}
        for text in modules().values()
        for node in ast.walk(parsed(text))
        if isinstance(node, ast.ClassDef)
    }
    kinds: set[str] = set()
    while more := {name for name, above in bases.items() if above & (kinds | {*roots})} - kinds:
        kinds |= more
    return kinds


def names_in(node: ast.AST) -> set[str]:
    """Return the names and the last parts of dotted names in an expression."""
    inside = list(ast.walk(node))
    found = {part.id for part in inside if isinstance(part, ast.Name)}
    return found | {part.attr for part in inside if isinstance(part, ast.Attribute)}


def asked_kinds(text: str, kinds: set[str]) -> list[int]:
    """Return the lines that ask whether something is of one of these classes.

    By ``isinstance``, by a comparison of its type or of the name of its class, or by a pattern.
    """
    lines = []
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Call) and names_in(node.func) & {"isinstance", "issubclass"}:
            asked = names_in(node.args[1]) & kinds
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            types = any(names_in(side) & {"type", "__name__", "__class__"} for side in sides)
            asked = (kinds & {*names_in(node), *constants_in(node)}) if types else set()
        elif isinstance(node, ast.MatchClass):
            asked = names_in(node.cls) & kinds
        else:
            continue
        if asked:
            lines.append(node.lineno)
    return lines


def constants_in(node: ast.AST) -> set[str]:
    """Return the texts in an expression."""
    inside = (part.value for part in ast.walk(node) if isinstance(part, ast.Constant))
    return {value for value in inside if isinstance(value, str)}


def asked_names(text: str, names: set[str], owners: set[str]) -> list[int]:
    """Return the lines that compare with one of these names, or look up what belongs to it.

    Args:
        text: source.
        names: that are compared with.
        owners: words by which the other side is known, such as ``contact`` in ``law.contact.name``;
            a comparison without one of them means something else.
    """
    lines = []
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            texts = set[str]().union(*(constants_in(side) for side in sides))
            meant = any(text in names or (text and set(text) <= names) for text in texts)
            known = any(names_in(side) & owners for side in sides)
        elif isinstance(node, ast.Subscript):
            table = node.value
            meant = isinstance(table, ast.Dict) and bool(constants_in(table) & names)
            known = bool(names_in(node.slice) & owners)
        elif isinstance(node, ast.MatchValue):
            meant, known = bool(constants_in(node) & names), True
        else:
            continue
        if meant and known:
            lines.append(node.lineno)
    return lines


def test_no_room_but_textures_asks_for_a_texture_kind() -> None:
    kinds = kinds_of("Texture")
    assert kinds >= {"Sinusoid", "Fourier", "Profile", "HeightMap", "Noise"}
    assert found_in(rooms_but("textures"), lambda text: asked_kinds(text, kinds)) == []


def test_no_room_but_the_simulation_asks_for_a_plant_or_a_hand() -> None:
    kinds = kinds_of("Plant", "Hand")
    assert kinds >= {"Cartesian", "Pantograph", "SpringHand", "BandHand", "PrescribedHand"}
    assert found_in(rooms_but("simulation"), lambda text: asked_kinds(text, kinds)) == []


@pytest.mark.parametrize(
    "text",
    [
        "if isinstance(texture, Sinusoid): ...",
        "if isinstance(texture, (int, textures.HeightMap)): ...",
        "if type(texture) is HeightMap: ...",
        "if type(texture).__name__ == 'Sinusoid': ...",
        "match texture:\n    case Sinusoid(): ...",
    ],
)
def test_a_question_for_a_kind_is_counted(text: str) -> None:
    assert len(asked_kinds(text, {"Sinusoid", "HeightMap"})) == 1
    assert asked_kinds(text, {"Fourier"}) == []


def test_making_a_texture_is_no_question() -> None:
    assert asked_kinds("flat = Sinusoid(0.0, 1.0)\nisinstance(x, float)\n", {"Sinusoid"}) == []


def asked_contacts(text: str) -> list[int]:
    return asked_names(text, CONTACTS, {"contact", "contact_name"})


def asked_clamps(text: str) -> list[int]:
    return asked_names(text, CLAMPS, {"clamp", "effective_clamp", "clamp_name"})


def asked_letters(text: str) -> list[int]:
    return asked_names(text, LETTERS, {"law", "letter", "laws", "letters", "LAWS", "find_law"})


def test_no_room_but_contacts_asks_for_a_contact() -> None:
    assert found_in(rooms_but("contacts"), asked_contacts) == []


def test_no_room_but_clamps_and_the_paper_asks_for_a_clamp() -> None:
    assert found_in(rooms_but("clamps", "paper"), asked_clamps) == []


@pytest.mark.parametrize(
    "text",
    [
        "if surface.effective_clamp == 'lateral': ...",
        "clamped = surface.clamp != 'none'",
        "if clamp in ('whole', 'backed'): ...",
        "depth = {'none': 1, 'whole': 2}[surface.clamp]",
    ],
)
def test_a_question_for_a_clamp_is_counted(text: str) -> None:
    assert len(asked_clamps(text)) == 1
    assert asked_clamps("if surface.effective_clamp.holds_whole_force: ...") == []


def test_no_room_but_laws_and_the_paper_asks_for_a_letter() -> None:
    assert found_in(rooms_but("laws", "paper"), asked_letters) == []


@pytest.mark.parametrize(
    "text",
    [
        "if law.contact.name == 'nominal': ...",
        "begins = 'nearest' != contact",
        "if law.contact.name in ('vertical', 'split'): ...",
        "cost = {'nominal': 1, 'split': 9}[contact.name]",
        "match contact.name:\n    case 'split': ...",
    ],
)
def test_a_question_for_a_contact_is_counted(text: str) -> None:
    assert len(asked_contacts(text)) == 1
    assert asked_letters(text) == []


@pytest.mark.parametrize(
    "text",
    [
        "if law.letter == 'F': ...",
        "if surface.law.letter in 'BC': ...",
        "if letter not in {'D', 'E'}: ...",
        "if surface.law is LAWS['H']: ...",
        "if law is find_law('H'): ...",
        "words = {'A': 'rough', 'B': 'smooth'}[law.letter]",
    ],
)
def test_a_question_for_a_letter_is_counted(text: str) -> None:
    assert len(asked_letters(text)) == 1
    assert asked_contacts(text) == []


@pytest.mark.parametrize(
    "text",
    [
        "if law.contact.costly: ...",
        "if side == 'nearest': ...",
        "find_law('B')",
        "if unit == 'A': ...",
    ],
)
def test_other_questions_are_not_counted(text: str) -> None:
    assert asked_contacts(text) == asked_letters(text) == []


# --- size, annotations, documentation ------------------------------------------------------------

LINES_AT_MOST = 39_500
"""Lines of code without docstrings, comments, blank lines and generated files."""


def functions(text: str) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(parsed(text)) if isinstance(node, ast.FunctionDef)]


def documented(node: ast.AST) -> bool:
    kinds = (ast.FunctionDef, ast.ClassDef, ast.Module)
    return isinstance(node, kinds) and ast.get_docstring(node) is not None


def lines_of_code(text: str) -> set[int]:
    """Return the numbers of the lines that hold code: no docstring, no comment, no blank."""
    lines = {
        number
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.strip().startswith("#")
    }
    for node in ast.walk(parsed(text)):
        if documented(node):
            said = node.body[0]
            lines -= set(range(said.lineno, said.end_lineno + 1))
    return lines


def body_lengths(text: str) -> list[int]:
    """Return the lines of code in the body of each function."""
    code = lines_of_code(text)
    return [
        len(code & set(range(node.body[0].lineno, (node.end_lineno or 0) + 1)))
        for node in functions(text)
    ]


def not_annotated(text: str) -> list[int]:
    """Return the lines of functions of which an argument or the result has no type."""
    lines = []
    for node in functions(text):
        given = node.args
        arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        bare = [a for a in arguments if a is not None and a.annotation is None]
        if node.returns is None or any(a.arg not in {"self", "cls"} for a in bare):
            lines.append(node.lineno)
    return lines


def not_documented(text: str) -> list[int]:
    """Return the lines of modules, public classes and their public functions without words."""
    tree = parsed(text)
    lines = [] if documented(tree) else [1]
    waiting: list[ast.stmt] = list(tree.body)
    for node in waiting:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
            if not documented(node) and "overload" not in names_in(ast.List(node.decorator_list)):
                lines.append(node.lineno)
            waiting.extend(node.body if isinstance(node, ast.ClassDef) else [])
    return lines


def written() -> dict[str, str]:
    """Return the modules that people write."""
    return rooms_but("derive.generated")


def test_the_code_does_not_grow_unnoticed() -> None:
    stub = (SOURCE / "asperity" / "__init__.pyi").read_text(encoding="utf-8")
    lines = sum(len(lines_of_code(text)) for text in [stub, *written().values()])
    assert lines <= LINES_AT_MOST


def test_functions_are_short() -> None:
    lengths = sorted(length for text in written().values() for length in body_lengths(text))
    assert statistics.median(lengths) <= 5
    assert lengths[int(0.9 * len(lengths))] <= 16
    assert lengths[-1] <= 45


def test_every_function_is_annotated_and_documented() -> None:
    assert found_in(written(), not_annotated) == []
    assert found_in(written(), not_documented) == []


SHORT = '''
"""A module."""

# A comment.
class Room:
    """A class."""

    def area(self, width: float) -> float:
        """Return it."""
        # Why.
        side = width

        return side * width

    def bare(self, width):
        return width


def _own(): ...
'''


def test_lines_of_code_are_counted() -> None:
    assert len(lines_of_code(SHORT)) == 7
    assert sorted(body_lengths(SHORT)) == [1, 1, 2]
    assert sorted(not_annotated(SHORT)) == [15, 19]
    assert not_documented(SHORT) == [15]
    assert not_documented("x = 1") == [1]


# --- one name, one thing; rooms of a size worth entering -----------------------------------------


MAX_FILES = 15


def repeated(names: Iterator[str]) -> list[str]:
    """Return the names that occur more than once."""
    return sorted(name for name, count in Counter(names).items() if count > 1)


def public_classes(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the names of the public classes."""
    for text in texts.values():
        for node in ast.walk(parsed(text)):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                yield node.name


def file_names(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the last parts of the modules' names, packages apart."""
    packages = {name.rpartition(".")[0] for name in texts}
    yield from (name.rpartition(".")[2] for name in texts if name not in packages)


def wide_rooms(texts: Mapping[str, str]) -> dict[str, int]:
    """Return the packages with too many files, ``__init__.py`` counted."""
    packages = {name.rpartition(".")[0] for name in texts}
    rooms = Counter(name if name in packages else name.rpartition(".")[0] for name in texts)
    return {room: count for room, count in rooms.items() if count > MAX_FILES}


def test_a_name_stands_for_one_thing() -> None:
    assert repeated(public_classes(written())) == []
    assert repeated(file_names(written())) == []


def test_rooms_have_at_most_fifteen_files() -> None:
    assert wide_rooms(written()) == {}


def test_repeated_names_and_wide_rooms_are_found() -> None:
    texts = {"a": "", "a.b": "class X: ...", "a.c": "class X: ...\nclass _Y: ...", "d.b": ""}
    assert repeated(public_classes(texts)) == ["X"]
    assert repeated(file_names(texts)) == ["b"]
    assert wide_rooms({f"a.m{i}": "" for i in range(16)}) == {"a": 16}
