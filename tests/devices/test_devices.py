"""The catalogue of devices: exactly the known numbers, each with its source."""

from __future__ import annotations

import math
import re

import pytest

from asperity.core.errors import ParameterError
from asperity.devices import FIELD_UNITS, Datum, Device, device_names, load_device, parse_device
from asperity.devices.five_bar import FiveBar, handle_damping

# Read (True) or remembered (False) values, recorded independently of the catalogue.
EXPECTED: dict[str, dict[str, list[tuple[float, bool]]]] = {
    "omega.3": {
        "max_force": [(12, True)],
        "max_stiffness": [(5000, True), (14500, False)],
        "position_resolution": [(1e-5, False)],
        "update_rate": [(4000, False), (8000, False)],
        "controller_damping": [(30, True)],
        "workspace_diameter": [(0.160, False)],
        "workspace_length": [(0.110, False)],
    },
    "delta.3": {
        "max_force": [(20, True)],
        "max_stiffness": [(5000, True)],
        "position_resolution": [(2e-5, False)],
        "apparent_mass": [(0.4, True), (0.5, True)],
        "update_rate": [(4000, True)],
        "controller_damping": [(30, True)],
    },
    "sigma.7": {
        "max_force": [(12, True), (20, False)],
        "max_stiffness": [(4000, True)],
        "position_resolution": [(1.5e-6, False)],
    },
    "lambda.7": {"max_force": [(12, True)], "max_stiffness": [(8000, True)]},
    "falcon": {
        "max_force": [(8, True)],
        "max_stiffness": [(3000, True)],
        "position_resolution": [(38e-6, True), (64e-6, False)],
        "update_rate": [(1000, True), (300, True)],
    },
    "touch": {
        "max_force": [(3.3, True)],
        "max_stiffness": [(400, True), (700, True)],
        "position_resolution": [(55e-6, False)],
        "friction": [(0.26, False)],
        "apparent_mass": [(0.045, False)],
        "continuous_force": [(0.88, False)],
    },
    "omni": {
        "max_force": [(3.3, True)],
        "max_stiffness": [(400, True), (700, True)],
        "position_resolution": [(55e-6, False)],
        "update_rate": [(1000, False)],
        "friction": [(0.26, False)],
        "apparent_mass": [(0.045, False)],
        "continuous_force": [(0.88, False)],
    },
    "touch-x": {
        "max_force": [(7.9, True)],
        "max_stiffness": [(1000, True)],
        "position_resolution": [(23e-6, False)],
        "friction": [(0.06, False)],
        "apparent_mass": [(0.045, False)],
    },
    "premium-1.5": {
        "max_force": [(8.5, True)],
        "max_stiffness": [(800, True), (3500, False)],
        "position_resolution": [(3e-5, False)],
        "friction": [(0.04, False)],
        "apparent_mass": [(0.075, False)],
    },
    "premium-3.0": {
        "max_force": [(22, True)],
        "max_stiffness": [(1000, True)],
        "position_resolution": [(2e-5, False)],
    },
    "inverse3": {
        "max_force": [(10, True)],
        "continuous_force": [(4, True)],
        "max_stiffness": [(1000, True)],
        "position_resolution": [(1e-5, True)],
        "force_resolution": [(0.014, True)],
        "velocity_rate": [(200, True)],
        "update_rate": [(4000, True)],
    },
    "2diy": {
        "position_resolution": [(90e-6, True), (41e-6, True)],
        "encoder_counts": [(4880, True), (10752, True)],
        "proximal_link": [(0.070, True)],
        "distal_link": [(0.090, True)],
    },
    "pantograph": {
        "max_stiffness": [(2000, True)],
        "position_resolution": [(15e-6, True), (10e-6, True)],
        "bandwidth": [(400, True)],
        "update_rate": [(10_000, True)],
        "joint_damping": [(4.7e-3, True), (4.0e-3, True)],
        "proximal_link": [(0.063, False)],
        "distal_link": [(0.075, False)],
        "base_distance": [(0.025, False)],
    },
}
EXPECTED_FIELDS = [(name, field) for name, fields in EXPECTED.items() for field in fields]
# Further numbers with a source: constants of drivers, and derived values.
OTHER_FIELDS = {"controller_damping", "workspace_radius", "damping", "base_distance"}


