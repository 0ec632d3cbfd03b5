"""Sets that a search one member at a time cannot reach: many that belong together, two that replace one."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import structure_of
from host.diagnosis.explanation import Explanation, Names
from host.diagnosis.fitter import Fitter
from host.diagnosis.pruning import pruned
from host.diagnosis.search import Search
from host.diagnosis.workers import Workers
from host.gauss_newton import Point
from host.output_error import output_error
from host.propagate import free_run, inputs_of
from host.recording import Recording

NOISE = np.array([[2e-3], [5e-3]])  # rad, m


def flown(values: dict[str, float], names: Names, seed: int = 3) -> Recording:
    """A dive of the catalogue's own equations: only the search is under test."""
    rows, structure = hidden_dive(duration=120.0), structure_of(names)
    known = dict.fromkeys(structure.names, 0.0) | BASE | values
    start = np.array([0.0, 0.0, 0.0, 20.0])
    run = free_run(np.array([known[name] for name in structure.names]), start, inputs_of(rows, structure))
    noisy = run.outputs + NOISE * np.random.default_rng(seed).standard_normal(run.outputs.shape)
    return replace(rows, pitch=noisy[0], depth=noisy[1])


def fitted(fitter: Fitter, names: Names, values: dict[str, float]) -> Explanation:
    """The end of a search from these values."""
    structure, base = structure_of(names), fitter.base.fit
    known = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0} | values
    start = Point(structure, np.array([known[n] for n in structure.names]), base.initial, base.noise)
    fit = output_error(start, fitter.inputs(names), fitter.free(names))
    return Explanation(names, fit, fitter.bic(fit, names))


@pytest.fixture
def quiet() -> list[str]:
    return []


def test_what_every_vehicle_has_joins_at_once(quiet: list[str]) -> None:
    true = {"c_wq": 0.8, "c_ww": -0.8, "c_qq": -3.0, "lag_time": 0.15, "depth_lag_time": 0.6}
    names = frozenset({
        "heave_pitch_rate_coupling", "heave_quadratic_drag", "pitch_quadratic_damping", "actuator_lag",
        "depth_sensor_lag",
    })  # fmt: skip
    fitter = Fitter([flown(true, names)])
    bent = (names | {"trim_moment", "ballast_change"}) - {"heave_pitch_rate_coupling", "heave_quadratic_drag"}
    wrong = fitted(fitter, bent, true | {"c_q0": 0.0, "c_wb": 0.0, "ballast_time": 60.0})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, quiet.append, fitter.base, fitter.trimmed())
        search.remember(wrong)
        found = search.completed(wrong)
    assert quiet == ["what every vehicle has beside it"]
    assert found.names == names
    assert found.bic < wrong.bic


def test_lags_of_both_sensors_give_way_to_one_of_the_plane(quiet: list[str]) -> None:
    names = frozenset({"actuator_lag", "heave_pitch_rate_coupling"})
    fitter = Fitter([flown({"c_wq": 0.8, "lag_time": 0.1}, names)])
    lags = {"lag_time": 0.065, "pitch_lag_time": 0.035, "depth_lag_time": 0.035}
    many = fitted(fitter, names | {"pitch_sensor_lag", "depth_sensor_lag"}, lags | {"c_wq": 0.8})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, quiet.append, fitter.base, fitter.trimmed())
        assert pruned(search, search.remember(many)).names == names
