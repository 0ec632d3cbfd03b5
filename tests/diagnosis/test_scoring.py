"""The score of a free run on stretches that it did not learn from."""

import warnings
from dataclasses import replace

import numpy as np
from hidden_dive import hidden_dive

from host.catalogue import structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.sea_fits import with_sea
from host.diagnosis.proof.scoring import foretells, misfit
from host.diagnosis.recordings.spans import divide
from host.dynamics.equations import NAMES
from host.dynamics.propagate import free_run, inputs_of
from host.noise.noise_floor import noise_floor
from host.recordings.recording import Array


def test_a_run_that_leaves_the_numbers_is_as_far_off_as_can_be() -> None:
    spans = divide([hidden_dive(duration=90.0)])
    fitter = Fitter(spans.teaching)
    fit = fitter.base.fit
    unstable = fit.parameters.copy()
    unstable[NAMES.index("a2")] = 1e4
    lost = Explanation(frozenset(), replace(fit, parameters=unstable), 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert misfit(lost, spans, fitter.floor).chi2 > 1e12
        assert misfit(fitter.base, spans, fitter.floor).chi2 < 2.0


def test_among_random_forces_a_lost_speed_arrives_where_it_is_judged() -> None:
    """A hull slow to regain its speed is still slow there: one that began anew would be at full speed."""
    names = frozenset({"speed_loss"})
    structure, rows, rng = structure_of(names), hidden_dive(duration=90.0), np.random.default_rng(2)
    known = {"a1": -0.6, "a2": -1.5, "a3": -1.0, "b1": 0.3, "b2": -0.8, "u0": 2.0}
    known |= {"speed_time": 60.0, "c_ud": 3.0, "c_uq": 0.0}
    values = np.array([known.get(name, 0.0) for name in structure.names])
    start = np.array([0.0, 0.0, 0.0, 20.0, 0.0])
    run = free_run(values, start, inputs_of(rows, structure))
    assert run.states[structure.states.index("speed_loss")].min() < -0.5
    noise = np.array([[2e-3], [1e-2]]) * rng.standard_normal(run.outputs.shape)
    pitch, depth = run.outputs + noise
    spans = divide([replace(rows, pitch=pitch, depth=depth)])
    fitter = Fitter(spans.teaching)
    floor = noise_floor(spans.teaching)
    forces = np.array([*floor, 1e-8, 1e-8])
    truth = replace(fitter.base.fit, structure=structure, parameters=values, initial=[start], noise=forces)
    after = misfit(Explanation(names, truth, 0.0), spans, floor)
    assert after.chi2_depth < 1.5
    assert after.chi2_pitch < 1.5


def test_among_random_forces_only_what_acts_foretells_the_next_seconds_better() -> None:
    gusts = 0.1 * np.random.default_rng(2).standard_normal(1001)

    def turned(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return float(gusts[int(10.0 * time)]), 3.0 * x[0], 0.0

    recording = hidden_dive(turned, duration=100.0)
    spans, floor = divide([recording]), noise_floor([recording])
    fitter = Fitter(spans.teaching)
    base = with_sea(fitter, fitter.base)
    acting, idle = (
        fitter.polished(fitter.grown(base, name, [])) for name in ("munk_moment", "heave_quadratic_drag")
    )
    assert base.fit.has_process_noise
    assert foretells(base, acting, spans, floor, 5.0)
    assert not foretells(base, idle, spans, floor, 5.0)
