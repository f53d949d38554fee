"""The simulated experiments and the verdicts that follow from them."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.paper import get_claim
from asperity.paper.cases import SAMPLING_PERIOD
from asperity.paper.claims import simulated_claims
from asperity.paper.claims.simulated_claims import SIMULATED_CLAIM_IDS
from asperity.paper.experiments import cycle_counts, experiment_setups, strokes
from asperity.paper.experiments.cycle_counts import count_cycles, passivity_experiment
from asperity.paper.experiments.device_onsets import (
    PRESSING_HAND,
    DeviceExperiment,
    DeviceOnset,
    device_onset,
    usable_devices,
)
from asperity.paper.experiments.experiment_suite import Experiments
from asperity.paper.experiments.strokes import energy_trace, scanning_experiment, simulate_bump
from asperity.simulation import simulate
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

# Verdicts on the statements of section V.
EXPECTED = {
    "sentence-III.B-reduced": "does not hold",  # A cycles at a quarter of the wall's onset over q
    "sentence-V.A-cycles": "undecided",  # the lag decides, which the paper does not state
    "sentence-V.A-settles": "holds",
    "sentence-V.B-A": "holds",
    "sentence-V.B-decrease": "holds with correction",  # an increasing one
    "sentence-V.B-G": "undecided",  # by its own sum two of nine hands and speeds agree
    "sentence-V.B-D": "undecided",  # by its own sum all nine, by the exact ledger none
    "sentence-V.B-F": "holds",
    "sentence-V.C-A": "holds",
    "sentence-V.C-D": "holds",
}


@pytest.mark.parametrize("name", SIMULATED_CLAIM_IDS)
def test_verdicts(name: str) -> None:
    found = get_claim(name).run()
    assert found.verdict == EXPECTED[name], found.evidence.summary
    assert found.evidence.numbers
    assert ("guessed" in found.evidence.fitted) is (name != "sentence-V.B-decrease")
    json.dumps(found.to_dict(), allow_nan=False)


def test_every_simulated_claim_has_its_experiment() -> None:
    from asperity.paper import CLAIMS

    assert set(SIMULATED_CLAIM_IDS) == set(EXPECTED)
    assert set(SIMULATED_CLAIM_IDS) <= set(CLAIMS)


# --- verdicts (the perturbation of each claim is in test_perturbations.py) ------------------------


@pytest.mark.parametrize(
    ("paper", "ours", "verdict"),
    [
        ((True, True), (True, True), "holds"),
        ((False, False), (False, False), "does not hold"),
        ((True, True), (False, False), "undecided"),  # the measures disagree
        ((True, False), (False, False), "undecided"),  # a guess decides
        ((True, True), (True, False), "undecided"),
    ],
)
def test_an_experiment_is_decided_where_guesses_and_measures_agree(
    paper: tuple[bool, ...], ours: tuple[bool, ...], verdict: str
) -> None:
    found = simulated_claims.check_over_assumptions("what", paper, ours, {})
    assert found.verdict == verdict
    assert f"{sum(paper)} of 2" in found.summary


def test_the_field_feeds_as_theory_says() -> None:
    """A, B and E are not conservative and feed some hand; F takes; the others give nothing."""
    found = scanning_experiment("WABCDEFH")
    feeding = {law: sum(one.gains_energy for one in found.strokes_of(law)) for law in "WABCDEFH"}
    every = len(experiment_setups.HANDS) * len(experiment_setups.SPEEDS)
    assert feeding["A"] == feeding["E"] == every
    assert feeding["B"] > 0
    assert [feeding[law] for law in "WCDFH"] == [0, 0, 0, 0, 0]
    assert all(one.closure < 1e-9 for law in "WABCDEFH" for one in found.strokes_of(law))
    assert all(one.total < 0.0 for one in found.strokes_of("F"))


# --- the experiments themselves -------------------------------------------------------------------


@pytest.fixture(scope="module")
def experiments() -> Experiments:
    """All of them, small."""
    usable, skipped = usable_devices()
    assert "touch" in usable
    assert "omega.3" in skipped
    surface = Surface(Sinusoid(0.1e-3, 1e-3), "A", max_depth=1e-3)
    found = device_onset("touch", "sinusoid", surface)
    return Experiments(
        passivity_experiment("WH", (0, 2), starts=2),
        scanning_experiment("AH"),
        strokes.bump_experiment("AD"),
        DeviceExperiment((found,), tuple(skipped)),
    )


def test_an_onset_below_what_was_tried_counts_as_unknown(experiments: Experiments) -> None:
    def summary(quiet: float, rule: float) -> str:
        first = next(one for one in experiments.passivity.onsets if not one.onset.is_smooth_wall)
        onset = replace(first.onset, quiet=quiet, cycling=50.0)
        changed = (replace(first, onset=onset, wall_rule=rule),)
        found = replace(experiments, passivity=replace(experiments.passivity, onsets=changed))
        return dict(found.summary_lines)["V.A onsets"].rpartition("; ")[2]

    own = "below K0/q of the wall's own onset in"
    assert summary(0.0, 14.0) == f"{own} 0 of 1 cases, unknown in 1"
    assert summary(0.0, 60.0) == f"{own} 1 of 1 cases"  # it cycles below, however far
    assert summary(45.0, 14.0) == f"{own} 0 of 1 cases"


def test_the_result_is_plain_data(experiments: Experiments) -> None:
    data = json.loads(json.dumps(experiments.to_dict(), allow_nan=False))
    assert set(data) == {"V.A", "V.B", "V.C", "beyond"}
    assert data["V.A"]["fitted"] == list(experiment_setups.FITTED_ASSUMPTIONS)
    assert len(data["V.B"]["strokes"]) == 2 * len(experiment_setups.HANDS) * len(
        experiment_setups.SPEEDS
    )
    assert [name for name, _words in experiments.summary_lines] == [
        "V.A",
        "V.A onsets",
        "V.B",
        "V.C",
        "devices",
    ]
    summaries = dict(experiments.summary_lines)
    assert "the field supplies energy: A 9, H 0" in summaries["V.B"]
    assert summaries["devices"].startswith("0 of 1 cases")


def test_onsets_carry_the_walls_own(experiments: Experiments) -> None:
    onsets = {(one.onset.law, one.onset.delay): one for one in experiments.passivity.onsets}
    wall, split = onsets["W", 2], onsets["H", 2]
    assert wall.wall_rule == wall.onset.quiet
    assert split.wall_rule == wall.onset.quiet
    stiffness = {(one.law, one.divisor): one.stiffness for one in experiments.passivity.counts}
    assert stiffness["A", 5.1] == pytest.approx(2000 / 5.1)


def test_a_device_s_rule_is_that_of_the_catalogue(experiments: Experiments) -> None:
    (found,) = experiments.devices.onsets
    assert found.catalogue_stiffness == 400.0
    assert found.catalogue_limit == pytest.approx(400.0 / found.prediction.q)
    assert not found.is_limit_violated
    worse = DeviceOnset(found.device, found.surface, 1e9, found.prediction)
    assert worse.is_limit_violated


def test_how_far_the_wall_itself_is_from_the_catalogue_is_said(experiments: Experiments) -> None:
    """Beside "0 of n cases": where the simulated wall begins to cycle, computed."""
    (texture,) = experiments.devices.onsets
    assert experiments.devices.wall_ratios == ()
    assert "wall" not in dict(experiments.summary_lines)["devices"]
    flat = replace(texture.prediction, onset=replace(texture.prediction.onset, is_smooth_wall=True))
    onsets = tuple(DeviceOnset("d", "s", k0, flat) for k0 in (100.0, 250.0))
    found = replace(experiments, devices=DeviceExperiment(onsets, ()))
    most = flat.onset.cycling / 100.0
    assert found.devices.wall_ratios == pytest.approx([most, most / 2.5])
    assert f"only at {most / 2.5:.0f} to {most:.0f} times" in dict(found.summary_lines)["devices"]


def test_a_trace_is_the_ledger_of_its_stroke() -> None:
    """The last row of a panel of figure 6 agrees with a run of one stroke."""
    trace = energy_trace("A")
    setup = experiment_setups.stroke_setup("A")
    run = simulate(
        setup.surface, setup.plant, setup.hand, setup.servo, setup.motion,
        float(trace.time[-1]) + SAMPLING_PERIOD,
    )  # fmt: skip
    before = run.energies["supplied"][-1]
    np.testing.assert_allclose(trace.exact[-1], before[[0, 2]], rtol=1e-12, atol=1e-18)


def test_a_count_keeps_its_trace() -> None:
    found = count_cycles("W", 1.0, 0, starts=2)
    assert (found.starts, found.cycles, found.stiffness) == (2, 0, 2000.0)
    assert found.time[-1] < experiment_setups.band_setup().duration
    assert found.z[0] == 4e-3
    assert found.z.min() < 0.0
    assert len(found.time) == len(found.x) == len(found.z)
    assert cycle_counts.CYCLE_COUNT_STARTS == 24
    assert strokes.FIGURE_6_LAWS[0] == "A"


def test_the_bump_closes_its_ledger() -> None:
    found = simulate_bump("A", "fast")
    assert found.closure < 1e-9
    assert found.total > 0.1
    assert found.lost > 1
    assert math.isfinite(found.jump)
    assert PRESSING_HAND.force == (0.0, 0.0, -1.0)
