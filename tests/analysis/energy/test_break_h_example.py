"""The example script that tests law H: H passes all statements, other laws and a wrong H fail."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from rich.console import Console

from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

SCRIPT = Path(__file__).parents[3] / "examples" / "break_h.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("break_h", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_law_h_passes_and_each_statement_fails_for_another_law(script: ModuleType) -> None:
    case = script.make_case(Sinusoid(amplitude=0.4e-3, period=1e-3, direction=(1.0, 2.0)), seed=3)
    statements = script.run([case], Console(quiet=True))
    assert len(statements) == len(script.TRIALS) == 11
    for statement in statements:
        assert not statement.breaks("H"), statement
        assert any(statement.breaks(law) for law in statement.numbers if law != "H"), statement
    table = script.table_of(statements)
    assert table.row_count == 11


def test_small_force_error_is_detected(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """A force that is too large by 1e-5 violates the Lipschitz constant."""
    intact = Surface.force

    def wrong(self: Surface, points: np.ndarray) -> np.ndarray:
        force = intact(self, points)
        return force * (1.0 + 1e-5) if self.law.letter == "H" else force

    case = script.make_case(Sinusoid(amplitude=0.4e-3, period=1e-3), seed=3)
    assert not script.lipschitz(case).breaks("H")
    monkeypatch.setattr(Surface, "force", wrong)
    assert script.lipschitz(case).breaks("H")
    assert script.flat_wall(case).breaks("H")
    assert script.equals_god_object(case).breaks("H")


def test_nan_breaks_a_statement(script: ModuleType) -> None:
    statement = script.Statement("words", 1.0)
    statement.record("H", 0.5)
    assert not statement.breaks("H")
    statement.record("H", float("nan"))
    assert statement.breaks("H")
