"""The whole diagnosis: search, doubt, prove, locate."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

import numpy as np

from host.catalogue import BY_NAME
from host.diagnosis.disturbances.seas import Explained, Waves, evidence
from host.diagnosis.explain import explain
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LARGEST_SET, NAMING_MARGIN
from host.diagnosis.fits.patience import is_over, was_cut
from host.diagnosis.fits.sea_fits import again_in_waves, again_under_forces, with_regular_waves
from host.diagnosis.fits.workers import Workers, sharing
from host.diagnosis.judge import Judged, NamedEffect, horizon_of, judge
from host.diagnosis.plane_choice import Way, is_likelier, likelier_first, ways
from host.diagnosis.plane_moments import with_plane_moments
from host.diagnosis.proof.deviations import deviations
from host.diagnosis.proof.locate import Location, locate
from host.diagnosis.proof.minute import LEAST_ANGLE, minute_in, unresolved_in
from host.diagnosis.proof.scoring import Misfit, free_run_errors
from host.diagnosis.proof.unknown_force import UnknownForce, unknown_force
from host.diagnosis.proof.verdict import Verdict, remaining
from host.diagnosis.recordings.blended import with_readings_apart
from host.diagnosis.recordings.sensed import as_sensed
from host.diagnosis.recordings.spans import divide, excerpt
from host.diagnosis.recordings.usable import check_usable, noted, with_plane_told
from host.diagnosis.search.candidates import eligible
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import beside_all, in_the_valley_of, widened
from host.dynamics.equations import NAMES, Slot
from host.identification.identifiability import ambiguity, left_open
from host.noise.noise_floor import noise_floor
from host.recordings.consistency import check_signs, units_note
from host.recordings.left_out import told as spans_told
from host.recordings.outliers import without_outliers
from host.recordings.recording import Array, Recording

CUT_SHORT = "The search was ended before it had asked all that it might: --minutes lets it go on for longer."
Ranking = list[tuple[str, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What `mils diagnose` found; the fits are those over all the recordings.

    ranking  effects by the BIC each takes off alone, the best first; where they were not tried alone, those
             that are named, by what each is worth beside the others
    """

    verdict: Verdict
    recordings: list[Recording]
    floor: Array
    base: Explanation
    extended: Explanation
    base_misfit: Misfit
    extended_misfit: Misfit
    is_held_out: bool
    horizon: float | None
    effects: list[NamedEffect]
    slots: dict[Slot, float]
    location: Location
    force: UnknownForce
    ranking: Ranking
    is_ranked_alone: bool
    remaining: str
    has_sea: bool
    bic: float
    std: dict[str, float] = field(default_factory=dict)


def diagnose(
    recordings: list[Recording],
    on_progress: Callable[[str], None] = lambda _: None,
    jobs: int = 1,
    like: Explanation | None = None,
    may_be_quiet: bool = False,
    may_leave_out: bool = True,
) -> Diagnosis:
    """Finds what the paper's equations lack on these recordings of one vehicle, on `jobs` cores.

    Spikes are left out first, and rows that only blend two readings; what is smoother than sensors are gets
    their noise, and it is asked what the plane did between rows: that is no physics.

    like  an explanation of a vehicle that this one should resemble: if of many effects, it is begun with
    may_be_quiet  whether recordings that are smoother than sensors are taken as they are
    may_leave_out  whether stretches in which other physics comes and goes are left out of one recording

    Raises RecordingError with one line where a recording is too short, or pitch or depth never changes, is
    hardly ever read or has the wrong sign.
    """
    check_usable(recordings)
    on_progress("base model")
    seen = without_outliers(with_plane_told(recordings))
    check_signs(seen)
    seen = noted(with_readings_apart(seen), units_note(seen))
    seen = seen if may_be_quiet else as_sensed(seen)
    with sharing(jobs):
        seen = with_plane_moments(seen, on_progress)
        first, *others = likelier_first(ways(seen), on_progress, jobs, may_leave_out)
        return _diagnosed(first, others, on_progress, jobs, like, [])


