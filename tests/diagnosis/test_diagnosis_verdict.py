"""The verdict on an explanation that leaves nothing, little or much, and what is said of the rest."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import Leftover
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.proof.slight import is_slight
from host.diagnosis.proof.verdict import (
    FAINT_WAVES,
    Verdict,
    beyond_bounds_in,
    beyond_geometry_in,
    breaking_in,
    cancelling_in,
    rare_in,
    remaining,
    undamped_in,
    verdict_on,
)

COMMON = {"heave_pitch_rate_coupling", "munk_moment", "speed_loss", "actuator_lag", "net_buoyancy"}
RARE = ("ballast_change", "depth_sensor_lever_arm", "internal_wave")


@pytest.fixture(scope="module")
def base() -> Explanation:
    return Fitter([hidden_dive(duration=40.0)]).base


def named(base: Explanation, *names: str) -> Explanation:
    """The fit of the base, as if it were that of a set: the verdict looks at names and noise only."""
    return Explanation(frozenset(names), base.fit, base.bic)


def misfit(chi2: float) -> Misfit:
    return Misfit(depth_rmse_m=0.0, pitch_rmse_rad=0.0, chi2_depth=chi2, chi2_pitch=chi2)


def leftover(*, is_smooth: bool = False) -> Leftover:
    return Leftover(
        is_coloured=False, is_local=False, is_by_speed=False, is_no_sea=False, is_above_floor=False,
        smooth_gain=0.0, is_smooth=is_smooth,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("names", "is_smooth", "after", "verdict"),
    [
        ((), False, 1.0, "no_mismatch"),
        (RARE[:2], False, 1.0, "explained"),
        ((*COMMON, *RARE[:2]), False, 1.0, "explained"),
        (RARE, False, 1.0, "partly_explained"),
        (RARE[:1], True, 1.0, "partly_explained"),
        (RARE[:1], True, 4.0, "unexplained"),
        ((), True, 5.0, "unexplained"),
    ],
)
def test_verdict(
    base: Explanation, names: tuple[str, ...], is_smooth: bool, after: float, verdict: Verdict
) -> None:
    left = leftover(is_smooth=is_smooth)
    assert verdict_on(named(base, *names), left, misfit(5.0), misfit(after)) == verdict


def test_what_foretells_nothing_better_has_not_explained_it(base: Explanation) -> None:
    found = named(base, RARE[0])
    for foretells, verdict in ((True, "explained"), (False, "partly_explained")):
        assert verdict_on(found, leftover(), misfit(7.0), misfit(6.0), foretells=foretells) == verdict
    assert "does not hold" in remaining("partly_explained", found, leftover(), misfit(6.0))


def test_many_effects_that_few_vehicles_have_are_doubted_by_name(base: Explanation) -> None:
    crowd = named(base, *COMMON, *RARE)
    assert sorted(rare_in(crowd)) == sorted(RARE)
    assert rare_in(named(base, RARE[0], "ballast_off_centre", "drag_along_the_hull")) == [RARE[0]]
    said = remaining("partly_explained", crowd, leftover(), misfit(1.0))
    assert said.startswith("Nothing else is left, but internal wave, ballast change, ")
    assert "may imitate physics that the catalogue does not hold" in said
    off = remaining("partly_explained", crowd, leftover(), misfit(4.0))
    assert "what was learnt does not hold on the stretches that were held out" in off


@pytest.mark.parametrize(("chi2", "off"), [(9.0, "3.0 times its"), (1.1, "hardly more than its")])
def test_what_is_left_is_told_by_its_size(base: Explanation, chi2: float, off: str) -> None:
    said = remaining("partly_explained", named(base, RARE[0]), leftover(is_smooth=True), misfit(chi2))
    assert f"is still off by {off} sensor noise in a free run" in said


def test_what_explains_all_but_the_stretches_that_were_held_out_says_so(base: Explanation) -> None:
    one = named(base, RARE[0])
    assert remaining("explained", one, leftover(), misfit(1.2)).endswith("sensors' own noise.")
    assert "held out pitch is off by 3.0 times it" in remaining("explained", one, leftover(), misfit(9.0))


@pytest.mark.parametrize(
    ("names", "before", "after", "is_trace"),
    [
        (COMMON, 5000.0, 1.4, True),
        (COMMON | {RARE[0]}, 5000.0, 1.4, True),
        (COMMON | {*RARE[:2]}, 5000.0, 1.4, False),
        ({RARE[0], "net_buoyancy"}, 5000.0, 1.4, False),
        (COMMON, 300.0, 1.4, False),
        (COMMON, 5000.0, 2.1, False),
    ],
)
def test_a_trace_is_left_of_a_real_vehicle_that_is_all_but_told(
    base: Explanation, names: set[str], before: float, after: float, is_trace: bool
) -> None:
    assert is_slight(named(base, *names), misfit(before), misfit(after)) == is_trace


def test_the_verdict_does_not_hang_on_a_trace_which_is_told(base: Explanation) -> None:
    left, found = leftover(is_smooth=True), named(base, *COMMON)
    names = frozenset({*COMMON, "unknown_moment_delta_delta"})
    known = dict.fromkeys(structure_of(names).names, 0.0) | values_of(base)
    formed = explanation_with(base, names, known)
    for one, told in ((found, "too little to name"), (formed, "delta times delta")):
        assert verdict_on(one, left, misfit(5000.0), misfit(1.2)) == "partly_explained"
        assert verdict_on(one, left, misfit(5000.0), misfit(1.2), is_slight=True) == "explained"
        said = remaining("explained", one, left, misfit(1.2))
        assert "A trace is left of physics" in said
        assert told in said
    assert "trace" not in remaining("explained", found, leftover(), misfit(1.2))


def values_of(base: Explanation) -> dict[str, float]:
    return dict(zip(base.fit.structure.names, base.fit.parameters.tolist(), strict=True))


def explanation_with(base: Explanation, names: frozenset[str], known: dict[str, float]) -> Explanation:
    """A set with these coefficients, each known to a deviation of 1."""
    structure = structure_of(names)
    values = np.array([known[name] for name in structure.names])
    free, information = np.ones(values.size, dtype=bool), np.eye(values.size)
    fit = replace(base.fit, structure=structure, parameters=values, free=free, information=information)
    return Explanation(names, fit, base.bic)


@pytest.mark.parametrize(("left_over", "verdict"), [(0.01, "partly_explained"), (0.2, "explained")])
def test_offsets_that_cancel_are_doubted_by_name(
    base: Explanation, left_over: float, verdict: Verdict
) -> None:
    offsets = frozenset({"net_buoyancy", "rudder_offset", "trim_moment"})
    known = values_of(base)
    known |= {"rudder_zero": 0.2, "c_w0": -0.2 * known["b1"], "c_q0": -0.2 * known["b2"] * (1.0 + left_over)}
    best = explanation_with(base, offsets, known)
    assert bool(cancelling_in(best)) == (verdict == "partly_explained")
    assert verdict_on(best, leftover(), misfit(5.0), misfit(1.0)) == verdict
    said = remaining(verdict, best, leftover(), misfit(1.0))
    assert ("net buoyancy, rudder offset, trim moment cancel:" in said) == (verdict == "partly_explained")
    assert not cancelling_in(replace(best, names=offsets - {"trim_moment"}))


@pytest.mark.parametrize("turning", ["rudder_offset", "trim_moment"])
@pytest.mark.parametrize(("left_over", "verdict"), [(0.01, "partly_explained"), (0.2, "explained")])
def test_a_zero_error_of_pitch_that_a_current_and_a_moment_undo_is_doubted(
    base: Explanation, turning: str, left_over: float, verdict: Verdict
) -> None:
    known = values_of(base)
    moment = known["a3"] * 0.2
    known |= {"pitch_zero": 0.2, "current": -0.2 * known["u0"] * (1.0 + left_over)}
    known |= {"rudder_zero": moment / known["b2"], "c_q0": moment}
    names = ["pitch_bias", "vertical_current", turning]
    best = explanation_with(base, frozenset(names), known)
    assert cancelling_in(best) == (names if verdict == "partly_explained" else [])
    assert verdict_on(best, leftover(), misfit(5.0), misfit(1.0)) == verdict


@pytest.mark.parametrize(
    ("share", "is_doubted", "is_alone"),
    [(0.99, True, True), (0.9, True, False), (-0.99, False, False), (0.5, False, False)],
)
def test_a_current_that_cancels_a_weight_is_doubted_sooner_beside_a_drag(
    base: Explanation, share: float, is_doubted: bool, is_alone: bool
) -> None:
    names = frozenset({"heave_quadratic_drag", "net_buoyancy", "vertical_current"})
    known = values_of(base)
    known |= {"c_ww": -1.0, "c_w0": 0.01, "current": share * 0.01 / known["a1"]}
    best = explanation_with(base, names, known)
    assert bool(cancelling_in(best)) == is_doubted
    verdict = verdict_on(best, leftover(), misfit(5.0), misfit(1.0))
    assert verdict == ("partly_explained" if is_doubted else "explained")
    alone = cancelling_in(replace(best, names=names - {"heave_quadratic_drag"}))
    assert alone == (["net_buoyancy", "vertical_current"] if is_alone else [])


@pytest.mark.parametrize(
    ("effect", "own", "share", "is_doubted"),
    [
        ("heave_pitch_rate_coupling", "c_wq", 1.9, False),
        ("heave_pitch_rate_coupling", "c_wq", -2.1, True),
        ("munk_moment", "c_qw", 5.9, False),
        ("munk_moment", "c_qw", -6.1, True),
    ],
)
def test_what_no_hull_makes_of_its_water_is_doubted(
    base: Explanation, effect: str, own: str, share: float, is_doubted: bool
) -> None:
    known = values_of(base)
    at_the_plane = abs(known["a1"] * known["b2"] / known["b1"])
    known |= {own: share * (known["u0"] if own == "c_wq" else at_the_plane)}
    best = explanation_with(base, frozenset({effect}), known)
    assert beyond_geometry_in(best) == [effect] * is_doubted
    verdict = verdict_on(best, leftover(), misfit(5.0), misfit(1.0))
    assert verdict == ("partly_explained" if is_doubted else "explained")
    said = remaining(verdict, best, leftover(), misfit(1.0))
    assert ("larger than on any hull" in said) == is_doubted
    beside = verdict_on(best, leftover(is_smooth=True), misfit(5.0), misfit(1.0))
    assert beside == ("unexplained" if is_doubted else "partly_explained")


@pytest.mark.parametrize(
    ("own", "value", "std", "doubted"),
    [
        ("a2", -1e-4, 0.01, "pitch damping"),
        ("a1", -1e-4, 0.01, "heave damping"),
        ("a2", -1e-4, 0.5, ""),
        ("a2", -0.01, 0.01, ""),
    ],
)
def test_a_hull_that_does_not_damp_is_doubted(
    base: Explanation, own: str, value: float, std: float, doubted: str
) -> None:
    fit = base.lean().fit
    k = fit.structure.names.index(own)
    values, information = fit.parameters.copy(), np.eye(fit.parameters.size)
    values[k], information[k, k] = value, std**-2
    names = frozenset({"munk_moment"})
    best = Explanation(names, replace(fit, parameters=values, information=information), base.bic)
    assert undamped_in(best) == [doubted.replace(" ", "_")] * bool(doubted)


@pytest.mark.parametrize(("speed", "is_doubted"), [(2.0, False), (4.0, False), (9.0, True)])
def test_waves_that_would_have_broken_are_doubted(base: Explanation, speed: float, is_doubted: bool) -> None:
    fit, names = base.fit, frozenset({"surface_waves"})
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    known |= {"wave_sine": 0.6 * speed, "wave_cosine": -0.8 * speed, "wave_period": 4.0}  # breaks at 2.7 m/s
    best = explanation_with(base, names, known)
    assert breaking_in(best) == ["surface_waves"] * is_doubted
    verdict = verdict_on(best, leftover(), misfit(5.0), misfit(1.0))
    assert verdict == ("partly_explained" if is_doubted else "explained")
    assert ("would have broken" in remaining(verdict, best, leftover(), misfit(1.0))) == is_doubted


@pytest.mark.parametrize(
    ("own", "value", "std", "doubted"),
    [
        ("c_ud", 500.0, 100.0, "speed loss"),
        ("c_ud", 500.0, 400.0, ""),
        ("c_ud", 400.0, 100.0, ""),
        ("u0", 20.0, 0.1, "forward speed"),
        ("u0", 20.0, 15.0, ""),
        ("u0", 19.0, 0.1, ""),
    ],
)
def test_a_coefficient_that_would_be_larger_than_on_any_vehicle_is_doubted(
    base: Explanation, own: str, value: float, std: float, doubted: str
) -> None:
    structure = structure_of(frozenset({"speed_loss"}))
    fit, count = base.lean().fit, len(structure.names)
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True)) | {own: value}
    values = np.array([known.get(name, 1.0) for name in structure.names])
    free = np.ones(count, dtype=bool)
    information = np.eye(count)
    information[structure.names.index(own), structure.names.index(own)] = std**-2
    white = [np.random.default_rng(0).normal(size=row.shape) for row in fit.whitened]
    found = replace(
        fit, structure=structure, parameters=values, free=free, information=information, whitened=white
    )
    best = Explanation(frozenset({"speed_loss"}), found, base.bic)
    assert beyond_bounds_in(best) == [doubted.replace(" ", "_")] * bool(doubted)
    verdict: Verdict = "partly_explained" if doubted else "explained"
    assert verdict_on(best, leftover(), misfit(5.0), misfit(1.0)) == verdict
    said = remaining(verdict, best, leftover(), misfit(1.0))
    assert (f"{doubted} would have to be larger than on any vehicle" in said) == bool(doubted)
    noise = np.array([*fit.noise[:2], 1e-6, 1e-6])  # of random forces, which lead a free run away
    rough = replace(best, fit=replace(found, noise=noise))
    said = remaining(verdict, rough, leftover(), misfit(40.0))
    assert (f"{doubted} would have to be larger than on any vehicle" in said) == bool(doubted)


@pytest.mark.parametrize(
    ("worth", "verdict"),
    [
        (FAINT_WAVES + 1.0, "partly_explained"),
        (FAINT_WAVES - 1.0, "unexplained"),
        (np.inf, "unexplained"),
    ],
)
def test_waves_that_explain_much_are_told_though_no_free_run_is_better(
    base: Explanation, worth: float, verdict: str
) -> None:
    said = verdict_on(named(base, "surface_waves"), leftover(is_smooth=True), misfit(9.0), misfit(8.0), worth)
    assert said == verdict


@pytest.mark.parametrize(("evidence", "verdict"), [(16.0, "partly_explained"), (200.0, "explained")])
def test_waves_that_are_hardly_likelier_than_none_are_doubted(
    base: Explanation, evidence: float, verdict: Verdict
) -> None:
    best = named(base, "surface_waves")
    assert verdict_on(best, leftover(), misfit(5.0), misfit(1.0), evidence) == verdict
    said = remaining(verdict, best, leftover(), misfit(4.0), evidence)
    assert ("waves are hardly likelier" in said) == (verdict == "partly_explained")


@pytest.mark.parametrize(
    ("munk", "moment", "is_by_speed", "verdict"),
    [
        (8.0, 1e-12, False, "partly_explained"),
        (8.0, 1e-12, True, "explained"),
        (8.0, 1e-4, False, "explained"),
        (1.0, 1e-12, False, "explained"),  # a Munk moment that is hardly known
    ],
)
def test_forces_that_push_a_hull_and_do_not_turn_it_are_no_sea(
    base: Explanation, munk: float, moment: float, is_by_speed: bool, verdict: Verdict
) -> None:
    best = explanation_with(base, frozenset({"munk_moment"}), values_of(base) | {"c_qw": munk})
    noise = np.array([*base.fit.noise[:2], 1e-5, moment])
    best = replace(best, fit=replace(best.fit, noise=noise))
    left = replace(leftover(), is_by_speed=is_by_speed)
    assert verdict_on(best, left, misfit(40.0), misfit(20.0)) == verdict
    said = remaining(verdict, best, left, misfit(20.0))
    assert ("do not turn it" in said) == (verdict == "partly_explained")
    assert ("astray, pitch by 4.5 times" in said) == (verdict == "explained" and not is_by_speed)
