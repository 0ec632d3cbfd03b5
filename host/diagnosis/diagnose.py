"""The whole diagnosis: search, doubt, prove, locate."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from host.catalogue import BY_NAME, CATALOGUE
from host.diagnosis.locate import Location, locate
from host.diagnosis.noise_floor import noise_floor
from host.diagnosis.scoring import Misfit, free_run_errors, misfit
from host.diagnosis.search import NAMING_MARGIN, Explanation, Search
from host.diagnosis.spans import divide
from host.diagnosis.unknown_force import UnknownForce, unknown_force
from host.equations import NAMES, Slot
from host.filter_error import filter_error
from host.fit import Fit
from host.propagate import inputs_of
from host.recording import Array, Recording
from host.uncertainty import covariance
from host.whiteness import is_white

Verdict = Literal["no_mismatch", "explained", "partly_explained", "unexplained"]
SLOTS: tuple[Slot, ...] = ("heave", "pitch", "kinematics", "surge", "actuator", "sensor", "environment")
NOTHING_LEFT = 1.3  # chi2 of a free run that is as good as the sensors, with room for their estimated noise
TWIN_MARGIN = 8.0  # of BIC: explanations closer than this cannot be told apart


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedEffect:
    """One effect of the answer.

    delta_bic     what the information criterion loses without it
    heldout_gain  share of the held-out squared error that returns without it
    twins         effects that would explain the recording as well in its place
    """

    name: str
    coefficients: dict[str, tuple[float, float, str]]
    delta_bic: float
    heldout_gain: float
    twins: list[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What `mils diagnose` found; the fits are those over all the recordings."""

    verdict: Verdict
    recordings: list[Recording]
    floor: Array
    base: Explanation
    extended: Explanation
    base_misfit: Misfit
    extended_misfit: Misfit
    is_held_out: bool
    effects: list[NamedEffect]
    slots: dict[Slot, float]
    location: Location
    force: UnknownForce
    ranking: list[tuple[str, float]]
    remaining: str
    has_sea: bool
    std: dict[str, float] = field(default_factory=dict)


def diagnose(recordings: list[Recording], on_progress: Callable[[str], None] = lambda _: None) -> Diagnosis:
    """Finds what the paper's equations lack on these recordings of one vehicle."""
    floor = noise_floor(recordings)
    spans = divide(recordings)
    search = Search(spans.teaching, on_progress)
    search.run()
    on_progress("doubting")
    best, has_sea = _without_sea(search, search.simplest())
    on_progress("held-out check")
    judging = spans.judging or spans.teaching
    before, after = misfit(search.base, judging, floor), misfit(best, judging, floor)
    on_progress("twins")
    effects = [_named(search, best, name, judging, floor, after) for name in best.names]
    effects.sort(key=lambda effect: -effect.delta_bic)
    on_progress("final fit on everything")
    base, extended = _refitted(search.base, recordings, has_sea), _refitted(best, recordings, has_sea)
    deviations = np.sqrt(np.diag(covariance(extended.fit)))
    std = dict(zip(extended.fit.structure.names, deviations.tolist(), strict=True))
    values = dict(zip(extended.fit.structure.names, extended.fit.parameters.tolist(), strict=True))
    effects = [_with_coefficients(effect, values, std) for effect in effects]
    longest = max(recordings, key=lambda recording: recording.duration)
    errors = free_run_errors(base, longest)
    verdict = _verdict(best, floor, before, after, has_sea)
    return Diagnosis(
        verdict=verdict,
        recordings=recordings,
        floor=floor,
        base=base,
        extended=extended,
        base_misfit=before,
        extended_misfit=after,
        is_held_out=bool(spans.judging),
        effects=effects,
        slots=_slots(search, best, effects, verdict),
        location=locate(longest, errors, floor, values["u0"]),
        force=unknown_force(longest, {n: values[n] for n in NAMES}, floor, search.accelerations),
        ranking=_ranking(search),
        remaining=_remaining(verdict, best, after, has_sea),
        has_sea=has_sea,
        std=std,
    )


def _without_sea(search: Search, best: Explanation) -> tuple[Explanation, bool]:
    """Where the residuals stay coloured, members must pay under a likelihood that knows of random forces.

    White-noise likelihood counts every coloured sample as new evidence; the filter's does not.
    """
    if all(is_white(e) for e in best.fit.whitened):
        return best, False
    inputs = [inputs_of(recording, best.fit.structure) for recording in search.recordings]
    filtered = filter_error(best.fit, inputs)
    if filtered.log_likelihood - best.fit.log_likelihood < np.log(best.fit.samples):
        return best, False
    if filtered.noise[2] + filtered.noise[3] <= 0.0:
        return best, False
    kept = best
    for name in sorted(best.names):
        smaller = search.without(kept, name)
        fewer = [inputs_of(recording, smaller.fit.structure) for recording in search.recordings]
        rival = filter_error(smaller.fit, fewer)
        saved = search.free_parameters(kept.names) - search.free_parameters(smaller.names)
        loss = 2.0 * (filtered.log_likelihood - rival.log_likelihood) - saved * np.log(best.fit.samples)
        if loss < NAMING_MARGIN:
            kept, filtered = smaller, rival
    return kept, True


