"""Offsets that no servo is true enough to notice stay in the model and get no name."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import structure_of
from host.diagnosis.diagnose import _unnamed, diagnose
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import Leftover
from host.diagnosis.proof.minute import LEAST_ANGLE, minute_in, unresolved_in
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.proof.verdict import Verdict, verdict_on

NOTHING = Leftover(
    is_coloured=False, is_local=False, is_by_speed=False, is_no_sea=False, is_above_floor=False,
    smooth_gain=0.0, is_smooth=False,
)  # fmt: skip
CLIMB, TURN = abs(BASE["a1"]) * BASE["u0"], abs(BASE["b2"])  # m/s^2 and rad/s^2 a radian


def misfit(chi2: float) -> Misfit:
    return Misfit(depth_rmse_m=0.0, pitch_rmse_rad=0.0, chi2_depth=chi2, chi2_pitch=chi2)


@pytest.mark.parametrize(
    ("name", "largest"),
    [
        ("net_buoyancy", LEAST_ANGLE * CLIMB),
        ("trim_moment", LEAST_ANGLE * TURN),
        ("rudder_offset", LEAST_ANGLE),
        ("pitch_bias", LEAST_ANGLE * BASE["b2"] / BASE["a3"]),
        ("vertical_current", LEAST_ANGLE * BASE["u0"]),
    ],
)
def test_an_offset_is_measured_by_the_angle_that_holds_it(name: str, largest: float) -> None:
    base, structure = Fitter([hidden_dive(duration=20.0)]).base, structure_of((name, "actuator_lag"))

    def with_offset(size: float) -> Explanation:
        own = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0, "lag_time": 1e-5}
        values = np.array([own.get(n, size) for n in structure.names])
        return Explanation(
            frozenset({name, "actuator_lag"}), replace(base.fit, structure=structure, parameters=values), 0.0
        )

    assert minute_in(with_offset(-0.99 * largest)) == {name}
    assert minute_in(with_offset(1.01 * largest)) == frozenset()


@pytest.mark.parametrize(
    ("name", "own", "is_moving", "step", "most"),
    [
        ("actuator_lag", "lag_time", True, 0.1, 0.025),
        ("actuator_delay", "delay", True, 1.0, 0.05),
        ("actuator_lag", "lag_time", False, 0.1, 0.0),
    ],
)
def test_a_plane_that_moves_between_rows_is_late_by_no_less_than_they_resolve(
    name: str, own: str, is_moving: bool, step: float, most: float
) -> None:
    dive = replace(hidden_dive(duration=20.0), has_moving_plane=is_moving)
    base, structure = Fitter([dive]).base, structure_of((name,))

    def late(by: float) -> frozenset[str]:
        known = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0, own: by}
        fit = replace(base.fit, structure=structure, parameters=np.array([known[n] for n in structure.names]))
        best, read = Explanation(frozenset({name}), fit, 0.0), [replace(dive, step=step)]
        (said,) = _unnamed(best, None, read) or [""]
        assert f"The model holds an {name.replace('_', ' ')} too short" in said or not said
        return unresolved_in(best, read)

    assert late(0.99 * most) == ({name} if is_moving else set())
    assert late(1.01 * most + 1e-3) == frozenset()
    found, off = replace(base, names=frozenset({name})), misfit(1.0)
    minute = (frozenset({name}), frozenset[str]())
    verdicts = [verdict_on(found, NOTHING, off, off, late=unnamed) for unnamed in minute]
    assert verdicts == ["no_mismatch", "explained"]


@pytest.mark.parametrize(
    ("moment", "verdict"),
    [(1.2e-4, "no_mismatch"), pytest.param(1.2e-2, "explained", marks=pytest.mark.long)],
)
def test_a_minute_moment_is_modelled_and_not_named(moment: float, verdict: Verdict) -> None:
    recording = hidden_dive(lambda *_: (0.0, moment, 0.0), duration=120.0, noise=0.02)
    found = diagnose([replace(recording, speed=np.full(recording.time.size, BASE["u0"]))])
    assert found.verdict == verdict
    assert found.extended.names & {"trim_moment", "rudder_offset", "net_buoyancy"}
    assert bool(found.effects) is (verdict == "explained")
    assert ("too little to be named" in found.remaining) is (verdict == "no_mismatch")


@pytest.mark.parametrize(("after", "verdict"), [(1.0, "no_mismatch"), (3.0, "unexplained")])
def test_a_minute_offset_does_not_excuse_what_was_held_out(after: float, verdict: Verdict) -> None:
    base, structure = Fitter([hidden_dive(duration=20.0)]).base, structure_of(("rudder_offset",))
    own = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0, "rudder_zero": 1e-5}
    fit = replace(base.fit, structure=structure, parameters=np.array([own[n] for n in structure.names]))
    off = misfit(after)
    assert verdict_on(Explanation(frozenset({"rudder_offset"}), fit, 0.0), NOTHING, off, off) == verdict
