"""A witness above a proved bound raises ``InternalError``; an excess within rounding does not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis.bounds.bound import NORM, Witness, checked_lower_bound, checked_upper_bound
from asperity.analysis.energy import leak as leaks
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.gain import medial_axis as search
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.theorems import THEOREMS, ClosedForm, Constant, Theorem
from asperity.core.errors import AsperityError, InternalError
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid

WAVE = Sinusoid(amplitude=0.1e-3, period=1e-3)
WAVES = Fourier([1e-4, 5e-5], [[3000.0, 0.0], [6000.0, 0.0]], [0.3, 1.0])
HEIGHTS = 5e-5 * np.random.default_rng(3).normal(size=(7, 7))


class UnderstatedFourier(Fourier):
    """Waves that declare half of their true slope and Hessian bounds."""

    @property
    def bounds(self) -> tuple[float, float]:
        slope, hessian = super().bounds
        return 0.5 * slope, 0.5 * hessian


def copy_of(letter: str) -> Law:
    law = LAWS[letter]
    return Law("copy", "copy", law.contact, law.force)


def test_understated_texture_bounds_are_detected() -> None:
    # Five independent waves are not certified: their bound uses the declared derivatives.
    waves = [1e-4, 5e-5, 4e-5, 3e-5, 2e-5]
    vectors = [[3000.0, 0.0], [0.0, 5000.0], [1234.0, 777.0], [-500.0, 2222.0], [1777.0, -3210.0]]
    correct, understated = Fourier(waves, vectors), UnderstatedFourier(waves, vectors)
    assert characteristic_number(Surface(correct, "A")).upper > 1.0
    with pytest.raises(InternalError) as caught:
        characteristic_number(Surface(understated, "A"))
    text = str(caught.value)
    for part in ("norm", "law='A'", "proved to be at most", "is attained at (", "report"):
        assert part in text
    assert "deflection" not in text
    assert isinstance(caught.value, AsperityError)


def test_wrong_jacobian_kernel_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Jacobians too large by 1e-6 contradict the bounds of branch and bound."""
    surface = Surface(WAVES, "B")
    assert characteristic_number(surface).method == "certified"
    intact = Surface.jacobian

    def scaled_jacobian(self: Surface, *arguments: Any) -> Any:
        return (1.0 + 1e-6) * intact(self, *arguments)

    monkeypatch.setattr(Surface, "jacobian", scaled_jacobian)
    with pytest.raises(InternalError, match="norm"):
        characteristic_number(surface)
    with pytest.raises(InternalError, match="one-sided"):
        one_sided_number(Surface(WAVE, "D"))


def test_wrong_theorem_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    constant, closed = copy_of("W"), copy_of("A")
    monkeypatch.setitem(THEOREMS, constant, Theorem({NORM: Constant(0.999, "wrong")}))
    form = ClosedForm(lambda _wave, _depth: 1.1, lambda _wave, _depth: 0.0)
    monkeypatch.setitem(THEOREMS, closed, Theorem(closed_forms={NORM: form}))
    for law in (constant, closed):
        with pytest.raises(InternalError):
            characteristic_number(Surface(WAVE, law))


def test_understated_crest_bound_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = Surface(WAVES, "D", max_depth=3e-4)
    assert characteristic_number(surface).upper > 1.0
    intact = search.supremum

    def scaled_down(*arguments: Any) -> Any:
        result = intact(*arguments)
        return replace(result, upper=0.999 * result.upper)

    monkeypatch.setattr(search, "supremum", scaled_down)
    with pytest.raises(InternalError, match="norm"):
        characteristic_number(surface)


def test_crest_without_proved_bound_gives_a_sampled_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that ends without a bound raises no error and gives an infinite upper bound."""
    intact = search.supremum
    monkeypatch.setattr(
        search,
        "supremum",
        lambda *arguments, **options: replace(intact(*arguments, **options), upper=math.inf),
    )
    bound = characteristic_number(Surface(WAVES, "D", max_depth=3e-4))
    assert (bound.method, bound.upper) == ("sampled", math.inf)
    assert bound.lower == pytest.approx(2.1244, rel=1e-4)


LEAKING = {
    "wave, A": (WAVE, "A"),
    "waves, G": (WAVES, "G"),
    "profile, B": (Profile(HEIGHTS[0], 3e-4, periodic=False), "B"),
    "map, A": (HeightMap(HEIGHTS, 3e-4), "A"),
}


@pytest.mark.parametrize("case", LEAKING.values(), ids=list(LEAKING))
def test_loop_energy_above_its_proved_bound_is_detected(
    case: tuple[Any, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    surface = Surface(*case)
    x, y = surface.texture.scan_line().direction
    correct = worst_loop(surface, (x, y))
    assert 0.9 * correct.upper_per_period < correct.energy <= correct.upper_per_period
    intact, share = leaks.curl_columns.curl_integral_bounds, [0.8]

    def scaled_down(*arguments: Any) -> Any:
        result = intact(*arguments)
        assert result is not None
        return [(share[0] * low, share[0] * high) for low, high in result]

    monkeypatch.setattr(leaks.curl_columns, "curl_integral_bounds", scaled_down)
    with pytest.raises(InternalError, match="gains"):
        worst_loop(surface, (x, y))
    share[0] = correct.energy / correct.upper_per_period * (1.0 - 1e-12)  # that much is rounding
    rounded = worst_loop(surface, (x, y))
    assert rounded.energy <= rounded.upper_per_period == pytest.approx(correct.energy, rel=1e-11)


def test_rounding_error_is_not_a_contradiction() -> None:
    surface = Surface(WAVE, "A")
    for excess in (-1e-3, 0.0, 1e-15, 1e-12):
        witness = Witness(2.0 * (1.0 + excess), 2.0, (0.0, 0.0, -1e-5))
        assert checked_upper_bound(surface, NORM, 2.0, witness) == max(2.0, witness.value)
    witness = Witness(2.0 * (1.0 + 1e-7), 2.0, (0.0, 0.0, -1e-5))
    with pytest.raises(InternalError):
        checked_upper_bound(surface, NORM, 2.0, witness)
    with pytest.raises(InternalError):
        checked_lower_bound(surface, NORM, 2.0, witness)


def test_command_line_returns_the_exit_code_of_internal_errors(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from asperity.cli import main as commands

    def contradict(**_options: Any) -> None:
        raise InternalError("proved to be at most 1, but 2 is attained")

    monkeypatch.setattr(commands, "cli", contradict)
    with pytest.raises(SystemExit) as stop:
        commands.main()
    assert stop.value.code == InternalError.exit_code
    assert "at most 1, but 2" in capsys.readouterr().err