def entries() -> list[tuple[Device, str, Datum]]:
    devices = [load_device(name) for name in device_names()]
    return [
        (device, field, datum)
        for device in devices
        for field, first in device.data.items()
        for datum in (first, *first.also)
    ]


def test_catalogue_contains_every_device() -> None:
    assert set(device_names()) == set(EXPECTED)


@pytest.mark.parametrize(("name", "field"), EXPECTED_FIELDS)
def test_catalogue_contains_every_known_number(name: str, field: str) -> None:
    datum = load_device(name).data[field]
    values = [(entry.value, entry.verified) for entry in (datum, *datum.also)]
    expected = EXPECTED[name][field]
    assert len(values) == len(expected)
    for entry, (value, verified) in zip(values, expected, strict=True):
        assert entry == (pytest.approx(value, rel=1e-12), verified)


@pytest.mark.parametrize("name", list(EXPECTED))
def test_catalogue_contains_no_unknown_number(name: str) -> None:
    assert set(load_device(name).data) <= set(EXPECTED[name]) | OTHER_FIELDS


def test_every_number_has_a_unit_and_a_source() -> None:
    all_entries = entries()
    assert len(all_entries) > 80
    for device, field, datum in all_entries:
        field_name = f"{device.id}.{field}"
        assert datum.unit == FIELD_UNITS[field], field_name
        assert len(datum.source) > 10, field_name
        assert math.isfinite(datum.value), field_name
        # Remembered numbers are never marked verified, and unverified ones state the reason.
        assert datum.verified != any(
            word in datum.source for word in ("remembered", "not verified", "derived likewise")
        ), field_name


def test_verified_number_precedes_remembered_ones() -> None:
    for device, field, datum in entries():
        if not datum.verified:
            continue
        assert device.data[field].verified, f"{device.id}.{field}"


def test_entries_of_one_device_under_two_names_agree() -> None:
    touch, omni = load_device("touch").data, load_device("omni").data
    # The rate is a property of the connection, which differs: FireWire, later Ethernet and USB.
    assert set(touch) == set(omni) - {"update_rate"}
    for field, datum in touch.items():
        values = [(entry.value, entry.verified) for entry in (datum, *datum.also)]
        other = omni[field]
        assert [(entry.value, entry.verified) for entry in (other, *other.also)] == values, field


def test_every_stiffest_wall_states_what_it_is_and_of_which_year() -> None:
    walls = [datum for _device, field, datum in entries() if field == "max_stiffness"]
    assert len(walls) == 16
    for datum in walls:
        kinds = ("a constant of the library", "data sheet", "product page", "a test: ")
        assert any(kind in datum.source for kind in kinds), datum.source
        assert re.search(r"\((19|20)\d\d\)|of an unknown year", datum.source), datum.source


def test_derived_resolutions_follow_from_their_sources() -> None:
    haply = load_device("2diy").data
    length = haply["proximal_link"].value
    counts = [haply["encoder_counts"], *haply["encoder_counts"].also]
    steps = [haply["position_resolution"], *haply["position_resolution"].also]
    for count, step in zip(counts, steps, strict=True):
        assert step.value == pytest.approx(2 * math.pi * length / count.value, rel=0.005)
    # libnifalcon: 320 slots in quadrature, capstan of 14.25 mm on an arc of 110 mm, arm of 60 mm.
    falcon_step = 60e-3 * 2 * math.pi / (4 * 320) * 14.25 / 110
    assert load_device("falcon").value("position_resolution") == pytest.approx(
        falcon_step, rel=0.005
    )


