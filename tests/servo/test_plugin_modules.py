"""What of a user's own files goes to the loop's process."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from asperity.cli.plugins import _execute
from asperity.servo.process import _pickle

BESIDE = "FACTOR = 3.0\n"
OWN = """
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
from asperity.servo.driver_loop import unpickle
before = list(sys.path)
thing = unpickle(*pickle.load(sys.stdin.buffer))
print(thing.times(), sys.path == before)
"""


def test_a_thing_arrives_with_its_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, source in (("beside_it", BESIDE), ("thing", OWN), ("unneeded", "")):
        (tmp_path / f"{name}.py").write_text(source)
        monkeypatch.setitem(sys.modules, f"plugin_{name}", None)  # forgotten afterwards
    monkeypatch.delitem(sys.modules, "beside_it", raising=False)
    thing, _ = (_execute(str(tmp_path / f"{name}.py"), source.encode())
                for name, source in (("thing", OWN), ("unneeded", "")))  # fmt: skip
    packed = _pickle(thing.Thing(2.0))
    assert packed[0] == (("plugin_thing", str(tmp_path / "thing.py")),)
    child = subprocess.run(
        [sys.executable, "-c", CHILD], input=pickle.dumps(packed), capture_output=True, check=True
    )
    assert child.stdout.decode().split() == ["6.0", "True"]
