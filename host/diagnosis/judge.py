"""What held-out stretches say of an explanation: its score, what is named and where it acts, the verdict."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from host.catalogue import UNKNOWN, named
from host.diagnosis.disturbances.seas import Explained, evidence
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.leftover import Leftover
from host.diagnosis.fits.sea_fits import WAVES
from host.diagnosis.proof.minute import minute_in, unresolved_in
from host.diagnosis.proof.scoring import Misfit, foretells, misfit
from host.diagnosis.proof.slight import is_slight
from host.diagnosis.proof.unproven import unproven_in
from host.diagnosis.proof.verdict import Verdict, verdict_on
from host.diagnosis.recordings.spans import Spans, clear_of
from host.diagnosis.search.exchange import twins
from host.diagnosis.search.search import Search
from host.diagnosis.search.unknown_physics import known_in, without_unknown
from host.dynamics.equations import Slot
from host.recordings.recording import Array

HORIZON = 5.0  # s
MOST_WORTH = 1e9  # of BIC: without some effects the equations run away
SLOTS: tuple[Slot, ...] = ("heave", "pitch", "kinematics", "surge", "actuator", "sensor", "environment")


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedEffect:
    """One effect of the answer.

    delta_bic     what the information criterion loses without it
    heldout_gain  share of the held-out squared error that returns without it
    twins         effects that would explain the recording as well in its place
    """

    name: str
    delta_bic: float
    heldout_gain: float = 0.0
    coefficients: dict[str, tuple[float, float, str]] = field(default_factory=dict)
    twins: list[str] = field(default_factory=list)


class Judged(NamedTuple):
    """What the held-out spans say of the base and of the model, what is named, where, and the verdict.

    unproven  what is not named as these spans speak against it
    """

    before: Misfit
    after: Misfit
    effects: list[NamedEffect]
    unproven: Names
    verdict: Verdict
    slots: dict[Slot, float]


def judge(explained: Explained, spans: Spans, floor: Array, on_progress: Callable[[str], None]) -> Judged:
    """Scores on held-out spans; what each effect is worth, and the slots."""
    best, search, left, waves, _ = explained
    model = best if waves is None else waves.model
    on_progress("held-out check")
    fit = best.fit
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    spans = clear_of(spans, [known[name] for name in fit.structure.moments])
    horizon = horizon_of(left)
    # The very waves that were met are chance, and the regular one in their place may come out of step.
    foretelling = best if waves is None else waves.fitted
    before, after = (misfit(one, spans, floor, horizon) for one in (search.base, foretelling))
    late = unresolved_in(best, search.fitter.recordings)
    unnamed = minute_in(best) | late | (frozenset() if waves is None else waves.theirs)
    effects = [one for one in _named(search, best, spans, floor, after, horizon) if one.name not in unnamed]
    if waves is not None and WAVES not in best.names:
        effects.append(NamedEffect(name=WAVES, delta_bic=waves.delta_bic))
    effects.sort(key=lambda effect: -effect.delta_bic)
    is_astray = best.fit.has_process_noise and waves is None and horizon is None and after.chi2 > before.chi2
    is_told = not is_astray or foretells(search.base, best, spans, floor, HORIZON)
    lean = without_unknown(search, best)
    bare = after if lean is best else misfit(lean, spans, floor, horizon)
    is_trace = waves is None and is_slight(lean, before, bare)
    verdict = verdict_on(model, left, before, after, evidence(waves), is_told, is_trace, late)
    unproven = frozenset[str]()
    is_judged = spans.judging and (horizon is not None or not best.fit.has_process_noise)
    if is_judged and not left.is_nothing and verdict != "explained":
        unproven = unproven_in({effect.name: effect.heldout_gain for effect in effects})
        effects = [effect for effect in effects if effect.name not in unproven]
        verdict = verdict if effects else "unexplained"
    return Judged(before, after, effects, unproven, verdict, _slots(search, best, effects, verdict))


def horizon_of(left: Leftover) -> float | None:
    """s, how far ahead is foretold where forces too weak for a sea lead any free run away; else None."""
    return HORIZON if left.is_of_what_drives or left.is_no_sea else None


def _named(
    search: Search, best: Explanation, spans: Spans, floor: Array, after: Misfit, horizon: float | None
) -> list[NamedEffect]:
    names = known_in(best)
    return [
        NamedEffect(
            name=name,
            delta_bic=min(without.bic - best.bic, MOST_WORTH),
            heldout_gain=1.0 - after.chi2 / misfit(without, spans, floor, horizon).chi2,
            twins=twins(search, best, name),
        )
        for name, without in zip(names, search.each_without(best, names), strict=True)
    ]


def _slots(
    search: Search, best: Explanation, effects: list[NamedEffect], verdict: Verdict
) -> dict[Slot, float]:
    """Shares that add up to 1: of the evidence of what was found, else of what each slot could gain."""
    shares: dict[Slot, float] = dict.fromkeys(SLOTS, 0.0)
    found = {name: search.without(best, name).bic - best.bic for name in best.names & UNKNOWN.keys()}
    found |= {effect.name: effect.delta_bic for effect in effects}
    if found:
        for name, worth in found.items():
            shares[named(name).slot] += float(np.clip(worth, 0.0, MOST_WORTH))
    elif verdict != "no_mismatch":
        for name, gain in search.gains(best).items():
            slot = named(name).slot
            shares[slot] = max(shares[slot], gain if np.isfinite(gain) else 0.0)
    total = sum(shares.values())
    return {slot: share / total for slot, share in shares.items()} if total > 0.0 else shares
