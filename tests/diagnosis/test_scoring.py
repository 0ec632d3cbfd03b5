"""The score of a free run on stretches that it did not learn from."""

import warnings
from dataclasses import replace

from hidden_dive import hidden_dive

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.scoring import misfit
from host.diagnosis.spans import divide
from host.equations import NAMES


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