def _diagnosed(
    way: Way,
    others: list[Way],
    on_progress: Callable[[str], None],
    jobs: int,
    like: Explanation | None,
    ranking: Ranking,
    is_second: bool = False,
) -> Diagnosis:
    """The diagnosis with the plane taken so, unless what is found speaks for another way.

    Then what was found so is begun with, and `ranking` is known from it.
    """
    recordings, fitter = way.recordings, way.fitter
    floor, spans = noise_floor(recordings), divide(recordings)
    is_part = excerpt(spans.teaching) is not spans.teaching
    if is_part:
        on_progress("an excerpt")
    with Workers(fitter, jobs) as workers:
        explained = explain(fitter, workers, on_progress, way, like=like, is_second=is_second)
        again = next((way for way in others if not is_over() and _is_likelier(way, explained)), None)
        if again is None and not is_part:
            judged = judge(explained, spans, floor, on_progress)
    if again is not None:
        on_progress("the plane between rows")
        second = _diagnosed(again, [], on_progress, jobs, explained.best, _ranking(explained.search), True)
        if is_part or not _is_no_better(second, explained):
            return second
        with Workers(fitter, jobs) as workers:
            explained.search.workers = workers
            judged = judge(explained, spans, floor, on_progress)
    if is_part:
        on_progress("the whole")
        fitter = Fitter(spans.teaching)
        with Workers(fitter, jobs) as workers:
            explained = explain(fitter, workers, on_progress, way, explained)
            judged = judge(explained, spans, floor, on_progress)
    best, search, left, waves, _ = explained
    on_progress("final fit on everything")
    base = _refitted(search.base, recordings)
    found = extended = _refitted(best if waves is None else waves.fitted, recordings)
    whole = Fitter(recordings, known=found)
    complete = beside_all(whole, found)
    if complete is not None:
        found = extended = in_the_valley_of(whole, complete, found)
    # Of a short recording they take less time than new processes.
    with Workers(whole, jobs if is_part else 1) as workers:
        std = deviations(whole, found, workers)
    if complete is not None:
        std = widened(std, found, complete)
    if waves is not None:
        extended = with_regular_waves(whole, found)
        std = deviations(whole, extended) | std
    longest = max(recordings, key=lambda recording: recording.duration)
    values = dict(zip(extended.fit.structure.names, extended.fit.parameters.tolist(), strict=True))
    effects = [_with_coefficients(effect, values, std) for effect in judged.effects]
    errors = free_run_errors(base, longest)
    alone = max(_ranking(search), ranking, key=len)
    is_ranked_alone = len(alone) >= len(effects)
    told = remaining(judged.verdict, best, left, judged.after, evidence(waves))
    stds = np.array([std.get(name, 0.0) for name in NAMES])
    hardly = [left_open(found.fit.parameters, stds)] * (judged.verdict == "no_mismatch")
    return Diagnosis(
        verdict=_on_all(judged, way),
        recordings=recordings,
        floor=floor,
        base=base,
        extended=extended,
        base_misfit=judged.before,
        extended_misfit=judged.after,
        is_held_out=bool(spans.judging),
        horizon=horizon_of(left),
        effects=effects,
        slots=judged.slots,
        location=locate(longest, errors, floor, values["u0"]),
        force=unknown_force(longest, {n: values[n] for n in NAMES}, floor, fitter.accelerations),
        ranking=alone if is_ranked_alone else [(effect.name, effect.delta_bic) for effect in effects],
        is_ranked_alone=is_ranked_alone,
        remaining=" ".join(
            filter(
                None,
                [
                    _apart(way),
                    told,
                    CUT_SHORT * was_cut(),
                    *_unnamed(best, waves, recordings, judged.unproven),
                    *(_other_answers(found) or hardly),
                ],
            )
        ),
        has_sea=best.fit.has_process_noise,
        bic=best.bic,
        std=std,
    )


def _apart(way: Way) -> str:
    """Where nothing of this holds."""
    if not way.apart:
        return ""
    return (
        f"From {spans_told(way.apart)} other physics acts that comes and goes (turns or another thrust, "
        "say): that was left out, and what follows is of the rest."
    )


def _on_all(judged: Judged, way: Way) -> Verdict:
    """The verdict on all of a recording of which stretches were left out, or a plane known in part.

    Or where many effects leave nothing before the search had asked all: with time fewer may.
    """
    is_of_part = way.apart or way.is_astray or (was_cut() and len(judged.effects) > LARGEST_SET)
    is_less = is_of_part and judged.verdict in ("explained", "no_mismatch")
    return "partly_explained" if is_less else judged.verdict


def _is_likelier(other: Way, explained: Explained) -> bool:
    in_own_waves = None if explained.waves is None else explained.waves.fitted
    return is_likelier(other, explained.search, explained.best, in_own_waves)


def _is_no_better(second: Diagnosis, first: Explained) -> bool:
    """Whether what promised more with the plane taken another way came to no more; not told among forces."""
    if second.has_sea or first.best.fit.has_process_noise:
        return False
    return second.bic > first.best.bic - NAMING_MARGIN


def _with_coefficients(effect: NamedEffect, values: dict[str, float], std: dict[str, float]) -> NamedEffect:
    return NamedEffect(
        name=effect.name,
        coefficients={p.name: (values[p.name], std[p.name], p.unit) for p in BY_NAME[effect.name].parameters},
        delta_bic=effect.delta_bic,
        heldout_gain=effect.heldout_gain,
        twins=effect.twins,
    )


def _refitted(explanation: Explanation, recordings: list[Recording]) -> Explanation:
    """The set fitted to all stretches, teaching and judging, for the model that is handed back."""
    fitter = Fitter(recordings, known=explanation)
    if explanation.fit.waves.any():
        return again_in_waves(fitter, explanation)
    if explanation.fit.has_process_noise:
        return again_under_forces(fitter, explanation)
    return fitter.across(fitter.refitted(explanation))


def _ranking(search: Search) -> Ranking:
    """What each effect alone improves the information criterion by, best first."""
    alone = [(effect.name, search.gain_alone(effect.name)) for effect in eligible(search)]
    return sorted((pair for pair in alone if pair[1] > -inf), key=lambda pair: -pair[1])


def _unnamed(
    best: Explanation, waves: Waves | None, recordings: list[Recording], unproven: Names = frozenset()
) -> list[str]:
    """Of what is in the model and not named."""
    angle, theirs = np.rad2deg(LEAST_ANGLE), waves.theirs if waves else frozenset()
    reasons = {
        f"worth less than {angle:.1g} deg of plane: too little to be named": minute_in(best),
        "no larger than what waves themselves do on the mean: it is not named": theirs - minute_in(best),
        "too short to be told from how the plane moved between rows: it is not named": unresolved_in(
            best, recordings
        ),
        "without which stretches that it never saw are foretold better: not named": unproven,
    }
    return [
        f"The model holds {' and '.join(_with_article(name) for name in sorted(names))} {reason}."
        for reason, names in reasons.items()
        if names
    ]


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name.replace('_', ' ')}"


def _other_answers(extended: Explanation) -> list[str]:
    """Of the same physics with other coefficients, which the deviations include."""
    fit = extended.fit
    return [ambiguity(fit.parameters, rival.parameters) for rival in fit.rivals]
