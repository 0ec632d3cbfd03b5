"""An unstable hull under an autopilot: a filter follows it, and tells whether anything else acts."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import led_by_filter
from host.diagnosis.search.led_by_filter import led_by_a_filter
from host.diagnosis.search.outset import LOST, ends_of, names_of_all
from host.diagnosis.search.search import Search
from host.recordings.recording import Recording

HULL = {"a1": -1.0, "a2": -1.0, "a3": -0.7, "b1": -0.7, "b2": -3.2, "u0": 1.5, "c_wq": 0.6, "c_qw": 3.9}
GUSTS = np.array([0.004, 0.02])  # m/s^2 and rad/s^2 over sqrt(Hz)
STEPS = 10  # of the integration, from row to row


def flown(stop: float = np.inf, duration: float = 150.0) -> Recording:
    """A dive held by an autopilot that also swings the plane; `stop` is where the plane stops, rad."""
    rng, rows = np.random.default_rng(3), hidden_dive(duration=duration)
    h = rows.step / STEPS
    w, q, theta, zeta = 0.0, 0.0, 0.0, 20.0
    told = np.empty((3, rows.time.size))
    for k in range(rows.time.size):
        command = 0.5 * rows.rudder[k] + 0.5 * theta + 0.35 * q - 0.02 * (zeta - 20.0)
        told[:, k] = theta, zeta, command
        plane = np.clip(command, -stop, stop)
        for _ in range(STEPS):
            force, moment = GUSTS * rng.standard_normal(2) / np.sqrt(h)
            heave = HULL["a1"] * w + HULL["b1"] * plane + HULL["c_wq"] * q + force
            turn = HULL["a2"] * q + HULL["a3"] * theta + HULL["b2"] * plane + HULL["c_qw"] * w + moment
            w, q, theta, zeta = (
                w + h * heave,
                q + h * turn,
                theta + h * q,
                zeta + h * (w - HULL["u0"] * theta),
            )
    pitch, depth = told[:2] + np.array([[2e-3], [1e-2]]) * rng.standard_normal(told[:2].shape)
    speed = np.full_like(pitch, HULL["u0"])
    return replace(rows, pitch=pitch, depth=depth, rudder=told[2], speed=speed)


@cache
def begun(stop: float) -> tuple[Fitter, Explanation]:
    fitter = Fitter([flown(stop)])
    return fitter, next(ends_of(fitter, names_of_all(fitter)))


def led(fitter: Fitter, whole: Explanation) -> Explanation | None:
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        return led_by_a_filter(search, whole)


@pytest.mark.long
def test_an_unstable_hull_is_led_by_a_filter() -> None:
    fitter, whole = begun(np.inf)
    assert fitter.excess(whole.fit) > LOST
    found = led(fitter, whole)
    assert found is not None
    assert found.leaves_white
    values = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    assert all(values[name] == pytest.approx(HULL[name], rel=0.3) for name in ("b1", "b2", "c_wq", "c_qw"))


@pytest.mark.long
def test_what_keeps_its_plane_back_gains_beside_the_forces() -> None:
    fitter, whole = begun(0.08)
    assert fitter.excess(whole.fit) > LOST
    found = led(fitter, whole)
    assert found is not None
    assert "actuator_saturation" in found.names
    assert "fin_stall" not in found.names  # which joins first
    values = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    assert values["plane_limit"] == pytest.approx(0.08, rel=0.03)
    assert all(values[name] == pytest.approx(HULL[name], rel=0.3) for name in ("b1", "b2", "c_wq", "c_qw"))


def test_a_hull_that_a_free_run_follows_needs_no_filter() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    assert led(fitter, fitter.root) is None


class Stub:
    """A search whose sets gain what is told, one after the other."""

    def __init__(self, *gains: dict[str, float]) -> None:
        self._gains, self.workers, self.fitter = list(gains), self, None

    def gains(self, _: Explanation) -> dict[str, float]:
        return {"munk_moment": 0.0} | self._gains.pop(0)

    def growth(self, parent: Explanation, name: str) -> Explanation:
        return replace(parent, names=parent.names | {name}, bic=parent.bic - 1000.0)

    def results(self, tasks: list[Explanation]) -> list[Explanation]:
        return tasks


@pytest.mark.parametrize(
    ("gains", "form", "joined"),
    [
        ([{"munk_moment": 1.0}], 0.0, set()),
        ([{"actuator_delay": 900.0}, {"ballast_change": 1.0}], 0.0, {"actuator_delay"}),
        ([{"depth_sensor_lever_arm": 60.0}, {}], 0.0, {"depth_sensor_lever_arm"}),  # it is there throughout
        ([{"ballast_change": 60.0}], 0.0, set()),  # what passes may follow the forces
        ([{"fin_stall": 60.0}], 0.0, set()),
        ([{"actuator_rate_limit": 60.0}], 0.0, set()),
        # A servo that is late is also slow.
        (
            [{"actuator_delay": 900.0}, {"actuator_rate_limit": 60.0, "fin_stall": 80.0}, {}],
            0.0,
            {"actuator_delay", "actuator_rate_limit"},
        ),
        ([{"actuator_delay": 900.0}], 950.0, None),  # a form promises more
        ([{"actuator_delay": 900.0}, {"ballast_change": 900.0}, {"internal_wave": 900.0}], 0.0, None),
    ],
)
def test_what_gains_beside_the_forces_joins_unless_it_is_too_much_or_of_no_catalogue(
    gains: list[dict[str, float]], form: float, joined: set[str] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(led_by_filter, "form_gains", lambda *_: {"unknown_force_w_w": form})
    monkeypatch.setattr(led_by_filter, "margin", lambda _: 6.0)
    monkeypatch.setattr(led_by_filter, "_among_look_alikes", lambda _, sea: sea)
    monkeypatch.setattr(led_by_filter, "_with_the_place", lambda _, sea: sea)
    sea: Any = Explanation(frozenset(), begun(np.inf)[0].root.fit, 0.0)
    search: Any = Stub(*gains)
    found = led_by_filter._with_what_gains(search, sea)
    assert (None if found is None else {*found.names}) == joined


def test_the_place_of_the_depth_sensor_is_asked_once_nothing_else_gains(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(led_by_filter, "form_gains", lambda *_: {"unknown_force_w_w": 0.0})
    monkeypatch.setattr(led_by_filter, "margin", lambda _: 6.0)
    monkeypatch.setattr(led_by_filter, "_among_look_alikes", lambda _, sea: sea)
    asked: list[frozenset[str]] = []

    def placed(_: Search, sea: Explanation) -> Explanation:
        asked.append(sea.names)
        return replace(sea, names=sea.names | {"depth_sensor_lever_arm"})

    monkeypatch.setattr(led_by_filter, "_with_the_place", placed)
    sea: Any = Explanation(frozenset(), begun(np.inf)[0].root.fit, 0.0)
    search: Any = Stub({"actuator_delay": 900.0}, {"ballast_change": 60.0}, {})
    found = led_by_filter._with_what_gains(search, sea)
    assert asked == [frozenset({"actuator_delay"})]
    assert found is not None
    assert found.names == {"actuator_delay", "depth_sensor_lever_arm"}


def test_what_joined_too_soon_goes_again() -> None:
    worth = {"pitch_bias": -5.0, "vertical_current": 30.0, "actuator_rate_limit": -9.0}
    bic = lambda names: -sum(worth.get(name, 1.0) for name in names)  # noqa: E731
    less = lambda one, names: replace(one, names=names, bic=bic(names))  # noqa: E731
    search: Any = SimpleNamespace(
        workers=SimpleNamespace(results=lambda tasks: [less(*given) for _, given in tasks])
    )
    names = frozenset({*worth, "munk_moment"})
    sea: Any = Explanation(names, begun(np.inf)[0].root.fit, bic(names))
    found = led_by_filter._without_what_joined_too_soon(search, sea, frozenset({"munk_moment"}))
    assert found.names == {"munk_moment", "vertical_current"}


@pytest.mark.parametrize(
    ("worth", "pays"), [((900.0, 40.0), True), ((40.0, 900.0), True), ((20.0, 12.0), False)]
)
def test_the_place_of_the_depth_sensor_is_told_from_where_the_hull_moves_as_before(
    worth: tuple[float, float], pays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(led_by_filter, "margin", lambda _: 14.0)
    fit = SimpleNamespace(samples=3000)
    sea: Any = SimpleNamespace(names=frozenset({"munk_moment"}), fit=fit, bic=0.0)
    search: Any = SimpleNamespace(
        fitter=SimpleNamespace(point=lambda names, _, __, probe: (names, float(probe[0]))),
        workers=SimpleNamespace(
            results=lambda tasks: [
                SimpleNamespace(bic=-one, begun=given) for one, (_, given) in zip(worth, tasks, strict=True)
            ]
        ),
    )
    found: Any = led_by_filter._with_the_place(search, sea)
    assert (found is not sea) == pays
    if pays:
        names, (_, forward) = found.begun
        assert names == {"munk_moment", "depth_sensor_lever_arm"}
        assert (forward > 0) == (worth[0] > worth[1])


def test_the_place_of_the_depth_sensor_is_asked_once() -> None:
    sea: Any = SimpleNamespace(names=frozenset({"depth_sensor_lever_arm"}))
    search: Any = None
    assert led_by_filter._with_the_place(search, sea) is sea


@pytest.mark.parametrize(
    ("worth", "is_white", "are_needed"),
    [
        ((900.0,), False, True),
        ((40.0,), False, False),
        ((40.0,), True, True),
        ((900.0, 40.0), False, True),  # beside what clearly does a little more may
        ((40.0, 50.0), False, False),
    ],
)
def test_what_keeps_the_plane_back_is_worth_much_where_no_white_noise_tells_it(
    worth: tuple[float, ...], is_white: bool, are_needed: bool
) -> None:
    fit = SimpleNamespace(samples=3000)
    sea: Any = SimpleNamespace(
        names=frozenset({"actuator_saturation"}), fit=fit, bic=0.0, leaves_white=is_white
    )
    fewer = [SimpleNamespace(bic=lost) for lost in worth]
    search: Any = SimpleNamespace(workers=SimpleNamespace(results=lambda _: fewer))
    assert led_by_filter._are_needed(search, sea, ["actuator_saturation"]) == are_needed


@pytest.mark.parametrize(
    ("lost", "shows"),
    [((90.0, 90.0), True), ((90.0, 9.0), False), ((90.0, None), False)],
)
def test_a_hull_of_which_a_textbook_knows_all_is_not_led(
    lost: tuple[float | None, ...], shows: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    worth = dict(zip(["munk_moment", "heave_quadratic_drag"], lost, strict=True)) | {"ballast_change": 900.0}
    foretold = lambda _, effect: None if (one := worth[effect.name]) is None else (one, None)  # noqa: E731
    monkeypatch.setattr(led_by_filter, "one_step_without", foretold)
    monkeypatch.setattr(led_by_filter, "margin", lambda _: 6.0)
    fitter: Any = SimpleNamespace(free_parameters=lambda _: 1)
    sea: Any = SimpleNamespace(names=frozenset(worth), fit=SimpleNamespace(samples=3000))
    assert led_by_filter._shows_a_hull(fitter, sea) == shows


@pytest.mark.parametrize(
    ("left", "away", "is_led"), [(2.0, True, True), (3.1, True, False), (1.0, False, False)]
)
def test_a_logger_that_reads_between_readings_is_led_as_well_but_none_that_a_free_run_follows(
    left: float, away: bool, is_led: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, whole = begun(np.inf)
    hull = fitter.root.fit.parameters.copy()
    hull[[0, 1]] = -1.0
    sea = Explanation(fitter.root.names, replace(fitter.root.fit, parameters=hull), whole.bic - 1e6)
    excess = lambda fit: left if fit is sea.fit else LOST + 1.0  # noqa: E731
    monkeypatch.setattr(fitter, "excess", excess)
    monkeypatch.setattr(led_by_filter, "_continued", lambda _: sea)
    monkeypatch.setattr(led_by_filter, "_among_look_alikes", lambda _, one: one)
    monkeypatch.setattr(led_by_filter, "_with_what_gains", lambda _, one: one)
    monkeypatch.setattr(led_by_filter, "_without_what_joined_too_soon", lambda _, one, __: one)
    monkeypatch.setattr(led_by_filter, "_shows_a_hull", lambda *_: True)
    monkeypatch.setattr(led_by_filter, "_needs_forces", lambda *_: away)
    assert (led(fitter, whole) is sea) == is_led
