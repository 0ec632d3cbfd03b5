"""What seldom acts is named on a real hull only where what every vehicle has cannot do its work."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import rarity
from host.diagnosis.search.exchange import twins
from host.diagnosis.search.offset_choice import with_likeliest_offsets, with_one_offset
from host.diagnosis.search.rarity import _pays, told_by_the_usual
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import with_all_ordinary
from host.recordings.recording import Array, Recording

SERVO, FILTER = 0.06, 0.5  # s


def real_hull(rows: Recording, servo: float, duration: float, trim: float = 0.0) -> Recording:
    """Coupling, drag across the hull and in pitch, a servo with a lag, and a moment."""
    begins, delta = np.empty(rows.time.size), 0.0
    for k, command in enumerate(rows.rudder):
        begins[k] = delta
        delta = command + (delta - command) * np.exp(-rows.step / servo)

    def force(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        w, q, *_ = x
        k = min(int(time / rows.step), rows.time.size - 1)
        off = (begins[k] - rows.rudder[k]) * np.exp(-(time - rows.time[k]) / servo)
        off += rows.rudder[k] - plane
        moment = trim - 4.0 * q * abs(q) + BASE["b2"] * off
        return 0.9 * q - 2.0 * w * abs(w) + BASE["b1"] * off, moment, 0.0

    return hidden_dive(force, duration=duration)


def searched(recording: Recording, *names: str) -> tuple[Search, Explanation]:
    fitter = Fitter([recording])
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    best = fitter.base
    for name in names:
        best = fitter.grown(best, name, [])
    return search, search.remember(fitter.polished(best))


REAL = ("heave_pitch_rate_coupling", "pitch_quadratic_damping")


def test_a_slow_attitude_filter_gives_way_to_a_servo_on_a_real_hull() -> None:
    recording = real_hull(hidden_dive(duration=30.0), SERVO, 30.0)
    search, best = searched(recording, *REAL, "pitch_sensor_lag")
    found = told_by_the_usual(search, best)
    assert "pitch_sensor_lag" not in found.names
    assert {*REAL, "actuator_lag"} <= found.names
    assert "pitch_sensor_lag" in twins(search, found, "actuator_lag")


def test_two_rare_effects_go_together_where_neither_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = real_hull(hidden_dive(duration=30.0), SERVO, 30.0)
    search, best = searched(recording, *REAL, "actuator_lag")
    both = search.fitter.grown(search.fitter.grown(best, "depth_sensor_lag", []), "pitch_sensor_lag", [])
    both = search.remember(search.fitter.polished(both))
    monkeypatch.setattr(rarity, "SLIGHT", -1.0)
    monkeypatch.setattr(rarity, "pruned", lambda *_: best)
    assert told_by_the_usual(search, both).names == best.names


def test_a_rare_effect_stays_whose_work_nothing_usual_does() -> None:
    recording = real_hull(hidden_dive(duration=60.0), SERVO, 60.0)
    pitch = recording.pitch.copy()
    for k in range(1, pitch.size):
        pitch[k] = pitch[k - 1] + (recording.pitch[k] - pitch[k - 1]) * (1 - np.exp(-recording.step / FILTER))
    noise = np.deg2rad(0.1) * np.random.default_rng(1).standard_normal(pitch.size)
    slow = replace(recording, pitch=pitch + noise)
    search, best = searched(slow, *REAL, "heave_quadratic_drag", "pitch_sensor_lag")
    assert told_by_the_usual(search, best).names >= {"pitch_sensor_lag"}


@pytest.mark.parametrize(("slight", "is_named"), [(0.01, True), (30.0, False)])
def test_what_is_significant_but_slight_is_not_named_on_a_real_hull(
    slight: float, is_named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = real_hull(hidden_dive(duration=60.0), SERVO, 60.0)
    drifting = replace(recording, depth=recording.depth + 5e-3 * (recording.time - 30.0))
    search, best = searched(drifting, *REAL, "heave_quadratic_drag", "actuator_lag", "vertical_current")
    worth = search.without(best, "vertical_current").bic - best.bic
    assert 0.01 * best.fit.samples < worth < 30.0 * best.fit.samples
    monkeypatch.setattr(rarity, "SLIGHT", slight)
    assert ("vertical_current" in told_by_the_usual(search, best).names) is is_named


@pytest.mark.parametrize("usual", [(), REAL[:1]])
def test_a_textbook_s_vehicle_may_have_one_rare_effect_alone(usual: tuple[str, ...]) -> None:
    search, best = searched(hidden_dive(duration=30.0), *usual, "pitch_sensor_lag")
    assert told_by_the_usual(search, best) is best


def test_what_pays_for_itself_must_pay_beside_all_that_every_vehicle_has() -> None:
    recording = real_hull(hidden_dive(duration=60.0), SERVO, 60.0)
    search, best = searched(recording, *REAL, "heave_quadratic_drag", "trim_moment")
    whole, other = (
        with_all_ordinary(search.fitter, one) for one in (best, search.without(best, "trim_moment"))
    )
    assert not _pays(search, "trim_moment", whole, other)
    surer = replace(whole, fit=replace(whole.fit, log_likelihood=other.fit.log_likelihood + 30.0))
    assert _pays(search, "trim_moment", surer, other)
    assert "trim_moment" not in told_by_the_usual(search, best).names


def test_an_offset_is_asked_again_beside_what_took_the_place_of_another() -> None:
    recording = real_hull(hidden_dive(duration=60.0), SERVO, 60.0, 0.05)
    search, best = searched(recording, *REAL, "heave_quadratic_drag", "actuator_lag", "rudder_offset")
    assert with_likeliest_offsets(search, best).names == best.names - {"rudder_offset"} | {"trim_moment"}
    plain = search.without(best, "rudder_offset")
    assert with_likeliest_offsets(search, plain) is plain


def test_two_offsets_give_way_to_one_with_all_that_every_vehicle_has() -> None:
    recording = real_hull(hidden_dive(duration=30.0), SERVO, 30.0)
    bent = replace(recording, rudder=recording.rudder - 0.02)
    search, two = searched(bent, *REAL, "net_buoyancy", "trim_moment")
    one = with_one_offset(search, two)
    assert "rudder_offset" in one.names
    assert one.names.isdisjoint({"net_buoyancy", "trim_moment"})
    assert one.bic < two.bic
    assert with_one_offset(search, one) is one
    search, few = searched(bent, "net_buoyancy", "trim_moment")
    assert with_one_offset(search, few).names == {"rudder_offset"}
