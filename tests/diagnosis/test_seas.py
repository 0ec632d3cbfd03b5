"""Waves are named by their swing, and what acts beside them is still found."""

import numpy as np
import pytest
from hidden_dive import Extra, hidden_dive

from host.diagnosis.diagnose import diagnose
from host.diagnosis.fitter import Fitter
from host.diagnosis.sea_fits import with_sea
from host.diagnosis.search import Search
from host.diagnosis.seas import among_waves
from host.diagnosis.workers import Workers
from host.recording import Array


def in_waves(extra: Extra, height: float, swing: float) -> Extra:
    """The effect, and an irregular sea of twelve waves: m/s^2 and rad/s^2 each."""
    rng = np.random.default_rng(4)
    met = rng.uniform(0.8, 1.6, 12)  # rad/s
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, 12))

    def rough(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        force, moment = np.sin(met * time + phases).sum(axis=1)
        own = extra(time, x, plane)
        return own[0] + height * force, own[1] + swing * moment, own[2]

    return rough


def test_a_coupling_is_found_among_waves() -> None:
    coupled = in_waves(lambda time, x, plane: (0.8 * x[1], 0.0, 0.0), 0.01, 0.02)  # noqa: ARG005
    found = diagnose([hidden_dive(coupled, duration=90.0)])
    names = [effect.name for effect in found.effects]
    assert names.count("surface_waves") == 1
    coupling = next(effect for effect in found.effects if effect.name != "surface_waves")
    assert "heave_pitch_rate_coupling" in {coupling.name, *coupling.twins}
    assert "surface_waves" in found.extended.names
    assert found.has_sea


def test_waves_are_estimated_beside_what_was_found_without_them(monkeypatch: pytest.MonkeyPatch) -> None:
    damped = in_waves(lambda time, x, plane: (0.0, -6.0 * x[1] * abs(x[1]), 0.0), 0.01, 0.06)  # noqa: ARG005
    fitter = Fitter([hidden_dive(damped, duration=90.0)])
    calm = fitter.grown(fitter.base, "pitch_quadratic_damping", [])
    base, root = with_sea(fitter, fitter.base), with_sea(fitter, fitter.trimmed())
    monkeypatch.setattr(Search, "run", lambda _, also: min(also, key=lambda e: e.bic))
    with Workers(fitter, 1) as workers:
        for known, names in ((fitter.base, set()), (calm, {"pitch_quadratic_damping"})):
            rough = Search(fitter, workers, lambda _: None, base, root)
            _, found, waves = among_waves(rough, base, known)
            assert waves is not None
            assert found.names == waves.fitted.names == names


def test_a_band_broader_than_that_of_any_sea_is_no_waves(monkeypatch: pytest.MonkeyPatch) -> None:
    rough = in_waves(lambda time, x, plane: (0.0, 0.0, 0.0), 0.01, 0.06)  # noqa: ARG005
    fitter = Fitter([hidden_dive(rough, duration=90.0)])
    base, root = with_sea(fitter, fitter.base), with_sea(fitter, fitter.trimmed())
    monkeypatch.setattr(Search, "run", lambda _, also: min(also, key=lambda e: e.bic))
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, base, root)
        assert among_waves(search, base, fitter.base)[2] is not None
        monkeypatch.setattr("host.diagnosis.seas.BROADEST", 0.001)
        assert among_waves(search, base, fitter.base)[2] is None
