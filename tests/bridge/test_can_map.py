import math

import pytest

from bridge.can_map import CanMap, CanSelector, CanSignal
from bridge.measurement import Quantity

DEPTH = CanSignal(quantity="depth", message="DEPTH", signal="depth")


def test_defaults_of_each_kind_have_what_identification_needs() -> None:
    for kind in ("dbc", "nmea2000", "dronecan"):
        quantities = {signal.quantity for signal in CanMap(kind=kind).table()}  # type: ignore[arg-type]
        assert {"pitch", "rudder"} < quantities
        assert quantities & {"depth", "pressure"}


def test_own_signals_replace_the_default_table() -> None:
    assert CanMap(signals=(DEPTH,)).table() == (DEPTH,)


def test_rudder_instance_selects_the_plane() -> None:
    rudder = next(s for s in CanMap(kind="nmea2000", rudder_instance=2).table() if s.quantity == "rudder")
    assert rudder.only == (CanSelector(signal="instance", value=2),)


def test_pressure_becomes_depth_and_back() -> None:
    can_map = CanMap(water_density=1000.0, gravity=9.8, surface_pressure_hpa=1000.0)
    signal = CanSignal(quantity="pressure", message="HULL", signal="bar", scale=1e5)
    assert can_map.to_quantity(signal, 1.98) == (Quantity.DEPTH, pytest.approx(10.0))
    assert can_map.from_quantity(signal, 10.0) == pytest.approx(1.98)


@pytest.mark.parametrize("quantity", ["depth", "pitch", "rudder", "speed", "pitch_rate"])
def test_scale_offset_and_sign_invert(quantity: str) -> None:
    can_map = CanMap(pitch_sign=-1, rudder_sign=-1)
    signal = CanSignal(quantity=quantity, message="M", signal="s", scale=0.5, offset=3.0)  # type: ignore[arg-type]
    _, value = can_map.to_quantity(signal, 4.0)
    assert value == (5.0 if quantity in ("depth", "speed") else -5.0)
    assert can_map.from_quantity(signal, value) == 4.0


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"kind": "nmea2000", "dbc": "x.dbc"}, "dbc must be left out"),
        ({"source_address": 5}, "source_address must be left out"),
        ({"dbc": "x.dbc"}, "signals must name"),
        ({"pitch_sign": 2}, "pitch_sign must be 1 or -1"),
        ({"rudder_sign": 0}, "rudder_sign must be 1 or -1"),
        ({"rudder_instance": 256}, "rudder_instance must be 0 to 255"),
        ({"kind": "nmea2000", "source_address": 254}, "source_address must be 0 to 253"),
        ({"water_density": 1.0}, "water_density must be"),
        ({"gravity": math.nan}, "gravity must be"),
        ({"surface_pressure_hpa": 101325.0}, "surface_pressure_hpa must be"),
    ],
)
def test_map_names_the_rule_that_is_broken(settings: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        CanMap(**settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "value"), [("scale", 0.0), ("scale", math.nan), ("offset", math.inf)])
def test_signal_names_the_rule_that_is_broken(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must be finite"):
        CanSignal(quantity="depth", message="M", signal="s", **{name: value})
