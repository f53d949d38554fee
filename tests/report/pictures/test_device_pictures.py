"""The spectrum along the scan line, wavelength limits of a device, the diagram of an envelope."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import asperity as asp
from asperity.devices import load_device, parse_device
from asperity.envelopes.envelope import Envelope
from asperity.report.pictures.device_pictures import (
    device_wavelength_limits,
    line_spectrum,
    spectrum_figure,
)
from asperity.report.sentences.analysis_text import envelope_answer
from asperity.textures.catalogue import as_texture

TEXTURE = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)


def test_spectrum_of_a_sinusoid_is_one_line_of_its_amplitude() -> None:
    wavelength, amplitude = line_spectrum(TEXTURE)
    assert wavelength[0] == pytest.approx(2e-3)
    assert amplitude[0] == pytest.approx(0.2e-3, rel=1e-9)
    assert amplitude[1:].max() < 1e-12


def test_device_wavelength_limits_match_hand_calculation() -> None:
    device = parse_device(
        {"position_resolution": "10 um", "update_rate": "1 kHz", "bandwidth": "200 Hz"}, "mine"
    )
    assert [least for least, _ in device_wavelength_limits(device)] == pytest.approx(
        [5e-5, 5e-4, 5e-4]
    )


def test_spectrum_shows_no_aliases_of_the_nodes() -> None:
    """Synthetic maps have heights at 0.1 nm below their shortest waves, from interpolation."""
    figure = spectrum_figure(as_texture("knurl"), load_device("touch"))
    (line,) = [line for line in figure.axes[0].lines if line.get_label() == "amplitude"]
    assert 1e6 * np.min(line.get_ydata()) > 10.0  # nm; the axis is in mm
    assert np.min(line.get_xdata()) > 0.03
    _wavelength, amplitude = line_spectrum(as_texture("knurl"))
    assert amplitude.min() < 1e-9


@pytest.fixture(scope="module")
def envelope() -> Envelope:
    return asp.envelope(["touch", "inverse3"], "BCDH", wavelengths=[1e-3, 1.4e-3, 1.8e-3, 2.4e-3])


def test_limits_of_an_envelope_are_seen_or_named_with_a_reason(envelope: Envelope) -> None:
    figure = envelope.plot()
    for axes, device in zip(figure.axes, envelope.devices, strict=True):
        title = axes.get_title(loc="left")
        low, high = axes.get_xlim()
        bottom, top = axes.get_ylim()
        for number in range(1, 7):
            is_named = str(number) in title.partition("limits ")[2].replace(";", "")
            assert is_named is not device.has_line(number), (device.device.id, number)
        for line in axes.lines:
            if "limit" in str(line.get_label()):
                x, y = line.get_data()
                assert np.any((x >= low) & (x <= high) & (y >= bottom) & (y <= top))
        notes = [note for note in axes.texts if note.get_text().strip("()").isdigit()]
        assert all(low <= note.xy[0] <= high for note in notes)
    assert envelope["inverse3"].has_line(4)
    assert not envelope["touch"].has_line(4)  # its force resolution is unknown
    assert "limits 1, 4, 6 unknown, 2, 3 outside" in figure.axes[0].get_title(loc="left")


def test_answer_of_an_envelope_has_a_unit_and_names_a_law_as_wide(envelope: Envelope) -> None:
    answer = envelope_answer(envelope["inverse3"])
    widest = envelope["inverse3"].widest
    assert f"law {widest.letter}" in answer
    assert f"{widest.decades:.2f} decades²" in answer
    assert {law.letter for law in envelope["inverse3"].near_widest} == set("CH") - {widest.letter}
    assert "renders nearly as much" in answer
    assert "amplitudes up to" in answer
    alone = replace(envelope["inverse3"], laws=(widest,))
    assert "nearly" not in envelope_answer(alone)
