"""The simulated experiments of section V, and the paper's figures, on the page of its claims."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.paper.experiments import Experiments
from asperity.paper.experiments.beyond import BeyondExperiment, DeviceOnset
from asperity.paper.experiments.bump import BumpExperiment
from asperity.paper.experiments.passivity import Count, PassivityExperiment
from asperity.paper.experiments.scanning import ScanningExperiment
from asperity.paper.figures import loop_energies
from asperity.report.onset import newton, onset_cells, onset_section, onset_seen
from asperity.report.page import Cell, Cells, Row, Section, Table, pictured
from asperity.report.pictures import experiment_pictures, paper_pictures
from asperity.report.pictures.paper_pictures import energy_words, figure_three
from asperity.report.pictures.sweep_pictures import onset_figure
from asperity.report.run import energy
from asperity.report.scan import milli
from asperity.units import engineering


def paper_sections() -> list[Section]:
    """Return figures 2 and 3 of the paper with their words."""
    fields = (
        "The texture of section V.B, 0.8 mm sin(2πx/2 mm), with κ₀ = 1000 N/m. The two handles are "
        "as deep on one flank of the crest as on the other, 0.6 mm below z = 0: laws differ in the "
        "direction of the force and in how deep they take a handle to be."
    )
    loops = (
        "Closed paths, and the energy that a law has given to a probe that went along them once. A "
        "law that ends above zero can be turned again and again: it feeds the hand. C and D, which "
        "the paper does not show, go the way of A."
    )
    fields_seen = (
        "Arrows of force below a sinusoid of 0.8 mm by 2 mm, a panel for each law, and larger ones "
        "at a handle on either flank of the crest."
    )
    panels = loop_energies()
    gained = "; ".join(f"{panel.law} {energy_words(panel)}" for panel in panels)
    loops_seen = f"A closed path and the work along it for each of {len(panels)} laws: {gained}."
    return [
        pictured("Figure 2: forces", paper_pictures.figure_two(), fields_seen, fields),
        pictured("Figure 3: energy around closed paths", figure_three(panels), loops_seen, loops),
    ]


def experiment_sections(found: Experiments) -> list[Section]:
    """Return the experiments' sections in order."""
    return [
        _cycles(found.passivity),
        _onsets(found.passivity),
        onset_section("V.A, onsets in numbers", found.passivity.onsets),
        _energies(found.scanning),
        _strokes(found.scanning),
        _bumps(found.bump),
        _devices(found),
        _device_table(found.beyond),
    ]


def _cycles(found: PassivityExperiment) -> Section:
    lag = found.counts[0].delay
    caption = (
        "Figure 5 in simulation: a rubber band pulls the handle into the wall. Height of the "
        f"handle after the release, one of {found.counts[0].starts} starts, at a loop lag of {lag} "
        "samples. Cycling: still moving after 2 s and not calming down."
    )
    figure = experiment_pictures.cycles_figure(found)
    counts = ", ".join(f"{one.cycles} with {_wall(one)}" for one in found.counts)
    seen = f"Height of the handle over time. Of {found.counts[0].starts} starts cycle: {counts}."
    return pictured("V.A, who begins to cycle", figure, seen, caption, _fitted(found.fitted))


def _wall(one: Count) -> str:
    """Return the law of a wall, and by what its stiffness is divided."""
    return one.law if one.divisor == 1.0 else f"{one.law}/{one.divisor:g}"


def _fitted(sentences: Sequence[str]) -> list[str]:
    return [f"Not stated by the paper: {'; '.join(sentences)}."]


def _onsets(found: PassivityExperiment) -> Section:
    caption = (
        "Not one lucky parameter set but the stiffness at which the first start cycles, against "
        "the lag that the paper does not state. Solid green: proved for conservative laws and "
        "exact positions."
    )
    figure = onset_figure(found.onsets)
    seen = onset_seen(found.onsets)
    return pictured("V.A, onset against lag, all laws", figure, seen, caption)


