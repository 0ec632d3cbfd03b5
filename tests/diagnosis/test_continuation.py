"""Many effects found at once where the free run tells nothing: the measurements steer the state at first."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from host.catalogue import ORDINARY
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis import continuation as module
from host.diagnosis.continuation import continued
from host.diagnosis.fitter import Fitter
from host.diagnosis.search import Search
from host.diagnosis.workers import Workers
from host.recording import Recording

NAMES = frozenset({*ORDINARY, FREE_TRIM.name})
WEAKENED_AT, WEAKENED_BY = 70.0, 0.4


def unstable_dive(is_weakened: bool) -> Recording:
    """A hull that its heave turns broadside (Munk) faster than its weight rights it, held by drag alone.

    From 70 s on its plane has lost two fifths, if so. Integrated by scipy; speed measured, constant.
    """
    rng = np.random.default_rng(3)
    h, rows = 0.1, 1400
    rudder, at = np.zeros(rows), 30
    while at < rows:
        until = at + int(rng.uniform(15, 50))
        rudder[at:until] = rng.uniform(-0.12, 0.12)
        at = until
    x, states = np.array([0.0, 0.0, 0.0, 20.0]), np.empty((4, rows))
    for k in range(rows):
        states[:, k] = x
        share = 1.0 - WEAKENED_BY * (is_weakened and k * h >= WEAKENED_AT)

        def rate(_: float, x: np.ndarray, plane: float = share * rudder[k]) -> list[float]:  # type: ignore[type-arg]
            w, q, theta, _ = x
            return [
                -0.65 * w - 1.8 * w * abs(w) + 0.6 * q - 0.2 * plane,
                -0.7 * q - 23.0 * q * abs(q) - 0.72 * np.sin(theta) + 4.6 * w - 1.45 * plane,
                q,
                w * np.cos(theta) - 1.5 * np.sin(theta),
            ]

        x = solve_ivp(rate, (0.0, h), x, rtol=1e-8, atol=1e-10).y[:, -1]
    return Recording(
        name="unstable.csv",
        sha256="0" * 64,
        time=np.arange(rows) * h,
        depth=states[3] + 0.008 * rng.standard_normal(rows),
        pitch=states[2] + np.deg2rad(0.08) * rng.standard_normal(rows),
        rudder=rudder,
        speed=np.full(rows, 1.5),
        pitch_rate=np.full(rows, np.nan),
        step=h,
    )


def search_of(workers: Workers, fitter: Fitter) -> Search:
    return Search(fitter, workers, lambda _: None, fitter.base, fitter.root)


def test_what_a_free_run_cannot_find_is_found_while_the_measurements_steer() -> None:
    fitter = Fitter([unstable_dive(is_weakened=True)])
    assert fitter.excess(fitter.root.fit) > 100.0  # a linear hull has nothing to do with it
    with Workers(fitter, 1) as workers:
        found = continued(search_of(workers, fitter), NAMES, most_beside=3)
    assert found is not None
    found = fitter.polished(found)
    values = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))
    assert fitter.excess(found.fit) < 1.15
    assert values["effectiveness_step"] == pytest.approx(-WEAKENED_BY, abs=0.02)
    assert values["c_qw"] == pytest.approx(4.6, rel=0.1)
    assert values["c_qq"] == pytest.approx(-23.0, rel=0.1)


def test_where_nothing_else_acts_nothing_joins() -> None:
    fitter = Fitter([unstable_dive(is_weakened=False)])
    with Workers(fitter, 1) as workers:
        found = continued(search_of(workers, fitter), NAMES, most_beside=3)
    assert found is not None
    assert found.names == NAMES
    assert fitter.excess(fitter.polished(found).fit) < 1.15


def test_a_recording_that_the_filter_loses_has_no_continuation(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([unstable_dive(is_weakened=False)])
    monkeypatch.setattr(module, "_steered", lambda *_: [])
    with Workers(fitter, 1) as workers:
        assert continued(search_of(workers, fitter), NAMES, most_beside=3) is None
