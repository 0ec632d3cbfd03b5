"""Coefficients of which a recording tells nothing are not charged, and known no better than their bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import named
from host.diagnosis.fits.charges import FOREIGN, HARDLY_CHANGES, RARITY
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.proof.deviations import deviations, interval
from host.likelihood.fit import Fit

STALL = frozenset({"rudder_stall"})


def blind_to(fit: Fit, *names: str) -> Fit:
    seen = ~np.isin(fit.structure.names, names)
    return replace(fit, information=fit.information * np.outer(seen, seen))


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    return Fitter([hidden_dive(duration=60.0)])


def test_what_makes_no_difference_is_charged_only_where_all_of_an_effect_does_not(fitter: Fitter) -> None:
    fit = replace(fitter.grown(fitter.base, "rudder_stall", []).fit, information=np.eye(11))
    whole = fitter.bic(fit, STALL)
    less = fitter.bic(blind_to(fit, "stall_share"), STALL)
    assert whole - less == pytest.approx(np.log(fit.samples))
    assert fitter.bic(blind_to(fit, "stall_angle", "stall_loss", "stall_share"), STALL) == whole


def test_what_is_not_told_deviates_as_if_drawn_between_its_bounds(fitter: Fitter) -> None:
    found = fitter.grown(fitter.base, "rudder_stall", [])
    fit = blind_to(found.fit, "stall_share")
    std = deviations(fitter, Explanation(STALL, fit, found.bic))
    assert std["stall_share"] == pytest.approx(1.0 / np.sqrt(12.0))


def test_an_interval_ends_at_the_bounds_of_its_coefficient() -> None:
    assert interval(named("rudder_stall"), "stall_share", 0.6, 0.289) == pytest.approx(
        (0.0336, 1.0), abs=1e-3
    )
    assert interval(named("trim_moment"), "c_q0", 0.0, 1.0) == pytest.approx((-1.96, 1.96))


def test_a_form_of_unknown_physics_is_charged_beyond_its_coefficients(fitter: Fitter) -> None:
    entry, form = (frozenset({name}) for name in ("heave_quadratic_drag", "unknown_moment_w_w"))
    fit = fitter.grown(fitter.base, "heave_quadratic_drag", []).fit
    assert fitter.free_parameters(entry) == fitter.free_parameters(form)
    assert fitter.bic(fit, form) - fitter.bic(fit, entry) == pytest.approx(FOREIGN + RARITY)


@pytest.mark.parametrize(("moment", "is_charged"), [(1.0, True), (30.0, False), (58.9, True)])
def test_a_change_as_the_recording_begins_or_ends_is_charged(
    moment: float, is_charged: bool, fitter: Fitter
) -> None:
    change = frozenset({"ballast_change"})
    fit = fitter.grown(fitter.base, "ballast_change", []).fit
    at = fit.structure.names.index("ballast_time")

    def changed(time: float) -> Fit:
        return replace(fit, parameters=np.where(np.arange(fit.parameters.size) == at, time, fit.parameters))

    charge = fitter.bic(changed(moment), change) - fitter.bic(changed(20.0), change)
    assert charge == pytest.approx(HARDLY_CHANGES * is_charged)
