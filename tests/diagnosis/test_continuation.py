"""Many effects found at once where the free run tells nothing: the measurements steer the state at first."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from host.catalogue import ORDINARY
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import continuation as module
from host.diagnosis.search.continuation import STAGES, continued
from host.diagnosis.search.search import Search
from host.likelihood import straightened
from host.likelihood.gauss_newton import Point
from host.recordings.recording import Recording

NAMES = frozenset({*ORDINARY, FREE_TRIM.name})
BEGUN = NAMES | {"pitch_bias", "vertical_current"}
WEAKENED_AT, WEAKENED_BY = 70.0, 0.4
HALF_LENGTH = 0.8  # m
NOTHING_LEFT = 1.2  # times a noise floor which, told from these 900 rows, is a fifth low in pitch
Hull = dict[str, float]
# Its heave turns it broadside (Munk) faster than its weight rights it, and drag alone holds it.
SHORT = {
    "a1": -0.65, "c_ww": -1.8, "c_wq": 0.6, "b1": -0.2,
    "a2": -0.7, "c_qq": -23.0, "a3": -0.72, "c_qw": 4.6, "b2": -1.45,
}  # fmt: skip
LONG = {
    "a1": -0.93, "c_ww": -2.3, "c_wq": 0.76, "b1": -0.72,
    "a2": -1.6, "c_qq": -2.4, "a3": -0.5, "c_qw": 1.1, "b2": -2.8,
}  # fmt: skip
Drag = Callable[[float, float], tuple[float, float]]


def two_drags(w: float, q: float) -> tuple[float, float]:
    return w * abs(w), q * abs(q)


def along_the_hull(w: float, q: float) -> tuple[float, float]:
    """Of 40 strips of a hull 2 x HALF_LENGTH long, each in the water that it meets."""
    y = HALF_LENGTH * (np.arange(40) - 19.5) / 20.0
    local = (w - y * q) * np.abs(w - y * q)
    return float(np.mean(local)), float(-4.0 / HALF_LENGTH**3 * np.mean(y * local))


def dive(
    hull: Hull,
    drag: Drag = two_drags,
    rows: int = 900,
    is_weakened: bool = False,
    servo: float = 1e-3,
    current: float = 0.0,
) -> Recording:
    """Integrated by scipy; speed measured, constant. From 70 s on the plane has lost two fifths, if so.

    servo    s, its time constant
    current  m/s, downwards
    """
    rng = np.random.default_rng(3)
    h = 0.1
    rudder, at = np.zeros(rows), 30
    while at < rows:
        until = at + int(rng.uniform(15, 50))
        rudder[at:until] = rng.uniform(-0.12, 0.12)
        at = until
    x, states = np.array([0.0, 0.0, 0.0, 20.0, 0.0]), np.empty((5, rows))
    for k in range(rows):
        states[:, k] = x
        share = 1.0 - WEAKENED_BY * (is_weakened and k * h >= WEAKENED_AT)

        def rate(_: float, x: np.ndarray, command: float = rudder[k], share: float = share) -> list[float]:  # type: ignore[type-arg]
            w, q, theta, _, angle = x
            plane = share * angle
            heaving, turning = drag(w, q)
            return [
                hull["a1"] * w + hull["c_ww"] * heaving + hull["c_wq"] * q + hull["b1"] * plane,
                hull["a2"] * q
                + hull["c_qq"] * turning
                + hull["a3"] * np.sin(theta)
                + hull["c_qw"] * w
                + hull["b2"] * plane,
                q,
                w * np.cos(theta) - 1.5 * np.sin(theta) + current,
                (command - angle) / servo,
            ]

        x = solve_ivp(rate, (0.0, h), x, rtol=1e-8, atol=1e-10).y[:, -1]
    return Recording(
        name="hull.csv",
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


@pytest.mark.long
def test_what_a_free_run_cannot_find_is_found_while_the_measurements_steer() -> None:
    fitter = Fitter([dive(SHORT, rows=1400, is_weakened=True)])
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


@pytest.mark.long
def test_where_nothing_else_acts_nothing_joins() -> None:
    fitter = Fitter([dive(SHORT)])
    with Workers(fitter, 1) as workers:
        found = continued(search_of(workers, fitter), NAMES, most_beside=3)
    assert found is not None
    assert found.names == BEGUN
    assert fitter.excess(fitter.polished(found).fit) < NOTHING_LEFT


# Of the shorter one the first end lies in a side valley.
@pytest.mark.long
@pytest.mark.parametrize("rows", [900, 1400])
def test_a_long_hull_that_meets_the_water_differently_at_either_end(rows: int) -> None:
    fitter = Fitter([dive(LONG, drag=along_the_hull, rows=rows)])
    with Workers(fitter, 1) as workers:
        found = continued(search_of(workers, fitter), NAMES, most_beside=3)
    assert found is not None
    assert found.names == BEGUN | {"drag_along_the_hull"}
    found = fitter.polished(found)
    values = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))
    assert fitter.excess(found.fit) < NOTHING_LEFT
    assert values["drag_half_length"] == pytest.approx(HALF_LENGTH, rel=0.15)


def begun_with(fitter: Fitter, values: Hull, share: float) -> Point:
    at = module._begun(fitter, NAMES, fitter.speed, {})
    own = zip(at.structure.names, at.parameters, strict=True)
    known = np.array([values.get(name, value) for name, value in own])
    return module._forced(fitter, replace(at, parameters=known), share)


def test_a_hull_that_was_taken_for_a_slow_servo_is_asked_about_the_other_way_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitter = Fitter([dive(LONG, servo=0.1)])
    grown = -4.3 / LONG["a3"]  # of LONG, a pole of pitch at -0.43 and one in the place of the servo's
    wrong = LONG | {name: LONG[name] * grown for name in ("a3", "b2", "c_qw", "c_qq")}
    wrong |= {"a2": -10.4, "lag_time": 0.85}
    asked: list[Point] = []

    def stuck(search: Search, names: Names, known: object) -> list[Explanation]:  # noqa: ARG001
        return [module._climbed(fitter, begun_with(fitter, wrong, STAGES[0]), 0)]

    def steered(_: Search, points: list[Point], steps: int = 0) -> list[Explanation]:  # noqa: ARG001
        asked.extend(points)
        return []

    monkeypatch.setattr(module, "_with_what_is_large", stuck)
    monkeypatch.setattr(module, "_steered", steered)
    with Workers(fitter, 1) as workers:
        assert continued(search_of(workers, fitter), NAMES, most_beside=0) is None
    known = [dict(zip(point.structure.names, point.parameters, strict=True)) for point in asked]
    near = [one for one in known if one["lag_time"] == pytest.approx(0.1, abs=0.01)]
    assert any({name: one[name] for name in LONG} == pytest.approx(LONG, rel=0.02) for one in near)


def test_a_damping_that_began_at_next_to_nothing_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([dive(SHORT)])
    idle = {"a2": -0.008, "a3": -0.52, "b2": -1.1, "c_qw": 2.9, "c_qq": -18.9}
    start = begun_with(fitter, SHORT | idle, STAGES[0])
    a2 = start.structure.names.index("a2")
    assert module._climbed(fitter, start, 10).fit.parameters[a2] == pytest.approx(SHORT["a2"], rel=0.7)
    monkeypatch.setattr(straightened, "HARDLY_DAMPS", 0.0)
    assert module._climbed(fitter, start, 10).fit.parameters[a2] > -0.1


@pytest.mark.long
def test_a_current_joins_beside_the_free_trim_that_cannot_do_its_work() -> None:
    fitter = Fitter([dive(LONG, current=0.1)])
    with Workers(fitter, 1) as workers:
        found = continued(search_of(workers, fitter), NAMES, most_beside=3)
    assert found is not None
    assert found.names & {"vertical_current", "pitch_bias"}
    assert fitter.excess(fitter.polished(found).fit) < NOTHING_LEFT


def test_what_is_lacking_is_asked_where_fewer_forces_are_less_likely(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([dive(LONG, rows=300)])
    least, slightly, by_far = 0.0, 15.0, 50.0  # of BIC, the latter two above the least
    bic = iter([*np.linspace(90.0, least, 7), slightly, slightly, by_far, by_far, by_far])
    now: list[float] = []
    asked: list[float] = []

    def under(search: Search, followed: list[Explanation], *_: object) -> list[Explanation]:  # noqa: ARG001
        if not followed:
            return []
        now.append(next(bic))
        return [replace(followed[0], bic=now[-1])]

    def larger(*_: object) -> list[Explanation]:
        asked.append(now[-1])
        return []

    stubs = {"_with_what_is_large": lambda *_: [fitter.root], "_under": under, "_larger": larger}
    stubs |= {"_left": lambda _: 1.0, "_moved": lambda _, one: one, "with_poles_swapped": lambda _: []}
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    with Workers(fitter, 1) as workers:
        continued(search_of(workers, fitter), fitter.root.names, most_beside=3)
    assert asked == [slightly, by_far]


def test_a_recording_that_the_filter_loses_has_no_continuation(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([dive(SHORT)])
    monkeypatch.setattr(module, "_steered", lambda *_: [])
    with Workers(fitter, 1) as workers:
        assert continued(search_of(workers, fitter), NAMES, most_beside=3) is None
