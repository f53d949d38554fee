"""All simulated experiments and their one-line summaries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from asperity.core.files import to_plain_data
from asperity.core.units import format_quantity
from asperity.paper.experiments import strokes
from asperity.paper.experiments.cycle_counts import PassivityExperiment, passivity_experiment
from asperity.paper.experiments.device_onsets import DeviceExperiment, device_experiment
from asperity.paper.experiments.experiment_setups import RESOLUTION
from asperity.textures.texture import Texture

STEPS = (
    "experiment V.A: limit cycles",
    "experiment V.B: energy per stroke",
    "experiment V.C: the bump",
    "further devices and surfaces",
)


@dataclass(frozen=True)
class Experiments:
    """Results of the simulated experiments.

    Attributes:
        passivity: section V.A, with the onsets of all laws.
        scanning: section V.B.
        bump: section V.C.
        devices: further devices and surfaces.
    """

    passivity: PassivityExperiment
    scanning: strokes.ScanningExperiment
    bump: strokes.BumpExperiment
    devices: DeviceExperiment

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return to_plain_data(
            {"V.A": self.passivity, "V.B": self.scanning, "V.C": self.bump, "beyond": self.devices}
        )

    @property
    def summary_lines(self) -> tuple[tuple[str, str], ...]:
        """Name and result of each experiment, in words."""
        return (
            ("V.A", self._summarize_cycles()),
            ("V.A onsets", f"{self._summarize_delay_rule()}; {self._summarize_wall_rule()}"),
            ("V.B", self._summarize_strokes()),
            ("V.C", self._summarize_bumps()),
            ("devices", self._summarize_devices()),
        )

    def _summarize_cycles(self) -> str:
        parts = [f"{one.wall} {one.cycles}" for one in self.passivity.counts]
        first = self.passivity.counts[0]
        return (
            f"of {first.starts} starts cycle at 2000 N/m and a lag of {first.delay} samples: "
            f"{', '.join(parts)}"
        )

    def _summarize_wall_rule(self) -> str:
        """Count the textures that cycle below the wall's own onset over q."""
        textured = [
            one for one in self.passivity.onsets if one.wall_rule and not one.onset.is_smooth_wall
        ]
        missed = sum(one.violates_wall_rule for one in textured)
        # A wall that cycles at the least stiffness tried may also cycle below it.
        open_cases = sum(one.onset.quiet == 0.0 and not one.violates_wall_rule for one in textured)
        unknown = f", unknown in {open_cases}" if open_cases else ""
        return f"below K0/q of the wall's own onset in {missed} of {len(textured)} cases{unknown}"

    def _summarize_delay_rule(self) -> str:
        found = self.passivity.onsets
        missed = [
            f"{one.onset.law} at d = {one.onset.delay}" for one in found if one.violates_delay_rule
        ]
        cases = sum(one.conservative for one in found)
        if not missed:
            return f"no limit cycle below the delay rule in {cases} cases of conservative laws"
        return (
            f"limit cycles below the delay rule in {len(missed)} of {cases} cases of conservative "
            f"laws, with steps of the encoder of {format_quantity(RESOLUTION, 'm')}; it is proved "
            f"for exact positions: {', '.join(missed)}"
        )

    def _summarize_strokes(self) -> str:
        counts: dict[str, list[bool]] = {}
        for one in self.scanning.strokes:
            counts.setdefault(one.stroke.law, []).append(one.stroke.gains_energy)
        parts = [f"{law} {sum(gains)}" for law, gains in counts.items()]
        total = max(map(len, counts.values()))
        return f"of {total} hands and speeds the field supplies energy: {', '.join(parts)}"

    def _summarize_bumps(self) -> str:
        parts = [f"{one.law} {1e3 * one.total:+.3g} mJ ({one.entry})" for one in self.bump.bumps]
        return ", ".join(parts)

    def _summarize_devices(self) -> str:
        found = self.devices.onsets
        missed = sum(one.catalogue_rule_missed for one in found)
        rules = sum(one.prediction.violates_delay_rule for one in found)
        return (
            f"{missed} of {len(found)} cases cycle at a stiffness that the catalogue's K0/q "
            f"allows, {rules} below the delay rule"
        ) + (f"; {self.devices.wall_summary}" if self.devices.wall_summary else "")


def run_experiments(
    measured_texture: Texture | None = None, progress: Callable[[str], None] | None = None
) -> Experiments:
    """Run all experiments; this takes one to three minutes on two cores.

    Args:
        measured_texture: a surface for the last one; by default a synthetic one.
        progress: called with the name of each step when it starts.
    """
    report = progress or (lambda _step: None)
    report(STEPS[0])
    passivity = passivity_experiment()
    report(STEPS[1])
    scanning = strokes.scanning_experiment()
    report(STEPS[2])
    bump = strokes.bump_experiment()
    report(STEPS[3])
    return Experiments(passivity, scanning, bump, device_experiment(measured_texture))
