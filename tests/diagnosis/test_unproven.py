"""What was likelier on the stretches that were fitted, and misleads on those held out."""

from dataclasses import replace

import pytest
from hidden_dive import hidden_dive

from host.diagnosis import judge as judging
from host.diagnosis.diagnose import _unnamed
from host.diagnosis.disturbances.seas import Explained
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.workers import Workers
from host.diagnosis.judge import NamedEffect, judge
from host.diagnosis.proof.unproven import unproven_in
from host.diagnosis.recordings.spans import divide
from host.diagnosis.search.search import Search


def test_only_what_few_vehicles_have_and_clearly_misleads() -> None:
    gains = {"ballast_change": -0.12, "trim_moment": -0.1, "net_buoyancy": 0.3, "speed_loss": -5.0}
    assert unproven_in(gains) == {"ballast_change"}


LAG, COUPLING = "depth_sensor_lag", "heave_pitch_rate_coupling"


@pytest.mark.parametrize(
    ("gains", "named", "verdict"),
    [
        ({LAG: -0.5, COUPLING: 0.9}, [COUPLING], "partly_explained"),
        ({LAG: -0.05, COUPLING: 0.9}, [LAG, COUPLING], "partly_explained"),
        ({LAG: -0.5}, [], "unexplained"),
    ],
)
def test_it_is_modelled_and_not_named(
    gains: dict[str, float], named: list[str], verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spans = divide([hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), duration=60.0)])
    fitter = Fitter(spans.teaching)
    best = fitter.grown(fitter.base, COUPLING, [])
    effects = [NamedEffect(name=name, delta_bic=50.0, heldout_gain=gain) for name, gain in gains.items()]
    monkeypatch.setattr(judging, "_named", lambda *_: effects)
    monkeypatch.setattr(judging, "verdict_on", lambda *_: "partly_explained")
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        left = replace(leftover(fitter, best), is_coloured=True)
        judged = judge(Explained(best, search, left, None), spans, fitter.floor, lambda _: None)
    assert [effect.name for effect in judged.effects] == named
    assert judged.verdict == verdict
    assert (LAG in judged.unproven) is (LAG not in named)
    said = " ".join(_unnamed(best, None, [], judged.unproven))
    assert ("a depth sensor lag without which" in said) is (LAG not in named)
