"""What is foretold over a few seconds from where a filter is."""

from dataclasses import replace

import numpy as np
import pytest

from host.catalogue import structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.proof import foretold
from host.diagnosis.proof.foretold import foretold_errors
from host.diagnosis.proof.scoring import misfit
from host.diagnosis.recordings.spans import divide
from host.dynamics.propagate import free_run, inputs_of
from tests.diagnosis.hidden_dive import BASE, hidden_dive
from tests.diagnosis.test_unstable_hull import NOISE, flown


def test_an_unstable_hull_is_foretold_where_no_free_run_follows_it() -> None:
    fitter, best = flown(0.12)
    fit = replace(best.fit, noise=np.array([*fitter.floor, 1e-6, 1e-4]))
    known = replace(best, fit=fit)
    spans = divide(fitter.recordings)
    run, ahead = misfit(known, spans, fitter.floor), misfit(known, spans, fitter.floor, horizon=2.0)
    assert ahead.chi2 < 0.6 * run.chi2
    assert ahead.chi2 < 3.0


@pytest.mark.parametrize("horizon", [0.1, 1.0, 4.0])
def test_the_first_row_of_each_stretch_is_one_step_ahead(horizon: float) -> None:
    fitter, best = flown(0.0)
    known = replace(best, fit=replace(best.fit, noise=np.array([*fitter.floor, 1e-8, 1e-8])))
    (recording,) = fitter.recordings
    errors = foretold_errors(known, recording, horizon)
    assert np.isnan(errors[:, recording.time < recording.time[0] + 5.0]).all()
    told = errors[:, recording.time >= recording.time[0] + 5.0]
    assert np.isfinite(told).all()
    assert np.sqrt(np.mean(told**2, axis=1)) == pytest.approx(NOISE.ravel(), rel=0.15)


def test_what_leaves_the_numbers_is_infinitely_far_off() -> None:
    fitter, best = flown(0.0)
    values = best.fit.parameters.copy()
    values[best.fit.structure.names.index("c_qq")] = 1e4  # a drag that drives
    lost = replace(
        best, fit=replace(best.fit, parameters=values, noise=np.array([*fitter.floor, 1e-8, 1e-8]))
    )
    errors = foretold_errors(lost, fitter.recordings[0], 20.0)
    assert np.isinf(errors[0]).any()


def test_no_stretch_is_told_by_what_comes_after_it() -> None:
    fitter, best = flown(0.0)
    known = replace(best, fit=replace(best.fit, noise=np.array([*fitter.floor, 1e-6, 1e-6])))
    (recording,) = fitter.recordings
    other = replace(recording, pitch=recording.pitch.copy(), depth=recording.depth.copy())
    late = recording.time >= recording.time[0] + 5.0 + 8.0
    other.pitch[late] += 1.0
    before = foretold_errors(known, recording, 4.0)[:, ~late]
    assert np.array_equal(foretold_errors(known, other, 4.0)[:, ~late], before, equal_nan=True)


@pytest.mark.parametrize("is_spread", [True, False])
def test_a_filter_finds_the_speed_at_which_a_recording_begins(
    is_spread: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(foretold, "FIRST_LOSS", foretold.FIRST_LOSS * is_spread)
    dive = hidden_dive(duration=120.0)
    structure = structure_of(("speed_loss",))
    known = dict.fromkeys(structure.names, 0.0) | BASE | {"speed_time": 1000.0}
    values = np.array([known[name] for name in structure.names])
    run = free_run(values, np.array([0.0, 0.0, 0.0, 20.0, 0.6]), inputs_of(dive, structure))
    rng = np.random.default_rng(3)
    pitch, depth = run.outputs + NOISE * rng.standard_normal(run.outputs.shape)
    fitter = Fitter([replace(dive, pitch=pitch, depth=depth)])
    noise = np.array([*fitter.floor, 1e-8, 1e-8])
    fit = replace(fitter.base.fit, structure=structure, parameters=values, noise=noise)
    errors = foretold_errors(Explanation(structure.effect_names, fit, 0.0), fitter.recordings[0], 5.0)
    late = np.nanmean(errors[:, 600:] ** 2, axis=1) / NOISE.ravel() ** 2
    assert (late < 2.0).all() == is_spread
