"""All experiments in one go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from asperity.files import plain
from asperity.paper.experiments.beyond import BeyondExperiment, beyond_experiment
from asperity.paper.experiments.bump import BumpExperiment, bump_experiment
from asperity.paper.experiments.passivity import PassivityExperiment, passivity_experiment
from asperity.paper.experiments.scanning import ScanningExperiment, scanning_experiment
from asperity.paper.experiments.settings import RESOLUTION
from asperity.textures.texture import Texture
from asperity.units import engineering

STEPS = (
    "experiment V.A: who cycles",
    "experiment V.B: what a stroke gains",
    "experiment V.C: the bump",
    "other devices and surfaces",
)


@dataclass(frozen=True)
class Experiments:
    """What the simulated experiments gave.

    Attributes:
        passivity: section V.A, with the onsets of all laws.
        scanning: section V.B.
        bump: section V.C.
        beyond: other devices and surfaces.
    """

    passivity: PassivityExperiment
    scanning: ScanningExperiment
    bump: BumpExperiment
    beyond: BeyondExperiment

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return plain(
            {"V.A": self.passivity, "V.B": self.scanning, "V.C": self.bump, "beyond": self.beyond}
        )

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Name and result of each experiment, in words."""
        return (
            ("V.A", self._cycles()),
            ("V.A onsets", self._onsets()),
            ("V.B", self._strokes()),
            ("V.C", self._bumps()),
            ("devices", self._devices()),
        )

    def _cycles(self) -> str:
        parts = [
            f"{one.law}{'' if one.divisor == 1.0 else f'/{one.divisor:g}'} {one.cycles}"
            for one in self.passivity.counts
        ]
        first = self.passivity.counts[0]
        return (
            f"of {first.starts} starts cycle at 2000 N/m and a lag of {first.delay} samples: "
            f"{', '.join(parts)}"
        )

    def _onsets(self) -> str:
        return f"{self._below_the_rule()}; {self._below_the_wall()}"

    def _below_the_wall(self) -> str:
        """Say how often a texture cycles below the wall's own onset over q."""
        textured = [one for one in self.passivity.onsets if one.wall_rule and not one.onset.wall]
        missed = sum(one.wall_rule_missed for one in textured)
        # What cycles at the least stiffness that was tried may cycle below it.
        open_cases = sum(one.onset.quiet == 0.0 and not one.wall_rule_missed for one in textured)
        unknown = f", unknown in {open_cases}" if open_cases else ""
        return f"below K0/q of the wall's own onset in {missed} of {len(textured)} cases{unknown}"

    def _below_the_rule(self) -> str:
        found = self.passivity.onsets
        missed = [f"{one.onset.law} at d = {one.onset.delay}" for one in found if one.missed]
        cases = sum(one.conservative for one in found)
        if not missed:
            return f"no limit cycle below the delay rule in {cases} cases of conservative laws"
        return (
            f"limit cycles below the delay rule in {len(missed)} of {cases} cases of conservative "
            f"laws, with steps of the encoder of {engineering(RESOLUTION, 'm')}; it is proved for "
            f"exact positions: {', '.join(missed)}"
        )

    def _strokes(self) -> str:
        laws = list(dict.fromkeys(one.stroke.law for one in self.scanning.strokes))
        parts = []
        for law in laws:
            strokes = self.scanning.of(law)
            parts.append(f"{law} {sum(one.feeds for one in strokes)}")
        return f"of {len(strokes)} hands and speeds the field feeds: {', '.join(parts)}"

    def _bumps(self) -> str:
        parts = [f"{one.law} {1e3 * one.total:+.3g} mJ ({one.entry})" for one in self.bump.bumps]
        return ", ".join(parts)

    def _devices(self) -> str:
        found = self.beyond.onsets
        missed = sum(one.missed for one in found)
        rules = sum(one.prediction.missed for one in found)
        return (
            f"{missed} of {len(found)} cases cycle at a stiffness that the catalogue's K0/q "
            f"allows, {rules} below the delay rule"
        ) + (f"; {self.beyond.how_far}" if self.beyond.how_far else "")


def run_experiments(
    measured: Texture | None = None, progress: Callable[[str], None] | None = None
) -> Experiments:
    """Return all experiments; one to three minutes on two processors.

    Args:
        measured: a surface for the last one; without it a drawn one takes its place.
        progress: is told the name of each step when it begins.
    """
    begin = progress or (lambda _step: None)
    begin(STEPS[0])
    passivity = passivity_experiment()
    begin(STEPS[1])
    scanning = scanning_experiment()
    begin(STEPS[2])
    bump = bump_experiment()
    begin(STEPS[3])
    return Experiments(passivity, scanning, bump, beyond_experiment(measured))