def _energies(found: ScanningExperiment) -> Section:
    caption = (
        "Figure 6 in simulation: energy that the texture has supplied over one stroke. Solid: work "
        "of the held force on the true motion. Dashed: the paper's sum of command and step of the "
        "same sample. Up feeds the hand; the paper draws it downwards."
    )
    figure = experiment_pictures.energies_figure(found)
    seen = f"Energy along x and z over one stroke, a panel for each of {len(found.traces)} laws."
    return pictured("V.B, energy of a stroke", figure, seen, caption, _fitted(found.guessed))


def _strokes(found: ScanningExperiment) -> Section:
    headings = ("law", "hand", "speed", "x", "z", "sum", "field", "±", "paper's", "lost")
    rows = []
    for one in found.strokes:
        stroke = one.stroke
        place: Cells = [Cell(stroke.law, "l"), one.hand, engineering(stroke.speed, "m/s")]
        work = [milli(value) for value in (stroke.energy[0], stroke.energy[2], stroke.total)]
        field = Cell(milli(stroke.field), "no" if stroke.feeds else "")
        spread = milli(stroke.spread + stroke.error, sign=False)
        rest = [spread, milli(sum(stroke.same_sample)), f"{stroke.lost_contact:.1f}"]
        rows.append(Row([*place, *work, field, *rest], law=stroke.law))
    notes = (
        "Energies in mJ per stroke of 80 mm. Field: what the law itself gives along the true path; "
        "the rest is sampling and steps of the encoder. Coloured: the field feeds the hand.",
    )
    table = Table(headings, rows, numbers=range(2, len(headings)))
    return Section("V.B, every hand and speed", [table], notes=notes)


def _bumps(found: BumpExperiment) -> Section:
    caption = (
        "Figure 7 in simulation: over a bump of 20 mm and back. Left the way of the handle, right "
        "the energy that the texture has supplied. A lifts the hand off and feeds it in jumps; D "
        "and H keep their balance, and hold the hand at the flank instead of lifting it."
    )
    figure = experiment_pictures.bumps_figure(found)
    gains = "; ".join(
        f"{one.law} {energy(float(one.supplied[-1]))} ({one.entry})" for one in found.bumps
    )
    seen = f"Way of the handle over the bump, and energy supplied in the end: {gains}."
    return pictured("V.C, the enlarged bump", figure, seen, caption, _fitted(found.guessed))


def _devices(found: Experiments) -> Section:
    caption = (
        "What the paper could not do: stiffnesses that a rule allows, against those at which the "
        "simulation begins to cycle. Below the line the rule was wrong: filled orange. Left K₀/q, "
        "with the K₀ of the catalogue, or with the wall's own onset for the pantograph of section "
        "V.A (crosses). Right the delay rule, for conservative laws a proof if positions are exact."
    )
    skipped = (
        f"Not simulated, their apparent mass being unknown: {', '.join(found.beyond.skipped)}."
    )
    far = [
        f"Few misses on the left say little: {words}." for words in [found.beyond.how_far] if words
    ]
    notes = [*_fitted(found.beyond.guessed), *far, skipped]
    figure = experiment_pictures.devices_figure(found)
    missed = sum(one.missed for one in found.beyond.onsets)
    seen = (
        f"Onset against what two rules allow. On other devices K₀/q was too much in {missed} of "
        f"{len(found.beyond.onsets)} cases."
    )
    return pictured("Predicted and simulated, every device with data", figure, seen, caption, notes)


def _device_table(found: BeyondExperiment) -> Section:
    headings = ("device", "surface", "law", "q", "K₀/q", "delay rule", "cycles", "starts", "depth")
    rows = [Row(_device_cells(one), law=one.prediction.onset.law) for one in found.onsets]
    notes = (
        "Stiffnesses in N/m. q at the depth that the handle got to. Delay rule: with the damping "
        "of the hand, a proof for conservative laws and exact positions, else in brackets.",
    )
    table = Table(headings, rows, numbers=range(3, len(headings)))
    return Section("Devices in numbers", [table], notes=notes)


def _device_cells(one: DeviceOnset) -> Cells:
    law, _delay, _quiet, cycling, starts, depth, q, _paper, rule, _wall = onset_cells(
        one.prediction
    )
    allowed = Cell(newton(one.allowed), "no" if one.missed else "")
    return [one.device, one.surface, law, q, allowed, rule, cycling, starts, depth]
