"""User-defined modules are sent to the loop's process with the objects that need them."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from asperity.cli.plugins import _execute
from asperity.servo.process import _pickle

BESIDE = "FACTOR = 3.0\n"
PLUGIN = """
from dataclasses import dataclass

from beside_it import FACTOR

@dataclass
class Thing:
    value: float

    def times(self):
        return FACTOR * self.value
"""
CHILD = """
import pickle
import sys
from asperity.servo.loop_process import unpickle
before = list(sys.path)
thing = unpickle(*pickle.load(sys.stdin.buffer))
print(thing.times(), sys.path == before)
"""


def test_pickled_object_carries_only_its_own_plugin_module(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, source in (("beside_it", BESIDE), ("thing", PLUGIN), ("unneeded", "")):
        (tmp_path / f"{name}.py").write_text(source)
        monkeypatch.setitem(sys.modules, f"plugin_{name}", None)  # removed again at teardown
    monkeypatch.delitem(sys.modules, "beside_it", raising=False)
    thing, _ = (
        _execute(str(tmp_path / f"{name}.py"), source.encode())
        for name, source in (("thing", PLUGIN), ("unneeded", ""))
    )
    packed = _pickle(thing.Thing(2.0))
    assert packed[0] == (("plugin_thing", str(tmp_path / "thing.py")),)
    child = subprocess.run(
        [sys.executable, "-c", CHILD], input=pickle.dumps(packed), capture_output=True, check=True
    )
    assert child.stdout.decode().split() == ["6.0", "True"]
