"""What is foretold over a few seconds from where a filter is."""

from dataclasses import replace

import numpy as np
import pytest

from host.diagnosis.proof.foretold import foretold_errors
from host.diagnosis.proof.scoring import misfit
from host.diagnosis.recordings.spans import divide
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
