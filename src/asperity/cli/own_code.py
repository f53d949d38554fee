"""``--law-module``: what the user's own Python file defines: laws, textures, criteria, claims.

Only the command line names such a file: whoever types the command runs the code. What it defines
is known until the command ends.
"""

from __future__ import annotations

import ast
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import click

from asperity.errors import AsperityError, ParameterError
from asperity.files import open_input

OPTION = "law_module"
_FILES: list[str] = []  # that were run


@dataclass(frozen=True)
class Registry:
    """Where things of a kind are known by name.

    Attributes:
        kind: of the things; ``None`` where a file must call ``register`` itself.
        register: adds one, and refuses a name that is taken.
        known: the things by name.
        check: refuses one that cannot be used.
    """

    kind: type | None
    register: Callable[..., Any]
    known: dict[str, Any]
    check: Callable[[Any], Any] = lambda _thing: None

    def takes(self, value: Any) -> bool:
        """Return whether a value of the file is to be registered here."""
        ours = self.kind is not None and isinstance(value, self.kind)
        return ours and all(value is not known for known in self.known.values())


def registries() -> tuple[Registry, ...]:
    """Return where what a file defines becomes known."""
    from asperity import laws
    from asperity.analysis.passivity import criteria
    from asperity.derive.jacobian import symbolic_force
    from asperity.measured.reading import Reader
    from asperity.measured.reading import registry as readers
    from asperity.paper import registry
    from asperity.paper.claim import Claim
    from asperity.servo.drivers import choice
    from asperity.servo.drivers.driver import DriverKind
    from asperity.textures import catalogue
    from asperity.textures.texture import Kind

    return (
        Registry(laws.Law, laws.register, laws.KNOWN_LAWS, symbolic_force),
        Registry(Kind, catalogue.register, catalogue.CATALOGUE),
        Registry(Reader, readers.register, readers.OWN),
        Registry(Claim, registry.register, registry.CLAIMS),
        # A criterion is a function: the file gives it its name by calling register.
        Registry(None, criteria.register, criteria.CRITERIA),
        Registry(DriverKind, choice.register, choice.KINDS),
    )


def load_own_code(ctx: click.Context, _option: click.Parameter, files: tuple[str, ...]) -> None:
    """Run the files and register what they define, until the command ends.

    Raises:
        ParameterError: for a file that cannot be read or run, with line and reason, one that
            defines nothing, or a name that is taken.
    """
    if not files:
        return
    places = registries()
    for place in places:
        ctx.find_root().with_resource(_restored(place.known))
    for file in files:
        _load(file, places)


@contextmanager
def _restored(table: dict[str, Any]) -> Iterator[None]:
    before = dict(table)
    try:
        yield
    finally:
        table.clear()
        table.update(before)


def own_files() -> tuple[str, ...]:
    """Return the files that were run."""
    return tuple(dict.fromkeys(_FILES))


def own_contents() -> dict[str, bytes]:
    """Return what is in the files that were run, by names that can stand in one folder."""
    contents: dict[str, bytes] = {}
    for file in own_files():
        name = Path(file).name
        contents[name if name not in contents else f"{len(contents)}_{name}"] = _source(file)
    return contents


def learn(files: tuple[str, ...]) -> None:
    """Run files and register what they define, in a process that another command has started."""
    for file in files:
        _load(file, registries())


def _load(file: str, places: tuple[Registry, ...]) -> None:
    before = sum(len(place.known) for place in places)
    source = _source(file)
    with _refusing(file):
        tree = ast.parse(source, file)
        module = _run(file, source)
    for name, value in vars(module).items():
        for place in places:
            if place.takes(value):
                with _refusing(file, _line(tree, name)):
                    place.register(value)
                    place.check(value)
    if sum(len(place.known) for place in places) == before:
        kinds = ", ".join(place.kind.__name__ for place in places if place.kind is not None)
        raise ParameterError(OPTION, f"{file} defines none of these at its top level: {kinds}")


def _source(file: str) -> bytes:
    try:
        with open_input(file, 2**24) as stream:
            return stream.read()
    except (OSError, ValueError) as error:  # ValueError: of an impossible path
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError(OPTION, f"{file} cannot be read: {reason}") from None


def _run(file: str, source: bytes) -> ModuleType:
    """Run a file as a module that can import its neighbours, as ``python FILE`` would."""
    _FILES.append(file)
    path = Path(file).resolve()
    module = ModuleType(f"own_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(path.parent))
    try:
        exec(compile(source, file, "exec"), vars(module))
    finally:
        sys.path.remove(str(path.parent))
    return module


@contextmanager
def _refusing(file: str, line: int = 1) -> Iterator[None]:
    """Turn whatever the user's code raises into one line: file, line and reason."""
    try:
        yield
    except (Exception, SystemExit) as error:
        at = _line_of(error, file) or line
        raise ParameterError(OPTION, f"{file}, line {at}: {_reason(error)}") from error


def own_fault(error: BaseException) -> str | None:
    """Return what to say of an error that the user's own code has raised; None if it has not."""
    lines = {file: _line_of(error, file) for file in _FILES}
    said = [f"{file}, line {line}: {_reason(error)}" for file, line in lines.items() if line]
    return said[0] if said else None


def _reason(error: BaseException) -> str:
    said = error.msg if isinstance(error, SyntaxError) else str(error)
    kind = "" if isinstance(error, AsperityError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{said}".split())


def _line_of(error: BaseException | None, file: str) -> int | None:
    """Return the line of the file at which an error, or what caused it, was raised."""
    if error is None:
        return None
    if isinstance(error, SyntaxError) and error.filename == file:
        return error.lineno
    frames = traceback.extract_tb(error.__traceback__)
    here = (frame.lineno for frame in reversed(frames) if frame.filename == file)
    return next(here, None) or _line_of(error.__cause__, file)


def _line(tree: ast.Module, name: str) -> int:
    """Return the line at which a name is assigned."""
    for node in tree.body:
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            return node.lineno
    return 1