def _named(
    search: Search, best: Explanation, name: str, judging: list[Recording], floor: Array, after: Misfit
) -> NamedEffect:
    without = search.polished(search.without(best, name))
    worse = misfit(without, judging, floor)
    likely = search.gains(without)
    own = without.bic - best.bic
    candidates = sorted(
        (other for other in likely if other not in best.names and likely[other] > 0.5 * own),
        key=lambda other: -likely[other],
    )
    twins = []
    for other in candidates[:4]:
        swapped = search.polished(search.extended(without, BY_NAME[other]))
        if swapped.bic - best.bic < TWIN_MARGIN:
            twins.append(other)
    return NamedEffect(
        name=name,
        coefficients={},
        delta_bic=own,
        heldout_gain=1.0 - after.chi2 / worse.chi2,
        twins=twins,
    )


def _with_coefficients(effect: NamedEffect, values: dict[str, float], std: dict[str, float]) -> NamedEffect:
    return NamedEffect(
        name=effect.name,
        coefficients={p.name: (values[p.name], std[p.name], p.unit) for p in BY_NAME[effect.name].parameters},
        delta_bic=effect.delta_bic,
        heldout_gain=effect.heldout_gain,
        twins=effect.twins,
    )


def _refitted(explanation: Explanation, recordings: list[Recording], has_sea: bool) -> Explanation:
    """The set fitted to all stretches, teaching and judging, for the model that is handed back."""
    search = Search(recordings, known=explanation)
    again = search.refitted(explanation)
    if not has_sea:
        return again
    inputs = [inputs_of(recording, again.fit.structure) for recording in recordings]
    fit: Fit = filter_error(again.fit, inputs)
    return Explanation(again.names, fit, again.bic)


def _verdict(best: Explanation, floor: Array, before: Misfit, after: Misfit, has_sea: bool) -> Verdict:
    taught = best.fit.noise[:2] / floor
    at_floor = max(taught) < NOTHING_LEFT and max(after.chi2_depth, after.chi2_pitch) < 2.0 * NOTHING_LEFT
    if not best.names:
        return "no_mismatch" if at_floor or has_sea else "unexplained"
    if at_floor or (has_sea and after.chi2 < 0.5 * before.chi2):
        return "explained"
    return "partly_explained" if after.chi2 < 0.7 * before.chi2 else "unexplained"


def _slots(
    search: Search, best: Explanation, effects: list[NamedEffect], verdict: Verdict
) -> dict[Slot, float]:
    """Shares that add up to 1: of the evidence of what was named, else of what each slot could gain."""
    shares: dict[Slot, float] = dict.fromkeys(SLOTS, 0.0)
    if effects:
        for effect in effects:
            shares[BY_NAME[effect.name].slot] += max(effect.delta_bic, 0.0)
    elif verdict != "no_mismatch":
        for name, gain in search.gains(best).items():
            slot = BY_NAME[name].slot
            shares[slot] = max(shares[slot], gain if np.isfinite(gain) else 0.0)
    total = sum(shares.values())
    return {slot: share / total for slot, share in shares.items()} if total > 0.0 else shares


def _ranking(search: Search) -> list[tuple[str, float]]:
    """What each effect alone improves the information criterion by, best first."""
    alone = [
        (effect.name, search.base.bic - search.tried[frozenset({effect.name})].bic)
        for effect in CATALOGUE
        if frozenset({effect.name}) in search.tried
    ]
    return sorted(alone, key=lambda pair: -pair[1])


def _remaining(verdict: Verdict, best: Explanation, after: Misfit, has_sea: bool) -> str:
    sea = (
        " Random forces act as well (waves, current, turbulence); they are part of the noise model." * has_sea
    )
    if verdict == "no_mismatch":
        return "Nothing is missing from the base model on this recording." + sea
    if verdict == "explained":
        return "What is left is as small as the sensors' own noise." + sea if not sea else sea.strip()
    worst = "depth" if after.chi2_depth > after.chi2_pitch else "pitch"
    left = max(after.chi2_depth, after.chi2_pitch)
    if best.names:
        return f"Most is explained, but {worst} is still off by {left**0.5:.1f} times its sensor noise." + sea
    return (
        f"None of the physics in the catalogue explains this: {worst} is off by {left**0.5:.1f} times "
        "its sensor noise." + sea
    )
