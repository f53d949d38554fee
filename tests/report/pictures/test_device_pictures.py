"""The spectrum along the scan line and the wavelength limits of a device."""

from __future__ import annotations

import pytest

import asperity as asp
from asperity.devices import parse_device
from asperity.report.pictures.device_pictures import device_wavelength_limits, line_spectrum

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
