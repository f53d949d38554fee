"""The data of the pictures of a vertical section."""

from __future__ import annotations

import numpy as np
import pytest

import asperity as asp
from asperity.report.pictures.scan_plane import choose_segment, curl_field
from asperity.surface import Surface

TEXTURE = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)


def test_curl_is_zero_for_law_c_and_not_for_law_a() -> None:
    segment = choose_segment(TEXTURE, 2e-3, 4e-3)
    fields = {
        letter: curl_field(Surface(TEXTURE, letter, 1000.0, 0.3e-3), segment, -0.4e-3, 20, 30)
        for letter in "AC"
    }
    assert np.nanmax(np.abs(fields["C"].curl)) < 1e-9
    # The maximum of k h', up to the cell size.
    assert np.nanmax(np.abs(fields["A"].curl)) == pytest.approx(
        1000.0 * 2 * np.pi * 0.2 / 2, rel=0.05
    )


def test_gain_of_law_a_is_the_norm_of_its_jacobian() -> None:
    """‖J_A‖ = k √(1 + h'²), at every depth."""
    segment = choose_segment(TEXTURE, 2e-3, 4e-3)
    field = curl_field(Surface(TEXTURE, "A", 700.0, 0.3e-3), segment, -0.4e-3, 20, 3)
    middles = 0.5 * (field.along[1:, 0] + field.along[:-1, 0])
    slope = TEXTURE.gradient(segment.xy(middles))[:, 0]
    expected = np.tile(np.hypot(1.0, slope)[:, None], (1, 3))
    np.testing.assert_allclose(field.gain, expected, rtol=1e-12)


def test_gain_where_the_force_jumps_is_a_line_at_every_depth_below_its_onset() -> None:
    """Law D jumps below a crest; without the secant single cells have a gain, or none."""
    steep = asp.Sinusoid(amplitude=0.4e-3, period=1e-3)
    surface = Surface(steep, "D", 1000.0, 0.8e-3)
    segment = choose_segment(steep, 1e-3, 1e-3)
    jump, plain = (
        curl_field(surface, segment, -0.8e-3, 40, 30, jumps=jumps) for jumps in (True, False)
    )
    deep = jump.z[:-1, :-1].mean(axis=0) < -0.1e-3
    assert np.all(jump.gain[:, deep].max(axis=0) > 5.0)
    assert np.all(plain.gain[:, deep].max(axis=0) < 5.0)
    smooth = Surface(TEXTURE, "C", 1000.0, 0.3e-3)
    gains = [
        curl_field(smooth, choose_segment(TEXTURE, 2e-3, 4e-3), -0.4e-3, 40, 30, jumps=jumps).gain
        for jumps in (True, False)
    ]
    assert np.quantile(gains[0] / gains[1], 0.9) < 1.3  # a secant is no larger than its slope
