"""Plugins: files of the option ``--plugin``, and modules that installed packages declare.

They define laws, textures, readers, drivers and more. Only the command line names files, and only
an installed package declares an entry point of the group ``asperity.plugins``: the user decides
which code runs. What a plugin defines is registered until the command ends.
"""

from __future__ import annotations

import ast
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import EntryPoints, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

import click

from asperity.core.errors import AsperityError, ParameterError, print_message
from asperity.core.files import open_input
from asperity.core.version import PLUGIN_GROUP

_OPTION = "plugin"
_LOADED_FILES: list[str] = []


@dataclass(frozen=True)
class PluginRegistry:
    """A registry that plugins add to.

    Attributes:
        entries: the registered objects.
        plugin_type: type of the objects that are registered when a file defines them at its top
            level; ``None`` where the file must call a function.
        register: registers an object.
        check: raises an error for an object that cannot be used.
    """

    entries: dict[Any, Any]
    plugin_type: type | None = None
    register: Callable[..., Any] = lambda _object: None
    check: Callable[[Any], Any] = lambda _object: None

    def accepts(self, value: Any) -> bool:
        """Return whether a value of a file is to be registered."""
        matches = self.plugin_type is not None and isinstance(value, self.plugin_type)
        return matches and all(value is not entry for entry in self.entries.values())

    def snapshot(self) -> dict[Any, Any]:
        """Return a copy of the entries."""
        return {
            key: value.copy() if isinstance(value, list) else value
            for key, value in self.entries.items()
        }

    def restore(self, entries: dict[Any, Any]) -> None:
        """Replace the entries by those of a snapshot."""
        self.entries.clear()
        self.entries.update(entries)


def plugin_registries() -> tuple[PluginRegistry, ...]:
    """Return all registries."""
    from asperity import laws
    from asperity.analysis.passivity.criteria import CRITERIA
    from asperity.derive.derivatives import symbolic_force
    from asperity.measured.reading import Reader, readers
    from asperity.servo.driver import DriverKind
    from asperity.servo.drivers import driver_registry
    from asperity.textures import catalogue
    from asperity.textures.texture import TextureKind

    return (
        PluginRegistry(laws.REGISTERED_LAWS, laws.Law, laws.register, symbolic_force),
        PluginRegistry(catalogue.CATALOGUE, TextureKind, catalogue.register),
        PluginRegistry(readers.USER_READERS, Reader, readers.register),
        PluginRegistry(driver_registry.DRIVER_KINDS, DriverKind, driver_registry.register_driver),
        PluginRegistry(CRITERIA),
    )


def load_plugins(ctx: click.Context, _option: click.Parameter, files: tuple[str, ...]) -> None:
    """Register what installed plugins and files define until the command ends.

    Raises:
        ParameterError: for a file that cannot be read or run, with line and reason, that
            registers nothing, or that uses a name that is taken.
    """
    installed = entry_points(group=PLUGIN_GROUP)
    if not (files or installed):
        return
    registries = plugin_registries()
    for registry in registries:
        ctx.find_root().call_on_close(partial(registry.restore, registry.snapshot()))
    _load_installed(installed, registries)
    for file in files:
        _load_plugin(file, registries)


def has_plugins() -> bool:
    """Return whether a file was run, or a plugin is installed."""
    return bool(_LOADED_FILES or entry_points(group=PLUGIN_GROUP))


def plugin_files() -> tuple[str, ...]:
    """Return the files that were run."""
    return tuple(dict.fromkeys(_LOADED_FILES))


def load_plugin_files(files: tuple[str, ...]) -> None:
    """Register what installed plugins and files define, in a worker process."""
    if has_plugins():
        _load_installed(entry_points(group=PLUGIN_GROUP), plugin_registries())
    for file in files:
        _load_plugin(file, plugin_registries())


def _load_installed(installed: EntryPoints, registries: tuple[PluginRegistry, ...]) -> None:
    """Register what modules define; one that fails is named in a message and is not used."""
    for entry in installed:
        try:
            for value in vars(entry.load()).values():
                for registry in registries:
                    if registry.accepts(value):
                        registry.register(value)
        except (Exception, SystemExit) as error:
            print_message(f"the installed plugin {entry.value} fails: {_error_text(error)}")


def _load_plugin(file: str, registries: tuple[PluginRegistry, ...]) -> None:
    before = [registry.snapshot() for registry in registries]
    source = _read_source(file)
    with _as_parameter_error(file):
        tree = ast.parse(source, file)
        module = _execute(file, source)
    for name, value in vars(module).items():
        for registry in registries:
            if registry.accepts(value):
                with _as_parameter_error(file, _line_of_assignment(tree, name)):
                    registry.register(value)
                    registry.check(value)
    if before == [registry.entries for registry in registries]:
        types = [registry.plugin_type for registry in registries]
        names = ", ".join(kind.__name__ for kind in types if kind is not None)
        fault = f"{file} registers nothing: no {names} at its top level, no register_criterion call"
        raise ParameterError(_OPTION, fault)


def _read_source(file: str) -> bytes:
    try:
        with open_input(file, 2**24) as stream:
            return stream.read()
    except (OSError, ValueError) as error:  # ValueError: an impossible path
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError(_OPTION, f"{file} cannot be read: {reason}") from None


def _execute(file: str, source: bytes) -> ModuleType:
    """Run a file as a module that can import its neighbours, as ``python FILE`` does."""
    _LOADED_FILES.append(file)
    path = Path(file).resolve()
    module = ModuleType(f"plugin_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(path.parent))
    try:
        exec(compile(source, file, "exec"), vars(module))
    finally:
        sys.path.remove(str(path.parent))
    return module


@contextmanager
def _as_parameter_error(file: str, line: int = 1) -> Iterator[None]:
    """Convert any error of user code into one line with file, line and reason."""
    try:
        yield
    except (Exception, SystemExit) as error:
        at = _line_in_file(error, file) or line
        raise ParameterError(_OPTION, f"{file}, line {at}: {_error_text(error)}") from error


def plugin_error_text(error: BaseException) -> str | None:
    """Return the message for an error that was raised in a plugin; ``None`` for other errors."""
    for file in _LOADED_FILES:
        if line := _line_in_file(error, file):
            return f"{file}, line {line}: {_error_text(error)}"
    return None


def _error_text(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    kind = "" if isinstance(error, AsperityError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{text}".split())


def _line_in_file(error: BaseException | None, file: str) -> int | None:
    """Return the line of a file at which an error, or its cause, was raised."""
    if error is None:
        return None
    if isinstance(error, SyntaxError) and error.filename == file:
        return error.lineno
    frames = traceback.extract_tb(error.__traceback__)
    lines = (frame.lineno for frame in reversed(frames) if frame.filename == file)
    return next(lines, None) or _line_in_file(error.__cause__, file)


def _line_of_assignment(tree: ast.Module, name: str) -> int:
    for node in tree.body:
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            return node.lineno
    return 1