def test_damping_of_the_pantograph_follows_from_its_joints() -> None:
    """σ₀(B) with B = J⁻ᵀ b J⁻¹, rounded down because it is a limit."""
    device = load_device("pantograph")
    data = device.data
    linkage = FiveBar(*(data[f].value for f in ("proximal_link", "distal_link", "base_distance")))
    joint = data["joint_damping"].value
    dampings = [data["damping"], *data["damping"].also]
    for datum, point in zip(dampings, [(-12.5e-3, 0.1), (37.5e-3, 0.1)], strict=True):
        x, y = (f"{1e3 * value:g}" for value in point)
        assert f"({x}, {y}) mm" in datum.source
        sigma = float(
            min(abs(value) for value in _eigenvalues(handle_damping(linkage, joint, point)))
        )
        assert 0.0 <= sigma - datum.value < 1e-3
        assert not datum.verified


def _eigenvalues(matrix: object) -> tuple[float, float]:
    (a, b), (_b, d) = matrix
    middle, half = (a + d) / 2, math.hypot((a - d) / 2, b)
    return middle - half, middle + half


def test_force_filter_of_a_driver_is_noted() -> None:
    assert any("filters the force" in note for note in load_device("inverse3").notes)


def test_axes_of_devices_are_described() -> None:
    assert load_device("omega.3").axes.startswith("x towards the user, y to the right, z up")
    assert load_device("touch").axes.startswith("x to the right, y up, z towards the user")
    assert load_device("inverse3").axes == "x to the right, y forward, z up"


def test_device_names_are_case_insensitive() -> None:
    assert load_device("OMEGA.3").id == "omega.3"


def test_load_device_accepts_a_device() -> None:
    device = load_device("touch")
    assert load_device(device) is device


@pytest.mark.parametrize(
    ("name", "nearest"),
    [("omega3", r"'omega\.3'"), ("premium1.5", r"'premium-1\.5'"), ("toch", "'touch'")],
)
def test_unknown_device_suggests_similar_names(name: str, nearest: str) -> None:
    with pytest.raises(ParameterError, match=f"did you mean {nearest}"):
        load_device(name)


@pytest.mark.parametrize("argument", [None, 5, b"touch", ["touch"]])
def test_invalid_type_of_device_is_an_error(argument: object) -> None:
    with pytest.raises(ParameterError, match="must be an id, a TOML file or a Device"):
        load_device(argument)  # wrong type on purpose


def test_unknown_value_is_none_and_required_stiffness_an_error() -> None:
    device = load_device("2diy")
    assert device.value("max_stiffness") is None
    with pytest.raises(ParameterError, match="2diy needs max_stiffness"):
        _ = device.max_stiffness


def test_device_to_dict_is_complete() -> None:
    content = load_device("omega.3").to_dict()
    stiffness = content["data"]["max_stiffness"]
    assert (stiffness["value"], stiffness["unit"], stiffness["verified"]) == (5000.0, "N/m", True)
    other = stiffness["also"][0]
    assert (other["value"], other["verified"], other["also"]) == (14500.0, False, [])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0, "1", "0"),
        (10752.0, "1", "10752"),
        (0.045, "kg", "45 g"),
        (1.2, "kg", "1.2 kg"),
        (0.0047, "N*m*s", "4.7 mN·m·s"),
        (30.0, "N*s/m", "30 N·s/m"),
        (14500.0, "N/m", "14500 N/m"),
        (4000.0, "Hz", "4 kHz"),
        (1.5e-6, "m", "1.5 µm"),
    ],
)
def test_values_are_formatted_with_units(value: float, unit: str, text: str) -> None:
    assert Datum(value, unit, "", True).text == text


def test_every_field_can_be_parsed() -> None:
    content = {
        field: {"value": 1, "unit": unit, "source": "s"} for field, unit in FIELD_UNITS.items()
    }
    device = parse_device(content, "whole")
    assert {field: datum.value for field, datum in device.data.items()} == dict.fromkeys(
        FIELD_UNITS, 1.0
    )
